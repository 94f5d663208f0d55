"""Quantities along a flight and metrics at its end.  SI, radians."""

from collections import namedtuple
from typing import Any

from campaigns.geo_servicing.corrections import ended
from campaigns.geo_servicing.dynamics import SIDEREAL_DAY
from campaigns.geo_servicing.inputs import CHOICES
from campaigns.geo_servicing.inspection import relative_orbit
from campaigns.geo_servicing.navigation import EXACT
from mc_engine.lanes import log, merged, physics, replace, where
from mc_engine.model import Field, at_end, maximum_of, metrics, minimum_of, outputs
from mc_engine.physics.earth_frames import ric_from_eci
from mc_engine.physics.frames import TURN
from mc_engine.physics.vectors import Vector, matrix_times, norm, subtracted

FAR = 1e9  # m, a range that is none
NONE = float("nan")

Outputs = outputs(
    longitude_deviation_deg="longitude less the required one, of the servicing module",
    mean_longitude_deviation_deg="osculating mean longitude less the required longitude",
    drift_rate_deg_rev="drift by the osculating period, east positive",
    period_error_s="osculating period less the sidereal day",
    eccentricity=Field("osculating eccentricity", unit=""),
    inclination_deg="osculating inclination",
    thrust_n="thrust ahead",
    delta_v_m_s="characteristic velocity so far",
    along_track_m="module ahead of the target, along the target's transverse axis",
    radial_m="module above the target, along its radius",
    range_m="distance of the two craft",
    settled_range_m="distance of the two craft once settle_time_days have passed; 0 before",
    settled_nearness_m="minus the range once settle_time_days have passed; far below before",
    settled_along_track_m="module ahead of the target once settle_time_days have passed",
    settled_radial_m="module above the target once settle_time_days have passed",
    relative_drift_m="drift of the module past the target in a revolution, by osculating elements",
    relative_eccentricity=Field("length of the difference of the eccentricity vectors", unit=""),
    corrections=Field("number of burns so far", unit=""),
)


def _some(description: str, **more: Any) -> Field:
    """A metric that not every phase has."""
    return Field(description, sometimes=True, **more)


END = "at the end of the transfer, or of a flight without a transfer"
Metrics = metrics(
    longitude_deviation_deg=_some(f"longitude less the required one {END}"),
    mean_longitude_deviation_deg=_some("osculating mean longitude less the required one at the end of the transfer"),
    daily_mean_longitude_deviation_deg=_some(
        "mean of the longitude deviation over the sidereal day after the transfer"
    ),
    drift_rate_deg_rev=_some(f"drift by the osculating period {END}"),
    actual_drift_rate_deg_rev=_some(
        "change of the mean longitude in the sidereal day after the transfer, per revolution"
    ),
    period_error_s=_some(f"osculating period less the sidereal day {END}"),
    actual_period_error_s=_some("period by the actual drift rate, less the sidereal day"),
    eccentricity=_some(f"osculating eccentricity {END}", low=0.0, unit=""),
    peak_eccentricity=maximum_of("eccentricity", "largest osculating eccentricity of the flight", low=0.0, unit=""),
    inclination_deg=_some(f"osculating inclination {END}", low=0.0),
    delta_v_m_s=at_end("delta_v_m_s", "characteristic velocity of all burns", low=0.0),
    transfer_time_s=_some("end of the last burn of the phasing", low=0.0),
    corrections=at_end("corrections", "number of burns", low=0.0, unit=""),
    final_longitude_deviation_deg=at_end(
        "longitude_deviation_deg", "longitude less the required one at the end of the flight"
    ),
    final_eccentricity=at_end("eccentricity", "osculating eccentricity at the end of the flight", low=0.0, unit=""),
    min_range_m=_some("smallest range", low=0.0),
    max_range_m=_some("largest range", low=0.0),
    settled_min_range_m=_some("smallest range after settle_time_days; no number if the flight ends before", low=0.0),
    settled_max_range_m=_some("largest range after settle_time_days; no number if the flight ends before", low=0.0),
    relative_eccentricity=_some("length of the difference of the eccentricity vectors at the end", low=0.0, unit=""),
    relative_drift_m=_some("drift of the module past the target in a revolution, at the end"),
    steady=_some("1 if the settled range stayed within range_low_m and range_high_m", low=0.0, high=1.0, unit=""),
)
EXTREMA = {
    "far": maximum_of("range_m", "largest range"),
    "near": minimum_of("range_m", "smallest range"),
    "settled_far": maximum_of("settled_range_m", "largest settled range"),
    "settled_near": maximum_of("settled_nearness_m", "smallest settled range, negative"),
}
# quantities and metrics of the inspection, by their names, as other phases have them
Pair = namedtuple(
    "Pair", "along_track radial range relative_drift relative_eccentricity", defaults=(NONE, NONE, 0.0, 0.0, 0.0)
)
Inspected = namedtuple(
    "Inspected", "min_range max_range settled_min_range settled_max_range relative_drift relative_eccentricity steady"
)
NOT_INSPECTED = Inspected(*[NONE] * 7)


@physics
def period_error(drift):
    """Period less the sidereal day [s] of a drift [rad/rev]."""
    return SIDEREAL_DAY / (1.0 + drift / TURN) - SIDEREAL_DAY


@physics
def pair_of(s, o):
    """The module seen from the target [m], in its radial and transverse axes; missing in phases without a target."""
    if o.phase == CHOICES.phase.inspection:
        r, v = Vector(s.target_x, s.target_y, s.target_z), Vector(s.target_vx, s.target_vy, s.target_vz)
        away = subtracted(s, r)
        seen = matrix_times(ric_from_eci(r, v), away)
        true = relative_orbit(s, EXACT)
        return Pair(seen.y, seen.x, norm(away), true.drift, true.e)
    return Pair()


@physics
def observe(t, s, m, p, o):
    """The quantities, SI and radians."""
    here, pair, settled = ended(t, s, p), pair_of(s, o), m.settled > 0.5
    return merged(
        Outputs,
        here,
        pair,
        period_error=period_error(here.drift_rate),
        thrust=m.burn.ahead,
        delta_v=p.exhaust * log(p.mass_left / s.mass_left),
        settled_range=where(settled, pair.range, 0.0),
        settled_nearness=where(settled, -pair.range, -FAR),
        settled_along_track=where(settled, pair.along_track, NONE),
        settled_radial=where(settled, pair.radial, NONE),
        corrections=m.burns,
    )


@physics
def evaluate(t, s, m, p, o, best):
    """The metrics at the end that are no value of a quantity, SI and radians."""
    end, inspected = m.end, NOT_INSPECTED
    if o.phase != CHOICES.phase.phasing:  # no transfer: where the module is at the end of the flight
        end = replace(ended(t, s, p), transfer_time=NONE)
    if o.phase == CHOICES.phase.inspection:
        settled, true = m.settled > 0.5, relative_orbit(s, EXACT)
        near, far = where(settled, -best.settled_near, NONE), where(settled, best.settled_far, NONE)
        steady = where(settled & (near >= o.range_low) & (far <= o.range_high), 1.0, 0.0)
        inspected = Inspected(best.near, best.far, near, far, true.drift, true.e, steady)
    period, actual = period_error(end.drift_rate), period_error(end.actual_drift_rate)
    return merged(Metrics, end, inspected, period_error=period, actual_period_error=actual)
