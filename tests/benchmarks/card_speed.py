"""NVIDIA cards beside the processor of the same machine: the bytes of both, and the times.  For the page on cards.

    python -m tests.benchmarks.card_speed kernels                            # a case by the kernels alone
    python -m tests.benchmarks.card_speed tables CASES SECONDS [CAMPAIGN]...  # case tables, byte by byte
    python -m tests.benchmarks.card_speed runs CASES BACKEND                 # low orbits of one day, to Parquet

A kernel's time on a card has the copies to it and back.  Tables are flown by all cores and not stored: fewer cases of a
campaign than asked for where all cores would take longer than so many seconds.
"""

import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.campaign.cases import case_table, is_endless
from mc_engine.campaign.loading import Campaign, load_campaign
from mc_engine.flight import flight
from mc_engine.flight.card_code import thread_code
from mc_engine.flight.chunks import LARGEST_CHUNK, fly_in_threads
from mc_engine.flight.flyer import Columns, Flyer
from mc_engine.flight.flyers import flyer_of
from mc_engine.flight.kernel import usual_width
from mc_engine.interruption import in_threads
from mc_engine.model import AdaptiveStep
from mc_engine.runner import runner
from mc_engine.runner.backends import shortest
from mc_engine.runner.cards import Card, CardFlyer, opened
from mc_engine.studies.lane_speed import Flight, campaign_flight
from tests.benchmarks.card_code import USUAL
from tests.benchmarks.peer_codes.engine import load
from tests.benchmarks.peer_codes.problems import BY_KEY
from tests.mc_engine.flight.cards.shipped_kernels import NAMES, shipped

PROBLEMS = (
    ("orbit", "RK4", 10.0),
    ("orbit", "DOP853", 5.62e-11),  # to a millimetre, as the next
    ("orbit", "GJ9", 75.0),
    ("ballistic", "DOP853", 1e-10),
    ("lifting", "DOP853", 1e-10),
)
ON_CARD, FIRST_TRIAL = 131_072, 1024  # cases
TURNS = 3
LONG = 0.5  # s, of a flight on the processor
DAY = Path(__file__).with_name("leo") / "day.toml"


def in_processes(function: Callable[[Any], object], items: Iterable[Any]) -> None:
    with get_context("spawn").Pool(os.cpu_count(), maxtasksperchild=1) as pool:
        pool.map(function, items, chunksize=1)


# ---- kernels


def flights(n_cases: int) -> Iterator[Flight]:
    """The main campaigns, and what the peers are measured on, with their usual steps and tolerances."""
    for name in USUAL:
        yield campaign_flight(shipped(name), n_cases)
    for key, method, value in PROBLEMS:
        problem = BY_KEY[key]()
        model = load(problem, method)
        adaptive = isinstance(model.clock, AdaptiveStep)
        inputs = {item.name: item.default for item in (*model.parameters, *model.settings)} | problem.inputs
        inputs["tolerance" if adaptive else "step_s"] = value
        many = {name: np.resize(given, n_cases) if np.ndim(given) else given for name, given in inputs.items()}
        yield Flight(f"{problem.title}, {method}", model, None, many, n_cases)


def on_two_threads(cases: Flight) -> float:
    """Time of a case [s] where two threads fly half of the cases each."""
    ids, width = np.arange(cases.n_cases), usual_width(cases.model)
    halves = []
    for half in (ids[: ids.size // 2], ids[ids.size // 2 :]):
        inputs = {name: given[half] if np.ndim(given) else given for name, given in cases.inputs.items()}
        halves.append(flight.bound_flight(cases.model, inputs, half, cases.seed, folder=cases.folder, width=width)[0])
    return shortest(lambda: in_threads(lambda fly: fly(), halves, 2), TURNS) / cases.n_cases


def on_card(cases: Flight, card: Card) -> float:
    """Time of a case [s]."""
    ids = np.arange(cases.n_cases)
    call = flight.bound_flight(cases.model, cases.inputs, ids, cases.seed, folder=cases.folder, width=1)[0]
    code = thread_code(call.func, call.args)
    return shortest(lambda: card.fly(code, call.args), TURNS) / cases.n_cases


def part_of(cases: Flight, n_cases: int) -> Flight:
    inputs = {name: given[:n_cases] if np.ndim(given) else given for name, given in cases.inputs.items()}
    return replace(cases, inputs=inputs, n_cases=n_cases)


def first_flight(place: int) -> None:
    """Compile for the processor and for the card, and keep that: in a process of its own, beside others."""
    cases = [*flights(64)][place]
    on_two_threads(cases), on_card(cases, opened()[0])


def kernels() -> None:
    in_processes(first_flight, range(len(USUAL) + len(PROBLEMS)))
    card = opened()[0]
    print(f"{card.facts.name}, {ON_CARD:,} cases, beside two threads of this machine's processor")
    print("| flight | card [µs a case] | two threads [µs a case] | ratio |\n|---|---|---|---|")
    for cases in flights(ON_CARD):
        n = FIRST_TRIAL
        processor = on_two_threads(part_of(cases, n))
        if (n := min(int(LONG / processor) // 64 * 64, cases.n_cases)) > FIRST_TRIAL:
            processor = on_two_threads(part_of(cases, n))
        seconds = on_card(cases, card)
        print(
            f"| {cases.title} | {1e6 * seconds:.4g} | {1e6 * processor:.4g} | {processor / seconds:.0f} |", flush=True
        )


# ---- tables


def make_ready(name: str) -> None:
    """Compile for the processor and for the cards."""
    campaign = shipped(name)
    for flyer in (flyer_of(campaign), CardFlyer(campaign)):
        flyer.make_ready()


def tables(wanted: int, seconds: float, names: list[str]) -> None:
    """Whether all results of each campaign have the same bytes, and the cases per second of all cores and of a card."""
    campaigns = {name: campaign for name in names if (campaign := shipped(name)).first is None}
    in_processes(make_ready, {campaign.model.name: name for name, campaign in campaigns.items()}.values())
    print("| campaign | cases | results | differ | all cores [cases/s] | card [cases/s] |\n|---|---|---|---|---|---|")
    for name, campaign in campaigns.items():
        most = wanted if is_endless(campaign) else min(wanted, campaign.cases)
        processor, card = flyer_of(campaign), CardFlyer(campaign)
        columns = [*processor.fly(campaign.nominal, np.zeros(1, dtype=np.int64))]
        trial, _ = flown(campaign, processor, min(FIRST_TRIAL, most), columns)
        n = min(most, max(FIRST_TRIAL, int(seconds * trial)))
        (rate, ours), (card_rate, theirs) = (flown(campaign, flyer, n, columns) for flyer in (processor, card))
        differ = ", ".join(key for key in columns if not same_bytes(ours[key], theirs[key])) or "none"
        print(f"| {name} | {n:,} | {len(columns)} | {differ} | {rate:,.0f} | {card_rate:,.0f} |", flush=True)


def flown(campaign: Campaign, flyer: Flyer, n_cases: int, columns: list[str]) -> tuple[float, Columns]:
    """(cases per second, results) of all cores, or of as many threads that hand cases to a card."""
    ids = np.arange(n_cases)
    table = case_table(campaign, ids)
    begin = time.perf_counter()
    results = fly_in_threads(campaign, table, ids, columns, os.cpu_count() or 1, flyer)
    return n_cases / (time.perf_counter() - begin), results


def same_bytes(one: np.ndarray, other: np.ndarray) -> bool:
    """Words are compared as words."""
    return bool((one == other).all()) if one.dtype == object else one.tobytes() == other.tobytes()


# ---- whole runs


def runs(n_cases: int, backend: str) -> None:
    """Wall time of a run to Parquet, and of one file as large on the same disk."""
    with tempfile.TemporaryDirectory(dir=".") as folder:
        runner.run(load_campaign(DAY, cases=LARGEST_CHUNK), Path(folder) / "ready", backend=backend)
        begin = time.perf_counter()
        store = runner.run(load_campaign(DAY, cases=n_cases), Path(folder) / "run", backend=backend)
        seconds = time.perf_counter() - begin
        size = sum(part.bytes for part in store.parts)
        disk = seconds_to_write(Path(folder) / "file", size)
    print(
        f"{backend}: {n_cases:,} cases in {seconds:.1f} s, {n_cases / seconds:,.0f} cases/s, "
        f"{size / 2**20:,.0f} MiB in {len(store.parts)} parts; one file as large takes {disk:.1f} s"
    )


def seconds_to_write(path: Path, size: int) -> float:
    piece = np.random.default_rng(0).bytes(2**26)
    begin = time.perf_counter()
    with open(path, "wb") as file:
        for _ in range(-(-size // len(piece))):
            file.write(piece)
        os.fsync(file.fileno())
    return time.perf_counter() - begin


def main(what: str = "", *words: str) -> None:
    if what == "kernels":
        kernels()
    elif what == "tables":
        tables(int(float(words[0])), float(words[1]), list(words[2:]) or list(NAMES))
    elif what == "runs":
        runs(int(float(words[0])), words[1])
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main(*sys.argv[1:])
