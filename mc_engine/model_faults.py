"""What is wrong with a model that cannot be compiled or flown, in a sentence with its place."""

import re
import sysconfig
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from traceback import extract_tb, walk_tb

from mc_engine.errors import EngineError, ModelError
from mc_engine.suggestions import hint

MORE = "; `mc-engine check` tells more"
_ENGINE = Path(__file__).resolve().parent
_PYTHON = Path(sysconfig.get_path("stdlib")).resolve()
_LANES = "physics uses the functions of mc_engine.lanes"
# The compiler's words, and what to do about them.
_CAUSES = (
    (r"function Function\(<class '(?:bool|range)'>\)", "`if`, `and`, `or`, `not` or a loop's length on a number that "
     "differs from case to case; use where(condition, a, b)"),
    (r"function Function\(<built-in function i?(?:add|sub|mul|truediv)>\)", "arithmetic on a truth value or a tuple; "
     "write where(condition, 1.0, 0.0)"),
    (r"function Function\(<built-in function i?pow>\)", "`**` takes a whole number that is written out; other powers "
     "are pow(x, y) of mc_engine.lanes"),
    (r"function Function\(<built-in function i?mod>\)", "`%` takes no lanes; write x - y * floor(x / y)"),
    (r"function Function\(<built-in function i?floordiv>\)", "`//` takes no lanes; write floor(x / y)"),
    (r"function Function\(<built-in function invert>\)", "`~` takes no lanes; write `not mask`"),
    (r"function Function\(<(?:built-in function|ufunc|class) '?(\w+)'?>\)", f"`{{0}}` takes no lanes; {_LANES}"),
    (r"Untyped global name '(\w+)'.*<class 'function'>", "`{0}` is not marked; write @physics on the line above it"),
    (r"Untyped global name '(\w+)'|assigned to variable '(\w+)' in globals", "`{0}` is nothing that physics can read; "
     "it reads numbers, tuples and marked functions"),
    (r"Unknown attribute '(\w+)' of type Module", f"`{{0}}` is a module's own; {_LANES}"),
    (r"opcode \((?:STORE|DELETE)_GLOBAL\)", "`global` in physics; what changes is kept in the state or in the memory"),
    (r"NRT required", "an array, a list or a text is made in physics; keep numbers in named tuples instead"),
)  # fmt: skip


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
    for frame in reversed(extract_tb(error.__traceback__)):
        path = Path(frame.filename)
        if path.suffix == ".py" and _is_the_users(path):
            return f"{path.name}, line {frame.lineno}"
    return ""


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


def _is_the_users(path: Path) -> bool:
    path = path.resolve()
    libraries = {_ENGINE, _PYTHON} & set(path.parents) or "site-packages" in path.parts
    return not libraries and not path.name.startswith("kernel_w")


def _place_and_cause(error: Exception) -> tuple[str, str]:
    """(place, or nothing; the error in one line): of the compiler's pages only the cause and what to do instead."""
    if not type(error).__module__.startswith("numba"):
        return place_in_model(error), f"{type(error).__name__}: {error}"
    lines = [line.strip() for line in re.sub(r"\x1b\[[0-9;]*m", "", str(error)).splitlines()]  # without colours
    cause = next((line for line in lines if line and not line.startswith("Failed in")), type(error).__name__)
    places = [match for line in lines if (match := re.match(r'File "([^"]+)", line (\d+)', line))]
    own = [match for match in places if _is_the_users(Path(match[1].replace("\\", "/")))]
    spot = f"{Path(own[0][1].replace(chr(92), '/')).name}, line {own[0][2]}" if own else ""
    for pattern, meaning in _CAUSES:
        if match := re.search(pattern, cause):
            return spot, meaning.format(*[group for group in match.groups() if group] or [""])
    return spot, cause
