"""The plan: the entry, vehicle and bank that a guidance law's reference path is flown with.  NumPy, SI.

A plan knows no errors and no factors.  By default it is each case's own entry, vehicle and bank, so that cases which
differ in their errors alone have one plan; with plan = "given" it is that of the settings plan_..., one for all.
"""

from collections import namedtuple
from types import SimpleNamespace

import numpy as np

from campaigns.reentry.airframe import airframe_of
from campaigns.reentry.entry_state import Entry, World, entry_of, world_of
from campaigns.reentry.inputs import GUIDANCE, PLAN_IS_GIVEN, Inputs
from campaigns.reentry.vehicles import Vehicle
from mc_engine.model import Parameter, Refusals

# laws that read the same stored gains: with range, and without
_SAME_GAINS = {"law2r": "law1", "law3r": "law1", "law3": "law2"}
_LAW = np.array([float(GUIDANCE.index(_SAME_GAINS.get(law, law))) for law in GUIDANCE])
# law, planet, shape, gravity, rotating, atmosphere, vehicle: codes of settings;  ground : equatorial radius
# radius, latitude, speed, path, heading : of entry, over ground;  drag : area over mass [m^2/kg]
# share : of the lift in the vertical plane;  end : altitude at which the reference path ends
Plan = namedtuple(
    "Plan",
    "law planet shape gravity rotating atmosphere vehicle ground "
    "radius latitude speed path heading drag lift_to_drag trim share end",
)
_OF_ENTRY = ("place", "ahead", "right", "heading", "radius", "latitude", "planned_speed", "planned_path")


def planned_entry(settings: SimpleNamespace, world: World, entry: Entry, refusals: Refusals) -> Entry:
    """The entry that distances count from: each case's own without errors, or that of plan_...

    Of the cases' own, only what _OF_ENTRY names is exchanged.
    """
    given = settings.plan == PLAN_IS_GIVEN
    if not given.any():
        return entry
    plain = SimpleNamespace(arrival=np.zeros_like(world.mu), speed_frame=settings.speed_frame)
    plan = entry_of(_inputs_of_plan(settings), plain, world, refusals)
    return entry._replace(**{name: np.where(given, getattr(plan, name), getattr(entry, name)) for name in _OF_ENTRY})


def _inputs_of_plan(settings: SimpleNamespace) -> SimpleNamespace:
    """The entry inputs that plan_... stand for, without errors; float64[n] by symbol."""
    names = ("speed", "flight_path_angle", "heading", "latitude", "longitude", "altitude", "radius")
    given = {f"entry_{name}": getattr(settings, f"plan_{name}") for name in names}
    zero = np.zeros_like(given["entry_speed"])
    errors = {f"entry_{name}_error": zero for name in names if name != "radius"}
    return SimpleNamespace(**given, **errors, excess_speed=zero, vacuum_periapsis=zero)


def plans_of(i: SimpleNamespace, settings: SimpleNamespace, world: World, planned: Entry, airframe: Vehicle) -> Plan:
    """The plan of each case: a `Plan` of float64[n]."""
    given = settings.plan == PLAN_IS_GIVEN
    numbers = given & (settings.vehicle < 0.5)  # one of vehicles.py brings its own
    drag = airframe.reference_area * airframe.drag_coefficient / airframe.mass
    return Plan(
        law=_LAW[settings.guidance.astype(int)],
        planet=settings.planet,
        shape=settings.shape,
        gravity=settings.gravity,
        rotating=settings.rotating,
        atmosphere=settings.atmosphere,
        vehicle=settings.vehicle,
        ground=world.radius,
        radius=planned.radius,
        latitude=planned.latitude,
        speed=planned.planned_speed,
        path=planned.planned_path,
        heading=planned.heading,
        drag=np.where(numbers, 1.0 / settings.plan_ballistic_coefficient, drag),
        lift_to_drag=np.where(
            numbers, settings.plan_lift_to_drag, airframe.lift_coefficient / airframe.drag_coefficient
        ),
        trim=np.where(numbers, settings.plan_trim_angle, airframe.trim_angle),
        share=np.cos(np.where(given, settings.plan_bank, i.bank)),
        end=settings.plan_stop_altitude,
    )


def default_plan() -> Plan:
    """The plan of the model's default inputs, as plain numbers, SI."""
    i = SimpleNamespace()
    settings = SimpleNamespace()
    for item in Inputs.declared:
        if isinstance(item, Parameter):
            setattr(i, item.symbol, np.array([item.default * item.si_factor]))
        else:
            setattr(settings, item.symbol, np.array([item.code(item.default)]))
    refusals = Refusals.none(1)
    world = world_of(i, settings)
    entry = entry_of(i, settings, world, refusals)
    return Plan(*(float(row[0]) for row in plans_of(i, settings, world, entry, airframe_of(i, settings, refusals))))
