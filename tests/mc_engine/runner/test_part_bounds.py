"""Missing cases are divided into the parts that an unbroken run has, or that a lost part had."""

import pytest

from mc_engine.flight.chunks import LARGEST_CHUNK, chunk_size
from mc_engine.runner.part_bounds import Stretch, part_bounds, stretches
from mc_engine.store.journal import Entry


def entries(*events):
    return [Entry(number, "", event, facts) for number, (event, facts) in enumerate(events, start=1)]


def withdrawn(first, last):
    return "part-withdrawn", {"file": f"cases/part-{first:010d}-{last:010d}.parquet"}


BEGUN, EXTENDED, AGAIN = ("started", {"chunk": 10}), ("extended", {"cases": 50}), ("started", {"chunk": 7})


def test_each_stretch_has_the_chunk_that_it_was_begun_with_and_a_gap_over_two_is_cut_by_both():
    lines = entries(BEGUN, ("started", {"chunk": 4}), EXTENDED, AGAIN)
    along = stretches(lines, 25, 50)
    assert along == [Stretch(25, 10), Stretch(50, 7)]
    assert part_bounds([(5, 50)], lines, along, 3) == [(5, 15), (15, 25), (25, 32), (32, 39), (39, 46), (46, 50)]
    assert part_bounds([(20, 30)], lines, stretches(entries(BEGUN, EXTENDED), 25, 50), 3) == [
        (20, 25),
        (25, 28),
        (28, 30),
    ]
    assert stretches(entries(BEGUN, AGAIN), 25, 50) == [Stretch(50, 10)]  # the line of the extension is lost


def test_a_withdrawn_part_is_flown_within_its_bounds_and_of_two_that_overlap_the_later_one():
    lines = entries(BEGUN, withdrawn(10, 19), withdrawn(12, 17), withdrawn(28, 33))
    along = stretches(lines, 30, 30)
    assert part_bounds([(0, 30)], lines, along, 3) == [(0, 10), (10, 12), (12, 18), (18, 28), (28, 30)]


@pytest.mark.parametrize("workers", [1, 2, 3, 16])
@pytest.mark.parametrize("cases", [64, 10_000, 600_000, 1_000_000, 10**8])
def test_every_worker_has_as_many_parts(cases, workers):
    """No worker waits in the end for another one that flies one part more, as long as parts are not tiny."""
    size = chunk_size(cases, workers)
    assert size <= LARGEST_CHUNK
    parts = -(-cases // size)
    assert parts % workers == 0 or size < 100  # else rounding up may cost a part
    assert parts >= min(8 * workers - 1, cases // 64)
