"""The servicing model as the engine sees it: inputs, what each case starts from, tables, and the MODEL record."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from campaigns.geo_servicing import corrections, dynamics, figures, navigation, outcome, plan_table
from campaigns.geo_servicing.dynamics import INSPECTION, PHASING, R0
from campaigns.geo_servicing.first_state import first_states
from campaigns.geo_servicing.inputs import GEOMETRIES, NAVIGATION, PARAMETERS, SETTINGS
from campaigns.geo_servicing.phasing_plan import plan_of
from mc_engine.errors import ModelError
from mc_engine.model import AdaptiveStep, Event, Field, Model, Refusals, kept_design
from mc_engine.physics.constants import STANDARD_GRAVITY
from mc_engine.physics.geopotential import COLUMNS, harmonics_rows, harmonics_table
from mc_engine.physics.sun_moon import COLUMNS as SUN_MOON
from mc_engine.physics.sun_moon import SPACING, ephemeris_table, node_before, sidereal_angle
from mc_engine.studies.published import read_published

SOURCE = (
    "Hoang Vu Tan, Development of motion control algorithms for a spacecraft of a geostationary communication "
    "satellite servicing system (in Russian), Candidate of Technical Sciences dissertation, Moscow Aviation Institute, "
    "Moscow, 2021"
)
STATES = (
    *(Field(f"{axis}_m", "m", f"place of the servicing module, {axis}") for axis in "xyz"),
    *(Field(f"v{axis}_m_s", "m/s", f"velocity of the servicing module, {axis}") for axis in "xyz"),
    Field("mass_left_kg", "kg", "mass of the servicing module"),
    *(Field(f"target_{axis}_m", "m", f"place of the target module, {axis}") for axis in "xyz"),
    *(Field(f"target_v{axis}_m_s", "m/s", f"velocity of the target module, {axis}") for axis in "xyz"),
    Field("longitude_sum_s", "s", "integral of the longitude deviation, in radians"),
)
_DAY = 86_400.0
PERFECT = float(NAVIGATION.index("perfect"))
BEHIND, AROUND = float(GEOMETRIES.index("behind")), float(GEOMETRIES.index("around"))


def prepare(inputs: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Kernel parameters of each case.

    inputs : float64[n] by symbol, SI;  settings : codes, float64[n], by symbol.  Refused cases join `refusals`.
    """
    i, o = inputs, settings
    epoch = o.epoch_utc + i.epoch_error / _DAY
    sidereal = sidereal_angle(epoch)
    two = o.phase == INSPECTION
    refusals.add(o.gravity_order > o.gravity_degree, "gravity_order is above gravity_degree")
    refusals.add(o.gravity_degree == 1.0, "the geopotential has no harmonics of degree 1; take 0, or 2 and above")
    mass = o.mass + i.mass_error
    refusals.add(mass <= 0.0, "mass_kg and mass_error_kg leave no mass")
    light = o.reflectivity * i.reflectivity_factor * o.area * i.area_factor
    rows = first_states(i, o, sidereal, refusals, two)
    rows |= {
        "mass": mass,
        "thrust": o.thrust,
        "exhaust": o.isp * STANDARD_GRAVITY,
        "light": light,
        "target_light": light / mass * i.target_area_to_mass_factor,
        "sidereal": sidereal,
        "aim": sidereal + o.target_longitude,
        "thrust_noise": i.thrust_noise,
        "pointing_noise": i.pointing_noise,
        # in the inspection both craft's fixes count, in the phasing there is one
        "nav_position": np.hypot(i.nav_position, np.where(two, i.target_nav_position, 0.0)),
        "nav_velocity": np.hypot(i.nav_velocity, np.where(two, i.target_nav_velocity, 0.0)),
    }
    for k in range(1, dynamics.BURNS + 1):
        rows[f"thrust_{k}"] = i.thrust_error + getattr(i, f"burn_{k}_thrust_error")
        rows[f"normal_{k}"] = i.out_of_plane + getattr(i, f"burn_{k}_out_of_plane")
        rows[f"radial_{k}"] = i.radial + getattr(i, f"burn_{k}_radial")
    return rows | _inspection_rows(i, o) | _sun_moon_rows(epoch, o)


def _inspection_rows(i: SimpleNamespace, o: SimpleNamespace) -> dict[str, np.ndarray]:
    """The law's parameters, SI; `around` is the difference of eccentricities that a fly-around keeps.

    The relative ellipse has the half axes R0 e outward and 2 R0 e ahead: it is between the ranges wanted if e is
    between low/R0 and high/(2 R0), and in the middle of that here.
    """
    middle = 0.5 * (i.around_low / R0 + i.around_high / (2.0 * R0))
    side = np.where(o.geometry == AROUND, 0.0, np.where(o.geometry == BEHIND, -1.0, 1.0))
    return {
        "chi1": i.chi1,
        "chi2": i.chi2,
        "weight": i.control_weight,
        "nominal": side * i.standoff,
        "around": np.where(o.geometry == AROUND, middle, 0.0),
        "coast": i.coast_revolutions,
    }


def _sun_moon_rows(epoch: np.ndarray, o: SimpleNamespace) -> dict[str, np.ndarray]:
    """The nodes that the chunk's flights need, where each case finds its first, and the time [s] since that."""
    number, time = node_before(epoch)
    # from the node before the start to two behind the end: the cubic takes one, a look past the last step another
    nodes = np.ceil((o.duration / _DAY) / SPACING) + 3.0
    nodes[np.isnan(number)] = 0.0
    first, last = int(np.nanmin(number)), int(np.nanmax(number + nodes))
    before = plan_table.LENGTH + COLUMNS * harmonics_rows(o.gravity_degree, o.gravity_order)
    return {
        "sun_moon": before + SUN_MOON * (number - first),
        "sun_moon_time": time,
        "tables": ephemeris_table(first, last),
    }


def tables(o: Any) -> np.ndarray:
    """The phasing plan and the harmonics of the geopotential, for the settings o."""
    rows = harmonics_table(int(o.gravity_degree), int(o.gravity_order)).ravel()
    plan = plan_table.no_plan()
    if o.phase == PHASING:
        first, sun_moon = nominal_start(o)
        behind = np.concatenate([plan, rows, sun_moon.ravel()])
        plan = kept_design(plan_of, o, behind, first)
    return np.concatenate([plan, rows])


def nominal_start(o: Any) -> tuple[SimpleNamespace, np.ndarray]:
    """(kernel parameters, SI, of the case without errors, nodes of Sun and Moon for it)."""
    inputs = SimpleNamespace(**{item.symbol: np.array([item.default * item.si_factor]) for item in PARAMETERS})
    settings = SimpleNamespace(**{item.symbol: np.array([getattr(o, item.symbol)]) for item in SETTINGS})
    # a plan may end after the flight
    settings.duration = np.maximum(settings.duration, settings.longest_transfer + 2.0 * _DAY)
    refusals = Refusals.none(1)
    columns = prepare(inputs, settings, refusals)
    if refusals.mask.any():
        raise ModelError(f"there is no plan: {refusals.reason[0]}")
    kernel: Any = dynamics.Parameters
    rows = {name: float(np.ravel(columns[name])[0]) for name in kernel._fields}
    return SimpleNamespace(**rows), columns["tables"]


def sample_period(o: Any) -> float:
    """Time [s] from one fix to the next; none are needed where nothing is drawn along the flight."""
    return np.inf if o.navigation == PERFECT and o.phase != INSPECTION else float(o.fix_period)


MODEL = Model(
    name="geo_servicing",
    title="Servicing a geostationary satellite",
    source=SOURCE,
    parameters=PARAMETERS,
    settings=SETTINGS,
    states=STATES,
    quantities=outcome.QUANTITIES,
    metrics=outcome.METRICS,
    clock=AdaptiveStep(
        "duration",
        "tolerance",
        (*(1e-4,) * 3, *(1e-8,) * 3, 1e-6, *(1e-4,) * 3, *(1e-8,) * 3, 1e-3),
        control_period=sample_period,
    ),
    kernel_parameters=dynamics.Parameters,
    prepare=prepare,
    initial=dynamics.initial,
    start=corrections.start,
    control=navigation.control,
    tables=tables,
    rhs=dynamics.rhs,
    events=corrections.events,
    switch=corrections.switch,
    event_list=(
        Event("due", "rising", "switch", rare=True),
        Event("settle", "rising", "switch", rare=True),
        Event("penumbra", "either", "switch", rare=True),
        Event("umbra", "either", "switch", rare=True),
    ),
    observe=outcome.observe,
    evaluate=outcome.evaluate,
    extrema=outcome.EXTREMA,
    figures=figures.FIGURES,
    published=read_published(Path(__file__).with_name("published.toml")),
)
