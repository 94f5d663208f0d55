"""A loop of a design: the bits of its interpreted twin, kept on the disk by what it is, refused where it cannot be."""

import subprocess
import sys

import numpy as np
import pytest

from mc_engine.errors import ModelError
from mc_engine.lanes import physics, sin
from mc_engine.model import compiled_loop
from tests.mc_engine.store.small_run import ENVIRONMENT

LOOP = """
import sys

import numpy as np

from mc_engine.lanes import physics
from mc_engine.model import compiled_loop

GAIN = 2.0


@physics
def gain(x):
    return GAIN * x


@compiled_loop
def filtered(x, rate, out):
    for i in range(1, x.size):
        out[i] = out[i - 1] + rate * (gain(x[i]) - out[i - 1])


out = np.zeros(3)
before = "numba" in sys.modules
filtered(np.ones(3), 0.5, out)
print(before, "numba" in sys.modules, *out)
"""


@physics
def spun(row, out, angle):
    """Writes into an array, as physics may where a loop calls it."""
    for k in range(row.size):
        out[k] = row[k] / sin(angle + k)


@compiled_loop
def spin(rows, angles, n, out):
    for case in range(rows.shape[0]):
        for _ in range(n):
            spun(rows[case], out[case], angles[case])
            for k in range(out.shape[1]):
                rows[case, k] = out[case, k]


def unmarked(x):
    return 2.0 * x


@compiled_loop
def calls_unmarked(x, out):
    out[0] = unmarked(x)


@compiled_loop
def gives_a_sum(x):
    return x[0] + x[1]


def printed(folder, text, *, cache):
    """What a process of its own prints that runs the text as a file of the folder."""
    (folder / "design.py").write_text(text)
    environment = {**ENVIRONMENT, "MC_ENGINE_CACHE": str(cache)}
    done = subprocess.run(
        [sys.executable, "design.py"], cwd=folder, env=environment, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


def test_a_loop_has_the_bits_of_its_interpreted_twin():
    random = np.random.default_rng(7)
    rows, angles = random.normal(size=(5, 4)), random.uniform(0.1, 3.0, 5)
    flown = []
    for function in (spin, spin.__wrapped__):
        start, out = rows.copy(), np.empty_like(rows)
        function(start, angles, 3, out)
        flown.append(out)
    np.testing.assert_array_equal(*flown)
    assert not (flown[0] == rows).any()


def test_a_loop_is_compiled_once_and_again_when_a_number_that_it_names_has_changed(tmp_path):
    cache = tmp_path / "cache"
    assert printed(tmp_path, LOOP, cache=cache) == ["False", "True", "0.0", "1.0", "1.5"]
    copy = tmp_path / "copy"
    copy.mkdir()
    assert printed(copy, f"# edited\n{LOOP}", cache=cache) == ["False", "False", "0.0", "1.0", "1.5"]
    changed = LOOP.replace("GAIN = 2.0", "GAIN = 4.0")
    assert printed(tmp_path, changed, cache=cache) == ["False", "True", "0.0", "2.0", "3.0"]


def test_a_function_that_is_no_physics_is_refused_with_the_way_to_mend_it():
    with pytest.raises(
        ModelError, match=r"^calls_unmarked names what .*; mark the functions that it calls with @physics"
    ):
        calls_unmarked(1.0, np.zeros(1))


def test_a_loop_that_returns_its_result_is_refused():
    with pytest.raises(ModelError, match=r"^gives_a_sum returns something; its results have to be written into arrays"):
        gives_a_sum(np.ones(2))


@pytest.mark.parametrize("out", [np.zeros((5, 4), np.float32), np.zeros((4, 5)).T, np.zeros((5, 4, 1)), [0.0]])
def test_arrays_that_machine_code_would_misread_are_refused(out):
    with pytest.raises(TypeError, match=r"^a kernel takes "):
        spin(np.ones((5, 4)), np.ones(5), 1, out)
