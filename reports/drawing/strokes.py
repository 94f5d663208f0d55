"""Marks as SVG in a frame, in colours of the page."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import singledispatch
from math import isfinite

import numpy as np

from reports.drawing import lettering
from reports.drawing.marks import Band, Bar, Limit, Line, Mark, Points

LINE, SIGN = 0.6, 0.5  # points for a pixel, of lines' widths and of signs' sizes
SWATCH = (13.0, 6.0)  # width and height of a sample in a key
MOST_COLOURS = 7  # of it
LEAST_SIGN = 6.0  # size of a point in it, in pixels
LAYERS = 8  # a cloud is drawn in so many, so that where many points lie it is darker
DASHES = {"solid": "", "dash": ' stroke-dasharray="4 2.4"', "dot": ' stroke-dasharray="1 1.8"'}
SIGNS = {  # outlines about the middle of a sign of width 2, and the width of the round pen that draws them
    "circle": ("h.001", 2.0),  # a pen that hardly moves: far shorter than circles
    "diamond": ("m0-1.2l1.2 1.2-1.2 1.2-1.2-1.2z", 0.0),
    "square": ("m-.9-.9h1.8v1.8h-1.8z", 0.0),
    "triangle-up": ("m0-1.1l1.1 1.9h-2.2z", 0.0),
    "star": ("m0-1.3l.4 .9 .9 .1-.7 .6 .2 1-.8-.5-.8 .5 .2-1-.7-.6 .9-.1z", 0.0),
    "x": ("m-.8-.8l1.6 1.6m0-1.6l-1.6 1.6", 0.3),
    "cross": ("m-.9 0h1.8m-.9-.9v1.8", 0.3),
}


@dataclass(frozen=True)
class Frame:
    """The rectangle of a panel on paper [points], and the values at the ends of its axes."""

    left: float
    top: float
    right: float
    bottom: float
    x_ends: tuple[float, float] = (0.0, 1.0)
    y_ends: tuple[float, float] = (0.0, 1.0)
    x_log: bool = False
    y_log: bool = False

    def x(self, values: np.ndarray) -> np.ndarray:
        return self.left + (self.right - self.left) * part_of_axis(values, self.x_ends, self.x_log)

    def y(self, values: np.ndarray) -> np.ndarray:
        return self.bottom - (self.bottom - self.top) * part_of_axis(values, self.y_ends, self.y_log)


def part_of_axis(values: np.ndarray, ends: tuple[float, float], log: bool) -> np.ndarray:
    """Positions along an axis, 0 at its begin and 1 at its end, limited to ±20: PDF readers lose digits beyond."""
    with np.errstate(divide="ignore", invalid="ignore"):
        place: Callable[..., np.ndarray] = np.log10 if log else np.asarray
        low, high = place(np.asarray(ends, dtype=np.float64))
        return np.clip((place(np.asarray(values, dtype=np.float64)) - low) / (high - low), -20.0, 20.0)


@singledispatch
def stroked(mark: object, frame: Frame) -> Iterator[str]:
    """The mark as SVG elements."""
    raise TypeError(f"{type(mark).__name__} is no mark that is drawn as SVG")


def swatch(mark: Mark, x: float, y: float) -> Iterator[str]:
    """A sample of the mark for a key, from x on, its middle at y."""
    width, height = SWATCH
    frame = Frame(x, y - 0.5 * height, x + width, y + 0.5 * height)
    ends, middle = np.array([0.0, 1.0]), np.full(2, 0.5)
    if isinstance(mark, Points):
        size = max(mark.size, LEAST_SIGN)
        yield from _points(replace(mark, x=middle[:1], y=middle[:1], size=size, opacity=1.0), frame)
    elif isinstance(mark, Line | Limit):
        yield from _line(Line(ends, middle, mark.colour, dash=mark.dash, width=mark.width), frame)
    else:
        every = np.atleast_1d(mark.colour)
        n = min(every.size, MOST_COLOURS)
        colours, edges = every[np.linspace(0, every.size - 1, n).astype(int)].tolist(), np.linspace(0.0, 1.0, n + 1)
        yield from _bar(Bar(edges[:-1], edges[1:], np.zeros(n), np.ones(n), colours, mark.opacity), frame)


@stroked.register
def _line(mark: Line, frame: Frame) -> Iterator[str]:
    where, faint = _pen(frame.x(mark.x), frame.y(mark.y)), _faint(mark.opacity)
    if where:
        style = f'stroke="{mark.colour}" stroke-width="{LINE * mark.width:.2f}"{DASHES[mark.dash]}{faint}'
        yield f'<path d="{where}" {style}/>'


@stroked.register
def _band(mark: Band, frame: Frame) -> Iterator[str]:
    outline = _pen(frame.x(mark.x), frame.y(mark.y), "z")
    style = f'fill-opacity="{mark.opacity:g}" fill-rule="evenodd"'
    style += f' stroke="{mark.edge}" stroke-width=".35"' if mark.edge else ""
    yield f'<path d="{outline}" fill="{mark.colour}" {style}/>'


@stroked.register
def _bar(mark: Bar, frame: Frame) -> Iterator[str]:
    edges = frame.x(mark.left), frame.x(mark.right), frame.y(mark.bottom), frame.y(mark.top)
    boxes = np.round(np.column_stack(edges), 2).tolist()
    colours, inks = (np.broadcast_to(paint, len(boxes)).tolist() for paint in (mark.colour, mark.ink))
    for colour in dict.fromkeys(colours):
        these = (box for box, own in zip(boxes, colours, strict=True) if own == colour)
        outlines = "".join(f"M{a} {c}H{b}V{d}H{a}z" for a, b, c, d in these)
        yield f'<path d="{outlines}" fill="{colour}" fill-opacity="{mark.opacity:g}"/>'
    for (a, b, c, d), label, ink in zip(boxes, mark.labels, inks, strict=False):
        yield from lettering.text((a + b) / 2, (c + d) / 2 + 2.7, [label], anchor="middle", fill=ink)


@stroked.register
def _points(mark: Points, frame: Frame) -> Iterator[str]:
    x, y = frame.x(mark.x), frame.y(mark.y)
    inside = (x > frame.left - 9) & (x < frame.right + 9) & (y > frame.top - 9) & (y < frame.bottom + 9)
    (shape, pen), r = SIGNS[mark.sign], 0.5 * SIGN * mark.size
    places = (np.round(np.column_stack([x[inside], y[inside]]), 1) / r).round(3).tolist()
    rim = SIGN * mark.edge_width / r if mark.edge else 0.0  # half of it outside the sign, half inside
    strokes = [*[(mark.edge, pen + rim)] * bool(rim), (mark.colour, max(pen - rim, 0.0))]
    layers = LAYERS if mark.opacity < 1.0 else 1
    for layer in range(min(layers, len(places))):
        outlines = "".join(f"M{x:g} {y:g}{shape}" for x, y in places[layer::layers])
        for colour, width in strokes:
            pencil = f'stroke="{colour}" stroke-width="{width:.3f}" stroke-linecap="round"'
            style = pencil if width else f'fill="{colour}"'
            yield f'<path transform="scale({r:.3f})" d="{outlines}" {style}{_faint(mark.opacity)}/>'


def _faint(opacity: float) -> str:
    return f' opacity="{opacity:g}"' if opacity < 1.0 else ""


def _pen(x: np.ndarray, y: np.ndarray, end: str = "") -> str:
    """A path through the points, lifted where they are not numbers; end : of each piece, "z" closes it."""
    pieces, down = [], False
    for across, up in zip(np.round(x, 2).tolist(), np.round(y, 2).tolist(), strict=True):
        if isfinite(across) and isfinite(up):
            pieces.append(f"{' ' if down else 'M'}{across:g} {up:g}")
            down = True
        elif down:
            pieces.append(end)
            down = False
    return "".join(pieces) + end * down
