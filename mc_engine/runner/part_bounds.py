"""Bounds of the parts that are yet to be flown: those that the run's other parts have, or that a lost part had.

So a run that was cut, repaired, merged or extended has the part files of one that was not.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from mc_engine.flight.chunks import chunks_of
from mc_engine.store.journal import Entry
from mc_engine.store.parts import cases_in_name
from mc_engine.store.receipts import Range


@dataclass(frozen=True)
class Stretch:
    """Cases up to `stop`, from the stretch before, with parts of `chunk` cases; None where no session has begun it."""

    stop: int
    chunk: int | None


def stretches(entries: Iterable[Entry], stop: int, end: int) -> list[Stretch]:
    """What a run began with, up to the case `stop`, and each extension up to `end`, as its journal tells."""
    found = [Stretch(stop, None)]
    for entry in entries:
        if entry.event == "extended":
            found.append(Stretch(entry.facts["cases"], None))
        elif entry.event in ("started", "merged") and found[-1].chunk is None:
            found[-1] = Stretch(found[-1].stop, entry.facts.get("chunk"))
    return [*found[:-1], Stretch(end, found[-1].chunk)]  # where the line of the last extension is lost, it ends before


def part_bounds(missing: Sequence[Range], entries: Sequence[Entry], along: Sequence[Stretch], size: int) -> list[Range]:
    """The missing ranges cut into those of parts, in order.  size : cases of a part where `along` says nothing."""
    bounds: list[Range] = []
    for gap in missing:
        known = _withdrawn(entries, gap)
        edges = [gap[0], *(edge for bound in known for edge in bound), gap[1]]
        bounds += known
        for first, stop in zip(edges[::2], edges[1::2], strict=True):
            bounds += _cut(first, stop, along, size)
    return sorted(bounds)


def _withdrawn(entries: Sequence[Entry], gap: Range) -> list[Range]:
    """Bounds of the parts in a gap that counted once, in order; of two that overlap, the later one's."""
    found: list[Range] = []
    for entry in reversed(entries):
        bound = cases_in_name(entry.facts["file"]) if entry.event == "part-withdrawn" else None
        if bound is None or bound[0] < gap[0] or gap[1] < bound[1]:
            continue
        if all(bound[1] <= other[0] or other[1] <= bound[0] for other in found):
            found.append(bound)
    return sorted(found)


def _cut(first: int, stop: int, along: Sequence[Stretch], size: int) -> Iterator[Range]:
    for stretch in along:
        if first < min(stop, stretch.stop):
            yield from chunks_of([(first, min(stop, stretch.stop))], stretch.chunk or size)
            first = stretch.stop
