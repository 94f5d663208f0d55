"""The compiled kernel of a model: assembled from its physics and the engine's loop, cached on disk.

numba caches a function beside the file that defines it and watches that file alone.  So every kernel gets a small
file of its own, in a folder named by the digest of what the kernel is compiled from (`mc_engine.flight.kernel_key`).
Models that compile to the same code share a kernel, wherever they lie.
"""

import os
import threading
from collections.abc import Callable
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

from mc_engine.cache_folder import cache_folder
from mc_engine.errors import DiskError
from mc_engine.flight.kernel_key import Recorder, kernel_key
from mc_engine.flight.kernel_parts import Functions, parts_of
from mc_engine.model.fields import AdaptiveStep, FixedStep
from mc_engine.model.imports import new_module
from mc_engine.model.record import Model, sources_of

WIDTH = 8  # one register of eight doubles
_FEW_FIXED, _FEW_ADAPTIVE = 18, 12  # values
_ENGINE = (
    "flight/kernel.py",
    "flight/kernel_key.py",
    "flight/kernel_parts.py",
    "model/fields.py",
    "model/record.py",
    "dates.py",
    "units.py",
    "status.py",
)

_FIXED = '''"""A kernel for {width} cases at a time.  Written by the engine; edit the model instead."""

from mc_engine.flight.kernel_parts import Functions
from mc_engine.lanes.compiler import compile_kernel
from mc_engine.lanes.fixed_step import Method, fly
from mc_engine.lanes.kernel_data import hand_over
from mc_engine.lanes.{module} import advance, begin, restart, single

_F, Parameters, Settings, HAS_EVENTS, MUST_STOP, BLOCKS = PARTS
{names} = _F


@compile_kernel
def kernel(
    parameters, settings, data, key, cases, n_steps, h, control_every, {tables}time, status, state, metrics, history,
    stride,
):
    hand_over(BLOCKS, data)
    f, method = Functions({names}), Method(begin, restart, advance, single, ({tables}))
    grid, kinds, out = (n_steps, h, control_every), (HAS_EVENTS, MUST_STOP), (time, status, state, metrics)
    return fly(
        f, method, Parameters, Settings, {width}, parameters, settings, key, cases, grid, kinds, out, history, stride
    )
'''
_TABLES = "nodes, starts, columns, weights, columns_of, ahead, behind, at_end, n_differences"
_RUNGE_KUTTA = _FIXED.replace("{module}", "fixed_step").replace("{tables}", "")
_MULTISTEP = _FIXED.replace("{module}", "multistep").replace("{tables}", _TABLES + ", ")
_ADAPTIVE = '''"""A kernel for {width} cases at a time.  Written by the engine; edit the model instead."""

import numpy as np

from mc_engine.flight.kernel_parts import Functions
from mc_engine.lanes.adaptive_flight import fly
from mc_engine.lanes.compiler import compile_kernel
from mc_engine.lanes.kernel_data import hand_over

_F, Parameters, Settings, HAS_EVENTS, MUST_STOP, BLOCKS = PARTS
{names} = _F


@compile_kernel
def kernel(
    parameters, settings, data, key, cases, nodes, starts, columns, weights, clock, atol, time, status, state, metrics,
    history, pace,
):
    hand_over(BLOCKS, data)
    f = Functions({names})
    tables, out = (nodes, starts, columns, weights), (time, status, state, metrics)
    return fly(
        f, tables, Parameters, Settings, {width}, np.arange({width}), parameters, settings, key, cases, clock, atol,
        MUST_STOP, out, history, pace,
    )
'''


def source_digest(model: Model, folder: Path | None) -> str:
    """SHA-256 of the text of the engine's compiled sources and the model's, in a fixed order: what a run records.

    folder : see `sources_of`.
    """
    engine = Path(__file__).parents[1]
    files = [*sorted(engine.glob("lanes/*.py")), *sorted(engine.glob("physics/*.py"))]
    files += [engine / name for name in _ENGINE]
    digest = sha256()
    for path in files:
        digest.update(f"{path.name}\n".encode() + path.read_bytes())
    for name, content in sources_of(model, folder).named():
        digest.update(f"{name}\n{len(content)}\n".encode() + content)
    return digest.hexdigest()


def usual_width(model: Model) -> int:
    """How many cases of a model fly at a time: 8, or 16 where two registers a number hide the waiting of one another.

    Measured (tests/benchmarks): with few values to hold sixteen are a tenth to a third faster, with many they are
    not.  Adaptive steps hold the events and extrema too.  The results have the same bits.
    """
    if isinstance(model.clock, AdaptiveStep):
        few = len(model.states) + len(model.event_list) + len(model.extrema) <= _FEW_ADAPTIVE
    else:
        few = len(model.states) <= _FEW_FIXED
    return 2 * WIDTH if few else WIDTH


@lru_cache(maxsize=64)
def build_kernel(model: Model, folder: Path | None = None, width: int = WIDTH) -> Callable[..., int]:
    """The kernel of `model` for `width` cases at a time: 1 (plain float64), 8 or 16.

    folder : see `sources_of`.  The first call compiles or loads from the cache.
    """
    module = sources_of(model, folder).module
    template = _template(model.clock)
    digest, is_complete = kernel_key(parts_of(module.MODEL, model.watching, Recorder()), template)
    if not is_complete:
        what = f"{digest} {source_digest(model, folder)} {module.__name__} {module.__file__}"
        digest = sha256(what.encode()).hexdigest()
    path = cache_folder() / "kernels" / digest[:20] / f"kernel_w{width}.py"
    text = template.format(width=width, names=", ".join(Functions._fields)).encode()
    _write_source(path, text)
    name, parts = f"mc_engine_kernel_{digest[:20]}_w{width}", parts_of(module.MODEL, model.watching)
    return new_module(name, path, text, PARTS=parts).kernel


def _template(clock: FixedStep | AdaptiveStep) -> str:
    """The text of a kernel's file; methods of one kind share a kernel, which is handed their tables."""
    if isinstance(clock, AdaptiveStep):
        return _ADAPTIVE
    return _RUNGE_KUTTA if clock.method == "rk4" else _MULTISTEP


def _write_source(path: Path, text: bytes) -> None:
    """Write the source of a kernel, unless it is there; DiskError with the folder's variable where the disk refuses.

    It is for numba, which keeps its files beside one, and for people: what runs is `text`.
    """
    try:
        if path.exists() and path.read_bytes() == text:
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{path.name}.{os.getpid()}.{threading.get_ident()}")
        temporary.write_bytes(text)
        os.replace(temporary, path)
    except OSError as error:
        raise DiskError(f"{path.parent}: {error.strerror or error}; compiled kernels are kept there, name another "
                        "folder in MC_ENGINE_CACHE") from error  # fmt: skip
