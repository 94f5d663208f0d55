"""One quantity of the flight against another, as altitude against speed, with percentile bands."""

from dataclasses import dataclass

import numpy as np

from reports.drawing.marks import Axis, Band, Drawing, Line, Plot
from reports.drawing.palette import SKY
from reports.figures.histories import HistoryLine, band_name, band_pairs, case_lines

SAMPLES = 400


@dataclass(frozen=True)
class ProfileBand:
    """Quantiles of x over n_cases at levels of y: float64[n] by probability at levels float64[n]."""

    levels: np.ndarray
    curves: dict[float, np.ndarray]
    n_cases: int
    rising: bool = False  # whether the flights come to the levels from below

    @property
    def pairs(self) -> list[tuple[float, float, float]]:
        """(lower, upper, opacity) of each band, the widest first."""
        return band_pairs(self.curves)

    def curve(self, probability: float) -> np.ndarray:
        """The quantile's curve; 1 - 0.05 is found although it is not 0.95 to the last bit."""
        return next(values for p, values in self.curves.items() if abs(p - probability) < 1e-9)


@dataclass(frozen=True)
class ProfileDrawing(Drawing):
    """Lines of retained cases, their x and y by these names, and the band over the fair ones."""

    lines: tuple[HistoryLine, ...]
    x: str
    y: str
    x_label: str
    y_label: str
    band: ProfileBand | None = None
    second: ProfileBand | None = None  # of the way down after the way up
    form = "Curves along flights, the nominal case among them"

    @property
    def bands(self) -> list[ProfileBand]:
        return [band for band in (self.band, self.second) if band is not None]

    @property
    def plots(self) -> tuple[Plot, ...]:
        marks: list[Band | Line] = []
        for band, (low, high, opacity) in ((one, pair) for one in self.bands for pair in one.pairs):
            lower, upper = band.curve(low), band.curve(high)
            x, y = np.r_[lower, upper[::-1]], np.r_[band.levels, band.levels[::-1]]
            name = band_name(low, high, band.n_cases) + self._way(band)
            marks.append(Band(x, y, SKY, opacity, name, key=name))
        marks += case_lines(self.lines, lambda line: thinned_curve(line.quantities[self.x], line.quantities[self.y]))
        return (Plot(tuple(marks), Axis(self.x_label), Axis(self.y_label), height=440.0),)

    def _way(self, band: ProfileBand) -> str:
        """Which way the flights of a band go, where there are bands of both."""
        return "" if self.second is None else f", {'up' if band.rising else 'down'}"


def thinned_curve(x: np.ndarray, y: np.ndarray, samples: int = SAMPLES) -> tuple[np.ndarray, np.ndarray]:
    """The curve with about `samples` points, evenly along its length in the units of its two ranges.

    Even in time, most points would lie at the end, where the flight is slow.
    """
    if x.size <= samples:
        return x, y
    steps = [np.diff(values) / (np.nanmax(values) - np.nanmin(values) or 1.0) for values in (x, y)]
    length = np.r_[0.0, np.cumsum(np.nan_to_num(np.hypot(*steps)))]
    rows = np.unique(np.searchsorted(length, np.linspace(0.0, length[-1], samples)).clip(0, x.size - 1))
    return x[rows], y[rows]
