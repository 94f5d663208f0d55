"""Points of curves and surfaces: read from a CSV or Parquet file, in SI by the units in the names of its columns, and
held to what a curve needs."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.suggestions import hint, listed
from mc_engine.units import UNITS, unit_hint


def columns_of(path: Path, wanted: Mapping[str, str | None]) -> dict[str, np.ndarray]:
    """float64[n_rows], SI, of each wanted column.

    wanted : names of columns, each with its unit, or with None: then the end of its name says it, such as _km_s, and a
        name without a unit is a plain number.
    Raises ModelError where the file, a column, a unit or a number is missing; FileNotFoundError as `open` does.
    """
    found = _parquet(path) if path.suffix == ".parquet" else _csv(path)
    for name in wanted:
        if name not in found:
            raise ModelError(f'{path.name} has no column "{name}"{hint(name, found)}; it has {listed([*found])}')
    return {name: found[name] * si_factor(name, unit) for name, unit in wanted.items()}


def si_factor(name: str, unit: str | None = None) -> float:
    """SI value of one unit of a column.  unit : by default what the name ends in; the longest ending counts."""
    if unit is not None:
        if unit not in UNITS:
            raise ModelError(f'"{unit}" is not a unit{unit_hint(unit)}')
        return UNITS[unit].factor
    fitting = [one for one in UNITS.values() if one.suffix and name.endswith(one.suffix)]
    longest = max((len(one.suffix) for one in fitting), default=0)
    factors = {one.factor for one in fitting if len(one.suffix) == longest}
    if len(factors) > 1:
        raise ModelError(f'the end of "{name}" could be more than one unit; say which')
    return factors.pop() if factors else 1.0


def _csv(path: Path) -> dict[str, np.ndarray]:
    """Columns by the names in the first line; lines that are empty or begin with # count for nothing."""
    text = path.read_text(encoding="utf-8-sig")
    lines = [(number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip() and line[0] != "#"]
    if not lines:
        raise ModelError(f"{path.name} is empty")
    names = [name.strip().strip('"') for name in lines[0][1].split(",")]
    rows = []
    for number, line in lines[1:]:
        cells = line.split(",")
        if len(cells) != len(names):
            raise ModelError(f"{path.name}, line {number}: {len(cells)} numbers for {len(names)} columns")
        try:
            rows.append([float(cell) for cell in cells])
        except ValueError:
            raise ModelError(f'{path.name}, line {number}: "{line.strip()}" are not all numbers') from None
    return dict(zip(names, np.array(rows).reshape(-1, len(names)).T, strict=True))


def _parquet(path: Path) -> dict[str, np.ndarray]:
    from pyarrow import parquet

    with path.open("rb") as file:
        table = parquet.read_table(file)
    numbers = [name for name in table.column_names if str(table[name].type) in _NUMBERS]
    return {name: table[name].to_numpy().astype(np.float64) for name in numbers}


_NUMBERS = {"double", "float", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))}


def caller_folder() -> Path:
    """Folder of the module that calls the function that calls this one."""
    file = sys._getframe(2).f_globals.get("__file__")
    return Path(file).parent if file else Path.cwd()


def array_of(values: Any, name: str) -> np.ndarray:
    """The numbers of an argument; ModelError for the name of a column, where there is no file."""
    if isinstance(values, str):
        raise ModelError(f'"{values}" is a column, but there is no file; give {name} as numbers')
    return np.asarray(values, dtype=np.float64)


def refuse_points(words: str, x: np.ndarray, values: np.ndarray, n: int) -> None:
    """ModelError unless x rises and there is a finite value, or a row of them, for each."""
    if x.ndim != 1 or x.size < 2 or values.shape[:1] != (n,):
        raise ModelError(
            f"{words}: {x.size} arguments, {len(values)} values; give two or more points, each with a value"
        )
    if not (np.isfinite(x).all() and np.isfinite(values).all()):
        raise ModelError(f"{words}: a number is infinite or missing")
    wrong = np.flatnonzero(np.diff(x) <= 0.0)
    if wrong.size:
        i = int(wrong[0])
        raise ModelError(f"{words}: the argument must rise, but {x[i + 1]:g} follows {x[i]:g} (SI)")


def refuse_steep(words: str, rows: np.ndarray) -> None:
    """ModelError where a slope is infinite: arguments next to each other as closely as floats are."""
    if not np.isfinite(rows).all():
        raise ModelError(f"{words}: two points lie so close that the slope between them is no number")


def grid_of(words: str, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of both axes and values [n_x, n_y] of rows in any order."""
    xs, at_x = np.unique(x, return_inverse=True)
    ys, at_y = np.unique(y, return_inverse=True)
    values = np.full((xs.size, ys.size), np.nan)
    values[at_x, at_y] = z
    if np.isnan(values).any() or x.size != values.size:
        raise ModelError(f"{words}: {x.size} rows are no grid of {xs.size} by {ys.size} points, each once")
    return xs, ys, values
