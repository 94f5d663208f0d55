"""Summary of one metric over the cases: how many numbers there are, where they lie, how surely.

Every summary says n_used of n_tried: failed cases and NaN have no number, and are never dropped silently.
Nothing in it is an approximation of a stream: mean and quantiles are exact whether the values are at hand
(`summarize`) or seen part by part (`summarize_parts`), and no bit depends on the order or the size of the parts.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mc_engine.statistics.moments import Spread, Tally, finite_values
from mc_engine.statistics.normality import Normality
from mc_engine.statistics.order_statistics import QUANTILES, Quantile, quantile, ranked_quantile, ranks_read
from mc_engine.statistics.selection import PASSES, Selection

_ROUNDING = 1e-12  # of the size of two numbers: more than rounding adds up to over thousands of steps


def nearly_equal(low: float, high: float) -> bool:
    """Whether two numbers are the same but for rounding."""
    low, high = float(low), float(high)  # whose difference may be infinite without a word
    return high == low or abs(high - low) <= _ROUNDING * max(abs(low), abs(high))


@dataclass(frozen=True)
class Summary:
    """Statistics of the finite values of a metric; what n_used is too small for is None (or no quantile)."""

    n_used: int
    n_tried: int
    mean: float | None
    sd: float | None
    minimum: float | None
    maximum: float | None
    quantiles: tuple[Quantile, ...]
    confidence: float
    shape: Normality | None

    @property
    def constant(self) -> bool:
        """All values that there are are the same, but for rounding."""
        return self.minimum is not None and self.maximum is not None and nearly_equal(self.minimum, self.maximum)

    @property
    def spread(self) -> float | None:
        """sd, or None where it is that of rounding or nothing: the digits of a number that it would ask for mean
        nothing."""
        return None if self.constant else self.sd

    def at(self, probability: float) -> Quantile | None:
        """The quantile for `probability`, or None without one."""
        return next((item for item in self.quantiles if item.probability == probability), None)


def summarize(values: np.ndarray, *, probabilities: tuple[float, ...] = QUANTILES, confidence: float = 0.90) -> Summary:
    """Summary of `values` (float64[n_tried]; NaN and infinite values count as tried, not as used).

    sd has n - 1 in its denominator and is None below two values.  Each quantile limit holds with a
    probability of 1 - (1 - confidence)/2.  No bit of it depends on the order of the values.
    """
    tally = Tally()
    finite = tally.add(np.asarray(values, dtype=np.float64))
    if not finite.size:
        return _without_number(tally, confidence)
    spread = Spread(tally)
    spread.add(finite)
    ordered = np.sort(finite)
    return _summary(spread, tuple(quantile(ordered, one, confidence) for one in probabilities), confidence)


def summarize_parts(
    passes: Callable[[], Iterable[Mapping[str, np.ndarray]]],
    names: Sequence[str],
    *,
    probabilities: tuple[float, ...] = QUANTILES,
    confidence: float = 0.90,
) -> dict[str, Summary]:
    """`summarize` for every name, to the same bits, of a table that is never held whole.

    passes : called four times; each time all parts of the same table in any order, float64[n_part] by name.
    """
    tallies = {name: Tally() for name in names}
    digits = {name: Selection() for name in names}
    for part in passes():
        for name in names:
            digits[name].add(tallies[name].add(np.asarray(part[name], dtype=np.float64)))
    used = [name for name in names if tallies[name].n_used]
    spreads = {name: Spread(tallies[name]) for name in used}
    for name in used:
        ranks = set().union(*(ranks_read(tallies[name].n_used, one, confidence) for one in probabilities))
        digits[name] = digits[name].next(ranks)
    for later in range(1, PASSES):
        for part in passes():
            for name in used:
                finite = finite_values(np.asarray(part[name], dtype=np.float64))
                digits[name].add(finite)
                if later == 1:
                    spreads[name].add(finite)
        digits.update({name: digits[name].next() for name in used})
    found = {}
    for name in names:
        if name not in spreads:
            found[name] = _without_number(tallies[name], confidence)
            continue
        at = digits[name].values.__getitem__
        n = tallies[name].n_used
        quantiles = tuple(ranked_quantile(n, at, one, confidence) for one in probabilities)
        found[name] = _summary(spreads[name], quantiles, confidence)
    return found


def _without_number(tally: Tally, confidence: float) -> Summary:
    return Summary(0, tally.n_tried, None, None, None, None, (), confidence, None)


def _summary(spread: Spread, quantiles: tuple[Quantile, ...], confidence: float) -> Summary:
    tally = spread.tally
    return Summary(
        n_used=tally.n_used,
        n_tried=tally.n_tried,
        mean=tally.mean,
        sd=spread.sd,
        minimum=tally.minimum,
        maximum=tally.maximum,
        quantiles=quantiles,
        confidence=confidence,
        shape=spread.shape,
    )
