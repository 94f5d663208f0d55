"""Plotly specifications as plain data: the axes, margins and text that all figures share."""

from html import escape
from typing import Any

import numpy as np

from reports.figures.palette import GRID, INK, MUTED, PAPER

DIGITS = 6


def rounded(values: Any, digits: int = DIGITS) -> list[Any]:
    """Numbers for JSON to `digits` significant digits; None for what is not finite.  Any shape."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim > 1:
        return [rounded(row, digits) for row in array]
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
    """A panel's layout; a title stands left above the axes."""
    heading = {"text": plain(title), "x": 0.0, "xref": "paper", "xanchor": "left", "font": {"size": 14}}
    return {
        "height": height,
        "margin": {"l": 50, "r": 14, "t": 34 if title else 12, "b": 44, "pad": 0},
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
