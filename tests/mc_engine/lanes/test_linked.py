"""Parts of a kernel: what several share is compiled once, whatever calls it, and the kernel is kept on disk."""

import re

import numpy as np
import pytest
from numba import njit

from mc_engine.lanes import exp, log, physics, sin
from mc_engine.lanes.compiler import compile_callable, compile_inline
from mc_engine.model.imports import new_module

KERNEL = b"""
from mc_engine.lanes.compiler import compile_kernel
from mc_engine.lanes.tuples import load, store


@compile_kernel
def kernel(x, out):
    for first in range(0, x.shape[0], 8):
        store(out, first, twice(wave, load(x, first, 8)))
"""


@physics
def wave(x):
    return sin(x) * exp(x) + log(2.0 + x)


def shared(function, x):
    return function(x) + exp(function(0.5 * x))


def kernel_of(folder, part):
    """A kernel in which an inlined function calls a part twice, and hands it another function."""

    def twice(function, x):
        return part(function, x) - part(function, 2.0 * x)

    folder.mkdir(exist_ok=True)
    (folder / "kernel.py").write_bytes(KERNEL)  # numba keeps its files beside one
    names = {"twice": compile_inline(twice), "wave": wave}
    return new_module("mc_engine_test_linked", folder / "kernel.py", KERNEL, **names).kernel


@pytest.mark.parametrize(("compiled", "copies"), [(compile_callable, 1), (compile_inline, 0)])
def test_a_shared_part_is_in_the_kernel_once_and_an_inlined_one_is_no_function(compiled, copies, tmp_path):
    kernel, x = kernel_of(tmp_path, compiled(shared)), np.linspace(0.0, 1.0, 16)
    out = np.empty(16)
    kernel(x, out)
    (code,) = kernel.inspect_llvm().values()
    assert len(re.findall(r"^define .*6shared", code, re.MULTILINE)) == copies
    assert len(re.findall(r"call .*6shared", code)) == 2 * copies
    np.testing.assert_allclose(out, shared(wave.function, x) - shared(wave.function, 2.0 * x), rtol=1e-14)


def test_shared_and_inlined_parts_give_the_same_bits(tmp_path):
    x, outs = np.linspace(0.0, 1.0, 16), []
    for compiled in (compile_callable, compile_inline):
        kernel_of(tmp_path / compiled.__name__, compiled(shared))(x, out := np.empty(16))
        outs.append(out.tobytes())
    assert outs[0] == outs[1]


def test_a_kernel_that_hands_a_function_to_a_shared_part_is_kept_on_disk(tmp_path):
    kernel_of(tmp_path, compile_callable(shared))(np.zeros(8), np.empty(8))
    assert list(tmp_path.rglob("*.nbc"))


def test_a_function_that_numba_compiles_by_itself_calls_parts_that_call_others():
    @njit
    def run(x, out):
        out[0] = wave(x)

    out = np.empty(1)
    run(0.5, out)
    assert out[0] == wave.function(0.5)
