"""Success probability along single inputs, with exact limits, a panel per requirement and input."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mc_engine.statistics.drivers import SuccessCurve
from reports.drawing.marks import Axis, Limit, Line, Panels, Plot, Points, joined
from reports.drawing.palette import BLUE, MUTED, VERMILION
from reports.text.numbers import count, number, percent


@dataclass(frozen=True)
class SuccessPanel:
    """title : the requirement;  label : of the input's axis;  overall : success probability of all cases."""

    title: str
    label: str
    curve: SuccessCurve
    overall: float

    @property
    def share(self) -> np.ndarray:
        """float64[n_bins], percent."""
        return 100.0 * self.curve.passed / self.curve.tried

    @property
    def names(self) -> tuple[str, ...]:
        """Levels of a group, as far as they were flown."""
        return tuple(self.curve.levels[int(k)] for k in self.curve.middle) if self.curve.levels else ()

    @property
    def places(self) -> np.ndarray:
        return np.arange(self.curve.middle.size, dtype=np.float64) if self.curve.levels else self.curve.middle


def success_figure(panels: Sequence[SuccessPanel], confidence: float) -> Panels:
    """confidence : of the limits, two-sided."""
    parts = []
    for panel in panels:
        low, high = int(panel.share.argmin()), int(panel.share.argmax())
        ends = [panel.names[k] if panel.names else number(float(panel.curve.middle[k]), 3) for k in (low, high)]
        parts.append(
            f"{panel.title} along {panel.label}: lowest {number(float(panel.share[low]), 3)} % at {ends[0]}, "
            f"highest {number(float(panel.share[high]), 3)} % at {ends[1]}"
        )
    plots = tuple(_plot(panel, confidence) for panel in panels)
    return Panels(plots, f"Success probability in bins of single inputs. {'; '.join(parts)}.")


def _plot(panel: SuccessPanel, confidence: float) -> Plot:
    curve, share = panel.curve, panel.share
    marks: list[Line | Limit | Points] = []
    if not panel.names:
        bins = zip(curve.low, curve.high, share, strict=True)
        line = joined([np.array([[low, one], [high, one]]) for low, high, one in bins])
        marks.append(Line(line[:, 0], line[:, 1], MUTED, "bin", width=1.5, key="extent of the bin"))
    told = tuple(
        f"{count(int(passed))} of {count(int(tried))} cases pass: {number(float(one), 4)} %"
        for passed, tried, one in zip(curve.passed, curve.tried, share, strict=True)
    )
    marks.append(Limit(100.0 * panel.overall, "y", VERMILION, "all cases", "dash", 1.4, key="all cases"))
    key = f"share of a bin that passes, at its median, with {percent(confidence)} Clopper–Pearson interval"
    ends = 100.0 * curve.lower, 100.0 * curve.upper
    marks.append(Points(panel.places, share, BLUE, size=6.0, texts=told, y_ends=ends, key=key))
    x = Axis(panel.label)
    if panel.names:
        ticks = tuple(zip(panel.places.tolist(), panel.names, strict=True))
        x = Axis(panel.label, reach=(-0.5, len(ticks) - 0.5), ticks=ticks)
    return Plot(tuple(marks), x, Axis("pass [%]", most=5), panel.title, 260.0)
