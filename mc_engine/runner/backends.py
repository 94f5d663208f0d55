"""The choice of a backend, with its limits.  `mc_engine.runner.pools` makes the worker pool for it."""

import importlib.util
import sys
from dataclasses import dataclass

from mc_engine.errors import EngineError
from mc_engine.extras import how_to_install
from mc_engine.shell_words import shell_word

BACKENDS = ("threading", "loky", "dask")


@dataclass(frozen=True)
class Backend:
    """The kind of workers that fly the cases, and their limits.

    name : "threading", "loky" or "dask".  scheduler : address of a `distributed` scheduler; without one, "dask"
    starts a cluster on this machine for the run.
    case_seconds : a case that takes longer ends with the status time-limit.  memory_mib : memory limit of a worker.
    patience_s : longest time without workers, for example while jobs wait in a queue; by default 300.
    """

    name: str = "threading"
    scheduler: str | None = None
    case_seconds: float | None = None
    memory_mib: int | None = None
    patience_s: float | None = None

    def __post_init__(self) -> None:
        if self.name not in BACKENDS:
            raise EngineError(f'backend "{self.name}" is not known; there are {", ".join(BACKENDS)}')
        if self.scheduler is not None and self.name != "dask":
            raise EngineError(f'a scheduler is for the backend "dask", not for "{self.name}"')
        if self.name == "threading" and (self.case_seconds is not None or self.memory_mib is not None):
            raise EngineError('a thread cannot be limited in time or memory; fly with the backend "loky"')
        if self.scheduler is not None and self.memory_mib is not None:
            raise EngineError("the workers of a scheduler have limits of their own: `dask worker --memory-limit`")
        if self.patience_s is not None and self.name != "dask":
            raise EngineError(f'patience is for the backend "dask", whose workers come and go, not for "{self.name}"')
        if self.memory_mib is not None and not memory_can_be_limited():
            raise EngineError("this system keeps no limit on memory; install psutil, with which the workers look")
        if self.name == "dask" and importlib.util.find_spec("distributed") is None:
            raise EngineError(f'the backend "dask" needs the package distributed; {how_to_install("cluster")}')

    def options(self) -> str:
        """The options of the command line that select this backend, each with a space before it."""
        name = None if self.name == "threading" else self.name
        seconds = None if self.case_seconds is None else f"{self.case_seconds:g}"
        patience = None if self.patience_s is None else f"{self.patience_s:g}"
        values = {
            "backend": name,
            "scheduler": self.scheduler,
            "case-seconds": seconds,
            "memory": self.memory_mib,
            "patience": patience,
        }
        return "".join(f" --{key} {shell_word(str(value))}" for key, value in values.items() if value is not None)


def memory_can_be_limited() -> bool:
    """True if the system can limit the memory of a process, or psutil is installed to watch it."""
    return sys.platform.startswith("linux") or importlib.util.find_spec("psutil") is not None
