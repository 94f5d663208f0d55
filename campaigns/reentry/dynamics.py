"""Flight of an entering vehicle: a point mass with drag and banked lift about a turning planet.

Planet-fixed Cartesian axes (x to longitude 0, z to the north pole), SI.  The motion is that of Vinh's equations
(`guidance/reference.py`), in components that have no singularity: a vehicle may start at rest, fall vertically, and
pass over a pole.  On a flat Earth x points ahead, y to the left and z up.
"""

from collections import namedtuple

from campaigns.reentry.air import logarithm_of_density, sound_speed
from campaigns.reentry.bank import angle_at
from campaigns.reentry.inputs import CHOICES
from campaigns.reentry.vehicles import apollo_shares
from campaigns.reentry.weather import weather_at
from mc_engine.lanes import any_lane, atan2, exp, maximum, merged, physics, replace, sincos, sqrt, where
from mc_engine.model import states
from mc_engine.physics.aerodynamics import axial_coefficient, lift_direction
from mc_engine.physics.frames import over_ellipsoid, velocity_angles
from mc_engine.physics.gravity import j2_perturbation, point_mass
from mc_engine.physics.heating import DKR_EXPONENT, detra_kemp_riddell, sutton_graves
from mc_engine.physics.vectors import Matrix, Vector, added, added_scaled, cross, dot, matrix_times, norm, scaled

NEVER = -1.0  # value of an event that is not looked for
NAN = float("nan")

State = states(
    **{f"{axis}_m": f"place, planet-fixed {axis}" for axis in "xyz"},
    **{f"v{axis}_m_s": f"velocity over ground, planet-fixed {axis}" for axis in "xyz"},
    heat_load_j_m2="convective heat load at the stagnation point",
)
# the discrete state: what the flight has met so far, and what the guidance keeps
Memory = namedtuple("Memory", "met steering")
# pressed, hottest: the moments of the largest dynamic pressure and heat rate; what has not come is not a number
Met = namedtuple("Met", "pressed hottest lift exits pull_out first_exit")
Lift = namedtuple("Lift", "cos_bank sin_bank rolls")  # present direction, and how often it was changed
# by the names of the metrics, SI
PullOut = namedtuple("PullOut", "min_altitude min_altitude_time", defaults=(NAN, NAN))
Exit = namedtuple(
    "Exit",
    "exit_time exit_speed exit_flight_path_angle exit_inertial_speed exit_apoapsis_altitude",
    defaults=(NAN, NAN, NAN, NAN, NAN),
)
Steering = namedtuple(
    "Steering", "turn reckoning side active samples saturated reversals", defaults=(0.0, 0.0, 0.0, 0.0)
)
# time of the last sample, bank [rad] and its rate there and at the next
Turn = namedtuple("Turn", "sampled bank bank_rate next_bank next_rate", defaults=(0.0, 0.0, 0.0, 0.0, 0.0))
# what law 3 keeps: speed lost W, reckoned range and its rate, measured deceleration, its logarithm over the stored one
Reckoning = namedtuple("Reckoning", "lost range rate axial excess", defaults=(0.0, 0.0, 0.0, 0.0, 0.0))
Events = namedtuple("Events", "pressure_peak heat_peak pull_out roll leave stop left missed over")
Place = namedtuple("Place", "altitude climb up")  # climb: rate of the altitude; up: unit vector
# slope: of the logarithm of the density, by altitude [1/m]; v, speed: of the vehicle through the air [m/s]; shear: rate
# of the speed, times it, per metre climbed, that a wind which changes with altitude brings [m/s^2]
Air = namedtuple("Air", "density slope temperature v speed shear")
# areas over mass [m^2/kg] of drag, lift, total load, load along the body axis and along the accelerometer's
Force = namedtuple("Force", "drag lift total axial sensed")
Exposure = namedtuple("Exposure", "place air force dynamic_pressure heat_rate")
# a time [s], and outputs there, SI
Moment = namedtuple("Moment", "time altitude speed load axial_load dynamic_pressure heat_rate")


@physics
def initial(p):
    """State at entry."""
    return merged(State, p, heat_load=0.0)


@physics
def velocity(s):
    """Velocity over ground [m/s], planet-fixed axes."""
    return Vector(s.vx, s.vy, s.vz)


@physics
def from_planned_entry(s, p):
    """The place [m] along the axes of the planned entry: up, ahead, to the right."""
    return matrix_times(Matrix(p.ex, p.ey, p.ez, p.fx, p.fy, p.fz, p.nx, p.ny, p.nz), s)


@physics
def place_of(s, p, o):
    """The `Place` in planet-fixed axes, SI.

    The altitude changes like r less the ellipsoid's radius: r' - (dR/d sin^2) (sin^2)', derived here with sin = z / r.
    """
    if o.shape == CHOICES.shape.flat:
        return Place(altitude=s.z, climb=s.vz, up=Vector(0.0, 0.0, 1.0))
    r2 = dot(s, s)
    inverse2 = 1.0 / r2
    r = sqrt(r2)
    inverse = r * inverse2
    altitude, slope = over_ellipsoid(r, inverse, s.z * s.z * inverse2, p.polar_radius, p.e2)
    radial = dot(s, velocity(s)) * inverse
    # rate of the squared sine of latitude, z^2 / r^2
    climb = radial - slope * (2.0 * s.z * inverse2 * (s.vz - s.z * radial * inverse))
    return Place(altitude, climb, up=scaled(inverse, s))


@physics
def air_of(s, place, p, o):
    """The `Air` where the vehicle is, and how it goes through it, SI: the wind blows along the local east and north.

    Derived here: shear = -(V . dW/dh), by which the speed through the air changes per metre climbed, times that speed.
    """
    value, slope, temperature = logarithm_of_density(place.altitude, p, o)
    v, up, shear = velocity(s), place.up, 0.0
    if o.weather > 0.5:
        w = weather_at(place.altitude, p.weather, o.tables)
        value, slope = value + w.density, slope + w.density_slope
        level = sqrt(up.x * up.x + up.y * up.y)
        inverse = 1.0 / maximum(level, 1e-9)  # over a pole the wind comes from nowhere
        east = Vector(-up.y * inverse, up.x * inverse, 0.0)
        north = Vector(-up.z * up.x * inverse, -up.z * up.y * inverse, level)
        v = added_scaled(added_scaled(v, -w.east, east), -w.north, north)
        shear = -(w.east_slope * dot(v, east) + w.north_slope * dot(v, north))
    return Air(p.density_factor * exp(value), slope, temperature, v, norm(v), shear)


@physics
def force_of(air, p, o):
    """Areas over mass [m^2/kg] in the flow about the craft; by the Mach number if the vehicle has curves over it."""
    if o.vehicle != CHOICES.vehicle.apollo:
        return merged(Force, p)
    of_drag, of_lift = apollo_shares(air.speed / sound_speed(air.temperature))
    drag, lift = of_drag * p.drag, of_lift * p.lift
    return Force(
        drag, lift, total=sqrt(drag * drag + lift * lift),
        axial=axial_coefficient(drag, lift, p.cos_trim, p.sin_trim),
        sensed=axial_coefficient(drag, lift, p.cos_tilted, p.sin_tilted),
    )  # fmt: skip


@physics
def exposure_of(s, p, o):
    """The `Exposure` of a state, SI: dynamic pressure rho V^2 / 2, convective heat rate at the stagnation point."""
    place = place_of(s, p, o)
    air = air_of(s, place, p, o)
    if o.heating == CHOICES.heating.sutton_graves:
        flux = sutton_graves(air.density, air.speed, p.heating)
    else:
        flux = detra_kemp_riddell(air.density, air.speed, p.heating)
    return Exposure(place, air, force_of(air, p, o), 0.5 * air.density * dot(air.v, air.v), flux)


@physics
def field(s, p, o):
    """Acceleration [m/s^2] by gravity and, on a turning planet, the centrifugal force."""
    if o.gravity == CHOICES.gravity.none:
        g = Vector(0.0, 0.0, 0.0)
    elif o.shape == CHOICES.shape.flat:
        g = Vector(0.0, 0.0, -p.gravity)
    else:
        g = Vector(*point_mass(s.x, s.y, s.z, p.mu))
    if o.gravity == CHOICES.gravity.j2:
        g = added(g, Vector(*j2_perturbation(s.x, s.y, s.z, p.mu)))
    return Vector(g.x + p.rate * p.rate * s.x, g.y + p.rate * p.rate * s.y, g.z)


@physics
def bank_of(t, m, o):
    """(cosine, sine) of the bank angle [rad]; the sine is 0 in a planar flight."""
    if o.guidance == CHOICES.guidance.none:
        return m.met.lift.cos_bank, m.met.lift.sin_bank
    sine, cosine = sincos(angle_at(t, m.steering.turn, o.guidance_period))
    return cosine, (1.0 - o.planar) * sine


@physics
def rhs(t, s, m, p, o):
    """Time derivative of the state, SI: field, Coriolis force, drag, lift, heat rate.  Vinh, chapter 2, as vectors."""
    place, air, force, _, flux = exposure_of(s, p, o)
    g, v, up = field(s, p, o), air.v, place.up
    push = 0.5 * air.density * air.speed  # dynamic pressure over speed
    k, twice = push * force.drag, 2.0 * p.rate
    a = Vector(g.x + twice * s.vy - k * v.x, g.y - twice * s.vx - k * v.y, g.z - k * v.z)
    if any_lane(abs(p.lift) > 0.0):
        cos_bank, sin_bank = bank_of(t, m, o)
        lift = lift_direction(v.x, v.y, v.z, up.x, up.y, up.z, air.speed, cos_bank, sin_bank)
        a = added_scaled(a, push * air.speed * force.lift, Vector(*lift))
    return State(x=s.vx, y=s.vy, z=s.vz, vx=a.x, vy=a.y, vz=a.z, heat_load=flux)


@physics
def crossings(t, s, m, p, o):
    """Peaks of dynamic pressure and heat rate, pull-out, rolls, and the ends of the flight.

    A peak is where the rate falls through zero.  Both quantities are rho^a V^b, whose logarithm has the rate
    a rho'/rho climb + b v.a/V^2, derived here; the events are V^2 times that [m^2/s^3], so that a vehicle at rest
    divides nothing by zero.  Rolls are sines of flight-path angles, ends altitudes [m] and times [s].
    """
    place, air, force, _, _ = exposure_of(s, p, o)
    v2 = dot(air.v, air.v)
    # v.a through the air: lift does no work, and the Coriolis force of a wind is left out
    braking = 0.5 * air.density * force.drag * (v2 * air.speed)
    gain = dot(air.v, field(s, p, o)) - braking + air.shear * place.climb
    thicker = air.slope * place.climb * v2
    power = 3.0 if o.heating == CHOICES.heating.sutton_graves else DKR_EXPONENT
    sine = dot(velocity(s), place.up) / where(air.speed > 0.0, air.speed, 1.0)  # winds are level
    rolls = m.met.lift.rolls
    above = place.altitude - p.exit
    stops = o.on_exit == CHOICES.on_exit.stop
    return Events(
        pressure_peak=thicker + 2.0 * gain,
        heat_peak=0.5 * thicker + power * gain,
        pull_out=where(m.met.pull_out.min_altitude_time >= 0.0, NEVER, place.climb),
        roll=where(rolls == 0.0, sine - p.roll_at, where(rolls == 1.0, p.roll_back_at - sine, NEVER)),
        leave=NEVER if stops else above,
        stop=place.altitude - p.stop_altitude,
        left=above if stops else NEVER,
        missed=place.altitude - p.missed if stops else NEVER,
        over=p.stop_time - t,
    )


@physics
def moment_of(t, s, exposure):
    """The `Moment` of a state and its `Exposure`, SI."""
    pressure, force, speed = exposure.dynamic_pressure, exposure.force, norm(velocity(s))
    load, axial_load = pressure * force.total, pressure * force.axial
    return merged(Moment, exposure, exposure.place, time=t, speed=speed, load=load, axial_load=axial_load)


@physics
def start(p, o):
    """The discrete state at entry, SI: peaks begin with the values there."""
    s, turn = initial(p), Turn(bank=p.first_bank, next_bank=p.first_bank)
    now = moment_of(0.0, s, exposure_of(s, p, o))
    met = Met(now, now, Lift(p.cos_bank, p.sin_bank, rolls=0.0), exits=0.0, pull_out=PullOut(), first_exit=Exit())
    return Memory(met, Steering(turn, Reckoning(), side=where(p.first_bank < 0.0, -1.0, 1.0)))


@physics
def exit_of(t, s, p, o):
    """The `Exit`, SI; the apoapsis, about a point mass, is not a number on a hyperbola and over a flat Earth."""
    v = norm(velocity(s))
    if o.shape == CHOICES.shape.flat:
        return Exit(t, v, atan2(s.vz, sqrt(s.vx * s.vx + s.vy * s.vy)), v, NAN)
    angle, _ = velocity_angles(s.x, s.y, s.z, s.vx, s.vy, s.vz)
    w = Vector(s.vx - p.rate * s.y, s.vy + p.rate * s.x, s.vz)
    h = cross(s, w)
    inverse_a = 2.0 / norm(s) - dot(w, w) / p.mu
    bound = inverse_a > 0.0
    a = 1.0 / where(bound, inverse_a, 1.0)
    e2 = maximum(1.0 - dot(h, h) / (p.mu * a), 0.0)
    return Exit(t, v, angle, norm(w), where(bound, a * (1.0 + sqrt(e2)) - p.radius, NAN))


@physics
def switch(t, s, m, p, o, hit):
    """Keep the larger of each peak, the first pull-out and the first exit, SI; change the bank where a roll is due."""
    now, met = moment_of(t, s, exposure_of(s, p, o)), m.met
    roll, leaving = hit.roll > 0.5, hit.leave > 0.5
    rolled, back = Lift(p.cos_rolled, p.sin_rolled, 1.0), Lift(p.cos_bank, p.sin_bank, 2.0)
    higher = (hit.pressure_peak > 0.5) & (now.dynamic_pressure > met.pressed.dynamic_pressure)
    hotter = (hit.heat_peak > 0.5) & (now.heat_rate > met.hottest.heat_rate)
    met = Met(
        pressed=where(higher, now, met.pressed),
        hottest=where(hotter, now, met.hottest),
        lift=where(roll & (met.lift.rolls == 0.0), rolled, where(roll, back, met.lift)),
        exits=where(leaving, met.exits + 1.0, met.exits),
        pull_out=where(hit.pull_out > 0.5, PullOut(now.altitude, t), met.pull_out),
        first_exit=where(leaving & (met.exits == 0.0), exit_of(t, s, p, o), met.first_exit),
    )
    return s, replace(m, met=met)
