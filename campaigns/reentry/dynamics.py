"""Flight of an entering vehicle: a point mass with drag and banked lift about a turning planet.

Planet-fixed Cartesian axes (x to longitude 0, z to the north pole), SI.  The motion is that of Vinh's equations
(`vinh.py`), in components that have no singularity: a vehicle may start at rest, fall vertically, and pass over a pole.
On a flat Earth x points ahead, y to the left and z up.
"""

from collections import namedtuple

from campaigns.reentry.air import logarithm_of_density, sound_speed
from campaigns.reentry.bank import angle_at
from campaigns.reentry.weather import weather_at
from mc_engine.lanes import any_lane, atan2, exp, maximum, physics, sincos, sqrt, where
from mc_engine.physics.aerodynamics import axial_coefficient, lift_direction, over_mach
from mc_engine.physics.frames import over_ellipsoid, velocity_angles
from mc_engine.physics.gravity import j2_perturbation, point_mass
from mc_engine.physics.heating import DKR_EXPONENT, detra_kemp_riddell, sutton_graves

State = namedtuple("State", "x y z vx vy vz heat")  # place [m], velocity [m/s] over ground, heat load [J/m^2]
# largest dynamic pressure so far with the areas over mass of the load there, and largest heat rate, each with time,
# altitude and speed; first pull-out; present lift direction
# and how often it was changed; first exit from the atmosphere; of a guided flight, time of the last sample, bank
# there and at the next, and what the laws keep
Memory = namedtuple(
    "Memory",
    "pressure pressure_time pressure_altitude pressure_speed pressure_total pressure_axial "
    "flux flux_time flux_altitude flux_speed "
    "low low_time cos_bank sin_bank rolls "
    "exits exit_time exit_speed exit_angle exit_inertial exit_apoapsis "
    "sampled bank bank_rate next_bank next_rate side active lost reckoned range_rate axial excess "  # see `guidance`
    "samples saturated reversals",
)
Parameters = namedtuple(
    "Parameters",
    "x y z vx vy vz "  # first state
    "mu rate polar_radius e2 gravity "  # planet; gravity: of a flat Earth
    "log_density inverse_scale temperature density deviation "  # exponential atmosphere; dispersions of the density
    "drag lift total axial heating "  # areas over mass [m^2/kg]; coefficient of the heating correlation
    "coefficients cos_trim sin_trim cos_tilted sin_tilted "  # place of the table over Mach, or -1; of body axes
    "cos_bank sin_bank cos_rolled sin_rolled roll_at roll_back_at "  # lift directions; sines of flight-path angles
    "stop exit stop_time "
    "ex ey ez fx fy fz nx ny nz "  # unit vectors to the planned entry place, ahead and to the right of it
    "radius heading speed path aim_down aim_cross aimed tx ty tz "  # of the ground; entry over ground; target
    "first_bank bank_error bank_lag bank_rate_limit reversal_floor reversal_width load_limit "
    "reference planned_range planned_share planned_lift_to_drag "  # place in the tables; what the laws know
    "sensed cos_misaligned sin_misaligned accelerometer_bias accelerometer_scale accelerometer_noise "
    "weather corridor_load corridor_heat_rate corridor_heat_load corridor_pressure "
    "nav_range nav_altitude nav_speed nav_path nav_climb",
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

# settings arrive as numbers: places in the lists of words of `model.py`
FLAT = 2.0
J2, NO_GRAVITY = 0.0, 2.0
SUTTON_GRAVES = 0.0
UNGUIDED = 0.0
STOP_ON_EXIT = 0.0
NEVER = -1.0  # value of an event that is not looked for
UNKNOWN = 1e300  # the pull-out has not come


@physics
def initial(p, o):
    """State at entry."""
    return State(p.x, p.y, p.z, p.vx, p.vy, p.vz, 0.0)


@physics
def place_of(s, p, o):
    """Altitude [m], its rate [m/s], and the direction up, planet-fixed axes.

    The rate is that of r less the ellipsoid's radius: r' - (dR/d sin^2) (sin^2)', derived here with sin = z / r.
    """
    if o.shape == FLAT:
        zero = 0.0 * s.x
        altitude, climb, ux, uy, uz = s.z + zero, s.vz + zero, zero, zero, 1.0 + zero
    else:
        r2 = s.x * s.x + s.y * s.y + s.z * s.z
        inverse2 = 1.0 / r2
        r = sqrt(r2)
        inverse = r * inverse2
        altitude, slope = over_ellipsoid(r, inverse, s.z * s.z * inverse2, p.polar_radius, p.e2)
        radial = (s.x * s.vx + s.y * s.vy + s.z * s.vz) * inverse
        # rate of the squared sine of latitude, z^2 / r^2
        climb = radial - slope * (2.0 * s.z * inverse2 * (s.vz - s.z * radial * inverse))
        ux, uy, uz = s.x * inverse, s.y * inverse, s.z * inverse
    return Place(altitude, climb, ux, uy, uz)


@physics
def air_of(s, place, p, o):
    """The `Air` where the vehicle is, and how it goes through it, SI: the wind blows along the local east and north.

    Derived here: shear = -(V . dW/dh), by which the speed through the air changes per metre climbed, times that speed.
    """
    value, slope, temperature = logarithm_of_density(place.altitude, p, o)
    vx, vy, vz, shear = s.vx, s.vy, s.vz, 0.0 * s.vx
    if o.weather > 0.5:
        w = weather_at(place.altitude, p.weather, o.tables)
        value, slope = value + w.density, slope + w.density_slope
        level = sqrt(place.ux * place.ux + place.uy * place.uy)
        inverse = 1.0 / maximum(level, 1e-9)  # over a pole the wind comes from nowhere
        ex, ey = -place.uy * inverse, place.ux * inverse
        nx, ny = -place.uz * place.ux * inverse, -place.uz * place.uy * inverse
        vx, vy, vz = vx - w.east * ex - w.north * nx, vy - w.east * ey - w.north * ny, vz - w.north * level
        shear = -(w.east_slope * (vx * ex + vy * ey) + w.north_slope * (vx * nx + vy * ny + vz * level))
    return Air(p.density * exp(value), slope, temperature, vx, vy, vz, shear)


@physics
def force_of(air, speed, p, o):
    """Areas over mass at a speed [m/s] through the air; by the Mach number if the vehicle has a table of it."""
    drag, lift, total, axial, sensed = p.drag, p.lift, p.total, p.axial, p.sensed
    if any_lane(p.coefficients >= 0.0):
        of_drag, of_lift = over_mach(o.tables, p.coefficients, speed / sound_speed(air.temperature))
        drag, lift = of_drag * p.drag, of_lift * p.lift
        total = sqrt(drag * drag + lift * lift)
        axial = axial_coefficient(drag, lift, p.cos_trim, p.sin_trim)
        sensed = axial_coefficient(drag, lift, p.cos_tilted, p.sin_tilted)
    return Force(drag, lift, total, axial, sensed)


@physics
def field(s, p, o):
    """Acceleration [m/s^2] by gravity and, on a turning planet, the centrifugal force."""
    if o.gravity == NO_GRAVITY:
        gx, gy, gz = 0.0 * s.x, 0.0 * s.y, 0.0 * s.z
    elif o.shape == FLAT:
        gx, gy, gz = 0.0 * s.x, 0.0 * s.y, -p.gravity + 0.0 * s.z
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
        cosine, sine = m.cos_bank, m.sin_bank
    else:
        sine, cosine = sincos(angle_at(t, m, o.guidance_period))
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
    return State(s.vx, s.vy, s.vz, ax, ay, az, heat_rate(air.density, v, p, o))


@physics
def events(t, s, m, p, o):
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
    roll = where(m.rolls == 0.0, sine - p.roll_at, where(m.rolls == 1.0, p.roll_back_at - sine, NEVER))
    above = place.altitude - p.exit
    stops = o.on_exit == STOP_ON_EXIT
    return Events(
        thicker + 2.0 * gain,
        0.5 * thicker + power * gain,
        where(m.low < UNKNOWN, NEVER, place.climb),
        roll,
        NEVER + 0.0 * above if stops else above,
        place.altitude - p.stop,
        above if stops else NEVER + 0.0 * above,
        p.stop_time - t,
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
    """Memory at entry, SI: peaks begin with the values there."""
    pressure, flux, altitude, v, force = exposure_of(initial(p, o), p, o)
    zero = 0.0 * v
    unknown = zero + UNKNOWN
    return Memory(
        pressure=pressure, pressure_time=zero, pressure_altitude=altitude, pressure_speed=v, pressure_total=force.total,
        pressure_axial=force.axial, flux=flux, flux_time=zero, flux_altitude=altitude, flux_speed=v,
        low=unknown, low_time=unknown, cos_bank=p.cos_bank, sin_bank=p.sin_bank,
        rolls=zero, exits=zero, exit_time=unknown, exit_speed=unknown, exit_angle=unknown, exit_inertial=unknown,
        exit_apoapsis=unknown,
        sampled=zero, bank=p.first_bank, bank_rate=zero, next_bank=p.first_bank, next_rate=zero,
        side=where(p.first_bank < 0.0, -1.0, 1.0), active=zero,
        lost=zero, reckoned=zero, range_rate=zero, axial=zero, excess=zero, samples=zero, saturated=zero,
        reversals=zero,
    )  # fmt: skip


@physics
def exit_of(s, p, o):
    """(speed, flight-path angle, inertial speed, apoapsis altitude [m]) of a vehicle that leaves the atmosphere.

    SI; relative to the ground but for the inertial speed.  The apoapsis is that of a point mass; on a hyperbola, and
    over a flat Earth, it is UNKNOWN.
    """
    v = sqrt(speed2(s))
    if o.shape == FLAT:
        angle, inertial, apoapsis = atan2(s.vz, sqrt(s.vx * s.vx + s.vy * s.vy)), v, UNKNOWN + 0.0 * v
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
    return v, angle, inertial, apoapsis


@physics
def switch(t, s, m, p, o, hit):
    """Keep the larger of each peak, the first pull-out and the first exit, SI; change the bank where a roll is due."""
    pressure, flux, altitude, v, force = exposure_of(s, p, o)
    push = (hit.pressure_peak > 0.5) & (pressure > m.pressure)
    heat = (hit.heat_peak > 0.5) & (flux > m.flux)
    low = hit.pull_out > 0.5
    roll = hit.roll > 0.5
    leaving = hit.leave > 0.5
    first = leaving & (m.exits == 0.0)
    speed, angle, inertial, apoapsis = exit_of(s, p, o)
    over = roll & (m.rolls == 0.0)
    return s, Memory(
        pressure=where(push, pressure, m.pressure),
        pressure_time=where(push, t, m.pressure_time),
        pressure_altitude=where(push, altitude, m.pressure_altitude),
        pressure_speed=where(push, v, m.pressure_speed),
        pressure_total=where(push, force.total, m.pressure_total),
        pressure_axial=where(push, force.axial, m.pressure_axial),
        flux=where(heat, flux, m.flux),
        flux_time=where(heat, t, m.flux_time),
        flux_altitude=where(heat, altitude, m.flux_altitude),
        flux_speed=where(heat, v, m.flux_speed),
        low=where(low, altitude, m.low),
        low_time=where(low, t, m.low_time),
        cos_bank=where(over, p.cos_rolled, where(roll, p.cos_bank, m.cos_bank)),
        sin_bank=where(over, p.sin_rolled, where(roll, p.sin_bank, m.sin_bank)),
        rolls=where(roll, m.rolls + 1.0, m.rolls),
        exits=where(leaving, m.exits + 1.0, m.exits),
        exit_time=where(first, t, m.exit_time),
        exit_speed=where(first, speed, m.exit_speed),
        exit_angle=where(first, angle, m.exit_angle),
        exit_inertial=where(first, inertial, m.exit_inertial),
        exit_apoapsis=where(first, apoapsis, m.exit_apoapsis),
        sampled=m.sampled,
        bank=m.bank,
        bank_rate=m.bank_rate,
        next_bank=m.next_bank,
        next_rate=m.next_rate,
        side=m.side,
        active=m.active,
        lost=m.lost,
        reckoned=m.reckoned,
        range_rate=m.range_rate,
        axial=m.axial,
        excess=m.excess,
        samples=m.samples,
        saturated=m.saturated,
        reversals=m.reversals,
    )
