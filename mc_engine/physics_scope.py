"""What the names in a function of physics stand for, as far as they come from outside of it."""

import ast
import builtins
import inspect
import random
from collections.abc import Callable, Iterator, Mapping
from types import CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numpy as np

from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.syntax_tree import tree_of_file

_AT_DEFINITION = {"annotation", "returns", "defaults", "kw_defaults", "decorator_list"}  # run once, by Python alone
# What the attributes of may be read: nothing of it runs code of the user's.
_FOLLOWED = (ModuleType, SimpleNamespace, np.random.Generator, np.random.RandomState, random.Random)
# what of a class is read; kernels take the same of it, see `mc_engine.lanes.namespaces`
_OF_CLASSES = (bool, int, float, str, tuple, list, dict, set, np.ndarray, np.generic, PhysicsFunction, FunctionType)

_LONG = 60  # characters of a piece of source in a sentence


class Scope:
    """The names of one function.  nodes : what runs in it; settings : their choices by symbol."""

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
        """The object that a name, or an attribute of a module or class, stands for; None where that is not known."""
        if isinstance(node, ast.Name):
            if node.id in self._own:
                return None
            if node.id in self._closed:
                return self._closed[node.id]
            return self._outside.get(node.id, getattr(builtins, node.id, None))
        if isinstance(node, ast.Attribute):
            owner = self.value(node.value)
            if isinstance(owner, type):
                return _of_class(owner, node.attr)
            return getattr(owner, node.attr, None) if isinstance(owner, _FOLLOWED) else None
        return None

    def is_own(self, node: ast.AST) -> bool:
        """Whether it is a name of the function's own: an argument, a variable, a function made in it."""
        return isinstance(node, ast.Name) and node.id in self._own

    def text(self, node: ast.AST) -> str | None:
        """The text that is written, or named; None for anything else."""
        value = node.value if isinstance(node, ast.Constant) else self.value(node)
        return value if isinstance(value, str) else None

    def is_constant(self, node: ast.AST) -> bool:
        """Whether an expression is the same in every case and step: it names nothing but what is outside."""
        return all(self.value(one) is not None for one in ast.walk(node) if isinstance(one, ast.Name))


def _of_class(owner: type, name: str) -> Any:
    found = inspect.getattr_static(owner, name, None)  # no descriptor and no metaclass runs
    found = found.__func__ if isinstance(found, staticmethod) else found
    return found if isinstance(found, _OF_CLASSES) else None


def running(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes under a function that are run when it is called, in the order of the text."""
    for field, value in ast.iter_fields(node):
        if field in _AT_DEFINITION:
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield child
                yield from running(child)


def code_of(function: Callable[..., Any]) -> CodeType | None:
    """The code that a function, marked or not, was written as; None where it is something else."""
    return getattr(inspect.unwrap(getattr(function, "function", function)), "__code__", None)


def definition_of(code: CodeType) -> ast.AST | None:
    """The syntax tree of a function; None where there is no source, as in an interactive session."""
    try:
        tree = tree_of_file(code.co_filename)
    except (SyntaxError, ValueError):
        return None
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name == code.co_name:
            if min([node.lineno, *(one.lineno for one in node.decorator_list)]) == code.co_firstlineno:
                return node
    return None


def shortened(text: str) -> str:
    """A piece of source for a sentence: on one line, cut where it is long."""
    text = " ".join(text.split())
    return text if len(text) <= _LONG else f"{text[: _LONG - 3].rstrip()}..."
