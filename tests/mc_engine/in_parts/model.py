"""An apogee raised by one burn, an impulse at the perigee of a circular orbit: a start for a model of your own.

Inside, all is SI and radians, and `burn_dv_m_s` is `burn_dv`; mc_engine.model says all that a model can have.
"""

from collections import namedtuple

from mc_engine.lanes import cos, physics, sin, sqrt
from mc_engine.model import Event, Extremum, Field, FixedStep, Model, Parameter
from mc_engine.physics.constants import EQUATORIAL_RADIUS, MU_EARTH

State = namedtuple("State", "x y vx vy")
Parameters = namedtuple("Parameters", "altitude burn_dv magnitude_error pitch_error")
Events = namedtuple("Events", "apogee")
Quantities = namedtuple("Quantities", "altitude speed")
Metrics = namedtuple("Metrics", "apogee_altitude apogee_time top_speed")


@physics
def initial(p, o):  # [m, m/s] just after the burn, on the x axis
    r, dv = EQUATORIAL_RADIUS + p.altitude, p.burn_dv * (1.0 + p.magnitude_error)
    return State(r, 0.0, dv * sin(p.pitch_error), sqrt(MU_EARTH / r) + dv * cos(p.pitch_error))


@physics
def rhs(t, s, m, p, o):  # derivative of the state: a point mass attracts, mu / r^2 [m/s^2]
    r2 = s.x * s.x + s.y * s.y
    g = -MU_EARTH / (r2 * sqrt(r2))
    return State(s.vx, s.vy, g * s.x, g * s.y)


@physics
def events(t, s, m, p, o):  # r r' [m^2/s]: zero at the apogee
    return Events(s.x * s.vx + s.y * s.vy)


@physics
def observe(t, s, m, p, o):  # what histories show [m, m/s]
    return Quantities(sqrt(s.x * s.x + s.y * s.y) - EQUATORIAL_RADIUS, sqrt(s.vx * s.vx + s.vy * s.vy))


@physics
def evaluate(t, s, m, p, o, best, when):  # at the end of a case [m, s, m/s]
    return Metrics(sqrt(s.x * s.x + s.y * s.y) - EQUATORIAL_RADIUS, t, best.speed)


MODEL = Model(
    name="minimal",
    title="Apogee raised by one burn",
    source="",
    parameters=(  # name, unit, meaning, nominal value, and the range that is allowed
        Parameter("altitude_km", "km", "altitude of the circular orbit", 300.0, low=150.0, high=2000.0),
        Parameter("burn_dv_m_s", "m/s", "size of the burn", 100.0, low=1.0),
        Parameter("magnitude_error_pct", "%", "error of the burn's size", 0.0, low=-99.0),
        Parameter("pitch_error_deg", "deg", "error of the burn's direction, in the orbital plane", 0.0, -90.0, 90.0),
    ),
    settings=(),
    states=(Field("x_m", "m", "x"), Field("y_m", "m", "y"), Field("vx_m_s", "m/s", "vx"), Field("vy_m_s", "m/s", "vy")),
    quantities=(Field("altitude_km", "km", "altitude"), Field("speed_m_s", "m/s", "speed")),
    metrics=(
        Field("apogee_altitude_km", "km", "altitude of the apogee"),
        Field("apogee_time_s", "s", "time from the burn to the apogee"),
        Field("top_speed_m_s", "m/s", "largest speed"),
    ),
    clock=FixedStep(step=10.0, until=10_000.0),
    kernel_parameters=Parameters,
    initial=initial,
    rhs=rhs,
    events=events,
    event_list=(Event("apogee", "falling", "stop"),),
    observe=observe,
    evaluate=evaluate,
    extrema=(Extremum("speed", "speed_m_s"),),
)
