"""The servicing model as the engine sees it: what each case starts from, tables, and the MODEL record."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from campaigns.geo_servicing import corrections, dynamics, navigation, outcome, plan_table
from campaigns.geo_servicing.dynamics import MU, R0, SIDEREAL_DAY, State
from campaigns.geo_servicing.inputs import BURN_NUMBERS, CHOICES, Inputs
from campaigns.geo_servicing.phasing_plan import plan_of
from mc_engine.errors import ModelError
from mc_engine.model import AdaptiveStep, Parameter, Refusals, declared_in, kept_design, model, prepared
from mc_engine.model.figures import HistoryFigure, ProfileFigure, ScatterFigure
from mc_engine.physics import geopotential, sun_moon
from mc_engine.physics.constants import STANDARD_GRAVITY
from mc_engine.physics.frames import TURN
from mc_engine.physics.orbital_elements import state_of_elements
from mc_engine.studies.published import read_published

_DAY = 86_400.0


def prepare(i: SimpleNamespace, o: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Kernel parameters of each case, SI; i : inputs;  o : settings, codes."""
    epoch = o.epoch_utc + i.epoch_error / _DAY
    sidereal = sun_moon.sidereal_angle(epoch)
    two, around = o.phase == CHOICES.phase.inspection, o.geometry == CHOICES.geometry.around
    refusals.add(o.gravity_order > o.gravity_degree, "gravity_order is above gravity_degree")
    refusals.add(o.gravity_degree == 1.0, "the geopotential has no harmonics of degree 1; take 0, or 2 and above")
    mass = o.mass + i.mass_error
    refusals.add(mass <= 0.0, "mass_kg and mass_error_kg leave no mass")
    module = np.where(two, craft_start(i, "module"), phasing_start(i, o, sidereal, refusals))
    target = np.where(two, craft_start(i, "target"), 0.0)
    light = o.reflectivity * i.reflectivity_factor * o.area * i.area_factor
    return {
        **vars(i),
        **dict(zip(State._fields[:6], module, strict=True)),
        **dict(zip(State._fields[7:13], target, strict=True)),
        "mass_left": mass,
        "exhaust": o.isp * STANDARD_GRAVITY,
        "light": light,  # C_R A [m^2]
        "target_light": light / mass * i.target_area_to_mass_factor,  # over its mass [m^2/kg]
        "sidereal": sidereal,
        "aim": sidereal + o.target_longitude,
        **{f"thrust_{k}": i.thrust_error + getattr(i, f"burn_{k}_thrust_error") for k in BURN_NUMBERS},
        **{f"radial_{k}": i.radial + getattr(i, f"burn_{k}_radial") for k in BURN_NUMBERS},
        **{f"normal_{k}": i.out_of_plane + getattr(i, f"burn_{k}_out_of_plane") for k in BURN_NUMBERS},
        # in the inspection both craft's fixes count, in the phasing there is one
        "nav_position": np.hypot(i.nav_position, np.where(two, i.target_nav_position, 0.0)),
        "nav_velocity": np.hypot(i.nav_velocity, np.where(two, i.target_nav_velocity, 0.0)),
        "nominal": np.where(around, 0.0, np.where(o.geometry == CHOICES.geometry.behind, -1.0, 1.0)) * i.standoff,
        # the relative ellipse has the half axes R0 e outward and 2 R0 e ahead: it is between the ranges wanted if the
        # difference of the eccentricities is between low/R0 and high/(2 R0), and in the middle of that here
        "around": np.where(around, 0.5 * (i.around_low / R0 + i.around_high / (2.0 * R0)), 0.0),
        **_sun_moon_rows(epoch, o),
    }


def phasing_start(i: SimpleNamespace, o: SimpleNamespace, sidereal, refusals: Refusals) -> np.ndarray:
    """The servicing module above its longitude, osculating elements; sidereal : angle [rad] at the start."""
    period = o.initial_period + i.initial_period_error
    e = o.initial_eccentricity + i.initial_eccentricity_error
    # a negative error of a small eccentricity is one to the other side of the orbit
    anomaly = o.initial_true_anomaly + i.initial_true_anomaly_error + np.where(e < 0.0, np.pi, 0.0)
    e = np.abs(e)
    inclination = o.initial_inclination + i.initial_inclination_error
    refusals.add(~((period > 0.0) & (e < 0.9)), "the first orbit is none: its period or its eccentricity is impossible")
    a = np.cbrt(MU * (period / TURN) ** 2)
    ahead = sidereal + o.initial_longitude + i.initial_longitude_error - o.initial_node
    latitude = np.arctan2(np.sin(ahead) / np.cos(inclination), np.cos(ahead))  # argument of, above the longitude
    return state_of_elements(a, e, inclination, o.initial_node, latitude - anomaly, anomaly, MU)


def craft_start(i: SimpleNamespace, name: str) -> np.ndarray:
    """State float64[6, n], SI, inertial axes, of the craft whose parameters begin with `name`."""
    parts = ("pericentre_radius", "eccentricity", "inclination", "node", "argument_of_pericentre")
    radius, e, inclination, node, pericentre = (getattr(i, f"{name}_{part}") for part in parts)
    anomaly = getattr(i, f"{name}_argument_of_latitude") - pericentre
    return state_of_elements(radius / (1.0 - e), e, inclination, node, pericentre, anomaly, MU)


def _sun_moon_rows(epoch: np.ndarray, o: SimpleNamespace) -> dict[str, np.ndarray]:
    """The nodes that the chunk's flights need, where each case finds its first, and the time [s] since that."""
    number, time = sun_moon.node_before(epoch)
    # from the node before the start to two behind the end: the cubic takes one, a look past the last step another
    nodes = np.ceil((o.duration / _DAY) / sun_moon.SPACING) + 3.0
    nodes[np.isnan(number)] = 0.0
    first, last = int(np.nanmin(number)), int(np.nanmax(number + nodes))
    before = plan_table.LENGTH + geopotential.COLUMNS * geopotential.harmonics_rows(o.gravity_degree, o.gravity_order)
    return {
        "sun_moon": before + sun_moon.COLUMNS * (number - first),
        "sun_moon_time": time,
        "tables": sun_moon.ephemeris_table(first, last),
    }


Parameters = prepared(prepare, Inputs)


def tables(o: Any) -> np.ndarray:
    """The phasing plan and the harmonics of the geopotential, SI, for the settings o.

    Raises ModelError where the flight ends before the day after a designed transfer is over: metrics would be missing.
    """
    plan = np.zeros(plan_table.LENGTH)
    if o.phase == CHOICES.phase.phasing:
        plan = kept_design(plan_of, *nominal_start(o))
        needed = (plan_table.end_of(plan, o.mass / o.thrust) + SIDEREAL_DAY) / _DAY
        if o.schedule == CHOICES.schedule.designed and o.duration < needed * _DAY:
            raise ModelError(
                f"the designed transfer and the day after it take {needed:.2f} days: give duration_days "
                f"{np.ceil(10.0 * needed + 1.0) / 10.0:.1f} or more, or a shorter longest_transfer_days"
            )
    return np.append(plan, geopotential.harmonics_table(int(o.gravity_degree), int(o.gravity_order)))


def nominal_start(o: Any) -> tuple[Any, Any]:
    """(settings with the tables of a flight without a plan, kernel parameters, SI) of the case without errors."""
    defaults = [item for item in Inputs.declared if isinstance(item, Parameter)]
    inputs = SimpleNamespace(**{item.symbol: np.array([item.default * item.si_factor]) for item in defaults})
    longest = o._replace(duration=max(o.duration, o.longest_transfer + 2.0 * _DAY))  # a plan may end after the flight
    settings = SimpleNamespace(**{name: np.array([value]) for name, value in longest._asdict().items()})
    refusals = Refusals.none(1)
    columns = prepare(inputs, settings, refusals)
    if refusals.mask.any():
        raise ModelError(f"there is no plan: {refusals.reason[0]}")
    # no plan yet, as in the tables of a free flight: for the phasing `tables` would ask for the plan itself
    unplanned = np.append(tables(o._replace(phase=CHOICES.phase.free)), columns.pop("tables"))
    return o._replace(tables=unplanned), Parameters(**{name: float(np.ravel(row)[0]) for name, row in columns.items()})


def sample_period(o: Any) -> float:
    """Time [s] from one fix to the next; none are needed where nothing is drawn along the flight."""
    nothing = o.navigation == CHOICES.navigation.perfect and o.phase != CHOICES.phase.inspection
    return np.inf if nothing else float(o.fix_period)


FIGURES = (
    ProfileFigure("mean_longitude_deviation_deg", "drift_rate_deg_rev", "Phase portrait: longitude and drift"),
    HistoryFigure(("longitude_deviation_deg", "drift_rate_deg_rev", "eccentricity"), "Longitude, drift, eccentricity"),
    ProfileFigure("along_track_m", "radial_m", "Relative motion in the orbital plane, as the target sees it"),
    ProfileFigure("settled_along_track_m", "settled_radial_m", "Relative motion after settling"),
    HistoryFigure(("range_m", "relative_drift_m", "relative_eccentricity"), "Range, relative drift, relative ellipse"),
    HistoryFigure(
        ("along_track_m", "radial_m", "delta_v_m_s"), "Characteristic velocity and place relative to the target"
    ),
    ScatterFigure("settled_min_range_m", "settled_max_range_m", "Smallest and largest range after settling"),
    ScatterFigure("daily_mean_longitude_deviation_deg", "actual_drift_rate_deg_rev", "Where the transfer ends"),
    ScatterFigure("drift_rate_deg_rev", "eccentricity", "Drift and eccentricity at the end of the transfer"),
)

MODEL = model(
    name="geo_servicing",
    title="Servicing a geostationary satellite",
    source="Hoang Vu Tan, Development of motion control algorithms for a spacecraft of a geostationary communication "
    "satellite servicing system (in Russian), Candidate of Technical Sciences dissertation, Moscow Aviation Institute, "
    "Moscow, 2021",
    inputs=Inputs,
    clock=AdaptiveStep(
        "duration", "tolerance", dynamics.tolerances(1e-4, 1e-8), control_period=sample_period, attempts=1_000_000
    ),
    kernel_parameters=Parameters,
    prepare=prepare,
    tables=tables,
    **declared_in(dynamics, corrections, navigation, outcome),
    figures=FIGURES,
    published=read_published(Path(__file__).with_name("published.toml")),
)
