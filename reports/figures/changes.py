"""Changes from one run to another: a row a metric, how far its mean moved and how much its spread grew or shrank."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reports.drawing.marks import Axis, Limit, Panels, Plot, Points
from reports.drawing.palette import BLUE, INK, VERMILION
from reports.text.numbers import number

MARKS = ((BLUE, "circle"), (VERMILION, "diamond"))  # by whether the change is significant


@dataclass(frozen=True)
class ChangePanel:
    """One kind of change.  value, lower, upper : float64[n_metrics], NaN where not defined; significant : bool.

    none : where nothing changed, 0 of a difference, 1 of a ratio; a ratio stands on a logarithmic axis.
    """

    title: str
    value: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    significant: np.ndarray
    none: float

    @property
    def span(self) -> tuple[float, float]:
        """Ends of the axis: every value and, unless they reach far beyond, every interval."""
        values = self.value[np.isfinite(self.value)]
        place = np.log(np.append(values, self.none)) if self.none else np.append(values, self.none)
        ends = np.log(np.concatenate([self.lower, self.upper])) if self.none else np.r_[self.lower, self.upper]
        ends = ends[np.isfinite(ends)]
        reach = max(float(np.ptp(place)), 0.1)
        low = max(float(min(place.min(), *ends, place.min())), float(place.min()) - reach) - 0.05 * reach
        high = min(float(max(place.max(), *ends, place.max())), float(place.max()) + reach) + 0.05 * reach
        return (float(np.exp(low)), float(np.exp(high))) if self.none else (low, high)


def change_figure(metrics: Sequence[str], panels: Sequence[ChangePanel], content: str) -> Panels:
    """Panels over the same metrics, of which the first stands on top.  content : of the intervals."""
    parts = []
    for panel in panels:
        sure = np.flatnonzero(panel.significant & np.isfinite(panel.value)).tolist()
        moved = [f"{metrics[k]} {number(float(panel.value[k]), 3)}" for k in sure]
        parts.append(f"{panel.title}: {', '.join(moved) if moved else 'no metric changed significantly'}")
    return Panels(tuple(_plot(metrics, panel, content) for panel in panels), f"{'; '.join(parts)}.")


def _plot(metrics: Sequence[str], panel: ChangePanel, content: str) -> Plot:
    marks: list[Limit | Points] = [Limit(panel.none, "x", INK, "no change", "dash", 1.0, key="no change")]
    keys = "not significant", f"significant, with its {content} interval"
    told = [
        f"{name}: {number(value, 3)}, {number(low, 3)} to {number(high, 3)}"
        for name, value, low, high in zip(metrics, panel.value, panel.lower, panel.upper, strict=True)
    ]
    for sure, (colour, sign) in enumerate(MARKS):
        rows = np.flatnonzero(np.isfinite(panel.value) & (panel.significant == bool(sure)))
        ends, texts = (panel.lower[rows], panel.upper[rows]), [told[k] for k in rows]
        marks.append(
            Points(panel.value[rows], rows, colour, sign=sign, size=8.0, texts=texts, x_ends=ends, key=keys[sure])
        )
    ticks = tuple((tick, number(tick, 3)) for tick in ratio_ticks(panel.span)) if panel.none else None
    x = Axis(reach=panel.span, log=bool(panel.none), ticks=ticks)
    y = Axis(reach=(len(metrics) - 0.5, -0.5), ticks=tuple(enumerate(metrics)))
    return Plot(tuple(marks), x, y, panel.title, 70.0 + 24.0 * len(metrics))


def ratio_ticks(span: tuple[float, float]) -> list[float]:
    """Round ratios inside the span, at most seven of them, 1 always among them."""
    for steps in ((1.0, 1.02, 1.04, 1.06, 1.08), (1.0, 1.05, 1.1, 1.15, 1.2), (1.0, 1.1, 1.2, 1.3, 1.5),
                  (1.0, 1.25, 1.5, 2.0, 3.0), (1.0, 2.0, 5.0, 10.0, 20.0), (1.0, 10.0, 100.0, 1e3, 1e4)):  # fmt: skip
        if max(span[1], 1.0 / span[0]) <= steps[-1] * 1.05:
            break
    ticks = sorted({round(1.0 / step, 3) for step in steps} | set(steps))
    return [tick for tick in ticks if span[0] <= tick <= span[1]]
