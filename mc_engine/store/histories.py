"""Tables of saved time histories: case_id, t_s, the model's outputs with units, and the phase; which rows they hold."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from mc_engine.errors import StoreError
from mc_engine.shell_words import shell_word
from mc_engine.store import parts
from mc_engine.store.parts import CASE_COLUMNS, Column, Part

if TYPE_CHECKING:
    import pandas as pd

_EVEN = 0.2  # share of the rows that lie evenly in time, so that no quiet stretch is left without
_EDGE = 1e-2  # of the range of a quantity: a smaller jump is no edge
_MOST_EDGES = 2  # times as many as the rows that are asked for
_BLOCK = 2**16  # numbers that are gone through together
_TINY = np.finfo(float).tiny


def rows_to_keep(table: np.ndarray, rows: int) -> np.ndarray:
    """Indices of the rows of a recorded flight that its history holds, ascending: int64[n_kept].

    table : float64[n, 1 + n_quantities], the time, not falling, and the quantities.  Rows of one time are one instant:
        two before and after a sample of the control, three or more before and after an event.
    rows : how many are kept.  The first and the last are, both sides of every event, and both sides of the samples at
        which a quantity jumps by more than a hundredth of its range: up to twice `rows` of them, the largest.  The rest
        lie where straight lines between them err most, a fifth evenly in time; they are half of `rows` at least, on top
        of the others where events and samples are so many.

    A row that repeats the one before counts as none.  All rows are kept where there are no more.
    The density of the rest is that of C. de Boor, A Practical Guide to Splines, 1978, chapter XII: the square root of
    the second derivative, here of the quantity that bends most in units of its range.
    """
    columns = table.T
    left = np.flatnonzero(_changes(columns))
    if left.size <= rows:
        return left
    t = columns[0, left]
    errors, jumps = _errors_and_jumps(t, columns[1:], left)
    always = _at_events(columns[0])[left] | _at_edges(jumps, rows)
    always[0] = always[-1] = True
    bend = np.sqrt(errors)
    density = (1.0 - _EVEN) * bend / max(bend.cumsum()[-1], _TINY)
    density[1:] += _EVEN * ((t[1:] - t[:-1]) / max(t[-1] - t[0], _TINY))
    density[always] = np.inf
    shares = _shares(density, max(rows, int(always.sum()) + rows // 2))
    places = np.floor(shares.cumsum() + 0.5)
    always[1:] |= places[1:] > places[:-1]  # the first is kept in any case
    return left[always]


def _blocks(columns: np.ndarray) -> Iterator[np.ndarray]:
    """Some quantities at a time: a processor takes several times longer over numbers that it cannot keep near."""
    size = max(1, _BLOCK // columns.shape[1])
    for first in range(0, len(columns), size):
        yield columns[first : first + size]


def _changes(columns: np.ndarray) -> np.ndarray:
    """Mask of the first row and of those that differ from the one before; not a number equals its like."""
    changes = np.zeros(columns.shape[1], dtype=bool)
    changes[:1] = True
    for block in _blocks(columns):
        after, before = block[:, 1:], block[:, :-1]
        differ = after != before
        if np.isnan(block.min()):
            differ &= (after == after) | (before == before)
        changes[1:] |= differ.any(axis=0)
    return changes


def _errors_and_jumps(t: np.ndarray, quantities: np.ndarray, left: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of the rows that are left: how far the straight line between the neighbours errs, and how far, without the first,
    it jumps from the one before at the same time; in the quantity where most, in units of its range.

    quantities : float64[n_quantities, n], of all rows.
    """
    errors, jumps = np.zeros(t.size), np.zeros(t.size - 1)
    width = t[2:] - t[:-2]
    share = (t[1:-1] - t[:-2]) / np.where(width > 0.0, width, 1.0)
    for block in _blocks(quantities):
        values = _in_ranges(block.take(left, axis=1) if left.size < block.shape[1] else block)
        chord = values[:, 2:] - values[:, :-2]
        chord *= share
        chord += values[:, :-2]
        chord -= values[:, 1:-1]
        np.maximum(errors[1:-1], np.abs(chord, out=chord).max(axis=0), out=errors[1:-1])
        change = values[:, 1:] - values[:, :-1]
        np.maximum(jumps, np.abs(change, out=change).max(axis=0), out=jumps)
    jumps[t[1:] != t[:-1]] = 0.0
    return errors, jumps


def _in_ranges(values: np.ndarray) -> np.ndarray:
    """Quantities in units of their ranges; 0 where one is not finite or constant.  float64[n_quantities, n]."""
    values = 0.5 * values  # halved, so that no range is above the largest number
    low, high = values.min(axis=1, keepdims=True), values.max(axis=1, keepdims=True)
    finite: Any = np.isfinite(low) & np.isfinite(high)
    if not finite.all():
        finite = np.isfinite(values)
        low = np.where(finite, values, np.inf).min(axis=1, keepdims=True)
        high = np.where(finite, values, -np.inf).max(axis=1, keepdims=True)
    varies = high > low
    with np.errstate(invalid="ignore"):
        values -= np.where(varies, low, 0.0)
        values /= np.where(varies, high - low, 1.0)
    return values if finite.all() and varies.all() else np.where(finite & varies, values, 0.0)


def _at_events(t: np.ndarray) -> np.ndarray:
    """Mask of the rows that are of an event: more than two of one time.  t : float64[n], of all rows."""
    instant = np.append(0, (t[1:] != t[:-1]).cumsum())
    is_event: np.ndarray = (np.bincount(instant) > 2)[instant]
    return is_event


def _at_edges(jumps: np.ndarray, rows: int) -> np.ndarray:
    """Mask of the rows before and after the largest jumps.  jumps : float64[n - 1], from row to row."""
    edges = np.flatnonzero(jumps > _EDGE)
    edges = edges[np.argsort(-jumps[edges], kind="stable")[: _MOST_EDGES * rows]]
    mask = np.zeros(jumps.size + 1, dtype=bool)
    mask[edges] = mask[edges + 1] = True
    return mask


def _shares(density: np.ndarray, total: int) -> np.ndarray:
    """min(1, c density), with the c that makes the sum `total`; 1 for each above 0 where they are no more than that."""
    falling = np.sort(density)[::-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        c = (total - np.arange(falling.size)) / falling[::-1].cumsum()[::-1]  # where as many of the largest are 1
        right = np.flatnonzero(c * falling <= 1.0)
    return np.minimum(1.0, c[right[0]] * density) if right.size else (density > 0.0).astype(np.float64)


PHASE_COLUMN = "phase"  # of histories of a model with phases: its name, in words


def history_columns(names: Sequence[str], quantities: Sequence[Mapping[str, str]]) -> tuple[Column, ...]:
    """Columns of a history table with these names: case_id and t_s first, units from the model's outputs."""
    known = {quantity["name"]: quantity for quantity in quantities}
    columns = [CASE_COLUMNS[0], Column("t_s", "s", "time", "time since the start of the case")]
    for name in names:
        if name == PHASE_COLUMN and name not in known:
            columns.append(Column(PHASE_COLUMN, "", "phase", "phase of the flight", "word"))
        elif name not in ("case_id", "t_s"):
            quantity = known.get(name, {})
            columns.append(Column(name, quantity.get("unit", ""), "quantity", quantity.get("description", "")))
    return tuple(columns)


def history_table(
    table: "pd.DataFrame | Mapping[str, Any]", quantities: Sequence[Mapping[str, str]], place: Path
) -> pa.Table:
    """The Arrow table of histories with their units; `place` is for messages."""
    arrays = {name: np.asarray(table[name]) for name in table}
    columns = history_columns(list(arrays), quantities)
    return parts.arrow_table(columns, arrays, len(arrays.get("t_s", ())), place)


def read_histories(run: Path, part: Part, quantities: Sequence[Mapping[str, str]]) -> pa.Table:
    """The saved time histories of a run; StoreError that names the file if it changed or holds no histories."""
    table = parts.read_part(run, part)
    problem = history_problem(table, quantities)
    if problem:
        raise StoreError(f"{run / part.file}: {problem}; `mc-engine verify {shell_word(run)}` names all damage")
    return table


def history_problem(table: pa.Table, quantities: Sequence[Mapping[str, str]]) -> str:
    """What is wrong with the columns of a table of histories; empty if they are case_id, t_s, outputs, phase."""
    names, known = table.column_names, {"case_id", "t_s", PHASE_COLUMN, *(quantity["name"] for quantity in quantities)}
    unknown = {*names} - known if quantities else {}
    expected = parts.arrow_schema(history_columns(names, quantities))
    if unknown or not {"case_id", "t_s"} <= {*names} or not table.schema.equals(expected, check_metadata=True):
        return "its columns are not those of histories"
    return ""
