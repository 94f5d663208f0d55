"""Error messages for a model's own code: one sentence each, with the file, the line and the usual fix.

For errors in physics the sentence adds the source line and what physics may contain, because the messages of NumPy and
of the compiler do not mention the user's code.
"""

import inspect
import linecache
import math
import re
import sys
import sysconfig
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from traceback import walk_tb
from types import FrameType, FunctionType, SimpleNamespace
from typing import Any

from mc_engine.errors import EngineError, ModelError
from mc_engine.lanes.number import Origin
from mc_engine.model.files import sources_in
from mc_engine.suggestions import hint, nearest
from mc_engine.units import UNITS, unit_suffix

MORE = "; `mc-engine check` tells more"
PHYSICS = (
    "write it with + - * / and comparisons, where(condition, a, b), named tuples, `for k in range(n)`, and calls of "
    "@physics functions and of mc_engine.lanes (floor, pow, maximum, ...)"
)
_EACH_CASE = (
    "Python cannot decide, count or look up by a number that differs from case to case; use where(condition, a, b), "
    "minimum, maximum, rint or look_up of mc_engine.lanes, & and | between conditions, and loops of a fixed number"
)
_CONDITION = "a condition stands where a number must; join conditions with & | ^, or write where(condition, 1.0, 0.0)"
_OF_A_MASK = re.compile(r"built-in function \w+>\) found for signature:\s+>>> \w+\(.*\blanes_m\d")
# How NumPy and Python complain of an array of cases where they take a single number.
_OF_ARRAYS = re.compile(
    "truth value of an array|integer scalar arrays|interpreted as an integer|only (length-1|0-dimensional) arrays|"
    "must be real number, not|__round__|ind(ex|ices) must be integers|used as indices|boolean index"
)
# what functions of a model are handed, by the names that they take
_HANDED = (
    *("t", "s", "m", "p", "o", "draws", "hit", "best", "when", "since", "phase"),
    *("time", "state", "memory", "parameters", "settings"),
)
_LEFT_OUT = re.compile(r"(\w+)\.__new__\(\) missing \d+ required positional arguments?: (.*)")
_UNKNOWN_FIELD = re.compile(r"(\w+)\.__new__\(\) got an unexpected keyword argument '(\w+)'")
_ARRAY = re.compile(r"'?(numpy\.)?ndarray'?( object)?")
_COMPILER = ("numba", "llvmlite")
_FUNCTIONS = {"sqrt": "the square root", "log": "the logarithm", "asin": "the arc sine", "acos": "the arc cosine",
              "tan": "the tangent", "exp": "the exponential"}  # fmt: skip
_ENGINE = Path(__file__).resolve().parents[1]
_PYTHON = Path(sysconfig.get_path("stdlib")).resolve()
_OF_0_1 = "CHANGELOG.md says under 0.2.0 how to convert a model of version 0.1"
_INSTEAD_OF_0_1 = {  # functions of version 0.1, and what replaces them
    "body_matrix": "to_matrix of mc_engine.physics.rotations",
    "quaternion_product": "product of mc_engine.physics.rotations",
    "mach_table": "curve of mc_engine.physics.curves",
    "over_mach": "curve of mc_engine.physics.curves",
}
_RECORDS_OF_0_1 = ("Field", "Parameter", "Setting")  # whose arguments had another order
_LONG = 60  # characters of a source line in a sentence


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
        place, cause = _place_and_cause(error)
        text = f"{what} cannot be flown: {place}: {cause}" if place else f"{reference}: {what} cannot be flown: {cause}"
        raise ModelError(f"{text}{more}") from error


def fault_of(error: BaseException, reference: str) -> str:
    """The error of a model's own code in one line, with its place."""
    place, cause = _place_and_cause(error)
    return f"{place or reference}: {cause}{_hint_of_module(error)}"


def _hint_of_module(error: BaseException) -> str:
    """The remedy for a module next to the model that one of its functions imports when it runs."""
    frame, _ = frame_in_model(error)
    if not isinstance(error, ModuleNotFoundError) or frame is None or frame.f_code.co_name == "<module>":
        return ""
    beside = Path(frame.f_code.co_filename).parent / str(error.name)
    found = any(sources_in(beside)) or beside.with_name(f"{beside.name}.py").is_file()
    return "; it lies beside the file: import it at the top, not in a function" if found else ""


def fault_of_trial(error: Exception) -> str:
    """The same, of physics that was called with arrays of cases."""
    frame, line = frame_in_model(error)
    text = " ".join(str(error).split()).rstrip(".")
    if _OF_ARRAYS.search(text):
        text = f"{_of_math(frame, line) if isinstance(error, TypeError) else ''}{_EACH_CASE}"
    elif left_out := _LEFT_OUT.match(text):
        text = f"{left_out[1]}(...) leaves out {left_out[2]}; give every field that has no default"
    elif unknown := _UNKNOWN_FIELD.match(text):
        text = f'{unknown[1]}(...) has no field "{unknown[2]}"{_hint_of_field(error, unknown[1], unknown[2])}'
    elif not isinstance(error, EngineError):  # which says the fix itself
        text = f"{type(error).__name__}: {_ARRAY.sub('a number', text)}{_hint_of_error(error) or f'; {PHYSICS}'}"
    return f"{source_place(frame.f_code.co_filename, line) if frame else 'the model'}: {text}"


def _hint_of_field(error: Exception, record: str, field: str) -> str:
    frame, _ = frame_in_model(error)
    made = (frame.f_globals | frame.f_locals).get(record) if frame else None
    if field in [item.symbol for item in getattr(made, "declared", ()) if item.name in getattr(made, "computed", ())]:
        return "; the engine computes it as it is declared: leave it out here"
    return hint(field, getattr(made, "_fields", ()))


def _hint_of_error(error: Exception) -> str:
    """What to do about a name that has no value, an unknown field, and numbers that cannot be combined."""
    text = str(error)
    if re.search(r"\bDraws\b", text):
        return "; for noise hand it to normal_pair(draws, index) of mc_engine.lanes.noise"
    if isinstance(error, UnboundLocalError):
        return "; give it a value on a line above, whichever way an `if` goes"
    if "'bitwise_" in text or "for &" in text or "for |" in text:
        return "; & and | join conditions, each in parentheses: (a > b) & (c > d)"
    if "numpy boolean" in text:
        return f"; {_CONDITION}"
    if "could not be broadcast" in text:
        return "; a tuple is no number: give its parts names, as in n1, n2 = normal_pair(draws, 0)"
    if not isinstance(error, NameError):
        return _hint_of_attribute(error)
    from mc_engine import lanes  # which loads the compiler

    frame, _ = frame_in_model(error)
    if error.name in _HANDED and frame:
        return f"; a function takes what it names: write `{error.name}` among the arguments of `{frame.f_code.co_name}`"
    if error.name in lanes.__all__:
        return "; import it from mc_engine.lanes"
    own, outside = (frame.f_locals, frame.f_globals) if frame else ({}, {})
    holder = next((name for name, value in own.items() if error.name in getattr(value, "_fields", ())), "")
    near = nearest(str(error.name), [*own, *outside])
    meant = f'did you mean "{near}"?' if near else "give it a value on a line above, or import it"
    return f"; write `{holder}.{error.name}`" if holder else f"; {meant}"


def _hint_of_attribute(error: Exception) -> str:
    """What an unknown field of a record was meant to be: that of a column, which physics has without its unit."""
    if isinstance(error, AttributeError) and isinstance(error.obj, SimpleNamespace):  # such as CHOICES
        return hint(str(error.name), vars(error.obj))
    if not isinstance(error, AttributeError) or not hasattr(error.obj, "_fields"):
        return ""
    name, known = str(error.name), error.obj._fields
    units = {unit_suffix(unit) for unit in UNITS if unit}
    symbol = next((symbol for symbol in known if name.startswith(symbol) and name.removeprefix(symbol) in units), "")
    return f'; a column\'s name is without its unit in physics, "{symbol}"' if symbol else hint(name, known)


def _of_math(frame: FrameType | None, line: int) -> str:
    """What is wrong with a line that calls a function of Python's `math`; "" for other lines."""
    if frame is None:
        return ""
    from mc_engine import lanes  # which loads the compiler

    for module, name in re.findall(r"(math\.)?\b(\w+)\(", linecache.getline(frame.f_code.co_filename, line)):
        function = getattr(math, name, None)
        if function and (module or frame.f_globals.get(name) is function):
            fix = "import it from mc_engine.lanes" if name in lanes.__all__ else "mc_engine.lanes has no such function"
            return f"`{name}` of Python's math takes a single number; {fix}; "
    return ""


def source_place(file: str, line: int) -> str:
    """Such as "model.py, line 12: `r = sqrt(x)`"."""
    text = " ".join(linecache.getline(file, line).split())
    return f"{Path(file).name}, line {line}: `{text if len(text) <= _LONG else f'{text[: _LONG - 3].rstrip()}...'}`"


def place_in_model(error: BaseException) -> str:
    """Such as "model.py, line 12": the last place outside the engine and the libraries that the error came through."""
    frame, line = frame_in_model(error)
    return f"{Path(frame.f_code.co_filename).name}, line {line}" if frame else ""


def frame_in_model(error: BaseException) -> tuple[FrameType | None, int]:
    """Where `place_in_model` is: the frame and the line."""
    frames = [
        (frame, line)
        for frame, line in walk_tb(error.__traceback__)
        if frame.f_code.co_filename.endswith(".py") and is_the_users(Path(frame.f_code.co_filename))
    ]
    return frames[-1] if frames else (None, 0)


def is_the_users(path: Path) -> bool:
    """Whether a source is neither the engine's nor a library's."""
    path = path.resolve()
    libraries = {_ENGINE, _PYTHON} & set(path.parents) or "site-packages" in path.parts
    return not libraries and not path.name.startswith("kernel_w")


def wrong_record(error: BaseException) -> str:
    """What is wrong with the arguments that a record or a declaration, such as a Field, is made with; "" for others."""
    said = re.sub(r"\. Did you mean '\w+'\?$", "", str(error))  # of Python from 3.13 on
    call = re.match(r"(\w+)(?:\.__(?:init|new)__)?\(\) (.*)", said)
    if not isinstance(error, TypeError) or not call:
        return ""
    *_, (frame, _) = walk_tb(error.__traceback__)
    made = (frame.f_globals | frame.f_locals).get(call[1])
    known = _arguments(made)
    if not known:
        return ""
    wrong = re.search("unexpected keyword argument '(\\w+)'", call[2])
    near = nearest(wrong[1], known) if wrong else None
    meant = f'; did you mean "{near}"?' if near else ""
    reordered = call[1] in _RECORDS_OF_0_1 and re.search("multiple values|were given", call[2])
    old = f"; {_OF_0_1}" if reordered else ""
    return f"{call[1]}: {call[2]}{meant}; it takes {', '.join(known)}{old}"


def _arguments(made: Any) -> list[str]:
    """What a record or a function of the engine's takes, such as `model` or `curve`; [] for anything else."""
    if isinstance(made, type) and is_dataclass(made):
        return [item.name for item in fields(made)]
    engine = isinstance(made, FunctionType) and made.__module__.startswith("mc_engine.")
    return list(inspect.signature(made).parameters) if engine else []


def wrong_import(error: BaseException) -> str:
    """What is wrong with an import from a dot in a model's file, or of a name that a module has not; "" for others."""
    if not isinstance(error, ImportError):
        return ""
    if "relative import with no known parent" in str(error):
        fix = "leave the dot out, as in from guidance import ..."
        return f"an import from a dot, which a model's file cannot have; {fix}"
    missing, module = re.match(r"cannot import name '(\w+)'", str(error)), sys.modules.get(error.name or "")
    if missing is None or module is None:
        return ""
    file = getattr(module, "__file__", None)  # the name of a module beside the model's file is the engine's
    who = Path(file).name if file and is_the_users(Path(file)) else error.name
    if (who, missing[1]) == ("mc_engine.lanes", "abs"):
        return 'mc_engine.lanes has no "abs"; physics takes that of Python, without an import'
    if who != error.name or (instead := _INSTEAD_OF_0_1.get(missing[1])) is None:
        public = getattr(module, "__all__", [name for name in vars(module) if not name.startswith("_")])
        return f'{who} has no "{missing[1]}"{hint(missing[1], public)}'
    return f'{who} has no "{missing[1]}"; use {instead}; {_OF_0_1}'


def _place_and_cause(error: BaseException) -> tuple[str, str]:
    """(place, or nothing; the error in one line)."""
    if _of_the_compiler(error):
        return _compiler_fault(re.sub(r"\x1b\[[0-9;]*m", "", str(error)))  # without colours
    return place_in_model(error), " ".join(f"{type(error).__name__}: {text_of(error)}".split())


def text_of(error: BaseException) -> str:
    """The text of an error, whose class may be the user's and fail to give one."""
    try:
        return str(error)
    except Exception as fault:
        return f"its text cannot be given, as its __str__ raises {type(fault).__name__}"


def _of_the_compiler(error: BaseException) -> bool:
    """Whether an error is the compiler's, or broke out of it on the way."""
    *_, (frame, _) = [(None, 0), *walk_tb(error.__traceback__)]
    if isinstance(error, OSError | MemoryError):
        return False  # the machine's
    broken = frame is not None and frame.f_globals.get("__name__", "").split(".")[0] in _COMPILER
    return broken or type(error).__module__.split(".")[0] in _COMPILER


def _compiler_fault(text: str) -> tuple[str, str]:
    """The same, from the compiler's pages: the first line that says something, and the first place in the model."""
    places = re.finditer(r'File "([^"]+)", line (\d+)|(?:at|from) (\S[^\n]*?\.py) \((\d+)\)', text)
    known = ((match[1] or match[3], int(match[2] or match[4])) for match in places)
    file, number = next((place for place in known if is_the_users(Path(place[0].replace("\\", "/")))), ("", 0))
    lines = [" ".join(line.split()) for line in text.splitlines()]
    idle = ("Failed in", "- Resolution failure", "File ", ">>> ", "There are ", "- Of which", "Overload ",
            "Intrinsic in ", "With argument", "Rejected as", "TypingError: Failed in")  # fmt: skip
    telling = (line for line in lines if line and not line.startswith(idle) and "<intrinsic " not in line)
    words = re.sub(r" at 0x\w+|(?<=\s)(?:[A-Za-z]:)?[/\\]\S*[/\\]", "", next(telling, "no reason given"))
    words = _CONDITION if _OF_A_MASK.search(text) else words
    return source_place(file, number) if file else "", f"kernels cannot run this ({words.rstrip(':.')}); {PHYSICS}"


def origin_sentence(origin: Origin, who: str = "") -> str:
    """Where a number became infinite or NaN: operation, place in the model's source, operands, and when.

    who : the case in words.
    """
    when = f"t = {origin.t:.6g} s" if math.isfinite(origin.t) else ""
    which = ", ".join(part for part in (when, who) if part)
    happened = f"{_operation(origin)} ({which})" if which else _operation(origin)
    if not origin.places:
        return happened
    ours = [place for place in origin.places if is_the_users(Path(place.file))] or [origin.places[-1]]
    if ours[0] is not origin.places[0] and not _is_look_up(origin):
        happened = f"in {origin.places[0]}, {happened}"
    if len(ours) > 1:
        happened += f", called by {ours[-1]}"
    return f"{source_place(*ours[0])}: {happened}"


def _operation(origin: Origin) -> str:
    if not origin.arguments:
        return origin.operation
    result = "not a number" if math.isnan(origin.result) else "infinite"
    values = [f"{argument:.6g}" for argument in origin.arguments if isinstance(argument, float | int)]
    if _is_look_up(origin):  # all digits tell an argument from the end of the points
        at = ", ".join(repr(float(argument)) for argument in origin.arguments)
        return f"{origin.operation} at {at} is {result}"
    if origin.operation in _FUNCTIONS:
        return f"{_FUNCTIONS[origin.operation]} of {values[0]} is {result}"
    if origin.operation.isidentifier():
        return f"{origin.operation}({', '.join(values)}) is {result}"
    return f"{f' {origin.operation} '.join(values)} is {result}"


def _is_look_up(origin: Origin) -> bool:
    """Whether the operation is a curve in words: the user's own data, whichever line of the engine reads them."""
    return " " in origin.operation
