"""What `bench` times is the flight of `run`, and it says how fast in words that compare."""

import re

import numpy as np
import pytest
from typer.testing import CliRunner

from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.columns import END_TIME
from mc_engine.campaign.loading import load_campaign
from mc_engine.command_line.commands import app
from mc_engine.flight.flight import bound_flight, fly


@pytest.fixture(scope="module")
def minimal():
    return load_campaign("minimal")


@pytest.mark.parametrize("width", [1, 16])
def test_the_timed_kernel_flies_the_cases_of_a_run(minimal, width):
    ids = np.arange(21)
    inputs = full_inputs(minimal, case_table(minimal, ids))
    kernel, ends, _ = bound_flight(minimal.model, inputs, ids, minimal.seed, width=width, folder=minimal.directory)
    kernel()
    assert ends.size % width == 0
    wanted = fly(minimal.model, inputs, ids, minimal.seed, folder=minimal.directory)[END_TIME]
    np.testing.assert_array_equal(ends, np.resize(wanted, ends.size))


def test_bench_prints_cases_a_second_nanoseconds_a_step_and_the_ratio():
    done = CliRunner().invoke(app, ["bench", "minimal", "--repeats", "3"])
    assert done.exit_code == 0, done.output
    head, alone, eight, sixteen = done.output.splitlines()
    assert head == "minimal: 256 cases a flight, the fastest of 3, one thread"
    rates = [int(re.search(r"([\d,]+) cases/s", one)[1].replace(",", "")) for one in (alone, eight, sixteen)]
    steps = [float(re.search(r"([\d.]+) ns a step", one)[1]) for one in (alone, eight, sixteen)]
    factors = [float(re.search(r"([\d.]+) times", one)[1]) for one in (eight, sixteen)]
    assert factors == pytest.approx([rates[1] / rates[0], rates[2] / rates[0]], rel=1e-2)
    # the same flights: a case is as many steps in each build
    assert np.multiply(rates, steps) == pytest.approx(rates[0] * steps[0], rel=0.05)
    assert sixteen.endswith(" times as fast (as `run`)")
