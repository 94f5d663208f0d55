"""What a model must keep, held against it without compiling: each breach a sentence with its place and the fix.

The physics runs interpreted on arrays of a few cases, as the lanes will hand them over.
`mc_engine.contract_flight` goes on with what only a flight can show.
"""

import ast
import inspect
import json
import os
import subprocess
import sys
import textwrap
import warnings
from collections import namedtuple
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.campaign import Campaign
from mc_engine.errors import EngineError, ModelError
from mc_engine.flight import prepare, settings_of
from mc_engine.kernel_parts import NoMemory
from mc_engine.lanes.noise import Draws, noise_key
from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model import Model
from mc_engine.model_faults import place_in_model

# The arguments that the engine hands to each function of a model.
ARGUMENTS = {
    "initial": "p, o",
    "start": "p, o",
    "rhs": "t, s, m, p, o",
    "control": "t, s, m, p, o, draws",
    "events": "t, s, m, p, o",
    "switch": "t, s, m, p, o, hit",
    "observe": "t, s, m, p, o",
    "evaluate": "t, s, m, p, o, best, when",
    "prepare": "inputs, settings, refusals",
    "tables": "o",
}
_INTERPRETED = ("prepare", "tables")  # NumPy, a whole chunk at a time
# what the fields of each function's result are declared by
_FIELDS = {"initial": "states", "rhs": "states", "observe": "quantities", "events": "event_list", "evaluate": "metrics"}
_ALLOCATING = {"array", "arange", "empty", "zeros", "ones", "full", "linspace", "stack", "concatenate", "list", "dict"}
_FEW = 3  # cases on arrays
_PATIENCE = 600.0  # s, compilation included


class Breach(ModelError):
    """One breach of the contract; its text is the sentence."""


def breaches(campaign: Campaign) -> list[str]:
    """Sentences on what is wrong with the campaign's model, as far as it shows without compiling; empty if nothing."""
    model = campaign.model
    found = [*_wrong_functions(model), *_allocations(model)]
    if found:
        return found
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            _run_through(campaign)
    except Breach as breach:
        found.append(str(breach))
    return found


def flight_faults(file: str) -> list[str]:
    """What `mc_engine.contract_flight` finds in a process of its own, which the model may kill or hang."""
    command = [sys.executable, "-P", "-m", "mc_engine.contract_flight", file]
    # the same packages as here, and nothing from the working folder
    path = os.pathsep.join(one or os.getcwd() for one in sys.path)
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=_PATIENCE, env={**os.environ, "PYTHONPATH": path}
        )
    except subprocess.TimeoutExpired:
        return [f"a flight of a few cases has not ended after {_PATIENCE:.0f} s; shorten the clock's `until`, or look "
                "for a loop without end"]  # fmt: skip
    if done.returncode:
        last = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
        return [f"a flight of a few cases killed its process: {last}"]
    return [str(one) for one in json.loads(done.stdout.splitlines()[-1])]


def _functions(model: Model) -> Iterator[tuple[str, Callable[..., Any]]]:
    for name in ARGUMENTS:
        function = getattr(model, name)
        if function is not None:
            yield name, function


def _wrong_functions(model: Model) -> list[str]:
    """Functions without their decorator, or with other arguments than the engine gives."""
    found = []
    for name, function in _functions(model):
        wanted = ARGUMENTS[name]
        if name not in _INTERPRETED and not isinstance(function, PhysicsFunction):
            found.append(f"{place_of(function)}: `{name}` is not marked; write @physics on the line above it")
            continue
        try:
            inspect.signature(function).bind(*wanted.split(", "))
        except TypeError:
            given = ", ".join(inspect.signature(function).parameters) or "nothing"
            found.append(f"{place_of(function)}: `{name}` takes ({given}); the engine gives it ({wanted})")
    return found


def place_of(function: Callable[..., Any]) -> str:
    """Such as "model.py, line 12"."""
    code = _code(function)
    return f"{Path(code.co_filename).name}, line {code.co_firstlineno}" if code else "the model"


def _code(function: Callable[..., Any]) -> Any:
    return getattr(inspect.unwrap(getattr(function, "function", function)), "__code__", None)


def _allocations(model: Model) -> list[str]:
    """Lists and arrays made inside physics: they would be made anew in every step of every case."""
    found = []
    for name, function in _functions(model):
        code = _code(function)
        if name in _INTERPRETED or code is None:
            continue
        try:
            tree = ast.parse(textwrap.dedent(inspect.getsource(code)))
        except (OSError, SyntaxError):
            continue  # no source at hand, as in an interactive session: the compiler will say
        for line, what in _allocating(tree):
            place = f"{Path(code.co_filename).name}, line {code.co_firstlineno + line - 1}"
            found.append(f"{place}: {what} in every step of `{name}`; keep numbers in named tuples instead")
    return found


def _allocating(tree: ast.AST) -> Iterator[tuple[int, str]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.List | ast.ListComp | ast.Dict | ast.DictComp | ast.Set | ast.SetComp):
            yield node.lineno, "a list, dictionary or set is made"
        elif isinstance(node, ast.Call):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if called in _ALLOCATING:
                yield node.lineno, f"`{ast.unparse(node.func)}` makes an array or list"


def _run_through(campaign: Campaign) -> None:
    """Each function once at the start of the nominal case, on arrays as of several cases."""
    model = campaign.model
    p, o = _inputs(campaign)
    s = _call(model, "initial", p, o)
    _check_numbers("initial", s, "the state")
    t = 0.0
    m = NoMemory(0.0) if model.start is None else _call(model, "start", p, o)
    if model.control is not None:
        sampled = _call(model, "control", t, s, m, p, o, Draws(noise_key(campaign.seed), 0.0, 0.0))
        if getattr(sampled, "_fields", None) != getattr(m, "_fields", None):
            raise Breach(f"{place_of(model.control)}: `control` gives {_shape(sampled)}, `start` {_shape(m)}; both "
                         "give the same memory")  # fmt: skip
        m = sampled
    derivative = _call(model, "rhs", t, s, m, p, o)
    if derivative._fields != s._fields:
        raise Breach(f"{place_of(model.rhs)}: `rhs` gives {_shape(derivative)}, `initial` {_shape(s)}; both give the "
                     "same named tuple")  # fmt: skip
    _check_numbers("rhs", derivative, "the derivative", model.rhs)
    seen = _call(model, "observe", t, s, m, p, o)
    if model.events is not None:
        _call(model, "events", t, s, m, p, o)
    best = namedtuple("Best", [one.name for one in model.extrema] or ["unused"])  # type: ignore[misc]
    names = [quantity.name for quantity in model.quantities]
    values = [seen[names.index(one.quantity)] for one in model.extrema] or [0.0]
    _call(model, "evaluate", t, s, m, p, o, best(*values), best(*[0.0 * value for value in values]))


def _inputs(campaign: Campaign) -> tuple[Any, Any]:
    """(p, o) of a few nominal cases as physics sees them: arrays, and the numbers that all share."""
    model = campaign.model
    try:
        ready = prepare(model, campaign.nominal, _FEW)
        settings = settings_of(model, ready.settings[0])
    except EngineError:
        raise
    except (KeyError, AttributeError) as error:
        missing = error.args[0] if isinstance(error, KeyError) else error.name
        if missing in model.kernel_parameters._fields:  # type: ignore[attr-defined]
            source = "`prepare` does not give it" if model.prepare else "no parameter has this name without its unit"
            raise Breach(f'kernel_parameters has the field "{missing}", but {source}') from None
        raise Breach(_sentence("prepare", error)) from None
    except Exception as error:
        raise Breach(_sentence("prepare", error)) from None
    if ready.refusals.mask[0]:
        raise Breach(f"the nominal case is refused: {ready.refusals.reason[0]}")
    for name, row in zip(model.kernel_parameters._fields, ready.parameters, strict=True):  # type: ignore[attr-defined]
        if not np.isfinite(row).all():
            raise Breach(f'`prepare` gives {row[0]:g} for "{name}" of the nominal case; it must be a number')
    return model.kernel_parameters(*ready.parameters), settings


def _call(model: Model, name: str, *arguments: Any) -> Any:
    """The result of one function of the model, a named tuple with a field for each that the model declares."""
    function = getattr(model, name)
    try:
        result = function(*arguments)
    except Exception as error:
        raise Breach(_sentence(name, error)) from None
    if not hasattr(result, "_fields"):
        raise Breach(f"{place_of(function)}: `{name}` gives {type(result).__name__}; it must give a named tuple")
    declared = _FIELDS.get(name)
    if declared is not None:
        _compare(
            function, name, result, declared, [getattr(one, "symbol", one.name) for one in getattr(model, declared)]
        )
    return result


def _compare(function: Callable[..., Any], name: str, result: Any, declared: str, symbols: list[str]) -> None:
    """Breach if the result has not one field for each declared one, in their order."""
    fields = list(result._fields)
    if len(fields) != len(symbols):
        missing = [one for one in symbols if one not in fields]
        more = [one for one in fields if one not in symbols]
        which = f"; {_listed(missing)} is missing" if missing else (f"; {_listed(more)} is too many" if more else "")
        raise Breach(f"{place_of(function)}: `{name}` gives {len(fields)} numbers, the model declares {len(symbols)} "
                     f"in `{declared}`{which}")  # fmt: skip
    if set(fields) == set(symbols) and fields != symbols:
        raise Breach(f"{place_of(function)}: `{name}` gives {_listed(fields)}; `{declared}` declares them in the order "
                     f"{_listed(symbols)}")  # fmt: skip


def _check_numbers(name: str, result: Any, what: str, function: Callable[..., Any] | None = None) -> None:
    for field, value in zip(result._fields, result, strict=True):
        if not np.isfinite(value).all():
            bad = np.ravel(value)[~np.isfinite(np.ravel(value))][0]
            place = f"{place_of(function)}: " if function is not None else ""
            raise Breach(f'{place}`{name}` gives {bad:g} for {what} of "{field}" at the start of the nominal case; '
                         "keep square roots, logarithms and divisions in range")  # fmt: skip


def _shape(result: Any) -> str:
    fields = getattr(result, "_fields", None)
    return type(result).__name__ if fields is None else f"{type(result).__name__}({', '.join(fields)})"


def _listed(names: list[str]) -> str:
    return ", ".join(f'"{name}"' for name in names)


def _sentence(name: str, error: Exception) -> str:
    """The error of the model's own code, at the line of the model that it comes from."""
    return f"{place_in_model(error) or 'the model'}: `{name}`: {_cause(error)}"


def _cause(error: Exception) -> str:
    text = str(error)
    if "truth value of an array" in text:
        return "`if`, `and`, `or` or `not` on a number that differs from case to case; use where(condition, a, b)"
    if "only length-1 arrays" in text or "only 0-dimensional arrays" in text or "must be real number, not" in text:
        return "a function of `math` on a number that differs from case to case; take it from mc_engine.lanes"
    if isinstance(error, AttributeError) and error.obj is not None and hasattr(error.obj, "_fields"):
        return f'there is no "{error.name}" in {_shape(error.obj)}'
    return f"{type(error).__name__}: {text}"
