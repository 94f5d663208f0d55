"""Calisto, a student rocket: rail, six degrees of freedom under power and in coast, two parachutes with lag.

Vehicle, motor, curves and equations of motion are those of RocketPy 1.13 (G. H. Ceotto et al., J. Aerosp. Eng. 34(6),
2021, doi 10.1061/(ASCE)AS.1943-5525.0001331; thrust.csv and drag.csv are from its repository, MIT licence), so that
flights can be compared.  As there, places of nozzle and centre of mass on the axis count from the centre of dry mass to
the tail, those of nose, fins and tail cone to the nose.  Axes: x east, y north, z up from sea level; z of the body to
the nose.
"""

from math import atan, cos, pi, radians, sin

import numpy as np

from mc_engine.lanes import acos, maximum, minimum, physics, sqrt, where
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
from mc_engine.physics.air import us76_air
from mc_engine.physics.curves import curve, wind_profile
from mc_engine.physics.rotations import Quaternion, derivative, euler_sequence, transformed, transformed_back
from mc_engine.physics.vectors import Vector, added, cross, norm, scaled, subtracted

# ---- the vehicle, SI: masses, places on the axis from the tail, radii
LATITUDE, ELEVATION, RAIL = radians(32.990254), 1400.0, 3.8632  # length of the rail above the upper button
RADIUS, BODY_MASS, MOTOR_DRY_MASS, NOZZLE = 0.0635, 14.426, 1.815, -1.255
AREA = pi * RADIUS**2
BURN, GRAINS, DENSITY, OUTER, INNER, HEIGHT, GAP = 3.9, 5, 1815.0, 0.033, 0.015, 0.12, 0.005
PROPELLANT, DRY_MOTOR = NOZZLE + 0.397, NOZZLE + 0.317  # centres of mass
I_BODY, I_MOTOR, I_AXIAL = 6.321, 0.125, 0.034 + 0.002
NOSE, FINS, TAIL = 1.278 - 0.279145, -1.04956 - 0.055, -1.194656 - 0.028130841121495328  # centres of pressure
NOSE_LIFT, TAIL_LIFT = 2.0, 2.0 * ((0.0435 / RADIUS) ** 2 - 1.0)  # slopes of the lift coefficients
SPAN, ROOT, TIP = 0.1, 0.12, 0.04
SLENDER = 4.0 * SPAN / (ROOT + TIP) / cos(atan(0.5 * (ROOT - TIP) / SPAN))  # aspect ratio over cosine of the sweep
BY_BODY = 2.0 * (1.0 + RADIUS / (SPAN + RADIUS))  # lift of the four fins over that of one alone
JET = 0.5 * 0.033**2  # gyration of the nozzle's jet [m^2]
S2, EARTH_RATE = sin(LATITUDE) ** 2, 7.292115e-5
GROUND = 9.7803253359 * (1.0 + 1.931852652458e-3 * S2) / (1.0 - 6.694379990141e-3 * S2) ** 0.5  # eq. 4-1
FALL = 2.0 / 6378137.0 * (1.0 + 3.352810665e-3 + 3.449786506841e-3 - 2.0 * 3.352810665e-3 * S2)
OMEGA = Vector(0.0, EARTH_RATE * cos(LATITUDE), EARTH_RATE * sin(LATITUDE))


# ---- the motor: hollow cylinders that burn inside and at both ends; what the thrust needs of them is burnt
THRUST = curve("thrust.csv", x="time_s", y="thrust_n")
DRAG = curve("drag.csv", x="mach", y="cd")
T = np.linspace(0.0, BURN, 3901)  # holds all points of the thrust curve
FULL = GRAINS * DENSITY * pi * (OUTER**2 - INNER**2) * HEIGHT
IMPULSE = np.concatenate([[0.0], np.cumsum(0.5 * (THRUST(T)[1:] + THRUST(T)[:-1]) * np.diff(T))])
EXHAUST = IMPULSE[-1] / FULL  # speed [m/s], constant
LEFT = FULL - IMPULSE / EXHAUST
_BURNT = np.linspace(0.0, OUTER - INNER, 100_001)  # depth
_RADIUS = INNER + np.interp(FULL - LEFT, FULL - GRAINS * DENSITY * pi * (OUTER**2 - (INNER + _BURNT) ** 2)
                            * (HEIGHT - 2.0 * _BURNT), _BURNT)  # fmt: skip
_LENGTH = HEIGHT - 2.0 * (_RADIUS - INNER)
_ACROSS = LEFT * (0.25 * (OUTER**2 + _RADIUS**2) + _LENGTH**2 / 12.0 + 10.0 * (HEIGHT + GAP) ** 2 / GRAINS)
_AXIAL = LEFT * 0.5 * (OUTER**2 + _RADIUS**2)
MASS, ACROSS, AXIAL = (curve(x=T, y=values, kind="cubic") for values in (LEFT, _ACROSS, _AXIAL))
ACROSS_RATE, AXIAL_RATE = (curve(x=T, y=np.gradient(values, T)) for values in (_ACROSS, _AXIAL))
FLOW_RATE = curve(x=T[:-1] + 0.0005, y=-np.diff(THRUST(T)) / np.diff(T) / EXHAUST, kind="nearest")  # kg/s^2

# ---- what is uncertain, what is flown, what is looked at
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
rail_attitude, _ = euler_sequence("313")
wind = wind_profile("wind.csv", "altitude_m", "north_m_s", "east_m_s")


@physics
def initial(p):
    q = rail_attitude(-p.heading, p.inclination - 0.5 * pi, 0.0)
    return State(east=0.0, north=0.0, altitude=ELEVATION, ve=0.0, vn=0.0, vu=0.0, q0=q.q0, q1=q.q1, q2=q.q2, q3=q.q3,
                 wx=0.0, wy=0.0, wz=0.0)  # fmt: skip


@physics
def gravity(h):  # WGS 84 normal gravity [m/s^2] above the ellipsoid (NIMA TR8350.2, eq. 4-3)
    return GROUND * (1.0 - FALL * h + 3.0 / 6378137.0**2 * h * h)


@physics
def flow(s, p):  # (air, velocity of the air against the rocket [m/s])
    w = scaled(p.wind_factor, wind(s.altitude))  # north, east, down
    return us76_air(s.altitude), Vector(w.y - s.ve, w.x - s.vn, -s.vu)


@physics
def dry(p):  # (mass [kg], centre [m], inertia across about it) without propellant
    m = p.body_mass + MOTOR_DRY_MASS
    centre = MOTOR_DRY_MASS * DRY_MOTOR / m
    return m, centre, I_BODY + p.body_mass * centre * centre + I_MOTOR + MOTOR_DRY_MASS * (DRY_MOTOR - centre) ** 2


@physics
def point(s, a):  # derivative of the state without rotation; a : acceleration [m/s^2]
    return State(east=s.ve, north=s.vn, altitude=s.vu, ve=a.x, vn=a.y, vu=a.z, q0=0.0, q1=0.0, q2=0.0, q3=0.0,
                 wx=0.0, wy=0.0, wz=0.0)  # fmt: skip


@physics
def slide(t, s, p):  # along the rail; held until the thrust lifts
    air, stream = flow(s, p)
    q, v = Quaternion(s.q0, s.q1, s.q2, s.q3), norm(stream)
    drag = 0.5 * air.density * v * v * AREA * p.drag_factor * DRAG(v / air.speed_of_sound)
    nose = transformed_back(q, Vector(0.0, 0.0, 1.0))
    a = (p.thrust_factor * THRUST(t) - drag) / (dry(p)[0] + MASS(t)) - nose.z * gravity(s.altitude)
    return point(s, scaled(maximum(a, 0.0), nose))


@physics
def lift(air, stream, w, place, slope):  # (force, moment about the centre of dry mass) of one surface
    own = Vector(stream.x - w.y * place, stream.y + w.x * place, stream.z)
    speed, across = norm(own), sqrt(own.x * own.x + own.y * own.y)
    alpha = where(across > 0.0, acos(minimum(-own.z / speed, 1.0)), 0.0)
    k = 0.5 * air.density * speed * speed * AREA * slope * alpha / where(across > 0.0, across, 1.0)
    return Vector(k * own.x, k * own.y, 0.0), Vector(-place * k * own.y, place * k * own.x, 0.0)


@physics
def fin_slope(mach):  # of one fin: F. W. Diederich, NACA TN 2335, with Prandtl and Glauert's factor
    beta = sqrt(where(mach < 0.8, 1.0 - mach * mach, where(mach < 1.1, 0.36, mach * mach - 1.0)))
    f = SLENDER * beta
    return 4.0 * pi * SPAN * SPAN / AREA / (2.0 + sqrt(f * f + 4.0))


@physics
def loads(s, p, air, stream, w):  # (force, moment) of the air in body axes: drag along the axis, lift of three surfaces
    centre, speed = dry(p)[1], norm(stream)
    drag = 0.5 * air.density * speed * speed * AREA * p.drag_factor * DRAG(speed / air.speed_of_sound)
    f1, m1 = lift(air, stream, w, NOSE - centre, NOSE_LIFT)
    f2, m2 = lift(air, stream, w, FINS - centre, BY_BODY * fin_slope(speed / air.speed_of_sound))
    f3, m3 = lift(air, stream, w, TAIL - centre, TAIL_LIFT)
    force = added(added(f1, f2), f3)
    return Vector(force.x, force.y, -drag), added(added(m1, m2), m3)


@physics
def moved(s, q, w, push, turn):  # derivative of the state from the acceleration [m/s^2, body] and the angular one
    v = Vector(s.ve, s.vn, s.vu)
    a, d = subtracted(transformed_back(q, push), scaled(2.0, cross(OMEGA, v))), derivative(q, w)
    return State(east=v.x, north=v.y, altitude=v.z, ve=a.x, vn=a.y, vu=a.z, q0=d.q0, q1=d.q1, q2=d.q2, q3=d.q3,
                 wx=turn.x, wy=turn.y, wz=turn.z)  # fmt: skip


@physics
def burn(t, s, p):  # six degrees of freedom with a motor that loses mass
    air, stream = flow(s, p)
    q, w = Quaternion(s.q0, s.q1, s.q2, s.q3), Vector(s.wx, s.wy, s.wz)
    body, centre, across = dry(p)
    fuel, rate, nozzle, arm = MASS(t), -THRUST(t) / EXHAUST, centre - NOZZLE, centre - PROPELLANT
    m = body + fuel
    r = arm * fuel / m  # of the centre of mass; its second derivative is left out, as in RocketPy: 0.4 m of the apogee
    dr = arm * rate * body / (m * m)
    i, axial = across + ACROSS(t) + fuel * arm * arm, I_AXIAL + AXIAL(t)
    jet = rate * (0.5 * JET + 0.25 * nozzle * nozzle) - ACROSS_RATE(t) - rate * arm * arm
    thrust = p.thrust_factor * THRUST(t) - 2.0 * rate * dr + FLOW_RATE(t) * (nozzle - r)
    sway = 2.0 * rate * (nozzle - r) - 2.0 * m * dr
    weight = transformed(q, Vector(0.0, 0.0, -m * gravity(s.altitude)))
    force, moment = loads(s, p, air, transformed(q, stream), w)
    fx = force.x + weight.x + w.y * sway - m * r * w.x * w.z
    fy = force.y + weight.y - w.x * sway - m * r * w.y * w.z
    fz = force.z + weight.z + thrust + m * r * (w.x * w.x + w.y * w.y)
    turn = Vector(((i - axial) * w.y * w.z + jet * w.x + moment.x + r * (fy - weight.y)) / (i - m * r * r),
                  ((axial - i) * w.x * w.z + jet * w.y + moment.y - r * (fx - weight.x)) / (i - m * r * r),
                  (rate * JET * w.z - AXIAL_RATE(t) * w.z + moment.z) / axial)  # fmt: skip
    return moved(s, q, w, Vector(fx / m + r * turn.y, fy / m - r * turn.x, fz / m), turn)


@physics
def coast(s, p):  # six degrees of freedom of the empty rocket
    air, stream = flow(s, p)
    q, w = Quaternion(s.q0, s.q1, s.q2, s.q3), Vector(s.wx, s.wy, s.wz)
    m, _, i = dry(p)
    force, moment = loads(s, p, air, transformed(q, stream), w)
    pull = transformed(q, Vector(0.0, 0.0, -gravity(s.altitude)))
    gyro = (i - I_AXIAL) * w.z
    turn = Vector((gyro * w.y + moment.x) / i, (moment.y - gyro * w.x) / i, moment.z / I_AXIAL)
    return moved(s, q, w, added(scaled(1.0 / m, force), pull), turn)


@physics
def hang(s, p, phase):  # a point under a parachute, which takes half a sphere of air along
    (air, stream), m = flow(s, p), dry(p)[0]
    area = where(phase.main > 0.5, p.main_area, p.drogue_area)
    moving = m + 2.0 / 3.0 * pi * air.density * sqrt(area / (1.4 * pi)) ** 3
    pull = scaled(0.5 * air.density * area * norm(stream) / moving, stream)
    a = subtracted(pull, scaled(2.0, cross(OMEGA, Vector(s.ve, s.vn, s.vu))))
    return point(s, Vector(a.x, a.y, a.z - m / moving * gravity(s.altitude)))


@physics
def left_rail(s):  # beyond the end of the rail [m^2]
    return s.east * s.east + s.north * s.north + (s.altitude - ELEVATION) ** 2 - RAIL * RAIL


@physics
def burnt(t):
    return t - BURN


@physics
def climb(s):
    return s.vu


@physics
def above_main(s):
    return height(s) - 800.0


@physics
def height(s):
    return s.altitude - ELEVATION


@physics
def observe(s):
    return Outputs(height=height(s), speed=norm(Vector(s.ve, s.vn, s.vu)), east=s.east, north=s.north, sink=-s.vu)


LANDING = {"ground": Event(height, "falling", "stop")}
MODEL = model(
    name="calisto", title="Calisto from the rail to the ground", inputs=Inputs, states=State, outputs=Outputs,
    metrics=Metrics, clock=AdaptiveStep(until=2000.0, rtol=1e-6, atol=1e-6), initial=initial, observe=observe,
    phases={
        "rail": Phase(slide, events={"rail_exit": Event(left_rail, "rising", to="powered")}),
        "powered": Phase(burn, events={"burn_out": Event(burnt, "rising", to="coast")}),
        "coast": Phase(coast, events={"apogee": Event(climb, "falling", to="drogue", after="drogue_lag"), **LANDING}),
        "drogue": Phase(hang, events={"main": Event(above_main, "falling", to="main", after="main_lag"), **LANDING}),
        "main": Phase(hang, events=LANDING),
    },
)  # fmt: skip
