"""Short ways to fly the entry model: inputs and results by column name, in declared units."""

from types import SimpleNamespace

import numpy as np

from campaigns.reentry.airframe import airframe_of
from campaigns.reentry.entry_state import entry_of, world_of
from campaigns.reentry.guidance.plan import Plan, planned_entry, plans_of
from mc_engine.model import Refusals
from tests.campaigns.model_flights import ModelFlights

FLIGHTS = ModelFlights("campaigns.reentry")
MODEL, NOMINAL = FLIGHTS.model, FLIGHTS.nominal
fly_cases, fly_one, history = FLIGHTS.cases, FLIGHTS.one, FLIGHTS.history
MU, RADIUS = 3.986004418e14, 6_378_137.0
G0 = 9.80665
EXACT = 1e-12  # tolerance of an integration step where the flight must be as good as its closed form

# a spherical Earth that does not turn, motion in the plane of the equator
PLANAR = {"shape": "sphere", "gravity": "point", "rotating": False, "speed_frame": "relative", "planar": True}
# the same with the textbook atmosphere, and a flat Earth without gravity
TEXTBOOK = PLANAR | {"atmosphere": "exponential"}
IDEAL = TEXTBOOK | {"shape": "flat", "gravity": "none"}


def ballistic(b):
    """A vehicle without lift of ballistic coefficient b [kg/m^2]."""
    return {"mass_kg": b, "reference_area_m2": 1.0, "drag_coefficient": 1.0, "lift_coefficient": 0.0}


def gliding(lift_area, lift_to_drag):
    """A vehicle with its lift up; lift_area is C_L A / m [m^2/kg]."""
    return {
        "mass_kg": 1.0,
        "reference_area_m2": lift_area,
        "lift_coefficient": 1.0,
        "drag_coefficient": 1.0 / lift_to_drag,
        "bank_deg": 0.0,
    }


def assert_same_bits_alone(together, picked, width=8, each=(), **inputs):
    """The picked cases have the bits of their rows among the others where each flies alone.

    each : input -> a value for every case;  inputs : what all cases share.
    """
    for case in picked:
        own = {name: values[case] for name, values in dict(each).items()}
        alone = fly_cases(width=width, ids=np.array([case]), **inputs, **own)
        for name, column in together.items():
            assert column[case : case + 1].tolist() == alone[name].tolist() or np.isnan(column[case]), (case, name)


def plan_of(**inputs):
    """The plan of one case, as plain numbers."""
    inputs = NOMINAL | inputs
    i = SimpleNamespace(
        **{parameter.symbol: np.array([inputs[parameter.name] * parameter.si_factor]) for parameter in MODEL.parameters}
    )
    o = SimpleNamespace(
        **{setting.symbol: np.array([setting.code(inputs[setting.name])]) for setting in MODEL.settings}
    )
    refusals = Refusals.none(1)
    world = world_of(i, o)
    planned = planned_entry(o, world, entry_of(i, o, world, refusals), refusals)
    return Plan(*(float(row[0]) for row in plans_of(i, o, world, planned, airframe_of(i, o, refusals))))


def circular_speed(altitude_km):
    """Circular speed [m/s] over the sphere."""
    return np.sqrt(MU / (RADIUS + 1e3 * np.asarray(altitude_km)))
