"""How much faster two threads, or all, fly a campaign than one: whole runs, from the loaded file to the last part.

    python -m tests.benchmarks.threads [campaign] [cases]

The runs take turns, and the shortest of each counts.
"""

import os
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from mc_engine import load_campaign
from mc_engine.campaign.loading import Campaign
from mc_engine.campaign.sections import HistoriesSection
from mc_engine.runner import runner


def seconds(campaign: Campaign, workers: int) -> float:
    """Wall time of one run without histories."""
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        runner.run(campaign, Path(folder) / "run", workers=workers)
        return time.perf_counter() - begin


def scaling(name: str, cases: int, turns: int = 5) -> dict[int, float]:
    """Threads -> seconds of the shortest run."""
    campaign = replace(load_campaign(name, cases=cases), retention=HistoriesSection(nominal=False))
    thread_counts = sorted({1, min(2, os.cpu_count() or 1), os.cpu_count() or 1})
    seconds(replace(campaign, cases=64), 1)  # compiles
    best = dict.fromkeys(thread_counts, float("inf"))
    for _ in range(turns):
        for workers in thread_counts:
            best[workers] = min(best[workers], seconds(campaign, workers))
    return best


if __name__ == "__main__":
    name = sys.argv[1] if len(sys.argv) > 1 else "flexible_satellite"
    cases = int(sys.argv[2]) if len(sys.argv) > 2 else 4000
    best = scaling(name, cases)
    for workers, time_taken in best.items():
        gain = best[1] / time_taken
        print(f"{name}, {cases:,} cases, {workers} threads: {time_taken:.2f} s, {gain:.2f} times one thread")
