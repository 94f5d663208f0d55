"""Plans are computed once for the same inputs and sources, and again where anything differs or the file is broken."""

import numpy as np
import pytest

from campaigns.geo_servicing.plan_cache import remembered

INPUTS = np.array([1.0, np.nan, 3.0])


@pytest.fixture
def planned(tmp_path, monkeypatch):
    """(a planner that counts its calls, the cache's folder)."""
    monkeypatch.setenv("MC_ENGINE_CACHE", str(tmp_path))

    def plan(inputs=INPUTS, sources="a"):
        plan.calls = 0

        def compute():
            plan.calls += 1
            return 2.0 * inputs

        return remembered(inputs, sources, compute)

    return plan, tmp_path / "plans"


def test_the_second_time_it_is_read_with_the_same_bits(planned):
    plan, _ = planned
    first = plan()
    assert plan.calls == 1
    assert plan().tobytes() == first.tobytes()
    assert plan.calls == 0


@pytest.mark.parametrize("other", [{"inputs": np.array([1.0, np.nan, 3.0 + 1e-15])}, {"sources": "b"}])
def test_other_inputs_and_other_sources_are_other_plans(planned, other):
    plan, _ = planned
    plan()
    plan(**other)
    assert plan.calls == 1


@pytest.mark.parametrize("text", [b"", b"\x93NUMPY", b"something else"])
def test_a_broken_file_is_planned_again(planned, text):
    plan, folder = planned
    first = plan()
    (file,) = folder.iterdir()
    file.write_bytes(text)
    assert plan().tobytes() == first.tobytes()
    assert plan.calls == 1


def test_a_cache_that_cannot_be_written_costs_nothing_but_time(planned):
    plan, folder = planned
    folder.write_text("in the way")
    assert plan()[2] == 6.0
