"""What flights and designs cost in processor time, so that other work on the machine does not count."""

from time import process_time

import pytest
from geo_sequences import dispersed, fly_cases
from geo_twin import fly_twin

from campaigns.geo_injection.design import program as design
from campaigns.geo_injection.design.kept_programs import SEQUENCES

MICROSECONDS_A_FLIGHT = 2 * 5.0 / 100_000 * 1e6  # 100 000 flights in 5 s on two cores
SECONDS_A_DESIGN = 30.0
N_CASES = 4000


def seconds(work):
    began = process_time()
    work()
    return process_time() - began


@pytest.mark.benchmark
def test_a_hundred_thousand_dispersed_flights_take_at_most_five_seconds_of_two_cores():
    inputs = dispersed(N_CASES)
    fly_cases(**dispersed(16))  # compiles
    ours = min(seconds(lambda: fly_cases(**inputs)) for _ in range(3)) / N_CASES
    program = design.program_for(SEQUENCES["two_burns_28_5"])
    twin = seconds(lambda: fly_twin(program, **{name: column[0] for name, column in inputs.items()}))
    print(f"injection, two burns: {1e6 * ours:.1f} us a case, {twin / ours:.0f} times the speed of SciPy")
    assert 1e6 * ours < MICROSECONDS_A_FLIGHT
    assert twin > 1000.0 * ours


@pytest.mark.benchmark
@pytest.mark.parametrize("name", sorted(SEQUENCES))
def test_every_shipped_sequence_is_designed_within_thirty_seconds(name):
    assert seconds(lambda: design.new_design(SEQUENCES[name])) < SECONDS_A_DESIGN
