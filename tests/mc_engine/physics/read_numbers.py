"""Curves and surfaces compiled by themselves, for one case or for lanes."""

from functools import cache

import numpy as np

from mc_engine.lanes.composed import blocks_in
from mc_engine.lanes.kernel_data import Blocks, gathered, hand_over
from mc_engine.lanes.tuples import load, store
from mc_engine.model import compiled_loop


@cache
def _kernel(function, n_arguments, width):
    blocks = Blocks(blocks_in([function]))

    def of_one(x, out, data):
        hand_over(blocks, data)
        for first in range(0, x.shape[1], width):
            store(out, first, function(load(x[0], first, width)))

    def of_two(x, out, data):
        hand_over(blocks, data)
        for first in range(0, x.shape[1], width):
            store(out, first, function(load(x[0], first, width), load(x[1], first, width)))

    return compiled_loop(of_one if n_arguments == 1 else of_two), blocks


def compiled(function, *arguments, width=8):
    """float64[n]: function of arrays, by lanes of this width."""
    columns = np.array(np.broadcast_arrays(*arguments), dtype=float)
    n = columns.shape[1]
    padded = np.pad(columns, ((0, 0), (0, -n % width)), "edge")
    kernel, blocks = _kernel(function, len(columns), width)
    out = np.empty(padded.shape[1])
    kernel(padded, out, gathered(blocks.blocks))
    return out[:n]


def every_way(function, *arguments):
    """The same by lanes; plain numbers and NumPy give the same bits."""
    lanes = compiled(function, *arguments)
    np.testing.assert_array_equal(lanes, function(*arguments))
    few = [np.asarray(one)[:200] for one in arguments]
    np.testing.assert_array_equal(lanes[:200], compiled(function, *few, width=1))
    return lanes
