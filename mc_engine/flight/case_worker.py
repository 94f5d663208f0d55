"""The process that flies a simulator's cases for one worker: a crash, leak or hang of a case costs only that case.

`mc_engine.flight.case_process` starts it, sends orders through a socket and reads one reply for each case, or one for
a batch.  The output of a case is written to files; if the case fails, the end of them is kept.
"""

import errno
import json
import os
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.errors import EngineError, StoreError
from mc_engine.flight.flyer import NOMINAL_NOISE
from mc_engine.flight.program_flight import Flown, ProgramFlight, flown
from mc_engine.model.faults import fault_of, text_of
from mc_engine.model.simulator import Refuse, Simulator, in_time, load_simulator, numeric
from mc_engine.model.sources import leave_importable
from mc_engine.process_tree import adopt_orphans, die_with_parent, end_children, hold_when_terminated, own_children
from mc_engine.sampling.streams import stream
from mc_engine.status import CRASHED, MEMORY_LIMIT, NO_RESULT, NOT_FINITE, OK, REFUSED
from mc_engine.store.case_rows import MOST_KEPT, RowLog, keep_case
from mc_engine.text import clean

IDLE_S = 10.0  # without an order, after which the process ends and frees what `start` took
STDOUT, STDERR = "stdout.txt", "stderr.txt"
KEPT_BYTES = 2**16  # of each stream
_MIB = 2**20
_STREAM, _SEED = "simulator.rng", "simulator.seed"  # names with a dot, which no dispersion has


@dataclass(frozen=True)
class Setup:
    """What the process needs to know.  simulator : of a program or an FMU; else None, and it is loaded from files."""

    reference: str
    directory: str
    digest: str
    seed: int
    simulator: Simulator | None
    memory_mib: float | None


@dataclass(frozen=True)
class Order:
    """Cases to fly: a column of values per input, and what addresses their noise.

    keep : run directory.  log : of their rows, which are added in this process; None adds none.
    """

    inputs: Mapping[str, Any]
    noise: np.ndarray
    history: bool = False
    keep: str | None = None
    log: RowLog | None = None


class Case:
    """The second argument of a simulator's function: the case, without its inputs."""

    def __init__(self, noise: int, seed: int, work: Path, shared: Any):
        self.id = -1 if noise == NOMINAL_NOISE else noise
        self.shared = shared
        self._noise, self._campaign_seed, self._work = noise, seed, work

    @cached_property
    def seed(self) -> int:
        """A whole number of 64 bits."""
        return int(stream(self._campaign_seed, _SEED, self._noise).integers(2**64, dtype=np.uint64))

    @cached_property
    def rng(self) -> np.random.Generator:
        """The generator of this case, of Philox."""
        return stream(self._campaign_seed, _STREAM, self._noise)

    @cached_property
    def folder(self) -> Path:
        """A folder of its own, empty at first."""
        folder = self._work / folder_name(self._noise)
        folder.mkdir(parents=True)
        return folder


class BatchCase:
    """The second argument for many cases at a time: arrays of `id` and `seed`, and a list of generators."""

    def __init__(self, noise: np.ndarray, seed: int, work: Path, shared: Any):
        self.id = np.where(noise == NOMINAL_NOISE, -1, noise)
        self.shared = shared
        self._first = Case(int(noise[0]), seed, work, shared)
        self._noise, self._campaign_seed = noise, seed

    @cached_property
    def _cases(self) -> list[Case]:
        """Without folders of their own."""
        return [Case(noise, self._campaign_seed, Path(), None) for noise in self._noise.tolist()]

    @cached_property
    def seed(self) -> np.ndarray:
        return np.array([case.seed for case in self._cases], dtype=np.uint64)

    @cached_property
    def rng(self) -> list[np.random.Generator]:
        return [case.rng for case in self._cases]

    @property
    def folder(self) -> Path:
        return self._first.folder


class Worker:
    """Flies orders by one simulator, whose files lie in the folder `work`."""

    def __init__(self, setup: Setup, work: Path):
        self._seed, self._work, self._process = setup.seed, work, os.getpid()
        self._simulator = setup.simulator or _loaded(setup, work)
        self._shared, self._program, self._fly = None, None, self._simulator.fly
        if self._simulator.program is not None:
            self._program = ProgramFlight(self._simulator, work / "home")
        elif self._simulator.fmu is not None:
            from mc_engine.flight.fmu_flight import FmuFlight

            self._fly = FmuFlight(self._simulator.fmu, work / "home").fly
        elif self._simulator.start is not None:
            self._shared = self._simulator.start()
        self._before = own_children()  # which `start` may have begun, and which live on
        self._streams = {1: ("stdout", sys.stdout, os.dup(1)), 2: ("stderr", sys.stderr, os.dup(2))}
        self._folder = os.open(".", os.O_RDONLY)  # in which every case begins, wherever the one before it went

    def fly(self, order: Order, reply: Callable[[Any], None]) -> None:
        """Fly the cases of an order in turn; one reply for each, or one for a batch."""
        if self._simulator.batch:
            reply(self._batch(order))
            return
        columns = {name: np.asarray(values).tolist() for name, values in order.inputs.items()}
        metrics = [metric.name for metric in self._simulator.metrics]
        try:
            for place, noise in enumerate(order.noise.tolist()):
                inputs = {name: values[place] for name, values in columns.items()}
                result = self._one(inputs, noise, order)
                if order.log is not None:
                    order.log.add(place, result.row(metrics))
                reply(result)
        finally:
            if order.log is not None:
                order.log.close()

    def _one(self, inputs: dict[str, Any], noise: int, order: Order) -> Flown:
        name = folder_name(noise)
        case = Case(noise, self._seed, self._work, self._shared)
        if self._program is not None:
            result = self._program.fly(inputs, case, order.history)
        else:
            result = self._called(_read, dict(inputs), case, order.history)  # a copy, which the function may change
        for stream_ in (sys.stdout, sys.stderr):
            with suppress(ValueError, AttributeError):  # of one that the function closed or replaced
                stream_.flush()
        settle(self._simulator.keep, self._work, name, result.status, Path(order.keep) if order.keep else None, inputs)
        _renew_streams(self._streams)
        return result

    def _batch(self, order: Order) -> Any:
        """(metrics by name, Flown of all with the history): arrays [n]; of an error, Flown with its status alone."""
        inputs = {name: np.asarray(values) for name, values in order.inputs.items()}
        cases = BatchCase(order.noise, self._seed, self._work, self._shared)
        try:
            return self._called(_read_batch, inputs, cases, order)
        finally:
            shutil.rmtree(self._work / folder_name(int(order.noise[0])), ignore_errors=True)
            _renew_streams(self._streams)

    def _called(self, read: Callable[..., Any], inputs: Mapping[str, Any], case: Any, how: Any) -> Any:
        """What `read` finds in what the function returns, or Flown with the status of what is wrong with it."""
        assert self._fly is not None  # no program
        try:
            given = self._fly(inputs, case)
        except BaseException as error:
            return _failed(error, self._simulator.reference)
        finally:
            if os.getpid() != self._process:  # a copy by os.fork, whose reply would be taken for that of another case
                os._exit(1)
            signal.setitimer(signal.ITIMER_REAL, 0.0)  # an alarm would ring in another case
            end_children(self._before)
            os.fchdir(self._folder)
            for descriptor, (_, _, kept) in self._streams.items():
                os.dup2(kept, descriptor)  # which the function may have closed
        try:
            return read(self._simulator, given, how)
        except ValueError as fault:
            return flown(NO_RESULT, str(fault))
        except BaseException as error:  # of the user's own mapping
            return _failed(error, self._simulator.reference)


def _loaded(setup: Setup, work: Path) -> Simulator:
    """The simulator of a file or module; EngineError if it is another one than the run was begun with."""
    simulator = load_simulator(setup.reference, Path(setup.directory))
    if simulator.digest() != setup.digest:
        raise EngineError(f"{setup.reference}: was changed while its cases were flying; begin again")
    leave_importable(simulator.sources, work / "modules")
    return simulator


def _failed(error: BaseException, reference: str) -> Flown:
    """How a case ended whose function raised an error."""
    if isinstance(error, Refuse):
        return flown(REFUSED, text_of(error) or "refused without a reason")
    if isinstance(error, MemoryError):
        error.__traceback__ = error.__context__ = None  # they hold what fills the memory, of which a reply needs some
        return flown(MEMORY_LIMIT, "needed more memory than the simulator may have")
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        raise error
    if not isinstance(error, Exception):
        return flown(CRASHED, f"{reference}: ends its process by {type(error).__name__}({text_of(error)})")
    return flown(CRASHED, fault_of(error, reference))


def _read(simulator: Simulator, given: Any, history: bool) -> Flown:
    """The metrics in what a function returned; ValueError with a sentence where they are not there.

    A history is read of every case, so that its status is the same whether its history is kept or not.
    """
    metrics, table = _parts(simulator, given)
    values = {}
    for metric in simulator.metrics:
        try:
            values[metric.name] = float(numeric(metrics[metric.name]))
        except (TypeError, ValueError):
            value = clean(repr(metrics[metric.name])[:60])
            raise ValueError(f'"{metric.name}" is {value}, which is no number') from None
    if lost := simulator.lost_metric(values):
        return flown(NOT_FINITE, lost)
    past, left_out = _history(simulator, table)
    return flown(OK, "", values, past if history else None)._replace(left_out=left_out)


def _read_batch(simulator: Simulator, given: Any, order: Order) -> tuple[dict[str, np.ndarray], Flown]:
    """The same of many cases, each of which may end not-finite by itself."""
    metrics, table = _parts(simulator, given)
    arrays = {}
    for metric in simulator.metrics:
        try:
            column = np.asarray(numeric(metrics[metric.name]), dtype=np.float64)
        except (TypeError, ValueError):
            raise ValueError(f'"{metric.name}" is no array of numbers') from None
        if column.shape != order.noise.shape:
            raise ValueError(f'"{metric.name}" has the shape {column.shape}; it must be {order.noise.shape}')
        arrays[metric.name] = column
    past, left_out = _history(simulator, table)
    return arrays, flown(OK, "", history=past if order.history else None)._replace(left_out=left_out)


def _parts(simulator: Simulator, given: Any) -> tuple[Mapping[str, Any], Any]:
    """(metrics, history or None) that a function returned; ValueError where the metrics are not those declared."""
    metrics, table = given if isinstance(given, tuple) and len(given) == 2 else (given, None)
    if not isinstance(metrics, Mapping):
        raise ValueError(f"`fly` returned {type(metrics).__name__}; it must be a mapping of the metrics")
    names = [metric.name for metric in simulator.metrics]
    if missing := [name for name in names if name not in metrics]:
        raise ValueError(f'the metric "{missing[0]}" is missing')
    if unknown := [name for name in metrics if name not in names]:
        raise ValueError(f'"{clean(str(unknown[0]))}" is no metric of the simulator')
    return metrics, table


def _history(simulator: Simulator, table: Any) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """(history of a case by column, names of columns that are no outputs); ValueError with a sentence without it."""
    wanted = ("t_s", *(output.name for output in simulator.outputs))
    known = table if isinstance(table, Mapping) else getattr(table, "columns", None)
    left_out = tuple(clean(str(name)) for name in (() if known is None else known) if name not in wanted)
    if not simulator.outputs or table is None:
        return {}, left_out
    if known is None:
        raise ValueError(f"the history is a {type(table).__name__}; it must be a DataFrame")
    columns = {}
    for name in wanted:
        if name not in known:
            raise ValueError(f'the history has no column "{name}"')
        try:
            columns[name] = np.asarray(numeric(table[name]), dtype=np.float64)
        except (TypeError, ValueError):
            raise ValueError(f'the column "{name}" of the history is no numbers') from None
    if len(counts := {np.size(column): None for column in columns.values()}) > 1:
        raise ValueError(f"columns of the history have {' and '.join(map(str, counts))} rows")
    return in_time(columns), left_out


def folder_name(noise: int) -> str:
    """The name of a case's folder."""
    return "nominal" if noise == NOMINAL_NOISE else f"case-{noise:07d}"


def settle(rule: str, work: Path, name: str, status: int, keep: Path | None, inputs: Mapping[str, Any]) -> None:
    """Keep or remove what a case left behind.

    rule : whose folders are kept.  keep : the run directory, or None.
    """
    if keep is not None and (rule == "all" or (rule == "failed" and status != OK)):
        folder = work / name
        texts = {file: text for file in (STDOUT, STDERR) if (text := end_of(folder / file) or end_of(work / file))}
        if not (folder / "case.json").exists():
            texts["case.json"] = json.dumps(dict(inputs), default=str).encode()
        keep_case(keep, name, folder, texts, None if rule == "all" else MOST_KEPT)
    if os.path.exists(f"{work}/{name}"):
        shutil.rmtree(work / name, ignore_errors=True)


def _renew_streams(streams: Mapping[int, tuple[str, Any, int]]) -> None:
    """Empty the files of stdout and stderr, and give both, by file descriptor, back to this process after a case."""
    for descriptor, (name, own, _) in streams.items():
        if os.fstat(descriptor).st_size:
            os.ftruncate(descriptor, 0)
        if getattr(own, "closed", False):
            own = open(descriptor, "w", buffering=1, errors="backslashreplace", closefd=False)
        setattr(sys, name, own)


def end_of(path: Path) -> bytes:
    """The last bytes of a file; empty if it is not there."""
    try:
        with path.open("rb") as file:
            file.seek(max(0, path.stat().st_size - KEPT_BYTES))
            return file.read(KEPT_BYTES)
    except OSError:
        return b""


def _end_with(parent: int, work: Path) -> None:
    """End this process when its parent has died."""
    while os.getppid() == parent:
        time.sleep(0.5)
    shutil.rmtree(work, ignore_errors=True)
    _end_at_once()


def _end_at_once(*_: Any) -> None:
    end_children(set())
    os._exit(1)


def _prepare_process(work: Path, parent: int, memory_mib: float | None, of_program: bool) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes of a terminal; the parent decides
    hold_when_terminated()
    die_with_parent(parent, _end_at_once if of_program else None)
    adopt_orphans()
    threading.Thread(target=_end_with, args=(parent, work), daemon=True).start()
    if memory_mib is not None and sys.platform.startswith("linux"):
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (int(memory_mib * _MIB),) * 2)


def main(descriptor: int, work: Path, parent: int) -> None:
    """Serve orders until the other end closes, or none comes for a while; then nothing of its cases is left."""
    try:
        _serve(descriptor, work, parent)
    finally:
        end_children(set())
        shutil.rmtree(work, ignore_errors=True)


def _serve(descriptor: int, work: Path, parent: int) -> None:
    import faulthandler

    faulthandler.enable()  # a crash in compiled code names the line of Python
    connection: Connection[Any, Any] = Connection(descriptor)
    setup = connection.recv()
    program = setup.simulator is not None and setup.simulator.program is not None
    _prepare_process(work, parent, setup.memory_mib, program)
    try:
        worker = Worker(setup, work)
    except BaseException as error:
        text = str(error) if isinstance(error, EngineError) else f"`start` failed: {fault_of(error, setup.reference)}"
        connection.send(text)
        return
    connection.send("")
    with suppress(EOFError, ConnectionError):
        while connection.poll(IDLE_S):
            order = connection.recv()
            if order is None:  # are you there
                connection.send("")
                continue
            try:
                worker.fly(order, connection.send)
            except OSError as error:  # of the disk, not of a case
                connection.send(f"{error.filename or work}: {error.strerror}")
            except StoreError as error:  # of the run directory
                connection.send(error)
