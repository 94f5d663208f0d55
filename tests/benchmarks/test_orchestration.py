"""A short form of the cost of a case beside its flight."""

import pytest

from tests.benchmarks.orchestration import microseconds_per_case


@pytest.mark.benchmark
def test_a_case_costs_microseconds_beside_its_flight():
    cost = microseconds_per_case("minimal", cases=20_000)
    print(f"{cost:.1f} µs per case beside the flight")
    assert 0.0 < cost < 50.0  # some 1 µs on a quiet core, and a few more for the files of a short run
