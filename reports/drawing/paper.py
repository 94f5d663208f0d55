"""Figures for PDF and Markdown: panels of marks laid out on the width of the page as SVG with searchable text.

All lengths are points.  The typesetter sets the text in the typeface of the page; `lettering` knows how wide it gets.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from reports.drawing import lettering
from reports.drawing.marks import Axis, Drawing, Field, Key, Plot
from reports.drawing.palette import GRID, field_colour, on_paper
from reports.drawing.strokes import DASHES, Frame, signs, stroked
from reports.drawing.ticks import log_numerals, log_ticks, nice_ticks, numerals

WIDTH = 493.2  # 174 mm, the text width of the page
TYPE, LINE = 7.5, 9.4  # size and distance of lines
SHORT = 0.46  # points of height on paper for a pixel on the screen
GAP = 14.0  # between panels
SWATCH = 17.0
BAR = 9.0  # width of a colour scale
FILLED = {"bar": 0.6, "field": 0.6, "band": 0.3}
AXIS = "#555b61"
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
    return (
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


def _key(key: tuple[Key, ...], whole: float) -> tuple[list[str], float]:
    """SVG elements of the key, and the y of its lower edge."""
    elements, x, y = [], 0.0, LINE
    for entry in key:
        lines = lettering.wrapped(entry.text, whole - SWATCH - 4.0, TYPE)
        long = max(lettering.width(line, TYPE) for line in lines)
        if x and x + SWATCH + long > whole:
            x, y = 0.0, y + LINE + 1.0
        elements += [
            *_swatch(entry, x, y - 2.6),
            *(lettering.text(x + SWATCH, y + LINE * k, line) for k, line in enumerate(lines)),
        ]
        y += LINE * (len(lines) - 1)
        x += SWATCH + long + 12.0
    return elements, y + 7.0 if key else 0.0


def _swatch(entry: Key, x: float, y: float) -> Iterator[str]:
    colour = on_paper(entry.colour)
    if entry.mark in FILLED:
        yield f'<path d="M{x:.1f} {y - 3:.1f}h13v6h-13z" fill="{colour}" fill-opacity="{FILLED[entry.mark]}"/>'
    elif entry.mark in ("point", "ring"):
        sign = "ring" if entry.mark == "ring" else entry.sign
        yield from signs([(round(x + 6.5, 1), round(y, 1))], sign, 2.6 if sign == "circle" else 5.0, colour)
    else:
        dash = DASHES[{"line": "solid"}.get(entry.mark, entry.mark)]
        yield f'<path d="M{x:.1f} {y:.1f}h13" stroke="{colour}" stroke-width="1.2"{dash}/>'


@dataclass(frozen=True)
class _Ticks:
    places: list[float]
    texts: list[list[str]]
    power: str = ""
    turned: bool = False

    @property
    def widest(self) -> float:
        return max((lettering.width(line, TYPE) for text in self.texts for line in text), default=0.0)

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
        texts = [lettering.wrapped(text, wrap, TYPE, 4) for _, text in own]
        wrapped = _Ticks([place for place, _ in own], texts)
        if upright or wrapped.widest <= slot:
            return wrapped
        return _Ticks(wrapped.places, [lettering.wrapped(text, 90.0, TYPE, 2) for _, text in own], turned=True)
    for most in range(axis.most, 0, -1):
        places = log_ticks(*ends, most) if axis.log else nice_ticks(*ends, most, axis.whole)
        words, power = (log_numerals(places), "") if axis.log else numerals(places)
        needed = sum(2.2 * TYPE if upright else lettering.width(text, TYPE) + 9.0 for text in words)
        if needed <= room or most == 1:
            break
    return _Ticks(places, [[text] for text in words], power)


class _Box:
    """One panel: computes the space that its texts take, then draws itself."""

    def __init__(self, plot: Plot, left: float, top: float, width: float):
        self.plot, self.left, self.top, self.right = plot, left, top, left + width
        height = SHORT * plot.height
        x_ends, y_ends = plot.ends
        self.y_ticks = _ticks(plot.y, y_ends, height, True)
        self.y_label = lettering.wrapped(plot.y.label, height + 12.0, TYPE, 2) if plot.y.label else []
        scale = _Scale(plot.field, height) if plot.field else None
        self.scale = scale
        self.frame_left = left + self.y_ticks.widest + 5.0 + LINE * len(self.y_label)
        self.frame_right = self.right - (scale.width if scale else 5.0)
        room = self.frame_right - self.frame_left
        self.x_ticks = _ticks(plot.x, x_ends, room, False)
        self.title = lettering.wrapped(plot.title, width - 4.0, TYPE, 3) if plot.title else []
        self.x_label = lettering.wrapped(plot.x.label, room - 2.0 * lettering.width(self.x_ticks.power, TYPE), TYPE, 2)
        self.ends = _equal(x_ends, y_ends, room, height) if plot.equal else (x_ends, y_ends)
        if plot.equal:
            self.x_ticks, self.y_ticks = (
                _ticks(plot.x, self.ends[0], room, False),
                _ticks(plot.y, self.ends[1], height, True),
            )

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
        yield f'<path d="{"".join(lines)}" stroke="{on_paper(GRID)}" stroke-width=".5"/>' if lines else ""

    def _axes(self, frame: Frame) -> Iterator[str]:
        corner = f"M{frame.left:.2f} {frame.top:.2f}V{frame.bottom:.2f}H{frame.right:.2f}"
        yield f'<path d="{corner}" stroke="{AXIS}" stroke-width=".6"/>'
        for place, lines in zip(frame.y(np.array(self.y_ticks.places)), self.y_ticks.texts, strict=True):
            for k, line in enumerate(lines):
                y = place + 2.7 + LINE * (k - 0.5 * (len(lines) - 1))
                yield lettering.text(frame.left - 3.0, y, line, anchor="end")
        yield from self._x_ticks(frame)
        if self.y_ticks.power:
            yield lettering.text(frame.left + 1.0, frame.top - 2.0, self.y_ticks.power)
        middle = 0.5 * (frame.top + frame.bottom)
        for k, line in enumerate(self.y_label):
            yield lettering.text(self.left + 7.0 + LINE * k, middle, line, anchor="middle", turned=True)
        below = frame.bottom + self.tick_room
        power_width = lettering.width(self.x_ticks.power, TYPE) + 3.0 if self.x_ticks.power else 0.0
        for k, line in enumerate(self.x_label):
            farthest = frame.right - power_width - 0.5 * lettering.width(line, TYPE)
            x = min(0.5 * (frame.left + frame.right), farthest)
            yield lettering.text(x, below + LINE * (k + 1) - 2.4, line, anchor="middle")
        if self.x_ticks.power:
            yield lettering.text(frame.right, below + LINE - 2.4, self.x_ticks.power, anchor="end")

    def _x_ticks(self, frame: Frame) -> Iterator[str]:
        ticks = self.x_ticks
        for place, lines in zip(frame.x(np.array(ticks.places)), ticks.texts, strict=True):
            for k, line in enumerate(lines):
                if ticks.turned:
                    x = place + 2.7 + LINE * (k - 0.5 * (len(lines) - 1))
                    yield lettering.text(x, frame.bottom + 4.0, line, anchor="end", turned=True)
                    continue
                half = 0.5 * lettering.width(line, TYPE)
                x, y = min(max(place, self.left + half), self.right - half), frame.bottom + LINE * (k + 1)
                yield lettering.text(x, y, line, anchor="middle")


class _Scale:
    """The colour scale to the right of a field."""

    def __init__(self, field: Field, height: float):
        self.field = field
        ends = float(field.levels[0]), float(field.levels[-1])
        self.ticks = _ticks(Axis(most=8), ends, height, True)
        self.label = lettering.wrapped(field.label, height, TYPE, 2)
        self.width = 10.0 + BAR + 4.0 + self.ticks.widest + LINE * len(self.label) + 3.0

    def drawn(self, frame: Frame) -> Iterator[str]:
        left, levels = frame.right + 10.0, self.field.levels
        own = Frame(left, frame.top, left + BAR, frame.bottom, (0.0, 1.0), (float(levels[0]), float(levels[-1])))
        edges = own.y(levels).tolist()
        for k, (low, high) in enumerate(pairwise(edges)):
            colour = field_colour((k + 0.5) / (len(edges) - 1))
            yield f'<path d="M{left:.1f} {low:.2f}h{BAR}V{high:.2f}h-{BAR}z" fill="{colour}"/>'
        for place, (text,) in zip(own.y(np.array(self.ticks.places)).tolist(), self.ticks.texts, strict=True):
            yield lettering.text(left + BAR + 3.0, place + 2.7, text)
        if self.ticks.power:
            yield lettering.text(left, frame.top - 3.0, self.ticks.power)
        for k, line in enumerate(self.label):
            x = left + BAR + 3.0 + self.ticks.widest + LINE * (k + 1)
            yield lettering.text(x, 0.5 * (frame.top + frame.bottom), line, anchor="middle", turned=True)


def _equal(x: Ends, y: Ends, width: float, height: float) -> tuple[Ends, Ends]:
    """Axis ranges with one scale for both axes; the range that is too short is extended on both sides."""
    unit = max(abs(x[1] - x[0]) / width, abs(y[1] - y[0]) / height)
    ends = []
    for (low, high), length in ((x, width), (y, height)):
        extra = 0.5 * (unit * length - abs(high - low)) * (1.0 if high >= low else -1.0)
        ends.append((low - extra, high + extra))
    return ends[0], ends[1]
