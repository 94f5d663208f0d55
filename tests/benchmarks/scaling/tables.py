"""The tables of the page on scaling, as Markdown, and their place in it."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import fields, replace
from math import log10
from pathlib import Path

import mc_engine
from mc_engine.flight.chunks import LARGEST_CHUNK
from tests.benchmarks.scaling.cluster import Flown, Recovery
from tests.benchmarks.scaling.model import (
    Costs,
    as_shards,
    longest,
    merging,
    most_workers,
    on_one_scheduler,
    runs_of,
)
from tests.benchmarks.scaling.storage import Stored

PAGE = Path(mc_engine.__file__).parent / "documentation" / "explanation" / "scaling.md"
BEGIN, END = "<!-- scaling -->", "<!-- end -->"
CASES, NODES, LONGER = (1e9, 1e11), (10, 100, 1000), (1.0, 1000.0)
LARGER = 32  # times the largest part of the command line, for runs from Python


def table(*rows: Sequence[object]) -> str:
    """Rows of cells, the first of which is the head."""
    head, *body = ("| " + " | ".join(map(str, row)) + " |" for row in rows)
    return "\n".join([head, "|---" * len(rows[0]) + "|", *body])


def digits(number: float) -> str:
    """Three digits, with commas between thousands."""
    return f"{number:,.0f}" if abs(number) >= 100.0 else f"{number:.3g}"


def duration(seconds: float) -> str:
    """Two digits in the unit that a person would choose."""
    units = {"days": 86_400.0, "h": 3600.0, "min": 60.0, "s": 1.0}
    unit, length = next((one for one in units.items() if seconds >= 2.0 * one[1]), ("s", 1.0))
    return f"{digits(float(f'{seconds / length:.2g}'))} {unit}"


def throughput(flown: dict[int, Flown], chunk: int) -> str:
    """Whole flights: what each worker adds, and how many cases a second of its processor flies."""
    rows: list[Sequence[object]] = [
        ("workers", "cases a second", "times one worker", "cases a processor second of the workers", "times one worker")
    ]
    rates = {}
    for workers, run in flown.items():
        cases = run.clocks.committed * chunk
        rates[workers] = cases / run.clocks.wall, cases / run.clocks.workers
        first = rates[min(rates)]
        wall, processor = rates[workers]
        ratios = f"{wall / first[0]:.2f}", f"{processor / first[1]:.2f}"
        rows.append((workers, digits(wall), ratios[0], digits(processor), ratios[1]))
    return table(*rows)


def per_thousand_parts(flown: dict[int, Flown]) -> str:
    """Seconds for 1000 parts, of everybody who takes part."""
    rows: list[Sequence[object]] = [
        ("workers", "wall time", "all workers", "writer", "writer waits for the disk", "scheduler")
    ]
    for workers, run in flown.items():
        clocks, parts = run.clocks, run.clocks.committed
        times = (clocks.wall, clocks.workers, clocks.writer, parts * run.disk_wait_s, clocks.scheduler)
        rows.append((workers, *(digits(1e3 * time / parts) for time in times)))
    return table(*rows)


def recovered(results: Sequence[Recovery]) -> str:
    """What became of runs of which half of the workers were killed."""
    head = (
        "workers", "killed", "first part after the kill [s]", "cases flown again",
        "rows lost", "rows doubled", "parts equal to those of threads",
    )  # fmt: skip
    rows = (
        (one.workers, one.killed, digits(one.first_part_s), f"{one.again_cases:,}", one.lost, one.doubled,
         "all" if one.equal else "**not all**")
        for one in results
    )  # fmt: skip
    return table(head, *rows)


def stored_parts(results: dict[int, Stored]) -> str:
    """Steps of shards over the object store."""
    rows: list[Sequence[object]] = [
        ("cases of a part", "step", "requests for a part", "s for 1000 parts", "of it this process", "MB/s")
    ]
    for chunk, stored in results.items():
        for name, step in stored.steps.items():
            requests = digits(sum(step.requests.values()) / stored.parts)
            times = (digits(1e3 * time / stored.parts) for time in (step.wall, step.processor))
            rows.append((f"{chunk:,}", name, requests, *times, digits(1e-6 * stored.part_bytes / step.wall)))
    return table(*rows)


def cost_table(costs: Costs) -> str:
    """What the model computes from."""
    rows = ((entry.metadata, getattr(costs, entry.name)) for entry in fields(Costs))
    lines = ((about["what"], f"{value:g}", about["unit"], about["source"]) for about, value in rows)
    return table(("quantity", "value", "unit", "source"), *lines)


def costs_of(text: str) -> Costs:
    """The costs of a text with their table."""
    values = {}
    for entry in fields(Costs):
        about = entry.metadata
        found = re.search(rf"\| {re.escape(about['what'])} \| (\S+) \| {about['unit']} \|", text)
        if found is None:
            raise ValueError(f"no line on {about['what']}")
        values[entry.name] = float(found[1])
    return Costs(**values)


def extrapolated(costs: Costs) -> Iterator[str]:
    """The computed tables: times of campaigns on many nodes, and where they stop scaling."""
    for longer in LONGER:
        these = replace(costs, case_us=longer * costs.case_us)
        yield f"A case takes {_case_time(these)} of a core:"
        rows: list[Sequence[object]] = [
            ("cases", "nodes", "one scheduler", "busy all the time", "shards", "busy all the time", "fetch", "merge")
        ]
        for cases in CASES:
            for nodes in NODES:
                runs, each = runs_of(cases)
                one, limit = longest(these, on_one_scheduler(these, each, nodes))
                shards, shard_limit = longest(these, as_shards(these, each, nodes))
                after = merging(these, each, nodes).values()
                times = [duration(runs * seconds) for seconds in (one, shards, *after)]
                rows.append((_power(cases), nodes, times[0], limit, times[1], shard_limit, *times[2:]))
        yield table(*rows)
    yield "Workers, and nodes, from which on one scheduler or its writer is busy all the time:"
    rows = [("a case takes", "cases of a part", "workers", "nodes")]
    for longer in LONGER:
        these = replace(costs, case_us=longer * costs.case_us)
        for part_cases in (LARGEST_CHUNK, LARGER * LARGEST_CHUNK):
            workers = most_workers(these, part_cases)
            rows.append((_case_time(these), f"{part_cases:,}", f"{workers:,}", digits(workers / these.node_cores)))
    yield table(*rows)


def _case_time(costs: Costs) -> str:
    return f"{digits(costs.case_us)} µs" if costs.case_us < 1e3 else f"{digits(1e-3 * costs.case_us)} ms"


def _power(cases: float) -> str:
    return "10" + str(round(log10(cases))).translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))


def written_into(page: Path, text: str) -> None:
    """Replace what is between the marks of a page."""
    before, begin, rest = page.read_text(encoding="utf-8").partition(f"{BEGIN}\n")
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"{page}: the tables go between a line {BEGIN} and a line {END}")
    page.write_text(f"{before}{begin}\n{text}\n\n{end}{after}", encoding="utf-8")
