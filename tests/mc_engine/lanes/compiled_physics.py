"""Physics functions compiled for one case or for lanes, and applied to whole arrays: for tests of single functions."""

from functools import cache

import numpy as np
from numba import njit

from mc_engine.flight.kernel import registers
from mc_engine.lanes.compiler import STRICT
from mc_engine.lanes.tuples import load, store_fields

WIDTHS = (1, registers().doubles, 2 * registers().doubles)  # that are flown on this processor


@cache
def _kernel(function, width):
    @njit(**STRICT)
    def run(x, y, out):
        for first in range(0, x.size, width):
            store_fields(out, first, function(load(x, first, width), load(y, first, width)))

    return run


def apply(function, n_results, x, y, width):
    """float64[n_results, n]: function(x, y), which gives a tuple, by the build of this width."""
    x, y = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(y, dtype=float))
    padding = (0, -x.size % width)
    out = np.empty((n_results, x.size + padding[1]))
    _kernel(function, width)(np.pad(x, padding, "edge"), np.pad(y, padding, "edge"), out)
    return out[:, : x.size].copy()


def by_every_width(function, n_results, x, y):
    """`apply` by all widths, which must agree to the last bit; where a number is missing, any NaN will do."""
    results = [apply(function, n_results, x, y, width) for width in WIDTHS]
    for width, result in zip(WIDTHS, results, strict=True):
        np.testing.assert_array_equal(bits(result), bits(results[0]), err_msg=f"width {width}")
    return results[0]


def bits(numbers):
    """The bits of numbers as whole numbers, NaN alike whatever their sign and payload."""
    numbers = np.asarray(numbers, dtype=float)
    return np.where(np.isnan(numbers), -1, numbers.view(np.int64))
