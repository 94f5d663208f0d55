"""Figures on the screen: panels of marks as specifications of plotly.js, plain data for a page's JSON.

The page's bundle of plotly.js has scatters and bars; a field is drawn as one filled region between every two levels.
"""

from base64 import b64encode
from collections.abc import Iterator
from functools import singledispatch
from html import escape
from typing import Any

import numpy as np

from reports.drawing.marks import Axis, Band, Bar, Drawing, Field, Limit, Line, Plot, Points
from reports.drawing.palette import GRID, INK, MUTED, PAPER
from reports.drawing.ticks import log_ticks
from reports.text.numbers import number

DIGITS = 6
MOST_DIGITS = 17  # of a float64
FEW = 24  # numbers that are written as such
NEAR = 100.0  # a float32 keeps enough digits of numbers up to so many times their spread
TITLE_LINE = 17  # pixels
WRAP = 32  # characters of a title
FRAME = 56  # pixels above and below the rows of a panel that has rows
BINS = "bins"  # the mark of bars that count cases
CASES = "cases"  # the mark of a cloud whose points are cases, with their numbers as its customdata


def rounded(values: Any, digits: int = DIGITS) -> list[Any]:
    """Numbers for JSON to `digits` significant digits, of their differences, too; None for what is not finite.

    Numbers that differ by little keep more digits: -2 ± 1e-5 must not become a single number.
    """
    array = np.asarray(values, dtype=np.float64)
    finite = array[np.isfinite(array)]
    span = float(finite.max()) - float(finite.min()) if finite.size else 0.0
    lost = np.log10(float(np.abs(finite).max()) / span) if 0.0 < span < np.inf else 0.0
    digits = min(digits + max(int(np.ceil(lost)), 0), MOST_DIGITS)
    return [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in array.tolist()]


def packed(values: Any) -> Any:
    """Many numbers as base64 of their bytes, which plotly.js reads; few of them as `rounded` does.

    A single number, such as that of a limit, keeps all digits: other marks may differ from it by little.
    """
    array = np.asarray(values, dtype=np.float64)
    if 0 < array.size <= FEW and np.isfinite(array[0]) and (array == array[0]).all():
        return array.tolist()
    if array.size <= FEW:
        return rounded(array)
    finite = array[np.isfinite(array)]
    spread = float(np.ptp(finite)) if finite.size else 0.0
    close = finite.size and float(np.abs(finite).max()) > NEAR * spread > 0.0
    return typed(array, "f8" if close else "f4")


def column(values: np.ndarray) -> dict[str, Any]:
    """Numbers of all cases for the page's scripts: four bytes each, from the smallest where they differ little."""
    finite = values[np.isfinite(values)]
    start = float(finite.min()) if finite.size and np.abs(finite).max() > NEAR * np.ptp(finite) else 0.0
    return {**typed(values - start, "f4"), **({"start": start} if start else {})}


def typed(values: np.ndarray, kind: str) -> dict[str, str]:
    """An array of numbers as plotly.js reads it."""
    with np.errstate(over="ignore"):
        data = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
    return {"dtype": kind, "bdata": b64encode(data).decode()}


def plain(text: str) -> str:
    """User text for plotly, which reads a small HTML of its own in every label."""
    return escape(text, quote=False)


def specifications(drawing: Drawing) -> list[dict[str, Any]]:
    """The "data" and "layout" of each panel; colours may be "@ink" and other page colours."""
    return [{"data": [trace for mark in plot.marks for trace in traced(mark, plot)], "layout": _layout(plot)}
            for plot in drawing.plots]  # fmt: skip


def history_panel(time: str) -> dict[str, Any]:
    """The layout of one quantity of a single case, still without its title."""
    layout = _layout(Plot((), Axis(time), Axis(most=5), "quantity", 240.0))
    for axis in ("xaxis", "yaxis"):
        del layout[axis]["range"]
    return layout


@singledispatch
def traced(mark: object, plot: Plot) -> Iterator[dict[str, Any]]:
    """The traces of plotly.js that draw the mark."""
    raise TypeError(f"{type(mark).__name__} is no mark that the screen draws")


@traced.register
def _points(mark: Points, plot: Plot) -> Iterator[dict[str, Any]]:
    ring = mark.sign == "ring"
    marker: dict[str, Any] = {"size": mark.size, "color": (mark.edge or "rgba(0,0,0,0)") if ring else mark.colour}
    marker |= {"opacity": mark.opacity} if mark.opacity < 1.0 else {}
    marker |= {"symbol": mark.sign} if mark.sign not in ("circle", "ring") else {}
    if ring:
        marker["line"] = {"width": 3, "color": mark.colour}
    elif mark.edge:
        marker["line"] = {"width": 0.6, "color": mark.edge}
    yield {
        "type": "scatter", "mode": "markers", "x": packed(mark.x), "y": packed(mark.y), "name": plain(mark.name),
        "marker": marker,
        **({} if mark.cases is None else {"meta": CASES, "customdata": mark.cases.tolist(), "columns": mark.columns}),
        **({"text": [plain(text) for text in mark.texts]} if len(mark.texts) else {}),
        **{f"error_{axis}": _intervals(mark, values, ends) for axis, values, ends in
           (("x", mark.x, mark.x_ends), ("y", mark.y, mark.y_ends)) if ends is not None},
        "hovertemplate": _pointed(plot, "case %{customdata}" * (mark.cases is not None), bool(len(mark.texts))),
    }  # fmt: skip


def _intervals(mark: Points, values: np.ndarray, ends: tuple[np.ndarray, np.ndarray]) -> dict[str, Any]:
    return {"type": "data", "symmetric": False, "array": rounded(np.fmax(ends[1] - values, 0.0)),
            "arrayminus": rounded(np.fmax(values - ends[0], 0.0)), "color": mark.colour, "thickness": 1.6,
            "width": 3}  # fmt: skip


def _pointed(plot: Plot, first: str = "", text: bool = False) -> str:
    """Template of the hover text: the names of both axes with their units, and the numbers."""
    lines = [plain(axis.name or axis.label) for axis in (plot.x, plot.y)]
    numbers = [f"{name + ': ' if name else ''}%{{{axis}:.5g}}" for name, axis in zip(lines, "xy", strict=True)]
    told = [*[first] * bool(first), *([] if text and not first else numbers), *["%{text}"] * text]
    return "<br>".join(told) + "<extra>%{fullData.name}</extra>"


@traced.register
def _line(mark: Line, plot: Plot) -> Iterator[dict[str, Any]]:
    shape = {"shape": mark.step} if mark.step else {}
    yield {
        "type": "scatter", "mode": "lines", "x": packed(mark.x), "y": packed(mark.y), "name": plain(mark.name),
        "line": {"color": mark.colour, "width": mark.width, "dash": mark.dash, **shape},
        **({"opacity": mark.opacity} if mark.opacity < 1.0 else {}),
        **({"text": plain(mark.text)} if mark.text else {}),
        "hovertemplate": "%{text}<extra></extra>" if mark.text else _pointed(plot),
    }  # fmt: skip


@traced.register
def _limit(mark: Limit, plot: Plot) -> Iterator[dict[str, Any]]:
    """A line between the ends of the other axis, with enough places for the pointer to find it."""
    x_ends, y_ends = plot.ends
    other = y_ends if mark.axis == "x" else x_ends
    log = (plot.y if mark.axis == "x" else plot.x).log
    along = np.geomspace(*other, 9) if log else np.linspace(*other, 9)
    at = np.full(along.size, mark.at)
    x, y = (at, along) if mark.axis == "x" else (along, at)
    yield from _line(Line(x, y, mark.colour, mark.name, mark.dash, mark.width, text=mark.name), plot)


@traced.register
def _band(mark: Band, plot: Plot) -> Iterator[dict[str, Any]]:
    yield {
        "type": "scatter", "mode": "lines", "x": packed(mark.x), "y": packed(mark.y), "fill": "toself",
        "fillcolor": _faint(mark.colour, mark.opacity),
        "line": {"width": 0.6 if mark.edge else 0, "color": mark.edge or mark.colour},
        **({"hoveron": "fills", "hoverinfo": "text", "text": plain(mark.name)} if mark.name else {"hoverinfo": "skip"}),
    }  # fmt: skip


@traced.register
def _bar(mark: Bar, plot: Plot) -> Iterator[dict[str, Any]]:
    yield {
        "type": "bar", "x": packed(0.5 * (mark.left + mark.right)), "y": packed(mark.top - mark.bottom),
        "base": packed(mark.bottom), "width": rounded(mark.right - mark.left),
        "marker": {"color": mark.colour, "opacity": mark.opacity, "line": {"width": 0}},
        **({"customdata": [plain(text) for text in mark.texts]} if len(mark.texts) else {}),
        **({"text": list(mark.labels), "textposition": "inside", "insidetextanchor": "middle", "textangle": 0,
            "constraintext": "none",
            "insidetextfont": {"color": mark.ink}} if len(mark.labels) else {"textposition": "none"}),
        **({"meta": BINS, "columns": [mark.column], "edges": rounded(np.append(mark.left, mark.right[-1:]), 12)}
           if mark.column else {}),
        "hovertemplate": "%{customdata}<extra></extra>" if len(mark.texts) else _pointed(plot),
    }  # fmt: skip


@traced.register
def _field(mark: Field, plot: Plot) -> Iterator[dict[str, Any]]:
    for band in mark.bands:
        yield from _band(band, plot)
    levels, n = mark.levels.tolist(), len(mark.colours)
    scale = [[end / n, colour] for k, colour in enumerate(mark.colours) for end in (k, k + 1)]
    yield {
        "type": "scatter", "mode": "markers", "x": [None], "y": [None], "hoverinfo": "skip",
        "marker": {"color": [levels[0]], "cmin": levels[0], "cmax": levels[-1], "colorscale": scale, "showscale": True,
                   "colorbar": {"title": {"text": plain(mark.label), "side": "right"}, "thickness": 14,
                                "outlinewidth": 0, "tickcolor": INK}},
    }  # fmt: skip


def _faint(colour: str, opacity: float) -> str:
    """The colour with an opacity, as CSS; page colours (with an @) are left to the page."""
    if opacity >= 1.0 or not colour.startswith("#"):
        return colour
    return f"rgba({','.join(str(int(colour[k : k + 2], 16)) for k in (1, 3, 5))},{opacity:g})"


def _axis(axis: Axis, ends: tuple[float, float], **own_keys: Any) -> dict[str, Any]:
    """The layout of one axis, in the colours of the page."""
    own = axis.ticks
    if own is None and axis.log:
        found = log_ticks(min(ends), max(ends))
        own = tuple((tick, number(tick, 3)) for tick in found) if len(found) > 1 else None
    return {
        "title": {"text": plain(axis.label), "standoff": 8, "font": {"size": 13}},
        "automargin": True, "gridcolor": GRID, "linecolor": MUTED, "tickcolor": MUTED, "zeroline": False,
        "ticks": "outside", "ticklen": 4, "showline": True, "exponentformat": "power", "minexponent": 5,
        "nticks": axis.most + 1,
        "range": [float(np.log10(end)) for end in ends] if axis.log else list(ends),
        **({"type": "log"} if axis.log else {"type": "linear"}),
        **({"showgrid": False} if not axis.grid else {}),
        **({} if own is None else {"tickvals": [at for at, _ in own], "ticktext": [plain(text) for _, text in own]}),
        **({"tickformat": ",d"} if axis.whole and own is None else {}),
        **own_keys,
    }  # fmt: skip


def _layout(plot: Plot) -> dict[str, Any]:
    x_ends, y_ends = plot.ends
    cases = any(getattr(mark, "cases", None) is not None or getattr(mark, "column", "") for mark in plot.marks)
    equal = {"scaleanchor": "x", "scaleratio": 1} if plot.equal else {}
    title = _title(plot.title)
    lines = title["text"].count("<br>") if title else -1
    return {
        "height": round(plot.height + TITLE_LINE * max(lines, 0) + (FRAME if plot.y.ticks else 0)),
        "margin": {"l": 50, "r": 14, "t": TITLE_LINE * (lines + 1) + 17 if title else 12, "b": 44, "pad": 0},
        "font": {"family": "inherit", "size": 12, "color": INK},
        "paper_bgcolor": "rgba(0,0,0,0)", "plot_bgcolor": "rgba(0,0,0,0)",
        "hoverlabel": {"bgcolor": PAPER, "bordercolor": MUTED, "font": {"color": INK}, "namelength": -1},
        "showlegend": False, "separators": ".\u202f", "hovermode": "closest", "bargap": 0, "barmode": "overlay",
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": MUTED, "activecolor": INK},
        "dragmode": "select" if cases else "zoom",
        "xaxis": _axis(plot.x, x_ends), "yaxis": _axis(plot.y, y_ends, **equal),
        **({"title": title} if title else {}),
    }  # fmt: skip


def _title(text: str) -> dict[str, Any]:
    """A title above the axes, aligned left, wrapped to as many lines as needed."""
    from textwrap import wrap

    lines = [line for part in text.split("\n") for line in wrap(part, WRAP)]
    if not lines:
        return {}
    return {
        "text": "<br>".join(map(plain, lines)), "font": {"size": 12.5},
        "x": 0.0, "xref": "paper", "xanchor": "left", "y": 1.0, "yref": "paper", "yanchor": "bottom",
        "pad": {"b": 7 + TITLE_LINE * (len(lines) - 1)},  # of its first line: further ones hang below it
    }  # fmt: skip
