"""Curves and surfaces through given points: functions of one number or two, from a file or from arrays.

    THRUST = curve("thrust.csv", x="time_s", y="thrust_n", outside="zero")
    CD = surface("cd.csv", "mach", "alpha_deg", "cd")

and in physics `THRUST(t)`, `CD(mach, alpha)`, in SI and radians: the name of a column ends in its unit.  The points may
have any spacing and are reproduced exactly; nothing is resampled.  The numbers are not part of the machine code, so new
numbers need no compilation.  The range is divided into equal buckets, so that two comparisons, seldom more, find the
points on both sides of an argument (see `_axis`).  A NaN argument gives NaN.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.lanes import physics, where
from mc_engine.lanes.kernel_data import DataBlock, numbers_of, one_at, row_of_four, row_of_two
from mc_engine.lanes.number import Number, result_of
from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.physics.curve_points import (
    array_of,
    columns_of,
    cubic_cells,
    cubic_rows,
    finite_rows,
    grid_of,
    linear_cells,
    linear_rows,
    nearest_cells,
    nearest_rows,
    path_beside_caller,
    previous_cells,
    previous_rows,
    refuse_other_quantity,
    refuse_points,
    turnovers,
)
from mc_engine.physics.vectors import Vector
from mc_engine.suggestions import listed

KINDS = ("linear", "cubic", "nearest", "previous")
OUTSIDE = ("held", "zero", "ends")
_HEADER = 8  # low, high, buckets per unit, last bucket, levels, place of the points, of the buckets, of what follows
_MOST_BUCKETS = 16384  # 512 KB: beyond, a look-up waits for memory longer than for another comparison
_NAN = float("nan")


class Curve(PhysicsFunction):
    """A function through points, of one number (`curve`) or two (`surface`)."""

    def __init__(self, function: Callable[..., Any], block: DataBlock, words: str, kind: str, outside: str):
        super().__init__(function)
        self.block, self.words, self.kind, self.outside = block, words, kind, outside

    def __call__(self, *args: Any) -> Any:
        """The value at the argument(s), interpreted: floats or arrays, SI."""
        wanted = self.function.__code__.co_argcount
        if len(args) != wanted:
            numbers = "one number, x" if wanted == 1 else "two numbers, x and y"
            raise ModelError(f"{self.words} is a function of {numbers}; it was given {len(args)}")
        if Number not in map(type, args):
            return self.function(*args)
        plain = [float(argument) if type(argument) is Number else argument for argument in args]
        is_left = self.outside == "ends" and all(map(math.isfinite, plain))
        return result_of(f"{self.words}, left at its end," if is_left else self.words, args, self.function(*plain))

    def __repr__(self) -> str:
        return f"<{self.words}>"


def curve(
    file: str | None = None,
    x: str | Sequence[float] | np.ndarray = "x",
    y: str | Sequence[float] | np.ndarray = "y",
    *,
    kind: str = "linear",
    outside: str = "held",
    x_unit: str | None = None,
    y_unit: str | None = None,
) -> Curve:
    """A function y(x) through points.

    file : CSV or Parquet, relative to the folder of the calling module; x and y are then names of columns.  Their units
        are x_unit and y_unit, or else the endings of the names.  Without a file, x and y are numbers, in x_unit and
        y_unit, or else in SI.
    x : strictly increasing, at least two points.  All numbers are finite.
    kind : "linear"; "cubic", smooth (continuous slope) and monotone where the points are (PCHIP, F. N. Fritsch and
        J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300-304); "nearest", of two equally near points the lower one;
        "previous", from each point on its value.
    outside : the value outside the points: "held", the first or the last value; "zero"; or "ends": NaN, so that the
        case ends as "not-finite".

    Returns a Curve, called in physics as y(x), in SI.
    Raises ModelError for errors in the file or the points.
    """
    _refuse_unknown(kind, KINDS, "kind")
    _refuse_unknown(outside, OUTSIDE, "outside")
    path = path_beside_caller(file) if file is not None else None
    if path is not None:
        said = {str(x): 'x_unit="{}"'.format, str(y): 'y_unit="{}"'.format}
        read = columns_of(path, {str(x): x_unit, str(y): y_unit}, said)
        xs, ys = read[str(x)], read[str(y)]
    else:
        xs, ys = array_of(x, "x", x_unit), array_of(y, "y", y_unit)
    return _through(xs, ys, kind, outside, path)


def _through(xs: np.ndarray, ys: np.ndarray, kind: str, outside: str, path: Path | None) -> Curve:
    """The curve through points in SI.  path : that they come from."""
    words = f"the curve {path.name}" if path else "the curve"
    refuse_points(words, xs, ys)
    axis = _axis(turnovers(xs) if kind == "nearest" else xs)
    axis[_HEADER - 1] = axis.size
    rows = finite_rows(words, _ROWS[kind], xs, ys)
    block = DataBlock(np.concatenate([axis, rows.ravel()]), path)
    return Curve(_bounded(_AT[kind], block, outside), block, words, kind, outside)


def wind_profile(
    file: str, altitude: str, north: str = "", east: str = "", *, speed: str = "", coming_from: str = "",
    kind: str = "linear", outside: str = "held",
) -> PhysicsFunction:  # fmt: skip
    """wind(h) -> Vector, velocity of the air over the ground [m/s] at altitude h [m]: north, east, down (zero).

    file, kind, outside : as in `curve`; the other arguments are names of columns.  Give either the components north and
    east, or speed and coming_from, the direction that the wind blows from, clockwise from north.  The components are
    interpolated: between 350 and 10 degrees the wind is from the north, with a speed a little below both.
    """
    path = path_beside_caller(file)
    wanted = [name for name in (altitude, north, east, speed, coming_from) if name]
    if len(wanted) != 3 or bool(north) != bool(east):
        raise ModelError("a wind has the columns north and east, or speed and coming_from")
    second = "speed" if north else "angle"
    for name, quantity in zip(wanted, ("length", "speed", second), strict=True):
        refuse_other_quantity(path, name, quantity)
    by_name = dict.fromkeys(wanted, lambda unit: "by another name" if unit else "its unit at its end, or one word,")
    h, *pair = (columns_of(path, dict.fromkeys(wanted), by_name)[name] for name in wanted)
    components = pair if north else [-pair[0] * np.cos(pair[1]), -pair[0] * np.sin(pair[1])]
    to_north, to_east = (_through(h, component, kind, outside, path) for component in components)

    @physics
    def wind(h):
        return Vector(to_north(h), to_east(h), 0.0)

    return wind


def surface(
    file: str | None = None,
    x: str | Sequence[float] | np.ndarray = "x",
    y: str | Sequence[float] | np.ndarray = "y",
    z: str | np.ndarray = "z",
    *,
    kind: str = "linear",
    outside: str = "held",
    units: dict[str, str] | None = None,
) -> Curve:
    """A function z(x, y) through the points of a grid, called in physics in SI.

    file : CSV or Parquet as in `curve`, one row for each point of the grid, in any order.
    units : units of columns whose names do not end in one, by column.
    Without a file, x and y are increasing numbers and z is float64[n_x, n_y], in SI or in the `units` of "x", "y", "z".
    kind : "linear" in each direction (bilinear); "cubic" in each (bicubic), smooth (continuous slopes), and along the
        lines of the grid the cubic curve through their points; "nearest"; or "previous".
    outside : as in `curve`.
    """
    _refuse_unknown(kind, KINDS, "kind")
    _refuse_unknown(outside, OUTSIDE, "outside")
    path = path_beside_caller(file) if file is not None else None
    words = f"the surface {file or ''}".rstrip()
    given = {} if units is None else units
    if not isinstance(given, Mapping):
        raise ModelError(f'{words}: units is a dict of a unit for each name, such as {{"x": "km"}}, not {units!r}')
    named = (str(x), str(y), str(z)) if path is not None else ("x", "y", "z")
    for name in given.keys() - set(named):
        raise ModelError(f'{words}: units has "{name}"; its numbers are {listed(named)}')
    if path is not None:
        said = {name: partial(_in_units, name) for name in named}
        read = columns_of(path, {name: given.get(name) for name in named}, said)
        xs, ys, zs = grid_of(words, *(read[name] for name in named))
    else:
        xs, ys = array_of(x, "x", given.get("x")), array_of(y, "y", given.get("y"))
        zs = array_of(z, "z", given.get("z"), dimensions=2)
    refuse_points(words, xs, zs)
    refuse_points(words, ys, zs.T)
    first, second = (_axis(turnovers(points) if kind == "nearest" else points) for points in (xs, ys))
    first[_HEADER - 1] = first.size
    second[_HEADER - 1] = first.size + second.size
    second[5:7] += first.size
    cells = finite_rows(words, _CELLS[kind], xs, ys, zs)
    block = DataBlock(np.concatenate([first, second, [cells.shape[1], 0.0, 0.0, 0.0], cells.ravel()]), path)
    return Curve(_bounded_surface(_ON[kind], block, outside), block, words, kind, outside)


def _in_units(name: str, unit: str) -> str:
    return f'units={{"{name}": "{unit}"}}'


# ---- points and the buckets that they are found by


def _axis(points: np.ndarray) -> np.ndarray:
    """Header, buckets and points of one argument; the place of what follows is left open.

    A bucket is (number of a point at or before it, that point, the two after it).  Buckets are numbered by the same
    operations as in a look-up, which keep the order with any rounding: a point of an earlier bucket is before all
    arguments of this one.  So an argument is compared only with the points of its own bucket, with two of them by
    their values in the bucket.  If a bucket has more points, up to 2**levels - 1, they are bisected.
    """
    low, high, n = points[0], points[-1], points.size
    buckets = n - 1
    while True:
        scale = buckets / (high - low)
        own = np.minimum(np.maximum(np.floor((points - low) * scale), 0.0), buckets - 1.0)
        held = np.bincount(own[1:].astype(int), minlength=buckets)
        if held.max() <= 2 or 2 * buckets > max(_MOST_BUCKETS, 4 * n):
            break
        buckets *= 2
    levels = int(held.max()).bit_length() if held.max() > 2 else 0
    start = np.concatenate([[0], np.cumsum(held)[:-1]])
    padded = np.concatenate([points, np.full(2 ** (levels + 1), np.inf)])
    table = np.column_stack([start, padded[start], padded[start + 1], padded[start + 2]])
    first = _HEADER + table.size
    header = [low, high, scale, buckets - 1.0, levels, first, _HEADER, 0.0]
    return np.concatenate([header, table.ravel(), padded])


@physics
def _segment(numbers, at, x):
    """(number of the point at or before x, distance from it to x, whether x is outside); outside, x is held.

    at : index of the axis.  For a NaN x the distance is NaN, but the number of the point is valid.
    """
    low, high, scale, last = row_of_four(numbers, at, 0)
    levels, points, buckets, _ = row_of_four(numbers, at, 1)
    outside = (x < low) | (x > high)
    x = where(x < low, low, where(x > high, high, x))
    bucket = (x - low) * scale
    # in this order what is not a number becomes the first bucket
    bucket = where(bucket > 0.0, bucket, 0.0)
    bucket = where(bucket < last, bucket, last)
    point, here, next_point, second = row_of_four(numbers, buckets, bucket)
    if levels > 0.0:
        point, here = _bisected(numbers, points, levels, point, here, x)
    else:
        passed, passed_both = x >= next_point, x >= second
        point = where(passed_both, point + 2.0, where(passed, point + 1.0, point))
        here = where(passed_both, second, where(passed, next_point, here))
    return point, x - here, outside


@physics
def _bisected(numbers, points, levels, point, here, x):
    """The last of the next 2**levels - 1 points that x has passed: (its number, the point)."""
    size = 1.0
    for _ in range(int(levels) - 1):
        size = size * 2.0
    for _ in range(int(levels)):
        ahead = one_at(numbers, points + point + size)
        passed = x >= ahead
        point, here = where(passed, point + size, point), where(passed, ahead, here)
        size = size * 0.5
    return point, here


# ---- what is between the points


@physics
def _linear(numbers, x):
    point, way, outside = _segment(numbers, 0.0, x)
    y, slope = row_of_two(numbers, one_at(numbers, 7), point)
    return y + way * slope, outside


@physics
def _cubic(numbers, x):
    point, way, outside = _segment(numbers, 0.0, x)
    y, c1, c2, c3 = row_of_four(numbers, one_at(numbers, 7), point)
    return y + way * (c1 + way * (c2 + way * c3)), outside


@physics
def _constant(numbers, x):
    point, way, outside = _segment(numbers, 0.0, x)
    y, _ = row_of_two(numbers, one_at(numbers, 7), point)
    return where(way == way, y, way), outside


_ROWS = {"linear": linear_rows, "cubic": cubic_rows, "nearest": nearest_rows, "previous": previous_rows}
_AT = {"linear": _linear, "cubic": _cubic, "nearest": _constant, "previous": _constant}


@physics
def _cell(numbers, x, y):
    """(first place, number of the cell, ways from its corner, whether the place is outside)."""
    i, way_x, outside_x = _segment(numbers, 0.0, x)
    j, way_y, outside_y = _segment(numbers, one_at(numbers, 7), y)
    first = one_at(numbers, one_at(numbers, 7) + 7.0)
    return first + 4.0, i * one_at(numbers, first) + j, way_x, way_y, outside_x | outside_y


@physics
def _bilinear(numbers, x, y):
    first, cell, way_x, way_y, outside = _cell(numbers, x, y)
    z, along_x, along_y, both = row_of_four(numbers, first, cell)
    return z + way_x * along_x + way_y * (along_y + way_x * both), outside


@physics
def _constant_on_grid(numbers, x, y):
    first, cell, way_x, way_y, outside = _cell(numbers, x, y)
    way = way_x + way_y
    return where(way == way, one_at(numbers, first + cell), way), outside


@physics
def _bicubic(numbers, x, y):
    first, cell, way_x, way_y, outside = _cell(numbers, x, y)
    c0 = _cubic_along_y(numbers, first, 4.0 * cell, way_y)
    c1 = _cubic_along_y(numbers, first, 4.0 * cell + 1.0, way_y)
    c2 = _cubic_along_y(numbers, first, 4.0 * cell + 2.0, way_y)
    c3 = _cubic_along_y(numbers, first, 4.0 * cell + 3.0, way_y)
    return c0 + way_x * (c1 + way_x * (c2 + way_x * c3)), outside


@physics
def _cubic_along_y(numbers, first, row, way):
    """The coefficient of a power of the way along x."""
    c0, c1, c2, c3 = row_of_four(numbers, first, row)
    return c0 + way * (c1 + way * (c2 + way * c3))


_CELLS = {"linear": linear_cells, "cubic": cubic_cells, "nearest": nearest_cells, "previous": previous_cells}
_ON = {"linear": _bilinear, "cubic": _bicubic, "nearest": _constant_on_grid, "previous": _constant_on_grid}


# ---- functions that physics calls


def _bounded(at: Any, block: DataBlock, outside: str) -> Callable[..., Any]:
    """The function of x on a block, with what is declared outside of its points."""
    if outside == "held":

        def value(x):
            return at(numbers_of(block), x)[0]

        return value
    beyond = 0.0 if outside == "zero" else _NAN

    def value_inside(x):
        y, is_outside = at(numbers_of(block), x)
        return where(is_outside, beyond, y)

    return value_inside


def _bounded_surface(on: Any, block: DataBlock, outside: str) -> Callable[..., Any]:
    """The same of x and y."""
    if outside == "held":

        def value(x, y):
            return on(numbers_of(block), x, y)[0]

        return value
    beyond = 0.0 if outside == "zero" else _NAN

    def value_inside(x, y):
        z, is_outside = on(numbers_of(block), x, y)
        # a value that is none stays none, also where the other argument is outside
        return where(is_outside & (z == z), beyond, z)

    return value_inside


def _refuse_unknown(value: str, known: Sequence[str], name: str) -> None:
    if value not in known:
        raise ModelError(f'{name} "{value}" is not known; write one of {", ".join(known)}')
