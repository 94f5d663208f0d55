"""Processes that this one began, directly or not: their memory, their end, and how it is told.

Linux has the means to end every process that a program began, to see its memory while it runs, and to end it with the
engine; elsewhere only its own process group is ended.
"""

import ctypes
import os
import signal
import sys
from pathlib import Path

_PAGE = os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 4096
_MIB = 2**20
_SET_PARENT_SIGNAL, _SET_SUBREAPER = 1, 36  # of prctl
_LINUX = sys.platform.startswith("linux")


def how_it_ended(code: int) -> str:
    """An exit code, or the signal that a negative one stands for, in words."""
    if code >= 0:
        return f"ended with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    return f"ended by {name}"


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


def die_with_parent(parent: int, by: int) -> None:
    """Have this process end by the signal `by` when its parent dies, even in code that lets no Python run."""
    if _LINUX:
        ctypes.CDLL(None).prctl(_SET_PARENT_SIGNAL, by)
        if os.getppid() != parent:  # it died before
            os._exit(1)


def let_forks_be_terminated() -> None:
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
