"""Flight of an entering vehicle: a point mass with drag and banked lift about a turning planet.

Planet-fixed Cartesian axes (x to longitude 0, z to the north pole), SI.  The motion is that of Vinh's equations
(`vinh.py`), in components that have no singularity: a vehicle may start at rest, fall vertically, and pass over a pole.
On a flat Earth x points ahead, y to the left and z up.
"""

from collections import namedtuple

from campaigns.reentry.air import logarithm_of_density, sound_speed
from campaigns.reentry.bank import angle_at
from campaigns.reentry.inputs import APOLLO, FLAT, J2, NO_GRAVITY, STOP_ON_EXIT, SUTTON_GRAVES, UNGUIDED
from campaigns.reentry.vehicles import apollo_shares
from campaigns.reentry.weather import weather_at
from mc_engine.lanes import any_lane, atan2, exp, maximum, physics, sincos, sqrt, where
from mc_engine.model import states
from mc_engine.physics.aerodynamics import axial_coefficient, lift_direction
from mc_engine.physics.frames import over_ellipsoid, velocity_angles
from mc_engine.physics.gravity import j2_perturbation, point_mass
from mc_engine.physics.heating import DKR_EXPONENT, detra_kemp_riddell, sutton_graves

NEVER = -1.0  # value of an event that is not looked for
UNKNOWN = 1e300  # the pull-out, or the exit, has not come

State = states(
    x_m="place, planet-fixed x",
    y_m="place, planet-fixed y",
    z_m="place, planet-fixed z",
    vx_m_s="velocity over ground, planet-fixed x",
    vy_m_s="velocity over ground, planet-fixed y",
    vz_m_s="velocity over ground, planet-fixed z",
    heat_load_j_m2="convective heat load at the stagnation point",
)
# the discrete state: what the flight has met so far, and what the guidance keeps
Memory = namedtuple("Memory", "met steering")
Met = namedtuple("Met", "pressure loads flux pull_out lift exits first_exit")
Peak = namedtuple("Peak", "value time altitude speed")  # largest dynamic pressure and heat rate so far; SI
Loads = namedtuple("Loads", "total axial")  # areas over mass of the loads at the largest dynamic pressure
PullOut = namedtuple("PullOut", "altitude time", defaults=(UNKNOWN, UNKNOWN))
Lift = namedtuple("Lift", "cos_bank sin_bank rolls")  # present direction, and how often it was changed
# from the atmosphere: speed and flight-path angle over ground, inertial speed, altitude of the apoapsis
Exit = namedtuple("Exit", "time speed angle inertial apoapsis", defaults=(UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN))
Steering = namedtuple(
    "Steering", "turn reckoning side active samples saturated reversals", defaults=(0.0, 0.0, 0.0, 0.0)
)
# time of the last sample, bank [rad] and its rate there and at the next
Turn = namedtuple("Turn", "sampled bank bank_rate next_bank next_rate", defaults=(0.0, 0.0, 0.0, 0.0, 0.0))
# what law 3 keeps: speed lost W, reckoned range, present rate of it, measured deceleration, its logarithm over the
# stored one
Reckoning = namedtuple("Reckoning", "lost range rate axial excess", defaults=(0.0, 0.0, 0.0, 0.0, 0.0))
Parameters = namedtuple(
    "Parameters",
    "x y z vx vy vz "  # first state
    "mu rate polar_radius e2 gravity "  # planet; gravity: of a flat Earth
    "log_density inverse_scale temperature density_factor density_deviation "  # exponential atmosphere; its dispersions
    "drag lift total axial heating "  # areas over mass [m^2/kg]; coefficient of the heating correlation
    "cos_trim sin_trim cos_tilted sin_tilted "  # of the body axis and the accelerometer's
    "cos_bank sin_bank cos_rolled sin_rolled roll_at roll_back_at "  # lift directions; sines of flight-path angles
    "stop_altitude exit stop_time "
    "ex ey ez fx fy fz nx ny nz "  # unit vectors to the planned entry place, ahead and to the right of it
    "radius heading speed path aim_down target_crossrange aimed tx ty tz "  # of the ground; entry over ground; target
    "first_bank bank_error bank_lag bank_rate_limit reversal_floor reversal_width load_limit "
    "reference planned_range planned_share planned_lift_to_drag "  # index in the tables; what the laws know
    "sensed cos_misaligned sin_misaligned accelerometer_bias accelerometer_scale_error accelerometer_noise weather "
    "corridor_load corridor_heat_rate corridor_heat_load corridor_dynamic_pressure "
    "nav_range_error nav_altitude_error nav_speed_error nav_flight_path_angle_error nav_climb_error",
)
Events = namedtuple("Events", "pressure_peak heat_peak pull_out roll leave stop left over")
Place = namedtuple("Place", "altitude climb ux uy uz")  # climb: rate of the altitude; u: unit vector up
# slope: of the logarithm of the density, by altitude [1/m]; v..: velocity through the air [m/s]; shear: rate of the
# speed through the air, times it, per metre climbed, that a wind which changes with altitude brings [m/s^2]
Air = namedtuple("Air", "density slope temperature vx vy vz shear")
# areas over mass [m^2/kg] of drag, lift, total load, load along the body axis and along the accelerometer's
Force = namedtuple("Force", "drag lift total axial sensed")
# what peaks, and where: dynamic pressure [Pa], heat rate [W/m^2], altitude [m], speed over ground [m/s], `Force`
Exposure = namedtuple("Exposure", "pressure flux altitude speed force")


@physics
def initial(p):
    """State at entry."""
    return State(x=p.x, y=p.y, z=p.z, vx=p.vx, vy=p.vy, vz=p.vz, heat_load=0.0)


@physics
def place_of(s, p, o):
    """Altitude [m], its rate [m/s], and the direction up, planet-fixed axes.

    The rate is that of r less the ellipsoid's radius: r' - (dR/d sin^2) (sin^2)', derived here with sin = z / r.
    """
    if o.shape == FLAT:
        place = Place(altitude=s.z, climb=s.vz, ux=0.0, uy=0.0, uz=1.0)
    else:
        r2 = s.x * s.x + s.y * s.y + s.z * s.z
        inverse2 = 1.0 / r2
        r = sqrt(r2)
        inverse = r * inverse2
        altitude, slope = over_ellipsoid(r, inverse, s.z * s.z * inverse2, p.polar_radius, p.e2)
        radial = (s.x * s.vx + s.y * s.vy + s.z * s.vz) * inverse
        # rate of the squared sine of latitude, z^2 / r^2
        climb = radial - slope * (2.0 * s.z * inverse2 * (s.vz - s.z * radial * inverse))
        place = Place(altitude, climb, ux=s.x * inverse, uy=s.y * inverse, uz=s.z * inverse)
    return place


@physics
def air_of(s, place, p, o):
    """The `Air` where the vehicle is, and how it goes through it, SI: the wind blows along the local east and north.

    Derived here: shear = -(V . dW/dh), by which the speed through the air changes per metre climbed, times that speed.
    """
    value, slope, temperature = logarithm_of_density(place.altitude, p, o)
    vx, vy, vz, shear = s.vx, s.vy, s.vz, 0.0
    if o.weather > 0.5:
        w = weather_at(place.altitude, p.weather, o.tables)
        value, slope = value + w.density, slope + w.density_slope
        level = sqrt(place.ux * place.ux + place.uy * place.uy)
        inverse = 1.0 / maximum(level, 1e-9)  # over a pole the wind comes from nowhere
        ex, ey = -place.uy * inverse, place.ux * inverse
        nx, ny = -place.uz * place.ux * inverse, -place.uz * place.uy * inverse
        vx, vy, vz = vx - w.east * ex - w.north * nx, vy - w.east * ey - w.north * ny, vz - w.north * level
        shear = -(w.east_slope * (vx * ex + vy * ey) + w.north_slope * (vx * nx + vy * ny + vz * level))
    return Air(p.density_factor * exp(value), slope, temperature, vx, vy, vz, shear)


@physics
def force_of(air, speed, p, o):
    """Areas over mass at a speed [m/s] through the air; by the Mach number if the vehicle has curves over it."""
    force = Force(p.drag, p.lift, p.total, p.axial, p.sensed)
    if o.vehicle == APOLLO:
        of_drag, of_lift = apollo_shares(speed / sound_speed(air.temperature))
        drag, lift = of_drag * p.drag, of_lift * p.lift
        force = Force(
            drag, lift, total=sqrt(drag * drag + lift * lift),
            axial=axial_coefficient(drag, lift, p.cos_trim, p.sin_trim),
            sensed=axial_coefficient(drag, lift, p.cos_tilted, p.sin_tilted),
        )  # fmt: skip
    return force


@physics
def field(s, p, o):
    """Acceleration [m/s^2] by gravity and, on a turning planet, the centrifugal force."""
    if o.gravity == NO_GRAVITY:
        gx, gy, gz = 0.0, 0.0, 0.0
    elif o.shape == FLAT:
        gx, gy, gz = 0.0, 0.0, -p.gravity
    else:
        gx, gy, gz = point_mass(s.x, s.y, s.z, p.mu)
    if o.gravity == J2:
        jx, jy, jz = j2_perturbation(s.x, s.y, s.z, p.mu)
        gx, gy, gz = gx + jx, gy + jy, gz + jz
    centrifugal = p.rate * p.rate
    return gx + centrifugal * s.x, gy + centrifugal * s.y, gz


@physics
def heat_rate(density, speed, p, o):
    """Convective heat rate [W/m^2] at the stagnation point."""
    if o.heating == SUTTON_GRAVES:
        q = sutton_graves(density, speed, p.heating)
    else:
        q = detra_kemp_riddell(density, speed, p.heating)
    return q


@physics
def speed2(s):
    """Squared speed [m^2/s^2] over ground, or through the air."""
    return s.vx * s.vx + s.vy * s.vy + s.vz * s.vz


@physics
def bank_of(t, m, o):
    """(cosine, sine) of the bank angle [rad]; the sine is 0 in a planar flight."""
    if o.guidance == UNGUIDED:
        cosine, sine = m.met.lift.cos_bank, m.met.lift.sin_bank
    else:
        sine, cosine = sincos(angle_at(t, m.steering.turn, o.guidance_period))
        sine = (1.0 - o.planar) * sine
    return cosine, sine


@physics
def rhs(t, s, m, p, o):
    """Time derivative of the state, SI: field, Coriolis force, drag, lift, heat rate.  Vinh, chapter 2, as vectors."""
    place = place_of(s, p, o)
    air = air_of(s, place, p, o)
    v = sqrt(speed2(air))
    push = 0.5 * air.density * v  # dynamic pressure over speed
    gx, gy, gz = field(s, p, o)
    force = force_of(air, v, p, o)
    k, twice = push * force.drag, 2.0 * p.rate
    ax, ay, az = gx + twice * s.vy - k * air.vx, gy - twice * s.vx - k * air.vy, gz - k * air.vz
    if any_lane(abs(p.lift) > 0.0):
        cos_bank, sin_bank = bank_of(t, m, o)
        lx, ly, lz = lift_direction(air.vx, air.vy, air.vz, place.ux, place.uy, place.uz, v, cos_bank, sin_bank)
        lift = push * v * force.lift
        ax, ay, az = ax + lift * lx, ay + lift * ly, az + lift * lz
    return State(x=s.vx, y=s.vy, z=s.vz, vx=ax, vy=ay, vz=az, heat_load=heat_rate(air.density, v, p, o))


@physics
def crossings(t, s, m, p, o):
    """Peaks of dynamic pressure and heat rate, pull-out, rolls, and the ends of the flight.

    A peak is where the rate falls through zero.  Both quantities are rho^a V^b, whose logarithm has the rate
    a rho'/rho climb + b v.a/V^2, derived here; the events are V^2 times that [m^2/s^3], so that a vehicle at rest
    divides nothing by zero.  Rolls are sines of flight-path angles, ends altitudes [m] and times [s].
    """
    place = place_of(s, p, o)
    air = air_of(s, place, p, o)
    v2 = speed2(air)
    v = sqrt(v2)
    gx, gy, gz = field(s, p, o)
    # v.a through the air: lift does no work, and the Coriolis force of a wind is left out
    braking = 0.5 * air.density * force_of(air, v, p, o).drag * (v2 * v)
    gain = (air.vx * gx + air.vy * gy + air.vz * gz) - braking + air.shear * place.climb
    thicker = air.slope * place.climb * v2
    power = 3.0 if o.heating == SUTTON_GRAVES else DKR_EXPONENT
    sine = (s.vx * place.ux + s.vy * place.uy + s.vz * place.uz) / where(v > 0.0, v, 1.0)  # winds are level
    rolls = m.met.lift.rolls
    above = place.altitude - p.exit
    stops = o.on_exit == STOP_ON_EXIT
    return Events(
        pressure_peak=thicker + 2.0 * gain,
        heat_peak=0.5 * thicker + power * gain,
        pull_out=where(m.met.pull_out.altitude < UNKNOWN, NEVER, place.climb),
        roll=where(rolls == 0.0, sine - p.roll_at, where(rolls == 1.0, p.roll_back_at - sine, NEVER)),
        leave=NEVER if stops else above,
        stop=place.altitude - p.stop_altitude,
        left=above if stops else NEVER,
        over=p.stop_time - t,
    )


@physics
def exposure_of(s, p, o):
    """The `Exposure` of a state, SI: dynamic pressure rho V^2 / 2."""
    place = place_of(s, p, o)
    air = air_of(s, place, p, o)
    v2 = speed2(air)
    v = sqrt(v2)
    flux, force = heat_rate(air.density, v, p, o), force_of(air, v, p, o)
    return Exposure(0.5 * air.density * v2, flux, place.altitude, sqrt(speed2(s)), force)


@physics
def start(p, o):
    """The discrete state at entry, SI: peaks begin with the values there."""
    pressure, flux, altitude, v, force = exposure_of(initial(p), p, o)
    met = Met(
        pressure=Peak(pressure, 0.0, altitude, v),
        loads=Loads(force.total, force.axial),
        flux=Peak(flux, 0.0, altitude, v),
        pull_out=PullOut(),
        lift=Lift(p.cos_bank, p.sin_bank, rolls=0.0),
        exits=0.0,
        first_exit=Exit(),
    )
    turn = Turn(bank=p.first_bank, next_bank=p.first_bank)
    return Memory(met, Steering(turn, Reckoning(), side=where(p.first_bank < 0.0, -1.0, 1.0)))


@physics
def exit_of(t, s, p, o):
    """The `Exit` of a vehicle that leaves the atmosphere, SI.

    The apoapsis is that of a point mass; on a hyperbola, and over a flat Earth, it is UNKNOWN.
    """
    v = sqrt(speed2(s))
    if o.shape == FLAT:
        angle, inertial, apoapsis = atan2(s.vz, sqrt(s.vx * s.vx + s.vy * s.vy)), v, UNKNOWN
    else:
        angle = velocity_angles(s.x, s.y, s.z, s.vx, s.vy, s.vz)[0]
        wx, wy = s.vx - p.rate * s.y, s.vy + p.rate * s.x
        r = sqrt(s.x * s.x + s.y * s.y + s.z * s.z)
        w2 = wx * wx + wy * wy + s.vz * s.vz
        hx, hy, hz = s.y * s.vz - s.z * wy, s.z * wx - s.x * s.vz, s.x * wy - s.y * wx
        inverse_a = 2.0 / r - w2 / p.mu
        bound = inverse_a > 0.0
        a = 1.0 / where(bound, inverse_a, 1.0)
        e2 = maximum(1.0 - (hx * hx + hy * hy + hz * hz) / (p.mu * a), 0.0)
        inertial, apoapsis = sqrt(w2), where(bound, a * (1.0 + sqrt(e2)) - p.radius, UNKNOWN)
    return Exit(t, v, angle, inertial, apoapsis)


@physics
def switch(t, s, m, p, o, hit):
    """Keep the larger of each peak, the first pull-out and the first exit, SI; change the bank where a roll is due."""
    pressure, flux, altitude, v, force = exposure_of(s, p, o)
    met, lift = m.met, m.met.lift
    push = (hit.pressure_peak > 0.5) & (pressure > met.pressure.value)
    heat = (hit.heat_peak > 0.5) & (flux > met.flux.value)
    roll = hit.roll > 0.5
    leaving = hit.leave > 0.5
    over = roll & (lift.rolls == 0.0)
    now = Met(
        pressure=where(push, Peak(pressure, t, altitude, v), met.pressure),
        loads=where(push, Loads(force.total, force.axial), met.loads),
        flux=where(heat, Peak(flux, t, altitude, v), met.flux),
        pull_out=where(hit.pull_out > 0.5, PullOut(altitude, t), met.pull_out),
        lift=where(
            over, Lift(p.cos_rolled, p.sin_rolled, 1.0), where(roll, Lift(p.cos_bank, p.sin_bank, 2.0), lift)
        ),
        exits=where(leaving, met.exits + 1.0, met.exits),
        first_exit=where(leaving & (met.exits == 0.0), exit_of(t, s, p, o), met.first_exit),
    )  # fmt: skip
    return s, Memory(now, m.steering)
