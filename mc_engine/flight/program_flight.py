"""Flight of one case by a program: its files, its start, its limits, its results, and the files that it leaves."""

import csv
import errno
import io
import json
import os
import re
import selectors
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from traceback import extract_tb
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from mc_engine.model.program import JSON_INPUT, template_environment
from mc_engine.model.simulator import Simulator, in_time
from mc_engine.numbers_in_text import counted, is_number
from mc_engine.process_tree import end_children, how_it_ended, kill_group, last_lines, memory_mib, without_work
from mc_engine.status import CRASHED, MEMORY_LIMIT, NO_RESULT, NOT_FINITE, OK, STATUS_NAME, TIME_LIMIT
from mc_engine.text import clean

if TYPE_CHECKING:
    from mc_engine.flight.case_worker import Case

PROGRAM_ID = "program_id"  # file with the process group of the program in flight, for whoever must end it
BOUNDED_S, TEMPLATE_MIB = 10.0, 2048  # that a template or a pattern may take for one case
JOB_ENDS_S = 0.2  # in which all processes of a job that is ended have SIGTERM: this one is then held up, and ended
_FORTRAN = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)[dD][+-]?\d+")  # a number that `is_number` does not take
LOOK_EVERY_S = 0.02  # between two looks at the memory of a program, and whether it has ended
MOST_STDOUT, MOST_STDERR, MOST_RESULT = 2**24, 2**16, 2**26  # bytes
_MIB, _LINUX = 2**20, sys.platform.startswith("linux")


class Flown(NamedTuple):
    """How a case ended.  metrics, history : by column, perhaps empty.  left_out : of the history, as no outputs."""

    status: int
    reason: str
    metrics: dict[str, float]
    history: dict[str, np.ndarray]
    left_out: tuple[str, ...] = ()

    def row(self, names: Sequence[str]) -> dict[str, Any]:
        """Status, reason and metrics by column; NaN for a metric that is missing."""
        metrics = {name: self.metrics.get(name, float("nan")) for name in names}
        return {"status": STATUS_NAME[self.status], "reason": self.reason, **metrics}


def flown(
    status: int, reason: str, metrics: dict[str, float] | None = None, history: dict[str, np.ndarray] | None = None
) -> Flown:
    return Flown(status, clean(" ".join(without_work(reason).split()))[:600], metrics or {}, history or {})


@dataclass
class _Ended:
    """A program that has ended.  limit : the status of the limit that ended it, or OK."""

    code: int
    stdout: bytes = b""
    stderr: bytes = b""
    limit: int = OK
    peak_mib: float = 0.0


class ProgramFlight:
    """Starts the program of a simulator.  home : folder in which the files are laid out that it is made of."""

    def __init__(self, simulator: Simulator, home: Path):
        assert simulator.program is not None  # the caller looked
        self._simulator, self._program, self._home = simulator, simulator.program, home
        for name, content in self._program.files.items():
            path = home / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
            path.chmod(0o755)

    def fly(self, inputs: Mapping[str, Any], case: "Case", history: bool) -> Flown:
        """Fly one case in its own folder."""
        folder = case.folder
        try:
            self._write_inputs(folder, inputs, case)
        except TemplateFault as fault:
            return flown(CRASHED, str(fault))
        words = {"folder": str(folder), "case_id": case.id, "seed": case.seed, "home": str(self._home)}
        command = [word.format(**words) for word in self._program.command]
        try:
            ended = self._run(command, folder)
        except OSError as error:
            return flown(CRASHED, f"{Path(command[0]).name} cannot be started: {_start_fault(command[0], error)}")
        finally:
            end_children(set())
        for name, written in (("stdout.txt", ended.stdout[-MOST_STDERR:]), ("stderr.txt", ended.stderr)):
            # without, where the program removed its folder or has a folder of that name
            with suppress(FileNotFoundError, IsADirectoryError, PermissionError):
                (folder / name).unlink(missing_ok=True)
                (folder / name).write_bytes(written)
        if sentence := self._ended_badly(ended):
            return flown(*sentence)
        try:
            return self._results(folder, ended.stdout, inputs, history)
        except (ValueError, OSError, RecursionError) as error:
            return flown(NO_RESULT, str(error))

    def _write_inputs(self, folder: Path, inputs: Mapping[str, Any], case: "Case") -> None:
        known = {**inputs, "case_id": case.id, "seed": case.seed}
        for name, kind in self._program.inputs.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            text = json.dumps(known, indent=1) if kind == JSON_INPUT else _rendered(name, kind, known)
            path.write_text(text, encoding="utf-8")

    def _run(self, command: list[str], folder: Path) -> _Ended:
        """Run the command until it ends or exceeds a limit; then nothing of its process group is left."""
        process = subprocess.Popen(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        (self._home.parent / PROGRAM_ID).write_text(str(process.pid))
        assert process.stdout is not None
        assert process.stderr is not None
        limit, begin, streams = OK, time.monotonic(), {"stdout": bytearray(), "stderr": bytearray()}
        with selectors.DefaultSelector() as selector, process.stdout, process.stderr:
            for name, pipe, most in (("stdout", process.stdout, MOST_STDOUT), ("stderr", process.stderr, MOST_STDERR)):
                os.set_blocking(pipe.fileno(), False)
                selector.register(pipe, selectors.EVENT_READ, (streams[name], most))
            while True:
                _read_ready(selector, LOOK_EVERY_S)
                if not selector.get_map():
                    time.sleep(0.0005)  # it has closed its streams, and ends
                if os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None:
                    break
                limit = self._exceeded(process.pid, time.monotonic() - begin)
                if limit != OK:
                    break
            kill_group(process.pid)
            (self._home.parent / PROGRAM_ID).unlink()
            _, code, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(code)
            _read_ready(selector, 0.0)
        peak = usage.ru_maxrss * (1024 if _LINUX else 1) / _MIB
        return _Ended(process.returncode, bytes(streams["stdout"]), bytes(streams["stderr"]), limit, peak)

    def _exceeded(self, pid: int, seconds: float) -> int:
        """The status of the limit that a program exceeds, or OK."""
        if self._simulator.time_limit_s is not None and seconds > self._simulator.time_limit_s:
            return TIME_LIMIT
        most = self._simulator.memory_limit_mib
        return MEMORY_LIMIT if most is not None and memory_mib(pid) > most else OK

    def _ended_badly(self, ended: _Ended) -> tuple[int, str] | None:
        """Status and reason of a program that did not end by itself with exit code 0."""
        most = self._simulator.memory_limit_mib
        if ended.limit == TIME_LIMIT:
            return TIME_LIMIT, f"took longer than {self._simulator.time_limit_s:g} s"
        if ended.limit == MEMORY_LIMIT or (most is not None and ended.peak_mib > most and ended.code):
            return MEMORY_LIMIT, f"needed more than {most:g} MiB"
        if ended.code == 0:
            return None
        if ended.code == -signal.SIGTERM:
            time.sleep(JOB_ENDS_S)
        return CRASHED, f"{how_it_ended(ended.code)}{last_lines(ended.stderr)}"

    def _results(self, folder: Path, stdout: bytes, inputs: Mapping[str, Any], history: bool) -> Flown:
        """Metrics and history that a program wrote; ValueError with a sentence where they are not there."""
        document = None if self._program.result is None else _document(folder, self._program.result)
        if self._program.echo is not None and (difference := _input_difference(document, self._program.echo, inputs)):
            return flown(NO_RESULT, difference)
        text, values = stdout.decode(errors="replace"), {}
        for metric in self._simulator.metrics:
            path, pattern = self._program.reads[metric.name]
            values[metric.name] = _number(metric.name, document, path, pattern, text, metric.sometimes)
        if lost := self._simulator.lost_metric(values):
            return flown(NOT_FINITE, lost)
        past = self._history(folder)
        return flown(OK, "", values, past if history else None)

    def _history(self, folder: Path) -> dict[str, np.ndarray]:
        if self._program.history is None or not self._simulator.outputs:
            return {}
        names, table = _table(folder, self._program.history)
        wanted = ["t_s", *(output.name for output in self._simulator.outputs)]
        if wrong := [name for name in wanted[1:] if names.count(name) != 1]:
            found = "two columns" if wrong[0] in names else "no column"
            raise ValueError(f'{self._program.history} has {found} "{wrong[0]}"')
        places = [0, *(names.index(name) for name in wanted[1:])]  # the first column is the time, whatever its name
        return in_time({name: table[:, place] for name, place in zip(wanted, places, strict=True)})


def _start_fault(program: str, error: OSError) -> str:
    """Why the system does not start a program, of which it says the same where the first line of a script is wrong."""
    if error.errno == errno.ENOEXEC:
        return "it is no program for this machine, and no script, whose first line is such as #!/bin/sh"
    if error.errno == errno.ENOENT and Path(program).is_file():
        with open(program, "rb") as file:
            mark, _, interpreter = file.readline(4096).decode(errors="replace").rstrip("\n").partition("#!")
        if interpreter and not mark:
            return f'its first line names "{clean(interpreter.strip(" "))}", which is not there'
    return error.strerror or str(error)


class TemplateFault(Exception):
    """A template that gives no text for a case."""


def _rendered(name: str, template: str, known: Mapping[str, Any]) -> str:
    """The text of a template.  name : of the file that it is for.  Raises TemplateFault."""
    try:
        with _bounded():
            return str(_compiled(template).render(known))
    except MemoryError:
        raise TemplateFault(f"the template of {name} needs more than {TEMPLATE_MIB} MiB") from None
    except Exception as error:  # of what stands in the template
        lines = [frame.lineno for frame in extract_tb(error.__traceback__) if frame.filename == "<template>"]
        place = f", line {lines[-1]}" if lines else ""
        raise TemplateFault(f"the template of {name}{place}: {error}") from None


@contextmanager
def _bounded() -> Iterator[None]:
    """Within, this process has limits of time and memory, where the system has them."""
    if not _LINUX:
        yield
        return
    import resource

    def end(*_: Any) -> None:
        raise TimeoutError(f"takes longer than {BOUNDED_S:g} s")

    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    most = TEMPLATE_MIB * _MIB if hard == resource.RLIM_INFINITY else min(TEMPLATE_MIB * _MIB, hard)
    before = signal.signal(signal.SIGALRM, end)
    resource.setrlimit(resource.RLIMIT_DATA, (most, hard))
    signal.setitimer(signal.ITIMER_REAL, BOUNDED_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))
        signal.signal(signal.SIGALRM, before)


@lru_cache(maxsize=64)
def _compiled(template: str) -> Any:
    return template_environment().from_string(template)


def _read_ready(selector: selectors.BaseSelector, seconds: float) -> None:
    """Read what has been written, and keep the end of it."""
    for key, _ in selector.select(seconds) if selector.get_map() else ():
        kept, most = key.data
        try:
            content = os.read(key.fd, 2**16)
        except BlockingIOError:
            continue
        if not content:
            selector.unregister(key.fileobj)
        kept += content
        if len(kept) > 2 * most:
            del kept[:-most]


def _content(folder: Path, name: str) -> bytes:
    path = folder / name
    if not path.is_file():
        raise ValueError(f"wrote no {name}")
    if path.stat().st_size > MOST_RESULT:
        raise ValueError(f"{name} has {path.stat().st_size:,} bytes; at most {MOST_RESULT:,} are read")
    return path.read_bytes()


def _text(folder: Path, name: str) -> str:
    """The text of a file that a program wrote, with or without a byte order mark; lines end in "\\n"."""
    try:
        return io.TextIOWrapper(io.BytesIO(_content(folder, name)), "utf-8-sig").read()
    except UnicodeDecodeError as error:
        raise ValueError(f"{name} is not text in UTF-8: {error}") from None


def _document(folder: Path, name: str) -> Any:
    """The result as nested mappings and lists; of a CSV, its one row by column; a list for a name that is twice."""
    text = _text(folder, name)
    try:
        if name.endswith(".json"):
            return json.loads(text, object_pairs_hook=_by_name)
        rows = [
            row for row in csv.reader(io.StringIO(text), skipinitialspace=True) if any(cell.strip() for cell in row)
        ]
    except (ValueError, RecursionError, csv.Error) as error:
        raise ValueError(f"{name} cannot be read: {error}") from None
    if len(rows) != 2 or len(rows[0]) != len(rows[1]):
        found = f"{counted(len(rows), 'row')} of {' and '.join(str(len(row)) for row in rows[:3]) or 'no'} fields"
        raise ValueError(f"{name} has {found}; it must have one of names and one of numbers, of equal length")
    return _by_name((name.strip(), value) for name, value in zip(*rows, strict=True))


def _by_name(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """Values by name; a list of them for a name that is twice."""
    same: dict[str, list[Any]] = {}
    for name, value in pairs:
        same.setdefault(name, []).append(value)
    return {name: values if len(values) > 1 else values[0] for name, values in same.items()}


def _table(folder: Path, name: str) -> tuple[list[str], np.ndarray]:
    """(names of the columns, float64[rows, columns]) of a CSV."""
    first, _, rest = _text(folder, name).partition("\n")
    try:
        names = [column.strip() for column in next(csv.reader([first], skipinitialspace=True), [])]
        if not rest.strip():
            return names, np.empty((0, len(names)))
        table = np.loadtxt(io.StringIO(rest), delimiter=",", ndmin=2)
    except (ValueError, csv.Error) as error:  # NumPy's says behind a semicolon what NumPy could do
        raise ValueError(f"{name} cannot be read: {str(error).partition(';')[0]}") from None
    if table.shape[1] != len(names):
        raise ValueError(f"{name} has {table.shape[1]} columns, and names of {len(names)}")
    return names, table


def _at(document: Any, path: str) -> Any:
    """What is in a document under a key, or under keys and places with dots between them; KeyError if nothing."""
    if isinstance(document, dict) and path in document:
        return document[path]
    for key in path.split("."):
        if isinstance(document, dict) and key in document:
            document = document[key]
        elif isinstance(document, list) and key.isdecimal() and int(key) < len(document):
            document = document[int(key)]
        else:
            raise KeyError(path)
    return document


def _number(name: str, document: Any, path: str | None, pattern: str | None, stdout: str, sometimes: bool) -> float:
    if pattern is not None:
        try:
            with _bounded():
                found = deque(re.finditer(pattern, stdout, re.MULTILINE), 1)
        except TimeoutError as fault:
            raise ValueError(f'the search of stdout for "{pattern}", by which "{name}" is read, {fault}') from None
        if not found and not sometimes:
            raise ValueError(f'stdout has nothing like "{pattern}", by which "{name}" is read')
        value: Any = found[0][1] or "" if found else "nan"
    else:
        assert path is not None  # one of them is given
        try:
            value = _at(document, path)
        except KeyError:
            if sometimes:
                return float("nan")
            raise ValueError(f'the result has no "{path}", by which "{name}" is read') from None
    text = value.strip() if isinstance(value, str) else json.dumps(value)
    if sometimes and text in ("", "null"):
        return float("nan")
    if isinstance(value, bool) or not is_number(text):
        way_out = "; write its exponent with the letter E" if _FORTRAN.fullmatch(text) else ""
        raise ValueError(f'"{name}" is {clean(text)[:60] or "empty"}, which is no number{way_out}')
    return float(text)


def _input_difference(document: Any, path: str, inputs: Mapping[str, Any]) -> str:
    """How the inputs that a program used differ from those of its case, as a sentence; empty if they do not."""
    try:
        used = _at(document, path)
    except KeyError:
        return f'the result has no "{path}", the inputs that were used'
    if not isinstance(used, dict):
        return f'"{path}" in the result is no table of the inputs that were used'
    for name, value in inputs.items():
        if name not in used:
            return f'the program does not say that it used "{name}"'
        if used[name] != value or isinstance(used[name], bool) != isinstance(value, bool):  # True is 1 for Python
            return f"the program used {name} = {used[name]!r}, where the case has {value!r}"
    return ""


def end_noted(work: Path) -> None:
    """Kill the program whose start was noted in `work`, where its own process could not."""
    with suppress(OSError, ValueError):
        kill_group(int((work / PROGRAM_ID).read_text()))
