"""Plotly specifications as plain data: the axes, margins and text that all figures share."""

from html import escape
from typing import Any

import numpy as np

from reports.figures.palette import GRID, INK, MUTED, PAPER

DIGITS = 6
MOST_DIGITS = 17  # of a float64
TITLE_LINE = 17  # pixels
CASES = "cases"  # the mark of a cloud whose points are cases, with their numbers as its customdata


def rounded(values: Any, digits: int = DIGITS) -> list[Any]:
    """Numbers for JSON to `digits` significant digits, of their differences, too; None for what is not finite.

    Any shape.  Numbers that differ by little keep more digits: -2 ± 1e-5 must not become a single number.
    """
    array = np.asarray(values, dtype=np.float64)
    finite = array[np.isfinite(array)]
    span = float(finite.max()) - float(finite.min()) if finite.size else 0.0
    lost = np.log10(float(np.abs(finite).max()) / span) if 0.0 < span < np.inf else 0.0
    return _to_digits(array, min(digits + max(int(np.ceil(lost)), 0), MOST_DIGITS))


def _to_digits(array: np.ndarray, digits: int) -> list[Any]:
    if array.ndim > 1:
        return [_to_digits(row, digits) for row in array]
    return [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in array.tolist()]


def plain(text: str) -> str:
    """User text for plotly, which reads a small HTML of its own in every label."""
    return escape(text, quote=False)


def axis(title: str, **more: Any) -> dict[str, Any]:
    """An axis: grid in the page's grid colour, line and ticks in its muted one."""
    return {
        "title": {"text": plain(title), "standoff": 8, "font": {"size": 13}},
        "automargin": True,
        "gridcolor": GRID,
        "linecolor": MUTED,
        "tickcolor": MUTED,
        "zerolinecolor": GRID,
        "ticks": "outside",
        "ticklen": 4,
        "showline": True,
        "exponentformat": "power",
        "minexponent": 5,
        **more,
    }


def outline(line: np.ndarray, colour: str, dash: str, text: str) -> dict[str, Any]:
    """The edge of a region, float64[n, 2] with NaN between its pieces; `text` shows under the pointer."""
    return {
        "type": "scatter",
        "mode": "lines",
        "x": rounded(line[:, 0]),
        "y": rounded(line[:, 1]),
        "line": {"color": colour, "dash": dash, "width": 1.8},
        "text": plain(text),
        "hovertemplate": "%{text}<extra></extra>",
    }


def ring(place: tuple[float, float], colour: str, words: str) -> dict[str, Any]:
    """A ring about one place that leaves what lies under it to be seen."""
    return {
        "type": "scatter",
        "mode": "markers",
        "x": [place[0]],
        "y": [place[1]],
        "marker": {"size": 12, "color": "rgba(0,0,0,0)", "line": {"width": 3, "color": colour}},
        "text": plain(words),
        "hovertemplate": "%{text} (%{x:.6g}, %{y:.6g})<extra></extra>",
    }


def layout(x: dict[str, Any], y: dict[str, Any], height: int, title: str = "", **more: Any) -> dict[str, Any]:
    """A panel's layout; a title stands left above the axes, in one line or more."""
    more_lines = title.count("\n")
    heading = {
        "text": plain(title).replace("\n", "<br>"),
        "font": {"size": 12.5},
        **{"x": 0.0, "xref": "paper", "xanchor": "left"},
        **{"y": 1.0, "yref": "paper", "yanchor": "bottom"},
        "pad": {"b": 7 + TITLE_LINE * more_lines},  # of its first line: further ones hang below it
    }
    top = TITLE_LINE * (more_lines + 1) + 17 if title else 12
    return {
        "height": height,
        "margin": {"l": 50, "r": 14, "t": top, "b": 44, "pad": 0},
        "font": {"family": "inherit", "size": 12, "color": INK},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "hoverlabel": {"bgcolor": PAPER, "bordercolor": MUTED, "font": {"color": INK}},
        "showlegend": False,
        "separators": ".\u202f",
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": MUTED, "activecolor": INK},
        "dragmode": "zoom",
        "xaxis": x,
        "yaxis": y,
        **({"title": heading} if title else {}),
        **more,
    }
