"""Probability distributions as quantile functions: from a uniform number to a value.

Every draw is `quantiles(distribution, u)`, so any design in the unit cube works with any distribution.  Truncated
draws are F^-1(F(lower) + u (F(upper) - F(lower))), so they never accumulate at a bound.

`cdf` and `sf` (its complement) take one number and need no scipy, so that a campaign file is checked fast.
"""

import math
from abc import ABC, abstractmethod
from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from functools import cached_property

import numpy as np

Scalar = float | bool | str

_BELOW_ONE = 1.0 - 2.0**-53
_TAIL = 0.5 * math.erfc(3.0 / math.sqrt(2.0))  # share of a normal beyond three sigma on one side, 0.00135


class Distribution(ABC):
    """A distribution of one input, in the input's declared unit."""

    @property
    @abstractmethod
    def support(self) -> tuple[float, float]:
        """Lowest and highest possible value; infinite for an unbounded tail."""

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest level in a design by levels: the support, or three sigma where it is unbounded."""
        return self.support

    @abstractmethod
    def ppf(self, u: np.ndarray) -> np.ndarray:
        """Quantiles: the values at the cumulative probabilities u, 0 < u < 1."""


class Continuous(Distribution):
    """A distribution that may be truncated: both of its tails are computed to full relative accuracy."""

    @abstractmethod
    def cdf(self, x: float) -> float:
        """Probability of a value below x."""

    @abstractmethod
    def sf(self, x: float) -> float:
        """Probability of a value above x."""

    @abstractmethod
    def isf(self, q: np.ndarray) -> np.ndarray:
        """The values that are exceeded with the probabilities q."""

    def share_between(self, lower: float, upper: float) -> float:
        """Probability of a value within [lower, upper], accurate in either tail."""
        if self.cdf(lower) < 0.5:
            return self.cdf(upper) - self.cdf(lower)
        return self.sf(lower) - self.sf(upper)


@dataclass(frozen=True)
class Normal(Continuous):
    """Normal, without bounds; its `span` is three sigma either way."""

    mean: float
    sigma: float

    @property
    def support(self) -> tuple[float, float]:
        return -math.inf, math.inf

    @property
    def span(self) -> tuple[float, float]:
        return self.mean - 3.0 * self.sigma, self.mean + 3.0 * self.sigma

    def cdf(self, x: float) -> float:
        return 0.5 * math.erfc((self.mean - x) / (self.sigma * math.sqrt(2.0)))

    def sf(self, x: float) -> float:
        return 0.5 * math.erfc((x - self.mean) / (self.sigma * math.sqrt(2.0)))

    def ppf(self, u: np.ndarray) -> np.ndarray:
        from scipy.special import ndtri

        numbers: np.ndarray = ndtri(u)
        numbers *= self.sigma
        numbers += self.mean  # in place, for memory that is new takes longer than the arithmetic
        return numbers

    def isf(self, q: np.ndarray) -> np.ndarray:
        from scipy.special import ndtri

        return self.mean - self.sigma * ndtri(q)


@dataclass(frozen=True)
class Lognormal(Continuous):
    """exp of a normal: `median` in the input's unit, `log_sigma` the standard deviation of ln x."""

    median: float
    log_sigma: float

    @classmethod
    def from_moments(cls, mean: float, sigma: float) -> "Lognormal":
        """The log-normal with this mean and standard deviation of x itself."""
        variance = math.log1p((sigma / mean) ** 2)
        return cls(mean * math.exp(-0.5 * variance), math.sqrt(variance))

    @property
    def support(self) -> tuple[float, float]:
        return 0.0, math.inf

    @property
    def span(self) -> tuple[float, float]:
        factor = math.exp(3.0 * self.log_sigma)
        return self.median / factor, self.median * factor

    def _standard(self, x: float) -> float:
        # a difference of logarithms: the quotient of extreme numbers would fall to zero
        distance = math.log(x) - math.log(self.median) if x > 0.0 else -math.inf
        return distance / (self.log_sigma * math.sqrt(2.0))

    def cdf(self, x: float) -> float:
        return 0.5 * math.erfc(-self._standard(x))

    def sf(self, x: float) -> float:
        return 0.5 * math.erfc(self._standard(x))

    def ppf(self, u: np.ndarray) -> np.ndarray:
        from scipy.special import ndtri

        return self.median * np.exp(self.log_sigma * ndtri(u))

    def isf(self, q: np.ndarray) -> np.ndarray:
        from scipy.special import ndtri

        return self.median * np.exp(-self.log_sigma * ndtri(q))


@dataclass(frozen=True)
class Exponential(Continuous):
    """Exponential density from `origin` on, falling by the factor e every `scale`; the mean is origin + scale."""

    origin: float
    scale: float

    @property
    def support(self) -> tuple[float, float]:
        return self.origin, math.inf

    @property
    def span(self) -> tuple[float, float]:
        return self.origin - self.scale * math.log1p(-_TAIL), self.origin - self.scale * math.log(_TAIL)

    def cdf(self, x: float) -> float:
        return -math.expm1(-max(x - self.origin, 0.0) / self.scale)

    def sf(self, x: float) -> float:
        return math.exp(-max(x - self.origin, 0.0) / self.scale)

    def ppf(self, u: np.ndarray) -> np.ndarray:
        return self.origin - self.scale * np.log1p(-u)

    def isf(self, q: np.ndarray) -> np.ndarray:
        return self.origin - self.scale * np.log(q)


@dataclass(frozen=True)
class Truncated(Distribution):
    """`base` conditional on a value within [lower, upper], which must have a positive probability."""

    base: Continuous
    lower: float
    upper: float

    @property
    def support(self) -> tuple[float, float]:
        low, high = self.base.support
        return max(low, self.lower), min(high, self.upper)

    @property
    def span(self) -> tuple[float, float]:
        low, high = self.base.span
        low, high = max(low, self.lower), min(high, self.upper)
        if low >= high:  # wholly in one tail, and perhaps without an end
            low, high = quantiles(self, np.array([_TAIL, 1.0 - _TAIL])).tolist()
        return low, high

    def ppf(self, u: np.ndarray) -> np.ndarray:
        below, above = self.base.cdf(self.lower), self.base.sf(self.lower)
        if below < 0.5:
            # 1 by rounding would be infinite
            x = self.base.ppf(np.minimum(below + u * (self.base.cdf(self.upper) - below), _BELOW_ONE))
        else:  # in the upper tail the cdf is 1 but for the last digits; its complement is exact
            x = self.base.isf(above - u * (above - self.base.sf(self.upper)))
        return np.clip(x, *self.support)  # takes back the last rounding, nothing more


@dataclass(frozen=True)
class Uniform(Distribution):
    """Constant density from lower to upper."""

    lower: float
    upper: float

    @property
    def support(self) -> tuple[float, float]:
        return self.lower, self.upper

    def ppf(self, u: np.ndarray) -> np.ndarray:
        return self.lower + u * (self.upper - self.lower)


@dataclass(frozen=True)
class Triangular(Distribution):
    """Density that rises linearly from lower to mode, and falls linearly from there to upper."""

    lower: float
    mode: float
    upper: float

    @property
    def support(self) -> tuple[float, float]:
        return self.lower, self.upper

    def ppf(self, u: np.ndarray) -> np.ndarray:
        width, rise = self.upper - self.lower, self.mode - self.lower
        left = self.lower + np.sqrt(u * width * rise)
        right = self.upper - np.sqrt((1.0 - u) * width * (self.upper - self.mode))
        return np.where(u * width < rise, left, right)


@dataclass(frozen=True)
class Beta(Distribution):
    """Density proportional to (x - lower)^(alpha - 1) (upper - x)^(beta - 1)."""

    alpha: float
    beta: float
    lower: float
    upper: float

    @property
    def support(self) -> tuple[float, float]:
        return self.lower, self.upper

    def ppf(self, u: np.ndarray) -> np.ndarray:
        from scipy.special import betaincinv

        x = self.lower + (self.upper - self.lower) * betaincinv(self.alpha, self.beta, u)
        return np.minimum(x, self.upper)  # which the sum may exceed by its rounding


@dataclass(frozen=True)
class Discrete(Distribution):
    """One of `values` with its weight; numbers, words or switches.  Quantiles follow the order of `values`."""

    values: tuple[Scalar, ...]
    weights: tuple[float, ...]

    @property
    def support(self) -> tuple[float, float]:
        numbers = [value for value in self.values if not isinstance(value, bool | str)]
        return (min(numbers), max(numbers)) if numbers else (-math.inf, math.inf)

    def ppf(self, u: np.ndarray) -> np.ndarray:
        total = np.cumsum(self.weights)
        # A value of weight zero occupies no interval; side="right" steps over it, and u < 1 keeps off the end.
        index = np.searchsorted(total, u * total[-1], side="right")
        return column(self.values)[index]


@dataclass(frozen=True)
class Empirical(Distribution):
    """Measured values, sorted, with equal probabilities; draws are these values, without interpolation."""

    values: tuple[float, ...]

    @property
    def support(self) -> tuple[float, float]:
        return self.values[0], self.values[-1]

    def within(self, lower: float, upper: float) -> "Empirical":
        """The measured values within [lower, upper]; there may be none."""
        return Empirical(self.values[bisect_left(self.values, lower) : bisect_right(self.values, upper)])

    def ppf(self, u: np.ndarray) -> np.ndarray:
        n_values = len(self.values)
        return self._column[np.minimum((u * n_values).astype(np.int64), n_values - 1)]

    @cached_property
    def _column(self) -> np.ndarray:
        return np.array(self.values)


@dataclass(frozen=True)
class Constant(Distribution):
    """One value, number or word, for every case."""

    value: Scalar

    @property
    def support(self) -> tuple[float, float]:
        return Discrete((self.value,), (1.0,)).support

    def ppf(self, u: np.ndarray) -> np.ndarray:
        return column([self.value] * len(u))


def truncate(distribution: Continuous | Truncated, lower: float, upper: float) -> Truncated:
    """The distribution truncated to [lower, upper]; one that is truncated already is truncated further."""
    if isinstance(distribution, Truncated):
        return Truncated(distribution.base, max(lower, distribution.lower), min(upper, distribution.upper))
    return Truncated(distribution, lower, upper)


def share_outside(distribution: Continuous | Truncated, low: float, high: float) -> float:
    """Probability of a draw outside [low, high]."""
    if isinstance(distribution, Continuous):
        return distribution.cdf(low) + distribution.sf(high)
    base, lower, upper = distribution.base, distribution.lower, distribution.upper
    below = base.share_between(lower, min(max(lower, low), upper))
    above = base.share_between(max(min(upper, high), lower), upper)
    return (below + above) / base.share_between(lower, upper)


def quantiles(distribution: Distribution, u: np.ndarray) -> np.ndarray:
    """The values at uniform numbers u, float64[n] in [0, 1]: float64[n], or bool[n], or object[n] of words.

    0 and 1 are moved inwards by less than their rounding, so that no draw is infinite.
    """
    return distribution.ppf(np.clip(u, 2.0**-54, _BELOW_ONE))


def column(values: tuple[Scalar, ...] | list[Scalar]) -> np.ndarray:
    """The values as one column of a case table: float64, bool, or object where they are words."""
    if any(isinstance(value, str) for value in values):
        return np.array(values, dtype=object)
    return np.array(values, dtype=bool if values and all(isinstance(value, bool) for value in values) else float)
