"""Bounds of the missing parts: aligned with the other parts of the run, or those of a lost part.

A run that was interrupted, repaired, merged or extended therefore has the same part files as one that was not.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from mc_engine.flight.chunks import chunks_of
from mc_engine.store.journal import Entry
from mc_engine.store.parts import cases_in_name
from mc_engine.store.receipts import Range


@dataclass(frozen=True)
class Stretch:
    """Cases from the end of the stretch before up to `stop`, in parts of `chunk` cases; None if not begun yet."""

    stop: int
    chunk: int | None


def stretches(entries: Iterable[Entry], stop: int, end: int) -> list[Stretch]:
    """The stretch with which a run began, up to the case `stop`, and one for each extension, by its journal.

    end : one past the last case; the last stretch ends there, also if the line of the last extension is lost.
    """
    along = [Stretch(stop, None)]
    for entry in entries:
        if entry.event == "extended":
            along.append(Stretch(entry.facts["cases"], None))
        elif entry.event in ("started", "merged") and along[-1].chunk is None:
            along[-1] = Stretch(along[-1].stop, entry.facts.get("chunk"))
    return [*along[:-1], Stretch(end, along[-1].chunk)]


def part_bounds(missing: Sequence[Range], entries: Sequence[Entry], along: Sequence[Stretch], size: int) -> list[Range]:
    """The missing ranges, divided into those of parts, in order.  size : cases of a part where `along` has no chunk."""
    bounds: list[Range] = []
    for gap in missing:
        known = _withdrawn(entries, gap)
        edges = [gap[0], *(edge for bound in known for edge in bound), gap[1]]
        bounds += known
        for first, stop in zip(edges[::2], edges[1::2], strict=True):
            bounds += _cut(first, stop, along, size)
    return sorted(bounds)


def _withdrawn(entries: Sequence[Entry], gap: Range) -> list[Range]:
    """Bounds of withdrawn parts within a gap, in order; of two that overlap, those of the later one."""
    bounds: list[Range] = []
    for entry in reversed(entries):
        bound = cases_in_name(entry.facts["file"]) if entry.event == "part-withdrawn" else None
        if bound is None or bound[0] < gap[0] or gap[1] < bound[1]:
            continue
        if all(bound[1] <= other[0] or other[1] <= bound[0] for other in bounds):
            bounds.append(bound)
    return sorted(bounds)


def _cut(first: int, stop: int, along: Sequence[Stretch], size: int) -> Iterator[Range]:
    for stretch in along:
        if first < min(stop, stretch.stop):
            yield from chunks_of([(first, min(stop, stretch.stop))], stretch.chunk or size)
            first = stretch.stop
