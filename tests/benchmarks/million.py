"""A million low orbits from the campaign file to Parquet: wall time, peak memory, and where the time goes.

    python -m tests.benchmarks.million [cases] [threads]

The run is a process of its own, so that its peak memory is its own; what is compiled is compiled before.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

CAMPAIGN = Path(__file__).with_name("leo") / "campaign.toml"


class Stopwatch:
    """Seconds that all threads together spend in some functions."""

    def __init__(self) -> None:
        self.spent: dict[str, float] = {}
        self._lock = threading.Lock()

    def watch(self, place: type | ModuleType, name: str, part: str) -> None:
        """From now on the time in `place.name` counts for `part`."""
        call: Callable[..., object] = getattr(place, name)

        def timed(*arguments: object, **options: object) -> object:
            begin = time.perf_counter()
            try:
                return call(*arguments, **options)
            finally:
                with self._lock:
                    self.spent[part] = self.spent.get(part, 0.0) + time.perf_counter() - begin

        setattr(place, name, timed)


def fly(cases: int, workers: int) -> dict[str, float]:
    """One run in this process: wall [s], peak memory [MiB], thread-seconds by part, parts and cases in the largest."""
    from mc_engine import load_campaign
    from mc_engine.flight import chunks
    from mc_engine.flight.compiled import CompiledFlyer
    from mc_engine.runner import runner
    from tests.benchmarks.kernel_clock import KernelClock

    with tempfile.TemporaryDirectory() as folder, KernelClock() as kernels:
        runner.run(load_campaign(CAMPAIGN, cases=64), Path(folder) / "warm", workers=1)
        watch = Stopwatch()
        for place, name, part in (
            (chunks, "case_table", "sampling"),
            (CompiledFlyer, "fly", "flying"),
            (chunks, "write_aside", "writing"),
        ):
            watch.watch(place, name, part)
        kernels.spent = 0.0
        begin = time.perf_counter()
        store = runner.run(load_campaign(CAMPAIGN, cases=cases), Path(folder) / "run", workers=workers)
        wall = time.perf_counter() - begin
        rows = [part.rows for part in store.parts]
        size = sum(file.stat().st_size for file in (Path(folder) / "run" / "cases").iterdir())
    spent = watch.spent
    return {
        "wall": wall,
        "peak_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
        "sampling": spent["sampling"],
        "kernel": kernels.spent,
        "conversion": spent["flying"] - kernels.spent,
        "writing": spent["writing"],
        "parts": len(rows),
        "largest_part": max(rows),
        "mib_on_disk": size / 2**20,
    }


def measured(cases: int, workers: int) -> dict[str, float]:
    """`fly` in a process of its own."""
    command = [sys.executable, "-m", "tests.benchmarks.million", "--inside", str(cases), str(workers)]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()[-1])


def line(cases: int, workers: int, result: dict[str, float]) -> str:
    """The result in words."""
    split = ", ".join(f"{part} {result[part]:.2f}" for part in ("sampling", "kernel", "conversion", "writing"))
    return (
        f"{cases:,} cases, {workers} threads: {result['wall']:.2f} s, peak {result['peak_mib']:.0f} MiB, "
        f"{result['parts']:.0f} parts of at most {result['largest_part']:,.0f} cases, "
        f"{result['mib_on_disk']:.0f} MiB; thread-seconds: {split}"
    )


if __name__ == "__main__":
    if sys.argv[1:2] == ["--inside"]:
        print(json.dumps(fly(int(sys.argv[2]), int(sys.argv[3]))))
    else:
        cases = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
        all_cores = int(sys.argv[2]) if len(sys.argv) > 2 else os.cpu_count() or 1
        for workers in sorted({1, all_cores}):
            print(line(cases, workers, measured(cases, workers)), flush=True)
