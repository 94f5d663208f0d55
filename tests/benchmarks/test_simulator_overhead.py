"""What the engine costs beside the time of a simulator itself, on two workers.

Other work on the machine lengthens the wall time and not the processor time.  So the gates take what is less: the wall
time of a case, or the processor time of the engine and its processes over two cores.
"""

import subprocess
import sys
import time

import psutil
import pytest

from mc_engine import load_campaign, run
from tests.mc_engine.flight.falling_ball import program_campaign, python_campaign

WORKERS = 2
TRIVIAL = "return {'fall_time_s': 1.0 + 0.0 * inputs['mass_kg'], 'impact_speed_m_s': 1.0 + 0.0 * inputs['mass_kg']}"
WAITING = f"import time\nend = time.thread_time() + 1e-3\nwhile time.thread_time() < end: pass\n{TRIVIAL}"


def processor_s():
    """Of this process and those that fly for it, or did so before they ended."""
    me = psutil.Process()
    return sum(sum(one.cpu_times()[:4]) for one in (me, *me.children(recursive=True)))


def seconds(file, cases, folder):
    """(wall time, processor time) of a run on two workers, without the start of their processes."""
    few, many = (load_campaign(file, cases=n) for n in (2 * WORKERS, cases))
    run(few, folder / "few", workers=WORKERS, chunk=2)  # the processes wait for the next run
    begin, spent = time.perf_counter(), processor_s()
    run(many, folder / "many", workers=WORKERS)
    return time.perf_counter() - begin, processor_s() - spent


@pytest.mark.benchmark
@pytest.mark.parametrize(("kind", "cases", "most_us"), [("case", 10_000, 500.0), ("batch", 100_000, 10.0)])
def test_a_python_case_costs_little(tmp_path, kind, cases, most_us):
    file = python_campaign(tmp_path / "ball", fault=TRIVIAL, options="batch=True," if kind == "batch" else "")
    wall, spent = (1e6 * one / cases for one in seconds(file, cases, tmp_path))
    print(f"{kind}: {wall:.1f} us a case of wall time, {spent:.1f} us of processor time")
    assert min(wall, spent / WORKERS) < most_us


@pytest.mark.benchmark
def test_cases_of_a_millisecond_keep_the_processors_busy(tmp_path):
    cases = 20_000
    wall, spent = seconds(python_campaign(tmp_path / "ball", fault=WAITING), cases, tmp_path)
    plain = without_engine(cases)
    busy, plain_busy = spent / WORKERS / wall, 1e-3 * cases / WORKERS / plain
    print(f"1 ms a case: {wall:.2f} s, two plain processes {plain:.2f} s; busy {busy:.1%}, they {plain_busy:.1%}")
    assert busy > 0.9 * plain_busy  # other work on the machine takes from both


def without_engine(cases):
    """Wall time of the same waiting in plain processes, under the same load of the machine."""
    lines = ["import time", "begin = time.perf_counter()", f"for _ in range({cases // WORKERS}):"]
    lines += ["    end = time.thread_time() + 1e-3", "    while time.thread_time() < end: pass"]
    command = [sys.executable, "-c", "\n".join([*lines, "print(time.perf_counter() - begin)"])]
    plain = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(WORKERS)]
    return max(float(one.communicate()[0]) for one in plain)


@pytest.mark.benchmark
def test_a_program_costs_little_beside_its_start(tmp_path):
    cases, file = 1000, program_campaign(tmp_path / "ball")
    (tmp_path / "case.txt").write_text("0 10 0.02 500\n")
    begin = time.perf_counter()
    for _ in range(100):
        subprocess.run([file.parent / "fall", "case.txt", "result.json"], cwd=tmp_path, check=True)
    start = 10.0 * (time.perf_counter() - begin)
    wall, spent = (1e3 * one / cases for one in seconds(file, cases, tmp_path))
    print(f"program: {wall:.2f} ms a case of wall time, {spent:.2f} ms of processor time; its start {start:.2f} ms")
    assert min(wall, spent / WORKERS) < start / WORKERS + 3.0
