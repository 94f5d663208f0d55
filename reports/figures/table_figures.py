"""Figures from a table of cases: from a DataFrame to a `Picture`, which a notebook shows and `savefig` writes.

    from reports.figures.table_figures import fuel_map, histogram, scatter

    cases = mc_engine.open_run("runs/deorbit").cases
    histogram(cases, "propellant_kg").savefig("propellant.png")

The figures are those of the reports, in the same style.  A table from `open_run` has units; for any other table the
axes show only the names of columns.  If there is a column `status`, cases that are not ok have no metrics.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from mc_engine.errors import EngineError
from mc_engine.statistics import map_metric, summarize
from mc_engine.statistics.picked_cases import picked_rows
from mc_engine.status import OK, STATUS_NAME
from reports.drawing import paper
from reports.drawing.marks import Axis, Drawing, Points
from reports.drawing.pictures import render_picture
from reports.figures import distributions
from reports.figures.clouds import case_scatter
from reports.figures.maps import metric_map
from reports.text.numbers import axis_label, count, same_lengths, words

OUTER = (0.00135, 0.99865)  # quantiles drawn beside the median
POINTS_ON_MAP = 2000


@dataclass(frozen=True)
class Picture:
    """A figure in the style of the reports.  svg : the figure, as wide as a page."""

    drawing: Drawing

    @property
    def svg(self) -> str:
        return paper.svg(self.drawing)

    def _repr_svg_(self) -> str:
        return self.svg

    def savefig(self, file: str | Path) -> None:
        """Write it as SVG, PDF or PNG, by the ending of the file name; EngineError for another ending."""
        kind = Path(file).suffix.removeprefix(".").lower()
        if kind == "svg":
            Path(file).write_bytes(self.svg.encode())
        elif kind in ("pdf", "png"):
            Path(file).write_bytes(render_picture(self.svg, kind))
        else:
            raise EngineError(f"{file}: a figure is written as .svg, .pdf or .png")


def histogram(table: pd.DataFrame, column: str) -> Picture:
    """Histogram of a column, with its median and outer quantiles.

    EngineError if there is no such column of numbers, or fewer than two cases have one.
    """
    values = _numbers(table, column)
    finite = values[np.isfinite(values)]
    _refuse_few(finite.size, 2, column)
    used = f"{count(finite.size)} of {count(values.size)} cases"
    plot = distributions.histogram(finite, _label(table, column), summarize(values), OUTER, title=used)
    return Picture(distributions.histograms([plot]))


def scatter(table: pd.DataFrame, x: str, y: str) -> Picture:
    """One column against another, one point per case.  EngineError as for `histogram`."""
    a, b = _numbers(table, x), _numbers(table, y)
    used = np.flatnonzero(np.isfinite(a) & np.isfinite(b))
    _refuse_few(used.size, 1, f"{x} and {y}")
    cloud = Points(a[used], b[used], "", cases=_case_ids(table)[used])
    classes = [("cases with both numbers", int(used.size))]
    axes, lengths = (Axis(_label(table, x)), Axis(_label(table, y))), same_lengths(_unit(table, x), _unit(table, y))
    member = np.zeros(used.size, dtype=np.int8)
    return Picture(case_scatter(cloud, member, classes, axes, len(table), lengths=lengths))


def fuel_map(table: pd.DataFrame, x: str, y: str, metric: str) -> Picture:
    """Filled contours of any metric over two columns: exact on a grid, smoothed from scattered cases.

    Blank where the cases do not support a surface; see `mc_engine.statistics.map_metric`.  EngineError where the cases
    are too few, or lie on a line.
    """
    a, b, c = (_numbers(table, name) for name in (x, y, metric))
    surface = map_metric(a, b, c)
    if surface is None or not np.isfinite(surface.value).any():
        raise EngineError(f"{metric}: too few cases over {x} and {y} for a map; draw a scatter instead")
    used = np.flatnonzero(np.isfinite(a) & np.isfinite(b) & np.isfinite(c))
    shown = used[picked_rows(used.size, POINTS_ON_MAP)]
    labels = _label(table, x), _label(table, y), _label(table, metric)
    points, unit = np.column_stack([a[shown], b[shown]]), _unit(table, metric)
    return Picture(
        metric_map(surface, points, c[shown], _case_ids(table)[shown], labels, unit, n_points=int(used.size))
    )


def _numbers(table: pd.DataFrame, column: str) -> np.ndarray:
    """float64[n]: the column, NaN where a case has no number."""
    if column not in table:
        raise EngineError(f'the table has no column "{column}"; it has {", ".join(map(str, table.columns))}')
    values = pd.to_numeric(table[column], errors="coerce").to_numpy(dtype=np.float64)
    role = table.attrs.get("roles", {}).get(column, "metric")
    if "status" not in table or role == "dispersion":
        return values
    return np.where(table["status"].to_numpy() == STATUS_NAME[OK], values, np.nan)


def _refuse_few(n_used: int, needed: int, what: str) -> None:
    if n_used < needed:
        raise EngineError(f"{what}: {n_used} cases have a number; the figure needs {needed}")


def _unit(table: pd.DataFrame, column: str) -> str:
    return str(table.attrs.get("units", {}).get(column, ""))


def _label(table: pd.DataFrame, column: str) -> str:
    return axis_label(words(column, _unit(table, column)), _unit(table, column))


def _case_ids(table: pd.DataFrame) -> np.ndarray:
    return (table["case_id"] if "case_id" in table else table.index).to_numpy()
