"""Figures as data: panels of marks.  `screen` and `paper` draw them; this module depends on neither.

A drawing is in the units of its axes.  Sizes and widths are pixels on the screen, and paper scales them.  Colours with
an @ are those of the page.  A mark's `key` is its text in the legend of the figure, which shows equal texts once.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from mc_engine.numbers_in_text import digits_within
from mc_engine.statistics.summary import nearly_equal
from reports.drawing.palette import CIVIDIS, PAPER, blended
from reports.text.numbers import number

MARGIN = 0.04  # of an axis, beyond the marks on it
FIELD_EDGE = "rgba(255,255,255,0.55)"  # between the regions of a field
LONGEST = 4.0  # times its width: a cloud or curve that is longer has an axis of its own scale across
OWN_SCALES = "Each axis has a scale of its own"
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
    """Through x, y : float64[n], interrupted at NaN.  text : in place of the coordinates under the pointer.

    near : whether the axes must reach it.
    """

    x: np.ndarray
    y: np.ndarray
    colour: str
    name: str = ""
    dash: str = "solid"
    width: float = 1.8
    opacity: float = 1.0
    text: str = ""
    near: bool = True
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
    opacity: float = 1.0

    @property
    def colour(self) -> list[str]:
        """The colour between each two levels."""
        n = self.levels.size - 1
        return [blended((k + 0.5) / n, *CIVIDIS) for k in range(n)]

    @property
    def bands(self) -> Iterator[Band]:
        """The region between each two levels, its range as its name."""
        import contourpy

        kind = contourpy.FillType.ChunkCombinedOffset
        generator: Any = contourpy.contour_generator(self.x, self.y, np.ma.masked_invalid(self.z), fill_type=kind)
        for (low, high), colour in zip(pairwise(self.levels.tolist()), self.colour, strict=True):
            (points,), (offsets,) = generator.filled(low, high)
            if points is not None:
                x, y = joined(np.split(points, offsets[1:-1])).T
                digits = digits_within(float(self.levels[0]), float(self.levels[-1]))
                text = f"{self.label}: {number(low, digits)} to {number(high, digits)}"
                yield Band(x, y, colour, self.opacity, text, FIELD_EDGE)


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

    def across(self, ends: tuple[float, float], log: bool) -> Line:
        """The line between the ends of the other axis, with enough places for the pointer to find it."""
        along = np.geomspace(*ends, 9) if log else np.linspace(*ends, 9)
        at = np.full(along.size, self.at)
        x, y = (at, along) if self.axis == "x" else (along, at)
        return Line(x, y, self.colour, self.name, self.dash, self.width, text=self.name)


Stroke = Points | Line | Band | Bar  # what is drawn: the other marks consist of these
Mark = Stroke | Field | Limit
PLACES = {"x": ("x", "left", "right"), "y": ("y", "bottom", "top")}  # members of marks that are numbers of an axis


def values_of(marks: Iterable[Mark], axis: str) -> Iterator[Any]:
    """All numbers of the marks on the axis "x" or "y"."""
    for mark in marks:
        if getattr(mark, "near", True):
            yield from [getattr(mark, place) for place in PLACES[axis] if hasattr(mark, place)]
        if isinstance(mark, Limit) and mark.near and mark.axis == axis:
            yield mark.at


def finite(values: Iterable[Any]) -> np.ndarray:
    """float64[n]: all numbers of these arrays that are finite."""
    every = np.concatenate([np.empty(0), *(np.asarray(part, dtype=np.float64).ravel() for part in values)])
    return every[np.isfinite(every)]


@dataclass(frozen=True)
class Axis:
    """label : beside it.  reach : its ends, in their order.  ticks : places and words of its own ticks.

    whole : ticks at whole numbers only.  Without a margin it ends at the outermost mark.
    """

    label: str = ""
    reach: tuple[float, float] | None = None
    log: bool = False
    ticks: tuple[tuple[float, str], ...] | None = None
    whole: bool = False
    margin: float = MARGIN

    def ends(self, values: Iterable[Any]) -> tuple[float, float]:
        """Both ends of the axis over marks with these values."""
        if self.reach is not None:
            return self.reach
        seen = finite(values)
        seen = np.log10(seen[seen > 0.0]) if self.log else seen
        low, high = (float(seen.min()), float(seen.max())) if seen.size else (0.0, 1.0)
        room = self.margin * (high - low)
        if nearly_equal(low, high):
            room = 0.05 * abs(high) or 1.0
        low, high = low - room, high + room
        return (10.0**low, 10.0 ** min(high, 308.0)) if self.log else (low, high)  # no float64 is larger


def names_axis(names: Sequence[str], label: str = "", *, down: bool = False) -> Axis:
    """An axis with a place for each name; down : an upright one, the first name on top."""
    ends = -0.5, len(names) - 0.5
    return Axis(label, reach=ends[::-1] if down else ends, ticks=tuple(enumerate(names)))


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
        return self.x.ends(values_of(self.marks, "x")), self.y.ends(values_of(self.marks, "y"))

    @property
    def strokes(self) -> Iterator[Stroke]:
        """All that is drawn, from back to front."""
        for mark in self.marks:
            if isinstance(mark, Field):
                yield from mark.bands
            elif isinstance(mark, Limit):
                other, log = (self.ends[1], self.y.log) if mark.axis == "x" else (self.ends[0], self.x.log)
                yield mark.across(other, log)
            else:
                yield mark

    @property
    def names(self) -> tuple[str, str]:
        """What the axes of x and of y measure: the label beside an axis, or above the panel."""
        above = self.title.partition("\n")[0]
        return self.x.label or above, self.y.label or above

    @property
    def words(self) -> str:
        """The alternative text: texts of points and bars if they are few, else its ranges; and its limits."""
        listed = [mark.texts for mark in self.marks if isinstance(mark, Points | Bar) and len(mark.texts) <= MOST_TOLD]
        said = [text for texts in listed for text in texts] or [" against ".join(self._ranges())]
        said += [mark.name for mark in self.marks if isinstance(mark, Limit)]
        title = "" if self.title in ("", *self.names) and not any(listed) else f"{self.title}: "
        return title + "; ".join(filter(None, dict.fromkeys(said)))

    def _ranges(self) -> Iterator[str]:
        """From where to where the marks, and the field in them, reach on the axes of numbers."""
        marks = [mark for mark in self.marks if not isinstance(mark, Limit | Band)]
        told = [(name, values_of(marks, axis)) for name, axis in zip(self.names[::-1], "yx", strict=True)
                if not getattr(self, axis).ticks]  # fmt: skip
        told += [(field.label, iter(field.z)) for field in self.fields]
        for name, values in told:
            if (numbers := finite(values)).size:
                ends = float(numbers.min()), float(numbers.max())
                low, high = (number(end, digits_within(*ends, least=4)) for end in ends)
                yield f"{name} {low} to {high}"

    @property
    def fields(self) -> list[Field]:
        return [mark for mark in self.marks if isinstance(mark, Field)]


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
        """The alternative text of the figure."""
        panels = "; ".join(plot.words for plot in self.plots)
        key = "".join(f"; {mark.key}" for mark in self.key if mark.key not in panels)
        return f"{self.form}. {self.words or panels + key}."

    @property
    def cases(self) -> list[np.ndarray]:
        """Numbers of the cases that are drawn as points."""
        marks = [mark for plot in self.plots for mark in plot.marks]
        return [mark.cases for mark in marks if isinstance(mark, Points) and mark.cases is not None]


def to_scale(plot: Plot, longest: float = LONGEST) -> Plot:
    """The panel with one scale for both axes, as high as that needs; one of a much longer shape keeps two and says so.

    longest : the longer side of the marks over the shorter one, up to which one scale shows both.
    """
    width, height = (abs(high - low) for low, high in plot.ends)
    if max(width, height) > longest * min(width, height):
        return replace(plot, title=OWN_SCALES)
    return replace(plot, equal=True, height=60.0 + 720.0 * min(max(height / width, 0.25), 0.75))


def between(
    x: np.ndarray, low: np.ndarray, high: np.ndarray, colour: str, opacity: float, name: str = "", key: str = "",
    upright: bool = False,
) -> Band:  # fmt: skip
    """The band from `low` to `high` over x, each float64[n]; interrupted at NaN; upright : x along y."""
    good = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
    pieces = np.split(np.arange(x.size), np.flatnonzero(np.diff(good)) + 1)
    rings = [np.column_stack([np.r_[x[k], x[k][::-1]], np.r_[low[k], high[k][::-1]]]) for k in pieces if good[k].any()]
    across, up = joined(rings).T[:: -1 if upright else 1]
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


def nominal_ring(place: Sequence[float] | np.ndarray, colour: str, name: str = "nominal") -> Points:
    """A ring around one point, its inside filled with the colour of the page."""
    x, y = (np.array([value], dtype=np.float64) for value in place)
    return Points(x, y, PAPER, name, size=12.0, edge=colour, edge_width=3.0, key=name)
