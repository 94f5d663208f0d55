"""Quantities along a flight and metrics at its end.  SI, radians."""

from collections import namedtuple

from campaigns.geo_servicing.corrections import drift_of, inclination_of
from campaigns.geo_servicing.dynamics import INSPECTION, PHASING, SIDEREAL_DAY, longitudes
from campaigns.geo_servicing.inspection import relative_orbit
from mc_engine.lanes import log, physics, sqrt, where
from mc_engine.model import Extremum, Field
from mc_engine.physics.frames import TURN, orbital_axes

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
def pair_of(s, m, p, o):
    """The module seen from the target [m], in its radial and transverse axes; missing in phases without a target."""
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
    """The quantities in the order of QUANTITIES, SI and radians."""
    true, mean, x = longitudes(t, s, p)
    drift = drift_of(x.a)
    pair = pair_of(s, m, p, o)
    settled = m.settled > 0.5
    return Quantities(
        longitude_deviation=true,
        mean_longitude_deviation=mean,
        drift_rate=drift,
        period_error=period_error(drift),
        eccentricity=sqrt(x.k * x.k + x.h * x.h),
        inclination=inclination_of(x),
        thrust=m.ahead,
        delta_v=p.exhaust * log(p.mass / s.mass),
        along_track=pair.along,
        radial=pair.radial,
        range=pair.range,
        settled_range=where(settled, pair.range, 0.0),
        settled_nearness=where(settled, -pair.range, -FAR),
        settled_along_track=where(settled, pair.along, float("nan")),
        settled_radial=where(settled, pair.radial, float("nan")),
        relative_drift=pair.drift,
        relative_eccentricity=pair.e,
        corrections=m.burns,
    )


@physics
def evaluate(t, s, m, p, o, best, when):
    """The metrics in the order of METRICS, at the end, SI and radians."""
    gone = float("nan")
    true, mean, x = longitudes(t, s, p)
    final_e = sqrt(x.k * x.k + x.h * x.h)
    pair = pair_of(s, m, p, o)
    phasing, two = o.phase == PHASING, o.phase == INSPECTION
    end_true, end_mean, end_drift, end_e, end_inclination = (
        m.end_true,
        m.end_mean,
        m.end_drift,
        m.end_e,
        m.end_inclination,
    )
    if not phasing:  # no transfer: where the module is at the end of the flight
        end_true, end_mean, end_drift, end_e, end_inclination = true, mean, drift_of(x.a), final_e, inclination_of(x)
    settled_near, settled_far = -best.settled_near, best.settled_far
    steady = (m.settled > 0.5) & (settled_near >= o.range_low) & (settled_far <= o.range_high)
    steady = where(steady, 1.0, 0.0)
    near, far, relative_e, relative_drift = best.near, best.far, pair.e, pair.drift
    if not two:  # no second craft
        near, far, relative_e, relative_drift = gone + true, gone + true, gone + true, gone + true
        settled_near, settled_far, steady = gone + true, gone + true, gone + true
    return Metrics(
        longitude_deviation=end_true,
        mean_longitude_deviation=end_mean,
        daily_mean_longitude_deviation=m.day_mean,
        drift_rate=end_drift,
        actual_drift_rate=m.day_drift,
        period_error=period_error(end_drift),
        actual_period_error=period_error(m.day_drift),
        eccentricity=end_e,
        peak_eccentricity=best.eccentricity,
        inclination=end_inclination,
        delta_v=p.exhaust * log(p.mass / s.mass),
        transfer_time=m.end_time,
        corrections=m.burns,
        final_longitude_deviation=true,
        final_eccentricity=final_e,
        min_range=near,
        max_range=far,
        settled_min_range=settled_near,
        settled_max_range=settled_far,
        relative_eccentricity=relative_e,
        relative_drift=relative_drift,
        steady=steady,
    )
