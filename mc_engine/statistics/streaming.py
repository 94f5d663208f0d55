"""Summaries and verdicts from a case table that is read part by part; bit-identical to those of the whole table.

Two to four passes: the first counts, and finds means and extremes; the second computes the moments, and with the later
ones the order statistics for quantiles, their intervals and the verdicts.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mc_engine.statistics.moments import Spread, Tally, finite_values
from mc_engine.statistics.order_statistics import QUANTILES, ranked_quantile, ranks_read
from mc_engine.statistics.requirements import LimitCounts, Verdict, judge_counted
from mc_engine.statistics.selection import Selection
from mc_engine.statistics.summary import Summary, summary_of, without_number

Passes = Callable[[Sequence[str]], Iterable[Mapping[str, np.ndarray]]]


@dataclass(frozen=True)
class Streamed:
    """The result over all cases: a summary of every metric, the counts of limits, and the verdicts."""

    summaries: dict[str, Summary]
    counts: LimitCounts
    verdicts: list[Verdict]
    joint: Verdict | None


def stream(
    passes: Passes,
    metrics: Sequence[str],
    *,
    requirements: Sequence[Mapping[str, Any]] = (),
    design: str = "mc",
    looked: bool = False,
    probabilities: tuple[float, ...] = QUANTILES,
    confidence: float = 0.90,
) -> Streamed:
    """`summarize` for every metric and `judge_all` for the requirements, which are on some of them.

    passes : called once a pass with the metrics that it looks at; each time all parts of the same table in any order,
    float64[n_part] by metric, NaN where a case was not completed.
    """
    counts = LimitCounts(requirements)
    tallies = {name: Tally() for name in metrics}
    digits = {name: Selection() for name in metrics}
    for part in passes(metrics):
        columns = {name: np.asarray(part[name], dtype=np.float64) for name in metrics}
        for name, values in columns.items():
            digits[name].add(tallies[name].add(values))
        if requirements:
            first = columns[str(requirements[0]["metric"])]
            counts.add(columns.__getitem__, np.ones(first.size, dtype=bool))
    used = [name for name in metrics if tallies[name].n_used]
    wanted = {
        name: set().union(*(ranks_read(tallies[name].n_used, p, confidence) for p in probabilities)) for name in used
    }

    def asked(metric: str, rank: int) -> float:
        wanted[metric].add(rank)
        return 0.0

    judge_counted(counts, asked, design, looked)
    digits = {name: digits[name].next(wanted[name]) for name in used}
    spreads = {name: Spread(tallies[name]) for name in used}
    unsettled, second = used, True
    while unsettled:
        for part in passes(unsettled):
            for name in unsettled:
                finite = finite_values(np.asarray(part[name], dtype=np.float64))
                digits[name].add(finite)
                if second:
                    spreads[name].add(finite)
        digits.update({name: digits[name].next() for name in unsettled})
        unsettled, second = [name for name in unsettled if not digits[name].done], False
    ranked = {name: selection.values for name, selection in digits.items()}
    summaries = {}
    for name, tally in tallies.items():
        if name not in spreads:
            summaries[name] = without_number(tally, confidence)
            continue
        quantiles = (ranked_quantile(tally.n_used, ranked[name].__getitem__, p, confidence) for p in probabilities)
        summaries[name] = summary_of(spreads[name], tuple(quantiles), confidence)
    return Streamed(summaries, counts, *judge_counted(counts, lambda name, rank: ranked[name][rank], design, looked))
