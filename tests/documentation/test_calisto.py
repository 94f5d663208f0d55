"""The rocket of `examples/calisto`: its flights beside those of its twin in RocketPy.

calisto_rocketpy.parquet holds the first 200 cases of its campaign file, flown by rocketpy_twin.py with RocketPy 1.13.
"""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import mc_engine
from mc_engine import StoreError, load_campaign, open_run, replay, run
from mc_engine.flight.chunks import fly_cases
from mc_engine.flight.flight import fly
from mc_engine.model import load_model
from mc_engine.runner.importing import import_results
from reports import write_reports
from tests.mc_engine.flight.falling_ball import assert_alike

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


def reported(store):
    """The report of a run, as data."""
    write_reports(store.path, ("json",))
    return json.loads((store.path / "report.json").read_text())


@pytest.fixture
def imported(tmp_path):
    """The run that the kept results of RocketPy make, which RocketPy need not be there for."""
    return import_results(load_campaign(EXAMPLE / "rocketpy.toml"), THEIRS, tmp_path / "imported")


def test_its_200_kept_cases_are_imported_judged_and_reported(imported):
    theirs, report = pd.read_parquet(THEIRS), reported(imported)
    rows = imported.cases()
    for name in theirs:
        np.testing.assert_array_equal(rows[name], theirs[name], err_msg=name)
    assert report["counts"] == {"cases": 200, "flown": 200, "completed": 200, "inside_all_limits": 200}
    verdicts = {one["name"]: (one["verdict"], one["passed"], one["tried"]) for one in report["requirements"]}
    assert verdicts == {"apogee": ("pass", 200, 200), "landing_speed": ("not demonstrable", 200, 200)}
    for metric in report["metrics"]:
        assert metric["mean"] == pytest.approx(theirs[metric["name"]].mean(), rel=1e-12)
        assert metric["sigma"] == pytest.approx(theirs[metric["name"]].std(), rel=1e-12)
    strongest = {one["metric"]: one["input"] for one in reversed(report["contributors"])}
    assert strongest == {"apogee_m": "thrust_factor", "landing_speed_m_s": "main_area_m2"}
    provenance = next(one["blocks"] for one in report["sections"] if one["title"] == "Provenance")
    assert ["imported from", THEIRS.name] in provenance[0]["rows"]
    assert "Command to replay" not in json.dumps(report["sections"])
    with pytest.raises(StoreError, match=r"the engine did not fly them"):
        replay(imported.path, 3)


def test_its_twin_flies_in_rocketpy_under_the_same_campaign_file(tmp_path, ours, imported):
    pytest.importorskip("rocketpy", reason='the extra "bench" is missing')
    theirs = pd.read_parquet(THEIRS)
    store = run(load_campaign(EXAMPLE / "rocketpy.toml"), tmp_path / "run", workers=2)
    flown = store.cases()
    for name in METRICS:
        np.testing.assert_allclose(flown[name], theirs[name], rtol=1e-6)
        assert abs(np.mean(ours[name] - flown[name])) < 0.01 * flown[name].std(), name
    through_the_door, from_elsewhere = reported(store), reported(imported)
    for part in ("counts", "requirements", "contributors", "worst"):
        assert_alike(through_the_door[part], from_elsewhere[part], rel=1e-6)


@pytest.mark.slow
def test_a_trace_has_the_bits_of_the_kernel_and_names_the_phases(tmp_path):
    run(load_campaign(EXAMPLE / "campaign.toml", cases=4), tmp_path / "run", workers=1)
    trace = open_run(tmp_path / "run").case(3).trace()  # refuses a flight whose end differs in a bit
    assert list(dict.fromkeys(trace["phase"])) == ["rail", "powered", "coast", "drogue", "main"]
    assert set(trace["phase"][trace["coast.free.air.density"].notna()]) == {"coast"}
