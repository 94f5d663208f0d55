"""From the keys of a [dispersion.NAME] to a distribution in the unit of the model's parameter."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

from mc_engine.campaign.inputs import accepted_range, check_value, number
from mc_engine.campaign.reading import Findings
from mc_engine.campaign.tables_beside import empirical_numbers
from mc_engine.model.fields import Parameter, Setting
from mc_engine.model.files import FileFault, resolve_beside
from mc_engine.sampling.distributions import (
    Beta,
    Constant,
    Continuous,
    Discrete,
    Distribution,
    Empirical,
    Exponential,
    Lognormal,
    Normal,
    Scalar,
    Triangular,
    Truncated,
    Uniform,
    share_outside,
    truncate,
)
from mc_engine.units import convert

_LEAST_SHARE = 1e-15  # an interval holding less of the distribution is a slip of the pen
_UNSEEN_SHARE = 1e-9  # so few draws outside the parameter's range may be cut without asking


@dataclass(frozen=True)
class Desk:
    """What the work on one dispersion needs: its keys `o`, in the parameter's unit, and where to complain."""

    item: Parameter | Setting
    nominal: Scalar
    design: str
    o: SimpleNamespace
    directory: Path
    found: Findings


def build_distribution(desk: Desk) -> Distribution | None:
    """The distribution that the keys describe; None where there is none, or where a mistake was noted."""
    if desk.o.dist is None:
        return None
    before = len(desk.found.problems)
    distribution = _BUILDERS[desk.o.dist](desk)
    if distribution is None or len(desk.found.problems) > before:
        return None
    if isinstance(distribution, Continuous):
        distribution = _cut(distribution, desk)
    if distribution is not None and isinstance(desk.item, Parameter):
        distribution = _inside_parameter_range(distribution, desk)
    return distribution


def _cut(distribution: Continuous, desk: Desk) -> Continuous | Truncated | None:
    """The distribution between the bounds `lower` and `upper` of the file."""
    lower = -math.inf if desk.o.lower is None else desk.o.lower
    upper = math.inf if desk.o.upper is None else desk.o.upper
    if not _in_order(desk, lower, upper):
        return None
    if (lower, upper) == (-math.inf, math.inf):
        return distribution
    if distribution.share_between(lower, upper) < _LEAST_SHARE:
        desk.found.add("lower" if lower > -math.inf else "upper", "the bounds leave nothing of the distribution")
        return None
    return truncate(distribution, lower, upper)


def _in_order(desk: Desk, lower: float, upper: float) -> bool:
    if lower < upper:
        return True
    desk.found.add("lower", f"{number(lower)} is not below upper = {number(upper)}")
    return False


def _inside_parameter_range(distribution: Distribution, desk: Desk) -> Distribution | None:
    """The distribution checked against what the model accepts; a tail too thin to be drawn is cut."""
    low, high = desk.item.low, desk.item.high
    lowest, highest = distribution.support
    if low <= lowest and highest <= high:
        return distribution
    if isinstance(distribution, Continuous | Truncated):
        share = share_outside(distribution, low, high)
        if share < _UNSEEN_SHARE:
            return truncate(distribution, low, high)
        accepted = accepted_range(desk.item)
        desk.found.add("", f"{share:.2g} of the draws would be outside {accepted}; cut with lower and upper")
    else:
        reach = f"{number(lowest)} to {number(highest)}" if lowest < highest else number(lowest)
        desk.found.add("", f"reaches {reach}; the model accepts {accepted_range(desk.item)}")
    return None


def _normal(desk: Desk) -> Distribution | None:
    o = desk.o
    given = [key for key in ("sigma", "three_sigma") if getattr(o, key) is not None]
    if len(given) != 1:
        desk.found.add("", f"needs sigma or three_sigma{', not both' if given else ''}")
        return None
    return Normal(_about(o.mean, desk), o.sigma if o.sigma is not None else o.three_sigma / 3.0)


def _uniform(desk: Desk) -> Distribution | None:
    bounds = _bounds(desk, "mean")
    return Uniform(*bounds) if bounds else None


def _triangular(desk: Desk) -> Distribution | None:
    bounds = _bounds(desk, "mode")
    mode = _about(desk.o.mode, desk)
    if bounds is None:
        return None
    if not bounds[0] <= mode <= bounds[1]:
        desk.found.add("mode", f"{number(mode)} is not between {number(bounds[0])} and {number(bounds[1])}")
        return None
    return Triangular(bounds[0], mode, bounds[1])


def _bounds(desk: Desk, middle: str) -> tuple[float, float] | None:
    """lower and upper as given, or half_range about the middle; the middle's key is idle between plain bounds."""
    o = desk.o
    plain = [o.lower, o.upper]
    if o.half_range is None and None not in plain:
        if middle == "mean" and o.mean is not None:
            desk.found.add("mean", "belongs to half_range; lower and upper already say it all")
        return (o.lower, o.upper) if _in_order(desk, o.lower, o.upper) else None
    if o.half_range is not None and plain == [None, None]:
        centre = _about(getattr(o, middle), desk)
        return centre - o.half_range, centre + o.half_range
    desk.found.add("", "needs lower and upper, or half_range, not a mixture of them")
    return None


def _lognormal(desk: Desk) -> Distribution | None:
    o = desk.o
    by_median, by_mean = o.log_sigma is not None, o.sigma is not None
    if by_median == by_mean or (by_median and o.mean is not None) or (by_mean and o.median is not None):
        desk.found.add("", "needs median with log_sigma, or mean with sigma")
        return None
    centre = _about(o.median if by_median else o.mean, desk)
    if not centre > 0.0:
        key = "median" if by_median else "mean"
        desk.found.add(key, f"the nominal value {number(centre)} is not above 0, as a log-normal must be")
        return None
    return Lognormal(centre, o.log_sigma) if by_median else Lognormal.from_moments(centre, o.sigma)


def _beta(desk: Desk) -> Distribution | None:
    o = desk.o
    return Beta(o.alpha, o.beta, o.lower, o.upper) if _in_order(desk, o.lower, o.upper) else None


def _exponential(desk: Desk) -> Distribution:
    return Exponential(_about(desk.o.origin, desk), desk.o.scale)


def _discrete(desk: Desk) -> Distribution | None:
    values = [
        check_value(value, desk.item, desk.found, f"values {k}") for k, value in enumerate(desk.o.values, start=1)
    ]
    weights = desk.o.weights if desk.o.weights is not None else [1.0] * len(values)
    if len(weights) != len(values):
        desk.found.add("weights", f"{len(weights)} weights for {len(values)} values")
    elif not sum(weights) > 0.0:
        desk.found.add("weights", "are all zero")
    elif None not in values:
        return Discrete(tuple(value for value in values if value is not None), tuple(weights))
    return None


def _empirical(desk: Desk) -> Distribution | None:
    o = desk.o
    try:
        measured = empirical_numbers(resolve_beside(desk.directory, o.file), o.column)
    except FileFault as fault:
        desk.found.add("file", str(fault))
        return None
    if o.unit is not None:
        measured = tuple(convert(value, o.unit, desk.item.unit) for value in measured)
    lower = -math.inf if o.lower is None else o.lower
    upper = math.inf if o.upper is None else o.upper
    if not _in_order(desk, lower, upper):
        return None
    kept = Empirical(measured).within(lower, upper)
    if not kept.values:
        desk.found.add(
            "lower" if o.lower is not None else "upper", f"the bounds leave none of the {len(measured)} numbers"
        )
        return None
    return kept


def _constant(desk: Desk) -> Distribution | None:
    value = check_value(desk.o.value, desk.item, desk.found, "value")
    return None if value is None else Constant(value)


_BUILDERS: dict[str, Callable[[Desk], Distribution | None]] = {
    "normal": _normal,
    "uniform": _uniform,
    "triangular": _triangular,
    "lognormal": _lognormal,
    "beta": _beta,
    "exponential": _exponential,
    "discrete": _discrete,
    "empirical": _empirical,
    "constant": _constant,
}


def _about(given: float | None, desk: Desk) -> float:
    """The value given, or the nominal one."""
    return float(desk.nominal) if given is None else given
