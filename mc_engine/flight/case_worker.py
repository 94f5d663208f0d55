"""The process that flies the cases of a simulator for one worker: a crash, a leak or a hang of a case costs that case.

`mc_engine.flight.case_process` starts it, sends orders through a socket and reads one reply for each case, or one for
a batch.  What a case prints goes into files, of which the end is kept where the case fails.
"""

import errno
import json
import math
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

from mc_engine.errors import EngineError
from mc_engine.flight.flyer import NOMINAL_NOISE
from mc_engine.flight.program_flight import Flown, ProgramFlight, end_children, flown, own_children
from mc_engine.model.faults import fault_of
from mc_engine.model.simulator import Refuse, Simulator, load_simulator
from mc_engine.sampling.streams import stream
from mc_engine.status import CRASHED, MEMORY_LIMIT, NO_RESULT, NOT_FINITE, OK, REFUSED
from mc_engine.text import clean

IDLE_S = 10.0  # without an order, after which the process ends and frees what `start` took
STDOUT, STDERR = "stdout.txt", "stderr.txt"
MOST_KEPT, KEPT_BYTES = 1000, 2**16  # folders of failed cases in a run; of each stream
_LONGEST_REASON = 600  # characters
_MIB = 2**20
_STREAM, _SEED = "simulator.rng", "simulator.seed"  # names with a dot, which no dispersion has


@dataclass(frozen=True)
class Setup:
    """What the process needs to know.  simulator : of a program; of a Python simulator None, and it is loaded."""

    reference: str
    directory: str
    digest: str
    seed: int
    simulator: Simulator | None
    memory_mib: float | None


@dataclass(frozen=True)
class Order:
    """Cases to fly: a column of values per input, and what addresses their noise.  keep : folder of kept cases."""

    inputs: Mapping[str, Any]
    noise: np.ndarray
    history: bool = False
    keep: str | None = None


class Case:
    """What the function of a simulator learns of its case, beside the inputs."""

    def __init__(self, noise: int, seed: int, folder: Path, shared: Any):
        self.id = -1 if noise == NOMINAL_NOISE else noise
        self.shared = shared
        self._noise, self._campaign_seed, self._folder = noise, seed, folder

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
        self._folder.mkdir(parents=True)
        return self._folder


class BatchCase:
    """The same for many cases at a time: arrays of `id` and `seed`, and a list of generators."""

    def __init__(self, cases: list[Case], shared: Any):
        self.id = np.array([case.id for case in cases])
        self.shared, self._cases = shared, cases

    @cached_property
    def seed(self) -> np.ndarray:
        return np.array([case.seed for case in self._cases], dtype=np.uint64)

    @cached_property
    def rng(self) -> list[np.random.Generator]:
        return [case.rng for case in self._cases]

    @property
    def folder(self) -> Path:
        return self._cases[0].folder


class Worker:
    """Flies orders by one simulator, whose files lie in the folder `work`."""

    def __init__(self, setup: Setup, work: Path):
        self._seed, self._work = setup.seed, work
        self._simulator = setup.simulator or _loaded(setup)
        self._shared, self._program = None, None
        if self._simulator.program is not None:
            self._program = ProgramFlight(self._simulator, work / "home")
        elif self._simulator.start is not None:
            self._shared = self._simulator.start()
        self._before = own_children()  # which `start` may have begun, and which live on

    def fly(self, order: Order, reply: Callable[[Any], None]) -> None:
        """Fly the cases of an order in turn; one reply for each, or one for a batch."""
        if self._simulator.batch:
            reply(self._batch(order))
            return
        names = [*order.inputs]
        columns = [np.asarray(order.inputs[name]).tolist() for name in names]
        for place, noise in enumerate(order.noise.tolist()):
            inputs = {name: values[place] for name, values in zip(names, columns, strict=True)}
            reply(self._one(inputs, noise, order))

    def _one(self, inputs: dict[str, Any], noise: int, order: Order) -> Flown:
        name = folder_name(noise)
        case = Case(noise, self._seed, self._work / name, self._shared)
        if self._program is not None:
            result = self._program.fly(inputs, case, order.history)
        else:
            result = self._called(inputs, case, order.history)
            end_children(self._before)
        sys.stdout.flush()
        sys.stderr.flush()
        keep = None if order.keep is None else Path(order.keep)
        settle(self._simulator.keep, self._work, name, result.status, keep, inputs)
        return result

    def _called(self, inputs: dict[str, Any], case: Any, history: bool) -> Flown:
        """What the function gives for one case."""
        assert self._simulator.fly is not None  # no program
        try:
            given = self._simulator.fly(inputs, case)
            return read_metrics(self._simulator, given, history)
        except BaseException as error:
            return _failed(error, self._simulator.reference)

    def _batch(self, order: Order) -> Any:
        """(metrics by name, Flown for all, history): arrays [n]; of an error, Flown with its status alone."""
        assert self._simulator.fly is not None  # no program
        n = order.noise.size
        cases = [Case(noise, self._seed, self._work / folder_name(noise), None) for noise in order.noise.tolist()]
        inputs = {name: np.asarray(values) for name, values in order.inputs.items()}
        try:
            given = self._simulator.fly(inputs, BatchCase(cases, self._shared))
            metrics, history = given if isinstance(given, tuple) else (given, None)
            if problem := _problem_of(self._simulator, metrics):
                return flown(NO_RESULT, problem)
            arrays = {}
            for metric in self._simulator.metrics:
                column = np.asarray(metrics[metric.name], dtype=np.float64)
                if column.shape != (n,):
                    return flown(NO_RESULT, f'"{metric.name}" has the shape {column.shape}; it must be ({n},)')
                arrays[metric.name] = column
            result = flown(OK, "", history=_history(self._simulator, history) if order.history else None)
            return arrays, result
        except BaseException as error:
            return _failed(error, self._simulator.reference)
        finally:
            end_children(self._before)
            shutil.rmtree(self._work / folder_name(int(order.noise[0])), ignore_errors=True)


def _loaded(setup: Setup) -> Simulator:
    """The simulator of a file or module; EngineError if it is another one than the run was begun with."""
    simulator = load_simulator(setup.reference, Path(setup.directory))
    if simulator.digest() != setup.digest:
        raise EngineError(f"{setup.reference}: was changed while its cases were flying; begin again")
    return simulator


def _failed(error: BaseException, reference: str) -> Flown:
    """How a case ended whose function raised an error."""
    if isinstance(error, Refuse):
        return flown(REFUSED, str(error) or "refused without a reason")
    if isinstance(error, MemoryError):
        return flown(MEMORY_LIMIT, "needed more memory than the simulator may have")
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        raise error
    if not isinstance(error, Exception):
        return flown(CRASHED, f"{reference}: ends its process by {type(error).__name__}({error})")
    return flown(CRASHED, fault_of(error, reference))


def read_metrics(simulator: Simulator, given: Any, history: bool) -> Flown:
    """The metrics in what a function returned."""
    metrics, table = given if isinstance(given, tuple) and len(given) == 2 else (given, None)
    if problem := _problem_of(simulator, metrics):
        return flown(NO_RESULT, problem)
    values = {}
    for metric in simulator.metrics:
        try:
            values[metric.name] = float(metrics[metric.name])
        except (TypeError, ValueError):
            return flown(NO_RESULT, f'"{metric.name}" is {clean(repr(metrics[metric.name])[:60])}, which is no number')
    if lost := lost_metric(simulator, values):
        return flown(NOT_FINITE, lost)
    return flown(OK, "", values, _history(simulator, table) if history else None)


def lost_metric(simulator: Simulator, values: Mapping[str, float]) -> str:
    """The first metric that is infinite or not a number, as a sentence; empty if there is none."""
    for metric in simulator.metrics:
        value = values[metric.name]
        if math.isinf(value) or (math.isnan(value) and not metric.sometimes):
            return f'"{metric.name}" is {"not a number" if math.isnan(value) else "infinite"}'
    return ""


def _problem_of(simulator: Simulator, metrics: Any) -> str:
    """What is wrong with the names of the metrics that a function returned; empty if nothing."""
    if not isinstance(metrics, Mapping):
        return f"`fly` returned {type(metrics).__name__}; it must be a mapping of the metrics"
    names = [metric.name for metric in simulator.metrics]
    if missing := [name for name in names if name not in metrics]:
        return f'the metric "{missing[0]}" is missing'
    if unknown := [name for name in metrics if name not in names]:
        return f'"{clean(str(unknown[0]))}" is no metric of the simulator'
    return ""


def _history(simulator: Simulator, table: Any) -> dict[str, np.ndarray]:
    """The history of a case by column; ValueError with a sentence if a column is missing."""
    if not simulator.outputs or table is None:
        return {}
    names = ["t_s", *(output.name for output in simulator.outputs)]
    if missing := [name for name in names if name not in table]:
        raise ValueError(f'the history has no column "{missing[0]}"')
    return {name: np.asarray(table[name], dtype=np.float64) for name in names}


def folder_name(noise: int) -> str:
    """The name of a case's folder."""
    return "nominal" if noise == NOMINAL_NOISE else f"case-{noise:07d}"


def settle(rule: str, work: Path, name: str, status: int, keep: Path | None, inputs: Mapping[str, Any]) -> None:
    """Keep or remove what a case left behind, and empty the files of its streams.  rule : whose folders are kept."""
    folder = work / name
    wanted = keep is not None and (rule == "all" or (rule == "failed" and status != OK))
    if wanted and (rule == "all" or not keep.is_dir() or len(os.listdir(keep)) < MOST_KEPT):  # type: ignore[union-attr]
        assert keep is not None
        folder.mkdir(exist_ok=True)
        if not (folder / "case.json").exists():
            (folder / "case.json").write_text(json.dumps(dict(inputs), default=str))
        for file in (STDOUT, STDERR):
            if text := end_of(work / file):
                (folder / file).write_bytes(text)
        target = keep / name
        keep.mkdir(exist_ok=True)
        if target.is_dir() and not target.is_symlink():
            shutil.rmtree(target)
        shutil.move(folder, target)
    elif folder.exists():
        shutil.rmtree(folder, ignore_errors=True)
    for file in (STDOUT, STDERR):
        with suppress(OSError):
            if os.stat(work / file).st_size:
                os.truncate(work / file, 0)


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
    end_children(set())
    shutil.rmtree(work, ignore_errors=True)
    os._exit(1)


def _end_at_once(*_: Any) -> None:
    end_children(set())
    os._exit(1)


def _prepare_process(work: Path, parent: int, memory_mib: float | None, of_program: bool) -> None:
    from mc_engine.flight.program_flight import adopt_orphans, die_with_parent

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes of a terminal; the parent decides
    signal.signal(signal.SIGTERM, _end_at_once)
    die_with_parent(parent, signal.SIGTERM if of_program else signal.SIGKILL)
    adopt_orphans()
    threading.Thread(target=_end_with, args=(parent, work), daemon=True).start()
    if memory_mib is not None and sys.platform.startswith("linux"):
        import resource

        limit = int(memory_mib * _MIB)
        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))


def main(descriptor: int, work: Path, parent: int) -> None:
    """Serve orders until the other end closes, or none comes for a while."""
    import faulthandler

    faulthandler.enable()  # a crash in compiled code names the line of Python
    connection: Connection[Any, Any] = Connection(descriptor)
    setup = connection.recv()
    _prepare_process(work, parent, setup.memory_mib, setup.simulator is not None)
    try:
        worker = Worker(setup, work)
    except BaseException as error:
        text = str(error) if isinstance(error, EngineError) else fault_of(error, setup.reference)  # type: ignore[arg-type]
        connection.send(f"`start` failed: {text}" if not isinstance(error, EngineError) else text)
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


if __name__ == "__main__":
    _work = Path(sys.argv[2])
    try:
        main(int(sys.argv[1]), _work, int(sys.argv[3]))
    finally:
        end_children(set())
        shutil.rmtree(_work, ignore_errors=True)
