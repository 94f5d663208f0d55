"""What the engine costs beside the time of a simulator itself."""

import time

import pytest

from mc_engine import load_campaign, run
from tests.mc_engine.flight.falling_ball import program_campaign, python_campaign


def seconds_per_case(file, cases, folder):
    """Wall time of a run on two workers, without the start of their processes."""
    few, many = (load_campaign(file, cases=n) for n in (2, cases))
    run(few, folder / "few", workers=2)  # the processes wait for the next run
    begin = time.perf_counter()
    run(many, folder / "many", workers=2)
    return (time.perf_counter() - begin) / cases


TRIVIAL = "return {'fall_time_s': 1.0 + 0.0 * inputs['mass_kg'], 'impact_speed_m_s': 1.0 + 0.0 * inputs['mass_kg']}"


@pytest.mark.benchmark
@pytest.mark.parametrize(("kind", "cases", "most_ms"), [("case", 10_000, 0.5), ("batch", 100_000, 0.05)])
def test_a_python_case_costs_little(tmp_path, kind, cases, most_ms):
    options = "batch=True," if kind == "batch" else ""
    file = python_campaign(tmp_path / "ball", fault=TRIVIAL, options=options)
    ms = 1e3 * seconds_per_case(file, cases, tmp_path)
    print(f"{kind}: {ms:.4f} ms a case")
    assert ms < most_ms


@pytest.mark.benchmark
def test_a_program_costs_little_beside_its_start(tmp_path):
    ms = 1e3 * seconds_per_case(program_campaign(tmp_path / "ball"), 1000, tmp_path)
    print(f"program: {ms:.2f} ms a case, with the start of a process")
    assert ms < 20.0
