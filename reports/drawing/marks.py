"""What figures are made of: panels of marks.  `screen` and `paper` draw them; this module depends on neither.

A drawing says once what is to be seen, in the units of its axes; sizes and widths are pixels on the screen, and paper
scales them.  Colours with an @ are the page's own.  A mark's `key` is its text in the figure's key, said once.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from reports.drawing.palette import CIVIDIS, PAPER, blended
from reports.text.numbers import number

MARGIN = 0.04  # of an axis, beyond the marks on it
FIELD_EDGE = "rgba(255,255,255,0.55)"  # between the regions of a field
MOST_TOLD = 8  # texts of a mark that are told to those who do not see it


@dataclass(frozen=True)
class Points:
    """x, y : float64[n].  sign : "circle", "diamond", "x", "square", "triangle-up", "cross" or "star".

    name : of them all.  texts : of each of them, in place of its coordinates.  edge : colour of their edge, if any.
    cases : their case numbers, so that a reader can choose them; columns : names of the columns of cases that x and y
    are, and of one that `texts` tell, so that a page with all cases finds those that are not drawn; of x alone where y
    is the rank.
    """

    x: np.ndarray
    y: np.ndarray
    colour: str
    name: str = ""
    sign: str = "circle"
    size: float = 4.0
    opacity: float = 1.0
    edge: str = ""
    edge_width: float = 0.4
    texts: Sequence[str] = ()
    cases: np.ndarray | None = None
    columns: tuple[str, ...] | None = None
    key: str = ""


@dataclass(frozen=True)
class Line:
    """Through x, y : float64[n], interrupted at NaN.  text : in place of the coordinates under the pointer."""

    x: np.ndarray
    y: np.ndarray
    colour: str
    name: str = ""
    dash: str = "solid"
    width: float = 1.8
    opacity: float = 1.0
    text: str = ""
    key: str = ""


@dataclass(frozen=True)
class Band:
    """A filled region: closed outlines in x, y : float64[n], separated by NaN; holes run the other way round."""

    x: np.ndarray
    y: np.ndarray
    colour: str
    opacity: float = 0.3
    name: str = ""
    edge: str = ""
    key: str = ""


@dataclass(frozen=True)
class Bar:
    """Boxes from (left, bottom) to (right, top), each float64[n]; colour : one for all, or one each.

    texts : of each box, for the pointer; labels : written in it, in `ink`, one for all or one each.
    column : of the cases that the boxes count, from left to right.
    """

    left: np.ndarray
    right: np.ndarray
    bottom: np.ndarray
    top: np.ndarray
    colour: str | Sequence[str]
    opacity: float = 0.6
    texts: Sequence[str] = ()
    labels: Sequence[str] = ()
    ink: str | Sequence[str] = "@ink"
    key: str = ""
    column: str = ""


@dataclass(frozen=True)
class Field:
    """Filled contours of z : float64[n_y, n_x] at the nodes x, y, blank where it is not a number.  label : of z."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    levels: np.ndarray
    label: str
    key: str = ""

    @property
    def colours(self) -> list[str]:
        """The colour between each two levels."""
        n = self.levels.size - 1
        return [blended((k + 0.5) / n, *CIVIDIS) for k in range(n)]

    @property
    def bands(self) -> Iterator[Band]:
        """The region between each two levels, its range as its name."""
        import contourpy

        generator: Any = contourpy.contour_generator(
            self.x, self.y, np.ma.masked_invalid(self.z), fill_type=contourpy.FillType.OuterOffset
        )
        for (low, high), colour in zip(pairwise(self.levels.tolist()), self.colours, strict=True):
            points, offsets = generator.filled(low, high)
            rings = [p[a:b] for p, o in zip(points, offsets, strict=True) for a, b in pairwise(o)]
            if rings:
                x, y = joined(rings).T
                yield Band(x, y, colour, 1.0, f"{self.label}: {number(low)} to {number(high)}", FIELD_EDGE)


@dataclass(frozen=True)
class Limit:
    """A straight line across the panel where x, or y, is `at`; `near` : whether the axis must reach it."""

    at: float
    axis: str
    colour: str
    name: str = ""
    dash: str = "solid"
    width: float = 1.8
    near: bool = True
    key: str = ""

    def across(self, x_ends: tuple[float, float], y_ends: tuple[float, float], log: bool = False) -> Line:
        """The line between the ends of the other axis, with enough places for the pointer to find it."""
        other = y_ends if self.axis == "x" else x_ends
        along = np.geomspace(*other, 9) if log else np.linspace(*other, 9)
        at = np.full(along.size, self.at)
        x, y = (at, along) if self.axis == "x" else (along, at)
        return Line(x, y, self.colour, self.name, self.dash, self.width, text=self.name)


Mark = Points | Line | Band | Bar | Field | Limit
_ACROSS = ("x", "left", "right")  # members of marks that are places on the axis of x, and on that of y
_UP = ("y", "bottom", "top")


def extent(mark: Mark) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """All numbers of a mark on either axis."""
    if isinstance(mark, Limit):
        at = [np.array([mark.at])] if mark.near else []
        return (at, []) if mark.axis == "x" else ([], at)
    x, y = ([getattr(mark, name) for name in names if hasattr(mark, name)] for names in (_ACROSS, _UP))
    return x, y


def finite(values: Iterable[Any]) -> np.ndarray:
    """float64[n]: all numbers of these arrays that are finite."""
    every = np.concatenate([np.empty(0), *(np.asarray(part, dtype=np.float64).ravel() for part in values)])
    return every[np.isfinite(every)]


def _range(label: str, values: Iterable[Any]) -> str:
    """From where to where the finite ones of these numbers reach, in words."""
    numbers = finite(values)
    return f"{label} {number(numbers.min(), 4)} to {number(numbers.max(), 4)}" if numbers.size else ""


@dataclass(frozen=True)
class Axis:
    """label : beside it; name : what it measures, where there is no label.  reach : its ends, in their order.

    ticks : places and words of its own ticks; most : of other ones; whole : at whole numbers only; zero : reaches 0.
    Without a margin it ends at the outermost mark.
    """

    label: str = ""
    name: str = ""
    reach: tuple[float, float] | None = None
    log: bool = False
    ticks: tuple[tuple[float, str], ...] | None = None
    most: int = 6
    whole: bool = False
    zero: bool = False
    grid: bool = True
    margin: float = MARGIN

    def ends(self, values: Iterable[np.ndarray]) -> tuple[float, float]:
        """Both ends of the axis over marks with these values."""
        if self.reach is not None:
            return self.reach
        seen = finite([*values, np.zeros(int(self.zero))])
        seen = seen[seen > 0.0] if self.log else seen
        if not seen.size:
            return (1.0, 10.0) if self.log else (0.0, 1.0)
        low, high = float(seen.min()), float(seen.max())
        if self.log:
            room = (high / low) ** self.margin if high > low else 1.5
            return low / room, high * room
        room = self.margin * (high - low)
        if high - low <= 1e-12 * max(abs(low), abs(high)):
            room = 0.05 * abs(high) or 1.0
        return low - (0.0 if self.zero and low == 0.0 else room), high + (0.0 if self.zero and high == 0.0 else room)


def names_axis(names: Sequence[str], label: str = "", *, down: bool = False, grid: bool = False) -> Axis:
    """An axis with a place for each name; down : an upright one, the first name on top."""
    ends = -0.5, len(names) - 0.5
    return Axis(label, reach=ends[::-1] if down else ends, ticks=tuple(enumerate(names)), grid=grid)


@dataclass(frozen=True)
class Plot:
    """Marks from back to front over two axes; height : pixels on the screen; equal : one scale for both axes.

    quantity : the name of the history quantity that it shows, if it shows one.
    """

    marks: tuple[Mark, ...]
    x: Axis
    y: Axis
    title: str = ""
    height: float = 270.0
    equal: bool = False
    quantity: str = ""

    @cached_property
    def ends(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Ends of both axes."""
        extents = [extent(mark) for mark in self.marks]
        return self.x.ends(a for x, _ in extents for a in x), self.y.ends(a for _, y in extents for a in y)

    @property
    def words(self) -> str:
        """What it shows, for those who do not see it: texts of few points and bars, else its ranges, and its limits."""
        listed = [mark.texts for mark in self.marks if isinstance(mark, Points | Bar) and len(mark.texts) <= MOST_TOLD]
        said = [text for texts in listed for text in texts] or [self._ranges()]
        said += [mark.name for mark in self.marks if isinstance(mark, Limit)]
        title = f"{self.title}: " if self.title not in ("", self.y.name) else ""
        return title + "; ".join(filter(None, dict.fromkeys(said)))

    def _ranges(self) -> str:
        """What the marks reach over on both axes, and the field in them."""
        extents = [extent(mark) for mark in self.marks if not isinstance(mark, Limit | Band)]
        x, y = ([part for both in extents for part in both[k]] for k in (0, 1))
        told = [_range(axis.name or axis.label, values) for axis, values in ((self.y, y), (self.x, x))]
        over = _range(self.field.label, [self.field.z]) if self.field else ""
        return ", ".join(filter(None, (" against ".join(filter(None, told)), over)))

    @property
    def field(self) -> Field | None:
        return next((mark for mark in self.marks if isinstance(mark, Field)), None)


@dataclass(frozen=True)
class Drawing:
    """A figure.  form : its kind, for those who do not see it; plots : its panels in reading order.

    across : most panels in a row on paper;  words : all of it, in place of those of its panels.
    places : numbers of cases that only this figure has, as columns of its points: by name, a label, cases and values.
    """

    form: str
    plots: tuple[Plot, ...]
    across: int = 2
    words: str = ""
    places: Mapping[str, tuple[str, np.ndarray, np.ndarray]] = field(default_factory=dict)

    @cached_property
    def key(self) -> tuple[Mark, ...]:
        """A mark of each meaning, in the order of the panels."""
        return tuple({mark.key: mark for plot in self.plots for mark in plot.marks if mark.key}.values())

    @property
    def alternative(self) -> str:
        """The figure in words, for those who do not see it."""
        panels = "; ".join(plot.words for plot in self.plots)
        key = "".join(f"; {mark.key}" for mark in self.key if mark.key not in panels)
        return f"{self.form}. {self.words or panels + key}."

    @property
    def cases(self) -> list[np.ndarray]:
        """Numbers of the cases that are drawn as points."""
        marks = [mark for plot in self.plots for mark in plot.marks]
        return [mark.cases for mark in marks if isinstance(mark, Points) and mark.cases is not None]


def between(
    x: np.ndarray, low: np.ndarray, high: np.ndarray, colour: str, opacity: float, name: str = "", key: str = ""
) -> Band:
    """The band from `low` to `high` over x, each float64[n]; in pieces where they are not numbers."""
    good = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
    pieces = np.split(np.arange(x.size), np.flatnonzero(np.diff(good)) + 1)
    rings = [np.column_stack([np.r_[x[k], x[k][::-1]], np.r_[low[k], high[k][::-1]]]) for k in pieces if good[k].any()]
    across, up = joined(rings).T
    return Band(across, up, colour, opacity, name, key=key)


def intervals(
    low: np.ndarray, high: np.ndarray, at: np.ndarray, colour: str, key: str = "", upright: bool = False
) -> Line:
    """A line from each low to its high, at these places of the other axis; upright : along y."""
    along, across = np.ravel(np.column_stack([low, high, np.full(low.size, np.nan)])), np.repeat(at, 3)
    x, y = (across, along) if upright else (along, across)
    return Line(x, y, colour, "interval", width=2.2, text=key or "interval", key=key)


def stepped(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The corners of a line through the points that goes along x, then along y."""
    return np.repeat(x, 2)[1:], np.repeat(y, 2)[:-1]


def joined(outlines: Sequence[np.ndarray]) -> np.ndarray:
    """Curves float64[k, 2] in one array, separated by rows of NaN, at which a line is interrupted."""
    parts = [part for outline in outlines for part in (outline, np.full((1, 2), np.nan))]
    return np.concatenate([np.empty((0, 2)), *parts[:-1]])


def nominal_ring(place: tuple[float, float], colour: str, name: str = "nominal") -> Points:
    """A ring around one point, its inside filled with the colour of the page."""
    x, y = (np.array([value], dtype=np.float64) for value in place)
    return Points(x, y, PAPER, name, size=12.0, edge=colour, edge_width=3.0, key=name)
