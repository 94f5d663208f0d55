"""Flushing of numbers below 2.2e-308 (subnormal) to zero, each of which costs an Intel processor some 150 cycles.

For a peer whose numbers fall so low, such as the density of the air far above its reference altitude.
"""

import ctypes
import ctypes.util
import platform
from collections.abc import Iterator
from contextlib import contextmanager

_FLUSHED = 0x8000 | 0x0040  # FTZ (of results) and DAZ (of operands) of MXCSR:  Intel SDM, volume 1, section 10.2.3
_MXCSR = 28  # its place in glibc's fenv_t of x86-64, which has 32 bytes


@contextmanager
def flushed() -> Iterator[None]:
    """Within, this thread flushes them; on processors other than x86-64 under Linux nothing changes."""
    if platform.machine() != "x86_64" or platform.libc_ver()[0] != "glibc":
        yield
        return
    mathematics = ctypes.CDLL(ctypes.util.find_library("m"))
    usual, changed = (ctypes.create_string_buffer(32) for _ in range(2))
    mathematics.fegetenv(usual)
    mathematics.fegetenv(changed)
    ctypes.c_uint32.from_buffer(changed, _MXCSR).value |= _FLUSHED
    mathematics.fesetenv(changed)
    try:
        yield
    finally:
        mathematics.fesetenv(usual)
