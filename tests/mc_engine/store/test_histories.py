"""Which rows of a recorded flight its history holds."""

import numpy as np
import pytest

from mc_engine.store import histories
from mc_engine.store.histories import rows_to_keep

T = np.linspace(0.0, 100.0, 20_001)


def by_lines(table):
    return np.ascontiguousarray(table.T)


def error(table, kept):
    """How far straight lines between the kept rows err, in the units of the quantity."""
    return np.abs(np.interp(table[:, 0], table[kept, 0], table[kept, 1]) - table[:, 1]).max()


def test_rows_lie_where_the_quantity_bends_and_straight_lines_between_them_err_ten_times_less():
    table = np.column_stack([T, np.tanh((T - 60.0) * 4.0)])
    kept = rows_to_keep(by_lines(table), 100)
    assert len(kept) == 100
    assert (kept[0], kept[-1]) == (0, len(T) - 1)
    even = np.linspace(0, len(T) - 1, 100).round().astype(int)
    assert error(table, kept) < 0.1 * error(table, even)
    assert np.diff(T[kept]).max() < 100.0 / (0.2 * 98) + 0.01  # a fifth of the rows evenly, beside both ends


def test_both_sides_of_the_largest_jumps_are_kept_on_top_of_half_the_rows():
    """A command that is held for 1 s: an edge at every second, of a size that grows with the time."""
    held = np.floor(T)
    table = np.column_stack([np.repeat(T, 2), np.repeat(held**2 * (-1.0) ** held, 2)])
    table[0::2, 1] = np.append(table[0, 1], table[1:-1:2, 1])  # before the sample: what the last one left
    for rows, first in ((1000, 8), (20, 60)):  # the smaller jumps: under a hundredth of the range, beyond 40 of them
        kept = rows_to_keep(by_lines(table), rows)
        t, command = table[kept].T
        for second in range(first + 1, 101):
            before, after = np.flatnonzero(t == second)
            assert command[before] == (second - 1) ** 2 * (-1.0) ** (second - 1)
            assert command[after] == second**2 * (-1.0) ** second
        assert len(kept) == pytest.approx(rows if rows == 1000 else 2 * 40 + 10, abs=2)


def test_three_rows_of_one_time_are_an_event_which_is_kept_though_nothing_jumps():
    t = np.sort(np.append(T, [33.335, 33.335, 33.335]))
    kept = rows_to_keep(np.array([t, np.sin(t)]), 10)
    assert 33.335 in t[kept]
    assert 33.335 not in T[rows_to_keep(np.array([T, np.sin(T)]), 10)]


def test_what_is_not_a_number_or_never_changes_takes_no_row_from_the_rest():
    table = np.column_stack([T, np.tanh(T - 60.0), np.full(T.size, np.nan), np.full(T.size, 7.0)])
    table[5000:, 2] = 1.0
    assert (rows_to_keep(by_lines(table), 50) == rows_to_keep(by_lines(table[:, :2]), 50)).all()
    assert rows_to_keep(by_lines(table[:40]), 50).tolist() == list(range(40))


def test_rows_are_chosen_among_those_of_a_flight_beside_others_by_machine_code_as_by_python(monkeypatch):
    """Edges, an event, repeated rows, a constant and what is not a number, each in a quantity of its own."""
    t = np.sort(np.append(np.repeat(T[::20], 2), T[10_000]))
    edges, held = np.floor(t) % 7.0, np.where(np.arange(t.size) % 2 == 0, np.ceil(t / 10.0), np.floor(t / 10.0))
    lost, huge = np.where(t > 80.0, np.nan, np.cos(t)), 1.7e308 * np.sin(0.3 * t)
    flight = [t, np.sin(t), edges, held, lost, huge, np.full(t.size, 3.0), np.where(t == 10.0, np.inf, t)]
    record = np.full((2 + len(flight) + 3, t.size + 50), 1.0) * np.arange(t.size + 50)
    record[2:-3, : t.size] = flight
    kept = rows_to_keep(record, 60, slice(2, -3), t.size).tolist()
    assert T[10_000] in t[kept]  # the event
    assert (np.diff(t[kept]) == 0.0).sum() > 5  # edges
    assert kept == rows_to_keep(np.array(flight), 60).tolist()
    for name in ("_without_repeats", "_errors_and_jumps", "_densest"):
        monkeypatch.setattr(histories, name, getattr(histories, name).__wrapped__)
    assert kept == rows_to_keep(record, 60, slice(2, -3), t.size).tolist()
