"""The compiled kernel of a model: assembled from its physics and the engine's loop, cached on disk.

Every kernel has its own small source file, with its machine code, in a folder named by the digest of everything that
the kernel is compiled from (`mc_engine.lanes.kernel_key`).  Models that compile to the same code share a kernel, also
if they are in different folders.
"""

import errno
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cache, lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from llvmlite import binding

from mc_engine.cache_folder import cache_folder
from mc_engine.errors import DiskError, ModelError, UsageError
from mc_engine.flight.kernel_parts import Functions, parts_of, second_order_of, tracking_of
from mc_engine.lanes.kernel_cache import Form, Kernel, replace_file
from mc_engine.lanes.kernel_key import Recorder, kernel_key
from mc_engine.lanes.runge_kutta_pairs import PAIRS
from mc_engine.model.fields import AdaptiveStep, FixedStep, uses_rates
from mc_engine.model.imports import new_module
from mc_engine.model.record import Model, sources_of

Builder = Callable[[Model, Path | None, int], Callable[..., Any]]  # gives, as `build_kernel`, what is called
FINER_STEPS = 2_000  # of a flight with a finer adaptive clock, which then sees what a step of its own may pass over
_MOST_STEPS = 10**9  # of a flight, as AdaptiveStep's attempts: a year of 0.03 s, a minute of one core
_ENGINE = (
    "flight/kernel.py",
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
from mc_engine.lanes.{tracking} import track

_F, Parameters, Settings, HAS_EVENTS, MUST_STOP, BLOCKS = PARTS
{names} = _F


@compile_kernel
def kernel(
    parameters, settings, data, key, cases, n_steps, h, control_every, {tables}time, status, state, metrics, history,
    rows, stride,
):
    hand_over(BLOCKS, data)
    f, method = Functions({names}), Method(begin, restart, advance, single, track, ({tables}))
    grid, kinds, out = (n_steps, h, control_every), (HAS_EVENTS, MUST_STOP), (time, status, state, metrics)
    fly(
        f, method, Parameters, Settings, {width}, parameters, settings, key, cases, grid, kinds, out, history, rows,
        stride,
    )
'''
_TABLES = "nodes, starts, columns, weights, columns_of, ahead, behind, at_end, n_differences"
_RUNGE_KUTTA = _FIXED.replace("{module}", "fixed_step").replace("{tables}", "")
_MULTISTEP = _FIXED.replace("{module}", "multistep").replace("{tables}", _TABLES + ", ")
_SUMS = "nodes, starts, columns, weights, columns_of, ahead, present, n_accelerations"
_GAUSS_JACKSON = (
    _FIXED.replace("{module}", "gauss_jackson")
    .replace("({tables})", f"({_SUMS}, positions_of, rates_of, in_order)")
    .replace("{tables}", _SUMS + ", ")
    .replace("= _F\n", "= _F\npositions_of, rates_of, in_order = SECOND_ORDER\n")
)
_ADAPTIVE = '''"""A kernel for {width} cases at a time.  Written by the engine; edit the model instead."""

from mc_engine.flight.kernel_parts import Functions
from mc_engine.lanes.adaptive_flight import fly
from mc_engine.lanes.compiler import compile_kernel
from mc_engine.lanes.kernel_data import hand_over
from mc_engine.lanes.lane_access import lane_numbers

_F, Parameters, Settings, HAS_EVENTS, MUST_STOP, BLOCKS = PARTS
{names} = _F


@compile_kernel
def kernel(
    parameters, settings, data, key, cases, nodes, starts, columns, weights, clock, atol, time, status, state, metrics,
    history, rows, pace,
):
    hand_over(BLOCKS, data)
    f = Functions({names})
    tables, out = (nodes, starts, columns, weights), (time, status, state, metrics)
    fly(
        f, tables, Parameters, Settings, {width}, lane_numbers({width}), parameters, settings, key, cases, clock, atol,
        MUST_STOP, out, history, rows, pace,
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
    sources = sources_of(model, folder)
    for name, content in (*sources.named(), *sources.elsewhere.items()):
        digest.update(f"{name}\n{len(content)}\n".encode() + content)
    return digest.hexdigest()


class Registers(NamedTuple):
    """Vector registers of a processor.

    doubles : numbers that one holds.
    few_fixed, few_adaptive : values of a case that kernels on a fixed grid, and adaptive ones, can hold in two each.
    """

    doubles: int
    few_fixed: int
    few_adaptive: int


@cache
def registers() -> Registers:
    """The vector registers of this processor: 32 of AVX-512, else counted as 16 of AVX2, as NEON's 32 of half the size.

    Measured (`python -m tests.benchmarks.lanes`, `mc-engine bench`) on Zen 5, on Zen 4 without AVX-512, and on Zen 3.
    """
    return Registers(8, 18, 12) if binding.get_host_cpu_features().get("avx512f") else Registers(4, 10, 11)


def usual_width(model: Model) -> int:
    """How many cases of a model fly at a time: as many as fill one vector register, or two, which hide latencies.

    For models with few values, two registers a number are up to a third faster.  For models with many values they are
    not, and of 16 registers they take up to 1.5 times as long.  Adaptive steps hold the events and extrema too.  The
    results have the same bits.
    """
    doubles, few_fixed, few_adaptive = registers()
    if isinstance(model.clock, AdaptiveStep):
        few = len(model.states) + len(model.event_list) + len(model.extrema) <= few_adaptive
    else:
        few = len(model.states) <= few_fixed
    return 2 * doubles if few else doubles


@lru_cache(maxsize=64)
def build_kernel(model: Model, folder: Path | None, width: int) -> Kernel:
    """The kernel of `model` for `width` cases at a time: 1 (plain float64), 4, 8 or 16.

    folder : see `sources_of`.  The kernel's first call compiles it or loads it from the cache.
    """
    module = sources_of(model, folder).module
    template = _template(model)
    digest, is_complete = kernel_key(_handed(module.MODEL, model, Recorder()), template)
    if not is_complete:
        what = f"{digest} {source_digest(model, folder)} {module.__name__} {module.__file__}"
        digest = sha256(what.encode()).hexdigest()
    path = cache_folder() / "kernels" / digest[:20] / f"kernel_w{width}.py"
    text = template.format(width=width, names=", ".join(Functions._fields)).encode()
    _write_source(path, text)

    def compiled(form: Form) -> tuple[str, Any]:
        handed = _handed(module.MODEL, model)
        made = new_module(f"mc_engine_kernel_{digest[:20]}_w{width}", path, text, **handed)
        name_and_library: tuple[str, Any] = made.kernel.library(form)
        return name_and_library

    return Kernel(path, compiled)


def _handed(written: Model, model: Model, makers: Any = None) -> dict[str, Any]:
    """The names that a kernel's file does not define itself.

    written : the model as its file has it; model : the same, perhaps with another clock or while it is watched.
    makers : see `functions_of`
    """
    parts = {"PARTS": parts_of(replace(written, clock=model.clock), model.watching, makers)}
    return parts | ({"SECOND_ORDER": second_order_of(model, makers)} if uses_rates(model.clock) else {})


def _template(model: Model) -> str:
    """The text of a kernel's file; methods of one kind share a kernel, which is handed their tables."""
    clock = model.clock
    if isinstance(clock, AdaptiveStep):
        return _ADAPTIVE
    text = _GAUSS_JACKSON if uses_rates(clock) else _RUNGE_KUTTA if clock.method == "rk4" else _MULTISTEP
    return text.replace("{tracking}", tracking_of(model))


def _write_source(path: Path, text: bytes) -> None:
    """Write the source of a kernel, unless it is there.

    The file serves readers, and messages of the compiler.  `text` is what runs, also if the file cannot be written.
    """
    make_kernel_folder(path.parent)
    with suppress(OSError):
        if not path.exists() or path.read_bytes() != text:
            replace_file(path, text)


def make_kernel_folder(path: Path | None = None) -> None:
    """Make the folder of a kernel, by default that of all kernels.

    Where none can be made, a full disk is a DiskError, as in a run; any other cause is a UsageError.
    """
    path = path or cache_folder() / "kernels"
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        kind = DiskError if error.errno in (errno.ENOSPC, errno.EDQUOT) else UsageError
        raise kind(f"{path}: {error.strerror or error}; compiled kernels are kept there, name another folder in "
                   "MC_ENGINE_CACHE") from error  # fmt: skip


# ---- what a kernel takes beside the cases


def clock_number(item: float | str | Callable[[Any], float], settings: Any) -> float:
    if callable(item):
        return float(item(settings))
    return float(getattr(settings, item) if isinstance(item, str) else item)


def grid_of(clock: FixedStep, settings: Any) -> tuple[int, float, int]:
    """(n_steps, step [s], control_every) of one flight; the last step reaches `until`, or goes past it."""
    step, until, every = (clock_number(item, settings) for item in (clock.step, clock.until, clock.control_every))
    if not (step > 0.0 and 0.0 < until <= _MOST_STEPS * step and every >= 1.0):
        raise ModelError(f"the clock has steps of {step:g} s until {until:g} s, control every {every:g} steps; all "
                         f"must be above 0, with no more than {_MOST_STEPS:,} steps")  # fmt: skip
    if every % 1.0:
        raise ModelError(f"the clock's `control_every` is {every:g}; it counts steps, in whole numbers")
    # a hair under the quotient, so that 300 s in steps of 0.01 s are 30 000 steps, not 30 001
    n_steps = max(1, int(np.ceil(until / step - 1e-9)))
    return n_steps, step, int(every)


def finer(clock: FixedStep | AdaptiveStep, flight_s: float) -> FixedStep | AdaptiveStep:
    """The clock with half of its steps, or a tenth of its tolerances and FINER_STEPS steps of a flight at least.

    The control is sampled at the same times.  flight_s : length of the flight [s]
    """
    if isinstance(clock, AdaptiveStep):
        atol = tuple(0.1 * number for number in clock.atol) if isinstance(clock.atol, tuple) else 0.1 * clock.atol
        fields: dict[str, Any] = {
            "rtol": lambda o: 0.1 * clock_number(clock.rtol, o),
            "atol": atol,
            "longest_step": lambda o: min(clock_number(clock.longest_step, o), flight_s / FINER_STEPS),
            "attempts": clock.attempts + 10 * FINER_STEPS,
        }
    else:
        fields = {
            "step": lambda o: 0.5 * grid_of(clock, o)[1],
            "until": lambda o: grid_of(clock, o)[0] * grid_of(clock, o)[1],
            "control_every": lambda o: 2 * grid_of(clock, o)[2],
        }
    return replace(clock, **fields)  # functions of the settings, see `clock_number`


def fixed_arguments(clock: FixedStep, settings: Any) -> tuple[Any, ...]:
    """Grid, and tables of a multistep method, as the kernels on a fixed grid take them."""
    if clock.method == "rk4":
        return grid_of(clock, settings)
    if uses_rates(clock):
        from mc_engine.lanes.gauss_jackson import gauss_jackson_tables

        return *grid_of(clock, settings), *gauss_jackson_tables(clock.method)
    from mc_engine.lanes.multistep import multistep_tables

    return *grid_of(clock, settings), *multistep_tables(clock.method)


def adaptive_arguments(model: Model, clock: AdaptiveStep, settings: Any) -> tuple[np.ndarray, ...]:
    """Tables of the pair, clock and absolute tolerances, as the adaptive kernels take them."""
    pair = PAIRS[clock.method]
    given = clock.until, clock.rtol, clock.control_period, clock.longest_step
    until, rtol, period, longest = (clock_number(item, settings) for item in given)
    if not all(number > 0.0 for number in (until, rtol, period, longest)):
        raise ModelError(f"the clock has until = {until:g} s, rtol = {rtol:g}, control_period = {period:g} s, "
                         f"longest_step = {longest:g} s; all must be above 0")  # fmt: skip
    numbers = [until, rtol, period, float(clock.attempts), clock.first_step, longest, float(pair.order)]
    return *pair.tables(), np.array(numbers), np.array(np.broadcast_to(clock.atol, len(model.states)), dtype=np.float64)
