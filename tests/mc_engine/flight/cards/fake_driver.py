"""A stand-in for the NVIDIA driver behind cuda-bindings: memory of this process, and kernels as their processor twins.

As with the driver, a thread needs a context before it asks for anything, a copy or launch is done when its stream is
waited for and not before, and memory begins undefined.  A copy beyond its block and a wrong argument are errors.
"""

import ctypes
import re
import sys
import threading
from importlib.machinery import ModuleSpec
from types import ModuleType, SimpleNamespace

import numpy as np
from processor_twin import ProcessorTwin

from mc_engine.runner import cards

_INVALID, _NO_DEVICE = 1, 100
_MAJOR, _MINOR = 75, 76


class FakeDriver:
    """The functions of `cuda.bindings.driver` that the engine calls.

    cards : (major, minor) of each.  memory : bytes of a card that are free at first.  launches : the number of threads
    of each, by card.  fails : name of a function that reports an error.
    """

    CUdevice_attribute = SimpleNamespace(
        CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR=_MAJOR, CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR=_MINOR
    )

    def __init__(self, cards=((9, 0),), memory=2**30, fails=None):
        self._cards, self._fails, self.free = cards, fails, [memory] * len(cards)
        self.launches = [[] for _ in cards]
        self.codes, self._twins = {}, {}
        self._here = threading.local()
        self._blocks, self._streams = {}, {}
        self._lock = threading.RLock()

    def __getattribute__(self, name):
        if name.startswith("cu") and name == object.__getattribute__(self, "_fails"):
            return lambda *arguments: (_INVALID, *([None] * 4))
        return object.__getattribute__(self, name)

    def cuInit(self, flags):
        return (0 if self._cards else _NO_DEVICE,)

    def cuGetErrorString(self, code):
        return 0, {_INVALID: b"invalid argument", _NO_DEVICE: b"no CUDA-capable device is detected"}[code]

    def cuDeviceGetCount(self):
        return 0, len(self._cards)

    def cuDeviceGet(self, number):
        return 0, number

    def cuDeviceGetName(self, length, device):
        return 0, b"Stand-in %d" % device + b"\0" * 8

    def cuDeviceGetAttribute(self, kind, device):
        return 0, self._cards[device][kind - _MAJOR]

    def cuDevicePrimaryCtxRetain(self, device):
        return 0, ("context", device)

    def cuCtxSetCurrent(self, context):
        self._here.card = context[1]
        return (0,)

    def cuMemGetInfo(self):
        return 0, self.free[self._here.card], 2 * self.free[self._here.card]

    def cuStreamCreate(self, flags):
        with self._lock:
            stream = len(self._streams) + 1
            self._streams[stream] = (self._here.card, [])
        return 0, stream

    def cuMemAlloc(self, size):
        if size > self.free[self._here.card]:
            return _INVALID, 0
        self.free[self._here.card] -= size
        return 0, self._allocated(("card", self._here.card), size)

    def cuMemAllocHost(self, size):
        return 0, self._allocated("pinned", size)

    def cuMemFree(self, address):
        self.free[self._here.card] += self._freed(("card", self._here.card), address)
        return (0,)

    def cuMemFreeHost(self, address):
        self._freed("pinned", address)
        return (0,)

    def cuModuleLoadData(self, image):
        text = image.decode()
        major, minor = self._cards[self._here.card]
        written_for = int(re.search(r"\.target sm_(\d+)", text)[1])
        assert text.endswith("\0")
        assert written_for <= 10 * major + minor
        return 0, text.rstrip("\0")

    def cuModuleGetFunction(self, module, name):
        assert f".visible .entry {name.decode()}(" in module
        with self._lock:
            code = self.codes[module]
            if code not in self._twins:
                self._twins[code] = ProcessorTwin(code)
            return 0, self._twins[code]

    def cuMemcpyHtoDAsync(self, to, origin, size, stream):
        self._check("pinned", origin, size)
        self._check(("card", self._here.card), to, size)
        return self._later(stream, lambda: ctypes.memmove(to, origin, size))

    def cuMemcpyDtoHAsync(self, to, origin, size, stream):
        self._check("pinned", to, size)
        self._check(("card", self._here.card), origin, size)
        return self._later(stream, lambda: ctypes.memmove(to, origin, size))

    def cuLaunchKernel(self, entry, blocks, y, z, threads, ty, tz, shared, stream, parameters, extra):
        assert (y, z, ty, tz, shared, extra) == (1, 1, 1, 1, 0, 0)
        (address,) = np.ctypeslib.as_array(ctypes.cast(parameters, ctypes.POINTER(ctypes.c_uint64)), (1,))
        # the driver copies the parameters when it launches; what becomes of them later is nothing to it
        size = 8 * entry.n_words
        words = np.frombuffer(ctypes.string_at(int(address), size), dtype=np.uint64).copy()
        self.launches[self._here.card].append(blocks * threads)
        return self._later(stream, lambda: entry.fly(words, blocks, threads))

    def cuStreamSynchronize(self, stream):
        of_card, work = self._streams[stream]
        assert of_card == self._here.card
        with self._lock:  # the twin has one place for the number of its thread
            while work:
                work.pop(0)()
        return (0,)

    def _later(self, stream, work):
        assert self._streams[stream][0] == self._here.card
        self._streams[stream][1].append(work)
        return (0,)

    def _allocated(self, where, size):
        block = ctypes.create_string_buffer(b"\xa5" * size, size)
        with self._lock:
            self._blocks[where, ctypes.addressof(block)] = block
        return ctypes.addressof(block)

    def _freed(self, where, address):
        with self._lock:
            return len(self._blocks.pop((where, address)))

    def _check(self, where, address, size):
        with self._lock:
            inside = [begin <= address and address + size <= begin + len(block)
                      for (place, begin), block in self._blocks.items() if place == where]  # fmt: skip
        assert any(inside)


def install(monkeypatch, fake):
    """Let the engine find this driver and no other, in place of cuda-bindings."""
    bindings, package = ModuleType("cuda.bindings"), ModuleType("cuda")
    bindings.__spec__, package.__spec__ = ModuleSpec("cuda.bindings", None), ModuleSpec("cuda", None)
    bindings.driver, package.bindings, package.__path__ = fake, bindings, []
    monkeypatch.setitem(sys.modules, "cuda", package)
    monkeypatch.setitem(sys.modules, "cuda.bindings", bindings)
    write = cards.ptx_of

    def noted(code, capability):
        text = write(code, capability)
        fake.codes[text] = code
        return text

    monkeypatch.setattr(cards, "ptx_of", noted)
    cards.cards.cache_clear()
    cards.opened.cache_clear()
    return fake
