"""The choice of a backend, with its limits.  `mc_engine.runner.pools` makes the worker pool for it."""

import importlib.util
import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from hashlib import sha256
from math import inf
from numbers import Real
from pathlib import Path

import numpy as np

from mc_engine.cache_folder import cache_folder
from mc_engine.campaign.cases import case_table, is_endless
from mc_engine.campaign.loading import Campaign
from mc_engine.durable_file import disk_errors
from mc_engine.errors import EngineError
from mc_engine.extras import how_to_install
from mc_engine.flight.chunks import LARGEST_CHUNK, fly_in_threads
from mc_engine.flight.flyer import Flyer
from mc_engine.flight.flyers import flyer_of
from mc_engine.model.simulator import Simulator
from mc_engine.shell_words import shell_word

BACKENDS = ("threading", "loky", "dask", "cuda", "auto")


@dataclass(frozen=True)
class Backend:
    """The kind of workers that fly the cases, and their limits.

    name : "threading", "loky", "dask", "cuda" (NVIDIA cards) or "auto", which takes a card where
    `bench` found it faster.  scheduler : address of a `distributed` scheduler; without one, "dask"
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
        for limit in ("case_seconds", "memory_mib", "patience_s"):
            value = getattr(self, limit)
            if value is not None and not _is_limit(value):
                raise EngineError(f"{limit}: {value!r} is not allowed; it must be a finite number above 0")
        limited = self.case_seconds is not None or self.memory_mib is not None
        if limited and (flown_by := {"threading": "a thread", "cuda": "a card", "auto": "a card"}.get(self.name)):
            raise EngineError(f'{flown_by} cannot be limited in time or memory; fly with the backend "loky"')
        if self.scheduler is not None and self.memory_mib is not None:
            raise EngineError("the workers of a scheduler have limits of their own: `dask worker --memory-limit`")
        if self.patience_s is not None and self.name != "dask":
            raise EngineError(f'patience is for the backend "dask", whose workers come and go, not for "{self.name}"')
        if self.memory_mib is not None and not memory_can_be_limited():
            raise EngineError("this system keeps no limit on memory; install psutil, with which the workers look")
        if self.name == "cuda":
            from mc_engine.runner.cards import cards

            cards()
        if self.name == "dask" and importlib.util.find_spec("distributed") is None:
            raise EngineError(f'the backend "dask" needs the package distributed; {how_to_install("cluster")}')
        if self.scheduler is not None:
            _refuse_no_address(self.scheduler)

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


def _refuse_no_address(scheduler: str) -> None:
    from distributed.comm import resolve_address
    from distributed.security import Security

    try:
        resolve_address(scheduler)
    except Exception as error:  # of a host that is not known, or a protocol that is not installed
        why = " ".join(str(error).split())
        raise EngineError(f"--scheduler {scheduler}: {why}; write an address such as tcp://node1:8786") from None
    try:
        keys = Security().get_connection_args("client")["ssl_context"]
    except OSError as error:  # of a file that is no key, or not there
        raise EngineError(f"--scheduler {scheduler}: the keys of Dask's configuration: {error}") from None
    if scheduler.startswith(("tls://", "wss://")) and keys is None:
        named = "distributed.comm.tls, with ca-file, client.cert and client.key"
        raise EngineError(f"--scheduler {scheduler}: needs keys; name them in Dask's configuration, {named}")


def flyer_on(backend: str, campaign: Campaign) -> Flyer:
    """The `Flyer` of a campaign on a backend: on the processor, or for "cuda" on a card.

    "auto" uses a card only for a model that `bench --card` found to be faster on the cards of this machine.
    Raises EngineError, one sentence, if a card is requested and cannot fly the cases.
    """
    compiled = not isinstance(campaign.model, Simulator)
    if backend == "cuda" and not compiled:
        raise EngineError('a simulator flies on the processor; leave "--backend cuda" away')
    if backend == "cuda" or (backend == "auto" and compiled and _is_faster_on_a_card(campaign)):
        from mc_engine.runner.cards import CardFlyer

        return CardFlyer(campaign)
    return flyer_of(campaign)


def _is_limit(value: object) -> bool:
    """Whether it is a number above 0 that a float can hold."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and 0.0 < float(value) < inf
    except OverflowError:
        return False


def memory_can_be_limited() -> bool:
    """True if the system can limit the memory of a process, or psutil is installed to watch it."""
    return sys.platform.startswith("linux") or importlib.util.find_spec("psutil") is not None


# ---- whether a card is faster than the processor

_FIRST_TRIAL, _LONG_ENOUGH = 1024, 0.25  # cases; s: to begin threads takes some milliseconds


def measure_card(campaign: Campaign, n_cases: int | None = None) -> tuple[float, float]:
    """Cases per second on all cores of the processor and on a card; the backend "auto" uses the result from then on.

    n_cases : of a flight; by default enough for all cores to fly for a while, or all cases of a design with fewer.
    The fastest of three flights counts.  Raises EngineError, one sentence, if there is no card.
    """
    from mc_engine.runner.cards import CardFlyer

    file, workers = _measurement_of(campaign), os.cpu_count() or 1
    most = n_cases or LARGEST_CHUNK * workers
    most = most if is_endless(campaign) else min(most, campaign.cases)

    def seconds(flyer: Flyer, cases: int, repeats: int) -> float:
        ids = np.arange(cases, dtype=np.int64)
        table = case_table(campaign, ids)
        return shortest(lambda: fly_in_threads(campaign, table, ids, ["status"], workers, flyer), repeats)

    on_processor, on_card = flyer_of(campaign), CardFlyer(campaign)
    cases = most if n_cases else min(_FIRST_TRIAL, most)
    while cases < most and seconds(on_processor, cases, 1) < _LONG_ENOUGH:
        cases = min(2 * cases, most)
    processor, card = (cases / seconds(flyer, cases, 3) for flyer in (on_processor, on_card))
    with disk_errors(file):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps({"processor_cases_s": processor, "card_cases_s": card}), encoding="utf-8")
    return processor, card


def _is_faster_on_a_card(campaign: Campaign) -> bool:
    """True where the cards were measured to be faster for this model; False where nothing was measured."""
    try:
        kept = json.loads(_measurement_of(campaign).read_text(encoding="utf-8"))
        return float(kept["card_cases_s"]) > float(kept["processor_cases_s"])
    except (EngineError, OSError, ValueError, KeyError, TypeError):
        return False  # no card, no measurement or one that was damaged


def shortest(flight: Callable[[], object], repeats: int) -> float:
    """Time of the fastest flight [s], after one that compiles."""
    flight()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        flight()
        times.append(time.perf_counter() - begin)
    return min(times)


def _measurement_of(campaign: Campaign) -> Path:
    """The file of the measurement for a model with its sources on the cards and cores of this machine."""
    from mc_engine.runner.cards import cards

    about = [flyer_of(campaign).digest(), str(os.cpu_count()), *(card.name for card in cards())]
    return cache_folder() / "cards" / f"{sha256(' '.join(about).encode()).hexdigest()[:20]}.json"
