"""Kernels as machine code: kept on disk, loaded by LLVM, called through their address.

A kernel is loaded and called without numba, whose import takes longer than many a flight.  numba is imported only to
compile a kernel (`mc_engine.lanes.compiler`).

Each file holds the machine code of one kernel and its digest.  The digest is checked before loading, because damaged
machine code may crash or give wrong numbers.  The file name identifies all that the kernel was compiled for.  Files are
replaced as a whole.  If a file cannot be read or written, the kernel is compiled, and the flight continues.  A lock per
file prevents two processes from compiling the same kernel.
"""

import ctypes
import json
import logging
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import blake2b, sha256
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import binding

from mc_engine.errors import ModelError
from mc_engine.garbage_collection import without_collection

try:
    import fcntl
except ImportError:  # Windows: processes that start together may compile the same kernel, each for itself
    fcntl = None  # type: ignore[assignment]

Form = tuple[str, ...]  # "float64", "int64" or "uint64" for each argument, with "[]" or "[,]" for an array
_NUMBERS: dict[str, Any] = {"float64": ctypes.c_double, "int64": ctypes.c_int64, "uint64": ctypes.c_uint64}
_WORDS: dict[Any, str] = {float: "float64", int: "int64"} | {np.dtype(name): name for name in _NUMBERS}
_ARRAYS = {1: "[]", 2: "[,]"}
_DIGEST_BYTES = 32
_IDLE_NAMES = ("NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS")  # of numba's settings; they change no code of a kernel
ENDED_WITH_ERROR = (
    "the compiled physics ended with an error; physics computes numbers and raises nothing. "
    "`mc-engine debug FILE --case N` flies a case line by line"
)


class Kernel:
    """A function in machine code.  It is loaded from the disk, or compiled, when it is called with a form of arguments.

    path : beside which its files are kept.  compiled(form) : (name of the function, its library), from the compiler.
    compilations, loads : how often this object has had it compiled, and has found it on the disk.
    Calls run without the interpreter lock.  Arguments are numbers, and arrays of one or two dimensions, contiguous.
    """

    def __init__(self, path: Path, compiled: Callable[[Form], tuple[str, Any]]):
        self.compiled = compiled
        self.compilations = self.loads = 0
        self._path, self._codes, self._lock = path, dict[Form, _MachineCode](), threading.Lock()

    def __call__(self, *arguments: Any) -> int:
        form = form_of(arguments)
        code = self._codes.get(form)
        if code is None:
            with self._lock:
                code = self._codes.get(form) or self._codes.setdefault(form, self._loaded(form))
        return code(arguments)

    def file(self, form: Form, kind: str = "kernel", version: str = "") -> Path:
        """Where the machine code for such arguments is kept on this processor, or code of another kind and version."""
        what = sha256((repr((form, _target())) + version).encode()).hexdigest()
        return self._path.with_name(f"{self._path.stem}.{what[:16]}.{kind}")

    def library(self, form: Form) -> tuple[str, Any]:
        """(name of the function, its library), from the compiler.  Its machine code is kept, if it was not yet."""
        with without_collection():
            name, library = self.compiled(form)
        if not (file := self.file(form)).exists():
            save(file, _machine_code(name, library))
        return name, library

    def _loaded(self, form: Form) -> "_MachineCode":
        content, is_new = kept_or_made(self.file(form), lambda: self._content(form))
        self.compilations, self.loads = self.compilations + is_new, self.loads + (not is_new)
        names, _, code = content.partition(b"\n")
        return _MachineCode(json.loads(names), code, form)

    def _content(self, form: Form) -> bytes:
        with without_collection():
            return _machine_code(*self.compiled(form))


def _machine_code(name: str, library: Any) -> bytes:
    """What the file of a kernel holds."""
    code: bytes = library.object_file()
    return json.dumps([name, *library.outside_names]).encode() + b"\n" + code


class _MachineCode:
    """One object file in memory, with a linker of its own: names in it may be those of another kernel.

    names : of the kernel, and of the functions outside of the file that it calls.
    """

    def __init__(self, names: Sequence[str], code: bytes, form: Form):
        name, *outside = names
        _find(outside)
        self._engine = binding.create_mcjit_compiler(binding.parse_assembly(""), _machine())
        self._engine.add_object_file(binding.ObjectFileRef.from_data(code))
        self._engine.finalize_object()
        kinds = [kind for word in form for kind in _kinds(word)]
        prototype = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p, *kinds)
        self._function = prototype(self._engine.get_function_address(name))

    def __call__(self, arguments: Sequence[Any]) -> int:
        result, error = ctypes.c_int64(0), ctypes.c_void_p(None)
        values = [value for argument in arguments for value in _values(argument)]
        if self._function(ctypes.addressof(result), ctypes.addressof(error), *values):
            raise ModelError(ENDED_WITH_ERROR)
        return result.value


def _find(names: Sequence[str]) -> None:
    """Let the linker find these functions; ModelError for one that is nowhere."""
    if all(binding.address_of_symbol(name) for name in names):
        return
    from numba.core.registry import cpu_target

    assert cpu_target.target_context  # which tells LLVM where numba's own functions are, such as that of math.gamma
    for name in names:
        if not binding.address_of_symbol(name):
            raise ModelError(f"the compiled physics calls {name}, which is not there")


def form_of(arguments: Sequence[Any]) -> Form:
    """The form of a call's arguments; TypeError for what no kernel takes."""
    return tuple(_word(argument) for argument in arguments)


def _word(argument: Any) -> str:
    given = argument.dtype if isinstance(argument, np.ndarray | np.generic) else type(argument)
    kind = _WORDS.get(given)
    if kind is None:
        what = given.__name__ if isinstance(given, type) else given
        raise TypeError(f"a kernel takes {', '.join(_NUMBERS)} and arrays of them, not {what}")
    if not isinstance(argument, np.ndarray):
        return kind
    if argument.ndim not in _ARRAYS or not argument.flags.carray:
        what = f"one of {argument.ndim} dimensions" if argument.ndim not in _ARRAYS else "one with gaps or read-only"
        raise TypeError(f"a kernel takes contiguous arrays of one or two dimensions that can be written to, not {what}")
    return f"{kind}{_ARRAYS[argument.ndim]}"


def _kinds(word: str) -> list[Any]:
    """C types of an argument, as numba hands arrays to a function: two addresses that only Python's own memory needs,
    the number of items, the size of an item, the data, the lengths and the strides."""
    number, bracket, _ = word.partition("[")
    if not bracket:
        return [_NUMBERS[number]]
    n_dimensions = 1 + ("," in word)
    pair, lengths = [ctypes.c_void_p, ctypes.c_void_p], [ctypes.c_int64] * (2 * n_dimensions)
    return [*pair, ctypes.c_int64, ctypes.c_int64, ctypes.c_void_p, *lengths]


def _values(argument: Any) -> tuple[Any, ...]:
    if not isinstance(argument, np.ndarray):
        return (argument.item() if isinstance(argument, np.generic) else argument,)
    place, shape, strides = argument.ctypes.data, argument.shape, argument.strides
    return None, None, argument.size, argument.itemsize, place, *shape, *strides


def _machine() -> Any:
    """LLVM's description of this processor, of which loading needs the kind alone; for one linker, which ends it."""
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    return binding.Target.from_triple(binding.get_process_triple()).create_target_machine(jit=True)


@cache
def _target() -> tuple[Any, ...]:
    """What machine code is made for, besides the versions in the kernel's own name: the processor and its
    instructions, and what the environment and a file in the working folder ask of numba."""
    features = sorted(name for name, has in binding.get_host_cpu_features().items() if has)
    names = sorted(name for name in os.environ if name.startswith("NUMBA_") and name not in _IDLE_NAMES)
    asked: list[tuple[str, Any]] = [(name, os.environ[name]) for name in names]
    file = Path(".numba_config.yaml")
    asked += [(file.name, file.read_bytes())] if file.is_file() else []
    return binding.get_process_triple(), binding.get_host_cpu_name(), features, asked


# ---- on disk


def kept_or_made(path: Path, make: Callable[[], bytes]) -> tuple[bytes, bool]:
    """(content of a file of the cache, such as a kernel's, whether `make` had to give it).

    Of processes that ask together one compiles, the others load.  Where there is no sound file, or the disk refuses,
    `make` is called, with a warning that names the folder.
    """
    if (kept := _read(path)) is not None:
        return kept, False
    with _locked(path.with_suffix(".lock")):
        if (kept := _read(path, warn=False)) is not None:
            return kept, False
        content = make()
        save(path, content)
        return content, True


def _read(path: Path, warn: bool = True) -> bytes | None:
    """The content of a file of the cache; None where there is none, or it cannot be read or is damaged."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        if warn:
            _warn(path.parent, _reason(error), f"{path.name} cannot be read there, and is made again")
        return None
    digest, code = content[:_DIGEST_BYTES], content[_DIGEST_BYTES:]
    if digest == _digest(path, code):
        return code
    if warn:
        _warn(path.parent, f"{path.name} is damaged there", "it is made again")
    return None


def save(path: Path, content: bytes) -> None:
    """Keep a file of the cache; a warning with the folder where the disk refuses."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, _digest(path, content) + content)
    except OSError as error:
        what = "compiled kernels cannot be kept there, and will be compiled again; make room, or name another folder in"
        _warn(path.parent, _reason(error), f"{what} MC_ENGINE_CACHE")


def replace_file(path: Path, content: bytes) -> None:
    """Write a file of the cache, as a whole or not at all; OSError where the disk refuses."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.{threading.get_ident()}")
    try:
        temporary.write_bytes(content)
        os.replace(temporary, path)
    except OSError:
        with suppress(OSError):
            temporary.unlink()
        raise


def _digest(path: Path, content: bytes) -> bytes:
    place = f"{path.parent.name}/{path.name}"  # a file in another's place is no sound one
    return blake2b(place.encode() + content, digest_size=_DIGEST_BYTES).digest()


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold the system's lock on a file, which ends with its process.  Where the system has none, go on without.

    The file is deleted at the end: who waits for it finds the kernel on disk when the lock is theirs.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.open("ab")
    except OSError:
        yield
        return
    with file:
        with suppress(OSError, AttributeError):
            fcntl.flock(file, fcntl.LOCK_EX)
        try:
            yield
        finally:
            with suppress(OSError):
                path.unlink()
            with suppress(OSError, AttributeError):  # closing alone would leave it to a child that was forked meanwhile
                fcntl.flock(file, fcntl.LOCK_UN)


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error)


def _warn(folder: Path, reason: str, what: str) -> None:
    logging.getLogger("mc_engine").warning("%s: %s; %s", folder, reason, what)
