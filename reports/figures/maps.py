"""A metric over two inputs: filled contours with the flown cases and the nominal on them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from mc_engine.statistics import SurfaceMap
from reports.document import Drawing, Key
from reports.figures import paper, screen
from reports.figures.palette import FIELD, INK, VERMILION, field_scale
from reports.numbers import count, number, with_unit

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
            f"local quadratic regression on the {surface.neighbours} nearest of {used}, as many as foretell left-out "
            f"cases best; error, bias included, {errors[0]} (median) to {with_unit(errors[1], self.unit)} (largest)"
        )

    @property
    def key(self) -> tuple[Key, ...]:
        shown = "all" if len(self.points) == self.n_points else f"{count(len(self.points))} of {count(self.n_points)}"
        entries = [Key("field", "#7C7B78", f"surface: {self.method}"), Key("point", DOT, f"flown cases, {shown} shown")]
        return (*entries, Key("ring", VERMILION, "nominal")) if self.nominal else tuple(entries)

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
        return np.asarray(MaxNLocator(LEVELS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))

    def interactive(self) -> list[dict[str, Any]]:
        levels, surface = self.levels(), self.surface
        field = {
            "type": "contour",
            "x": screen.rounded(surface.x),
            "y": screen.rounded(surface.y),
            "z": screen.rounded(surface.value, 5),
            "colorscale": field_scale(),
            "zmin": float(levels[0]),
            "zmax": float(levels[-1]),
            "contours": {"start": float(levels[0]), "end": float(levels[-1]), "size": float(levels[1] - levels[0])},
            "line": {"width": 0.6, "color": "rgba(255,255,255,0.55)"},
            "colorbar": {"title": {"text": screen.plain(self.metric_label), "side": "right"}, "thickness": 14,
                         "outlinewidth": 0, "tickcolor": INK},
            "hovertemplate": "%{x:.3f}, %{y:.3f}: %{z:.4g}<extra>surface</extra>",
        }  # fmt: skip
        dots = {
            "type": "scatter",
            "mode": "markers",
            "x": screen.rounded(self.points[:, 0]),
            "y": screen.rounded(self.points[:, 1]),
            "meta": screen.CASES,
            "customdata": [
                [int(case), number(value)] for case, value in zip(self.case_ids, self.point_values, strict=True)
            ],
            "marker": {
                "size": 3.5,
                "color": DOT,
                "line": {"width": 0.4, "color": "rgba(255,255,255,0.7)"},
            },
            "hovertemplate": "case %{customdata[0]}: (%{x:.3f}, %{y:.3f}), %{customdata[1]}<extra></extra>",
        }
        data = [field, dots]
        if self.nominal:
            data.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "x": [self.nominal[0]],
                    "y": [self.nominal[1]],
                    "marker": {"size": 12, "color": "#ffffff", "line": {"width": 3, "color": VERMILION}},
                    "hovertemplate": "nominal (%{x:.3f}, %{y:.3f})<extra></extra>",
                }
            )
        x, y = (screen.axis(label, showgrid=False, zeroline=False) for label in (self.x_label, self.y_label))
        return [{"data": data, "layout": screen.layout(x, y, 520, hovermode="closest", dragmode="select")}]

    def printed(self) -> Figure:
        figure, (axis,) = paper.new_figure(4.3)
        surface, levels = self.surface, self.levels()
        value = np.ma.masked_invalid(surface.value)
        field = axis.contourf(surface.x, surface.y, value, levels, cmap=FIELD)
        lines = axis.contour(surface.x, surface.y, value, levels, colors="white", linewidths=0.4, alpha=0.6)
        axis.clabel(lines, levels[::2], fontsize=6, fmt=lambda level: number(level, 3))
        axis.scatter(self.points[:, 0], self.points[:, 1], s=4.5, color=DOT, edgecolors="white", linewidths=0.25)
        if self.nominal:
            axis.plot(*self.nominal, "o", markersize=6, markerfacecolor="white", color=VERMILION, markeredgewidth=1.6)
        axis.set(xlabel=paper.literal(self.x_label), ylabel=paper.literal(self.y_label))
        axis.grid(visible=False)
        bar = figure.colorbar(
            field, ax=axis, label=paper.literal(self.metric_label), pad=0.02, aspect=32, format=paper.PlainNumbers()
        )
        bar.ax.spines["outline"].set_visible(False)
        paper.add_key(figure, self.key, columns=1)
        return figure
