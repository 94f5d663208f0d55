"""The digest that names a compiled kernel: of everything that the compiler reads, and of nothing else.

numba compiles a function from its bytecode, and takes the values of global names, closures and default arguments as
constants.  `kernel_key` follows the function objects of a model in the same way.  The digest does not depend on
comments, docstrings, line numbers, descriptions, file names or folders, nor on numbers that reach a kernel as
arguments: parameters, settings, tables, curves and the clock's times.  Functions of `mc_engine.lanes` are represented
by the digest of its sources, functions of Python and NumPy by their versions.

An object that is not understood, such as an enumeration or a function of a C library, is reported.  The caller then
names the kernel by all sources of the model: it is compiled more often than necessary, but never too seldom.
"""

import builtins
import dis
import platform
import struct
import sys
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from importlib import metadata
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType, SimpleNamespace
from typing import Any

import llvmlite
import numpy as np
from llvmlite import binding

from mc_engine.lanes.kernel_data import Blocks, DataBlock
from mc_engine.lanes.physics_function import PhysicsFunction

_KNOWN_BY_NAME = ("builtins", "cmath", "math", "mc_engine.lanes", "numpy", "operator")
_PLAIN = (bool, int, str, bytes, range, slice, type(None), type(Ellipsis))
_HAS_DOCSTRING = 0x4000000  # flag of code objects from Python 3.14 on; before, the first constant is the docstring
_PASSED_BY_CALLER = 0x04 | 0x08  # flags of *args and **named


def kernel_key(parts: Any, template: str) -> tuple[str, bool]:
    """(digest of all that a kernel is compiled from, whether every object in the parts was known).

    parts : of a model, as `parts_of` gives them with a `Recorder`; of a `compiled_loop`, its function as physics.
    template : source of the kernel's file
    """
    names: frozenset[str] = frozenset()
    while True:
        walk = _Walk(names)
        description = walk.value(parts)
        if walk.names == names:
            break
        names = walk.names  # physics that a namespace leads to may read further attributes of another
    what = repr((description, template, _engine_digest(), _versions()))
    return sha256(what.encode()).hexdigest(), walk.is_complete


class Recorder:
    """In place of `mc_engine.lanes.tuples`: its makers of intrinsics, which give what they are called with."""

    def __getattr__(self, maker: str) -> Any:
        return lambda *arguments: (maker, *arguments)


class _Walk:
    """One walk over the objects that compiled code reads; each is described by tuples of texts, numbers and bytes.

    read : names of the attributes that any function reads, as far as an earlier walk has found them.
    names : those that this walk has found.
    """

    def __init__(self, read: frozenset[str]):
        self.names = frozenset[str]()
        self.is_complete = True
        self._read = sorted(read)
        self._index: dict[int, int] = {}  # of functions, classes and namespaces in the order in which they were met
        self._met: list[Any] = []  # keeps them alive, and so their ids theirs

    def value(self, value: Any) -> Any:
        """A value that compiled code may hold as a constant, or call."""
        kind = type(value)
        if kind in _PLAIN:
            return kind.__name__, repr(value)
        if kind in (float, complex):
            return kind.__name__, struct.pack("<2d", value.real, value.imag)  # every bit, of NaN and -0.0 too
        if isinstance(value, np.ndarray | np.generic | np.dtype):
            return self._array(value)
        if isinstance(value, tuple) and hasattr(kind, "_fields"):
            return "record", self.value(kind), [self.value(field) for field in value]
        if kind in (tuple, list):
            return kind.__name__, [self.value(item) for item in value]
        if kind is frozenset:
            return kind.__name__, sorted(repr(self.value(item)) for item in value)
        if kind is dict:
            return kind.__name__, [(self.value(key), self.value(item)) for key, item in value.items()]
        if (name := _name_of(value)) is not None:
            return "name", name
        if id(value) in self._index:
            return "met", self._index[id(value)]
        self._index[id(value)] = len(self._met)
        self._met.append(value)
        return self._object(value)

    def _object(self, value: Any) -> Any:
        """A function, a class or a namespace."""
        if isinstance(value, PhysicsFunction) and isinstance(value.function, FunctionType):
            return "physics", self._function(value.function)
        if _is_dispatcher(value):
            options = sorted((name, repr(option)) for name, option in value.targetoptions.items())
            return "compiled", options, repr(value.locals), self._function(value.py_func)
        if isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields"):
            return "fields", value._fields, self.value(getattr(value, "_field_defaults", {}))
        if isinstance(value, DataBlock):
            return "block"  # its numbers are an argument of the kernel
        if isinstance(value, Blocks):
            return "blocks", [self.value(block) for block in value.blocks]
        if type(value) in (type, ModuleType, SimpleNamespace):
            read = [(name, getattr(value, name)) for name in self._read if hasattr(value, name)]
            return "namespace", [(name, self.value(attribute)) for name, attribute in read]
        self.is_complete = False  # also a function without a decorator: only an overload gives it a compiled meaning
        return "unknown", kind_name(value)

    def _array(self, value: Any) -> Any:
        if isinstance(value, np.dtype):
            return "dtype", repr(value)
        if value.dtype.hasobject:
            self.is_complete = False
        layout = [value.flags[name] for name in ("C_CONTIGUOUS", "F_CONTIGUOUS", "ALIGNED", "WRITEABLE")]
        what = type(value).__name__, repr(value.dtype), value.shape, layout
        return *what, sha256(value.tobytes()).hexdigest()

    def _function(self, function: FunctionType) -> Any:
        code, known = function.__code__, {**vars(builtins), **function.__globals__}
        self.names |= set(_names_in(code))
        globals_read = sorted(name for name in _globals_of(code) if name in known)
        values = [(name, self.value(known[name])) for name in globals_read]
        try:
            closure = [self.value(cell.cell_contents) for cell in function.__closure__ or ()]
        except ValueError:  # a cell that nothing was put in yet
            self.is_complete, closure = False, []
        defaults = self.value(function.__defaults__), self.value(function.__kwdefaults__)
        return self.code(code), values, closure, defaults

    def code(self, code: CodeType) -> Any:
        """What a code object does, without its docstring, lines, name and file."""
        constants = list(code.co_consts)
        if _has_docstring(code):
            constants[0] = None
        described = [self.code(item) if isinstance(item, CodeType) else self.value(item) for item in constants]
        arguments = code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags & _PASSED_BY_CALLER
        names = code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars
        return code.co_code, code.co_exceptiontable, described, arguments, names


def _is_dispatcher(value: Any) -> bool:
    """Whether numba compiles this object; a model that has one has imported numba."""
    numba: Any = sys.modules.get("numba.core.dispatcher")
    return numba is not None and isinstance(value, numba.Dispatcher)


def kind_name(value: Any) -> str:
    """Module and name of a value's class."""
    return f"{type(value).__module__}.{type(value).__qualname__}"


def _has_docstring(code: CodeType) -> bool:
    if sys.version_info >= (3, 14):
        return bool(code.co_flags & _HAS_DOCSTRING)
    is_function = code.co_flags & 0x03 == 0x03 and not code.co_name.startswith("<")
    return is_function and bool(code.co_consts) and isinstance(code.co_consts[0], str)


def _codes_in(code: CodeType) -> Iterator[CodeType]:
    """A code object and those of the functions inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes_in(constant)


def _names_in(code: CodeType) -> Iterator[str]:
    """Names that may be read as attributes, by a dot or by `getattr` with a text."""
    for inner in _codes_in(code):
        yield from inner.co_names
        yield from (constant for constant in inner.co_consts if isinstance(constant, str))


@cache  # several walks read the same functions
def _globals_of(code: CodeType) -> frozenset[str]:
    steps = (step for inner in _codes_in(code) for step in dis.get_instructions(inner))
    return frozenset(step.argval for step in steps if step.opname in ("LOAD_GLOBAL", "LOAD_NAME"))


def _name_of(value: Any) -> str | None:
    """Full name of an object whose meaning its name and the versions give; None for any other.

    The object must be what the name leads to: a decorator may give a user's function the name of another.
    """
    module: Any = "numpy" if isinstance(value, np.ufunc) else getattr(value, "__module__", None)
    name: Any = getattr(value, "__qualname__", None) or getattr(value, "__name__", None)
    if isinstance(value, ModuleType):
        module, name = value.__name__, ""
    elif isinstance(value, BuiltinFunctionType) and isinstance(value.__self__, ModuleType):
        module = value.__self__.__name__
    if not isinstance(module, str) or not isinstance(name, str):
        return None
    if not any(module == known or module.startswith(f"{known}.") for known in _KNOWN_BY_NAME):
        return None
    reached: Any = sys.modules.get(module)
    for part in name.split(".") if name else ():
        reached = getattr(reached, part, None)
    return f"{module}:{name}" if reached is value else None


@cache
def _engine_digest() -> str:
    """SHA-256 of the engine's compiled sources without comments: of the lanes, and the status codes.

    They are read as Python keeps them compiled, which is what runs; to parse them takes five times as long.
    """
    engine, walk, digest = Path(__file__).parents[1], _Walk(frozenset()), sha256()
    for path in (*sorted(engine.glob("lanes/*.py")), engine / "status.py"):
        code: Any = SourceFileLoader(path.stem, str(path)).get_code(path.stem)
        digest.update(repr((path.name, walk.code(code))).encode())
    return digest.hexdigest()


@cache
def _versions() -> str:
    """Versions of what compiles, and the processor that it compiles for."""
    versions = metadata.version("numba"), llvmlite.__version__, np.__version__, sys.version_info[:2]
    return f"{versions} {platform.machine()} {binding.get_host_cpu_name()}"
