"""The figure of the contributors: a tornado of their effects, a panel a metric."""

from collections.abc import Iterable, Sequence

import numpy as np

from reports.document.blocks import FigureBlock
from reports.drawing.marks import Drawing
from reports.figures.rows import tornado
from reports.run.contributions import UNEXPLAINED, Contributor
from reports.run.flown import Flown
from reports.text.numbers import given_percent, number

MOST_METRICS = 6  # of the figure
STRONGEST = 5  # of a metric
SMALL = 0.02  # a smaller effect is left out, but for the strongest
LEFT = 0.005  # an unexplained share below it is not told


def contributor_figure(
    flown: Flown, by_metric: Iterable[tuple[str, Sequence[Contributor]]], source: str
) -> FigureBlock:
    """by_metric : words and contributors of each metric.  source : what the effects were estimated from."""
    by_metric = list(by_metric)
    panels, told, totals = [], [], False
    interval = f"{given_percent(flown.stated.confidence)} confidence"
    for words, contributors in by_metric[:MOST_METRICS]:
        rows = strongest(contributors)
        names = [name_of(flown, row.input) for row in rows]
        total = _effect_array((row.total, row.total_interval) for row in rows)
        first = _effect_array((row.first, row.first_interval) for row in rows)
        totals |= bool(np.isfinite(total[:, 0]).any())
        panels.append(tornado(words, names, total, first, interval))
        sizes = [f"{name} {number(row.size, 2)}" for name, row in zip(names[:3], rows, strict=False)]
        told.append(f"{words}: {', '.join(sizes)}")
    effects = "Total and first-order" if totals else "First-order"
    drawn = "each metric" if len(panels) == len(by_metric) else f"the first {len(panels)} of {len(by_metric)} metrics"
    caption = f"{effects} effects of the contributors to {drawn}, {source}."
    return FigureBlock(caption, Drawing("Tornado diagrams", tuple(panels), words="; ".join(told)), "half")


def name_of(flown: Flown, contributor: str) -> str:
    """A contributor in words: an input, a group of inputs, or the random draws."""
    if contributor == UNEXPLAINED:
        return f"{UNEXPLAINED} by the inputs"
    return flown.words(contributor) if contributor in flown.columns else contributor


def strongest(contributors: Sequence[Contributor]) -> list[Contributor]:
    """The largest contributor, others that surely have an effect, and the unexplained fraction."""
    named = sorted(
        (contributor for contributor in contributors if contributor.input != UNEXPLAINED),
        key=lambda contributor: -contributor.size,
    )
    sure = [contributor for contributor in named[1:STRONGEST] if contributor.size >= SMALL and contributor.surely_acts]
    return [
        *named[:1],
        *sure,
        *(contributor for contributor in contributors if contributor.input == UNEXPLAINED and contributor.size >= LEFT),
    ]


def _effect_array(effects: Iterable[tuple[float | None, tuple[float, float] | None]]) -> np.ndarray:
    """float64[n, 3]: values and ends of their intervals, NaN for what is not known."""
    return np.array([(value, *(ends or (None, None))) for value, ends in effects], dtype=np.float64)
