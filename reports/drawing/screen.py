"""Figures on the screen: panels of marks as specifications of plotly.js, plain data for a page's JSON.

The page's bundle of plotly.js has scatters and bars; a field is drawn as one filled region between every two levels.
"""

from base64 import b64encode
from collections.abc import Iterator
from functools import singledispatch
from html import escape
from math import isfinite
from textwrap import wrap
from typing import Any

import numpy as np

from reports.drawing.marks import Axis, Band, Bar, Drawing, Field, Limit, Line, Plot, Points
from reports.drawing.palette import GRID, INK, MUTED, PAPER
from reports.drawing.ticks import axis_ticks, numerals
from reports.text.numbers import number

FEW = 24  # numbers that are written as such
FLOATS = (1e-30, 1e30)  # largest of some numbers that float32 holds with room to spare
NEAR = 100.0  # a float32 keeps enough digits of numbers up to so many times their spread
TITLE_LINE = 17  # pixels
ABOVE, ROUND_TITLE = 12, 6  # pixels above the axes; more of them where there is a title, besides its lines
PAD, CAPITAL = 7, 9  # pixels above a title; more of them above two lines, where plotly forgets the first one's height
WRAP = 28  # characters of a title
ACROSS, ALONE = 32, 64  # characters of a line of the label below a panel of several, and below a single one
UPRIGHT = 9  # pixels of height for a character of the label beside a panel
LONG = 8  # characters of a tick label; of longer ones there are few, or they turn and take the room of the panel
FRAME = 56  # pixels above and below the rows of a panel that has rows
BINS = "bins"  # the mark of bars that count cases
CASES = "cases"  # the mark of a cloud whose points are cases, with their numbers as its customdata


def packed(values: Any) -> Any:
    """Many numbers as base64 of their bytes, which plotly.js reads; few as a list, with None for what is not finite."""
    array = np.asarray(values, dtype=np.float64)
    if array.size <= FEW:
        return [value if isfinite(value) else None for value in array.tolist()]
    return typed(array, "f8" if _alike(array) else _kind(array))


def column(values: np.ndarray) -> dict[str, Any]:
    """Numbers of all cases for the page's scripts: four bytes each where these hold them, from the smallest where they
    differ little."""
    start = float(values[np.isfinite(values)].min()) if _alike(values) else 0.0
    return {**typed(values - start, _kind(values - start)), **({"start": start} if start else {})}


def _kind(values: np.ndarray) -> str:
    """Four bytes a number, or eight where a float32 does not hold the largest."""
    size = float(np.abs(values[np.isfinite(values)]).max(initial=0.0))
    return "f8" if size and not FLOATS[0] <= size <= FLOATS[1] else "f4"


def _alike(values: np.ndarray) -> bool:
    """Whether a float32 keeps too few digits of the differences between these numbers."""
    finite = values[np.isfinite(values)]
    return bool(finite.size and 0.5 * np.abs(finite).max() / NEAR > np.ptp(0.5 * finite))  # halves: no overflow


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
    characters = ALONE if len(drawing.plots) == 1 else ACROSS
    return [{"data": [trace for mark in plot.marks for trace in traced(mark, plot)],
             "layout": _layout(plot, characters)} for plot in drawing.plots]  # fmt: skip


def history_panel(time: str) -> dict[str, Any]:
    """The layout of one quantity of a single case, still without its title."""
    layout = _layout(Plot((), Axis(time), Axis(most=5), "quantity", 240.0), ACROSS)
    for axis in ("xaxis", "yaxis"):
        del layout[axis]["range"]
    return layout


@singledispatch
def traced(mark: object, plot: Plot) -> Iterator[dict[str, Any]]:
    """The traces of plotly.js that draw the mark."""
    raise TypeError(f"{type(mark).__name__} is no mark that the screen draws")


@traced.register
def _points(mark: Points, plot: Plot) -> Iterator[dict[str, Any]]:
    edge = {"line": {"width": mark.edge_width, "color": mark.edge}} if mark.edge else {}
    texts = [plain(text) for text in mark.texts]
    cases = {} if mark.cases is None else {"meta": CASES, "customdata": mark.cases.tolist(), "columns": mark.columns}
    yield {
        "type": "scatter", "mode": "markers", "x": packed(mark.x), "y": packed(mark.y), "name": plain(mark.name),
        "marker": {"size": mark.size, "color": mark.colour, "opacity": mark.opacity, "symbol": mark.sign, **edge},
        **cases, **({"text": texts} if texts else {}),
        "hovertemplate": _pointed(plot, "case %{customdata}" * bool(cases), bool(texts)),
    }  # fmt: skip


def _pointed(plot: Plot, first: str = "", text: bool = False) -> str:
    """Template of the hover text: the names of both axes with their units, and the numbers."""
    lines = [plain(axis.name or axis.label) for axis in (plot.x, plot.y)]
    numbers = [f"{name + ': ' if name else ''}%{{{axis}:.5g}}" for name, axis in zip(lines, "xy", strict=True)]
    told = [*[first] * bool(first), *([] if text and not first else numbers), *["%{text}"] * text]
    return "<br>".join(told) + "<extra>%{fullData.name}</extra>"


@traced.register
def _line(mark: Line, plot: Plot) -> Iterator[dict[str, Any]]:
    yield {
        "type": "scatter", "mode": "lines", "x": packed(mark.x), "y": packed(mark.y), "name": plain(mark.name),
        "line": {"color": mark.colour, "width": mark.width, "dash": mark.dash},
        "opacity": mark.opacity, "text": plain(mark.text),
        "hovertemplate": "%{text}<extra></extra>" if mark.text else _pointed(plot),
    }  # fmt: skip


@traced.register
def _limit(mark: Limit, plot: Plot) -> Iterator[dict[str, Any]]:
    yield from _line(mark.across(*plot.ends, (plot.y if mark.axis == "x" else plot.x).log), plot)


@traced.register
def _band(mark: Band, plot: Plot) -> Iterator[dict[str, Any]]:
    yield {
        "type": "scatter", "mode": "lines", "x": packed(mark.x), "y": packed(mark.y), "fill": "toself",
        "fillcolor": f"{mark.colour}{round(255 * mark.opacity):02x}",
        "line": {"width": 0.6 if mark.edge else 0, "color": mark.edge or mark.colour},
        **({"hoveron": "fills", "hoverinfo": "text", "text": plain(mark.name)} if mark.name else {"hoverinfo": "skip"}),
    }  # fmt: skip


@traced.register
def _bar(mark: Bar, plot: Plot) -> Iterator[dict[str, Any]]:
    yield {
        "type": "bar", "x": packed(0.5 * (mark.left + mark.right)), "y": packed(mark.top - mark.bottom),
        "base": packed(mark.bottom), "width": packed(mark.right - mark.left),
        "marker": {"color": mark.colour, "opacity": mark.opacity, "line": {"width": 0}},
        "customdata": [plain(text) for text in mark.texts], "text": list(mark.labels),
        "textposition": "inside", "insidetextanchor": "middle", "textangle": 0, "insidetextfont": {"color": mark.ink},
        **({"meta": BINS, "columns": [mark.column], "edges": np.append(mark.left, mark.right[-1:]).tolist()}
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


def _lines(text: str, characters: int) -> str:
    """The text in lines of at most so many characters, where its words allow that."""
    lines = (line for part in text.split("\n") for line in wrap(part, characters, break_long_words=False))
    return "<br>".join(map(plain, lines))


def _axis(axis: Axis, ends: tuple[float, float], characters: int, **own_keys: Any) -> dict[str, Any]:
    """The layout of one axis, in the colours of the page; characters : of a line of its label."""
    own = axis.ticks
    if own is None and axis.log:
        found = axis_ticks(*ends, axis.most, log=True)
        texts, power = numerals(found, True)
        own = tuple(zip(found, map(number, found) if power else texts, strict=True))
    longest = max(map(len, numerals(axis_ticks(*ends, axis.most))[0]), default=0)
    return {
        "title": {"text": _lines(axis.label, characters), "standoff": 8, "font": {"size": 13}},
        "automargin": True, "gridcolor": GRID, "linecolor": MUTED, "tickcolor": MUTED, "zeroline": False,
        "ticks": "outside", "ticklen": 4, "showline": True, "exponentformat": "power", "minexponent": 5,
        "nticks": axis.most + 1 if longest < LONG else 4,
        "autotickangles": [0, *[30] * (axis.ticks is None), -90],  # names stand upright, as many as can be
        "range": [float(np.log10(end)) for end in ends] if axis.log else list(ends),
        "type": "log" if axis.log else "linear", "showgrid": axis.grid,
        **({} if own is None else {"tickvals": [at for at, _ in own], "ticktext": [plain(text) for _, text in own]}),
        **({"tickformat": ",d"} if axis.whole and own is None else {}),
        **own_keys,
    }  # fmt: skip


def _layout(plot: Plot, characters: int) -> dict[str, Any]:
    """The layout of a panel; characters : of a line of the label below it."""
    x_ends, y_ends = plot.ends
    cases = any(getattr(mark, "cases", None) is not None or getattr(mark, "column", "") for mark in plot.marks)
    equal = {"scaleanchor": "x", "scaleratio": 1} if plot.equal else {}
    title = _lines(plot.title, WRAP)
    lines = title.count("<br>") + 1 if title else 0
    top = ABOVE + (ROUND_TITLE + TITLE_LINE * lines if lines else 0)  # plotly's own room puts two lines out of sight
    return {
        "title": {"text": title, "font": {"size": 12.5}, "x": 0.0, "xref": "paper", "y": 1.0,
                  "yref": "container", "yanchor": "top", "pad": {"t": PAD + (CAPITAL if lines > 1 else 0)}},
        "height": round(plot.height + TITLE_LINE * max(lines - 1, 0) + (FRAME if plot.y.ticks else 0)),
        "margin": {"l": 50, "r": 14, "t": top, "b": 44, "pad": 0},
        "font": {"family": "inherit", "size": 12, "color": INK},
        "paper_bgcolor": "rgba(0,0,0,0)", "plot_bgcolor": "rgba(0,0,0,0)",
        "hoverlabel": {"bgcolor": PAPER, "bordercolor": MUTED, "font": {"color": INK}, "namelength": -1},
        "showlegend": False, "separators": ".\u202f", "hovermode": "closest", "bargap": 0, "barmode": "overlay",
        "uniformtext": {"mode": "show", "minsize": 5},
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": MUTED, "activecolor": INK},
        "dragmode": "select" if cases else "zoom",
        "xaxis": _axis(plot.x, x_ends, characters),
        "yaxis": _axis(plot.y, y_ends, round(plot.height) // UPRIGHT, **equal),
    }  # fmt: skip
