"""Compiled models flown on NVIDIA cards.  Tests use a substitute for the driver, or a card if there is one.

Every flight has a stream, a block of the card's memory, and a block of host memory that the card reads directly
("pinned").  Both blocks have the same layout: inputs copied to the card, then results copied back.  Threads that fly at
the same time have a stream each, so that the copies of one flight run while another computes.  Blocks are kept for the
next flight.
"""

import ctypes
import importlib.util
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.errors import EngineError, ModelError
from mc_engine.extras import how_to_install
from mc_engine.flight.card_code import (
    CAPABILITIES,
    ENTRY,
    FAILED,
    OLDEST,
    PER_CASE,
    STATUS,
    ptx_of,
    thread_code,
    words_of,
)
from mc_engine.flight.compiled import CompiledFlyer
from mc_engine.flight.kernel import build_kernel
from mc_engine.lanes.kernel_cache import ENDED_WITH_ERROR
from mc_engine.model.record import Model

# ---- the driver

_NEEDED = f'the backend "cuda" needs an NVIDIA card of compute capability {OLDEST / 10:.1f} or later and its driver'


@dataclass(frozen=True)
class CardFacts:
    """A card.  number : the driver's.  capability : the latest one, 80 for 8.0, whose code it runs."""

    number: int
    name: str
    capability: int


@lru_cache(maxsize=1)
def cards() -> tuple[CardFacts, ...]:
    """The cards of this machine that can fly cases.

    Raises EngineError, one sentence, where there is none or where the package is missing.
    """
    if importlib.util.find_spec("cuda") is None or importlib.util.find_spec("cuda.bindings") is None:
        raise EngineError(f'the backend "cuda" needs the package cuda-bindings; {how_to_install("cuda")}')
    try:
        call("cuInit", 0)
        found = [_facts(number) for number in range(call("cuDeviceGetCount"))]
    except (EngineError, RuntimeError, ImportError) as error:  # RuntimeError: cuda-bindings finds no driver
        raise EngineError(f"{_NEEDED}; none was found here") from error
    able = tuple(card for card in found if card.capability)
    if not able:
        names = ", ".join(card.name for card in found) or "none"
        raise EngineError(f"{_NEEDED}; found here: {names}")
    return able


def _facts(number: int) -> CardFacts:
    from cuda.bindings import driver

    device = call("cuDeviceGet", number)
    kinds = driver.CUdevice_attribute
    major = call("cuDeviceGetAttribute", kinds.CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR, device)
    minor = call("cuDeviceGetAttribute", kinds.CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR, device)
    known = [capability for capability in CAPABILITIES if capability <= 10 * major + minor]
    name = call("cuDeviceGetName", 128, device).split(b"\0")[0].decode(errors="replace")
    return CardFacts(number, name, max(known, default=0))


def call(name: str, *arguments: Any) -> Any:
    """Call a function of the driver; what it returns beside its result code: nothing, a value or a tuple.

    Raises EngineError with the driver's own words where the code is an error.
    """
    from cuda.bindings import driver

    function: Callable[..., Any] = getattr(driver, name)
    code, *values = function(*arguments)
    if int(code) != 0:
        words = driver.cuGetErrorString(code)[1] or b"unknown error"
        raise EngineError(f"the CUDA driver: {name}: {words.decode(errors='replace')}")
    return values[0] if len(values) == 1 else tuple(values) or None


# ---- a card

_THREADS = 64  # of a block; 32 and 128 were as fast on an H200
_MOST_OF_FREE = 0.25  # of the card's free memory for one flight: as much is there for those beside it
_ALIGNED = 256  # bytes, where an array begins
_NO_STREAM_ZERO = 1  # CU_STREAM_NON_BLOCKING: it waits for no other


@dataclass
class _Lane:
    """A stream with its blocks of memory.  size : of each [bytes]."""

    stream: Any
    size: int = 0
    on_card: int = 0
    pinned: int = 0


class Card:
    """A card with its context.  Used by several threads at once.  flights : that are on it at this moment."""

    def __init__(self, facts: CardFacts):
        self.facts, self.flights = facts, 0
        self._context = call("cuDevicePrimaryCtxRetain", call("cuDeviceGet", facts.number))
        self._lock = threading.Lock()
        self._lanes: list[_Lane] = []
        self._entries: dict[str, Any] = {}

    def fly(self, code: str, arguments: Sequence[Any]) -> None:
        """Fly all cases of a kernel's call, and fill its arrays of results.

        code : of `thread_code`.  arguments : of the kernel, for one case at a time.
        Raises EngineError where the driver refuses, for example for want of memory.
        """
        call("cuCtxSetCurrent", self._context)
        entry = self._entry(code)
        n_cases, size = arguments[PER_CASE[1]].size, self._cases_at_once(arguments)
        with self._lane() as lane:
            for first in range(0, n_cases, size):
                self._fly_piece(entry, lane, arguments, slice(first, min(first + size, n_cases)))

    def _entry(self, code: str) -> Any:
        """The driver's handle on the code, which is compiled and loaded once."""
        with self._lock:
            if code not in self._entries:
                module = call("cuModuleLoadData", ptx_of(code, self.facts.capability).encode() + b"\0")
                self._entries[code] = call("cuModuleGetFunction", module, ENTRY.encode())
            return self._entries[code]

    def _cases_at_once(self, arguments: Sequence[Any]) -> int:
        """How many cases find room on the card."""
        free, _ = call("cuMemGetInfo")
        per_case = sum(arguments[index][..., :1].nbytes for index in PER_CASE)
        shared = sum(argument.nbytes + _ALIGNED for argument in arguments if isinstance(argument, np.ndarray))
        shared -= per_case * arguments[PER_CASE[1]].size
        return max(_THREADS, int((_MOST_OF_FREE * free - shared) // per_case // _THREADS * _THREADS))

    def _fly_piece(self, entry: Any, lane: _Lane, arguments: Sequence[Any], cases: slice) -> None:
        n = len(arguments)
        own, results = {index % n for index in PER_CASE}, {index % n for index in PER_CASE[2:]}
        piece = [argument[..., cases] if i in own else argument for i, argument in enumerate(arguments)]
        arrays = [i for i, argument in enumerate(piece) if isinstance(argument, np.ndarray)]
        order = [i for i in arrays if i not in results] + [i for i in arrays if i in results]
        places, end = {}, 0
        for i in order:
            places[i], end = end, end + -(-piece[i].nbytes // _ALIGNED) * _ALIGNED
        given = min(places[i] for i in results)
        _make_room(lane, end)
        for i in order:
            if i not in results:
                _at(lane.pinned + places[i], piece[i])[...] = piece[i]
        words = words_of(piece, [lane.on_card + places[i] for i in arrays], cases.stop - cases.start)
        pointers = np.array([words.ctypes.data], dtype=np.uint64)  # of the entry's one parameter
        blocks = -(-(cases.stop - cases.start) // _THREADS)
        call("cuMemcpyHtoDAsync", lane.on_card, lane.pinned, given, lane.stream)
        call("cuLaunchKernel", entry, blocks, 1, 1, _THREADS, 1, 1, 0, lane.stream, pointers.ctypes.data, 0)
        call("cuMemcpyDtoHAsync", lane.pinned + given, lane.on_card + given, end - given, lane.stream)
        call("cuStreamSynchronize", lane.stream)
        for i in results:
            arguments[i][..., cases] = _at(lane.pinned + places[i], piece[i])

    @contextmanager
    def _lane(self) -> Iterator[_Lane]:
        """A stream that no other flight uses."""
        with self._lock:
            lane = self._lanes.pop() if self._lanes else None
        lane = lane or _Lane(call("cuStreamCreate", _NO_STREAM_ZERO))
        yield lane  # after an error the driver may be unable to use it again, so it is left
        with self._lock:
            self._lanes.append(lane)


def _make_room(lane: _Lane, size: int) -> None:
    """Blocks of at least this size [bytes]."""
    if lane.size >= size:
        return
    if lane.size:
        call("cuMemFree", lane.on_card)
        call("cuMemFreeHost", lane.pinned)
        lane.size = 0
    lane.on_card = int(call("cuMemAlloc", size))
    lane.pinned = int(call("cuMemAllocHost", size))
    lane.size = size


def _at(address: int, like: np.ndarray) -> np.ndarray:
    """Memory of this process as an array."""
    numbers = memoryview((ctypes.c_char * like.nbytes).from_address(address))
    return np.ndarray(like.shape, like.dtype, numbers)


# ---- flights


def _card_kernel(model: Model, folder: Path | None, width: int) -> Callable[..., None]:
    """What is called in place of the model's kernel, with its arguments; it fills the same arrays."""
    return partial(_fly_on_card, build_kernel(model, folder, width))


class CardFlyer(CompiledFlyer):
    """A compiled model, one case per thread of a card.  Time histories are flown on the processor.

    A card flies thousands of cases in the time of one, so chunks are as large as possible.  Larger chunks also need
    less time per case in the interpreter, for which the worker threads wait in turn.
    """

    chunks_per_worker, largest_chunk = 1, 131_072
    _width = 1
    _build = staticmethod(_card_kernel)


def _fly_on_card(kernel: Any, *arguments: Any) -> None:
    with _COMPILING:
        code = _code_of(kernel, arguments)
    with least_busy() as card:
        card.fly(code, arguments)
    if (arguments[STATUS] == FAILED).any():
        raise ModelError(ENDED_WITH_ERROR)


_COMPILING, _CHOOSING = threading.Lock(), threading.Lock()
_CODES: dict[Any, str] = {}


def _code_of(kernel: Any, arguments: tuple[Any, ...]) -> str:
    """The code of a kernel's threads, made once; its arguments are of the same types in every call."""
    if kernel not in _CODES:
        _CODES[kernel] = thread_code(kernel, arguments)
    return _CODES[kernel]


@lru_cache(maxsize=1)
def opened() -> tuple[Card, ...]:
    """The cards of this machine, with their contexts."""
    return tuple(Card(facts) for facts in cards())


@contextmanager
def least_busy() -> Iterator[Card]:
    """The card with the fewest flights."""
    with _CHOOSING:
        card = min(opened(), key=lambda card: card.flights)
        card.flights += 1
    try:
        yield card
    finally:
        with _CHOOSING:
            card.flights -= 1
