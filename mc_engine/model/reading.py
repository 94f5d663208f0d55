"""Check of the source of a model's physics against the list of what physics may contain; each breach is one sentence.

It reads the functions of the model and all physics that they call, including the engine's own.  The list is `_SYNTAX`,
`_VALUES` and `_BUILTINS`.  `mc_engine.model.trial` runs the physics to find what the source alone does not show.
"""

import ast
import builtins
import inspect
import random
import sys
from collections.abc import Callable, Iterator
from enum import Enum
from pathlib import Path
from types import CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numpy as np

from mc_engine.lanes.composed import Alternatives, ComposedFunction
from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model.faults import PHYSICS, source_place
from mc_engine.model.record import Model
from mc_engine.model.syntax_tree import repeated, tree_of_file

# The arguments that the engine hands to each function of a model.
ARGUMENTS = {
    "initial": ("p", "o"),
    "start": ("p", "o"),
    "rhs": ("t", "s", "m", "p", "o"),
    "control": ("t", "s", "m", "p", "o", "draws"),
    "events": ("t", "s", "m", "p", "o"),
    "switch": ("t", "s", "m", "p", "o", "hit"),
    "observe": ("t", "s", "m", "p", "o"),
    "evaluate": ("t", "s", "m", "p", "o", "best", "when"),
    "note": ("t", "s", "m", "p", "o", "hit"),  # the engine's own, of `observe`, which is known by its own name
    "prepare": ("inputs", "settings", "refusals"),
    "tables": ("o",),
}
INTERPRETED = ("prepare", "tables")  # NumPy, a whole chunk at a time

# The syntax of physics.
_SYNTAX = (
    ast.FunctionDef, ast.Lambda, ast.arguments, ast.arg, ast.Return, ast.Expr, ast.Pass, ast.Assert, ast.Raise,
    ast.Assign, ast.AugAssign, ast.AnnAssign, ast.NamedExpr,
    ast.If, ast.IfExp, ast.For, ast.While, ast.Break, ast.Continue, ast.Try, ast.ExceptHandler,
    ast.Match, ast.match_case, ast.pattern,
    ast.Constant, ast.Name, ast.Attribute, ast.Subscript, ast.Slice, ast.Tuple, ast.Starred, ast.Call, ast.keyword,
    ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare,
    ast.Add, ast.Sub, ast.Mult, ast.Div, ast.FloorDiv, ast.Mod, ast.Pow, ast.LShift, ast.RShift,
    ast.BitAnd, ast.BitOr, ast.BitXor, ast.UAdd, ast.USub, ast.Not, ast.boolop, ast.cmpop, ast.expr_context,
)  # fmt: skip
# What physics reads from outside of a function.  Functions are judged by `_wrong_function`.
_VALUES = (bool, int, float, str, tuple, np.ndarray, np.generic, Enum, type(None), ModuleType, SimpleNamespace, type,
           PhysicsFunction)  # fmt: skip
_BUILTINS = {abs, bool, divmod, enumerate, float, int, len, max, min, pow, range, round, sum, tuple, zip}

# How the sentence on `print` and `breakpoint()` ends, which a flight by Python allows.
FOR_DEBUGGING = (
    "would run in every step of every case; `mc-engine debug` flies one case that runs it; let `observe` give what "
    "histories are to show"
)
_TUPLES = "keep numbers in tuples and named tuples"
_KEEP = (
    "what changes is kept in the state or in the memory, and a record is made anew, State(...) with every field or "
    "replace(s, x=...) of mc_engine.lanes"
)
_OWN = "a case depends on its inputs and case_id alone: noise comes from the `draws` of `control`"
_RETURN = "physics computes and returns; write def and `return`"
# The usual fix of what is not on the list; without one, the list itself.
_FIXES = (
    ((ast.List, ast.Dict, ast.Set), f"a list, dictionary or set is not for physics; {_TUPLES}"),
    ((ast.ListComp, ast.DictComp, ast.SetComp, ast.GeneratorExp),
     f"a comprehension or generator is not for physics; write its terms out, or loop with `for`; {_TUPLES}"),
    ((ast.Yield, ast.YieldFrom, ast.Await, ast.AsyncFor, ast.AsyncWith, ast.AsyncFunctionDef),
     f"`async`, `await` and `yield` are not for physics; {_RETURN}"),
    ((ast.Global, ast.Nonlocal), f"physics assigns to its own names; {_KEEP}"),
    ((ast.Import, ast.ImportFrom), "an import is not for physics; move it to the top of the file"),
    ((ast.With,), "`with` is not for physics, which only computes; leave it out"),
    ((ast.MatMult,), "`@` is not for physics; write the products and their sum out"),
    ((ast.Invert,), "`~` is not for physics; write `not mask`"),
)  # fmt: skip

_ENGINE = Path(__file__).resolve().parents[1]
_PHASES = "mc_engine.model.phases"  # the module of the functions that make phases of the model's own
# Arguments of a call, a keyword counted twice.  Of more Python makes a tuple and a dictionary, which numba does not
# follow through a branch.
_MANY = 30
_AT_DEFINITION = {"annotation", "returns", "defaults", "kw_defaults", "decorator_list"}  # run once, by Python alone
# What the attributes of may be read: nothing of it runs code of the user's.
_FOLLOWED = (ModuleType, SimpleNamespace, np.random.Generator, np.random.RandomState, random.Random)


def source_faults(model: Model) -> list[str]:
    """Sentences on functions without decorator or with other arguments, and on what physics may not contain."""
    reader = _Reader(frozenset(setting.symbol for setting in model.settings))
    for name, function in functions_of_model(model):
        if name not in INTERPRETED and isinstance(function, PhysicsFunction):
            reader.read(function, name, ())
    return [*_wrong_functions(model), *reader.breaches, *_repeated(model)]


def is_shipped(model: Model) -> bool:
    """Whether the model is one of the project's own campaigns, which its tests hold to the contract."""
    code = code_of(model.rhs)
    return code is not None and _ENGINE.with_name("campaigns") in Path(code.co_filename).resolve().parents


def place_of(function: Callable[..., Any]) -> str:
    """Such as "model.py, line 12"."""
    code = code_of(function)
    return f"{Path(code.co_filename).name}, line {code.co_firstlineno}" if code else "the model"


def code_of(function: Callable[..., Any]) -> CodeType | None:
    """The code that a function, marked or not, was written as; None where it is something else."""
    return getattr(inspect.unwrap(getattr(function, "function", function)), "__code__", None)


def functions_of_model(model: Model) -> Iterator[tuple[str, Callable[..., Any]]]:
    """The functions of the model's file, each once, with what the engine calls it; not those that make its phases."""
    met: list[Any] = []
    for name in ARGUMENTS:
        for function in _parts(getattr(model, name)):
            own = getattr(function, "__module__", "") != _PHASES
            if function is not None and own and not any(function is other for other in met):
                met.append(function)
                yield name, function


def _parts(function: Any) -> Iterator[Any]:
    """A function, or those that it is composed of."""
    if not isinstance(function, ComposedFunction | Alternatives):
        yield function
        return
    for part in function.parts:
        yield from _parts(part)


def _wrong_functions(model: Model) -> Iterator[str]:
    for name, function in functions_of_model(model):
        wanted, called = ARGUMENTS[name], getattr(code_of(function), "co_name", name)
        if not callable(function):
            yield f"`{name}` is {function!r}; it must be a function"
            continue
        if name not in INTERPRETED:  # it is handed the arguments that it names
            if not isinstance(function, PhysicsFunction):
                yield f"{place_of(function)}: {_unmarked(called)}"
            continue
        try:
            inspect.signature(function).bind(*wanted)
        except TypeError:
            given = ", ".join(inspect.signature(function).parameters) or "nothing"
            yield f"{place_of(function)}: `{called}` takes ({given}); the engine gives it ({', '.join(wanted)})"


def _repeated(model: Model) -> Iterator[str]:
    """On keys and functions of the model's files of which Python keeps the last alone."""
    codes = [code_of(function) for _, function in functions_of_model(model)]
    files = [code.co_filename for code in codes if code and _ENGINE not in Path(code.co_filename).parents]
    for file in dict.fromkeys([*files, getattr(getattr(model.sources, "module", None), "__file__", None) or ""]):
        try:
            twice = [*repeated(tree_of_file(file))]
        except (SyntaxError, ValueError):  # no source of a file
            continue
        for line, what, before in twice:
            words = f"{what} is in line {before}, too, and Python keeps the last alone; give each a name of its own"
            yield f"{source_place(file, line)}: {words}"


class _Reader:
    """Reads functions, each once, and gathers the breaches.  settings : their symbols."""

    def __init__(self, settings: frozenset[str]) -> None:
        self.breaches: list[str] = []
        self._settings = settings
        self._read: set[PhysicsFunction] = set()
        self._named: set[tuple[CodeType, int | str]] = set()

    def read(self, physics: PhysicsFunction, name: str, callers: tuple[PhysicsFunction, ...]) -> None:
        """Breaches of a function and of the physics that it calls.  callers : the functions that it is called from.

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
        nodes = [(tree, code.co_firstlineno), *_running(tree, code.co_firstlineno)]
        scope = _Scope(inspect.unwrap(physics.function), [node for node, _ in nodes[1:]], self._settings)
        for node, line in nodes:
            if words := _breach(node, scope):
                self._add(code, line, words)
            called = scope.value(node)
            if isinstance(called, PhysicsFunction):
                self.read(called, called.function.__name__, (*callers, physics))

    def _add(self, code: CodeType, line: int, words: str) -> None:
        """One sentence a line, and one for a mistake that is made on several."""
        if not {(code, line), (code, words)} & self._named:
            self._named |= {(code, line), (code, words)}
            self.breaches.append(f"{source_place(code.co_filename, line)}: {words}")


class _Scope:
    """What the names of one function stand for, as far as they come from outside.  nodes : what runs in it."""

    def __init__(self, function: Any, nodes: list[ast.AST], settings: frozenset[str]):
        self.settings = settings
        cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
        self._outside = vars(builtins) | function.__globals__ | {name: cell.cell_contents for name, cell in cells}
        own = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
        own |= {node.arg for node in nodes if isinstance(node, ast.arg)}
        own |= {node.name for node in nodes if isinstance(node, ast.FunctionDef)}
        self._own = own - {name for node in nodes if isinstance(node, ast.Global) for name in node.names}

    def value(self, node: ast.AST) -> Any:
        """The object that a name, or an attribute of a module or class, stands for; None where that is not known."""
        if isinstance(node, ast.Name):
            return None if node.id in self._own else self._outside.get(node.id)
        if not isinstance(node, ast.Attribute):
            return None
        owner = self.value(node.value)
        if isinstance(owner, type):  # no descriptor and no metaclass runs
            held = inspect.getattr_static(owner, node.attr, None)
            return held.__func__ if isinstance(held, staticmethod) else held
        return getattr(owner, node.attr, None) if isinstance(owner, _FOLLOWED) else None

    def is_constant(self, node: ast.AST) -> bool:
        """Whether an expression is the same in every case and step: it names nothing but what is outside."""
        return all(self.value(part) is not None for part in ast.walk(node) if isinstance(part, ast.Name))

    def is_text(self, node: ast.AST) -> bool:
        """Whether it is a text, or a tuple of them, that is written or named."""
        if isinstance(node, ast.Tuple):
            return any(map(self.is_text, node.elts))
        return isinstance(node.value if isinstance(node, ast.Constant) else self.value(node), str)


def _running(node: ast.AST, line: int) -> Iterator[tuple[ast.AST, int]]:
    """The nodes under a function that are run when it is called, with their lines, in the order of the text."""
    for field, value in ast.iter_fields(node):
        if field in _AT_DEFINITION:
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                own = getattr(child, "lineno", line)
                yield child, own
                yield from _running(child, own)


def definition_of(code: CodeType) -> ast.AST | None:
    """The syntax tree of a function; None where there is no source, as in an interactive session."""
    try:
        tree = tree_of_file(code.co_filename)
    except (SyntaxError, ValueError):
        return None
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name == code.co_name:
            if min([node.lineno, *(mark.lineno for mark in node.decorator_list)]) == code.co_firstlineno:
                return node
    return None


def _breach(node: ast.AST, scope: _Scope) -> str:
    """What is wrong with one node, and the usual fix; "" for what physics may contain."""
    if not isinstance(node, _SYNTAX):
        return next((fix for kinds, fix in _FIXES if isinstance(node, kinds)), PHYSICS)
    if isinstance(getattr(node, "ctx", None), ast.Store) and not isinstance(node, ast.Name | ast.Tuple):
        return f"physics assigns to its own names, each by itself; {_KEEP}"
    if isinstance(node, ast.arguments) and node.kwonlyargs:
        return "arguments behind a `*` are not for physics, whose arguments are told by their places; leave it out"
    if isinstance(node, ast.Constant) and isinstance(node.value, complex | bytes):
        return "complex numbers and bytes are not for physics; keep two parts as two numbers"
    if isinstance(node, ast.While) and not _steps(node):
        return "`while` may never end for some case; write for k in range(most) and where(condition, a, b)"
    if isinstance(node, ast.ExceptHandler) and node.type and scope.value(node.type) is not Exception:
        return "physics raises nothing, numbers become infinite or NaN; keep them in range with where(condition, a, b)"
    if isinstance(node, ast.Compare):
        return _wrong_comparison(node, scope)
    return _wrong_call(node, scope) if isinstance(node, ast.Call) else _wrong_value(scope.value(node))


def _steps(loop: ast.While) -> bool:
    """Whether a loop compares something that it steps; the trial counts its rounds."""
    compared = {node.id for node in ast.walk(loop.test) if isinstance(node, ast.Name)}
    assigned = [node for line in loop.body if isinstance(line, ast.Assign | ast.AugAssign) for node in ast.walk(line)]
    stepped = {node.id for node in assigned if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    return isinstance(loop.test, ast.Compare) and bool(compared & stepped)


def _wrong_comparison(node: ast.Compare, scope: _Scope) -> str:
    """On a setting compared with a text, for which kernels have a number, and on `is`, which holds in no case."""
    sides = [node.left, *node.comparators]
    chosen = [side.attr for side in sides if isinstance(side, ast.Attribute) and side.attr in scope.settings]
    if chosen and any(map(scope.is_text, sides)) and not scope.is_constant(node):
        word = f"CHOICES.{chosen[0]}.word"
        return f"in physics a setting is a number, not a text; CHOICES = choices(Inputs) has it as {word}"
    if not any(isinstance(sign, ast.Is | ast.IsNot) for sign in node.ops) or all(map(scope.is_constant, sides)):
        return ""
    if any(isinstance(side, ast.Constant) and side.value is None for side in sides):
        return ""  # of an argument that may be left out
    return "`is` compares objects, not values; a condition stands alone or behind `not`, numbers have == and !="


def _wrong_call(node: ast.Call, scope: _Scope) -> str:
    """On a call of what is neither physics nor a named tuple, and on arguments that kernels do not take."""
    called, arguments = scope.value(node.func), [*node.args, *(named.value for named in node.keywords)]
    choices = [part for argument in arguments for part in ast.walk(argument) if _branches(part)]
    if choices and len(node.args) + 2 * len(node.keywords) > _MANY:
        chosen = ast.unparse(choices[0])
        return f"`{chosen}` decides within a call of too many arguments; give it a name on a line above the call"
    if called is None and isinstance(node.func, ast.Attribute) and not scope.is_constant(node.func):
        known = node.func.attr.startswith("_") or hasattr(np.ndarray, node.func.attr)
        return f"methods are not for physics: functions are those of mc_engine.lanes; {_KEEP}" if known else ""
    if isinstance(called, np.ufunc) and not all(map(scope.is_constant, arguments)):
        return "NumPy is for arrays; physics uses the functions of mc_engine.lanes"
    if not isinstance(called, type) or called in _BUILTINS or issubclass(called, np.generic | BaseException | Enum):
        return ""
    if hasattr(called, "_fields"):
        return ""
    return f"physics makes no objects of the class `{called.__name__}`; make it a namedtuple, and {_TUPLES}"


def _branches(node: ast.AST) -> bool:
    """Whether Python decides at this node what it computes next: `a if b else c`, `and`, `or`, `a < b < c`."""
    return isinstance(node, ast.IfExp | ast.BoolOp) or (isinstance(node, ast.Compare) and len(node.ops) > 1)


def _unmarked(name: str) -> str:
    """On a function that is not marked as physics; a lambda cannot have a decorator."""
    if name == "<lambda>":
        return "a lambda is not marked; write physics(lambda ...)"
    return f"`{name}` is not marked; write @physics on the line above it"


def _wrong_value(value: Any) -> str:
    """On a value from outside the function that physics cannot read, or must not."""
    home = (getattr(value, "__module__", None) or type(getattr(value, "__self__", None)).__module__ or "").split(".")
    if isinstance(value, list | dict | set):
        return f"a {type(value).__name__} outside of physics changes; physics reads numbers and tuples, {_KEEP}"
    if isinstance(value, _VALUES) or hasattr(type(value), "_numba_type_") or home[:2] == ["mc_engine", "lanes"]:
        return ""
    if isinstance(value, np.random.Generator | np.random.RandomState | random.Random) or "random" in home:
        return f"random numbers are not for physics; {_OWN}"
    if value in (print, breakpoint):
        return f"`{value.__name__}` {FOR_DEBUGGING}"
    if isinstance(value, np.ufunc) or (callable(value) and (value in _BUILTINS or home == ["math"])):
        return ""
    if isinstance(value, FunctionType) and home[0] not in ("numpy", *sys.stdlib_module_names):
        return _unmarked(value.__name__)
    name = getattr(value, "__name__", type(value).__name__)
    return f"`{name}` is not for physics, which has no clocks, files, arrays and objects; {PHYSICS}"
