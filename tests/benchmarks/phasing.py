"""Ten-day phasings to a geostationary place with all dispersions of the campaign: processor time in the kernel.

python -m tests.benchmarks.phasing [cases] [threads]
"""

import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from mc_engine import load_campaign
from mc_engine.campaign.cases import case_table
from mc_engine.flight import flight
from tests.benchmarks.kernel_clock import KernelClock


def flown(cases, threads=1):
    """(columns of the last part, processor seconds in the kernel, wall seconds) of the first cases of the campaign."""
    campaign = load_campaign("geo_servicing", cases=cases)

    def part(ids):
        inputs = dict(campaign.nominal) | case_table(campaign, ids)
        return flight.fly(campaign.model, inputs, ids, campaign.seed)

    part(np.arange(8))  # compiled and planned before
    parts = np.array_split(np.arange(cases), max(threads, cases // 1000))
    with KernelClock(time.thread_time) as clock, ThreadPoolExecutor(threads) as pool:
        begin = time.perf_counter()
        columns = list(pool.map(part, parts))[-1]
        return columns, clock.spent, time.perf_counter() - begin


if __name__ == "__main__":
    numbers = [int(one) for one in sys.argv[1:]] + [10_000, 2][len(sys.argv) - 1 :]
    best = min((flown(*numbers)[1:] for _ in range(3)), key=lambda pair: pair[0])
    print("{} ten-day phasings: {:.2f} s of processor time in the kernel, {:.2f} s on {} threads".format(
        numbers[0], *best, numbers[1]
    ))  # fmt: skip
