"""What the source of a model's physics shows to be wrong, read without running it: each fault a sentence.

Read are the model's functions and all the physics that they call, down to the engine's own.  What the reader cannot
follow is left to the trial and to the compiler.
"""

import ast
import builtins
import inspect
import random
import sys
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model import Model
from mc_engine.syntax_tree import parse

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
         ast.While, ast.Global, ast.Nonlocal, ast.Import, ast.ImportFrom, ast.Subscript, ast.Compare)  # fmt: skip
_AT_DEFINITION = {"annotation", "returns", "defaults", "kw_defaults", "decorator_list"}  # run once, by Python alone
_BUILTINS = {"abs", "bool", "divmod", "enumerate", "float", "int", "len", "max", "min", "pow", "range",
             "round", "sum", "tuple", "zip"}  # fmt: skip
_RECORD = {"_replace": "write State(...) with every field", "_asdict": "name the fields one by one",
           "_make": "write State(...) with every field"}  # fmt: skip
_MOST_TIMES = 1_000_000  # of a loop, in one step
_FOREIGN = {"numpy", "numba", *sys.stdlib_module_names}
_OWN = "a case must depend on its inputs and case_id alone"
_KEEP = "what changes is kept in the state or in the memory"


def source_faults(model: Model) -> list[str]:
    """Sentences on functions without decorator or with other arguments, and on what physics cannot do."""
    found = list(_wrong_functions(model))
    reader = _Reader({one.symbol: one.choices for one in model.settings})
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
    tree = parse(Path(file).read_bytes())
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
    """Reads functions, each once, and gathers the faults.  settings : their choices by symbol."""

    def __init__(self, settings: Mapping[str, tuple[str, ...]]) -> None:
        self.found: list[str] = []
        self._settings = settings
        self._read: set[PhysicsFunction] = set()
        self._said: set[tuple[CodeType, str]] = set()

    def read(self, physics: PhysicsFunction, name: str, callers: tuple[PhysicsFunction, ...]) -> None:
        """Faults of a function and of the physics that it calls.  callers : the functions that it is called from.

        Functions are told apart by themselves, not by their code, which all that one factory makes share.
        """
        code = _code(physics)
        if code is None or _ENGINE in Path(code.co_filename).parents:
            return
        if physics in callers:
            self._add(code, code.co_firstlineno, f"`{name}` calls itself; physics has no recursion, unroll it")
            return
        tree = None if physics in self._read else _definition(code)
        self._read.add(physics)
        if tree is None:
            return
        nodes = list(_running(tree))
        scope = _Scope(inspect.unwrap(physics.function), nodes, self._settings)
        for node in nodes:
            if not isinstance(node, _READ):
                continue
            for sentence in _faults(node, name, scope):
                self._add(code, getattr(node, "lineno", code.co_firstlineno), sentence)
            called = scope.value(node)
            if isinstance(called, PhysicsFunction):
                self.read(called, called.function.__name__, (*callers, physics))
            elif isinstance(node, ast.Call) and _is_unmarked(scope.value(node.func)):
                helper = scope.value(node.func)
                sentence = f"`{helper.__name__}` is not marked, and `{name}` calls it; write @physics on the line above"
                self.found.append(f"{place_of(helper)}: {sentence}")

    def _add(self, code: CodeType, line: int, sentence: str) -> None:
        if (code, sentence) not in self._said:  # a name that is used twice is one mistake
            self._said.add((code, sentence))
            self.found.append(f"{Path(code.co_filename).name}, line {line}: {sentence}")


def _running(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes under a function that are run when it is called, in the order of the text."""
    for field, value in ast.iter_fields(node):
        if field in _AT_DEFINITION:
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield child
                yield from _running(child)


# What the attributes of may be read: nothing of it runs code of the user's.
_FOLLOWED = (ModuleType, np.random.Generator, np.random.RandomState, random.Random)


class _Scope:
    """What the names of a function stand for, as far as they come from outside of it."""

    def __init__(self, function: Any, nodes: list[ast.AST], settings: Mapping[str, tuple[str, ...]]):
        self.settings = settings
        cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
        self._closed = {name: cell.cell_contents for name, cell in cells}
        self._outside = function.__globals__
        own = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
        own |= {node.arg for node in nodes if isinstance(node, ast.arg)}
        own |= {node.name for node in nodes if isinstance(node, ast.FunctionDef)}
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
            return getattr(owner, node.attr, None) if isinstance(owner, _FOLLOWED) else None
        return None

    def is_constant(self, node: ast.AST) -> bool:
        """Whether an expression is the same in every case and step: it names nothing but what is outside."""
        return all(self.value(one) is not None for one in ast.walk(node) if isinstance(one, ast.Name))


def _faults(node: ast.AST, name: str, scope: _Scope) -> Iterator[str]:
    """Sentences on one node of the function `name`."""
    if isinstance(node, ast.List | ast.ListComp | ast.Dict | ast.DictComp | ast.Set | ast.SetComp):
        yield f"a list, dictionary or set is made in every step of `{name}`; keep numbers in named tuples instead"
    elif isinstance(node, ast.While) and not _counts(node, scope):
        yield f"`while` in `{name}` may never end for some case; write for k in range(most) and where(condition, a, b)"
    elif isinstance(node, ast.Global | ast.Nonlocal):
        yield f"`{ast.unparse(node)}` in `{name}`: {_OWN}; {_KEEP}"
    elif isinstance(node, ast.Name) and isinstance(scope.value(node), list | dict | set):
        kind = type(scope.value(node)).__name__
        yield f"`{node.id}` in `{name}` is a {kind} outside of it; physics reads numbers and tuples, {_KEEP}"
    elif isinstance(node, ast.Call):
        if _times(node, scope) > _MOST_TIMES:  # minutes of a step, or more
            yield f"`{ast.unparse(node)}` in `{name}` goes round more than {_MOST_TIMES:,} times a step; shorten it"
        constant = all(scope.is_constant(one) for one in [*node.args, *(one.value for one in node.keywords)])
        yield from _wrong_call(ast.unparse(node.func), scope.value(node.func), name, constant)
    elif isinstance(node, ast.Import | ast.ImportFrom):
        yield f"`{ast.unparse(node)}` in `{name}`; move the import to the top of the file"
    elif isinstance(node, ast.Subscript) and not isinstance(node.ctx, ast.Load):
        if not isinstance(scope.value(node.value), list | dict | set):  # which is a mistake of its own
            yield f"`{ast.unparse(node)}` is written in `{name}`, where arrays and tuples are only read; {_KEEP}"
    elif isinstance(node, ast.Compare):
        yield from _compared_with_a_text(node, name, scope)


def _times(node: ast.Call, scope: _Scope) -> int:
    """How often a loop over range(...) goes round, 0 where that is not known."""
    if scope.value(node.func) is not range or node.keywords:
        return 0
    bounds = [_whole(one, scope) for one in node.args]
    known = [one for one in bounds if one is not None]
    if len(known) < len(bounds) or not 1 <= len(known) <= 3 or known[2:] == [0]:
        return 0
    ends = range(*known)
    return max(0, (ends.stop - ends.start) // ends.step)


def _whole(node: ast.AST, scope: _Scope) -> int | None:
    """The whole number that is written, or named, or a power or product of such; None for anything else."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow | ast.Mult):
        left, right = _whole(node.left, scope), _whole(node.right, scope)
        if left is None or right is None:
            return None
        if isinstance(node.op, ast.Mult):
            return left * right
        return left**right if 0 <= right <= 64 and abs(left) <= _MOST_TIMES else None
    value = node.value if isinstance(node, ast.Constant) else scope.value(node)
    return value if isinstance(value, int) else None


def _counts(loop: ast.While, scope: _Scope) -> bool:
    """Whether a loop goes on until a counter, which it only steps, passes a bound that it leaves alone."""
    test = loop.test
    if not (isinstance(test, ast.Compare) and len(test.ops) == 1 and isinstance(test.left, ast.Name)):
        return False
    step = ast.Add if isinstance(test.ops[0], ast.Lt | ast.LtE) else ast.Sub
    if not isinstance(test.ops[0], ast.Lt | ast.LtE | ast.Gt | ast.GtE):
        return False
    end = test.comparators[0]
    most = end.value if isinstance(end, ast.Constant) else _whole(end, scope)
    if isinstance(most, int | float) and abs(most) > _MOST_TIMES:
        return False
    nodes = [node for line in loop.body for node in ast.walk(line)]
    written = [node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]
    bound = {node.id for node in ast.walk(end) if isinstance(node, ast.Name)}
    steps = [
        line
        for line in loop.body
        if isinstance(line, ast.AugAssign)
        and isinstance(line.target, ast.Name)
        and line.target.id == test.left.id
        and isinstance(line.op, step)
        and isinstance(line.value, ast.Constant)
        and isinstance(line.value.value, int | float)
        and line.value.value > 0
    ]
    skipped = any(isinstance(node, ast.Continue) for node in nodes)
    return bool(steps) and written.count(test.left.id) == 1 and not bound & set(written) and not skipped


def _compared_with_a_text(node: ast.Compare, name: str, scope: _Scope) -> Iterator[str]:
    """One sentence if a setting is compared with a word, for which kernels have a number."""
    for one, other in zip([node.left, *node.comparators], [*node.comparators, node.left], strict=True):
        for setting, word in ((one, other), (other, one)):
            texts = [_text(part, scope) for part in getattr(word, "elts", [word])]
            if not isinstance(setting, ast.Attribute) or setting.attr not in scope.settings or None in texts:
                continue
            if texts and scope.value(_root(setting)) is None:
                choices, text = scope.settings[setting.attr], texts[0]
                place = f"; {text!r} is {choices.index(text)}.0, its place in `choices`" if text in choices else ""
                yield f"`{ast.unparse(node)}` in `{name}` compares with a text; in physics a setting is a number{place}"
                return


def _text(node: ast.AST, scope: _Scope) -> str | None:
    value = node.value if isinstance(node, ast.Constant) else scope.value(node)
    return value if isinstance(value, str) else None


def _root(node: ast.expr) -> ast.expr:
    """What an attribute, or an attribute of one, is of."""
    while isinstance(node, ast.Attribute):
        node = node.value
    return node


def _wrong_call(text: str, called: Any, name: str, constant: bool) -> Iterator[str]:
    """constant : whether all that it is called with is the same in every case."""
    last, home = text.split(".")[-1], _home(called)
    if last in _ALLOCATING and (called is None or home[0] in ("numpy", "builtins")):
        yield f"`{text}` makes an array or list in every step of `{name}`; keep numbers in named tuples instead"
    elif last in _RECORD and "." in text:
        yield f"`{text}` in `{name}`: compiled physics makes a named tuple anew; {_RECORD[last]}"
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
    elif home[0] == "numpy" and not isinstance(called, type) and not constant:
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
