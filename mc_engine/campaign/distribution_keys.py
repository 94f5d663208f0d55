"""Builds a distribution, in the unit of the model's parameter, from the keys of a [dispersion.NAME].

One function for each distribution checks its keys.  Bounds truncate the distribution.  A distribution that exceeds the
range which the model accepts is refused.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

from mc_engine.campaign.inputs import about, accepted_range, check_value, number, within_rounding
from mc_engine.campaign.reading import Findings
from mc_engine.campaign.sections import LARGEST
from mc_engine.campaign.tables_beside import empirical_numbers
from mc_engine.model.fields import Parameter, Setting
from mc_engine.model.files import FileFault, resolve_beside
from mc_engine.numbers_in_text import counted
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
class DispersionContext:
    """What the keys of one dispersion are checked against.

    keys : those of the section, numbers in the parameter's unit.  findings : where problems are noted.
    """

    item: Parameter | Setting
    nominal: Scalar
    design: str
    keys: SimpleNamespace
    directory: Path
    findings: Findings


def build_distribution(context: DispersionContext) -> Distribution | None:
    """The distribution that the keys describe; None without `dist`, or where a problem was noted."""
    if context.keys.dist is None:
        return None
    before = len(context.findings.problems)
    distribution = _BUILDERS[context.keys.dist](context)
    if distribution is None or len(context.findings.problems) > before:
        return None
    if not isinstance(distribution, Discrete | Empirical | Constant):
        refuse_no_spread(*distribution.span, context.findings)
    if isinstance(distribution, Continuous):
        distribution = _truncated(distribution, context)
    if distribution is not None and isinstance(context.item, Parameter):
        distribution = _inside_parameter_range(distribution, context)
    return distribution


def refuse_no_spread(low: float, high: float, findings: Findings) -> None:
    """Note a spread that is lost in the rounding of the numbers that it surrounds."""
    if low == high:
        findings.add("", f"the spread is too small for the digits of {number(low)}: all values would be equal")


def _truncated(distribution: Continuous, context: DispersionContext) -> Continuous | Truncated | None:
    """The distribution between the bounds `lower` and `upper` of the file."""
    lower, upper = _cut(context)
    if not _in_order(context, lower, upper):
        return None
    if (lower, upper) == (-math.inf, math.inf):
        return distribution
    if distribution.share_between(lower, upper) < _LEAST_SHARE:
        context.findings.add("lower" if lower > -math.inf else "upper", "the bounds leave nothing of the distribution")
        return None
    return truncate(distribution, lower, upper)


def _cut(context: DispersionContext) -> tuple[float, float]:
    """The bounds of the file, infinite where it has none."""
    lower, upper = context.keys.lower, context.keys.upper
    return -math.inf if lower is None else lower, math.inf if upper is None else upper


def _in_order(context: DispersionContext, lower: float, upper: float) -> bool:
    if lower < upper:
        return True
    context.findings.add("lower", f"{number(lower)} is not below upper = {number(upper)}")
    return False


def _inside_parameter_range(distribution: Distribution, context: DispersionContext) -> Distribution | None:
    """The distribution checked against the range that the model accepts; a tail below `_UNSEEN_SHARE` is truncated."""
    low, high = context.item.low, context.item.high
    lowest, highest = distribution.support
    if low <= lowest and highest <= high:
        return distribution
    if isinstance(distribution, Continuous | Truncated):
        share = share_outside(distribution, low, high)
        if share < _UNSEEN_SHARE:
            return truncate(distribution, low, high)
        accepted = accepted_range(context.item)
        context.findings.add("", f"{share:.2g} of the draws would be outside {accepted}; cut with lower and upper")
    else:
        reach = f"{number(lowest)} to {number(highest)}" if lowest < highest else number(lowest)
        context.findings.add("", f"reaches {reach}; the model accepts {accepted_range(context.item)}")
    return None


def _normal(context: DispersionContext) -> Distribution | None:
    keys = context.keys
    given = [key for key in ("sigma", "three_sigma") if getattr(keys, key) is not None]
    if len(given) != 1:
        context.findings.add("", f"needs sigma or three_sigma{', not both' if given else ''}")
        return None
    return Normal(
        _given_or_nominal(keys.mean, context), keys.sigma if keys.sigma is not None else keys.three_sigma / 3.0
    )


def _uniform(context: DispersionContext) -> Distribution | None:
    bounds = _bounds(context, "mean")
    return Uniform(*bounds) if bounds else None


def _triangular(context: DispersionContext) -> Distribution | None:
    bounds = _bounds(context, "mode")
    mode = _given_or_nominal(context.keys.mode, context)
    if bounds is None:
        return None
    if not bounds[0] <= mode <= bounds[1]:
        given = "" if context.keys.mode is not None else "the nominal value "
        ends = f"{number(bounds[0])} and {number(bounds[1])}"
        context.findings.add("mode", f"{given}{number(mode)} is not between {ends}")
        return None
    return Triangular(bounds[0], mode, bounds[1])


def _bounds(context: DispersionContext, middle: str) -> tuple[float, float] | None:
    """(lower, upper) as given, which excludes a `mean`; or by half_range about the value of the key `middle`."""
    keys = context.keys
    plain = [keys.lower, keys.upper]
    if keys.half_range is None and None not in plain:
        if middle == "mean" and keys.mean is not None:
            context.findings.add("mean", "belongs to half_range; lower and upper already say it all")
        return (keys.lower, keys.upper) if _in_order(context, keys.lower, keys.upper) else None
    if keys.half_range is not None and plain == [None, None]:
        centre = _given_or_nominal(getattr(keys, middle), context)
        return about(centre, keys.half_range, context.item)
    context.findings.add("", "needs lower and upper, or half_range, not a mixture of them")
    return None


def _lognormal(context: DispersionContext) -> Distribution | None:
    keys = context.keys
    by_median, by_mean = keys.log_sigma is not None, keys.sigma is not None
    if by_median == by_mean or (by_median and keys.mean is not None) or (by_mean and keys.median is not None):
        context.findings.add("", "needs median with log_sigma, or mean with sigma")
        return None
    centre = _given_or_nominal(keys.median if by_median else keys.mean, context)
    if not centre > 0.0:
        key = "median" if by_median else "mean"
        context.findings.add(key, f"the nominal value {number(centre)} is not above 0, as a log-normal must be")
        return None
    return Lognormal(centre, keys.log_sigma) if by_median else Lognormal.from_moments(centre, keys.sigma)


def _beta(context: DispersionContext) -> Distribution | None:
    keys = context.keys
    return Beta(keys.alpha, keys.beta, keys.lower, keys.upper) if _in_order(context, keys.lower, keys.upper) else None


def _exponential(context: DispersionContext) -> Distribution:
    return Exponential(_given_or_nominal(context.keys.origin, context), context.keys.scale)


def checked_values(context: DispersionContext) -> list[Scalar | None]:
    """The key `values` as the input takes it; None for each value with a mistake."""
    return [
        check_value(value, context.item, context.findings, f"values {k}")
        for k, value in enumerate(context.keys.values, start=1)
    ]


def _discrete(context: DispersionContext) -> Distribution | None:
    values = checked_values(context)
    weights = context.keys.weights if context.keys.weights is not None else [1.0] * len(values)
    if len(weights) != len(values):
        context.findings.add("weights", f"{counted(len(weights), 'weight')} for {counted(len(values), 'value')}")
    elif not sum(weights) >= 1.0 / LARGEST:
        context.findings.add("weights", "are too small" if any(weights) else "are all zero")
    elif None not in values:
        drawn = [(value, weight) for value, weight in zip(values, weights, strict=True) if value is not None and weight]
        return Discrete(*zip(*drawn, strict=True))  # a grid has no level of weight 0
    return None


def _empirical(context: DispersionContext) -> Distribution | None:
    keys = context.keys
    try:
        measured = empirical_numbers(resolve_beside(context.directory, keys.file), keys.column)
    except FileFault as fault:
        context.findings.add("file", str(fault))
        return None
    if keys.unit is not None:
        converted = (convert(value, keys.unit, context.item.unit) for value in measured)
        measured = tuple(within_rounding(value, context.item) for value in converted)
    lower, upper = _cut(context)
    if not _in_order(context, lower, upper):
        return None
    kept = Empirical(measured).within(lower, upper)
    if not kept.values:
        context.findings.add(
            "lower" if keys.lower is not None else "upper", f"the bounds leave none of the {len(measured)} numbers"
        )
        return None
    return kept


def _constant(context: DispersionContext) -> Distribution | None:
    value = check_value(context.keys.value, context.item, context.findings, "value")
    return None if value is None else Constant(value)


_BUILDERS: dict[str, Callable[[DispersionContext], Distribution | None]] = {
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


def _given_or_nominal(given: float | None, context: DispersionContext) -> float:
    """The value given, or the nominal one."""
    return float(context.nominal) if given is None else given
