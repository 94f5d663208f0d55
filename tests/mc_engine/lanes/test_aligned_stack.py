import platform

import pytest
from numba import njit

from mc_engine.lanes.aligned_stack import align_stack
from mc_engine.lanes.compiler import STRICT


def on_a_boundary(x):
    align_stack()
    return x + 1.0


def anywhere(x):
    return x + 1.0


def machine_code(function):
    compiled = njit(**STRICT)(function)
    assert compiled(1.0) == 2.0
    return "".join(compiled.inspect_asm().values())


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="looks for an instruction of x86-64")
def test_a_function_that_asks_for_it_puts_its_stack_on_a_boundary_of_64_bytes():
    assert "andq\t$-64, %rsp" in machine_code(on_a_boundary)
    assert "andq\t$-64, %rsp" not in machine_code(anywhere)
