"""Tuples of lanes: to and from arrays, field by field, at every width."""

from collections import namedtuple

import numpy as np
import pytest
from compiled_physics import WIDTHS
from numba import njit

from mc_engine.lanes.compiler import STRICT
from mc_engine.lanes.functions import fma
from mc_engine.lanes.tuples import (
    add_scaled,
    any_field,
    directions,
    least,
    load,
    load_fields,
    load_scalars,
    picker,
    select,
    spread,
    store,
    store_fields,
    total,
)

Place = namedtuple("Place", "x y z")
Picked = namedtuple("Picked", "first second")
pick = picker(Picked, [(2, -1.0, 0.0), (0, 1.0, 5.0)])
signs = directions([1.0, -1.0, 0.0])
RANDOM = np.random.default_rng(3)
COLUMNS = 48


@pytest.fixture(scope="module", params=WIDTHS)
def results(request):
    """Rows that one kernel of this width makes of `table`, and what NumPy makes of it."""
    width = request.param

    @njit(**STRICT)
    def run(table, scalars, sums, ahead, mixed, out):
        plain = load_scalars(Place, scalars)
        for first in range(0, table.shape[1], width):
            s = load_fields(Place, table, first, width)
            store_fields(ahead, first, add_scaled(s, 0.1, Place(s.y, s.z, s.x)))
            store_fields(mixed, first, select(s.x > s.y, s, spread(plain, s.x)))
            chosen = pick(s)
            turned = signs(s)
            low = any_field((s.x < -1.0, s.y < -1.0, s.z < -1.0))
            flags = select(low, spread(1.0, s.x), spread(0.0, s.x))
            one = load(sums, first, width)
            store(sums, first, one + total(s))
            every = (s.x, s.y, s.z, least(s), flags, chosen.first, chosen.second, turned.x, turned.y, turned.z)
            store_fields(out, first, every)

    table, scalars = RANDOM.normal(size=(3, COLUMNS)), np.array([10.0, 20.0, 30.0])
    table.setflags(write=False)
    sums, out = np.ones(COLUMNS), np.empty((16, COLUMNS))
    run(table, scalars, sums, out[:3], out[3:6], out[6:])
    return table, scalars, sums, out


def test_fields_come_from_the_rows_of_an_array_and_go_to_rows(results):
    table, _, _, out = results
    np.testing.assert_array_equal(out[6:9], table)


def test_add_scaled_rounds_once(results):
    table, _, _, out = results
    np.testing.assert_array_equal(out[:3], fma(0.1, table[[1, 2, 0]], table))


def test_select_takes_whole_tuples_lane_by_lane(results):
    table, scalars, _, out = results
    np.testing.assert_array_equal(out[3:6], np.where(table[0] > table[1], table, scalars[:, None]))


def test_fields_are_summed_and_compared_within_each_lane(results):
    table, _, sums, out = results
    np.testing.assert_array_equal(sums, 1.0 + ((table[0] + table[1]) + table[2]))
    np.testing.assert_array_equal(out[9], table.min(axis=0))
    np.testing.assert_array_equal(out[10], (table < -1.0).any(axis=0))


def test_a_picker_turns_and_shifts_the_fields_it_takes(results):
    table, _, _, out = results
    np.testing.assert_array_equal(out[11], -table[2])
    np.testing.assert_array_equal(out[12], table[0] - 5.0)
    np.testing.assert_array_equal(out[13:].T, np.tile([1.0, -1.0, 0.0], (COLUMNS, 1)))
