"""Summaries and verdicts from a case table that is read part by part; bit-identical to those of the whole table.

Two to four passes are made.  The first counts, and finds means and extremes.  The second computes the moments, and
together with later ones the order statistics for quantiles, their intervals and the verdicts.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mc_engine.statistics.limits import LimitCounts
from mc_engine.statistics.moments import Spread, Tally, finite_values
from mc_engine.statistics.order_statistics import QUANTILES, ranked_quantile, ranks_read
from mc_engine.statistics.requirements import Verdict, judge_counted, judged_by
from mc_engine.statistics.selection import Selection
from mc_engine.statistics.summary import Summary, summary_of, without_number
from mc_engine.statistics.tolerance import Judged

Passes = Callable[[Sequence[str]], Iterable[Mapping[str, np.ndarray]]]


@dataclass(frozen=True)
class Streamed:
    """The result over all cases: a summary of every metric, the counts of cases outside limits, and the verdicts."""

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
    chained: bool = False,
    probabilities: tuple[float, ...] = QUANTILES,
    confidence: float = 0.90,
) -> Streamed:
    """`summarize` for every metric and `judge_all` for the requirements, which are on some of them.

    passes : called once for each pass with the metrics that it needs; returns all parts of the same table in any order,
    float64[n_part] by metric, NaN where a case was not completed.
    """
    counts = LimitCounts(requirements)
    tallies = {name: Tally() for name in metrics}
    digits = {column: Selection() for column in dict.fromkeys([*map(Judged, metrics), *map(judged_by, requirements)])}
    for part in passes(metrics):
        columns = {name: np.asarray(part[name], dtype=np.float64) for name in metrics}
        finite = {name: tallies[name].add(values) for name, values in columns.items()}
        for column, selection in digits.items():
            selection.add(column.of(finite[column.metric]))
        if requirements:
            first = columns[str(requirements[0]["metric"])]
            counts.add(columns.__getitem__, np.ones(first.size, dtype=bool))
    used = [name for name in metrics if tallies[name].n_used]
    wanted = {column: set[int]() for column in digits if column.metric in used}
    for name in used:
        wanted[Judged(name)].update(*(ranks_read(tallies[name].n_used, p, confidence) for p in probabilities))

    def asked(column: Judged, rank: int) -> float:
        wanted[column].add(rank)
        return 0.0

    judge_counted(counts, asked, design, looked, chained)
    spreads = {name: Spread(tallies[name]) for name in used}
    ranked = _ranked(passes, {column: digits[column].next(ranks) for column, ranks in wanted.items()}, spreads)
    summaries = {}
    for name, tally in tallies.items():
        if name not in spreads:
            summaries[name] = without_number(tally, confidence)
            continue
        quantiles = (
            ranked_quantile(tally.n_used, ranked[Judged(name)].__getitem__, p, confidence) for p in probabilities
        )
        summaries[name] = summary_of(spreads[name], tuple(quantiles), confidence)
    return Streamed(
        summaries, counts, *judge_counted(counts, lambda column, rank: ranked[column][rank], design, looked, chained)
    )


def _ranked(
    passes: Passes, digits: dict[Judged, Selection], spreads: Mapping[str, Spread]
) -> dict[Judged, dict[int, float]]:
    """The wanted values by rank, in as many passes as they take; the first of these passes adds up the spreads too."""
    unsettled, second = [*digits], True
    while unsettled:
        names = list(dict.fromkeys(column.metric for column in unsettled))
        for part in passes(names):
            finite = {name: finite_values(np.asarray(part[name], dtype=np.float64)) for name in names}
            for column in unsettled:
                digits[column].add(column.of(finite[column.metric]))
            for name in names if second else ():
                spreads[name].add(finite[name])
        digits.update({column: digits[column].next() for column in unsettled})
        unsettled, second = [column for column in unsettled if not digits[column].done], False
    return {column: selection.values for column, selection in digits.items()}
