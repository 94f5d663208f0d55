"""What is seen along a flight and what it comes to: quantities and metrics.  SI, radians."""

from collections import namedtuple

from campaigns.geo_servicing.corrections import drift_of
from campaigns.geo_servicing.dynamics import INSPECTION, PHASING, SIDEREAL_DAY, TURN, longitudes
from campaigns.geo_servicing.inspection import relative_orbit
from mc_engine.lanes import atan, log, physics, sqrt, where
from mc_engine.model import Extremum, Field
from mc_engine.physics.frames import orbital_axes

FAR = 1e9  # m, a range that is none

QUANTITIES = (
    Field("longitude_deviation_deg", "deg", "longitude less the required one, of the servicing module"),
    Field("mean_longitude_deviation_deg", "deg", "the same of its osculating mean longitude"),
    Field("drift_rate_deg_rev", "deg/rev", "drift by the osculating period, east positive"),
    Field("period_error_s", "s", "osculating period less the sidereal day"),
    Field("eccentricity", "", "osculating eccentricity"),
    Field("inclination_deg", "deg", "osculating inclination"),
    Field("thrust_n", "N", "thrust ahead"),
    Field("delta_v_m_s", "m/s", "characteristic velocity so far"),
    Field("along_track_m", "m", "module ahead of the target, along the target's transverse axis"),
    Field("radial_m", "m", "module above the target, along its radius"),
    Field("range_m", "m", "distance of the two craft"),
    Field("settled_range_m", "m", "the same once settle_time_days have passed; 0 before"),
    Field("settled_nearness_m", "m", "minus the range once settle_time_days have passed; far below before"),
    Field("settled_along_track_m", "m", "module ahead of the target once settle_time_days have passed"),
    Field("settled_radial_m", "m", "module above the target once settle_time_days have passed"),
    Field("relative_drift_m", "m", "drift of the module past the target in a revolution, by osculating elements"),
    Field("relative_eccentricity", "", "length of the difference of the eccentricity vectors"),
    Field("corrections", "", "burns so far"),
)
EXTREMA = (
    Extremum("eccentricity", "eccentricity"),
    Extremum("far", "range_m"),
    Extremum("near", "range_m", "min"),
    Extremum("settled_far", "settled_range_m"),
    Extremum("settled_near", "settled_nearness_m"),
)


def _some(name: str, unit: str, description: str, **bounds: float) -> Field:
    """A metric that not every phase has."""
    return Field(name, unit, description, sometimes=True, **bounds)


METRICS = (
    _some(
        "longitude_deviation_deg",
        "deg",
        "longitude less the required one at the end of the transfer, or of a flight without",
    ),
    _some("mean_longitude_deviation_deg", "deg", "the same of the osculating mean longitude"),
    _some("daily_mean_longitude_deviation_deg", "deg", "mean of the longitude deviation over the sidereal day after"),
    _some(
        "drift_rate_deg_rev",
        "deg/rev",
        "drift by the osculating period at the end of the transfer, or of a flight without",
    ),
    _some("actual_drift_rate_deg_rev", "deg/rev", "what the mean longitude changes in the sidereal day after"),
    _some(
        "period_error_s",
        "s",
        "osculating period less the sidereal day at the end of the transfer, or of a flight without",
    ),
    _some("actual_period_error_s", "s", "the same by the actual drift"),
    _some("eccentricity", "", "osculating eccentricity at the end of the transfer, or of a flight without", low=0.0),
    Field("peak_eccentricity", "", "largest osculating eccentricity of the flight", low=0.0),
    _some(
        "inclination_deg", "deg", "osculating inclination at the end of the transfer, or of a flight without", low=0.0
    ),
    Field("delta_v_m_s", "m/s", "characteristic velocity", low=0.0),
    _some("transfer_time_s", "s", "end of the last burn of the phasing", low=0.0),
    Field("corrections", "", "burns", low=0.0),
    Field("final_longitude_deviation_deg", "deg", "longitude less the required one at the end of the flight"),
    Field("final_eccentricity", "", "osculating eccentricity at the end of the flight", low=0.0),
    _some("min_range_m", "m", "smallest range", low=0.0),
    _some("max_range_m", "m", "largest range", low=0.0),
    _some("settled_min_range_m", "m", "smallest range after settle_time_days", low=0.0),
    _some("settled_max_range_m", "m", "largest range after settle_time_days", low=0.0),
    _some("relative_eccentricity", "", "length of the difference of the eccentricity vectors at the end", low=0.0),
    _some("relative_drift_m", "m", "drift of the module past the target in a revolution, at the end"),
    _some("steady", "", "1 if the settled range stayed within range_low_m and range_high_m", low=0.0, high=1.0),
)
Quantities = namedtuple("Quantities", [field.symbol for field in QUANTITIES])  # type: ignore[misc]
Metrics = namedtuple("Metrics", [field.symbol for field in METRICS])  # type: ignore[misc]
Pair = namedtuple("Pair", "along radial range drift e")
Error = namedtuple("Error", "r s u w")
EXACT = Error(0.0, 0.0, 0.0, 0.0)  # what navigation would be without its errors


@physics
def period_error(drift):
    """Period less the sidereal day [s] of a drift [rad/rev]."""
    return SIDEREAL_DAY / (1.0 + drift / TURN) - SIDEREAL_DAY


@physics
def inclination_of(elements):
    """Inclination [rad] of equinoctial elements."""
    return 2.0 * atan(sqrt(elements.q * elements.q + elements.p * elements.p))


@physics
def pair_of(s, m, p, o):
    """The module seen from the target; nothing in the other phases, which have none."""
    zero = 0.0 * s.x
    along, radial, distance, drift, e = zero + float("nan"), zero + float("nan"), zero, zero, zero
    if o.phase == INSPECTION:
        rx, ry, rz, ax, ay, az, _, _, _ = orbital_axes(s.tx, s.ty, s.tz, s.tvx, s.tvy, s.tvz)
        dx, dy, dz = s.x - s.tx, s.y - s.ty, s.z - s.tz
        along, radial = dx * ax + dy * ay + dz * az, dx * rx + dy * ry + dz * rz
        distance = sqrt(dx * dx + dy * dy + dz * dz)
        true = relative_orbit(s, EXACT)
        drift, e = true.drift, true.e
    return Pair(along, radial, distance, drift, e)


@physics
def observe(t, s, m, p, o):
    """The quantities in the order of QUANTITIES."""
    true, mean, x = longitudes(t, s, p)
    drift = drift_of(x.a)
    pair = pair_of(s, m, p, o)
    settled = m.settled > 0.5
    return Quantities(
        true,
        mean,
        drift,
        period_error(drift),
        sqrt(x.k * x.k + x.h * x.h),
        inclination_of(x),
        m.ahead,
        p.exhaust * log(p.mass / s.mass),
        pair.along,
        pair.radial,
        pair.range,
        where(settled, pair.range, 0.0),
        where(settled, -pair.range, -FAR),
        where(settled, pair.along, float("nan")),
        where(settled, pair.radial, float("nan")),
        pair.drift,
        pair.e,
        m.burns,
    )


@physics
def evaluate(t, s, m, p, o, best, when):
    """The metrics in the order of METRICS, at the end."""
    gone = float("nan")
    true, mean, x = longitudes(t, s, p)
    final_e = sqrt(x.k * x.k + x.h * x.h)
    pair = pair_of(s, m, p, o)
    phasing, two = o.phase == PHASING, o.phase == INSPECTION
    end = (m.end_true, m.end_mean, m.end_drift, m.end_e, m.end_inclination)
    if not phasing:  # no transfer: where the module is at the end of the flight
        end = (true, mean, drift_of(x.a), final_e, inclination_of(x))
    settled_near, settled_far = -best.settled_near, best.settled_far
    steady = (m.settled > 0.5) & (settled_near >= o.range_low) & (settled_far <= o.range_high)
    return Metrics(
        end[0],
        end[1],
        m.day_mean,
        end[2],
        m.day_drift,
        period_error(end[2]),
        period_error(m.day_drift),
        end[3],
        best.eccentricity,
        end[4],
        p.exhaust * log(p.mass / s.mass),
        m.end_time,
        m.burns,
        true,
        final_e,
        best.near if two else gone + true,
        best.far if two else gone + true,
        settled_near if two else gone + true,
        settled_far if two else gone + true,
        pair.e if two else gone + true,
        pair.drift if two else gone + true,
        where(steady, 1.0, 0.0) if two else gone + true,
    )
