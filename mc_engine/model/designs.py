"""Design calculations that take seconds and serve all cases of a model, such as a burn program or a gain table.

A design is computed once and kept in the cache folder, where the next process, `resume` and `replay` find it.
"""

import dataclasses
import io
import os
import platform
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache, wraps
from hashlib import sha256
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from mc_engine.cache_folder import cache_folder
from mc_engine.durable_file import make_folder, read_file, write_durably
from mc_engine.errors import ModelError, StoreError
from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model.sources import made_of

_ENGINE = Path(__file__).parents[1]
_DIGEST_BYTES = 32
_one_at_a_time = threading.RLock()  # a design may ask for another


def kept_design(design: Callable[..., np.ndarray], *inputs: Any) -> np.ndarray:
    """The array that `design(*inputs)` returns, from the cache if it was computed before with the same inputs.

    design : function of a module; its result must depend on the inputs, the sources and the model's data files alone
    inputs : numbers, texts, None, arrays of numbers; tuples, lists, dictionaries, named tuples, dataclasses and
        `SimpleNamespace` of them

    Returns the array, of any shape and numeric type.

    One design is computed at a time.  A design may call `kept_design`, but not in threads that it waits for.

    A design is computed again after a change of its inputs, of a source in the folder of `design` or imported from
    there, of a data file or curve that such a source names, of the engine's physics, of NumPy or SciPy, or of the
    processor, and if its file is damaged.  If the cache cannot be written, the result is the same, but each call
    computes it anew.

    Raises TypeError for inputs of other types, which cannot be compared with those of a kept design.

    >>> from mc_engine.physics.attitude import rotation_quaternion
    >>> kept_design(rotation_quaternion, np.zeros(3))
    array([1., 0., 0., 0.])
    """
    key = sha256(f"{_sources(design.__module__)} {design.__qualname__} {_versions()} ".encode() + _content(inputs))
    path = cache_folder() / "designs" / f"{design.__name__}_{key.hexdigest()[:32]}.npy"
    with suppress(StoreError, ValueError):
        kept = read_file(path)
        if kept[:_DIGEST_BYTES] == _digest(path, kept[_DIGEST_BYTES:]):
            return np.asarray(np.load(io.BytesIO(kept[_DIGEST_BYTES:]), allow_pickle=False))
    with designing():
        designed = design(*inputs)
    with io.BytesIO() as file:
        np.save(file, designed, allow_pickle=False)
        content = file.getvalue()
    with suppress(StoreError):
        make_folder(path.parent)
        write_durably(path, _digest(path, content) + content)
    return designed


def _digest(path: Path, content: bytes) -> bytes:
    """SHA-256 of a cached file's name and content: content under another file's name is not valid."""
    return sha256(path.name.encode() + content).digest()


def compiled_loop(function: Callable[..., None]) -> Callable[..., None]:
    """Decorator that compiles a loop over numbers and arrays, for loops that take too long in Python or NumPy.

    function : its arguments are float64 and int64 numbers, and writable contiguous arrays of them with one or two
        dimensions.  It writes its results into arrays among its arguments, and returns nothing.  The functions that it
        calls are marked with `mc_engine.lanes.physics`; here they may take arrays.

    Returns the compiled function, whose arguments are given by position.  Its attribute `__wrapped__` is `function`.
    Both give the same bits if all mathematical functions are from `mc_engine.lanes`.

    The first call compiles, in a second or more, or loads the machine code from the cache folder, where it is kept
    under a digest of the function and of all that it calls and names.  Global numbers and arrays are constants.
    Indices are not checked.

    Raises ModelError at a call if the function returns something, or calls a function that is not physics; TypeError
    for arguments of other types.

    >>> @compiled_loop
    ... def add_up(x, total):
    ...     for i in range(x.size):
    ...         total[0] += x[i]
    >>> total = np.zeros(1)
    >>> add_up(np.array([1.0, 2.0, 3.5]), total)
    >>> total
    array([6.5])
    """

    @cache
    def kernel() -> Callable[..., int]:
        from mc_engine.lanes.kernel_cache import Kernel  # loads LLVM
        from mc_engine.lanes.kernel_key import kernel_key

        digest, is_complete = kernel_key(PhysicsFunction(function), "")
        if not is_complete:
            raise ModelError(f"{function.__qualname__} names what compiled code cannot follow; mark the functions that "
                             "it calls with @physics of mc_engine.lanes")  # fmt: skip
        return Kernel(cache_folder() / "kernels" / digest[:20] / function.__name__, compiled)

    def compiled(form: tuple[str, ...]) -> tuple[str, Any]:
        from mc_engine.lanes.compiler import compile_kernel  # imports numba

        return compile_kernel(function).library(form)

    @wraps(function)
    def run(*arguments: Any) -> None:
        kernel()(*arguments)

    return run


@contextmanager
def designing() -> Iterator[None]:
    """Within the block, no other design is computed, and linear algebra uses one thread.

    OpenBLAS divides its sums among threads, which changes the last digits, and an optimizer enlarges the difference.
    Without this, machines with different numbers of cores would fly different bits.
    """
    from threadpoolctl import threadpool_limits

    if os.environ.get("OPENBLAS_NUM_THREADS") != "1":  # as it is in commands
        import scipy.linalg  # noqa: F401  # its OpenBLAS must be there to be limited
    with _one_at_a_time, threadpool_limits(limits=1, user_api="blas"):
        yield


def _sources(module: str) -> str:
    """SHA-256 over the sources and data of a module, as they were imported, and over the engine's physics."""
    engine = [*_ENGINE.glob("lanes/*.py"), *_ENGINE.glob("physics/*.py")]
    files = [*made_of(module), *((path.name, path.read_bytes()) for path in engine)]
    digest = sha256()
    for item in sorted(f"{name} {sha256(content).hexdigest()} " for name, content in files):
        digest.update(item.encode())
    return digest.hexdigest()


@cache
def _versions() -> str:
    import scipy
    from llvmlite import binding

    return f"{platform.python_version()} {np.__version__} {scipy.__version__} {binding.get_host_cpu_name()}"


def _content(value: Any) -> bytes:
    """Bytes that differ wherever two inputs do."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, str | int | float | complex | None):
        return f"{value!r};".encode()
    if isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
        return f"{value.dtype.str}{value.shape}:".encode() + value.tobytes()
    if isinstance(value, SimpleNamespace) or dataclasses.is_dataclass(value):
        value = vars(value)
    if isinstance(value, Mapping):
        value = tuple(value.items())
    if isinstance(value, tuple | list):
        return b"(" + b"".join(_content(part) for part in value) + b")"
    raise TypeError(f"a kept design cannot depend on a {type(value).__name__}; see mc_engine.model.kept_design")
