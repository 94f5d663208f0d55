"""What the source of a model's physics shows to be wrong, read without running it: each fault a sentence.

Read are the model's functions and all the physics that they call, down to the engine's own.  What the reader cannot
follow is left to the trial and to the compiler.
"""

import ast
import builtins
import inspect
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model import Model
from mc_engine.physics_loops import MOST_TIMES, counts, times
from mc_engine.physics_scope import Scope, code_of, definition_of, running, shortened

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
_MADE = ast.List | ast.ListComp | ast.Dict | ast.DictComp | ast.Set | ast.SetComp
_BUILTINS = {"abs", "bool", "divmod", "enumerate", "float", "int", "len", "max", "min", "pow", "range",
             "round", "sum", "tuple", "zip"}  # fmt: skip
_RECORD = {"_replace": "write State(...) with every field", "_asdict": "name the fields one by one",
           "_make": "write State(...) with every field"}  # fmt: skip
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
    code = code_of(model.rhs)
    return code is not None and _ENGINE.with_name("campaigns") in Path(code.co_filename).resolve().parents


def place_of(function: Callable[..., Any]) -> str:
    """Such as "model.py, line 12"."""
    code = code_of(function)
    return f"{Path(code.co_filename).name}, line {code.co_firstlineno}" if code else "the model"


def _functions(model: Model) -> Iterator[tuple[str, Callable[..., Any]]]:
    for name in ARGUMENTS:
        function = getattr(model, name)
        if function is not None:
            yield name, function


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
        code = code_of(physics)
        if code is None or _ENGINE in Path(code.co_filename).parents:
            return
        if physics in callers:
            self._add(code, code.co_firstlineno, f"`{name}` calls itself; physics has no recursion, unroll it")
            return
        tree = None if physics in self._read else definition_of(code)
        self._read.add(physics)
        if tree is None:
            return
        if isinstance(tree, ast.AsyncFunctionDef):
            self._add(code, code.co_firstlineno, f"`{name}` is an async def; write def, physics waits for nothing")
            return
        if isinstance(tree, ast.FunctionDef) and tree.args.kwonlyargs:
            self._add(code, code.co_firstlineno, _behind_a_star(name, tree.args))
        nodes = list(running(tree))
        scope = Scope(inspect.unwrap(physics.function), nodes, self._settings)
        for node in nodes:
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


def _faults(node: ast.AST, name: str, scope: Scope) -> Iterator[str]:
    """Sentences on one node of the function `name`."""
    if isinstance(node, _MADE):
        yield f"a list, dictionary or set is made in every step of `{name}`; keep numbers in named tuples instead"
    elif isinstance(node, ast.While) and not counts(node, scope):
        yield f"`while` in `{name}` may never end for some case; write for k in range(most) and where(condition, a, b)"
    elif isinstance(node, ast.Global | ast.Nonlocal):
        yield f"`{ast.unparse(node)}` in `{name}`: {_OWN}; {_KEEP}"
    elif isinstance(node, ast.Name | ast.Attribute) and isinstance(scope.value(node), list | dict | set):
        kind = type(scope.value(node)).__name__
        yield f"`{ast.unparse(node)}` in `{name}` is a {kind} outside of it; physics reads numbers and tuples, {_KEEP}"
    elif isinstance(node, ast.Call):
        if times(node, scope) > MOST_TIMES:  # minutes of a step, or more
            yield f"`{ast.unparse(node)}` in `{name}` goes round more than {MOST_TIMES:,} times a step; shorten it"
        constant = all(scope.is_constant(one) for one in [*node.args, *(one.value for one in node.keywords)])
        if not scope.is_own(node.func):
            yield from _wrong_call(ast.unparse(node.func), scope.value(node.func), name, constant)
            yield from _left_to_a_default(node, scope.value(node.func), name)
    elif isinstance(node, ast.FunctionDef | ast.Lambda) and node.args.kwonlyargs:
        yield _behind_a_star(getattr(node, "name", "a lambda"), node.args)
    elif isinstance(node, ast.Import | ast.ImportFrom):
        yield f"`{ast.unparse(node)}` in `{name}`; move the import to the top of the file"
    elif isinstance(node, ast.Subscript) and not isinstance(node.ctx, ast.Load):
        if not isinstance(scope.value(node.value), list | dict | set):  # which is a mistake of its own
            yield f"`{ast.unparse(node)}` is written in `{name}`, where arrays and tuples are only read; {_KEEP}"
    elif isinstance(node, ast.Compare):
        yield from _compared_with_a_text(node, name, scope)
        yield from _compared_by_identity(node, name, scope)
    else:
        yield from _beyond_physics(node, name, scope)


def _behind_a_star(name: str, arguments: ast.arguments) -> str:
    words = ", ".join(f"`{one.arg}`" for one in arguments.kwonlyargs)
    return f"`{name}` has {words} behind a `*`, and kernels hand arguments over by their places; leave the star out"


def _left_to_a_default(node: ast.Call, called: Any, name: str) -> Iterator[str]:
    """One sentence on a named tuple made without some of its fields, whose defaults the compiler does not know."""
    given = len(node.args) + len(node.keywords)
    starred = any(isinstance(one, ast.Starred) for one in node.args) or any(one.arg is None for one in node.keywords)
    if isinstance(called, type) and getattr(called, "_field_defaults", None) and not starred:
        if given < len(getattr(called, "_fields", ())):
            yield f"`{shortened(ast.unparse(node))}` in `{name}` leaves a field to its default; write every field"


def _beyond_physics(node: ast.AST, name: str, scope: Scope) -> Iterator[str]:
    """One sentence on what Python can do and a kernel cannot."""
    text = shortened(ast.unparse(node)) if isinstance(node, ast.expr) else ""
    if isinstance(node, ast.GeneratorExp):
        yield f"`{text}` in `{name}` is a generator, which kernels cannot run; write its terms out, or loop with `for`"
    elif isinstance(node, ast.Yield | ast.YieldFrom | ast.Await):
        yield f"`{text}` in `{name}`: physics gives its result once, and at its end; write `return`"
    elif isinstance(node, ast.Starred) and isinstance(node.ctx, ast.Store):
        yield f"`{text}` in `{name}` takes the rest of a tuple; name each part, or cut it out, as s[2:]"
    elif isinstance(node, ast.Attribute) and not isinstance(node.ctx, ast.Load):
        yield f"`{text}` is set in `{name}`, where records are only read; make another, State(...) with every field"
    elif isinstance(node, ast.With | ast.AsyncWith):
        context = ", ".join(ast.unparse(item.context_expr) for item in node.items)
        if not any(isinstance(item.context_expr, ast.Call) and ast.unparse(item.context_expr.func) == "open"
                   for item in node.items):  # fmt: skip
            yield f"`with {shortened(context)}` in `{name}` is not for physics, which only computes; leave it out"
    elif isinstance(node, ast.Try | ast.TryStar) and not _is_plain(node, scope):
        yield (f"`try` in `{name}`: physics raises nothing, it goes on with an infinity or with what is not a number; "
               "keep arguments in range with where(condition, a, b)")  # fmt: skip


def _is_plain(node: ast.Try | ast.TryStar, scope: Scope) -> bool:
    """Whether it is a `try` that kernels have: one that asks for no error by its kind."""
    kinds = [scope.value(one.type) for one in node.handlers if one.type is not None]
    return isinstance(node, ast.Try) and all(kind is Exception for kind in kinds)


def _compared_by_identity(node: ast.Compare, name: str, scope: Scope) -> Iterator[str]:
    """One sentence on `is` between values of a case, which are never one object: it holds in none."""
    sides = [node.left, *node.comparators]
    if not any(isinstance(one, ast.Is | ast.IsNot) for one in node.ops) or all(map(scope.is_constant, sides)):
        return
    if any(isinstance(side, ast.Constant) and side.value is None for side in sides):
        return  # of an argument that may be left out
    fix = "a condition stands alone, or behind `not`; numbers are compared with == or !="
    yield f"`{shortened(ast.unparse(node))}` in `{name}` compares objects, not values; {fix}"


def _compared_with_a_text(node: ast.Compare, name: str, scope: Scope) -> Iterator[str]:
    """One sentence if a setting is compared with a word, for which kernels have a number."""
    for one, other in zip([node.left, *node.comparators], [*node.comparators, node.left], strict=True):
        for setting, word in ((one, other), (other, one)):
            texts = [scope.text(part) for part in getattr(word, "elts", [word])]
            if not isinstance(setting, ast.Attribute) or setting.attr not in scope.settings or None in texts:
                continue
            if texts and scope.value(_root(setting)) is None:
                choices, text = scope.settings[setting.attr], texts[0]
                place = f"; {text!r} is {choices.index(text)}.0, its place in `choices`" if text in choices else ""
                yield f"`{ast.unparse(node)}` in `{name}` compares with a text; in physics a setting is a number{place}"
                return


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
