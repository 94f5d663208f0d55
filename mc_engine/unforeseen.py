"""Errors that nobody foresaw: one sentence for the user, and a log file with the traceback for who mends it.

The command line ends with UNFORESEEN, an exit status of its own, so that no script takes a fault of the program for a
requirement that is not met.  The Python API raises what it raises.
"""

import os
import sys
import tempfile
import threading
import traceback
import warnings
from contextlib import suppress
from pathlib import Path
from typing import Any

UNFORESEEN = 6  # the exit status
# Bytes of addresses: those without which no case flies, and those below which the threads of a BLAS have no room.
_LEAST, _SMALL = 900 * 2**20, 3 * 2**30


def unforeseen(error: BaseException) -> str:
    """The sentence to leave with; the traceback goes to a file that this user alone can read."""
    log = _written("".join(traceback.format_exception(error)))
    where = f"; {log} says where" if log else ""
    if _is_for_want_of_memory(error):
        return f"the memory that this process may have does not suffice; give it more{where}"
    words = " ".join(str(error).split())[:200]
    kind = type(error).__name__
    return f"the program failed, which is no fault of the run's results: {kind}{f': {words!a}' if words else ''}{where}"


def _is_for_want_of_memory(error: BaseException | None) -> bool:
    """True for a MemoryError, for what libraries make of one, and for what came of either."""
    if error is None:
        return False
    words = ("cannot allocate memory", "failed to map segment", "can't start new thread", "bad_alloc", "out of memory")
    told = any(word in str(error).lower() for word in words)
    return isinstance(error, MemoryError) or told or _is_for_want_of_memory(error.__cause__ or error.__context__)


def _written(text: str) -> str:
    """The name of the log, from the home folder on if it lies there; empty where none can be written."""
    with suppress(OSError):
        number, name = tempfile.mkstemp(prefix="mc-engine-", suffix=".log")  # with the rights 0600
        with os.fdopen(number, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(text)
        with suppress(ValueError, RuntimeError):
            return f"~/{Path(name).relative_to(Path.home()).as_posix()}"
        return name
    return ""


def catch_all() -> None:
    """From here on warnings, and errors of threads, are a sentence each on standard error, and no Python source."""
    warnings.showwarning = _tell_warning  # type: ignore[assignment]
    threading.excepthook = lambda facts: _tell_error(facts.exc_value)
    sys.unraisablehook = lambda facts: _tell_error(facts.exc_value)


def _tell_warning(message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: Any) -> None:
    print(f"warning: {Path(filename).name}, line {lineno}: {' '.join(str(message).split())}", file=sys.stderr)


def _tell_error(error: BaseException | None) -> None:
    if error is not None and not isinstance(error, SystemExit | KeyboardInterrupt):
        print(unforeseen(error), file=sys.stderr)


def refuse_small_memory() -> None:
    """Ends the process where `ulimit -v` leaves less than loading takes; where it is short, BLAS does with one thread.

    A BLAS that finds no room for its threads never returns, or ends the process itself with the exit status 1.
    """
    with suppress(ImportError, ValueError, OSError):
        import resource

        soft, _ = resource.getrlimit(resource.RLIMIT_AS)
        if 0 <= soft < _LEAST and not {"-h", "--help"} & {*sys.argv}:
            print(
                f"this process may have {soft >> 20:,} MiB of memory (`ulimit -v`); give it {_LEAST >> 20:,} at least",
                file=sys.stderr,
            )
            sys.exit(UNFORESEEN)
        if 0 <= soft < _SMALL:
            for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
                os.environ.setdefault(name, "1")
