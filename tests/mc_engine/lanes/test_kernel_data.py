"""Data that a kernel is handed: each call has its own, whoever else flies the same machine code."""

import subprocess
import sys
import textwrap
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest

from mc_engine.errors import ModelError
from mc_engine.lanes import kernel_data, physics
from mc_engine.lanes.compiler import compile_callable
from mc_engine.lanes.composed import blocks_in
from mc_engine.lanes.kernel_cache import Kernel
from mc_engine.lanes.kernel_data import (
    Blocks,
    DataBlock,
    gathered,
    hand_over,
    numbers_of,
    one_at,
    row_of_four,
    row_of_two,
)
from mc_engine.model.imports import new_module

# `shared` is not inlined: the data must reach functions that the kernel calls, too
KERNEL = b"""
from mc_engine.lanes.compiler import compile_kernel
from mc_engine.lanes.kernel_data import hand_over
from mc_engine.lanes.tuples import load, store


@compile_kernel
def kernel(x, out, data):
    hand_over(BLOCKS, data)
    for first in range(0, x.shape[0], 8):
        at = load(x, first, 8)
        store(out, first, inlined(at) + shared(at))
"""
N = 4096
PLACES = np.random.default_rng(1).integers(0, 5, N).astype(float)


def reading(one, other):
    """Physics that reads two blocks, one of them through another function."""

    @physics
    def inner(at):
        return one_at(numbers_of(other), at)

    @physics
    def outer(at):
        first, second = row_of_two(numbers_of(one), 1.0, at)
        return first + 10.0 * second + 100.0 * inner(at)

    return outer


def kernel_of(folder, one, other):
    """A kernel of the same source, name and cache whatever the numbers; what it is handed; and what it must give."""
    function, blocks = reading(one, other), Blocks(blocks_in([reading(one, other)]))
    names = {"BLOCKS": blocks, "inlined": function, "shared": compile_callable(function.function)}
    made = new_module("mc_engine_test_kernel", folder / "kernel.py", KERNEL, **names).kernel
    at = PLACES.astype(int)
    wanted = 2.0 * (one.numbers[2 * at + 1] + 10.0 * one.numbers[2 * at + 2] + 100.0 * other.numbers[at])
    return Kernel(folder / "kernel.py", made.library), gathered(blocks.blocks), wanted


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "kernel.py").write_bytes(KERNEL)
    return tmp_path


def random_block(size):
    return DataBlock(np.random.default_rng(size).integers(0, 1000, size))


def test_the_same_machine_code_flies_other_data_in_turn_and_at_once(folder):
    first = kernel_of(folder, random_block(16), random_block(7))
    second = kernel_of(folder, random_block(60), random_block(7))
    assert not np.array_equal(first[2], second[2])
    out = np.empty(N)
    for kernel, data, wanted in (first, second, first, second):
        kernel(PLACES, out, data)
        assert out.tolist() == wanted.tolist()
    assert (first[0].compilations, first[0].loads) == (1, 0)
    # the second flew machine code that the first compiled
    assert (second[0].compilations, second[0].loads) == (0, 1)

    def fly(flight):
        kernel, data, wanted = flight
        mine = np.empty(N)
        for _ in range(200):
            kernel(PLACES, mine, data)
            if not np.array_equal(mine, wanted):
                return False
        return True

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(fly, [first, second] * 8))


def test_one_kernel_object_takes_other_data_with_each_call(folder):
    kernel, data, wanted = kernel_of(folder, random_block(16), random_block(7))
    out = np.empty(N)
    kernel(PLACES, out, data)
    assert out.tolist() == wanted.tolist()
    longer = [DataBlock(-np.arange(8.0)), DataBlock(np.arange(90.0))]  # the inner function's is found first
    kernel(PLACES, out, gathered(longer))
    assert out.tolist() == (2.0 * ((2.0 * PLACES + 1.0) + 10.0 * (2.0 * PLACES + 2.0) - 100.0 * PLACES)).tolist()


def test_another_process_takes_the_kernel_from_the_disk_with_data_of_its_own(folder):
    kernel, data, _ = kernel_of(folder, random_block(16), random_block(7))
    kernel(PLACES, np.empty(N), data)
    script = """
    import sys
    from pathlib import Path
    sys.path.insert(0, {tests!r})
    import numpy as np
    from test_kernel_data import N, PLACES, kernel_of, random_block
    [random_block(3) for _ in range(5)]  # other serial numbers
    kernel, data, wanted = kernel_of(Path({folder!r}), random_block(61), random_block(9))
    out = np.empty(N)
    kernel(PLACES, out, data)
    assert (kernel.compilations, kernel.loads) == (0, 1)
    assert out.tolist() == wanted.tolist()
    """
    text = textwrap.dedent(script).format(tests=str(__file__).rpartition("/")[0], folder=str(folder))
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_block_that_a_kernel_is_not_handed_is_refused_when_it_is_compiled(folder):
    names = {"BLOCKS": Blocks(()), "inlined": reading(random_block(16), random_block(7))}
    names["shared"] = names["inlined"]
    made = new_module("mc_engine_test_kernel", folder / "kernel.py", KERNEL, **names).kernel
    with pytest.raises(Exception, match="were not found by the names"):
        Kernel(folder / "kernel.py", made.library)(PLACES, np.empty(N), gathered([]))


def test_blocks_are_found_wherever_physics_names_them_once_and_in_order():
    a, b, c, d = (random_block(2) for _ in range(4))
    space, both = SimpleNamespace(c=c), (a, (d,))

    @physics
    def inner(x):
        return one_at(numbers_of(b), x) + one_at(numbers_of(space.c), x)

    @physics
    def outer(x):
        return one_at(numbers_of(both[0]), x) + inner(x) + one_at(numbers_of(a), x)

    found = blocks_in([outer, inner])
    assert {*found} == {a, b, c, d}
    assert found == blocks_in([outer, inner])
    assert len(found) == 4


def test_what_is_read_together_is_what_is_read_alone():
    numbers = np.arange(10.0)
    assert row_of_four(numbers, 1.0, 1.9) == (5.0, 6.0, 7.0, 8.0)
    assert [one.tolist() for one in row_of_two(numbers, 0, np.array([0.0, 4.0]))] == [[0.0, 8.0], [1.0, 9.0]]
    assert one_at(numbers, 9) == 9.0


def test_outside_of_a_kernel_nothing_is_handed_over():
    with pytest.raises(ModelError, match="only a kernel"):
        hand_over(Blocks(()), gathered([]))
    assert kernel_data.gathered([]).size == 0
