"""What is wrong with a model that cannot be compiled or flown, in a sentence with its place."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from traceback import walk_tb
from types import TracebackType

from mc_engine.compiler_faults import compiler_fault, is_the_users
from mc_engine.errors import EngineError, ModelError
from mc_engine.suggestions import hint

MORE = "; `mc-engine check` tells more"
_COMPILER = ("numba", "llvmlite")


@contextmanager
def naming_faults(reference: str, what: str, more: str = MORE) -> Iterator[None]:
    """Turn any error of the model's own code into a ModelError that says where it is and what was being done.

    more : how the sentence ends.
    """
    try:
        yield
    except EngineError:
        raise
    except SystemExit as error:  # in a thread it would end the thread alone, which is then waited for
        raise ModelError(f"{reference}: {what} cannot be flown: the model ends its process{more}") from error
    except Exception as error:
        spot, cause = _place_and_cause(error)
        text = f"{what} cannot be flown: {spot}: {cause}" if spot else f"{reference}: {what} cannot be flown: {cause}"
        raise ModelError(f"{text}{more}") from error


def fault_of(error: Exception, reference: str) -> str:
    """The error of a model's own code in one line, with its place."""
    spot, cause = _place_and_cause(error)
    return f"{spot or reference}: {cause}"


def place_in_model(error: BaseException) -> str:
    """Such as "model.py, line 12": the last place outside the engine and the libraries that the error came through."""
    spot = spot_in_model(error)
    return f"{Path(spot.tb_frame.f_code.co_filename).name}, line {spot.tb_lineno}" if spot else ""


def spot_in_model(error: BaseException) -> TracebackType | None:
    """Where `place_in_model` is, as an entry of the traceback."""
    found, spot = None, error.__traceback__
    while spot is not None:
        path = Path(spot.tb_frame.f_code.co_filename)
        found = spot if path.suffix == ".py" and is_the_users(path) else found
        spot = spot.tb_next
    return found


def wrong_record(error: BaseException) -> str:
    """What is wrong with the arguments that a record of the model, such as a Field, is made with; "" for others."""
    text = str(error)
    record = re.match(r"(\w+)\.__(?:init|new)__\(\) ", text)
    if not isinstance(error, TypeError) or not record:
        return ""
    *_, (frame, _) = walk_tb(error.__traceback__)
    made = (frame.f_globals | frame.f_locals).get(record[1])
    known = [one.name for one in fields(made)] if isinstance(made, type) and is_dataclass(made) else []
    if unknown := re.search(r"unexpected keyword argument '(\w+)'", text):
        return f"{record[1]} has no `{unknown[1]}`{hint(unknown[1], known)}"
    if missing := re.search(r"missing \d+ required (?:positional|keyword-only) arguments?: (.+)", text):
        return f"{record[1]} needs {missing[1].replace(chr(39), '`')}"
    if re.search(r"takes (?:from \d+ to )?\d+ positional arguments? but", text):
        return f"{record[1]} has too many arguments; it takes {', '.join(known)}" if known else ""
    return ""


def relative_import(error: BaseException) -> str:
    """What is wrong with an import that begins with a dot, in a model that is a file; "" for other errors."""
    if not isinstance(error, ImportError) or "relative import with no known parent" not in str(error):
        return ""
    return "an import from a dot, which a model's file cannot have; leave the dot out, as in from guidance import ..."


def _place_and_cause(error: Exception) -> tuple[str, str]:
    """(place, or nothing; the error in one line): of the compiler's pages only the cause and what to do instead."""
    if _of_the_compiler(error):
        return compiler_fault(str(error))
    return place_in_model(error), " ".join(f"{type(error).__name__}: {error}".split())


def _of_the_compiler(error: Exception) -> bool:
    """Whether an error is the compiler's, or broke out of it on the way."""
    *_, (frame, _) = [(None, 0), *walk_tb(error.__traceback__)]
    if isinstance(error, OSError | MemoryError):
        return False  # the machine's
    broken = frame is not None and frame.f_globals.get("__name__", "").split(".")[0] in _COMPILER
    return broken or type(error).__module__.split(".")[0] in _COMPILER
