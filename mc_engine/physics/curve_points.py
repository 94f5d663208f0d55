"""Points of curves and surfaces: read from a CSV or Parquet file, converted to SI by the units of its columns, checked,
and arranged for the look-up: a row of numbers for each point, or for each cell of a grid."""

import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.numbers_in_text import counted
from mc_engine.suggestions import hint
from mc_engine.units import UNITS, unit_hint, unit_of, units_meant

LARGEST = 1e300  # of the arguments
NARROWEST = 1e-300  # range of the arguments


def columns_of(
    path: Path, wanted: Mapping[str, str | None], said: Mapping[str, Callable[[str], str]]
) -> dict[str, np.ndarray]:
    """float64[n_rows], SI, of each wanted column.

    wanted : names of columns, each with its unit, or with None: then the ending of its name is the unit, such as _km_s,
        and a single word, such as mach, is a plain number.
    said : for error messages, by column, how a user states a unit.
    Raises ModelError where the file, a column, a unit or a number is missing; FileNotFoundError as `open` does.
    """
    columns = _parquet(path) if path.suffix == ".parquet" else _csv(path)
    for name in wanted:
        if name not in columns:
            raise ModelError(f'{path.name} has no column "{name}"{hint(name, columns)}')
    try:
        return {name: columns[name] * si_factor(name, unit, said[name]) for name, unit in wanted.items()}
    except ModelError as error:
        raise ModelError(f"{path.name}: {error}") from None


def si_factor(name: str, unit: str | None = None, said: Callable[[str], str] = str) -> float:
    """SI value of one unit of a column.

    unit : by default the ending of the name, of which the longest counts.  A single word, such as mach, has no unit.
    said : for error messages, how a user states a unit.
    Raises ModelError for an unknown unit, and if a name of several words ends in no unit or its ending fits two units.
    """
    if unit is not None:
        if unit not in UNITS:
            raise ModelError(f'"{unit}" is not a unit{unit_hint(str(unit))}')
        return UNITS[unit].factor
    if name.isalnum():  # mach, cd
        return 1.0
    factors = {UNITS[meant].factor for meant in units_meant(name)}
    return factors.pop() if len(factors) == 1 else UNITS[unit_of(name, said)].factor


def refuse_other_quantity(path: Path, name: str, quantity: str) -> None:
    """ModelError for a column whose name ends in a unit of another quantity; a single word has no unit."""
    units = [] if name.isalnum() else units_meant(name)
    if units and quantity not in {UNITS[unit].quantity for unit in units}:
        raise ModelError(f'{path.name}: "{name}" ends in {units[0]}, no unit of {quantity}; see `mc-engine units`')


def _csv(path: Path) -> dict[str, np.ndarray]:
    """Columns by the names in the first line; lines that are empty or begin with # count for nothing."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ModelError(f"{path.name} is no text in UTF-8; save it as CSV in UTF-8") from None
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip() and line[0] != "#"]
    if not lines:
        raise ModelError(f"{path.name} is empty")
    names = [name.strip().strip('"') for name in lines[0][1].split(",")]
    if twice := [name for name in names if names.count(name) > 1]:
        raise ModelError(f'{path.name} has two columns "{twice[0]}"; give each a name of its own')
    rows = []
    for number, line in lines[1:]:
        cells = line.split(",")
        if len(cells) != len(names):
            raise ModelError(f"{path.name}, line {number}: {counted(len(cells), 'number')} for {len(names)} columns")
        try:
            rows.append([float(cell) for cell in cells])
        except ValueError:
            raise ModelError(
                f'{path.name}, line {number}: "{line.strip()}" are not all numbers; write one for each column, with '
                "commas between"
            ) from None
    return dict(zip(names, np.array(rows).reshape(-1, len(names)).T, strict=True))


def _parquet(path: Path) -> dict[str, np.ndarray]:
    from pyarrow import ArrowInvalid, parquet

    with path.open("rb") as file:
        try:
            table = parquet.read_table(file)
        except ArrowInvalid:
            raise ModelError(f"{path.name} is no Parquet file") from None
    numbers = [name for name in table.column_names if str(table[name].type) in _NUMBERS]
    return {name: table[name].to_numpy().astype(np.float64) for name in numbers}


_NUMBERS = {"double", "float", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))}


def path_beside_caller(file: object) -> Path:
    """Path of a file that is named from the folder of the module that calls the function that calls this one.

    ModelError for a folder, and for what is no name, such as points without the names of their arguments.
    """
    if not isinstance(file, str | os.PathLike):
        what = type(file).__name__
        raise ModelError(f"the first argument is the name of a file, and {what} is none; give points as x=..., y=...")
    caller = sys._getframe(2).f_globals.get("__file__")
    path = (Path(caller).parent if caller else Path.cwd()) / file
    if path.is_dir():
        raise ModelError(f'"{file}" is a folder; name a CSV or Parquet file')
    return path


def array_of(values: Any, name: str, unit: str | None = None, dimensions: int = 1) -> np.ndarray:
    """The numbers of an argument, in SI.  unit : of the numbers given, None for SI.

    Raises ModelError for the name of a column without a file, and for anything but numbers with these dimensions.
    """
    if isinstance(values, str):
        raise ModelError(f'"{values}" is a column, but there is no file; give {name} as numbers')
    try:
        given = np.asarray(values)
        numbers = given.astype(np.float64) if given.dtype.kind in "biufO" else np.asarray(np.nan)
    except (TypeError, ValueError):  # rows of different lengths, or what is no number
        numbers = np.asarray(np.nan)
    if numbers.ndim != dimensions:
        shape = "one row" if dimensions == 1 else "one row for each x"
        raise ModelError(f"{name} must be numbers, {shape} of them")
    return numbers * (1.0 if unit is None else si_factor(name, unit))


def refuse_points(words: str, x: np.ndarray, values: np.ndarray) -> None:
    """ModelError unless x rises and there is a finite value, or a row of them, for each."""
    if x.ndim != 1 or x.size < 2 or values.shape[:1] != x.shape:
        sizes = ((x.size, "argument"), (len(values), "value"))
        given = ", ".join(f"{n} {what}{'' if n == 1 else 's'}" for n, what in sizes)
        raise ModelError(f"{words}: {given}; give two or more points, each with a value")
    if not (np.isfinite(x).all() and np.isfinite(values).all()):
        raise ModelError(f"{words}: a number is infinite or missing")
    if np.abs(x).max() > LARGEST:  # the range itself is a number then
        raise ModelError(f"{words}: the arguments are too large; keep them below {LARGEST:g}")
    wrong = np.flatnonzero(np.diff(x) <= 0.0)
    if wrong.size:
        i = int(wrong[0])
        raise ModelError(f"{words}: the argument must rise, but {x[i + 1]:g} follows {x[i]:g} (SI)")
    if x[-1] - x[0] < NARROWEST:
        raise ModelError(f"{words}: all arguments lie within {x[-1] - x[0]:.3g} (SI); spread them over {NARROWEST:g}")


def finite_rows(words: str, rows_of: Callable[..., np.ndarray], *points: np.ndarray) -> np.ndarray:
    """The rows that a look-up reads, made by `rows_of`; ModelError if points are so close that one is infinite."""
    with np.errstate(all="ignore"):
        rows = rows_of(*points)
    if not np.isfinite(rows).all():
        raise ModelError(f"{words}: two points lie so close that the slope between them is no number")
    return rows


def grid_of(words: str, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(x, y, values [n_x, n_y]): both axes and the values of a grid, from rows in any order."""
    xs, at_x = np.unique(x, return_inverse=True)
    ys, at_y = np.unique(y, return_inverse=True)
    values = np.full((xs.size, ys.size), np.nan)
    values[at_x, at_y] = z
    if np.isnan(values).any() or x.size != values.size:
        raise ModelError(f"{words}: {x.size} rows are no grid of {xs.size} by {ys.size} points, each once")
    return xs, ys, values


# ---- a row for each point


def linear_rows(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(value, slope to the next point) of each point; the slope of the last one is 0."""
    return np.column_stack([y, np.append(np.diff(y) / np.diff(x), 0.0)])


def cubic_rows(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Coefficients of the powers of the distance from each point."""
    h = np.diff(x)
    m = np.diff(y) / h
    d = _slopes(h, m)
    rows = np.column_stack([y[:-1], d[:-1], (3.0 * m - 2.0 * d[:-1] - d[1:]) / h, (d[:-1] + d[1:] - 2.0 * m) / h / h])
    return np.concatenate([rows, [[y[-1], 0.0, 0.0, 0.0]]])


def _slopes(h: np.ndarray, m: np.ndarray) -> np.ndarray:
    """Slopes at the points by Fritsch and Butland's weighted harmonic mean; h, m : length and slope of each stretch."""
    if m.size == 1:
        return np.repeat(m, 2)
    before, behind = h[1:] + 2.0 * h[:-1], 2.0 * h[1:] + h[:-1]  # weights of the slopes behind and before
    same = m[:-1] * m[1:] > 0.0
    safe = np.where(same, m[:-1], 1.0), np.where(same, m[1:], 1.0)
    inner = np.where(same, (before + behind) / (behind / safe[0] + before / safe[1]), 0.0)
    return np.concatenate([[_end(h[0], h[1], m[0], m[1])], inner, [_end(h[-1], h[-2], m[-1], m[-2])]])


def _end(h0: float, h1: float, m0: float, m1: float) -> float:
    """Slope at an end by three points, kept from overshooting (C. Moler, Numerical Computing with MATLAB, 3.6)."""
    d = ((2.0 * h0 + h1) * m0 - h0 * m1) / (h0 + h1)
    if np.sign(d) != np.sign(m0):
        return 0.0
    return 3.0 * m0 if np.sign(m0) != np.sign(m1) and abs(d) > 3.0 * abs(m0) else d


def turnovers(x: np.ndarray) -> np.ndarray:
    """First point, the first arguments that are nearer to the next point than to the one before, last point."""
    return np.concatenate([x[:1], np.nextafter(0.5 * x[:-1] + 0.5 * x[1:], np.inf), x[-1:]])


def nearest_rows(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(value, 0) from each turnover on; at the last one begins what is outside."""
    return np.column_stack([np.append(y, y[-1]), np.zeros(x.size + 1)])


def previous_rows(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(value, 0) from each point on."""
    return np.column_stack([y, np.zeros(x.size)])


# ---- a cell behind each point of a grid


def linear_cells(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """(value, slope along x, slope along y, their product's) of the cell behind each point of the grid."""
    along_x, along_y = np.zeros_like(z), np.zeros_like(z)
    along_x[:-1] = np.diff(z, axis=0) / np.diff(x)[:, None]
    along_y[:, :-1] = np.diff(z, axis=1) / np.diff(y)
    both = np.zeros_like(z)
    both[:-1] = np.diff(along_y, axis=0) / np.diff(x)[:, None]
    return np.stack([z, along_x, along_y, both], axis=-1)


def nearest_cells(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """The value from each pair of turnovers on."""
    return np.pad(z, ((0, 1), (0, 1)), "edge")


def previous_cells(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """The value from each point of the grid on."""
    return z


def cubic_cells(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Coefficients of the powers of both ways, [n_x, n_y, power of the way along x, along y].

    Along y the values and the slopes along x are curves by `cubic_rows`; between them stands Hermite's cubic along x.
    """
    steps = np.diff(x)
    slopes = np.column_stack([_slopes(steps, np.diff(column) / steps) for column in z.T])
    values, slopes = (np.stack([cubic_rows(y, row) for row in rows]) for rows in (z, slopes))
    h = steps[:, None, None]
    m = np.diff(values, axis=0) / h
    cells = np.zeros((x.size, y.size, 4, 4))
    cells[:, :, 0] = values
    cells[:-1, :, 1] = slopes[:-1]
    cells[:-1, :, 2] = (3.0 * m - 2.0 * slopes[:-1] - slopes[1:]) / h
    cells[:-1, :, 3] = (slopes[:-1] + slopes[1:] - 2.0 * m) / h / h
    return cells
