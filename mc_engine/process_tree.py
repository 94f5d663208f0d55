"""Descendants of this process: their memory, how to end them, and how they ended, in words.

On Linux, every process that a program began can be ended, its memory measured while it runs, and it ends with the
engine.  On other systems only its own process group is ended.

As a program, `python -m mc_engine.process_tree MODULE DESCRIPTOR FOLDER PARENT`, it is the guard of a process that runs
foreign code, the `main` of the module: with it, it ends all processes that this code began, also if the engine is
killed.
"""

import ctypes
import os
import re
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

_PAGE = os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 4096
_MIB = 2**20
_SET_PARENT_SIGNAL, _SET_SUBREAPER = 1, 36  # of prctl
# a line of a stack trace: of gfortran and sanitizers, of Java and the C library, of Octave
_FRAME = re.compile(
    r"#\d+\s+0x.*|at \S+(?::\d+|\(.*\))|\S+ at line \d+ column \d+|.*\b[Bb]acktrace:|error: called from"
)
HELD_S = 5.0  # longer than the engine needs to end its processes
_LINUX = sys.platform.startswith("linux")
# sent by the system to a process whose parent has died, which then ends what it began; no job manager sends it
_PARENT_DIED = getattr(signal, "SIGRTMIN", 0) + 3
WORK = "mc-engine-"  # how the names of the folders begin in which processes of cases work


def how_it_ended(code: int) -> str:
    """An exit code, or the signal that a negative one stands for, in words."""
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    return f"ended by {name}"


def last_lines(stderr: bytes) -> str:
    """The last three lines of what was written to stderr, to be put at the end of a sentence.

    The frames of a stack trace are left out. Most programs write them after their message, and those of gfortran are
    other addresses in every process.
    """
    lines = [line.strip() for line in stderr.decode(errors="replace").splitlines() if line.strip()]
    lines = [line for line in lines if not _FRAME.fullmatch(line)] or lines
    return f": {' | '.join(lines[-3:])}" if lines else ""


def without_work(text: str) -> str:
    """The text without the folders in which processes of cases work: each has another name every time."""
    return re.sub(rf"{re.escape(os.path.join(tempfile.gettempdir(), WORK))}\w{{8}}/", "", text)


def memory_mib(pid: int) -> float:
    """Memory of a process and its descendants; 0 where the system does not show it."""
    pages = 0
    for process in [pid, *_descendants(pid)]:
        try:
            pages += int(Path(f"/proc/{process}/statm").read_text().split()[1])
        except (OSError, IndexError):
            continue
    return pages * _PAGE / _MIB


def _descendants(pid: int) -> list[int]:
    children = _children(pid)
    return [*children, *(below for child in children for below in _descendants(child))]


def _children(pid: int) -> list[int]:
    try:
        tasks = os.listdir(f"/proc/{pid}/task")
        texts = [Path(f"/proc/{pid}/task/{task}/children").read_text() for task in tasks]
    except OSError:
        return []
    return [int(word) for text in texts for word in text.split()]


def own_children() -> set[int]:
    """Children of this process."""
    return set(_children(os.getpid())) if _LINUX else set()


def _has_children() -> bool:
    """Whether this process has children, alive or dead: one call of the system, which each case can afford."""
    try:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    except ChildProcessError:
        return False
    return True


def end_children(keep: set[int]) -> None:
    """Kill the descendants of this process that a case left behind.  keep : children that live on."""
    if not (_LINUX and _has_children()):
        return
    for _ in range(50):  # the children of one that dies become this process's own
        left = own_children() - keep
        if not left:
            return
        for pid in left:
            kill_group(pid)
            try:
                os.kill(pid, signal.SIGKILL)
                os.waitpid(pid, 0)
            except (ProcessLookupError, ChildProcessError):
                continue
        _forget_server(left)


def _forget_server(ended: set[int]) -> None:
    """Let `multiprocessing` start its fork server anew: it would wait for the one that it knows, and raise an error."""
    server = getattr(sys.modules.get("multiprocessing.forkserver"), "_forkserver", None)
    if server is not None and server._forkserver_pid in ended:
        os.close(server._forkserver_alive_fd)
        server._forkserver_pid = None


def kill_group(pid: int) -> None:
    try:
        if os.getpgid(pid) != os.getpgrp():
            os.killpg(os.getpgid(pid), signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        pass


def adopt_orphans() -> None:
    """From now on, descendants whose parent dies become children of this process."""
    if _LINUX:
        ctypes.CDLL(None).prctl(_SET_SUBREAPER, 1)


def die_with_parent(parent: int, end: Callable[[int, Any], None] | None = None) -> None:
    """Have this process end when its parent dies: by `end`, a handler, or at once, in code that lets no Python run."""
    if _LINUX:
        if end is not None:
            signal.signal(_PARENT_DIED, end)
        ctypes.CDLL(None).prctl(_SET_PARENT_SIGNAL, signal.SIGKILL if end is None else _PARENT_DIED)
        if os.getppid() != parent:  # it died before
            if end is not None:
                end(_PARENT_DIED, None)
            os._exit(1)


def hold_when_terminated() -> None:
    """From now on, SIGTERM holds this process up for a while, but does not end it.

    Who ends a job signals all of its processes.  The engine, which has the signal too, ends this one meanwhile: so
    nothing is recorded of a case that was ended with the job.
    """
    signal.signal(signal.SIGTERM, lambda *_: time.sleep(HELD_S))
    _let_forks_be_terminated()


def _let_forks_be_terminated() -> None:
    """From now on, processes that this one forks end by SIGTERM, whatever handler this one has.

    Python forgets a signal for its handlers that comes while a process is forked, and a pool waits for a process that
    it terminated.  So SIGTERM is kept back until the new process has no handler.
    """
    mask = [signal.SIGTERM]

    def in_child() -> None:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, mask)

    os.register_at_fork(
        before=lambda: signal.pthread_sigmask(signal.SIG_BLOCK, mask),
        after_in_parent=lambda: signal.pthread_sigmask(signal.SIG_UNBLOCK, mask),
        after_in_child=in_child,
    )


def _guard(parent: int, descriptor: int, folder: Path) -> int:
    """The process number of the guard: in a child of this process, which goes on; the guard itself never returns.

    It ends when its child has ended, in the same way, or by SIGHUP, also while code in the child lets no Python run;
    then no process is left that the child began.  It ends with its parent, too, and removes the folder.
    descriptor : of the child alone.
    """
    adopt_orphans()
    guard = os.getpid()
    child = os.fork()
    if not child:
        die_with_parent(guard)
        return guard

    def end(by: int, _: object) -> None:
        end_children(set())
        if by == _PARENT_DIED:
            shutil.rmtree(folder, ignore_errors=True)
        os._exit(1)

    os.close(descriptor)
    signal.signal(signal.SIGHUP, end)
    hold_when_terminated()
    die_with_parent(parent, end)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    end_children(set())
    if code < 0:
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # its child has left one, where they are wanted
        if code != -signal.SIGKILL:
            signal.signal(-code, signal.SIG_DFL)
        os.kill(guard, -code)
    os._exit(code)


if __name__ == "__main__":
    _module, _descriptor, _folder, _parent = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]), int(sys.argv[4])
    if _LINUX:
        _parent = _guard(_parent, _descriptor, _folder)
    import_module(_module).main(_descriptor, _folder, _parent)
