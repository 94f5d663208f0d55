"""A metric over two inputs: filled contours with the flown cases and the nominal on them."""

from dataclasses import dataclass

import numpy as np

from mc_engine.statistics import SurfaceMap
from reports.drawing.marks import Axis, Drawing, Field, Plot, Points, nominal_ring
from reports.drawing.palette import VERMILION
from reports.drawing.ticks import covering
from reports.text.numbers import count, number, with_unit

LEVELS = 12
DOT = "#1b1b1b"  # on the field, whose colours do not follow the page's


@dataclass(frozen=True)
class MapDrawing(Drawing):
    """points : float64[k, 2], the cases shown, with case_ids int64[k] and their metric values float64[k]."""

    surface: SurfaceMap
    x_label: str
    y_label: str
    metric_label: str
    unit: str
    points: np.ndarray
    case_ids: np.ndarray
    point_values: np.ndarray
    n_points: int
    nominal: tuple[float, float] | None
    columns: tuple[str, str, str] | None = None

    @property
    def method(self) -> str:
        """How the surface was made, with its standard error."""
        surface = self.surface
        used = f"{count(surface.n_used)} of {count(surface.n_tried)} cases"
        if surface.exact:
            return f"exact, every grid node is a case ({used})"
        if surface.cases_per_node:
            return f"mean of {count(surface.cases_per_node)} cases at each grid node ({used})"
        assert surface.error is not None  # a smoothed surface always has one
        errors = [number(float(pick(surface.error)), 2) for pick in (np.nanmedian, np.nanmax)]
        if surface.n_smoothed < surface.n_used:
            used = f"{count(surface.n_smoothed)} cases picked evenly out of {used}"
        return (
            f"local quadratic regression on the {surface.neighbours} nearest of {used}; error {errors[0]} (median) to "
            f"{with_unit(errors[1], self.unit)} (largest)"
        )

    @property
    def alternative(self) -> str:
        surface = self.surface
        row, column = np.unravel_index(int(np.nanargmax(surface.value)), surface.value.shape)
        return (
            f"Filled contour map of {self.metric_label} over {self.x_label} from {number(surface.x[0], 3)} to "
            f"{number(surface.x[-1], 3)} and {self.y_label} from {number(surface.y[0], 3)} to "
            f"{number(surface.y[-1], 3)}. Lowest {number(float(np.nanmin(surface.value)), 4)}, highest "
            f"{number(float(np.nanmax(surface.value)), 4)} near ({number(surface.x[column], 3)}, "
            f"{number(surface.y[row], 3)})."
        )

    def levels(self) -> np.ndarray:
        """Round contour levels that cover the surface."""
        low, high = float(np.nanmin(self.surface.value)), float(np.nanmax(self.surface.value))
        if high - low <= 1e-9 * max(abs(low), abs(high)):
            half = max(abs(low), 1.0) * 1e-6
            return np.array([low - half, low + half])
        return np.array(covering(low, high, LEVELS))

    @property
    def plots(self) -> tuple[Plot, ...]:
        surface = self.surface
        texts = tuple(f"{self.metric_label}: {number(float(value))}" for value in self.point_values)
        marks: list[Field | Points] = [
            Field(surface.x, surface.y, surface.value, self.levels(), self.metric_label, f"surface: {self.method}")
        ]
        x, y = self.points.T
        shown = "all" if len(x) == self.n_points else f"{count(len(x))} of {count(self.n_points)}"
        key = f"cases, {shown} shown"
        marks.append(
            Points(x, y, DOT, size=3.5, edge="#ffffff", texts=texts, cases=self.case_ids, columns=self.columns, key=key)
        )
        if self.nominal:
            marks.append(nominal_ring(self.nominal, VERMILION, edge="#ffffff"))
        axes = (Axis(self.x_label, grid=False, margin=0.0), Axis(self.y_label, grid=False, margin=0.0))
        return (Plot(tuple(marks), *axes, height=500.0),)
