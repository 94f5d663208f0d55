"""Time that a run spends in its kernels."""

import threading
import time
from collections.abc import Callable
from typing import Any

from mc_engine.flight import flight


class KernelClock:
    """Seconds that all threads together spend in kernels, compilation apart, within a `with` block.

    timer : clock that is read before and after each call; `time.thread_time` counts processor time
    """

    def __init__(self, timer: Callable[[], float] = time.perf_counter) -> None:
        self.spent, self._timer, self._lock, self._build = 0.0, timer, threading.Lock(), flight.build_kernel

    def __enter__(self) -> "KernelClock":
        flight.build_kernel = self._timed
        return self

    def __exit__(self, *_: object) -> None:
        flight.build_kernel = self._build

    def _timed(self, *arguments: Any) -> Callable[..., int]:
        kernel = self._build(*arguments)

        def timed(*inputs: Any) -> int:
            begin = self._timer()
            try:
                return kernel(*inputs)
            finally:
                with self._lock:
                    self.spent += self._timer() - begin

        return timed
