"""A sounding rocket in the vertical plane of its launcher, from the rail to the ground.

A rigid rocket with a swivelling nozzle burns, coasts to its apogee, and comes down on a
drogue and a main parachute.  Flat Earth at rest, air of one exponential layer, no
moments from the air: good for dispersions up to 100 km, not for loads of the ascent.
"""

from collections import namedtuple
from math import radians

from figures import FIGURES

from mc_engine.lanes import cos, exp, maximum, minimum, physics, sin, sqrt, where
from mc_engine.lanes.noise import normal_pair
from mc_engine.model import Event, Extremum, Field, FixedStep, Model, Parameter
from mc_engine.physics.atmosphere import exponential
from mc_engine.physics.constants import STANDARD_GRAVITY

# kg; m, m^2 and kg m^2 of the rocket
DRY_MASS, PROPELLANT = 200.0, 200.0
NOZZLE_ARM, BODY_DRAG_AREA, INERTIA = 1.5, 0.04, 600.0
DROGUE_AREA, MAIN_AREA, MAIN_ALTITUDE = 2.0, 30.0, 3000.0
MASS_FLOW, EXHAUST_SPEED = 10.0, 2250.0  # kg/s, m/s
RAIL = 6.0  # m
# Attitude to be held, rad; rad of the nozzle per rad, and per rad/s, of error; stop
HELD = radians(5.0)
PROPORTIONAL, DERIVATIVE, NOZZLE_STOP = 0.3, 0.11, 0.1
ATTITUDE_NOISE, RATE_NOISE = 0.002, 0.005  # rad, rad/s, one sigma of a sample

PARAMETERS = (
    Parameter("launcher_deg", "deg", "launcher's angle from the vertical", 5.0, 0.0, 30.0),
    Parameter("thrust_pct", "%", "error of the thrust, not of the flow", 0.0, -50.0, 50.0),
    Parameter("drag_pct", "%", "error of the body's drag area", 0.0, -90.0, 200.0),
    Parameter("wind_m_s", "m/s", "wind at the ground, downrange", 0.0, -40.0, 40.0),
    Parameter("misalignment_deg", "deg", "of the thrust, from the nozzle", 0.0, -3.0, 3.0),
)

# m, m/s, rad from the vertical, rad/s, kg
State = namedtuple("State", "downrange altitude vx vz pitch rate mass")
# as PARAMETERS, in SI
Parameters = namedtuple("Parameters", "launcher thrust drag wind misalignment")
Memory = namedtuple("Memory", "nozzle burning drag_area")  # rad; 1 or 0; m^2
Events = namedtuple("Events", "burn_out apogee main ground")
Quantities = namedtuple("Quantities", "altitude downrange speed pressure pitch nozzle")
Metrics = namedtuple(
    "Metrics",
    "apogee apogee_time top_speed peak_pressure landing_distance landing_speed",
)


@physics
def thrust_of(p):
    """Thrust [N]: the mass flow is the nominal one."""
    return MASS_FLOW * EXHAUST_SPEED * (1.0 + p.thrust)


@physics
def initial(p, o):
    """At the rail's end: the speed is that of a constant acceleration along it."""
    mass = DRY_MASS + PROPELLANT
    along = thrust_of(p) / mass - STANDARD_GRAVITY * cos(p.launcher)
    speed = sqrt(2.0 * RAIL * along)
    s, c = sin(p.launcher), cos(p.launcher)
    return State(RAIL * s, RAIL * c, speed * s, speed * c, p.launcher, 0.0, mass)


@physics
def start(p, o):
    """The nozzle straight, the engine burning, no parachute."""
    return Memory(0.0, 1.0, BODY_DRAG_AREA * (1.0 + p.drag))


@physics
def air(s, p):
    """(density [kg/m^3], velocity through the air [m/s]); the wind fades in 8 km."""
    rho = exponential(s.altitude, 1.225, 0.0, 7200.0)
    return rho, s.vx - p.wind * exp(s.altitude * (-1.0 / 8000.0)), s.vz


@physics
def rhs(t, s, m, p, o):
    """Thrust along the nozzle, which turns the body; drag against the air; gravity."""
    rho, ux, uz = air(s, p)
    drag = 0.5 * rho * m.drag_area * sqrt(ux * ux + uz * uz)
    force = m.burning * thrust_of(p)
    swivel = m.nozzle + p.misalignment
    towards = s.pitch - swivel
    turn = force * (NOZZLE_ARM / INERTIA) * sin(swivel)
    return State(
        s.vx,
        s.vz,
        (force * sin(towards) - drag * ux) / s.mass,
        (force * cos(towards) - drag * uz) / s.mass - STANDARD_GRAVITY,
        m.burning * s.rate,
        turn,
        -m.burning * MASS_FLOW,
    )


@physics
def control(t, s, m, p, o, draws):
    """Turn the nozzle against errors of attitude and rate; every sample has noise."""
    n1, n2 = normal_pair(draws, 0)
    error = s.pitch + ATTITUDE_NOISE * n1 - HELD
    nozzle = -PROPORTIONAL * error - DERIVATIVE * (s.rate + RATE_NOISE * n2)
    nozzle = minimum(maximum(nozzle, -NOZZLE_STOP), NOZZLE_STOP)
    return Memory(nozzle, m.burning, m.drag_area)


@physics
def events(t, s, m, p, o):
    """Zeros: no propellant left, end of the climb, main parachute, ground."""
    return Events(s.mass - DRY_MASS, s.vz, s.altitude - MAIN_ALTITUDE, s.altitude)


@physics
def switch(t, s, m, p, o, hit):
    """Burn-out stops the engine; the drogue opens at the apogee, the main one lower."""
    burning = where(hit.burn_out > 0.5, 0.0, m.burning)
    area = where(hit.apogee > 0.5, DROGUE_AREA, m.drag_area)
    area = where(hit.main > 0.5, MAIN_AREA, area)
    return s, Memory(m.nozzle, burning, area)


@physics
def observe(t, s, m, p, o):
    """What histories show, and what extremes are taken of."""
    rho, ux, uz = air(s, p)
    pressure = 0.5 * rho * (ux * ux + uz * uz)
    speed = sqrt(s.vx * s.vx + s.vz * s.vz)
    nozzle = m.burning * m.nozzle
    return Quantities(s.altitude, s.downrange, speed, pressure, s.pitch, nozzle)


@physics
def evaluate(t, s, m, p, o, best, when):
    """What a flight comes to."""
    x, speed = s.downrange, sqrt(s.vx * s.vx + s.vz * s.vz)
    return Metrics(best.apogee, when.apogee, best.speed, best.pressure, x, speed)


MODEL = Model(
    name="sounding_rocket",
    title="Sounding rocket from rail to ground",
    source="",
    parameters=PARAMETERS,
    settings=(),
    states=(
        Field("downrange_km", "km", "distance along the ground"),
        Field("altitude_km", "km", "altitude"),
        Field("vx_m_s", "m/s", "speed downrange"),
        Field("vz_m_s", "m/s", "speed upwards"),
        Field("pitch_deg", "deg", "body axis from the vertical"),
        Field("rate_deg_s", "deg/s", "rate of the same"),
        Field("mass_kg", "kg", "mass"),
    ),
    quantities=(
        Field("altitude_km", "km", "altitude"),
        Field("downrange_km", "km", "distance along the ground"),
        Field("speed_m_s", "m/s", "speed over the ground"),
        Field("pressure_pa", "Pa", "dynamic pressure"),
        Field("pitch_deg", "deg", "body axis from the vertical"),
        Field("nozzle_deg", "deg", "angle of the nozzle"),
    ),
    metrics=(
        Field("apogee_km", "km", "greatest altitude"),
        Field("apogee_time_s", "s", "time from the rail to the apogee"),
        Field("top_speed_m_s", "m/s", "greatest speed over the ground"),
        Field("peak_pressure_pa", "Pa", "greatest dynamic pressure"),
        Field("landing_distance_km", "km", "distance of the landing from the launcher"),
        Field("landing_speed_m_s", "m/s", "speed at the ground, wind included"),
    ),
    clock=FixedStep(step=0.05, until=2000.0),
    kernel_parameters=Parameters,
    initial=initial,
    start=start,
    rhs=rhs,
    control=control,
    events=events,
    event_list=(
        Event("burn_out", "falling", "switch"),
        Event("apogee", "falling", "switch"),
        Event("main", "falling", "switch"),
        Event("ground", "falling", "stop"),
    ),
    switch=switch,
    observe=observe,
    evaluate=evaluate,
    extrema=(
        Extremum("apogee", "altitude_km"),
        Extremum("speed", "speed_m_s"),
        Extremum("pressure", "pressure_pa"),
    ),
    figures=FIGURES,
)
