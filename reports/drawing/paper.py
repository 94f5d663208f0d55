"""Figures for PDF and Markdown: panels of marks laid out on the width of the page as SVG with searchable text.

All lengths are points.  The typesetter sets the text in the typeface of the page; `lettering` knows how wide it gets.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from reports.drawing import lettering
from reports.drawing.lettering import LINE, TYPE
from reports.drawing.marks import Axis, Bar, Drawing, Field, Mark, Plot
from reports.drawing.palette import GRID, MUTED, ON_PAPER, ON_SCREEN, coloured
from reports.drawing.strokes import SWATCH, Frame, part_of_axis, stroked, swatch
from reports.drawing.ticks import MOST_TICKS, axis_ticks, numerals

WIDTH = 493.2  # 174 mm, the text width of the page
SHORT = 0.46  # points of height on paper for a pixel on the screen
GAP = 14.0  # between panels
NAMES = 0.34 * WIDTH  # of the lines of words along an upright axis
UPRIGHT, BETWEEN = 1.8 * TYPE, 5.0  # distance of tick labels of an upright axis; gap between those of another
KEY_GAP = 12.0  # between entries of a key
BAR = 14.0  # width of a colour scale and of the gap to its right
Ends = tuple[float, float]


def svg(drawing: Drawing) -> str:
    """The figure as SVG on a transparent ground; the same figure gives the same bytes."""
    key, top = _key(drawing.key, WIDTH)
    parts = list(_panel_rows(drawing, WIDTH, top))
    return _picture([*key, *(line for body, _ in parts for line in body)], 0.0, parts[-1][1], WIDTH)


def strips(drawing: Drawing, width: float = WIDTH) -> list[str]:
    """The key, "" without one, and an SVG for each row of panels, so that a figure can continue on the next page."""
    body, top = _key(drawing.key, width)
    pictures = [_picture(body, 0.0, top, width) if body else ""]
    for body, bottom in _panel_rows(drawing, width, top):
        pictures.append(_picture(body, top, bottom, width))
        top = bottom
    return pictures


def _picture(body: list[str], top: float, bottom: float, width: float) -> str:
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 {top:.1f} {width:.1f} {bottom - top:.1f}" '
        f'width="{width:.1f}pt" height="{bottom - top:.1f}pt" font-family="DejaVu Sans, sans-serif" font-size="{TYPE}" '
        'fill="none">'
    )
    return coloured("".join([head, *body, "</svg>"]), ON_PAPER)


def _panel_rows(drawing: Drawing, whole: float, top: float) -> Iterator[tuple[list[str], float]]:
    """SVG elements of each row of panels, from `top` downwards, and the y of its lower edge."""
    rows = -(-len(drawing.plots) // drawing.across)
    for number, row in enumerate(np.array_split(np.arange(len(drawing.plots)), rows)):
        width = (whole - GAP * (len(row) - 1)) / len(row)
        panels: list[_Panel] = []
        body: list[str] = []
        for k, plot in enumerate(drawing.plots[row[0] : row[-1] + 1]):
            left = (GAP + width) * k
            scales = [_colour_scale(field, plot.height) for field in plot.fields]
            room = sum(_Panel(scale, 0.0, 0.0).frame_left + BAR for scale in scales)
            panels.append(_Panel(plot, left, width - room))
            panels += [_Panel(scale, left + width - room, room) for scale in scales]
        upper = top + 5.0 + LINE * max(len(panel.title) for panel in panels)
        lower = upper + max(panel.height for panel in panels)
        for k, panel in enumerate(panels):
            body += panel.drawn(top, upper, lower, f"c{number}-{k}")
        top = lower + max(panel.foot for panel in panels) + 6.0
        yield body, top


def _colour_scale(field: Field, height: float) -> Plot:
    """The colours of a field and their values, as a narrow panel."""
    n, levels = len(field.colour), field.levels
    boxes = Bar(np.zeros(n), np.ones(n), levels[:-1], levels[1:], field.colour, field.opacity)
    up = Axis(field.label, reach=(float(levels[0]), float(levels[-1])))
    return Plot((boxes,), Axis(reach=(0.0, 1.0), ticks=()), up, height=height)


def _key(key: tuple[Mark, ...], whole: float) -> tuple[list[str], float]:
    """SVG elements of the key, and the y of its lower edge."""
    elements: list[str] = []
    x, y, inset = 0.0, LINE, SWATCH[0] + 4.0
    for mark in key:
        lines = lettering.wrapped(mark.key, whole - inset - 4.0)
        long = lettering.widest(lines)
        if x and x + inset + long > whole:
            x, y = 0.0, y + LINE + 1.0
        elements += [*swatch(mark, x, y - 2.6), *lettering.text(x + inset, y, lines)]
        y += LINE * (len(lines) - 1)
        x += inset + long + KEY_GAP
    return elements, y + 7.0 if key else 0.0


def page_swatch(mark: Mark) -> str:
    """The mark's sample in the key of a figure on the screen, as SVG in colours of the page."""
    width, height = SWATCH
    sample = coloured("".join(swatch(mark, 0.0, 0.5 * height)), ON_SCREEN)
    return f'<svg viewBox="0 0 {width:g} {height:g}" fill="none">{sample}</svg>'


@dataclass(frozen=True)
class _Ticks:
    """places : on the axis; texts : lines of each; power : of ten that the numbers leave out; turned : upwards."""

    places: np.ndarray
    texts: list[list[str]]
    power: str = ""
    turned: bool = False

    @property
    def widest(self) -> float:
        return max(map(lettering.widest, self.texts), default=0.0)


def _ticks(axis: Axis, ends: Ends, room: float, upright: bool) -> _Ticks:
    """The ticks of an axis of length `room` points, as many as fit without overlap."""
    if axis.ticks is not None:
        return _own_ticks([(at, text) for at, text in axis.ticks if min(ends) <= at <= max(ends)], room, upright)
    many = [axis_ticks(*ends, most, log=axis.log, whole=axis.whole) for most in range(MOST_TICKS, 1, -1)]
    outermost = many[0][:: max(len(many[0]) - 1, 1)]  # one tick alone says nothing of a scale
    choices = [*(some for some in many if len(some) > 1), outermost]
    for turned, places in product((False, not upright), choices):
        texts, power = numerals(places, axis.log)
        apart = np.abs(np.diff(part_of_axis(np.array(places), ends, axis.log))) * room
        sizes = np.array([UPRIGHT if upright or turned else lettering.width(text) + BETWEEN for text in texts])
        if (apart >= 0.5 * (sizes[1:] + sizes[:-1])).all():
            break
    return _Ticks(np.array(places), [[text] for text in texts], power, turned)


def _own_ticks(own: list[tuple[float, str]], room: float, upright: bool) -> _Ticks:
    """Words along an axis: in lines as wide as their slots, or turned where a word is wider."""
    places, slot = np.array([at for at, _ in own]), room / max(len(own), 1) - 4.0
    ticks = _Ticks(places, [lettering.wrapped(text, NAMES if upright else slot, 4) for _, text in own])
    if upright or ticks.widest <= slot:
        return ticks
    return _Ticks(places, [lettering.wrapped(text, 90.0, 2) for _, text in own], turned=True)


def _room_of_words(axis: Axis) -> float:
    """Height of an upright axis on which its own words do not overlap; 0 where none of them is broken into lines."""
    own = axis.ticks or ()
    lines = max((len(lettering.wrapped(text, NAMES, 4)) for _, text in own), default=0)
    return LINE * lines * len(own) if lines > 1 else 0.0


class _Panel:
    """One panel: computes the space that its texts take, then draws itself."""

    def __init__(self, plot: Plot, left: float, width: float):
        self.plot, self.left, self.right = plot, left, left + width
        self.height = max(SHORT * plot.height, _room_of_words(plot.y))
        room = (width - 4.0) / lettering.BOLD
        self.title = lettering.wrapped(plot.title, room, 3)
        self.bold = len(lettering.wrapped(plot.title.partition("\n")[0], room, 3))
        self.ends = plot.ends
        self.y_ticks = _ticks(plot.y, self.ends[1], self.height, True)
        self.y_label = _label(plot.y, self.y_ticks, self.height + (0.0 if self.title else 12.0))
        self.frame_left = left + self.y_ticks.widest + 5.0 + LINE * len(self.y_label)
        room = self.right - 5.0 - self.frame_left
        if plot.equal:
            self.ends = _equal(*self.ends, room, self.height)
            self.y_ticks = _ticks(plot.y, self.ends[1], self.height, True)
        self.x_ticks = _ticks(plot.x, self.ends[0], room, False)
        self.x_label = _label(plot.x, self.x_ticks, room)
        lines = LINE * max(map(len, self.x_ticks.texts), default=0)
        self.tick_room = 3.0 + (self.x_ticks.widest if self.x_ticks.turned else lines)
        self.foot = self.tick_room + LINE * len(self.x_label)

    def drawn(self, top: float, upper: float, lower: float, clip: str) -> Iterator[str]:
        """SVG elements, its title from `top` on, its axes from `upper` to `lower`; clip : a name of its own."""
        logs = self.plot.x.log, self.plot.y.log
        frame = Frame(self.frame_left, upper, self.right - 5.0, lower, *self.ends, *logs)
        yield from lettering.text(self.left, top + LINE - 1.0, self.title[: self.bold], bold=True)
        yield from lettering.text(self.left, top + LINE * (self.bold + 1) - 1.0, self.title[self.bold :])
        left, right = f"M{frame.left:.2f}", f"H{frame.right:.2f}"
        lines = [f"M{x:.2f} {upper:.2f}V{lower:.2f}" for x in frame.x(self.x_ticks.places)]
        lines += [f"{left} {y:.2f}{right}" for y in frame.y(self.y_ticks.places)]
        yield f'<path d="{"".join(lines)}" stroke="{GRID}" stroke-width=".5"/>' if lines else ""
        yield f'<clipPath id="{clip}"><path d="{left} {upper:.2f}{right}V{lower:.2f}H{frame.left:.2f}z"/></clipPath>'
        yield f'<g clip-path="url(#{clip})">'
        for mark in self.plot.strokes:
            yield from stroked(mark, frame)
        yield f'</g><path d="{left} {upper:.2f}V{lower:.2f}{right}" stroke="{MUTED}" stroke-width=".6"/>'
        yield from self._texts(frame)

    def _texts(self, frame: Frame) -> Iterator[str]:
        """Of both axes: ticks, then labels."""
        for at, lines in zip(frame.y(self.y_ticks.places), self.y_ticks.texts, strict=True):
            yield from lettering.text(frame.left - 3.0, at + _first_line(lines), lines, anchor="end")
        for at, lines in zip(frame.x(self.x_ticks.places), self.x_ticks.texts, strict=True):
            if self.x_ticks.turned:
                yield from lettering.text(at + _first_line(lines), frame.bottom + 4.0, lines, anchor="end", turned=True)
            else:
                half = 0.5 * lettering.widest(lines)
                x = min(max(at, self.left + half), self.right - half)
                yield from lettering.text(x, frame.bottom + LINE, lines, anchor="middle")
        middle = 0.5 * (frame.left + frame.right), 0.5 * (frame.top + frame.bottom)
        yield from lettering.text(self.left + 7.0, middle[1], self.y_label, anchor="middle", turned=True)
        below = frame.bottom + self.tick_room + LINE - 2.4
        yield from lettering.text(middle[0], below, self.x_label, anchor="middle")


def _first_line(lines: list[str]) -> float:
    """Where the baseline of the first of these lines lies, when their middle is at 0."""
    return 2.7 - 0.5 * LINE * (len(lines) - 1)


def _label(axis: Axis, ticks: _Ticks, room: float) -> list[str]:
    """The lines of an axis label, with the power of ten that its numbers leave out."""
    return lettering.wrapped(" ".join(filter(None, (axis.label, ticks.power))), room, 4)


def _equal(x: Ends, y: Ends, width: float, height: float) -> tuple[Ends, Ends]:
    """Axis ranges with one scale for both axes; the range that is too short is extended on both sides."""
    unit = max(abs(x[1] - x[0]) / width, abs(y[1] - y[0]) / height)
    extra = [0.5 * np.copysign(unit * length - abs(high - low), high - low)
             for (low, high), length in ((x, width), (y, height))]  # fmt: skip
    return (x[0] - extra[0], x[1] + extra[0]), (y[0] - extra[1], y[1] + extra[1])
