"""Tables of saved time histories: case_id, t_s, the model's outputs with units, and the phase; which rows they hold."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from mc_engine.errors import StoreError
from mc_engine.model.designs import compiled_loop
from mc_engine.shell_words import shell_word
from mc_engine.store import parts
from mc_engine.store.parts import CASE_COLUMNS, Column, Part

if TYPE_CHECKING:
    import pandas as pd

_EVEN = 0.2  # share of the rows that lie evenly in time, so that no quiet stretch is left without
_EDGE = 1e-2  # of the range of a quantity: a smaller jump is no edge
_MOST_EDGES = 2  # times as many as the rows that are asked for
_TINY = np.finfo(float).tiny


def rows_to_keep(record: np.ndarray, rows: int, lines: slice = slice(None), n_rows: int | None = None) -> np.ndarray:
    """Indices of the rows of a recorded flight that its history holds, ascending: int64[n_kept].

    record : float64[n_lines, n], contiguous; a column is a row of the history.  lines : of this flight, the time, not
        falling, and its quantities; by default all.  n_rows : recorded; by default n.  Rows of one time are one
        instant: two before and after a sample of the control, three or more before and after an event.
    rows : how many are kept.  The first and the last are, both sides of every event, and both sides of the samples at
        which a quantity jumps by more than a hundredth of its range: up to twice `rows` of them, the largest.  The rest
        lie where straight lines between them err most, a fifth evenly in time; they are half of `rows` at least, on top
        of the others where events and samples are so many.

    A row that repeats the one before counts as none.  All rows are kept where there are no more.
    The density of the rest is that of C. de Boor, A Practical Guide to Splines, 1978, chapter XII: the square root of
    the second derivative, here of the quantity that bends most in units of its range.
    """
    first, stop, _ = lines.indices(len(record))
    times = record[first, :n_rows]
    repeats, count = np.arange(1, times.size), np.full(1, times.size - 1)
    _repeats(record, first, stop, repeats, count)
    left = np.delete(np.arange(times.size), repeats[: count[0]])
    if left.size <= rows:
        return left
    t, ranges = times[left], _ranges(record[first + 1 : stop, :n_rows])
    errors, jumps = np.zeros(t.size), np.zeros(t.size - 1)
    _errors_and_jumps(record, first + 1, *ranges, left, t, np.empty(t.size), np.empty(t.size), errors, jumps)
    always = _at_events(times)[left] | _at_edges(jumps, rows)
    always[0] = always[-1] = True
    bend = np.sqrt(errors)
    density = (1.0 - _EVEN) * bend / max(bend.cumsum()[-1], _TINY)
    density[1:] += _EVEN * ((t[1:] - t[:-1]) / max(t[-1] - t[0], _TINY))
    density[always] = np.inf
    shares = _shares(density, max(rows, int(always.sum()) + rows // 2))
    places = np.floor(shares.cumsum() + 0.5)
    always[1:] |= places[1:] > places[:-1]  # the first is kept in any case
    return left[always]


@compiled_loop
def _repeats(record, first, stop, rows, count):
    """Of some rows, those that are as the one before in all lines; not a number equals its like.

    rows : int64[n], after the call those in front.  count : int64[1], how many there are.
    """
    n = count[0]
    for line in range(first, stop):
        found = 0
        for k in range(n):
            before, after = record[line, rows[k] - 1], record[line, rows[k]]
            rows[found] = rows[k]
            found += after == before or (after != after and before != before)
        n = found
    count[0] = n


def _ranges(quantities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Half of the least and half of the largest number of each quantity, of those that are finite; halved, so that no
    difference is above the largest number.  Without any, inf and -inf."""
    low, high = quantities.min(axis=1), quantities.max(axis=1)
    for line in np.flatnonzero(~(np.isfinite(low) & np.isfinite(high))):
        numbers = quantities[line, np.isfinite(quantities[line])]
        low[line], high[line] = numbers.min(initial=np.inf), numbers.max(initial=-np.inf)
    return 0.5 * low, 0.5 * high


@compiled_loop
def _errors_and_jumps(record, first, low, high, left, t, share, values, errors, jumps):
    """Of the rows that are left: how far the straight line between the neighbours errs, and how far, without the first,
    it jumps from the one before at the same time; in the quantity where most, in units of its range.

    Numbers that are not finite count as 0, as those of a quantity without a range.
    first : line of the first quantity.  low, high : see `_ranges`.  t : float64[n_left], times of the rows.
    share, values : float64[n_left], to work in.  errors : float64[n_left], jumps : float64[n_left - 1], 0 at first.
    """
    n = left.size
    for k in range(1, n - 1):
        width = t[k + 1] - t[k - 1]
        share[k] = (t[k] - t[k - 1]) / (width if width > 0.0 else 1.0)
    for line in range(low.size):
        least, size = low[line], high[line] - low[line]
        if not size > 0.0:
            continue
        for k in range(n):
            value = 0.5 * record[first + line, left[k]]
            values[k] = (value - least) / size if -np.inf < value < np.inf else 0.0
        for k in range(1, n - 1):
            error = abs((values[k + 1] - values[k - 1]) * share[k] + values[k - 1] - values[k])
            errors[k] = error if error > errors[k] else errors[k]
        for k in range(n - 1):
            jump = abs(values[k + 1] - values[k]) if t[k + 1] == t[k] else 0.0
            jumps[k] = jump if jump > jumps[k] else jumps[k]


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
