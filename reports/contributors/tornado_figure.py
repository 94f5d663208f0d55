"""The figure of the contributors: a tornado of their effects, a panel a metric."""

from collections.abc import Iterable, Sequence

import numpy as np

from reports.document.blocks import FigureBlock
from reports.drawing.marks import Drawing
from reports.figures.rows import tornado
from reports.run.contributions import UNEXPLAINED, Contributor
from reports.run.flown import Flown
from reports.text.numbers import number, percent

MOST_METRICS = 6  # of the figure
STRONGEST = 5  # of a metric
SMALL = 0.02  # a smaller effect is left out, but for the strongest
LEFT = 0.005  # an unexplained share below it is not told


def contributor_figure(
    flown: Flown, by_metric: Iterable[tuple[str, Sequence[Contributor]]], source: str
) -> FigureBlock:
    """by_metric : words and contributors of each metric.  source : what the effects were estimated from."""
    panels, told = [], []
    interval = f"{percent(flown.stated.confidence)} confidence"
    for words, found in list(by_metric)[:MOST_METRICS]:
        rows = strongest(found)
        names = [name_of(flown, one.input) for one in rows]
        total = _values((one.total, one.total_interval) for one in rows)
        first = _values((one.first, one.first_interval) for one in rows)
        panels.append(tornado(words, names, total, first, interval))
        effects = [f"{name} {number(one.size, 2)}" for name, one in zip(names[:3], rows, strict=False)]
        told.append(f"{words}: {', '.join(effects)}")
    caption = f"Total and first-order effects of the contributors to each metric, {source}."
    return FigureBlock(caption, Drawing("Tornado diagrams", tuple(panels), words="; ".join(told)), "half")


def name_of(flown: Flown, one: str) -> str:
    """A contributor in words: an input, a group of inputs, or the random draws."""
    if one == UNEXPLAINED:
        return f"{UNEXPLAINED} by the inputs"
    return flown.words(one) if one in flown.columns else one


def strongest(found: Sequence[Contributor]) -> list[Contributor]:
    """The first one, others whose effect is surely more than nothing, and what is unexplained."""
    named = sorted((one for one in found if one.input != UNEXPLAINED), key=lambda one: -one.size)
    sure = [one for one in named[1:STRONGEST] if one.size >= SMALL and max(map(surely, intervals(one)))]
    return [*named[:1], *sure, *(one for one in found if one.input == UNEXPLAINED and one.size >= LEFT)]


def intervals(one: Contributor) -> tuple[tuple[float, float] | None, ...]:
    return one.first_interval, one.total_interval


def surely(interval: tuple[float, float] | None) -> bool:
    """Whether an effect with this interval is more than noise."""
    return interval is not None and interval[0] > 0.0


def _values(found: Iterable[tuple[float | None, tuple[float, float] | None]]) -> np.ndarray:
    """float64[n, 3]: values and ends of their intervals, NaN for what is not known."""
    return np.array([(value, *(ends or (None, None))) for value, ends in found], dtype=np.float64)
