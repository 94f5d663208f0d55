"""Parts of a kernel: what several share is compiled once, whatever calls it, and the kernel is kept on disk."""

import math
import re
import subprocess
import sys

import numpy as np
import pytest
from numba import njit

from mc_engine.lanes import exp, log, physics, sin
from mc_engine.lanes.compiler import compile_callable, compile_inline, compile_kernel
from mc_engine.lanes.kernel_cache import Kernel
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
    names = {"twice": compile_inline(twice), "wave": wave}
    made = new_module("mc_engine_test_linked", folder / "kernel.py", KERNEL, **names).kernel
    return made, Kernel(folder / "kernel.py", made.library)


@pytest.mark.parametrize(("compiled", "copies"), [(compile_callable, 1), (compile_inline, 0)])
def test_a_shared_part_is_in_the_kernel_once_and_an_inlined_one_is_no_function(compiled, copies, tmp_path):
    (made, kernel), x = kernel_of(tmp_path, compiled(shared)), np.linspace(0.0, 1.0, 16)
    out = np.empty(16)
    kernel(x, out)
    code = made.library(("float64[]", "float64[]"))[1].get_llvm_str()
    assert len(re.findall(r"^define .*6shared", code, re.MULTILINE)) == copies
    assert len(re.findall(r"call .*6shared", code)) == 2 * copies
    np.testing.assert_allclose(out, shared(wave.function, x) - shared(wave.function, 2.0 * x), rtol=1e-14)


def test_shared_and_inlined_parts_give_the_same_bits(tmp_path):
    x, outs = np.linspace(0.0, 1.0, 16), []
    for compiled in (compile_callable, compile_inline):
        kernel_of(tmp_path / compiled.__name__, compiled(shared))[1](x, out := np.empty(16))
        outs.append(out.tobytes())
    assert outs[0] == outs[1]


def test_a_kernel_that_hands_a_function_to_a_shared_part_is_kept_on_disk(tmp_path):
    kernel_of(tmp_path, compile_callable(shared))[1](np.zeros(8), np.empty(8))
    assert list(tmp_path.rglob("*.kernel"))


OTHER_PROCESS = """
import sys
from pathlib import Path
import numpy as np
from mc_engine.lanes.kernel_cache import Kernel
kernel, out = Kernel(Path(sys.argv[1]), None), np.empty(1)
assert "numba" not in sys.modules
kernel(np.array([2.5]), out)
print(kernel.loads, out[0])
"""


def test_a_kernel_finds_the_compilers_own_functions_in_a_process_that_compiles_nothing(tmp_path):
    def of_gamma(x, out):
        out[0] = math.gamma(x[0])

    made = compile_kernel(of_gamma)
    Kernel(tmp_path / "kernel.py", made.library)(np.array([2.5]), out := np.empty(1))
    assert out[0] == pytest.approx(math.gamma(2.5), rel=1e-14)
    other = subprocess.run(
        [sys.executable, "-c", OTHER_PROCESS, tmp_path / "kernel.py"], capture_output=True, text=True, check=True
    )
    assert other.stdout.split() == ["1", str(out[0])]


@pytest.mark.parametrize(("given", "told"), [
    (np.zeros(16)[::2], "one with gaps"), (np.zeros(8, dtype=np.float32), "float32"), (np.float32(1.0), "float32"),
    (np.zeros(8, dtype=">f8"), ">f8"), (np.zeros((2, 2, 2)), "one of 3 dimensions"), (True, "bool"), ([0.0], "list"),
])  # fmt: skip
def test_a_kernel_refuses_what_it_cannot_take(given, told, tmp_path):
    with pytest.raises(TypeError, match=f"a kernel takes .*, not {told}"):
        kernel_of(tmp_path, compile_callable(shared))[1](given, np.empty(8))


def test_a_function_that_numba_compiles_by_itself_calls_parts_that_call_others():
    @njit
    def run(x, out):
        out[0] = wave(x)

    out = np.empty(1)
    run(0.5, out)
    assert out[0] == wave.function(0.5)
