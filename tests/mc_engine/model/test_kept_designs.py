"""A design is computed once for the same inputs and sources, and again after a change or where its file is damaged."""

import doctest
import os
import subprocess
import sys
import time
from collections import namedtuple
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from mc_engine.campaign.search import SHIPPED
from mc_engine.model import designs, kept_design, load_model
from tests.mc_engine.store.small_run import ENVIRONMENT

INPUTS = np.array([1.0, np.nan, 3.0])
Pair = namedtuple("Pair", "a b")
calls: list[object] = []


@dataclass
class Craft:
    mass: float


def doubled(inputs):
    calls.append(inputs)
    return 2.0 * inputs


def nothing(inputs):
    calls.append(inputs)
    return np.zeros(1)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Where the designs are kept."""
    monkeypatch.setenv("MC_ENGINE_CACHE", str(tmp_path / "cache"))
    calls.clear()
    return tmp_path / "cache" / "designs"


def test_the_second_time_it_is_read_with_the_same_bits(folder):
    first = kept_design(doubled, INPUTS)
    assert kept_design(doubled, INPUTS).tobytes() == first.tobytes() == (2.0 * INPUTS).tobytes()
    assert len(calls) == 1


THREADS = """
import numpy as np
from concurrent.futures import ThreadPoolExecutor
from threadpoolctl import threadpool_info
from mc_engine.model import kept_design

def threads_of_blas(number):
    if number > 0.0:
        kept_design(threads_of_blas, -number)
    return np.array([library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"])

with ThreadPoolExecutor(2) as pool:
    designed = list(pool.map(lambda number: kept_design(threads_of_blas, number), (1.0, 2.0, 3.0)))
print(*np.concatenate(designed), "then", *threads_of_blas(0.0))
"""


def test_designs_have_one_thread_of_blas_each_and_give_back_what_was_there(tmp_path):
    (tmp_path / "threads.py").write_text(THREADS)
    chosen = ENVIRONMENT | {"OPENBLAS_NUM_THREADS": "2", "MKL_NUM_THREADS": "2", "MC_ENGINE_CACHE": str(tmp_path)}
    command = [sys.executable, tmp_path / "threads.py"]
    told = subprocess.run(command, env=chosen, capture_output=True, text=True, check=True).stdout
    inside, after = told.split(" then ")
    assert {*inside.split()} == {"1"}
    assert {*after.split()} == {"2"}


def test_threads_design_one_after_the_other(folder):
    def alone(number):
        calls.append(number)
        time.sleep(0.1)
        assert calls[-1] == number
        return np.zeros(1)

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(partial(kept_design, alone), (1.0, 2.0)))
    assert len(calls) == 2


def test_inputs_that_differ_are_designed_apart(folder):
    inputs = [
        1.0, 1, True, "1", None, (1.0,), ((1.0,),), (1.0, 1.0), Pair(1.0, 2.0), {"a": 1.0}, SimpleNamespace(a=2.0),
        Craft(1.0), Craft(2.0), np.array([1.0]), np.array([[1.0]]), np.array([1]), -0.0, 0.0, float("nan"),
        np.array([1.0 + 1e-15]),
    ]  # fmt: skip
    for value in [*inputs, *inputs]:
        kept_design(nothing, value)
    assert len(calls) == len(inputs) == len(list(folder.iterdir()))


def test_what_could_hold_anything_is_no_input(folder):
    with pytest.raises(TypeError, match="cannot depend on a function"):
        kept_design(nothing, doubled)


@pytest.mark.parametrize(
    "damage",
    [
        lambda old, _: b"",
        lambda old, _: old[:50],
        lambda old, _: old[:-1] + bytes([old[-1] ^ 1]),
        lambda _, other: other,
    ],
)
def test_a_damaged_file_is_designed_again(folder, damage):
    first = kept_design(doubled, INPUTS)
    (file,) = folder.iterdir()
    kept_design(doubled, 3.0 * INPUTS)
    (other,) = {*folder.iterdir()} - {file}
    file.write_bytes(damage(file.read_bytes(), other.read_bytes()))
    for _ in range(2):
        assert kept_design(doubled, INPUTS).tobytes() == first.tobytes()
    assert len(calls) == 3


def test_a_cache_that_cannot_be_written_costs_nothing_but_time(folder):
    folder.parent.mkdir()
    folder.write_text("in the way")
    for _ in range(2):
        assert kept_design(doubled, INPUTS)[2] == 6.0
    assert len(calls) == 2


@pytest.mark.parametrize(
    ("changed", "more"), [("model.py", "NEW = 1"), ("gains.py", "NEW = 1"), ("k.csv", "9,9"), (0, 0)]
)
def test_a_changed_source_of_the_model_is_another_design(folder, tmp_path, changed, more):
    minimal = (SHIPPED / "minimal" / "model.py").read_text()
    curves = "K, L = curve('k.csv', y_unit='m'), curve('l.csv', y_unit='m')"
    gains = f"import numpy as np\nfrom mc_engine.physics.curves import curve\n{curves}\n"
    gains += "def gains(k):\n    return np.array([K(k) - L(k)])\n"
    files = {"k.csv": "x,y\n0,1\n5,1\n", "l.csv": "x,y\n0,2\n5,2\n"}
    files |= {"model.py": f"{minimal}\nfrom gains import gains\n", "gains.py": gains}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    edited = {changed: f"{files[changed]}{more}\n"} if changed else {"k.csv": files["l.csv"], "l.csv": files["k.csv"]}
    for edit, count in (({}, 1), ({}, 1), (edited, 2)):
        loaded = load_model("model.py", tmp_path).sources.module.gains
        for name, text in edit.items():
            (tmp_path / name).write_text(text)
        kept_design(loaded, 4.0)  # of the sources as they were loaded, whatever the files say since
        assert len(list(folder.iterdir())) == 1
        kept_design(load_model("model.py", tmp_path).sources.module.gains, 4.0)
        assert len(list(folder.iterdir())) == count


ELSEWHERE = """
from pathlib import Path
from mc_engine.model import kept_design, load_model
module = load_model("model.py", Path.cwd()).sources.module
assert kept_design(module.table, 2.0) == module.AT_IMPORT
print(*module.AT_IMPORT)
"""


def test_changed_physics_from_another_folder_are_another_design(folder, tmp_path):
    table = "def table(k):\n    return np.array([pull(k)])\n\n\nAT_IMPORT = kept_design(table, 2.0)\n"
    imports = "import numpy as np\nfrom laws.pull import pull\nfrom mc_engine.model import kept_design\n"
    (tmp_path / "model.py").write_text((SHIPPED / "minimal" / "model.py").read_text() + imports + table)
    (tmp_path / "lib" / "laws").mkdir(parents=True)
    env = {**ENVIRONMENT, "PYTHONPATH": f"{ENVIRONMENT['PYTHONPATH']}{os.pathsep}{tmp_path / 'lib'}"}
    env |= {"MC_ENGINE_CACHE": str(folder.parent)}
    for factor, count in ((3.0, 1), (3.0, 1), (30.5, 2)):
        pull = f"from mc_engine.lanes import physics\n\n\n@physics\ndef pull(x):\n    return {factor} * x\n"
        (tmp_path / "lib" / "laws" / "pull.py").write_text(pull)
        command = [sys.executable, "-c", ELSEWHERE]
        done = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True)
        assert done.stdout == f"{2.0 * factor}\n", done.stderr
        assert len(list(folder.iterdir())) == count


def test_the_example_runs(folder):
    (example,) = doctest.DocTestFinder().find(
        kept_design, "kept_design", globs={**vars(designs), "np": np, "__name__": __name__}
    )
    assert doctest.DocTestRunner().run(example) == (0, 2)
