"""Outputs along a flight, and metrics at its end: orbit at the last cut-off, corrections it needs, propellant."""

from collections import namedtuple

from campaigns.geo_injection.aiming import pole, velocity
from campaigns.geo_injection.dynamics import COAST, direction, level_of
from campaigns.geo_injection.program_table import nominal
from mc_engine.lanes import asin, atan2, maximum, merged, minimum, physics, sincos, sqrt, where
from mc_engine.model import Field, at_end, metrics, outputs
from mc_engine.physics.constants import MU_EARTH
from mc_engine.physics.vectors import cross, dot, norm, scaled, subtracted

Outputs = outputs(
    x_km="place, to the nominal ascending node",
    y_km="place, a quarter revolution east of that in the equator",
    z_km="place, to the north pole",
    radius_km="distance from the Earth's centre",
    speed_m_s="inertial speed",
    radial_speed_m_s="speed away from the Earth",
    flight_path_angle_deg="angle of the velocity over the local horizon",
    mass_kg="mass",
    acceleration_m_s2="acceleration by thrust",
    thrust_right_ascension_deg="in-plane thrust angle phi; while the engine is off, the last one",
    thrust_declination_deg="out-of-plane thrust angle psi; while the engine is off, the last one",
    osculating_semi_major_axis_km="semi-major axis of the osculating orbit",
    osculating_eccentricity=Field("eccentricity of the osculating orbit", unit=""),
    osculating_inclination_deg="inclination of the osculating orbit",
)
OSCULATING = "osculating, at the last burn-out"
CLOSED = "; no number if the orbit does not close"
NAN = float("nan")
Metrics = metrics(
    semi_major_axis_km=at_end("osculating_semi_major_axis_km", OSCULATING, low=0.0),
    eccentricity=at_end("osculating_eccentricity", OSCULATING, low=0.0, unit=""),
    inclination_deg=at_end("osculating_inclination_deg", "against the equator, at the last burn-out", low=0.0),
    plane_error_deg=Field("angle between the orbit's plane and the one aimed at", low=0.0),
    node_deg="right ascension of the ascending node, from the parking orbit's nominal node",
    perigee_radius_km=Field(OSCULATING, low=0.0),
    apogee_radius_km=Field(OSCULATING + CLOSED, sometimes=True, low=0.0),
    radius_error_km="distance at the last burn-out less that of the final circle",
    longitude_drift_deg_day=Field(
        "drift of the longitude, eastward, relative to the final circle" + CLOSED, sometimes=True
    ),
    in_plane_correction_m_s=Field(
        "two apsidal impulses to the final circle, in the order that needs less" + CLOSED, sometimes=True, low=0.0
    ),
    plane_correction_m_s=Field("one impulse at the node, into the plane of the final circle", low=0.0),
    correction_dv_m_s=Field(
        "root sum square of the in-plane and the plane correction" + CLOSED, sometimes=True, low=0.0
    ),
    propellant_kg=Field("propellant used", low=0.0),
    propellant_margin_kg="propellant on board less propellant used",
    final_mass_kg=at_end("mass_kg", "mass at the last burn-out", low=0.0),
    burn_out_1_s=Field("end of the first burn, after the nominal first ignition", low=0.0, unit="s"),
    burn_out_2_s=Field("end of the second burn", low=0.0, unit="s"),
    last_burn_out_s=Field("end of the last burn", low=0.0),
)
Orbit = namedtuple("Orbit", "a e h radius speed radial_speed")  # h: angular momentum, a vector


@physics
def orbit_of(s):
    """Osculating orbit of a state: Curtis, Orbital Mechanics for Engineering Students, 3rd ed., algorithm 4.2."""
    v, r = velocity(s), norm(s)
    v2, rv = dot(v, v), dot(s, v)
    e = norm(subtracted(scaled(v2 / MU_EARTH - 1.0 / r, s), scaled(rv / MU_EARTH, v)))
    a = 1.0 / (2.0 / r - v2 / MU_EARTH)
    return Orbit(a=a, e=e, h=cross(s, v), radius=r, speed=sqrt(v2), radial_speed=rv / r)


@physics
def observe(t, s, m, p):
    """Outputs along the flight, SI and radians, inertial axes."""
    orbit = orbit_of(s)
    # on a coast no later than the segment's end, beyond which the polynomial has no meaning
    to = direction(where(m.phase == COAST, minimum(t, m.arc.middle + 1.0 / m.arc.rate), t), m)
    return merged(
        Outputs,
        s,
        orbit,
        flight_path_angle=asin(orbit.radial_speed / orbit.speed),
        acceleration=level_of(t, m, p) * p.thrust / s.mass,
        thrust_right_ascension=atan2(to.y, to.x),
        thrust_declination=atan2(to.z, sqrt(to.x * to.x + to.y * to.y)),
        osculating_semi_major_axis=orbit.a,
        osculating_eccentricity=orbit.e,
        osculating_inclination=atan2(sqrt(orbit.h.x * orbit.h.x + orbit.h.y * orbit.h.y), orbit.h.z),
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
def evaluate(t, s, m, p, o):
    """Metrics of a case, SI and radians; an orbit that does not close has no apogee, drift and correction.

    The plane is corrected by one impulse at the node, 2 v sin(i/2); drift: sqrt(mu/a^3) less that of the final circle.
    """
    orbit, radius = orbit_of(s), o.final_radius
    closed = orbit.a > 0.0
    e = minimum(orbit.e, where(closed, 1.0 - 1e-12, orbit.e))
    perigee, apogee = orbit.a * (1.0 - e), where(closed, orbit.a * (1.0 + e), NAN)
    in_plane = minimum(_two_impulses(perigee, apogee, radius), _two_impulses(apogee, perigee, radius))
    in_plane = where(closed, in_plane, NAN)
    final = pole(o.final_inclination)
    tilt = atan2(norm(cross(orbit.h, final)), dot(orbit.h, final))
    plane = 2.0 * sqrt(MU_EARTH / radius) * sincos(0.5 * tilt)[0]
    a = where(closed, orbit.a, NAN)
    used, clock = p.mass - s.mass, t + p.ignition_delay_1
    return Metrics(
        plane_error=tilt,
        node=atan2(orbit.h.x, -orbit.h.y),
        perigee_radius=perigee,
        apogee_radius=apogee,
        radius_error=orbit.radius - radius,
        longitude_drift=sqrt(MU_EARTH / a) / a - sqrt(MU_EARTH / radius) / radius,
        in_plane_correction=in_plane,
        plane_correction=plane,
        correction_dv=sqrt(in_plane * in_plane + plane * plane),
        propellant=used,
        propellant_margin=o.propellant_limit - used,
        burn_out_1=m.burn_out_1 + p.ignition_delay_1,
        burn_out_2=where(nominal(o.tables).burns > 2.5, m.burn_out_2 + p.ignition_delay_1, clock),
        last_burn_out=clock,
    )
