"""An apogee raised by one burn, an impulse at the perigee of a circular orbit: a start for a model of your own."""

from mc_engine.lanes import cos, physics, rsqrt, sin, sqrt
from mc_engine.model import Event, FixedStep, Parameter, at_end, inputs, maximum_of, metrics, model, outputs, states
from mc_engine.physics.constants import EQUATORIAL_RADIUS, MU_EARTH

Inputs = inputs(  # nominal value, meaning, range; a name ends in its unit, and physics has it in SI, without: `burn_dv`
    altitude_km=Parameter(300.0, "altitude of the circular orbit", low=150.0, high=2000.0),
    burn_dv_m_s=Parameter(100.0, "size of the burn", low=1.0),
    magnitude_error_pct=Parameter(0.0, "error of the burn's size", low=-99.0),
    pitch_error_deg=Parameter(0.0, "error of the burn's direction, in the orbital plane", low=-90.0, high=90.0),
)
State = states(x_m="x", y_m="y", vx_m_s="vx", vy_m_s="vy")
Outputs = outputs(altitude_km="altitude", speed_m_s="speed")
Metrics = metrics(apogee_altitude_km=at_end("altitude_km", "altitude of the apogee"),
                  apogee_time_s=at_end("t_s", "time from the burn to the apogee"),
                  top_speed_m_s=maximum_of("speed_m_s", "largest speed"))  # fmt: skip


@physics
def initial(p):  # just after the burn, on the x axis; a function takes what it names: t, s, m, p, o
    r, dv = EQUATORIAL_RADIUS + p.altitude, p.burn_dv * (1.0 + p.magnitude_error)
    return State(x=r, y=0.0, vx=dv * sin(p.pitch_error), vy=sqrt(MU_EARTH / r) + dv * cos(p.pitch_error))


@physics
def rhs(s):  # derivative of the state: a point mass attracts, mu / r^2 [m/s^2]
    r2 = s.x * s.x + s.y * s.y
    g = -MU_EARTH * rsqrt(r2) ** 3
    return State(x=s.vx, y=s.vy, vx=g * s.x, vy=g * s.y)


@physics
def climb(s):  # r r' [m^2/s]: zero at the apogee
    return s.x * s.vx + s.y * s.vy


@physics
def observe(s):  # what histories show, and extremes are taken of
    return Outputs(altitude=sqrt(s.x * s.x + s.y * s.y) - EQUATORIAL_RADIUS, speed=sqrt(s.vx * s.vx + s.vy * s.vy))


MODEL = model(name="minimal", title="Apogee raised by one burn", inputs=Inputs, states=State, outputs=Outputs,
              metrics=Metrics, clock=FixedStep(step=10.0, until=10_000.0), initial=initial, rhs=rhs, observe=observe,
              events={"apogee": Event(climb, "falling", "stop")})  # fmt: skip
