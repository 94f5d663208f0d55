"""Marks as SVG in a frame, in colours of the page."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import singledispatch

import numpy as np

from reports.drawing import lettering
from reports.drawing.marks import Band, Bar, Field, Limit, Line, Mark, Points

LINE, SIGN = 0.6, 0.5  # points for a pixel, of lines' widths and of signs' sizes
SWATCH = (13.0, 6.0)  # width and height of a sample in a key
MOST_COLOURS = 7  # of it
LEAST_SIGN = 6.0  # size of a point in it, in pixels
LAYERS = 8  # a cloud is drawn in so many, so that where many points lie it is darker
DASHES = {"solid": "", "dash": ' stroke-dasharray="4 2.4"', "dot": ' stroke-dasharray="1 1.8"'}
SHAPES = {  # outlines about the middle of a sign of width 2
    "diamond": "m0-1.2l1.2 1.2-1.2 1.2-1.2-1.2z",
    "square": "m-.9-.9h1.8v1.8h-1.8z",
    "triangle-up": "m0-1.1l1.1 1.9h-2.2z",
    "star": "m0-1.3l.4 .9 .9 .1-.7 .6 .2 1-.8-.5-.8 .5 .2-1-.7-.6 .9-.1z",
}
ARMS = {"x": "m-.8-.8l1.6 1.6m0-1.6l-1.6 1.6", "cross": "m-.9 0h1.8m-.9-.9v1.8"}


@dataclass(frozen=True)
class Frame:
    """The rectangle of a panel on paper [points], and the values at the ends of its axes."""

    left: float
    top: float
    right: float
    bottom: float
    x_ends: tuple[float, float]
    y_ends: tuple[float, float]
    x_log: bool = False
    y_log: bool = False

    def x(self, values: np.ndarray | float) -> np.ndarray:
        return self.left + (self.right - self.left) * part_of_axis(values, self.x_ends, self.x_log)

    def y(self, values: np.ndarray | float) -> np.ndarray:
        return self.bottom - (self.bottom - self.top) * part_of_axis(values, self.y_ends, self.y_log)


def part_of_axis(values: np.ndarray | float, ends: tuple[float, float], log: bool) -> np.ndarray:
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
    frame = Frame(x, y - 0.5 * height, x + width, y + 0.5 * height, (0.0, 1.0), (0.0, 1.0))
    ends, middle = np.array([0.0, 1.0]), np.full(2, 0.5)
    if isinstance(mark, Points):
        size, at = max(mark.size, LEAST_SIGN), middle[:1]
        yield from _points(replace(mark, x=at, y=at, x_ends=None, y_ends=None, size=size, opacity=1.0), frame)
    elif isinstance(mark, Line | Limit):
        yield from _line(Line(ends, middle, mark.colour, dash=mark.dash, width=mark.width), frame)
    else:
        one_or_more = mark.colours if isinstance(mark, Field) else mark.colour
        every = [one_or_more] if isinstance(one_or_more, str) else one_or_more
        colours = [every[k] for k in np.linspace(0, len(every) - 1, min(len(every), MOST_COLOURS)).astype(int)]
        n, opacity = len(colours), 1.0 if isinstance(mark, Field) else mark.opacity
        edges = np.linspace(0.0, 1.0, n + 1)
        yield from _bar(Bar(edges[:-1], edges[1:], np.zeros(n), np.ones(n), colours, opacity), frame)


@stroked.register
def _line(mark: Line, frame: Frame) -> Iterator[str]:
    x, y = mark.corners
    yield from _path(_pen(frame.x(x), frame.y(y)), mark.colour, mark.width, mark.dash, mark.opacity)


@stroked.register
def _limit(mark: Limit, frame: Frame) -> Iterator[str]:
    at = float((frame.x if mark.axis == "x" else frame.y)(mark.at))
    where = (
        f"M{at:.2f} {frame.top:.2f}V{frame.bottom:.2f}"
        if mark.axis == "x"
        else f"M{frame.left:.2f} {at:.2f}H{frame.right:.2f}"
    )
    yield from _path(where, mark.colour, mark.width, mark.dash)


@stroked.register
def _band(mark: Band, frame: Frame) -> Iterator[str]:
    outline = _pen(frame.x(mark.x), frame.y(mark.y), close=True)
    style = f'fill-opacity="{mark.opacity:g}" fill-rule="evenodd"'
    style += f' stroke="{mark.edge}" stroke-width=".35"' if mark.edge else ""
    yield f'<path d="{outline}" fill="{mark.colour}" {style}/>'


@stroked.register
def _bar(mark: Bar, frame: Frame) -> Iterator[str]:
    left, right = (np.round(frame.x(edge), 2).tolist() for edge in (mark.left, mark.right))
    bottom, top = (np.round(frame.y(edge), 2).tolist() for edge in (mark.bottom, mark.top))
    boxes = [f"M{a} {c}H{b}V{d}H{a}z" for a, b, c, d in zip(left, right, bottom, top, strict=True)]
    colours = [mark.colour] * len(boxes) if isinstance(mark.colour, str) else mark.colour
    for colour in dict.fromkeys(colours):
        these = "".join(box for box, one in zip(boxes, colours, strict=True) if one == colour)
        yield f'<path d="{these}" fill="{colour}" fill-opacity="{mark.opacity:g}"/>'
    inks = [mark.ink] * len(boxes) if isinstance(mark.ink, str) else mark.ink
    for a, b, c, d, label, ink in zip(left, right, bottom, top, mark.labels, inks, strict=False):
        yield lettering.text((a + b) / 2, (c + d) / 2 + 2.7, label, anchor="middle", fill=ink)


@stroked.register
def _field(mark: Field, frame: Frame) -> Iterator[str]:
    for band in mark.bands:
        yield from _band(band, frame)


@stroked.register
def _points(mark: Points, frame: Frame) -> Iterator[str]:
    x, y = frame.x(mark.x), frame.y(mark.y)
    yield from _intervals(mark, frame, x, y)
    inside = (x > frame.left - 9) & (x < frame.right + 9) & (y > frame.top - 9) & (y < frame.bottom + 9)
    places = list(zip(np.round(x[inside], 1).tolist(), np.round(y[inside], 1).tolist(), strict=True))
    for layer in range(min(LAYERS if mark.opacity < 1.0 else 1, len(places))):
        some = places[layer::LAYERS] if mark.opacity < 1.0 else places
        yield from signs(some, mark.sign, SIGN * mark.size, mark.colour, mark.opacity, mark.edge)


def _intervals(mark: Points, frame: Frame, x: np.ndarray, y: np.ndarray) -> Iterator[str]:
    """Bars with caps between the ends of intervals."""
    paths = []
    if mark.x_ends:
        low, high = (frame.x(end) for end in mark.x_ends)
        rows = np.column_stack([np.fmin(low, x), np.fmax(high, x), y]).round(2).tolist()
        paths += [f"M{a} {c}H{b}" for a, b, c in rows]
    if mark.y_ends:
        low, high = (frame.y(end) for end in mark.y_ends)
        rows = np.column_stack([x, np.fmax(low, y), np.fmin(high, y)]).round(2).tolist()
        paths += [f"M{a} {b}V{c}M{a - 1.5:.2f} {b}h3M{a - 1.5:.2f} {c}h3" for a, b, c in rows]
    if paths:
        yield from _path("".join(paths), mark.colour, 1.6)


def signs(
    places: Sequence[tuple[float, float]], sign: str, size: float, colour: str, opacity: float = 1.0, edge: str = ""
) -> Iterator[str]:
    """Signs of one kind at these places of the page."""
    faint = f' opacity="{opacity:g}"' if opacity < 1.0 else ""
    r = 0.5 * size
    if sign == "ring":
        rings = "".join(f'<circle cx="{x}" cy="{y}" r="{r:.2f}"/>' for x, y in places)
        yield f'<g fill="{edge or "none"}" stroke="{colour}" stroke-width="1.5"{faint}>{rings}</g>'
    elif sign in SHAPES:
        scaled = "".join(f"M{x / r:.3f} {y / r:.3f}{SHAPES[sign]}" for x, y in places)
        yield f'<path transform="scale({r:.3f})" d="{scaled}" fill="{colour}"{faint}/>'
    elif sign in ARMS:
        arms = "".join(f"M{x / r:.3f} {y / r:.3f}{ARMS[sign]}" for x, y in places)
        yield f'<path transform="scale({r:.3f})" d="{arms}" stroke="{colour}" stroke-width=".6"{faint}/>'
    else:  # a round pen that hardly moves: far shorter than circles
        dots = "".join(f"M{x} {y}h.01" for x, y in places)
        for tint, width in ((edge, size + 0.5), (colour, size)) if edge else ((colour, size),):
            yield f'<path d="{dots}" stroke="{tint}" stroke-width="{width:.2f}" stroke-linecap="round"{faint}/>'


def _path(where: str, colour: str, width: float, dash: str = "solid", opacity: float = 1.0) -> Iterator[str]:
    faint = f' opacity="{opacity:g}"' if opacity < 1.0 else ""
    if where:
        yield f'<path d="{where}" stroke="{colour}" stroke-width="{LINE * width:.2f}"{DASHES[dash]}{faint}/>'


def _pen(x: np.ndarray, y: np.ndarray, close: bool = False) -> str:
    """A path through the points, lifted where they are not numbers."""
    good = np.isfinite(x) & np.isfinite(y)
    pieces, down = [], False
    for px, py, finite in zip(np.round(x, 2).tolist(), np.round(y, 2).tolist(), good.tolist(), strict=True):
        if finite:
            pieces.append(f"{' ' if down else 'M'}{px:g} {py:g}")
        elif down and close:
            pieces.append("z")
        down = finite
    return "".join(pieces) + "z" * (close and down)
