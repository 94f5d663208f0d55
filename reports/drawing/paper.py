"""Figures for PDF and Markdown: panels of marks laid out on the width of the page as SVG with searchable text.

All lengths are points.  The typesetter sets the text in the typeface of the page; `lettering` knows how wide it gets.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from reports.drawing import lettering
from reports.drawing.lettering import LINE, TYPE
from reports.drawing.marks import Axis, Drawing, Field, Mark, Plot
from reports.drawing.palette import GRID, MUTED, on_paper, on_screen
from reports.drawing.strokes import SWATCH, Frame, part_of_axis, stroked, swatch
from reports.drawing.ticks import log_numerals, log_ticks, nice_ticks, numerals

WIDTH = 493.2  # 174 mm, the text width of the page
SHORT = 0.46  # points of height on paper for a pixel on the screen
GAP = 14.0  # between panels
UPRIGHT, BETWEEN = 1.8 * TYPE, 5.0  # distance of tick labels of an upright axis; gap between those of another
KEY_GAP = 12.0  # between entries of a key
BAR = 9.0  # width of a colour scale
Ends = tuple[float, float]


def svg(drawing: Drawing) -> str:
    """The figure as SVG on a transparent ground; the same figure gives the same bytes."""
    parts = list(_panel_rows(drawing, WIDTH))
    return _picture([line for body, _ in parts for line in body], 0.0, parts[-1][1], WIDTH)


def strips(drawing: Drawing, width: float = WIDTH) -> list[str]:
    """One SVG for each row of panels, so that a figure can continue on the next page; the first holds the key."""
    pictures, top = [], 0.0
    for body, bottom in _panel_rows(drawing, width):
        pictures.append(_picture(body, top, bottom, width))
        top = bottom
    return pictures


def _picture(body: list[str], top: float, bottom: float, width: float) -> str:
    return on_paper(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 {top:.1f} {width:.1f} {bottom - top:.1f}" '
        f'width="{width:.1f}pt" height="{bottom - top:.1f}pt" font-family="DejaVu Sans, sans-serif" font-size="{TYPE}" '
        f'fill="none">{"".join(body)}</svg>'
    )


def _panel_rows(drawing: Drawing, whole: float) -> Iterator[tuple[list[str], float]]:
    """SVG elements of each row of panels and the y of its lower edge; the first row has the key above it."""
    body, top = _key(drawing.key, whole)
    clip = 0
    for row in rows_of(drawing.plots, drawing.across):
        width = (whole - GAP * (len(row) - 1)) / len(row)
        boxes = [_Box(plot, GAP * k + width * k, top, width) for k, plot in enumerate(row)]
        head, foot = max(box.head for box in boxes), max(box.foot for box in boxes)
        height = max(SHORT * box.plot.height for box in boxes)
        for box in boxes:
            body += box.drawn(head, height, clip)
            clip += 1
        top += head + height + foot + 6.0
        yield body, top
        body = []


def rows_of(plots: tuple[Plot, ...], across: int) -> list[tuple[Plot, ...]]:
    """The panels in rows of at most `across`, as even as can be; a shorter row is as wide as the others."""
    rows = -(-len(plots) // across)
    bounds = [round(k * len(plots) / rows) for k in range(rows + 1)]
    return [plots[a:b] for a, b in pairwise(bounds)]


def _key(key: tuple[Mark, ...], whole: float) -> tuple[list[str], float]:
    """SVG elements of the key, and the y of its lower edge."""
    elements: list[str] = []
    x, y, inset = 0.0, LINE, SWATCH[0] + 4.0
    for mark in key:
        lines = lettering.wrapped(mark.key, whole - inset - 4.0)
        long = lettering.widest(lines)
        if x and x + inset + long > whole:
            x, y = 0.0, y + LINE + 1.0
        elements += [*swatch(mark, x, y - 2.6), *lettering.lines(x + inset, y, lines)]
        y += LINE * (len(lines) - 1)
        x += inset + long + KEY_GAP
    return elements, y + 7.0 if key else 0.0


def page_swatch(mark: Mark) -> str:
    """The mark's sample in the key of a figure on the screen, as SVG in colours of the page."""
    width, height = SWATCH
    sample = on_screen("".join(swatch(mark, 0.0, 0.5 * height)))
    return f'<svg viewBox="0 0 {width:g} {height:g}" fill="none">{sample}</svg>'


@dataclass(frozen=True)
class _Ticks:
    places: list[float]
    texts: list[list[str]]
    power: str = ""
    turned: bool = False

    @property
    def widest(self) -> float:
        return max(map(lettering.widest, self.texts), default=0.0)

    @property
    def lines(self) -> int:
        return max(map(len, self.texts), default=0)


def _ticks(axis: Axis, ends: tuple[float, float], room: float, upright: bool) -> _Ticks:
    """The ticks of an axis of length `room` points, as many as fit without overlap."""
    if axis.ticks is not None:
        low, high = min(ends), max(ends)
        own = [(place, text) for place, text in axis.ticks if low <= place <= high]
        slot = room / max(len(own), 1) - 4.0
        wrap = 0.34 * WIDTH if upright else slot
        texts = [lettering.wrapped(text, wrap, 4) for _, text in own]
        wrapped = _Ticks([place for place, _ in own], texts)
        if upright or wrapped.widest <= slot:
            return wrapped
        return _Ticks(wrapped.places, [lettering.wrapped(text, 90.0, 2) for _, text in own], turned=True)
    for places in _choices(axis, ends):
        decades = axis.log and places[-1] >= 10.0 * places[0]
        words, power = (log_numerals(places), "") if decades else numerals(places)
        apart = np.abs(np.diff(part_of_axis(np.array(places), ends, axis.log))) * room
        sizes = [UPRIGHT if upright else lettering.width(text) + BETWEEN for text in words]
        if all(distance >= 0.5 * (a + b) for distance, (a, b) in zip(apart, pairwise(sizes), strict=True)):
            break
    return _Ticks(places, [[text] for text in words], power)


def _choices(axis: Axis, ends: Ends) -> Iterator[list[float]]:
    """Tick values from many to few: one alone says nothing of a scale, so the last choice is the outermost two."""
    log = axis.log and len(log_ticks(*ends, axis.most)) > 1  # a narrow range may hold no 1, 2 or 5 of a decade
    many = [log_ticks(*ends, most) if log else nice_ticks(*ends, most, axis.whole)
            for most in range(axis.most, 1, -1)]  # fmt: skip
    yield from (places for places in many if len(places) > 1)
    yield many[0][:: max(len(many[0]) - 1, 1)]


class _Box:
    """One panel: computes the space that its texts take, then draws itself."""

    def __init__(self, plot: Plot, left: float, top: float, width: float):
        self.plot, self.left, self.top, self.right = plot, left, top, left + width
        height = SHORT * plot.height
        x_ends, y_ends = plot.ends
        self.y_ticks = _ticks(plot.y, y_ends, height, True)
        self.y_label = lettering.wrapped(plot.y.label, height + 12.0, 2)
        self.scale = _Scale(plot.field, height) if plot.field else None
        self.frame_left = left + self.y_ticks.widest + 5.0 + LINE * len(self.y_label)
        self.frame_right = self.right - (self.scale.width if self.scale else 5.0)
        room = self.frame_right - self.frame_left
        self.ends = x_ends, y_ends
        if plot.equal:
            self.ends = _equal(x_ends, y_ends, room, height)
            self.y_ticks = _ticks(plot.y, self.ends[1], height, True)
        self.x_ticks = _ticks(plot.x, self.ends[0], room, False)
        self.title = lettering.wrapped(plot.title, width - 4.0, 3)
        self.x_label = lettering.wrapped(plot.x.label, room - 2.0 * lettering.width(self.x_ticks.power), 2)

    @property
    def tick_room(self) -> float:
        return (self.x_ticks.widest if self.x_ticks.turned else LINE * self.x_ticks.lines) + 3.0

    @property
    def head(self) -> float:
        return 3.0 + LINE * (len(self.title) + bool(self.y_ticks.power))

    @property
    def foot(self) -> float:
        return self.tick_room + LINE * (len(self.x_label) if self.plot.x.label else bool(self.x_ticks.power))

    def drawn(self, head: float, height: float, clip: int) -> Iterator[str]:
        top = self.top + head
        frame = Frame(
            self.frame_left, top, self.frame_right, top + height, *self.ends, self.plot.x.log, self.plot.y.log
        )
        for k, line in enumerate(self.title):
            yield lettering.text(self.left, top - head + LINE * (k + 1) - 1.0, line, bold=k == 0)
        yield from self._grid(frame)
        yield (f'<clipPath id="c{clip}"><path d="M{frame.left:.2f} {frame.top:.2f}H{frame.right:.2f}V{frame.bottom:.2f}'
               f'H{frame.left:.2f}z"/></clipPath><g clip-path="url(#c{clip})">')  # fmt: skip
        for mark in self.plot.marks:
            yield from stroked(mark, frame)
        yield "</g>"
        yield from self._axes(frame)
        if self.scale:
            yield from self.scale.drawn(frame)

    def _grid(self, frame: Frame) -> Iterator[str]:
        lines = [
            f"M{x:.2f} {frame.top:.2f}V{frame.bottom:.2f}"
            for x in frame.x(np.array(self.x_ticks.places))
            if self.plot.x.grid
        ]
        lines += [
            f"M{frame.left:.2f} {y:.2f}H{frame.right:.2f}"
            for y in frame.y(np.array(self.y_ticks.places))
            if self.plot.y.grid
        ]
        yield f'<path d="{"".join(lines)}" stroke="{GRID}" stroke-width=".5"/>' if lines else ""

    def _axes(self, frame: Frame) -> Iterator[str]:
        corner = f"M{frame.left:.2f} {frame.top:.2f}V{frame.bottom:.2f}H{frame.right:.2f}"
        yield f'<path d="{corner}" stroke="{MUTED}" stroke-width=".6"/>'
        for place, lines in zip(frame.y(np.array(self.y_ticks.places)), self.y_ticks.texts, strict=True):
            y = place + 2.7 - 0.5 * LINE * (len(lines) - 1)
            yield from lettering.lines(frame.left - 3.0, y, lines, anchor="end")
        yield from self._x_ticks(frame)
        if self.y_ticks.power:
            yield lettering.text(frame.left + 1.0, frame.top - 2.0, self.y_ticks.power)
        middle = 0.5 * (frame.top + frame.bottom)
        yield from lettering.lines(self.left + 7.0, middle, self.y_label, anchor="middle", turned=True)
        below = frame.bottom + self.tick_room
        power_width = lettering.width(self.x_ticks.power) + 3.0 if self.x_ticks.power else 0.0
        farthest = frame.right - power_width - 0.5 * lettering.widest(self.x_label)
        x = min(0.5 * (frame.left + frame.right), farthest)
        yield from lettering.lines(x, below + LINE - 2.4, self.x_label, anchor="middle")
        if self.x_ticks.power:
            yield lettering.text(frame.right, below + LINE - 2.4, self.x_ticks.power, anchor="end")

    def _x_ticks(self, frame: Frame) -> Iterator[str]:
        ticks = self.x_ticks
        for place, lines in zip(frame.x(np.array(ticks.places)), ticks.texts, strict=True):
            if ticks.turned:
                x = place + 2.7 - 0.5 * LINE * (len(lines) - 1)
                yield from lettering.lines(x, frame.bottom + 4.0, lines, anchor="end", turned=True)
            else:
                half = 0.5 * lettering.widest(lines)
                x = min(max(place, self.left + half), self.right - half)
                yield from lettering.lines(x, frame.bottom + LINE, lines, anchor="middle")


class _Scale:
    """The colour scale to the right of a field."""

    def __init__(self, field: Field, height: float):
        self.field = field
        ends = float(field.levels[0]), float(field.levels[-1])
        self.ticks = _ticks(Axis(most=8), ends, height, True)
        self.label = lettering.wrapped(field.label, height, 2)
        self.width = 10.0 + BAR + 4.0 + self.ticks.widest + LINE * len(self.label) + 3.0

    def drawn(self, frame: Frame) -> Iterator[str]:
        left, levels = frame.right + 10.0, self.field.levels
        own = Frame(left, frame.top, left + BAR, frame.bottom, (0.0, 1.0), (float(levels[0]), float(levels[-1])))
        for (low, high), colour in zip(pairwise(own.y(levels).tolist()), self.field.colours, strict=True):
            yield f'<path d="M{left:.1f} {low:.2f}h{BAR}V{high:.2f}h-{BAR}z" fill="{colour}"/>'
        for place, (text,) in zip(own.y(np.array(self.ticks.places)).tolist(), self.ticks.texts, strict=True):
            yield lettering.text(left + BAR + 3.0, place + 2.7, text)
        if self.ticks.power:
            yield lettering.text(left, frame.top - 3.0, self.ticks.power)
        x, y = left + BAR + 3.0 + self.ticks.widest + LINE, 0.5 * (frame.top + frame.bottom)
        yield from lettering.lines(x, y, self.label, anchor="middle", turned=True)


def _equal(x: Ends, y: Ends, width: float, height: float) -> tuple[Ends, Ends]:
    """Axis ranges with one scale for both axes; the range that is too short is extended on both sides."""
    unit = max(abs(x[1] - x[0]) / width, abs(y[1] - y[0]) / height)
    ends = []
    for (low, high), length in ((x, width), (y, height)):
        extra = 0.5 * (unit * length - abs(high - low)) * (1.0 if high >= low else -1.0)
        ends.append((low - extra, high + extra))
    return ends[0], ends[1]
