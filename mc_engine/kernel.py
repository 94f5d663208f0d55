"""The compiled kernel of a model: assembled from its physics and the engine's loop, cached on disk.

numba caches a function beside the file that it stands in and watches that file alone.  So every kernel gets
a small file of its own, in a folder named by a digest of everything the kernel is made of: the engine's and
the model's sources, the compiler's versions and the processor.  A changed source is a new folder.
"""

import importlib.util
import os
import platform
import sys
import tempfile
from collections import namedtuple
from collections.abc import Callable
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from mc_engine.lanes import physics
from mc_engine.model import Model, load_model

WIDTH = 8  # one register of eight doubles; see tests/benchmarks for 1, 8 and 16

Functions = namedtuple(
    "Functions",
    "initial start rhs control events switch observe evaluate peaks_of lasts_of best_of when_of smooth_of "
    "signs_of stops_of",
)
NoMemory = namedtuple("NoMemory", "unused")
NoEvents = namedtuple("NoEvents", "unused")

_TEMPLATE = '''"""Kernel of {reference}, {width} cases at a time.  Written by the engine; edit the model instead."""

from pathlib import Path

from mc_engine.kernel import Functions, parts_of
from mc_engine.lanes.compiler import compile_kernel
from mc_engine.lanes.fixed_step import fly

_F, Parameters, Settings, HAS_EVENTS, MUST_STOP = parts_of({reference!r}, {folder!r})
{names} = _F


@compile_kernel
def kernel(parameters, settings, key, cases, n_steps, h, control_every, time, status, state, metrics, history, stride):
    f = Functions({names})
    grid, kinds, out = (n_steps, h, control_every), (HAS_EVENTS, MUST_STOP), (time, status, state, metrics)
    return fly(f, Parameters, Settings, {width}, parameters, settings, key, cases, grid, kinds, out, history, stride)
'''


@physics
def _no_start(p, o):
    return NoMemory(0.0)


@physics
def _no_control(t, s, m, p, o, draws):
    return m


@physics
def _no_events(t, s, m, p, o):
    return NoEvents(1.0)


@physics
def _no_switch(t, s, m, p, o, hit):
    return s, m


class Parts(NamedTuple):
    """What a kernel file needs from its model."""

    functions: Functions
    parameters: type
    settings: type
    has_events: bool
    must_stop: bool


def settings_class(model: Model) -> type:
    """Named tuple of the model's settings, by symbol."""
    return namedtuple("Settings", [s.symbol for s in model.settings] or ["unused"])


def parts_of(reference: str, folder: str | None) -> Parts:
    """Functions, tuple classes and flags of the model that a kernel file names."""
    return _parts(load_model(reference, Path(folder) if folder else None))


def _parts(model: Model) -> Parts:
    from mc_engine.lanes.tuples import any_of, directions, picker

    names = [quantity.name for quantity in model.quantities]
    peaks = [e for e in model.extrema if e.kind in ("max", "min")]
    lasts = [e for e in model.extrema if e.kind == "last_above"]
    order = [*peaks, *lasts]
    extremum_names = [e.name for e in model.extrema]
    sign = {e.name: -1.0 if e.kind == "min" else 1.0 for e in model.extrema}
    # a model without extrema tracks its first quantity, so that no tuple of the loop is empty
    peak_picks = [(names.index(e.quantity), sign[e.name], 0.0) for e in peaks] or [(0, 1.0, 0.0)]
    last_picks = [(names.index(e.quantity), 1.0, e.level) for e in lasts] or [(0, 1.0, 0.0)]
    at = {e.name: order.index(e) + (1 if not peaks else 0) for e in order}
    best_picks = [(at[name], sign[name], 0.0) for name in extremum_names] or [(0, 1.0, 0.0)]
    best_class = namedtuple("Best", extremum_names or ["unused"])  # type: ignore[misc]
    signs = [{"rising": 1.0, "falling": -1.0, "either": 0.0}[e.direction] for e in model.event_list] or [-1.0]
    stops = [i for i, event in enumerate(model.event_list) if event.action == "stop"]
    functions = Functions(
        model.initial,
        model.start or _no_start,
        model.rhs,
        model.control or _no_control,
        model.events or _no_events,
        model.switch or _no_switch,
        model.observe,
        model.evaluate,
        picker(None, peak_picks),
        picker(None, last_picks),
        picker(best_class, best_picks),
        picker(best_class, [(i, 1.0, 0.0) for i, _, _ in best_picks]),
        directions([1.0 if e.smooth else 0.0 for e in peaks] or [0.0]),
        directions(signs),
        any_of(stops),
    )
    return Parts(functions, model.kernel_parameters, settings_class(model), bool(model.event_list), bool(stops))


def model_sources(model: Model, folder: Path | None) -> list[Path]:
    """Source files that decide the model's numbers: its package, or the Python files beside it."""
    if model.reference.endswith(".py"):
        return sorted(((folder or Path.cwd()) / model.reference).resolve().parent.glob("*.py"))
    module = sys.modules[model.reference]
    assert module.__file__ is not None  # a model's module always comes from a file
    home = Path(module.__file__)
    return sorted(home.parent.rglob("*.py")) if home.name == "__init__.py" else [home]


def source_digest(model: Model, folder: Path | None) -> str:
    """SHA-256 over the engine's compiled sources and the model's, in a fixed order."""
    engine = Path(__file__).parent
    files = [*sorted(engine.glob("lanes/*.py")), *sorted(engine.glob("physics/*.py"))]
    files += [engine / name for name in ("kernel.py", "model.py", "units.py", "status.py")]
    digest = sha256()
    for path in [*files, *model_sources(model, folder)]:
        digest.update(f"{path.name}\n".encode() + path.read_bytes())
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
    return Path(tempfile.gettempdir()) / "mc-engine"


@lru_cache(maxsize=64)
def build_kernel(model: Model, folder: Path | None = None, width: int = WIDTH) -> Callable[..., int]:
    """The kernel of `model` for `width` cases at a time: 1 (plain float64), 8 or 16.

    folder : where a `.py` model lies.  The first call compiles or loads from the cache.
    """
    import llvmlite
    import numba

    versions = f"{numba.__version__} {llvmlite.__version__} {platform.machine()} {sys.version_info[:2]} {_processor()}"
    digest = sha256(f"{model.reference} {source_digest(model, folder)} {versions} {folder}".encode()).hexdigest()
    path = cache_folder() / "kernels" / digest[:20] / f"kernel_w{width}.py"
    text = _TEMPLATE.format(
        reference=model.reference,
        folder=str(folder) if folder else None,
        width=width,
        names=", ".join(Functions._fields),
    )
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{path.name}.{os.getpid()}")
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    return _import(path, f"mc_engine_kernel_{digest[:20]}_w{width}").kernel


def _processor() -> str:
    from llvmlite import binding

    return str(binding.get_host_cpu_name())


def _import(path: Path, name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None  # a .py path always has a loader
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module
