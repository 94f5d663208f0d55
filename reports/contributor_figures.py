"""The figures of the contributors: per metric a tornado of their effects, and a budget of their 1σ contributions."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from reports.contributions import UNEXPLAINED, Contributor
from reports.document import FigureBlock
from reports.figures.contributors import budget, tornado
from reports.figures.marks import Panels, Plot
from reports.flown import Flown
from reports.numbers import count, number, percent, typeset

MOST_ROWS = 6  # of a panel
SMALL = 0.01  # a smaller effect has no row, but for the strongest


def contributor_figure(
    flown: Flown,
    by_metric: Iterable[tuple[str, str, Sequence[Contributor]]],
    source: str,
    rest: str,
) -> FigureBlock:
    """A row of two panels a metric: its effects, and what they come to in its own unit.

    by_metric : name, words and contributors of each metric.  source : what the effects were estimated from.
    rest : what the budget leaves, in words: what the first-order effects do not hold.
    """
    panels: list[Plot] = []
    told = []
    interval = f"{percent(flown.stated.confidence)} confidence"
    for metric, words, found in by_metric:
        strongest = _strongest(found)
        names = [name_of(flown, one.input) for one in strongest]
        total = _values((one.total, one.total_interval) for one in strongest)
        first = _values((one.first, one.first_interval) for one in strongest)
        panels.append(tornado(words, names, total, first, interval))
        panels.extend(_budgets(flown, metric, words, found, rest))
        effects = [f"{name} {number(one.size, 2)}" for name, one in zip(names[:3], strongest, strict=False)]
        told.append(f"{words}: {', '.join(effects)}")
    caption = (
        "Contributors to each metric. Left: total and first-order effects, the fractions of the metric’s variance that "
        f"come from each contributor with and without its interactions, {source}. Right: 1σ budget. A contribution is "
        "√(first-order effect) × σ; the root sum square of all of them is shown next to the σ of the cases."
    )
    words = f"Tornado diagram and 1σ budget of each metric, by total effect. {'; '.join(told)}."
    return FigureBlock(caption, Panels(tuple(panels), words), "half")


def name_of(flown: Flown, one: str) -> str:
    """A contributor in words: an input, a group of inputs, or the random draws."""
    return flown.words(one) if one in flown.columns else one


def _strongest(found: Sequence[Contributor]) -> list[Contributor]:
    ordered = sorted(found, key=lambda one: -one.size)
    return [one for k, one in enumerate(ordered) if k == 0 or one.size >= SMALL][:MOST_ROWS]


def _values(found: Iterable[tuple[float | None, tuple[float, float] | None]]) -> np.ndarray:
    """float64[n, 3]: values and ends of their intervals, NaN for what is not known."""
    return np.array([(value, *(ends or (None, None))) for value, ends in found], dtype=np.float64)


def sigma_budget(found: Sequence[Contributor], sigma: float) -> tuple[list[tuple[str, float]], float, float]:
    """(contributor, its 1σ contribution), the largest first; their root sum square; what is left of sigma."""
    shares = [(one.input, max(one.first or 0.0, 0.0)) for one in found if one.input != UNEXPLAINED]
    explained = sum(share for _, share in shares)
    contributions = [(name, float(np.sqrt(share)) * sigma) for name, share in shares]
    left = float(np.sqrt(max(1.0 - explained, 0.0))) * sigma
    return sorted(contributions, key=lambda one: -one[1]), float(np.sqrt(explained)) * sigma, left


def _budgets(flown: Flown, metric: str, words: str, found: Sequence[Contributor], rest: str) -> Iterator[Plot]:
    """The budget of a metric of the table; none of one without a spread, nor of a share of cases."""
    summary = flown.summaries.get(metric)
    if summary is None or not summary.sd:
        return
    contributions, root_sum_square, left = sigma_budget(found, summary.sd)
    named = [(name_of(flown, name), value) for name, value in contributions[:MOST_ROWS] if value > 0.0]
    others = contributions[MOST_ROWS:]
    together = float(np.hypot.reduce([0.0, *(value for _, value in others)]))
    named += [(f"{count(len(others))} others", together)] if together > 0.0 else []
    rows = [(name, value, "") for name, value in named]
    rows += [("root sum square", root_sum_square, "sum"), (rest, left, "rest"), ("σ of the cases", summary.sd, "all")]
    yield budget(f"{words}, 1σ budget", rows, typeset(flown.unit(metric)))
