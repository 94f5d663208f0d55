"""The entry model as the engine sees it: inputs, settings, what each case starts from, and the MODEL record."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from campaigns.reentry import dynamics, figures, guidance, outcome, reference_table, weather
from campaigns.reentry.air import GAS_CONSTANT
from campaigns.reentry.entry_state import Entry, World, entry_of
from campaigns.reentry.inputs import PARAMETERS, PLANS, SETTINGS, SHAPES
from campaigns.reentry.planets import PLANETS
from campaigns.reentry.reference import planned_inputs, reference_tables
from campaigns.reentry.vehicles import VEHICLES, Vehicle
from mc_engine.model import AdaptiveStep, Event, Field, Model, Refusals
from mc_engine.physics.aerodynamics import axial_coefficient
from mc_engine.physics.heating import detra_kemp_riddell_coefficient
from mc_engine.published import read_published

SOURCE = (
    "N. Mahmoudian, Design of a re-entry guidance and control system based on nominal-trajectory tracking "
    "(in Persian), M.Sc. thesis, K. N. Toosi University of Technology, early 2000s"
)
STATES = (
    *(Field(f"{axis}_m", "m", f"place, planet-fixed {axis}") for axis in "xyz"),
    *(Field(f"v{axis}_m_s", "m/s", f"velocity over ground, planet-fixed {axis}") for axis in "xyz"),
    Field("heat_load_j_m2", "J/m^2", "convective heat load at the stagnation point"),
)
EARTH = 0.0
ELLIPSOID, FLAT = float(SHAPES.index("ellipsoid")), float(SHAPES.index("flat"))
J2 = 0.0
US76 = 0.0
DETRA_KEMP_RIDDELL = 1.0
_OF_A_VEHICLE = ("mass", "reference_area", "drag_coefficient", "lift_coefficient", "trim_angle", "nose_radius")


def prepare(inputs: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Kernel parameters of each case.

    inputs : float64[n] by symbol, SI;  settings : codes, float64[n], by symbol.  Refused cases join `refusals`.
    """
    _refuse_what_does_not_fit(settings, refusals)
    refusals.add(
        (settings.guidance > 0.5) & (settings.planar < 0.5) & (inputs.target_downrange == 0.0),
        "a guidance law that turns to the side needs target_downrange_km, or planar = true",
    )
    world = _world(inputs, settings)
    entry = entry_of(inputs, settings, world, refusals)
    planned = _planned(settings, world, entry, refusals)
    exit_altitude = np.where(inputs.exit_altitude > 0.0, inputs.exit_altitude, entry.altitude)
    refusals.add(entry.altitude <= inputs.stop_altitude, "the entry is not above stop_altitude_km")
    names = ("x", "y", "z", "vx", "vy", "vz")
    rows = dict(zip(names, (*entry.position, *entry.velocity), strict=True))
    rows |= {"stop": inputs.stop_altitude, "exit": exit_altitude, "stop_time": inputs.stop_time}
    rows |= _target(inputs, world, planned) | {"speed": entry.speed, "path": entry.path}
    rows |= _guidance_rows(inputs, settings) | _weather_rows(inputs, settings)
    return (
        rows
        | _planet_rows(inputs, settings, world)
        | _vehicle_rows(inputs, settings, refusals)
        | _bank_rows(inputs, settings)
    )


def _refuse_what_does_not_fit(settings: SimpleNamespace, refusals: Refusals) -> None:
    """Scenarios that contradict themselves."""
    other = settings.planet != EARTH
    refusals.add(other & (settings.atmosphere == US76), 'the atmosphere "us76" is that of the Earth')
    refusals.add(other & (settings.gravity == J2), 'the gravity "j2" is that of the Earth; take "point"')
    refusals.add(other & (settings.shape == ELLIPSOID), 'only the Earth is an "ellipsoid" here; take "sphere"')
    refusals.add(
        other & (settings.heating == DETRA_KEMP_RIDDELL), 'the heating "detra_kemp_riddell" is that of the Earth\'s air'
    )
    guided = settings.guidance > 0.5
    refusals.add(guided & (settings.plan == PLANS.index("entry")), 'a guidance law needs its plan; set plan = "given"')
    flat = settings.shape == FLAT
    refusals.add(flat & (settings.weather > 0.5), "a flat Earth has no weather")
    refusals.add(guided & flat, "the guidance laws want a round planet")
    refusals.add(flat & (settings.rotating > 0.5), "a flat Earth does not turn; set rotating = false")
    refusals.add(flat & (settings.gravity == J2), 'a flat Earth has the gravity "point", which is uniform, or "none"')


def _of_planets(settings: SimpleNamespace, name: str) -> np.ndarray:
    """One number of each case's planet."""
    return np.array([getattr(planet, name) for planet in PLANETS.values()])[settings.planet.astype(int)]


def _world(i: SimpleNamespace, settings: SimpleNamespace) -> World:
    radius = np.where(i.surface_radius > 0.0, i.surface_radius, _of_planets(settings, "radius"))
    e2 = np.where(settings.shape == ELLIPSOID, _of_planets(settings, "e2"), 0.0)
    rate = np.where(settings.rotating > 0.5, _of_planets(settings, "rate"), 0.0)
    return World(_of_planets(settings, "mu"), radius, radius * np.sqrt(1.0 - e2), e2, rate, settings.shape == FLAT)


def _planet_rows(i: SimpleNamespace, settings: SimpleNamespace, world: World) -> dict[str, np.ndarray]:
    air = _of_planets(settings, "air")
    gravity = world.mu / world.radius**2
    return {
        "mu": world.mu,
        "rate": world.rate,
        "polar_radius": world.polar_radius,
        "e2": world.e2,
        "gravity": gravity,
        "log_density": np.log(air[:, 0]),
        "inverse_scale": 1.0 / air[:, 1],
        "temperature": gravity * air[:, 1] / GAS_CONSTANT,
        "density": i.density_factor,
        "deviation": i.density_deviation,
        "corridor_load": i.corridor_load,
        "corridor_heat_rate": i.corridor_heat_rate,
        "corridor_heat_load": i.corridor_heat_load,
        "corridor_pressure": i.corridor_dynamic_pressure,
        "radius": world.radius,
    }


def _numbers_of(vehicle: Vehicle) -> tuple[float, ...]:
    """SI numbers of a vehicle in the order of _OF_A_VEHICLE."""
    trim = float(np.radians(vehicle.trim_angle))
    return (
        vehicle.mass,
        vehicle.area,
        vehicle.drag_coefficient,
        vehicle.lift_coefficient,
        trim,
        vehicle.nose_radius,
    )


def _chosen_vehicle(i: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> list[np.ndarray]:
    """Numbers of each case's vehicle; one that is named and given other numbers besides is refused."""
    numbers = [getattr(i, symbol) for symbol in _OF_A_VEHICLE]
    items = {parameter.symbol: parameter for parameter in PARAMETERS}
    for k, (name, vehicle) in enumerate(VEHICLES.items(), start=1):
        chosen = settings.vehicle == k
        for symbol, number in zip(_OF_A_VEHICLE, numbers, strict=True):
            item = items[symbol]
            refusals.add(
                chosen & (number != item.default * item.si_factor),
                f'{item.name} is that of the vehicle "{name}"; for another, set vehicle = "given"',
            )
        own = _numbers_of(vehicle)
        numbers = [np.where(chosen, value, number) for value, number in zip(own, numbers, strict=True)]
    return numbers


def _planned_lift_to_drag(settings: SimpleNamespace) -> np.ndarray:
    """Lift-to-drag ratio that the laws know of."""
    own = [vehicle.lift_coefficient / vehicle.drag_coefficient for vehicle in VEHICLES.values()]
    ratios = np.array([0.0, *own])[settings.vehicle.astype(int)]
    ratio = np.where(settings.vehicle > 0.5, ratios, settings.plan_lift_to_drag)
    return np.where(ratio > 0.0, ratio, 1.0)  # a vehicle without lift is not guided


def _vehicle_rows(i: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Areas over mass of the four forces, and the coefficient of the heating."""
    mass, area, drag, lift, trim, nose = _chosen_vehicle(i, settings, refusals)
    drag = drag * i.cd_factor
    lift = lift * i.cd_factor * i.ld_factor
    per_mass = area / (mass * i.mass_factor)
    nose = nose * i.nose_radius_factor
    tilted = trim + i.accelerometer_misalignment
    sutton_graves = _of_planets(settings, "heating") / np.sqrt(nose)
    heating = np.where(settings.heating == DETRA_KEMP_RIDDELL, detra_kemp_riddell_coefficient(nose), sutton_graves)
    return {
        "drag": drag * per_mass,
        "lift": lift * per_mass,
        "total": np.hypot(drag, lift) * per_mass,
        "axial": axial_coefficient(drag, lift, np.cos(trim), np.sin(trim)) * per_mass,
        "sensed": axial_coefficient(drag, lift, np.cos(tilted), np.sin(tilted)) * per_mass,
        "planned_lift_to_drag": _planned_lift_to_drag(settings),
        "heating": heating * i.heating_factor,
    }


def _bank_rows(i: SimpleNamespace, settings: SimpleNamespace) -> dict[str, np.ndarray]:
    """Directions of the lift; a planar flight knows nothing of the side."""
    side = np.where(settings.planar > 0.5, 0.0, 1.0)
    first, rolled = i.bank + i.bank_error, i.rolled_bank + i.bank_error
    never = 0.5 * np.pi * (1.0 - 1e-12)
    return {
        "cos_bank": np.cos(first),
        "sin_bank": side * np.sin(first),
        "cos_rolled": np.cos(rolled),
        "sin_rolled": side * np.sin(rolled),
        "roll_at": np.where(i.roll_flight_path_angle > never, 2.0, np.sin(i.roll_flight_path_angle)),
        "roll_back_at": np.where(i.roll_back_flight_path_angle < -never, -2.0, np.sin(i.roll_back_flight_path_angle)),
    }


def _weather_rows(i: SimpleNamespace, settings: SimpleNamespace) -> dict[str, np.ndarray]:
    """The profiles of the cases, behind the tables of the guidance, and where each begins."""
    asked = settings.weather > 0.5
    if not asked.any():
        return {"weather": np.zeros(asked.size)}
    nodes = weather.weather_nodes(i.weather_draw, i.density_random_size, i.wind_random_size, i.wind_mean_size)
    guidance_tables = np.where(settings.guidance > 0.5, float(reference_table.LENGTH), 0.0)
    return {"weather": guidance_tables + weather.LENGTH * np.arange(asked.size), "tables": nodes}


def _planned(settings: SimpleNamespace, world: World, entry: Entry, refusals: Refusals) -> Entry:
    """The entry that distances are counted from: each case's own without errors, or that of the plan."""
    given = settings.plan == PLANS.index("given")
    if not given.any():
        return entry
    plain = SimpleNamespace(arrival=np.zeros_like(world.mu), speed_frame=settings.speed_frame)
    plan = entry_of(planned_inputs(settings), plain, world, refusals)
    mixed = {
        name: np.where(given, getattr(plan, name), getattr(entry, name))
        for name in ("place", "ahead", "right", "heading")
    }
    return replace(entry, **mixed)


def _guidance_rows(i: SimpleNamespace, settings: SimpleNamespace) -> dict[str, np.ndarray]:
    """Bank execution, reversals, sensor errors, and what the laws know of the planned vehicle."""
    return {
        "first_bank": i.bank + i.bank_error,
        "bank_error": i.bank_error,
        "bank_lag": i.bank_lag,
        "bank_rate_limit": i.bank_rate_limit,
        "reversal_floor": i.reversal_floor,
        "reversal_width": i.reversal_width,
        "load_limit": i.load_limit,
        "planned_share": np.cos(settings.plan_bank),
        "accelerometer_bias": i.accelerometer_bias,
        "accelerometer_scale": i.accelerometer_scale_error,
        "accelerometer_noise": i.accelerometer_noise,
        "nav_range": i.nav_range_error,
        "nav_altitude": i.nav_altitude_error,
        "nav_speed": i.nav_speed_error,
        "nav_path": i.nav_flight_path_angle_error,
        "nav_climb": i.nav_climb_error,
    }


def _target(i: SimpleNamespace, world: World, entry: Entry) -> dict[str, np.ndarray]:
    rows: dict[str, np.ndarray] = {}
    for letter, vectors in (("e", entry.place), ("f", entry.ahead), ("n", entry.right)):
        rows |= {f"{letter}{axis}": vectors[k] for k, axis in enumerate("xyz")}
    along, across = i.target_downrange / world.radius, i.target_crossrange / world.radius
    ahead = np.cos(along) * entry.place + np.sin(along) * entry.ahead
    target = np.cos(across) * ahead + np.sin(across) * entry.right
    rows |= {f"t{axis}": target[k] for k, axis in enumerate("xyz")}
    return rows | {
        "heading": entry.heading,
        "aim_down": i.target_downrange,
        "aim_cross": i.target_crossrange,
        "aimed": np.where(i.target_downrange > 0.0, 1.0, 0.0),
    }


MODEL = Model(
    name="reentry",
    title="Atmospheric entry",
    source=SOURCE,
    parameters=PARAMETERS,
    settings=SETTINGS,
    states=STATES,
    quantities=outcome.QUANTITIES,
    metrics=outcome.METRICS,
    clock=AdaptiveStep(
        "time_limit",
        "tolerance",
        (1e-5, 1e-5, 1e-5, 1e-8, 1e-8, 1e-8, 10.0),
        control_period=lambda o: o.guidance_period if o.guidance > 0.5 else np.inf,
        method="dp54",
        attempts=50_000,
    ),
    kernel_parameters=dynamics.Parameters,
    prepare=prepare,
    initial=dynamics.initial,
    start=dynamics.start,
    control=guidance.control,
    tables=reference_tables,
    rhs=dynamics.rhs,
    events=dynamics.events,
    switch=dynamics.switch,
    event_list=(
        Event("pressure_peak", "falling", "switch"),
        Event("heat_peak", "falling", "switch"),
        Event("pull_out", "rising", "switch"),
        Event("roll", "rising", "switch"),
        Event("leave", "rising", "switch"),
        Event("stop", "falling", "stop"),
        Event("left", "rising", "stop"),
        Event("over", "falling", "stop"),
    ),
    observe=outcome.observe,
    evaluate=outcome.evaluate,
    figures=figures.FIGURES,
    published=read_published(Path(__file__).with_name("published.toml")),
)
