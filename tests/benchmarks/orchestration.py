"""What a case costs beside its flight: sampling, unit conversion, design, storing, bookkeeping.

    python -m tests.benchmarks.orchestration

One thread, so that the time in the kernels can be taken away from the whole.
"""

import tempfile
import time
from dataclasses import replace
from pathlib import Path

from mc_engine import load_campaign
from mc_engine.campaign.sections import HistoriesSection
from mc_engine.runner import runner
from tests.benchmarks.kernel_clock import KernelClock


def microseconds_per_case(name="deorbit", cases=100_000):
    """Microseconds a case of a run without histories, less those in the kernels."""
    campaign = replace(load_campaign(name, cases=cases), retention=HistoriesSection(nominal=False))
    with tempfile.TemporaryDirectory() as folder, KernelClock() as kernels:
        runner.run(replace(campaign, cases=64), Path(folder) / "warm", workers=1)
        kernels.spent = 0.0
        begin = time.perf_counter()
        runner.run(campaign, Path(folder) / "run", workers=1)
        return 1e6 * (time.perf_counter() - begin - kernels.spent) / cases


if __name__ == "__main__":
    for name in ("deorbit", "minimal"):
        best = min(microseconds_per_case(name) for _ in range(3))
        print(f"{name}: {best:.2f} µs per case beside the flight, 100 000 cases, one thread")
