"""Lanes written by hand in C++ (lanes.cpp), compiled here by each compiler that is installed."""

import ctypes
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from mc_engine.flight import flight
from tests.benchmarks.peer_codes.engine import load
from tests.benchmarks.peer_codes.entrant import Entrant, Flight
from tests.benchmarks.peer_codes.problems import Problem

SOURCE = Path(__file__).resolve().parents[1] / "lanes.cpp"
FLAGS = ("-O3", "-march=native", "-ffast-math", "-fPIC", "-pthread")
COMPILERS = ("g++", "clang++")
FUNCTIONS = {"orbit": "orbit", "satellite": "satellite"}  # problem -> function


def compilers() -> list[str]:
    """Those of the compilers that are installed."""
    return [name for name in COMPILERS if shutil.which(name)]


@cache
def library(compiler: str) -> ctypes.CDLL:
    """The compiled lanes; they stay loaded after the folder is gone."""
    # clang takes half of a register's width on AVX-512 unless told otherwise; g++ takes what the source says
    extra = ("-mprefer-vector-width=512",) if compiler == "clang++" else ()
    with tempfile.TemporaryDirectory() as folder:
        parts, target = Path(folder) / "lanes.o", Path(folder) / "lanes.so"
        # linked without -ffast-math, which would make this whole process, tests and all, flush small numbers to zero
        for command in (
            [compiler, "-c", *FLAGS, *extra, str(SOURCE), "-o", str(parts)],
            [compiler, "-shared", "-pthread", str(parts), "-o", str(target)],
        ):
            subprocess.run(command, check=True, capture_output=True)
        return ctypes.CDLL(str(target))


def version(compiler: str) -> str:
    """Major version, as in "g++ 12"."""
    text = subprocess.run([compiler, "-dumpversion"], check=True, capture_output=True, text=True).stdout
    return f"{compiler} {text.split('.')[0].strip()}"


def entrants(problem: Problem, step: float) -> list[Entrant]:
    """The hand-written lanes, by each compiler; step [s]."""
    return [_entrant(problem, compiler, step) for compiler in compilers()]


def _entrant(problem: Problem, compiler: str, step: float) -> Entrant:
    def build(cases: Problem, value: float, threads: int) -> Flight:
        model, n = load(cases, "RK4"), cases.first.shape[1]
        inputs = {item.name: item.default for item in (*model.parameters, *model.settings)} | cases.inputs
        parameters = np.ascontiguousarray(flight.prepare(model, inputs, n).parameters)
        end, steps = np.empty((len(model.states), n)), round(cases.duration / value)
        function = getattr(library(compiler), FUNCTIONS[cases.key])
        rows, out = (ctypes.c_void_p(array.ctypes.data) for array in (parameters, end))
        sizes = ctypes.c_long(n), ctypes.c_long(steps), ctypes.c_double(value), ctypes.c_int(threads)

        def fly() -> np.ndarray:
            assert parameters.size  # kept alive: the function sees only its address
            function(rows, out, *sizes)
            return end

        return fly

    form = f"RK4, {library(compiler).lanes()} lanes, {version(compiler)}"
    return Entrant("C++ by hand", form, problem, "step", (step,), build)
