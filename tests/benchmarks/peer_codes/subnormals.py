"""Flushing of numbers below 2.2e-308 (subnormal) to zero, each of which costs an Intel processor some 150 cycles.

For a peer whose numbers fall so low, such as the density of the air far above its reference altitude.
"""

import ctypes
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

_FLUSHED = 0x8000 | 0x0040  # FTZ (of results) and DAZ (of operands) of MXCSR:  Intel SDM, volume 1, section 10.2.3
_MXCSR = 28  # its place in glibc's fenv_t of x86-64, which has 32 bytes


@cache
def _mathematics() -> ctypes.CDLL | None:
    """The library that sets MXCSR; None on processors other than x86-64, and without glibc."""
    there = platform.machine() == "x86_64" and platform.libc_ver()[0] == "glibc"
    return ctypes.CDLL("libm.so.6") if there else None


@contextmanager
def flushed() -> Iterator[None]:
    """Within, this thread flushes them, on x86-64 with glibc."""
    if (mathematics := _mathematics()) is None:
        yield
        return
    usual, changed = (ctypes.create_string_buffer(32) for _ in range(2))
    mathematics.fegetenv(usual)
    mathematics.fegetenv(changed)
    ctypes.c_uint32.from_buffer(changed, _MXCSR).value |= _FLUSHED
    mathematics.fesetenv(changed)
    try:
        yield
    finally:
        mathematics.fesetenv(usual)
