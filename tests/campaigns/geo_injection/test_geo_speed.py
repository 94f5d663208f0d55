"""What flights and designs cost in processor time, so that other work on the machine does not count."""

from time import process_time

import numpy as np
import pytest
from geo_flights import fly_cases
from geo_twin import fly_twin

from campaigns.geo_injection.design import programs as design
from campaigns.geo_injection.design.kept_programs import SEQUENCES

MICROSECONDS_A_FLIGHT = 2 * 5.0 / 100_000 * 1e6  # 100 000 flights in 5 s on two cores
SECONDS_A_DESIGN = 30.0
N_CASES = 4000


def dispersed(n):
    random = np.random.default_rng(9)
    factors = {"thrust_factor": 0.005, "isp_factor": 0.003, "initial_mass_factor": 0.002}
    inputs = {name: 1.0 + sigma * random.standard_normal(n) for name, sigma in factors.items()}
    inputs |= {f"ignition_delay_{k}_s": random.standard_normal(n) for k in (1, 2)}
    return inputs | {f"{name}_error_deg": 0.2 * random.standard_normal(n) for name in ("pitch", "yaw")}


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
