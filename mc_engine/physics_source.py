"""What the source of a model's physics shows to be wrong, read without running it: each fault a sentence.

Read are the model's functions and all the physics that they call, down to the engine's own.  What the reader cannot
follow is left to the trial and to the compiler.
"""

import ast
import builtins
import inspect
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model import Model

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
INTERPRETED = ("prepare", "tables")  # NumPy, a whole chunk at a time
_ENGINE = Path(__file__).resolve().parent
_ALLOCATING = {"array", "arange", "empty", "zeros", "ones", "full", "linspace", "stack", "concatenate", "list", "dict"}
_READ = (ast.Name, ast.Attribute, ast.Call, ast.List, ast.ListComp, ast.Dict, ast.DictComp, ast.Set, ast.SetComp,
         ast.While, ast.Global, ast.Nonlocal)  # fmt: skip
_BUILTINS = {"abs", "bool", "enumerate", "float", "int", "len", "max", "min", "pow", "range", "round", "tuple", "zip"}
_FOREIGN = {"numpy", "numba", *sys.stdlib_module_names}
_OWN = "a case must depend on its inputs and case_id alone"
_KEEP = "what changes is kept in the state or in the memory"


def source_faults(model: Model) -> list[str]:
    """Sentences on functions without decorator or with other arguments, and on what physics cannot do."""
    found = list(_wrong_functions(model))
    reader = _Reader()
    for name, function in _functions(model):
        if name not in INTERPRETED and isinstance(function, PhysicsFunction):
            reader.read(function, name, ())
    return list(dict.fromkeys([*found, *reader.found]))


def is_shipped(model: Model) -> bool:
    """Whether the model is one of the project's own campaigns, which its tests hold to the contract."""
    code = _code(model.rhs)
    return code is not None and _ENGINE.with_name("campaigns") in Path(code.co_filename).resolve().parents


def place_of(function: Callable[..., Any]) -> str:
    """Such as "model.py, line 12"."""
    code = _code(function)
    return f"{Path(code.co_filename).name}, line {code.co_firstlineno}" if code else "the model"


def _functions(model: Model) -> Iterator[tuple[str, Callable[..., Any]]]:
    for name in ARGUMENTS:
        function = getattr(model, name)
        if function is not None:
            yield name, function


def _code(function: Callable[..., Any]) -> CodeType | None:
    return getattr(inspect.unwrap(getattr(function, "function", function)), "__code__", None)


def _wrong_functions(model: Model) -> Iterator[str]:
    for name, function in _functions(model):
        wanted = ARGUMENTS[name]
        if not callable(function):
            yield f"`{name}` is {function!r}; it must be a function"
            continue
        if name not in INTERPRETED and not isinstance(function, PhysicsFunction):
            yield f"{place_of(function)}: `{name}` is not marked; write @physics on the line above it"
            continue
        try:
            inspect.signature(function).bind(*wanted.split(", "))
        except TypeError:
            given = ", ".join(inspect.signature(function).parameters) or "nothing"
            yield f"{place_of(function)}: `{name}` takes ({given}); the engine gives it ({wanted})"


@lru_cache(maxsize=64)
def _definitions(file: str, changed: float) -> Mapping[tuple[str, int], ast.AST]:
    """The functions of a file by name and first line, decorators included.  changed : when the file was written."""
    tree = ast.parse(Path(file).read_bytes())
    nodes = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    return {(node.name, min([node.lineno, *(one.lineno for one in node.decorator_list)])): node for node in nodes}


def _definition(code: CodeType) -> ast.AST | None:
    """The syntax tree of a function; None where there is no source, as in an interactive session."""
    try:
        known = _definitions(code.co_filename, Path(code.co_filename).stat().st_mtime)
    except (OSError, SyntaxError, ValueError):
        return None
    return known.get((code.co_name, code.co_firstlineno))


class _Reader:
    """Reads functions, each once, and gathers the faults."""

    def __init__(self) -> None:
        self.found: list[str] = []
        self._read: set[CodeType] = set()
        self._said: set[tuple[CodeType, str]] = set()

    def read(self, physics: PhysicsFunction, name: str, callers: tuple[CodeType, ...]) -> None:
        """Faults of a function and of the physics that it calls.  callers : the functions that it is called from."""
        code = _code(physics)
        if code is None or _ENGINE in Path(code.co_filename).parents:
            return
        if code in callers:
            self._add(code, code.co_firstlineno, f"`{name}` calls itself; physics has no recursion, unroll it")
            return
        tree = None if code in self._read else _definition(code)
        self._read.add(code)
        if tree is None:
            return
        nodes = list(ast.walk(tree))
        scope = _Scope(inspect.unwrap(physics.function), nodes)
        for node in nodes:
            if not isinstance(node, _READ):
                continue
            for sentence in _faults(node, name, scope):
                self._add(code, getattr(node, "lineno", code.co_firstlineno), sentence)
            called = scope.value(node)
            if isinstance(called, PhysicsFunction):
                self.read(called, called.function.__name__, (*callers, code))
            elif isinstance(node, ast.Call) and _is_unmarked(scope.value(node.func)):
                helper = scope.value(node.func)
                sentence = f"`{helper.__name__}` is not marked, and `{name}` calls it; write @physics on the line above"
                self.found.append(f"{place_of(helper)}: {sentence}")

    def _add(self, code: CodeType, line: int, sentence: str) -> None:
        if (code, sentence) not in self._said:  # a name that is used twice is one mistake
            self._said.add((code, sentence))
            self.found.append(f"{Path(code.co_filename).name}, line {line}: {sentence}")


class _Scope:
    """What the names of a function stand for, as far as they come from outside of it."""

    def __init__(self, function: Any, nodes: list[ast.AST]):
        cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
        self._closed = {name: cell.cell_contents for name, cell in cells}
        self._outside = function.__globals__
        own = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
        own |= {node.arg for node in nodes if isinstance(node, ast.arg)}
        self._own = own - {name for node in nodes if isinstance(node, ast.Global) for name in node.names}

    def value(self, node: ast.AST) -> Any:
        """The object that a name, or an attribute of a module, stands for; None where that is not known."""
        if isinstance(node, ast.Name):
            if node.id in self._own:
                return None
            if node.id in self._closed:
                return self._closed[node.id]
            return self._outside.get(node.id, getattr(builtins, node.id, None))
        if isinstance(node, ast.Attribute):
            owner = self.value(node.value)
            return getattr(owner, node.attr, None) if isinstance(owner, ModuleType) else None
        return None


def _faults(node: ast.AST, name: str, scope: _Scope) -> Iterator[str]:
    """Sentences on one node of the function `name`."""
    if isinstance(node, ast.List | ast.ListComp | ast.Dict | ast.DictComp | ast.Set | ast.SetComp):
        yield f"a list, dictionary or set is made in every step of `{name}`; keep numbers in named tuples instead"
    elif isinstance(node, ast.While):
        yield f"`while` in `{name}` may never end for some case; write for k in range(most) and where(condition, a, b)"
    elif isinstance(node, ast.Global | ast.Nonlocal):
        yield f"`{ast.unparse(node)}` in `{name}`: {_OWN}; {_KEEP}"
    elif isinstance(node, ast.Name) and isinstance(scope.value(node), list | dict | set):
        kind = type(scope.value(node)).__name__
        yield f"`{node.id}` in `{name}` is a {kind} outside of it; physics reads numbers and tuples, {_KEEP}"
    elif isinstance(node, ast.Call):
        yield from _wrong_call(ast.unparse(node.func), scope.value(node.func), name)


def _wrong_call(text: str, called: Any, name: str) -> Iterator[str]:
    last, home = text.split(".")[-1], _home(called)
    if last in _ALLOCATING and (called is None or home[0] in ("numpy", "builtins")):
        yield f"`{text}` makes an array or list in every step of `{name}`; keep numbers in named tuples instead"
    elif called is None or isinstance(called, PhysicsFunction) or hasattr(called, "_fields"):
        return
    elif called is print:
        yield f"`print` in `{name}` runs in every step of every case; let `observe` give what histories are to show"
    elif called is getattr(builtins, last, None) and last not in _BUILTINS and not isinstance(called, type):
        yield f"`{text}` is not for physics, and `{name}` calls it; physics reads parameters, settings and `tables`"
    elif home[:2] == ("numpy", "random") or (
        home[0] in sys.stdlib_module_names and home[0] not in ("builtins", "math")
    ):
        yield f"`{text}` in `{name}`: {_OWN}; noise comes from the `draws` of `control`"
    elif home[0] == "numpy" and not isinstance(called, type):
        yield f"`{text}` in `{name}` is for arrays; physics uses the functions of mc_engine.lanes"


def _home(called: Any) -> tuple[str, ...]:
    """The module, part by part, that a function comes from; of a method, that of its object."""
    module = getattr(called, "__module__", None) or type(getattr(called, "__self__", None)).__module__
    return tuple(str(module).split(".")) if called is not None else ("",)


def _is_unmarked(called: Any) -> bool:
    """Whether a function of the user's own lacks its decorator."""
    return isinstance(called, FunctionType) and not _ours(called) and _home(called)[0] not in _FOREIGN


def _ours(called: FunctionType) -> bool:
    return _ENGINE in Path(called.__code__.co_filename).parents
