"""The compiled kernel of a model: assembled from its physics and the engine's loop, cached on disk.

numba caches a function beside the file that it stands in and watches that file alone.  So every kernel gets
a small file of its own, in a folder named by a digest of everything the kernel is made of: the engine's and
the model's sources, the compiler's versions and the processor.  A changed source is a new folder.
"""

import os
import platform
import stat
import sys
import tempfile
import threading
from collections.abc import Callable
from functools import cache, lru_cache
from hashlib import sha256
from pathlib import Path

from mc_engine.errors import DiskError
from mc_engine.flight.kernel_parts import Functions, parts_of
from mc_engine.model.fields import AdaptiveStep
from mc_engine.model.imports import new_module
from mc_engine.model.record import Model, sources_of

WIDTH = 8  # one register of eight doubles
_FEW_FIXED, _FEW_ADAPTIVE = 18, 12  # values
_ENGINE = (
    "flight/kernel.py",
    "flight/kernel_parts.py",
    "model/event_watch.py",
    "model/fields.py",
    "model/record.py",
    "dates.py",
    "units.py",
    "status.py",
)

_FIXED = '''"""Kernel of {reference}, {width} cases at a time.  Written by the engine; edit the model instead."""

from mc_engine.flight.kernel_parts import Functions
from mc_engine.lanes.compiler import compile_kernel
from mc_engine.lanes.fixed_step import fly
from mc_engine.lanes.kernel_data import hand_over

_F, Parameters, Settings, HAS_EVENTS, MUST_STOP, BLOCKS = PARTS
{names} = _F


@compile_kernel
def kernel(
    parameters, settings, data, key, cases, n_steps, h, control_every, time, status, state, metrics, history, stride,
):
    hand_over(BLOCKS, data)
    f = Functions({names})
    grid, kinds, out = (n_steps, h, control_every), (HAS_EVENTS, MUST_STOP), (time, status, state, metrics)
    return fly(f, Parameters, Settings, {width}, parameters, settings, key, cases, grid, kinds, out, history, stride)
'''
_ADAPTIVE = '''"""Kernel of {reference}, {width} cases at a time.  Written by the engine; edit the model instead."""

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
    history, spacing,
):
    hand_over(BLOCKS, data)
    f = Functions({names})
    tables, out = (nodes, starts, columns, weights), (time, status, state, metrics)
    return fly(
        f, tables, Parameters, Settings, {width}, np.arange({width}), parameters, settings, key, cases, clock, atol,
        MUST_STOP, out, history, spacing,
    )
'''


def source_digest(model: Model, folder: Path | None) -> str:
    """SHA-256 over the engine's compiled sources and the model's, in a fixed order.  folder : see `sources_of`."""
    engine = Path(__file__).parents[1]
    files = [*sorted(engine.glob("lanes/*.py")), *sorted(engine.glob("physics/*.py"))]
    files += [engine / name for name in _ENGINE]
    digest = sha256()
    for path in files:
        digest.update(f"{path.name}\n".encode() + path.read_bytes())
    for name, content in sources_of(model, folder).named():
        digest.update(f"{name}\n{len(content)}\n".encode() + content)
    return digest.hexdigest()


def cache_folder() -> Path:
    """Folder of compiled kernels: MC_ENGINE_CACHE, or the user's cache folder, or a temporary one."""
    if chosen := os.environ.get("MC_ENGINE_CACHE"):
        return Path(chosen)
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = base / "mc-engine"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass  # a read-only home: kernels are then compiled once per temporary folder
    return _own_temporary_folder()


def _own_temporary_folder() -> Path:
    """A temporary folder of this user alone, since what stands in it is run."""
    user = os.getuid() if hasattr(os, "getuid") else 0  # Windows has a temporary folder for every user
    folder = Path(tempfile.gettempdir()) / f"mc-engine-{user}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        about = folder.lstat()
        if not hasattr(os, "getuid") or (about.st_uid == user and stat.S_ISDIR(about.st_mode)):
            return folder
    except OSError:
        pass  # somebody else's file has the name
    return _temporary_folder_of_this_process()


@cache
def _temporary_folder_of_this_process() -> Path:
    return Path(tempfile.mkdtemp(prefix="mc-engine-"))


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
    import llvmlite
    import numba

    module = sources_of(model, folder).module
    versions = f"{numba.__version__} {llvmlite.__version__} {platform.machine()} {sys.version_info[:2]} {_processor()}"
    what = f"{module.__name__} {source_digest(model, folder)} {versions} {module.__file__} {model.watching}"
    digest = sha256(what.encode()).hexdigest()
    path = cache_folder() / "kernels" / digest[:20] / f"kernel_w{width}.py"
    template = _ADAPTIVE if isinstance(model.clock, AdaptiveStep) else _FIXED
    text = template.format(reference=model.reference, width=width, names=", ".join(Functions._fields)).encode()
    _write(path, text)
    name, parts = f"mc_engine_kernel_{digest[:20]}_w{width}", parts_of(module.MODEL, model.watching)
    return new_module(name, path, text, PARTS=parts).kernel


def _write(path: Path, text: bytes) -> None:
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


def _processor() -> str:
    from llvmlite import binding

    return str(binding.get_host_cpu_name())
