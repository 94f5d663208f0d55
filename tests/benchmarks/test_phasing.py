"""A short form of the ten-day phasings: they end where they should, and cost a small part of a case by SciPy."""

import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks.phasing import flown

sys.path.append(str(Path(__file__).parents[1] / "campaigns" / "geo_servicing"))

CASES, DAY = 512, 86_400.0
# A thousand cases of 1.6 ms are what two cores may take for 10 000 in eight seconds; SciPy's take some seconds each.
LEAST_RATIO = 500.0


@pytest.mark.benchmark
def test_a_phasing_costs_a_small_part_of_one_by_scipy():
    from servicing_flights import first_states
    from servicing_twin import Twin

    row, spent, _ = flown(CASES)
    assert (row["status"] == "ok").all()
    begin = time.thread_time()
    Twin(58484.5).fly(0.0, first_states()[0], DAY, rtol=1e-11)
    ratio = 10.0 * (time.thread_time() - begin) / (spent / CASES)
    print(f"10 000 ten-day phasings: {1e4 * spent / CASES:.1f} s of processor time; SciPy {ratio:.0f} times as long")
    assert ratio > LEAST_RATIO
    assert np.abs(row["daily_mean_longitude_deviation_deg"]).max() < 0.05
