"""The entry model as the engine sees it: inputs, settings, what each case starts from, and the MODEL record."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from campaigns.reentry import dynamics, outcome, weather
from campaigns.reentry.airframe import airframe_of, airframe_rows
from campaigns.reentry.dynamics import crossings
from campaigns.reentry.entry_state import Planned, World, entry_of, world_of
from campaigns.reentry.guidance import laws
from campaigns.reentry.guidance.plan import planned_entry, plans_of
from campaigns.reentry.guidance.reference import stored_references
from campaigns.reentry.inputs import CHOICES, Inputs
from mc_engine.model import AdaptiveStep, Event, Refusals, declared_in, figures, model, prepared
from mc_engine.studies.published import read_published

FIRST = 1  # index at which the tables of the cases begin


def prepare(inputs: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Kernel parameters of each case, SI; inputs, and settings as codes, by symbol."""
    _refuse_what_does_not_fit(settings, refusals)
    world = world_of(inputs, settings)
    entry = entry_of(inputs, settings, world, refusals)
    planned = planned_entry(inputs, settings, world, entry, refusals)
    airframe = airframe_of(inputs, settings, refusals)
    altitude = entry.planned.altitude
    refusals.add(altitude <= inputs.stop_altitude, "the entry is not above stop_altitude_km")
    refusals.add(entry.altitude <= inputs.stop_altitude, "the entry with its errors is not above stop_altitude_km")
    plan = plans_of(inputs, settings, world, planned, airframe)
    guided = settings.guidance != CHOICES.guidance.none
    refusals.add(guided & ~(plan.lift_to_drag > 0.0), "a guidance law needs a vehicle with lift")
    start, along, tables = stored_references(plan, guided, FIRST, refusals)
    rows = vars(inputs) | world._asdict() | _axes("", entry.position) | _axes("v", entry.velocity)
    # the numbers of a vehicle that is named take the place of the inputs
    rows |= airframe_rows(inputs, settings, airframe) | _bank_rows(inputs, settings)
    rows |= _target(inputs, world, planned, np.where(guided, along, inputs.target_downrange))
    # 1 mm lower: a start at the exit altitude, which rounding puts on either side of it, is above
    leaving = np.where(inputs.exit_altitude > 0.0, inputs.exit_altitude, altitude) - 1e-3
    rows |= {"exit": leaving, "missed": np.maximum(leaving, entry.altitude - 1e-3), "heading": planned.heading}
    rows |= {"relative_speed": entry.speed, "relative_flight_path_angle": entry.path}  # with their errors
    rows |= {"planned_range": along, "planned_share": plan.share, "planned_lift_to_drag": plan.lift_to_drag}
    return rows | {"reference": start} | _case_tables(inputs, settings, tables)


def _axes(letters: str, vectors: np.ndarray) -> dict[str, np.ndarray]:
    """Components [3, n] by name."""
    return {f"{letters}{axis}": vectors[k] for k, axis in enumerate("xyz")}


def _refuse_what_does_not_fit(settings: SimpleNamespace, refusals: Refusals) -> None:
    """Scenarios that contradict themselves."""
    other, flat = settings.planet != CHOICES.planet.earth, settings.shape == CHOICES.shape.flat
    weather, j2 = settings.weather > 0.5, settings.gravity == CHOICES.gravity.j2
    by_air = settings.heating == CHOICES.heating.detra_kemp_riddell
    us76 = settings.atmosphere == CHOICES.atmosphere.us76
    refusals.add(other & us76, 'the atmosphere "us76" is that of the Earth')
    refusals.add(other & j2, 'the gravity "j2" is that of the Earth; take "point"')
    refusals.add(other & weather, "the random air of weather = true is that of the Earth")
    refusals.add(other & by_air, 'the heating "detra_kemp_riddell" is that of the Earth\'s air')
    refusals.add(flat & weather, "a flat Earth has no weather")
    refusals.add(flat & (settings.guidance != CHOICES.guidance.none), "the guidance laws want a round planet")
    refusals.add(flat & (settings.rotating > 0.5), "a flat Earth does not turn; set rotating = false")
    refusals.add(flat & j2, 'a flat Earth has the gravity "point", which is uniform, or "none"')


def _bank_rows(i: SimpleNamespace, settings: SimpleNamespace) -> dict[str, np.ndarray]:
    """The first bank [rad], cosines and sines of all, without a side in a planar flight, and when to roll.

    roll_at, roll_back_at : sines of the flight-path angles; 2 and -2, which no sine reaches, stand for "never"
    """
    side = np.where(settings.planar > 0.5, 0.0, 1.0)
    first, rolled = i.bank + i.bank_error, i.rolled_bank + i.bank_error
    never = 0.5 * np.pi * (1.0 - 1e-12)
    return {
        "first_bank": first,
        "cos_bank": np.cos(first),
        "sin_bank": side * np.sin(first),
        "cos_rolled": np.cos(rolled),
        "sin_rolled": side * np.sin(rolled),
        "roll_at": np.where(i.roll_flight_path_angle > never, 2.0, np.sin(i.roll_flight_path_angle)),
        "roll_back_at": np.where(i.roll_back_flight_path_angle < -never, -2.0, np.sin(i.roll_back_flight_path_angle)),
    }


def _target(i: SimpleNamespace, world: World, planned: Planned, end: np.ndarray) -> dict[str, np.ndarray]:
    """Unit axes of the distances, and the target; end : its downrange [m] where the inputs name none, 0 for none."""
    downrange = np.where(i.target_downrange > 0.0, i.target_downrange, end)
    along, across = downrange / world.radius, i.target_crossrange / world.radius
    ahead = np.cos(along) * planned.place + np.sin(along) * planned.ahead
    target = np.cos(across) * ahead + np.sin(across) * planned.right
    rows = _axes("e", planned.place) | _axes("f", planned.ahead) | _axes("n", planned.right) | _axes("t", target)
    return rows | {"aim_down": downrange}


def _case_tables(i: SimpleNamespace, settings: SimpleNamespace, references: np.ndarray) -> dict[str, np.ndarray]:
    """Reference paths, then the air of each case, SI, and the index at which that begins, float64[n]."""
    asked = settings.weather > 0.5
    if not asked.any():
        return {"weather": np.zeros(asked.size), "tables": references}
    nodes = weather.weather_nodes(i.weather_draw, i.density_random_size, i.wind_random_size, i.wind_mean_size)
    start = FIRST + references.size + weather.LENGTH * np.arange(asked.size)
    return {"weather": start, "tables": np.concatenate([references, nodes.ravel()])}


CORRIDOR = ("peak_load_g", "peak_axial_load_g", "peak_dynamic_pressure_pa", "peak_heat_rate_w_m2", "heat_load_j_m2")
# a map is drawn where the run disperses its two inputs
FIGURES = (
    figures.CorridorFigure(
        "relative_speed_m_s",
        "relative_flight_path_angle_deg",
        (*CORRIDOR, "exits", "min_altitude_km"),
        "Entry corridor: speed and flight-path angle at entry, over ground",
    ),
    figures.FootprintFigure(
        "final_latitude_deg",
        "final_longitude_deg",
        "Where the flights end",
        ends_below=("final_altitude_km", 35.0),  # one that ends higher left the atmosphere again or ran out of time
        planet="planet",
        target=("target_latitude_deg", "target_longitude_deg"),
    ),
    figures.ProfileFigure("speed_m_s", "altitude_km", "Altitude against speed"),
    figures.MapFigure("exit_speed_m_s", "vacuum_periapsis_km", "density_factor", "Speed that a pass leaves"),
    figures.MapFigure(
        "peak_load_g", "entry_flight_path_angle_error_deg", "entry_speed_error_m_s", "Largest load over entry errors"
    ),
    figures.MapFigure(
        "miss_km", "ve_pct", "oe_pct", "Landing miss over the errors of the de-orbit burn", upstream=True
    ),
    figures.HistoryFigure(
        ("altitude_km", "speed_m_s", "flight_path_angle_deg"), "Altitude, speed and flight-path angle"
    ),
    figures.HistoryFigure(("load_g", "heat_rate_w_m2", "dynamic_pressure_pa"), "Load, heat rate and dynamic pressure"),
    figures.HistoryFigure(("downrange_km", "crossrange_km", "bank_deg"), "Distances over ground and bank"),
    figures.ScatterFigure("downrange_km", "crossrange_km", "Where the flight ends"),
    figures.ScatterFigure("peak_load_altitude_km", "peak_load_g", "Largest load and its altitude"),
    figures.ScatterFigure("heat_load_j_m2", "peak_heat_rate_w_m2", "Largest heat rate and heat load"),
)

MODEL = model(
    name="reentry",
    title="Atmospheric entry",
    source=(
        "N. Mahmoudian, Design of a re-entry guidance and control system based on nominal-trajectory tracking "
        "(in Persian), M.Sc. thesis, K. N. Toosi University of Technology, early 2000s"
    ),
    inputs=Inputs,
    clock=AdaptiveStep(
        "time_limit",
        "tolerance",
        (1e-5, 1e-5, 1e-5, 1e-8, 1e-8, 1e-8, 10.0),
        control_period=lambda o: o.guidance_period if o.guidance != CHOICES.guidance.none else np.inf,
        method="dp54",
        attempts=200_000,  # a law with the shortest period steps so often in 2000 s
    ),
    kernel_parameters=prepared(prepare, Inputs),
    prepare=prepare,
    tables=lambda o: np.zeros(FIRST),  # nothing is shared: reference paths and air are those of `prepare`
    events={
        **dict.fromkeys(("pressure_peak", "heat_peak"), Event(crossings, "falling", "switch")),
        **dict.fromkeys(("pull_out", "roll", "leave"), Event(crossings, "rising", "switch", rare=True)),
        "stop": Event(crossings, "falling", "stop"),
        **dict.fromkeys(("left", "missed"), Event(crossings, "rising", "stop", rare=True)),
        "over": Event(crossings, "falling", "stop", rare=True),
    },
    **declared_in(dynamics, laws, outcome),
    figures=FIGURES,
    published=read_published(Path(__file__).with_name("published.toml")),
)
