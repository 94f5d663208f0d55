"""Calisto, a student rocket: rail, six degrees of freedom under power and in coast, two parachutes with lag.

Vehicle, motor, curves and equations of motion are those of RocketPy 1.13 (G. H. Ceotto et al., J. Aerosp. Eng. 34(6),
2021, doi 10.1061/(ASCE)AS.1943-5525.0001331; thrust.csv and drag.csv are from its repository, MIT licence), so that
flights can be compared.  As there, places of nozzle and propellant count to the nose where they are towards the tail,
and `free` changes two terms.  Axes: x east, y north, z up from sea level; z of the body to the nose.
"""

from math import cos, pi, radians, sin

from mc_engine.lanes import maximum, physics, replace, where
from mc_engine.model import (
    AdaptiveStep,
    Event,
    Field,
    Parameter,
    Phase,
    at_end,
    inputs,
    maximum_of,
    metrics,
    model,
    outputs,
    states,
    time_of,
    value_at,
)  # fmt: skip
from mc_engine.physics.aerodynamics import fins_lift_area, lift_of_part, parachute_acceleration
from mc_engine.physics.air import us76_air
from mc_engine.physics.constants import EARTH_RATE
from mc_engine.physics.curves import curve, wind_profile
from mc_engine.physics.gravity import normal_gravity
from mc_engine.physics.rigid_body import Propellant, Rocket, rocket_accelerations, solid_propellant
from mc_engine.physics.rotations import Quaternion, derivative, euler_sequence, transformed, transformed_back
from mc_engine.physics.vectors import Vector, added, cross, norm, scaled, subtracted

# ---- the vehicle, SI: masses, places on the axis from the tail, radii
LATITUDE, ELEVATION, RAIL = radians(32.990254), 1400.0, 3.8632  # length of the rail above the upper button
OMEGA = Vector(0.0, EARTH_RATE * cos(LATITUDE), EARTH_RATE * sin(LATITUDE))
RADIUS, BODY_MASS, MOTOR_DRY_MASS, NOZZLE = 0.0635, 14.426, 1.815, -1.255
PROPELLANT, DRY_MOTOR = NOZZLE + 0.397, NOZZLE + 0.317  # centres of mass
I_BODY, I_MOTOR, I_AXIAL = 6.321, 0.125, 0.034 + 0.002
NOSE, FINS, TAIL = 1.278 - 0.279145, -1.04956 - 0.055, -1.194656 - 0.028130841121495328  # centres of pressure
AREA, SPAN, ROOT, TIP = pi * RADIUS**2, 0.1, 0.12, 0.04  # of reference; of the fins
NOSE_LIFT, TAIL_LIFT = 2.0 * AREA, 2.0 * ((0.0435 / RADIUS) ** 2 - 1.0) * AREA  # by the angle of attack

THRUST = curve("thrust.csv", x="time_s", y="thrust_n")
DRAG = curve("drag.csv", x="mach", y="cd")
BURN, EMPTY = 3.9, Propellant(*7 * (0.0,))
propellant = solid_propellant(THRUST, BURN, number=5, density=1815.0, outer=0.033, inner=0.015, length=0.12, gap=0.005)
wind = wind_profile("wind.csv", "altitude_m", "north_m_s", "east_m_s")
rail_attitude, _ = euler_sequence("313")

Inputs = inputs(
    body_mass_kg=Parameter(BODY_MASS, "mass without motor", low=5.0, high=50.0),
    thrust_factor=Parameter(1.0, "thrust over that of the curve", low=0.5, high=1.5, unit=""),
    drag_factor=Parameter(1.0, "drag coefficient over that of the curve", low=0.1, high=3.0, unit=""),
    inclination_deg=Parameter(85.0, "rail above the horizon", low=60.0, high=89.9),
    heading_deg=Parameter(0.0, "rail from north to east", low=-360.0, high=360.0),
    wind_factor=Parameter(0.0, "wind over that of wind.csv", low=-3.0, high=3.0, unit=""),
    drogue_lag_s=Parameter(1.5, "from the apogee to the open drogue", low=0.0, high=10.0),
    main_lag_s=Parameter(1.5, "from the main's altitude to the open main", low=0.0, high=10.0),
    drogue_area_m2=Parameter(1.0, "drag area of the drogue", low=0.01, high=20.0),
    main_area_m2=Parameter(10.0, "drag area of the main parachute", low=0.1, high=100.0),
)
ATTITUDE = Field("from the body's axes to those of the ground", unit="")
State = states(
    east_m="east of the rail", north_m="north of the rail", altitude_m="above sea level", ve_m_s="speed east",
    vn_m_s="speed north", vu_m_s="speed upwards", q0=ATTITUDE, q1=ATTITUDE, q2=ATTITUDE, q3=ATTITUDE,
    wx_deg_s="rate about x", wy_deg_s="rate about y", wz_deg_s="roll rate",
)  # fmt: skip
Outputs = outputs(height_m="above the ground", speed_m_s="speed", east_m="east of the rail",
                  north_m="north of the rail", sink_m_s="speed downwards")  # fmt: skip
Metrics = metrics(
    apogee_m=value_at("apogee", "height_m", "height of the apogee"),
    apogee_time_s=time_of("apogee", "time of the apogee"),
    top_speed_m_s=maximum_of("speed_m_s", "largest speed"),
    rail_speed_m_s=value_at("rail_exit", "speed_m_s", "speed at the end of the rail"),
    flight_time_s=at_end("t_s", "time of the landing"),
    landing_east_m=at_end("east_m", "landing place, east"),
    landing_north_m=at_end("north_m", "landing place, north"),
    landing_speed_m_s=at_end("sink_m_s", "sink speed at the ground"),
)
STILL = State(*13 * (0.0,))


@physics
def initial(p):
    q = rail_attitude(-p.heading, p.inclination - 0.5 * pi, 0.0)
    return replace(STILL, altitude=ELEVATION, q0=q.q0, q1=q.q1, q2=q.q2, q3=q.q3)


@physics
def weight(s):  # [m/s^2]
    return Vector(0.0, 0.0, -normal_gravity(sin(LATITUDE) ** 2, s.altitude))


@physics
def flow(s, p):  # (air, velocity of the air against the rocket [m/s])
    w = scaled(p.wind_factor, wind(s.altitude))  # north, east, down
    return us76_air(s.altitude), Vector(w.y - s.ve, w.x - s.vn, -s.vu)


@physics
def dry(p):  # the rocket without propellant, and its centre of mass behind that of the body
    m = p.body_mass + MOTOR_DRY_MASS
    centre = MOTOR_DRY_MASS * DRY_MOTOR / m
    across = I_BODY + p.body_mass * centre * centre + I_MOTOR + MOTOR_DRY_MASS * (DRY_MOTOR - centre) ** 2
    return Rocket(m, across, I_AXIAL, PROPELLANT - centre, NOZZLE - centre, jet=0.5 * 0.033**2), centre


@physics
def point(s, a):  # derivative of the state without rotation; a : acceleration [m/s^2]
    return replace(STILL, east=s.ve, north=s.vn, altitude=s.vu, ve=a.x, vn=a.y, vu=a.z)


@physics
def slide(t, s, p):  # along the rail; held until the thrust lifts
    air, stream = flow(s, p)
    q, v = Quaternion(s.q0, s.q1, s.q2, s.q3), norm(stream)
    drag = 0.5 * air.density * v * v * AREA * p.drag_factor * DRAG(v / air.speed_of_sound)
    nose = transformed_back(q, Vector(0.0, 0.0, 1.0))
    a = (p.thrust_factor * THRUST(t) - drag) / (dry(p)[0].mass + propellant(t).mass) + nose.z * weight(s).z
    return point(s, scaled(maximum(a, 0.0), nose))


@physics
def loads(p, air, stream, w, centre, thrust):  # (force, moment) in body axes: axial force, lift of three parts
    mach, speed = norm(stream) / air.speed_of_sound, norm(stream)
    fins = fins_lift_area(mach, 4, SPAN, ROOT, TIP, RADIUS)
    f1, m1 = lift_of_part(air.density, stream, w, NOSE - centre, NOSE_LIFT)
    f2, m2 = lift_of_part(air.density, stream, w, FINS - centre, fins)
    f3, m3 = lift_of_part(air.density, stream, w, TAIL - centre, TAIL_LIFT)
    drag = 0.5 * air.density * speed * speed * AREA * p.drag_factor * DRAG(mach)
    return added(added(f1, f2), Vector(f3.x, f3.y, thrust - drag)), added(added(m1, m2), m3)


@physics
def free(s, p, fuel, thrust):  # six degrees of freedom
    air, stream = flow(s, p)
    q, v, w = Quaternion(s.q0, s.q1, s.q2, s.q3), Vector(s.ve, s.vn, s.vu), Vector(s.wx, s.wy, s.wz)
    rocket, centre = dry(p)
    force, moment = loads(p, air, transformed(q, stream), w, centre, thrust)
    undamped = 0.75 * fuel.rate * rocket.nozzle**2  # RocketPy's jet takes a quarter of this away with the rotation
    moment = Vector(moment.x - undamped * w.x, moment.y - undamped * w.y, moment.z)
    push, turn = rocket_accelerations(rocket, fuel, w, force, moment, transformed(q, weight(s)))
    lever = -2.0 * rocket.propellant * fuel.mass / (rocket.mass + fuel.mass)  # not mirrored in RocketPy
    push = Vector(push.x + lever * turn.y, push.y - lever * turn.x, push.z)
    a, d = subtracted(transformed_back(q, push), scaled(2.0, cross(OMEGA, v))), derivative(q, w)
    return State(east=v.x, north=v.y, altitude=v.z, ve=a.x, vn=a.y, vu=a.z, q0=d.q0, q1=d.q1, q2=d.q2, q3=d.q3,
                 wx=turn.x, wy=turn.y, wz=turn.z)  # fmt: skip


@physics
def burn(t, s, p):
    return free(s, p, propellant(t), p.thrust_factor * THRUST(t))


@physics
def coast(s, p):
    return free(s, p, EMPTY, 0.0)


@physics
def hang(s, p, phase):  # a point under a parachute
    air, stream = flow(s, p)
    area = where(phase.main > 0.5, p.main_area, p.drogue_area)
    a = parachute_acceleration(air.density, stream, dry(p)[0].mass, area, -weight(s).z)
    return point(s, subtracted(a, scaled(2.0, cross(OMEGA, Vector(s.ve, s.vn, s.vu)))))


@physics
def left_rail(s):  # beyond the end of the rail [m^2]
    return s.east * s.east + s.north * s.north + (s.altitude - ELEVATION) ** 2 - RAIL * RAIL


@physics
def height(s):
    return s.altitude - ELEVATION


@physics
def observe(s):
    return Outputs(height=height(s), speed=norm(Vector(s.ve, s.vn, s.vu)), east=s.east, north=s.north, sink=-s.vu)


LANDING = {"ground": Event(height, "falling", "stop")}
APOGEE = Event(physics(lambda s: s.vu), "falling", to="drogue", after="drogue_lag")
MAIN = Event(physics(lambda s: height(s) - 800.0), "falling", to="main", after="main_lag")
MODEL = model(
    name="calisto", title="Calisto from the rail to the ground", inputs=Inputs, states=State, outputs=Outputs,
    metrics=Metrics, clock=AdaptiveStep(until=2000.0, rtol=1e-6, atol=1e-6), initial=initial, observe=observe,
    phases={
        "rail": Phase(slide, events={"rail_exit": Event(left_rail, "rising", to="powered")}),
        "powered": Phase(burn, events={"burn_out": Event(physics(lambda t: t - BURN), "rising", to="coast")}),
        "coast": Phase(coast, events={"apogee": APOGEE, **LANDING}),
        "drogue": Phase(hang, events={"main": MAIN, **LANDING}),
        "main": Phase(hang, events=LANDING),
    },
)  # fmt: skip
