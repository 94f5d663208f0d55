"""Data that physics reads by the name of an object, such as the points of a curve, and that a kernel gets in its call.

A `DataBlock` is such an object.  Machine code contains only its index among the blocks of the kernel, so other numbers
need no compilation.  A kernel takes all its blocks in one array, made by `gathered`, and `hand_over` keeps the address
of the array during the call (see `call_frame`).

In lanes, adjacent numbers are read together, by one load for each lane.
"""

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.errors import ModelError

_SERIAL = itertools.count()


class DataBlock:
    """A row of float64 numbers.  file : that they were read from, if any."""

    def __init__(self, numbers: np.ndarray, file: Path | None = None):
        self.numbers, self.file = np.ascontiguousarray(numbers, dtype=np.float64), file
        self.serial = next(_SERIAL)  # tells blocks apart within the process; machine code has no trace of it


class Blocks:
    """The blocks of one kernel, in the order in which it takes them."""

    def __init__(self, blocks: Sequence[DataBlock]):
        self.blocks = tuple(blocks)


def gathered(blocks: Sequence[DataBlock]) -> np.ndarray:
    """What a kernel takes: float64[...], the place of each block as a whole number's bits, then the blocks."""
    sizes = [len(blocks), *(block.numbers.size for block in blocks)]
    places = np.cumsum(sizes, dtype=np.int64)[: len(blocks)]
    return np.concatenate([places.view(np.float64), *(block.numbers for block in blocks)])


def numbers_of(block: DataBlock) -> np.ndarray:
    """The numbers of a block; in compiled physics, their address."""
    return block.numbers


def one_at(numbers, place):
    """The number at `place`, which is inside: nothing is checked, here and below.

    The fraction of a place or row is dropped; neither may be NaN.
    """
    return _taken(numbers, place, 1)[0]


def row_of_two(numbers, first, row):
    """Row number `row` of a table of two columns that begins at place `first`, the same in all lanes."""
    return _taken(numbers, int(first) + 2 * _whole(row), 2)


def row_of_four(numbers, first, row):
    """Row number `row` of a table of four columns that begins at place `first`."""
    return _taken(numbers, int(first) + 4 * _whole(row), 4)


def _whole(value: Any) -> Any:
    return int(value) if np.ndim(value) == 0 else np.asarray(value).astype(np.int64)


def _taken(numbers: np.ndarray, place: Any, count: int) -> tuple[Any, ...]:
    first = _whole(place)
    if np.ndim(first) == 0:
        return tuple(numbers[first : first + count].tolist())
    return tuple(numbers[first + i] for i in range(count))


def hand_over(blocks: Blocks, array: np.ndarray) -> None:
    """In a kernel alone: `array`, made by `gathered` of these blocks, holds what its physics reads."""
    raise ModelError("only a kernel is handed its data")
