"""Quantities along a flight, and metrics at its end: orbit at the last cut-off, corrections it needs, propellant."""

from collections import namedtuple

from campaigns.geo_injection.dynamics import COAST, direction, level_of
from campaigns.geo_injection.program_table import n_burns
from mc_engine.lanes import asin, atan2, maximum, minimum, physics, sincos, sqrt, where
from mc_engine.model import Field
from mc_engine.physics.constants import MU_EARTH

QUANTITIES = (
    Field("x_km", "km", "place, to the nominal ascending node"),
    Field("y_km", "km", "place, a quarter revolution east of that in the equator"),
    Field("z_km", "km", "place, to the north pole"),
    Field("radius_km", "km", "distance from the Earth's centre"),
    Field("speed_m_s", "m/s", "inertial speed"),
    Field("radial_speed_m_s", "m/s", "speed away from the Earth"),
    Field("flight_path_angle_deg", "deg", "angle of the velocity over the local horizon"),
    Field("mass_kg", "kg", "mass"),
    Field("acceleration_m_s2", "m/s^2", "acceleration by thrust"),
    Field("thrust_right_ascension_deg", "deg", "in-plane thrust angle phi; while the engine is off, the last one"),
    Field("thrust_declination_deg", "deg", "out-of-plane thrust angle psi; while the engine is off, the last one"),
    Field("osculating_semi_major_axis_km", "km", "of the osculating orbit"),
    Field("osculating_eccentricity", "", "of the osculating orbit"),
    Field("osculating_inclination_deg", "deg", "of the osculating orbit"),
)
METRICS = (
    Field("semi_major_axis_km", "km", "osculating, at the last burn-out", low=0.0),
    Field("eccentricity", "", "osculating, at the last burn-out", low=0.0),
    Field("inclination_deg", "deg", "against the equator, at the last burn-out", low=0.0),
    Field("plane_error_deg", "deg", "angle between the orbit's plane and the one aimed at", low=0.0),
    Field("node_deg", "deg", "right ascension of the ascending node, from the parking orbit's nominal node"),
    Field("perigee_radius_km", "km", "osculating, at the last burn-out", low=0.0),
    Field("apogee_radius_km", "km", "osculating, at the last burn-out", low=0.0),
    Field("radius_error_km", "km", "distance at the last burn-out less that of the final circle"),
    Field("longitude_drift_deg_day", "deg/day", "eastward, against the final circle's own rate"),
    Field("in_plane_correction_m_s", "m/s", "two apsidal impulses to the final circle, in the cheaper order", low=0.0),
    Field("plane_correction_m_s", "m/s", "one impulse at the node", low=0.0),
    Field("correction_dv_m_s", "m/s", "root of the sum of both squares", low=0.0),
    Field("propellant_kg", "kg", "propellant used", low=0.0),
    Field("propellant_margin_kg", "kg", "what is left of the propellant on board"),
    Field("final_mass_kg", "kg", "mass at the last burn-out", low=0.0),
    Field("burn_out_1_s", "s", "end of the first burn, after the nominal first ignition", low=0.0),
    Field("burn_out_2_s", "s", "end of the second burn", low=0.0),
    Field("last_burn_out_s", "s", "end of the last burn", low=0.0),
)
Quantities = namedtuple("Quantities", [field.symbol for field in QUANTITIES])  # type: ignore[misc]
Metrics = namedtuple("Metrics", [field.symbol for field in METRICS])  # type: ignore[misc]
Orbit = namedtuple("Orbit", "a e hx hy hz h r radial speed")


@physics
def orbit_of(s):
    """Osculating orbit of a state: Curtis, Orbital Mechanics for Engineering Students, 3rd ed., algorithm 4.2."""
    r = sqrt(s.x * s.x + s.y * s.y + s.z * s.z)
    v2 = s.vx * s.vx + s.vy * s.vy + s.vz * s.vz
    rv = s.x * s.vx + s.y * s.vy + s.z * s.vz
    hx, hy, hz = s.y * s.vz - s.z * s.vy, s.z * s.vx - s.x * s.vz, s.x * s.vy - s.y * s.vx
    k, q = v2 / MU_EARTH - 1.0 / r, rv / MU_EARTH
    ex, ey, ez = k * s.x - q * s.vx, k * s.y - q * s.vy, k * s.z - q * s.vz
    h = sqrt(hx * hx + hy * hy + hz * hz)
    e = sqrt(ex * ex + ey * ey + ez * ez)
    return Orbit(
        a=1.0 / (2.0 / r - v2 / MU_EARTH),
        e=e,
        hx=hx,
        hy=hy,
        hz=hz,
        h=h,
        r=r,
        radial=rv / r,
        speed=sqrt(v2),
    )


@physics
def observe(t, s, m, p, o):
    """Quantities along the flight, SI and radians, inertial axes."""
    orbit = orbit_of(s)
    # on a coast a polynomial would go astray beyond its segment
    dx, dy, dz = direction(where(m.phase == COAST, minimum(t, m.middle + 1.0 / m.rate), t), m)
    acceleration = level_of(t, m, p) * p.thrust / s.mass
    level = sqrt(orbit.hx * orbit.hx + orbit.hy * orbit.hy)
    return Quantities(
        x=s.x,
        y=s.y,
        z=s.z,
        radius=orbit.r,
        speed=orbit.speed,
        radial_speed=orbit.radial,
        flight_path_angle=asin(orbit.radial / orbit.speed),
        mass=s.mass,
        acceleration=acceleration,
        thrust_right_ascension=atan2(dy, dx),
        thrust_declination=atan2(dz, sqrt(dx * dx + dy * dy)),
        osculating_semi_major_axis=orbit.a,
        osculating_eccentricity=orbit.e,
        osculating_inclination=atan2(level, orbit.hz),
    )


@physics
def _speed_at(r, other):
    """Speed [m/s] at one apsis of an ellipse with the apses r, other [m]: the vis-viva equation, 2 a = r + other."""
    return sqrt(maximum(2.0 * MU_EARTH * other / (r * (r + other)), 0.0))


@physics
def _two_impulses(r, other, target):
    """Speed changes [m/s], added, at r, which carries the other apsis to the target [m], and there into the circle."""
    circular = sqrt(MU_EARTH / target)
    return abs(_speed_at(r, target) - _speed_at(r, other)) + abs(circular - _speed_at(target, r))


@physics
def evaluate(t, s, m, p, o, best, when):
    """Metrics of a case, SI and radians; an orbit that does not close has no correction.

    The plane is corrected by one impulse at the node, 2 v sin(i/2); drift: sqrt(mu/a^3) less that of the final circle.
    """
    orbit = orbit_of(s)
    radius = o.final_radius + 0.0 * t
    closed = orbit.a > 0.0
    e = minimum(orbit.e, where(closed, 1.0 - 1e-12, orbit.e))
    perigee, apogee = orbit.a * (1.0 - e), where(closed, orbit.a * (1.0 + e), 1e300)
    in_plane = minimum(_two_impulses(perigee, apogee, radius), _two_impulses(apogee, perigee, radius))
    in_plane = where(closed, in_plane, 1e300)
    tilt_sin, tilt_cos = sincos(o.final_inclination + 0.0 * t)
    # against the final plane's normal (0, -sin, cos)
    up = tilt_cos * orbit.hz - tilt_sin * orbit.hy
    across = tilt_cos * orbit.hy + tilt_sin * orbit.hz
    tilt = atan2(sqrt(orbit.hx * orbit.hx + across * across), up)
    half = sincos(0.5 * tilt)[0]
    plane = 2.0 * sqrt(MU_EARTH / radius) * half
    a = where(closed, orbit.a, 1e300)
    drift = sqrt(MU_EARTH / a) / a - sqrt(MU_EARTH / radius) / radius
    used = p.mass - s.mass
    clock = t + p.delay_1
    return Metrics(
        semi_major_axis=orbit.a,
        eccentricity=orbit.e,
        inclination=atan2(sqrt(orbit.hx * orbit.hx + orbit.hy * orbit.hy), orbit.hz),
        plane_error=tilt,
        node=atan2(orbit.hx, -orbit.hy),
        perigee_radius=perigee,
        apogee_radius=apogee,
        radius_error=orbit.r - radius,
        longitude_drift=drift,
        in_plane_correction=in_plane,
        plane_correction=plane,
        correction_dv=where(closed, sqrt(minimum(in_plane, 1e100) * minimum(in_plane, 1e100) + plane * plane), 1e300),
        propellant=used,
        propellant_margin=o.propellant_limit - used,
        final_mass=s.mass,
        burn_out_1=m.burn_out_1 + p.delay_1,
        burn_out_2=where(n_burns(o.tables) > 2.5, m.burn_out_2 + p.delay_1, clock),
        last_burn_out=clock,
    )
