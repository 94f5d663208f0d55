"""The rocket of `examples/calisto`: its flights beside those of its twin in RocketPy.

calisto_rocketpy.parquet holds the first 200 cases of its campaign file, flown by rocketpy_twin.py with RocketPy 1.13.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import mc_engine
from mc_engine import load_campaign, open_run, run
from mc_engine.flight.chunks import fly_cases
from mc_engine.flight.flight import fly
from mc_engine.model import load_model

EXAMPLE = Path(mc_engine.__file__).parent / "documentation" / "examples" / "calisto"
THEIRS = Path(__file__).with_name("calisto_rocketpy.parquet")
METRICS = ("apogee_m", "apogee_time_s", "top_speed_m_s", "rail_speed_m_s", "flight_time_s", "landing_east_m",
           "landing_north_m", "landing_speed_m_s")  # fmt: skip


@pytest.fixture(scope="module")
def ours():
    return fly_cases(load_campaign(EXAMPLE / "campaign.toml", cases=200), np.arange(200))


def test_200_dispersed_cases_are_those_of_rocketpy_within_a_hundredth_of_sigma(ours):
    theirs = pd.read_parquet(THEIRS)
    assert set(ours["status"]) == {"ok"}
    for name in theirs.columns.intersection(pd.Index(ours)).difference(METRICS):
        np.testing.assert_array_equal(ours[name], theirs[name], err_msg=name)  # the same inputs
    for name in METRICS:
        assert abs(np.mean(ours[name] - theirs[name])) < 0.01 * theirs[name].std(), name


def test_the_flight_without_wind_is_that_of_rocketpy():
    model = load_model("model.py", EXAMPLE)
    still = {item.name: np.array([item.default]) for item in model.parameters}
    columns = fly(model, still, np.array([0]), 1, folder=EXAMPLE)
    # rocketpy_twin.py gives these in RocketPy 1.13.0
    assert columns["apogee_m"][0] == pytest.approx(3306.4591583, rel=1e-4)
    assert columns["top_speed_m_s"][0] == pytest.approx(285.9566881, rel=1e-4)
    assert columns["flight_time_s"][0] == pytest.approx(298.2283098, rel=1e-4)
    assert columns["landing_east_m"][0] == pytest.approx(-6.1803210, abs=0.1)
    assert columns["landing_north_m"][0] == pytest.approx(657.1249733, abs=0.1)


def test_its_twin_flies_in_rocketpy_under_the_same_campaign_file(tmp_path):
    pytest.importorskip("rocketpy")
    theirs = pd.read_parquet(THEIRS)
    run(load_campaign(EXAMPLE / "rocketpy.toml", cases=2), tmp_path / "run", workers=2)
    flown = pd.read_parquet(tmp_path / "run" / "cases")
    for name in METRICS:
        np.testing.assert_allclose(flown[name], theirs[name][:2], rtol=1e-6)


@pytest.mark.slow
def test_a_trace_has_the_bits_of_the_kernel_and_names_the_phases(tmp_path):
    run(load_campaign(EXAMPLE / "campaign.toml", cases=4), tmp_path / "run", workers=1)
    trace = open_run(tmp_path / "run").case(3).trace()  # refuses a flight whose end differs in a bit
    assert list(dict.fromkeys(trace["phase"])) == ["rail", "powered", "coast", "drogue", "main"]
    assert trace["coast.air.density"].notna().any()
