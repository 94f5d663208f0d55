"""Plans of earlier processes, kept beside the compiled kernels: a plan takes seconds, and every replay wants it again.

A plan is a function of its inputs, the sources, the libraries and the processor alone; a change of any of them is
another file.
"""

import os
import platform
from collections.abc import Callable
from hashlib import sha256

import numpy as np
import scipy

from mc_engine.flight.kernel import cache_folder


def remembered(inputs: np.ndarray, sources: str, compute: Callable[[], np.ndarray]) -> np.ndarray:
    """What `compute` returns, float64[n], from the cache where it was computed before; inputs : all that it reads.

    A file that cannot be read or written costs time, no result.
    """
    path = cache_folder() / "plans" / f"{_key(inputs, sources)}.npy"
    try:
        return np.asarray(np.load(path, allow_pickle=False), dtype=np.float64)
    except (OSError, ValueError, EOFError):
        found = compute()
    temporary = path.with_name(f".{os.getpid()}.{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with temporary.open("wb") as file:
            np.save(file, found, allow_pickle=False)
        os.replace(temporary, path)
    except OSError:
        pass  # a full or read-only disk: the next process plans again
    return found


def _key(inputs: np.ndarray, sources: str) -> str:
    from llvmlite import binding

    versions = f"{platform.python_version()} {np.__version__} {scipy.__version__} {binding.get_host_cpu_name()}"
    content = np.ascontiguousarray(inputs, dtype=np.float64).tobytes()
    return sha256(f"{sources} {versions} ".encode() + content).hexdigest()
