"""Tables of saved time histories: case_id, t_s, the model's outputs with units, and the phase; which rows they hold."""

import math
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
        decreasing, and its quantities; by default all.  n_rows : recorded; by default n.  Rows at the same time are one
        instant: two before and after a control sample, three or more before and after an event.
    rows : number of rows to keep.  Always kept are the first and the last row, both sides of every event, and both
        sides of samples at which a quantity jumps by more than a hundredth of its range, up to twice `rows` of these,
        the largest.  The others are where linear interpolation between them has the largest errors, and a fifth of them
        evenly in time.  They are at least half of `rows`, in addition to those always kept if these are many.

    Rows that repeat the one before are not counted.  All rows are kept if there are no more than wanted.
    The density of the others is that of C. de Boor, A Practical Guide to Splines, 1978, chapter XII: the square root of
    the second derivative, here of the quantity with the largest one in units of its range.
    """
    first, stop, _ = lines.indices(len(record))
    n = record.shape[1] if n_rows is None else n_rows
    left, always, count = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64), np.zeros(1, dtype=np.int64)
    _without_repeats(record, first, stop, n, left, always, count)
    left = left[: count[0]]
    if left.size <= rows:
        return left
    always, t = always[: left.size], record[first, left]
    errors, jumps, share, values = np.zeros((4, left.size))
    _errors_and_jumps(record, first + 1, stop, left, t, share, values, errors, jumps)
    always[_at_edges(jumps, rows)] = 1
    _densest(t, np.sqrt(errors), always, rows, left, share, count)
    return left[: count[0]]


@compiled_loop
def _without_repeats(record, first, stop, n_rows, left, always, count):
    """The rows that are not as the one before in all lines; not a number equals its like.

    left : int64[n_rows], those rows in front after the call.  count : int64[1], how many they are.
    always : int64[n_rows], for each of them 1 if it is of an event, one of more than two rows of one time; 0 else.
    """
    n = 0
    for k in range(n_rows):
        line = first
        while k > 0 and line < stop:
            before, after = record[line, k - 1], record[line, k]
            if not (after == before or (after != after and before != before)):
                break
            line += 1
        if line == stop:
            continue
        t = record[first, k]
        is_last = k > 1 and record[first, k - 2] == t
        is_between = 0 < k < n_rows - 1 and record[first, k - 1] == t and record[first, k + 1] == t
        is_first = k < n_rows - 2 and record[first, k + 2] == t
        left[n], always[n] = k, is_last or is_between or is_first
        n += 1
    count[0] = n


@compiled_loop
def _errors_and_jumps(record, first, stop, left, t, share, values, errors, jumps):
    """Of the rows that are left: how far the straight line between the neighbours errs, and how far each jumps from the
    one before at the same time; in the quantity where most, in units of its range.

    Numbers that are not finite count as 0, as those of a quantity without a range.  All are halved, so that no
    difference is above the largest number.
    first, stop : lines of the quantities.  t : float64[n_left], times of the rows.
    share, values : float64[n_left], to work in.  errors, jumps : float64[n_left], 0 at first.
    """
    n = left.size
    for k in range(1, n - 1):
        width = t[k + 1] - t[k - 1]
        share[k] = (t[k] - t[k - 1]) / (width if width > 0.0 else 1.0)
    for line in range(first, stop):
        low, high = np.inf, -np.inf
        for k in range(n):
            value = 0.5 * record[line, left[k]]
            low = value if -np.inf < value < low else low
            high = value if high < value < np.inf else high
        size = high - low
        if not size > 0.0:
            continue
        for k in range(n):
            value = 0.5 * record[line, left[k]]
            values[k] = (value - low) / size if -np.inf < value < np.inf else 0.0
        for k in range(1, n - 1):
            error = abs((values[k + 1] - values[k - 1]) * share[k] + values[k - 1] - values[k])
            errors[k] = error if error > errors[k] else errors[k]
        for k in range(1, n):
            jump = abs(values[k] - values[k - 1]) if t[k] == t[k - 1] else 0.0
            jumps[k] = jump if jump > jumps[k] else jumps[k]


def _at_edges(jumps: np.ndarray, rows: int) -> np.ndarray:
    """Indices of the rows before and after the largest jumps.  jumps : float64[n], to each row from the one before."""
    edges = np.flatnonzero(jumps > _EDGE)
    edges = edges[np.argsort(-jumps[edges], kind="stable")[: _MOST_EDGES * rows]]
    return np.append(edges - 1, edges)


@compiled_loop
def _densest(t, bends, always, rows, left, density, count):
    """The rows that are kept, in front of `left` after the call; count[0] : how many they are.

    t, bends, always : of the rows in `left`.  density : float64[n_left], to work in.
    A row has the share min(1, c density), with the c that makes the sum of all what is wanted, and 1 where it is kept
    always.  Rows of a density above 0 have 1 if they are no more than that.  It is kept where the sum of the shares up
    to it passes a next half.
    """
    n = left.size
    always[0] = always[n - 1] = 1
    n_always = always.sum()
    wanted = max(rows, n_always + rows // 2)
    bend, even = (1.0 - _EVEN) / max(bends.sum(), _TINY), _EVEN / max(t[n - 1] - t[0], _TINY)
    for k in range(1, n):
        density[k] = bend * bends[k] + even * (t[k] - t[k - 1])
    c, n_full, n_before = 0.0, 0, -1
    while n_full > n_before:  # the larger c, the more shares are 1
        n_before, n_full, rest = n_full, 0, 0.0
        for k in range(n):
            is_full = always[k] == 1 or c * density[k] >= 1.0
            n_full += is_full
            rest += 0.0 if is_full else density[k]
        c = (wanted - n_full) / rest if rest > 0.0 else c
    total, n_kept = 0.5, 0
    for k in range(n):
        before = math.floor(total)
        total += 1.0 if always[k] == 1 else min(1.0, c * density[k])
        if always[k] == 1 or math.floor(total) > before:
            left[n_kept] = left[k]
            n_kept += 1
    count[0] = n_kept


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
