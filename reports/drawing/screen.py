"""Figures on the screen: panels of marks as specifications of plotly.js, plain data for a page's JSON.

The page's bundle of plotly.js has scatters and bars; a field is drawn as one filled region between every two levels.
"""

from base64 import b64encode
from functools import singledispatch
from html import escape
from math import floor, isfinite
from textwrap import wrap
from typing import Any

import numpy as np

from reports.drawing.marks import Axis, Band, Bar, Drawing, Field, Line, Plot, Points
from reports.drawing.palette import GRID, INK, MUTED, PAPER
from reports.drawing.ticks import MOST_TICKS, axis_ticks, numerals
from reports.text.numbers import number

FEW = 24  # numbers that are written as such
DIFFERENCE = 1e-5  # of the spread of some numbers: how far off each may be
TITLE_LINE = 17  # pixels
ABOVE, ROUND_TITLE = 12, 6  # pixels above the axes; more of them where there is a title, besides its lines
PAD, CAPITAL = 7, 9  # pixels above a title; more of them above two lines, where plotly forgets the first one's height
WRAP = 28  # characters of a line of a title, and of the label below a panel
UPRIGHT = 9  # pixels of height for a character of the label beside a panel
NAME, LETTER = 36, 7  # characters of a line of a name along an axis; pixels of one
SIDE_BY_SIDE = 600  # pixels of all names below a panel that stand level
LONG = 8  # characters of a tick label; of longer ones there are few, or they turn and take the room of the panel
FRAME = 56  # pixels above and below the rows of a panel that has rows
SERIES = "<extra>%{fullData.name}</extra>"  # of a hover text: the name of the mark beside it
POWERS = {"exponentformat": "power", "minexponent": 5}  # of tick labels: 3×10⁹ and not plotly's 3B
BINS = "bins"  # the mark of bars that count cases
CASES = "cases"  # the mark of a cloud whose points are cases, with their numbers as its customdata


def packed(values: Any) -> Any:
    """Many numbers as base64 of their bytes, which plotly.js reads; few as a list, with None for what is not finite."""
    array = np.asarray(values, dtype=np.float64)
    if array.size <= FEW:
        return [value if isfinite(value) else None for value in array.tolist()]
    return typed(array, _kind(array))


def column(values: np.ndarray) -> dict[str, Any]:
    """Numbers of all cases for the page's scripts: four bytes each where these hold them, if need be from a start."""
    finite = values[np.isfinite(values)]
    near = finite.size and np.ptp(0.5 * finite) < 0.5 * abs(finite.min())  # halves: no overflow
    start = float(finite.min()) if near and _kind(values) == "f8" else 0.0
    return {**typed(values - start, _kind(values - start)), "start": start}


def _kind(values: np.ndarray) -> str:
    """Four bytes a number where these tell apart what differs, or eight."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return "f4"
    with np.errstate(over="ignore"):
        error = np.abs(finite - finite.astype(np.float32))
    return "f4" if (error <= DIFFERENCE * np.ptp(0.5 * finite)).all() else "f8"


def typed(values: np.ndarray, kind: str) -> dict[str, str]:
    """An array of numbers as plotly.js reads it."""
    return {"dtype": kind, "bdata": b64encode(np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()).decode()}


def plain(text: str) -> str:
    """User text for plotly, which reads a small HTML of its own in every label."""
    return escape(text, quote=False)


def specifications(drawing: Drawing) -> list[dict[str, Any]]:
    """The "data" and "layout" of each panel; colours may be "@ink" and other page colours."""
    return [{"data": [*(traced(stroke, plot) for stroke in plot.strokes), *map(_colour_scale, plot.fields)],
             "layout": _layout(plot)} for plot in drawing.plots]  # fmt: skip


def history_panel(time: str) -> dict[str, Any]:
    """The layout of one quantity of a single case, still without its title."""
    layout = _layout(Plot((), Axis(time), Axis(), "quantity", 240.0))
    for axis in ("xaxis", "yaxis"):
        del layout[axis]["range"]
    return layout


@singledispatch
def traced(stroke: object, plot: Plot) -> dict[str, Any]:
    """The trace of plotly.js that draws it."""
    raise TypeError(f"{type(stroke).__name__} is no mark that the screen draws")


@traced.register
def _points(mark: Points, plot: Plot) -> dict[str, Any]:
    edge = {"line": {"width": mark.edge_width, "color": mark.edge}} if mark.edge else {}
    cases = {} if mark.cases is None else {"meta": CASES, "customdata": mark.cases.tolist(), "columns": mark.columns}
    texts = {"text": [plain(text) for text in mark.texts]} if mark.texts else {}
    numbers = "" if texts and not cases else _numbers(plot)
    told = "case %{customdata}" * bool(cases), numbers, "%{text}" * bool(texts)
    return {
        "type": "scatter", "mode": "markers", "x": packed(mark.x), "y": packed(mark.y), "name": plain(mark.name),
        "marker": {"size": mark.size, "color": mark.colour, "opacity": mark.opacity, "symbol": mark.sign, **edge},
        "hovertemplate": "<br>".join(filter(None, told)) + SERIES, **cases, **texts,
    }  # fmt: skip


def _numbers(plot: Plot) -> str:
    """Template of a hover text: the names of both axes with their units, and the numbers."""
    lines = zip(map(plain, plot.names), ("%{x:.5g}", "%{y:.5g}"), strict=True)
    return "<br>".join(f"{name}: {value}" if name else value for name, value in lines)


@traced.register
def _line(mark: Line, plot: Plot) -> dict[str, Any]:
    return {
        "type": "scatter", "mode": "lines", "x": packed(mark.x), "y": packed(mark.y), "name": plain(mark.name),
        "line": {"color": mark.colour, "width": mark.width, "dash": mark.dash}, "opacity": mark.opacity,
        "text": plain(mark.text), "hovertemplate": "%{text}<extra></extra>" if mark.text else _numbers(plot) + SERIES,
    }  # fmt: skip


@traced.register
def _band(mark: Band, plot: Plot) -> dict[str, Any]:
    return {
        "type": "scatter", "mode": "lines", "x": packed(mark.x), "y": packed(mark.y), "fill": "toself",
        "fillcolor": f"{mark.colour}{round(255 * mark.opacity):02x}",
        "line": {"width": 0.6 if mark.edge else 0, "color": mark.edge or mark.colour},
        **({"hoveron": "fills", "hoverinfo": "text", "text": plain(mark.name)} if mark.name else {"hoverinfo": "skip"}),
    }  # fmt: skip


@traced.register
def _bar(mark: Bar, plot: Plot) -> dict[str, Any]:
    edges = {"meta": BINS, "columns": [mark.column], "edges": np.append(mark.left, mark.right[-1:]).tolist()}
    return {
        "type": "bar", "x": packed(0.5 * (mark.left + mark.right)), "y": packed(mark.top - mark.bottom),
        "base": packed(mark.bottom), "width": packed(mark.right - mark.left),
        "marker": {"color": mark.colour, "opacity": mark.opacity, "line": {"width": 0}},
        "customdata": [plain(text) for text in mark.texts], "text": list(mark.labels),
        "textposition": "inside", "insidetextanchor": "middle", "textangle": 0, "insidetextfont": {"color": mark.ink},
        "hovertemplate": ("%{customdata}" if len(mark.texts) else _numbers(plot)) + "<extra></extra>",
        **(edges if mark.column else {}),
    }  # fmt: skip


def _colour_scale(field: Field) -> dict[str, Any]:
    """A trace with the colours of a field beside the panel, and no point."""
    levels, n = field.levels.tolist(), len(field.colour)
    scale = [[end / n, colour] for k, colour in enumerate(field.colour) for end in (k, k + 1)]
    bar = {"title": {"text": plain(field.label), "side": "right"}, "thickness": 14, "outlinewidth": 0, "tickcolor": INK,
           **POWERS}  # fmt: skip
    return {
        "type": "scatter", "mode": "markers", "x": [None], "y": [None], "hoverinfo": "skip",
        "marker": {"color": [levels[0]], "cmin": levels[0], "cmax": levels[-1], "colorscale": scale, "showscale": True,
                   "colorbar": bar},
    }  # fmt: skip


def _lines(text: str, characters: int) -> str:
    """The text in lines of at most so many characters, where its words allow that."""
    lines = (line for part in text.split("\n") for line in wrap(part, characters, break_long_words=False))
    return "<br>".join(map(plain, lines))


def _room_below(axis: Axis) -> int:
    """Pixels that names below a panel take where they stand upright: without them plotly takes those of its rows."""
    longest = max((len(line) for _, text in axis.ticks or () for line in wrap(text, NAME)), default=0)
    return LETTER * longest if LETTER * longest * len(axis.ticks or ()) > SIDE_BY_SIDE else 0


def _axis(axis: Axis, ends: tuple[float, float], characters: int) -> dict[str, Any]:
    """The layout of one axis, in the colours of the page; characters : of a line of its label."""
    own, places = axis.ticks, axis_ticks(*ends, MOST_TICKS, log=axis.log)
    texts, power = numerals(places, axis.log)
    most = 4 if max(map(len, texts), default=0) >= LONG else 0  # ticks; 0: as many as have room
    if axis.whole:  # so few that plotly has no step below 1
        most = min(floor(abs(ends[1] - ends[0])) + 1, most or MOST_TICKS)
    if own is None and axis.log:
        own = tuple(zip(places, map(number, places) if power else texts, strict=True))
    return {
        "title": {"text": _lines(axis.label, characters), "standoff": 8, "font": {"size": 13}},
        "automargin": True, "gridcolor": GRID, "linecolor": MUTED, "tickcolor": MUTED, "zeroline": False,
        "ticks": "outside", "ticklen": 4, "showline": True, **POWERS,
        "nticks": most,
        "autotickangles": [0, -90] if axis.ticks else [0, 30, -90],  # names stand upright, as many as can be
        "range": [float(np.log10(end)) for end in ends] if axis.log else list(ends),
        "type": "log" if axis.log else "linear",
        **({"tickformat": ",.3~f"} if axis.whole else {}),  # after zooming in 0.5 is 0.5, not 1
        **({} if own is None else {"tickvals": [at for at, _ in own],
                                   "ticktext": [_lines(text, NAME) for _, text in own]}),
    }  # fmt: skip


def _layout(plot: Plot) -> dict[str, Any]:
    """The layout of a panel."""
    x_ends, y_ends = plot.ends
    cases = any(getattr(mark, "cases", None) is not None or getattr(mark, "column", "") for mark in plot.marks)
    title = _lines(plot.title, WRAP)
    lines = title.count("<br>") + 1 if title else 0
    top = ABOVE + (ROUND_TITLE + TITLE_LINE * lines if lines else 0)  # plotly's own room puts two lines out of sight
    return {
        "title": {"text": title, "font": {"size": 12.5}, "x": 0.0, "xref": "container", "y": 1.0,
                  "yref": "container", "yanchor": "top", "pad": {"t": PAD + (CAPITAL if lines > 1 else 0)}},
        "height": round(plot.height + TITLE_LINE * max(lines - 1, 0) + (FRAME if plot.y.ticks else 0)
                        + _room_below(plot.x)),
        "margin": {"l": 50, "r": 14, "t": top, "b": 44, "pad": 0},
        "font": {"family": "inherit", "size": 12, "color": INK},
        "paper_bgcolor": "rgba(0,0,0,0)", "plot_bgcolor": "rgba(0,0,0,0)",
        "hoverlabel": {"bgcolor": PAPER, "bordercolor": MUTED, "font": {"color": INK}, "namelength": -1},
        "showlegend": False, "separators": ".\u202f", "hovermode": "closest", "bargap": 0, "barmode": "overlay",
        "uniformtext": {"mode": "show", "minsize": 5},
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": MUTED, "activecolor": INK},
        "dragmode": "select" if cases else "zoom",
        "xaxis": _axis(plot.x, x_ends, WRAP),
        "yaxis": _axis(plot.y, y_ends, round(plot.height) // UPRIGHT) | ({"scaleanchor": "x"} if plot.equal else {}),
    }  # fmt: skip
