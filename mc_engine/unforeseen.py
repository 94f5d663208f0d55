"""Unexpected errors on the command line: one sentence for the user, and a log file with the traceback.

The exit status is UNFORESEEN, so that a script can distinguish such an error from a requirement that is not met.  In
the Python interface unexpected errors are raised unchanged.
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
# Bytes of address space: the least with which cases can fly, and the least for the threads of a BLAS.
_LEAST, _SMALL = 900 * 2**20, 3 * 2**30


def unforeseen(error: BaseException) -> str:
    """The message for an unexpected error; its traceback is written to a file that only this user can read."""
    log = _write_log("".join(traceback.format_exception(error)))
    where = f"; {log} says where" if log else ""
    if _lacks_memory(error):
        return f"the memory that this process may have does not suffice; give it more{where}"
    text = " ".join(str(error).split())[:200]
    kind = type(error).__name__
    return f"the program failed, which is no fault of the run's results: {kind}{f': {text!a}' if text else ''}{where}"


def _lacks_memory(error: BaseException | None) -> bool:
    """True for a MemoryError, for the errors of libraries without memory, and for errors caused by them."""
    if error is None:
        return False
    words = ("cannot allocate memory", "failed to map segment", "can't start new thread", "bad_alloc", "out of memory")
    says_so = any(word in str(error).lower() for word in words)
    return isinstance(error, MemoryError) or says_so or _lacks_memory(error.__cause__ or error.__context__)


def _write_log(text: str) -> str:
    """Write the log.  Returns its path, with ~ for the home folder, or "" if it cannot be written."""
    with suppress(OSError):
        number, name = tempfile.mkstemp(prefix="mc-engine-", suffix=".log")  # with the rights 0600
        with os.fdopen(number, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(text)
        with suppress(ValueError, RuntimeError):
            return f"~/{Path(name).relative_to(Path.home()).as_posix()}"
        return name
    return ""


def catch_all() -> None:
    """From now on print each warning, and each error of a thread, as one sentence without Python source."""
    warnings.showwarning = _tell_warning  # type: ignore[assignment]
    threading.excepthook = lambda facts: _tell_error(facts.exc_value)
    sys.unraisablehook = lambda facts: _tell_error(facts.exc_value)


def _tell_warning(message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: Any) -> None:
    print(f"warning: {Path(filename).name}, line {lineno}: {' '.join(str(message).split())}", file=sys.stderr)


def _tell_error(error: BaseException | None) -> None:
    if error is not None and not isinstance(error, SystemExit | KeyboardInterrupt):
        print(unforeseen(error), file=sys.stderr)


def refuse_small_memory() -> None:
    """End the process if `ulimit -v` leaves less memory than loading takes.

    If it is small, BLAS is limited to one thread, and Arrow takes its memory from the system's allocator: a BLAS
    without memory for its threads never returns, or ends the process with the exit status 1, and Arrow's own allocator
    ends it with a segmentation fault.
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
            os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")
