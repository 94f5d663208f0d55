"""Physics on records, compiled for lanes and plain numbers and interpreted on arrays: for twins on many random ones."""

from functools import cache

import numpy as np
from numba import njit

from mc_engine.lanes.compiler import STRICT
from mc_engine.lanes.tuples import joined, load_fields, spread, store_fields


@cache
def _kernel(function, record, width, several):
    @njit(**STRICT)
    def of_one(rows, out):
        for first in range(0, rows.shape[1], width):
            fields = load_fields(record, rows, first, width)
            store_fields(out, first, spread(function(fields), fields[0]))

    @njit(**STRICT)
    def of_several(rows, out):
        for first in range(0, rows.shape[1], width):
            fields = load_fields(record, rows, first, width)
            store_fields(out, first, spread(joined(*function(fields)), fields[0]))

    return of_several if several else of_one


def _called(function, record, rows):
    """(numbers, whether they are several records) of the function by NumPy."""
    result = function(record(*rows))
    several = isinstance(result[0], tuple)
    flat = [number for one in result for number in one] if several else result
    return np.array(np.broadcast_arrays(*flat)), several


def compiled(function, record, rows, width=8):
    """float64[n_results, n]: the record, or records in a tuple, that function(record) gives for every column of rows.

    rows : float64[n_fields, n], n a multiple of 8.
    """
    numbers, several = _called(function, record, rows[:, :2])
    out = np.empty((len(numbers), rows.shape[1]))
    _kernel(function, record, width, several)(np.ascontiguousarray(rows), out)
    return out


def by_both(function, record, rows, rtol=1e-13):
    """The same by lanes, of which plain numbers have the bits, and NumPy all but the last digits."""
    lanes = compiled(function, record, rows)
    few = np.ascontiguousarray(rows[:, :256])
    assert compiled(function, record, few, width=1).tobytes() == lanes[:, :256].copy().tobytes()
    interpreted, _ = _called(function, record, few)
    scale = np.abs(lanes).max(axis=1, keepdims=True)
    assert (np.abs(interpreted - lanes[:, :256]) <= rtol * scale).all()
    return lanes
