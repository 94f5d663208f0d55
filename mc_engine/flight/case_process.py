"""A process that flies the cases of a simulator for one worker: its orders, its replies, and how it ended.

Between chunks a process waits for the next one.  If a case ends it, a new one is started.
"""

import atexit
import os
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from mc_engine.errors import DiskError, ModelError, StoreError
from mc_engine.flight.case_worker import STDERR, STDOUT, Order, Setup, end_of
from mc_engine.flight.flyer import RunStopped, never
from mc_engine.flight.program_flight import end_noted
from mc_engine.process_tree import WORK, how_it_ended, last_lines
from mc_engine.safe_path import safe_environment
from mc_engine.status import CRASHED, TIME_LIMIT

_WORKER = "mc_engine.flight.case_worker"
START_S = 600.0  # for `start`
JOB_S = 2.0  # in which all processes of a job that is ended have SIGTERM
END_S = 5.0  # in which a process and all that it began should have ended by SIGHUP
LOOK_EVERY_S = 0.2  # whether the run is to stop
_idle: dict[tuple[Any, ...], list["CaseProcess"]] = {}
_alive: set["CaseProcess"] = set()  # waiting or flying
_ending = threading.Event()  # once this process is about to end
_lock = threading.Lock()
# A process ends with the thread that started it, so one thread that lives as long as this process starts all.
_starter = ThreadPoolExecutor(1, thread_name_prefix="mc-engine-starter")  # which begins its thread at the first task


class CaseEnded(Exception):
    """A case ended its process, or was ended by a limit: status code and reason."""

    def __init__(self, status: int, reason: str):
        super().__init__(reason)
        self.status, self.reason = status, reason


class TerminatedAtStart(ModelError):
    """A process was ended by SIGTERM before it was ready, perhaps with all processes of a job."""


class CaseProcess:
    """One process, with a temporary folder for its cases."""

    def __init__(self, setup: Setup):
        self.work = Path(tempfile.mkdtemp(prefix=WORK))
        ours, theirs = socket.socketpair()
        try:
            self._process = _starter.submit(self._start, theirs.fileno()).result()
            _alive.add(self)
        finally:
            theirs.close()
        self._connection: Connection[Any, Any] = Connection(ours.detach())
        self._replies = select.poll()  # once, as `Connection.poll` makes a new one each time
        self._replies.register(self._connection.fileno(), select.POLLIN)
        kind = ModelError
        try:
            self._connection.send(setup)
            fault = self._connection.recv() if self._connection.poll(START_S) else f"took longer than {START_S:.0f} s"
        except (EOFError, OSError):
            fault = self._how_it_ended()
            kind = TerminatedAtStart if self._process.returncode == -signal.SIGTERM else ModelError
        if fault:
            self.end()
            raise kind(f"{setup.reference}: {fault}")

    def _start(self, descriptor: int) -> "subprocess.Popen[bytes]":
        command = [sys.executable, "-m", "mc_engine.process_tree", _WORKER, str(descriptor), str(self.work)]
        with open(self.work / STDOUT, "ab") as stdout, open(self.work / STDERR, "ab") as stderr:
            return subprocess.Popen(
                [*command, str(os.getpid())],
                stdin=subprocess.DEVNULL,
                stdout=stdout,
                stderr=stderr,
                pass_fds=(descriptor,),
                start_new_session=True,
                env=safe_environment(),
            )

    def replies(self, order: Order, count: int, limit_s: float | None, stopped: Callable[[], bool]) -> Iterator[Any]:
        """The replies to an order, one by one.

        limit_s : time from one reply to the next.  Raises CaseEnded if the process ends, or the limit is exceeded, and
        RunStopped once `stopped()` is true; the process has ended then.
        """
        try:
            self._connection.send(order)
            for _ in range(count):
                self._wait(limit_s, stopped)
                reply = self._connection.recv()
                if isinstance(reply, str):
                    raise DiskError(reply)
                if isinstance(reply, StoreError):
                    raise reply
                yield reply
        except (EOFError, ConnectionError):
            if _ending.is_set():
                threading.Event().wait()  # without end, see `end_all`
            raise CaseEnded(CRASHED, self._how_it_ended()) from None

    def _how_it_ended(self) -> str:
        """How the process ended that has closed its end of the connection, as a sentence; one that lives on is ended.

        A case may close files that are not its own, and leave threads for which Python waits.
        """
        try:
            code = self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._kill()
            return "closed the connection to the engine, and did not end"
        return f"{how_it_ended(code)}{_crash_site(end_of(self.work / STDERR))}"

    def _wait(self, limit_s: float | None, stopped: Callable[[], bool]) -> None:
        begin = time.monotonic()
        look_every_ms = 1e3 * (LOOK_EVERY_S if limit_s is None else min(LOOK_EVERY_S, limit_s))
        while not self._replies.poll(look_every_ms):
            if stopped():
                raise RunStopped
            if limit_s is not None and time.monotonic() - begin >= limit_s:
                raise CaseEnded(TIME_LIMIT, f"took longer than {limit_s:g} s")

    def is_alive(self) -> bool:
        """Whether it answers."""
        try:
            self._connection.send(None)
            return bool(self._connection.poll(5.0)) and self._connection.recv() == ""
        except (EOFError, OSError):
            return False

    def end(self, keep: Callable[[Path], None] | None = None) -> None:
        """End the process and what it began.  keep : called with its folder before that is removed."""
        self._connection.close()
        self._kill()
        if keep is not None:
            keep(self.work)
        shutil.rmtree(self.work, ignore_errors=True)

    def _kill(self) -> None:
        if sys.platform.startswith("linux"):  # elsewhere it has no guard
            with suppress(subprocess.TimeoutExpired):
                self._process.send_signal(signal.SIGHUP)
                self._process.wait(END_S)
        for stop in (lambda: os.killpg(self._process.pid, signal.SIGKILL), self._process.kill):
            with suppress(ProcessLookupError, PermissionError):
                stop()
        self._process.wait()
        _alive.discard(self)
        end_noted(self.work)


def _crash_site(stderr: bytes) -> str:
    """Where a process crashed, by the lines that Python's faulthandler wrote; else the last lines of stderr."""
    lines = stderr.decode(errors="replace").splitlines()
    for number, line in enumerate(lines):
        if line.startswith("Current thread"):
            frames = [frame.strip() for frame in lines[number + 1 :] if frame.strip().startswith("File")]
            ours = [frame for frame in frames if "/mc_engine/flight/" not in frame]
            if ours:
                file, _, rest = ours[0].removeprefix('File "').partition('"')
                return f" at {Path(file).name}{rest}"
    return last_lines(stderr)


def take(key: tuple[Any, ...], setup: Callable[[], Setup], stopped: Callable[[], bool] = never) -> CaseProcess:
    """A process that waits for cases of the simulator `key`, or a new one.

    A new process that SIGTERM ends while it starts is started once more.  If a whole job is ended, the engine gets the
    signal, too: then `stopped()` becomes true, and RunStopped is raised.
    """
    terminated = False
    while True:
        with _lock:
            waiting = _idle.get(key)
            process = waiting.pop() if waiting else None
        if process is None:
            try:
                return CaseProcess(setup())
            except TerminatedAtStart:
                if terminated:
                    raise
                terminated = True
                _wait_for_stop(stopped)
        elif process.is_alive():
            return process
        else:
            process.end()


def _wait_for_stop(stopped: Callable[[], bool]) -> None:
    """RunStopped if the engine is stopped in the next moments."""
    end = time.monotonic() + JOB_S
    while time.monotonic() < end:
        if stopped():
            raise RunStopped
        time.sleep(LOOK_EVERY_S)


@atexit.register
def _end_idle() -> None:
    for process in (process for waiting in _idle.values() for process in waiting):
        process.end()


def end_all() -> None:
    """End all processes, also those that fly a case, with what they began; for a process that then ends at once.

    A thread that flies a case learns nothing of it: it must not tell a case that was ended here as crashed.
    """
    _ending.set()
    for process in list(_alive):
        process._kill()
        shutil.rmtree(process.work, ignore_errors=True)


def give_back(key: tuple[Any, ...], process: CaseProcess) -> None:
    """Let a process wait for further cases."""
    with _lock:
        _idle.setdefault(key, []).append(process)
