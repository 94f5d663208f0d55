"""Syntax trees of Python sources: what a source imports, the data files that it names, what it defines twice."""

import ast
import linecache
import threading
from collections.abc import Iterable, Iterator
from functools import lru_cache

_LOCK = threading.Lock()
_RECORDS = ("model", "Simulator")  # which name data files


def parse(source: bytes | str) -> ast.Module:
    """The tree of a source; SyntaxError or ValueError where it is none.

    One at a time: in Python 3.11 trees that are made in two threads at once disturb each other (SystemError).
    """
    with _LOCK:
        return ast.parse(source)


def tree_of_file(file: str) -> ast.Module:
    """The tree of a source that was imported: of a model, as it was read then.  Not to be changed."""
    linecache.checkcache(file)
    return _tree("".join(linecache.getlines(file)))


@lru_cache(maxsize=64)
def _tree(source: str) -> ast.Module:
    return parse(source)


@lru_cache(maxsize=512)
def imported_names(source: bytes, package: str = "") -> frozenset[str]:
    """Dotted names of all that a source may import, the modules and what is taken from them; none of broken ones.

    package : that the source belongs to, for relative imports.
    """
    return frozenset(name for node in _nodes(source) for name in _names_imported_by(node, package))


@lru_cache(maxsize=512)
def data_names(source: bytes) -> frozenset[str]:
    """The texts that stand in the argument `data` of a call of `model` or `Simulator`; none of a broken source."""
    if b"data" not in source:
        return frozenset()  # it need not be parsed
    return _texts(_arguments(_calls(source, _RECORDS), "data"))


@lru_cache(maxsize=512)
def curve_files(source: bytes) -> frozenset[str]:
    """The files that calls of `curve`, `surface` and `wind_profile` name; none of a broken source."""
    calls = _calls(source, ("curve", "surface", "wind_profile"))
    return _texts([*_arguments(calls, "file"), *(call.args[0] for call in calls if call.args)])


def repeated(tree: ast.Module) -> Iterator[tuple[int, str, int]]:
    """(line, key of a dictionary or function of the module, line before) of what a source says twice.

    Python keeps the last alone.  A function that is used before it is defined again is none, nor one that a decorator
    may keep, as `overload` does.
    """
    for node in ast.walk(tree):
        met: dict[object, int] = {}
        for key in node.keys if isinstance(node, ast.Dict) else ():
            if isinstance(key, ast.Constant):
                if key.value in met:
                    yield key.lineno, f"the key {key.value!r} of a dictionary", met[key.value]
                met[key.value] = key.lineno
    defined: dict[str, int] = {}
    for statement in tree.body:
        function = statement if isinstance(statement, ast.FunctionDef) else None
        for part in [function.args, *function.decorator_list] if function else [statement]:
            for node in ast.walk(part):
                defined.pop(getattr(node, "id", ""), 0)
        if function and function.name in defined:
            yield function.lineno, f"the function `{function.name}`", defined[function.name]
        if function and all(getattr(item, "id", "") == "physics" for item in function.decorator_list):
            defined[function.name] = function.lineno


def _arguments(calls: list[ast.Call], name: str) -> list[ast.expr]:
    return [keyword.value for call in calls for keyword in call.keywords if keyword.arg == name]


def _calls(source: bytes, names: tuple[str, ...]) -> list[ast.Call]:
    """Calls of functions of these names, whatever they are attributes of."""
    if not any(name.encode() in source for name in names):
        return []
    calls = (node for node in _nodes(source) if isinstance(node, ast.Call))
    return [call for call in calls if getattr(call.func, "attr", getattr(call.func, "id", None)) in names]


@lru_cache(maxsize=64)
def _nodes(source: bytes) -> tuple[ast.AST, ...]:
    """All nodes of the tree of a source; none of a broken one."""
    try:
        return tuple(ast.walk(parse(source)))
    except (SyntaxError, ValueError, MemoryError, RecursionError):  # the last two: nested too deep
        return ()


def _texts(values: Iterable[ast.AST]) -> frozenset[str]:
    texts = (node.value for value in values for node in ast.walk(value) if isinstance(node, ast.Constant))
    return frozenset(text for text in texts if isinstance(text, str))


def _names_imported_by(node: ast.AST, package: str) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
        home = ".".join([*above, *([node.module] if node.module else [])])
        yield home
        yield from (f"{home}.{alias.name}" for alias in node.names)
