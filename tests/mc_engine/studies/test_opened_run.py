import cProfile
from dataclasses import replace

import numpy as np
import pytest

import mc_engine
from mc_engine import load_campaign, open_run
from mc_engine.campaign.search import SHIPPED
from mc_engine.errors import ModelError, StoreError
from mc_engine.model import load_model
from mc_engine.physics.constants import MU_EARTH
from mc_engine.runner import runner
from mc_engine.studies.trace import trace_case
from reports.drawing.marks import Bar
from reports.figures.table_figures import fuel_map, histogram, scatter
from tests.mc_engine.flight.falling_ball import python_campaign
from tests.mc_engine.lanes.flown_models import FOLDER, inputs_of


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """150 cases of the smallest campaign, which keeps the histories of the nominal and the first three."""
    folder = tmp_path_factory.mktemp("flown") / "run"
    runner.run(load_campaign("minimal", cases=150), folder, workers=1)
    return open_run(folder)


def test_a_run_shows_its_title_its_cases_its_verdicts_and_its_metrics(run):
    page = run._repr_html_()
    for words in ("Apogee raised by one burn", "150 of 150 cases: 150 ok", ">pass<", "apogee_altitude_km ≥ 600 km"):
        assert words in page
    assert f"{run.cases['apogee_altitude_km'].mean():.6g}" in page
    assert "apogee: pass" in repr(run)


def test_a_case_has_the_numbers_of_its_row(run):
    case, row = run.case(17), run.cases.iloc[17]
    assert dict(case.inputs) == {name: row[name] for name in ("magnitude_error_pct", "pitch_error_deg")}
    assert case.metrics["apogee_altitude_km"] == row["apogee_altitude_km"]
    assert case.status == "ok"
    assert set(case.end_state.index) == {"end_time_s", "end_x_m", "end_y_m", "end_vx_m_s", "end_vy_m_s"}
    assert f"{row['apogee_altitude_km']:.6g}" in case._repr_html_()


def test_a_kept_history_is_read_and_pictured_and_any_other_is_flown(run, monkeypatch):
    assert '<img alt="history of case 2" src="data:image/png;base64,' in run.case(2)._repr_html_()
    assert "was not kept" in run.case(17)._repr_html_()
    flown = run.case(17).history()
    assert set(flown["case_id"]) == {17}
    assert flown["altitude_km"].iloc[-1] == pytest.approx(run.case(17).metrics["apogee_altitude_km"], abs=1e-9)
    changed = replace(run.case(17).replay(), equal=False, differences=("case 17, apogee: stored 1.0, now 2.0",))
    monkeypatch.setattr(runner, "replay", lambda *_: changed)
    with pytest.raises(StoreError, match=r"case 17, apogee: stored 1.0, now 2.0; the run was changed"):
        run.case(17).history()
    monkeypatch.setattr(runner, "replay", None)  # a kept one is not flown
    assert set(run.case(2).history()["case_id"]) == {2}


def test_a_replay_is_bit_exact_and_the_nominal_case_has_none(run):
    assert run.case(17).replay().equal
    assert run.nominal.inputs["magnitude_error_pct"] == 0.0
    assert len(run.nominal.history())
    with pytest.raises(StoreError, match="nominal case cannot be replayed"):
        run.nominal.replay()


def test_a_trace_has_every_number_that_the_physics_names_at_every_step(run):
    case, trace = run.case(17), run.case(17).trace()
    assert trace["t_s"].tolist() == [*(10.0 * np.arange(len(trace) - 1)), case.row["end_time_s"]]
    for name in ("x_m", "y_m", "vx_m_s", "vy_m_s"):
        assert trace[name].iloc[-1] == case.row[f"end_{name}"]
    r2 = trace["x_m"] ** 2 + trace["y_m"] ** 2
    np.testing.assert_allclose(trace["rhs.r2"], r2, rtol=1e-15)
    np.testing.assert_allclose(trace["rhs.g"], -MU_EARTH / r2**1.5, rtol=1e-14)
    np.testing.assert_allclose(trace["d(vx)/dt"], trace["rhs.g"] * trace["x_m"], rtol=1e-15)
    climb = trace["x_m"] * trace["vx_m_s"] + trace["y_m"] * trace["vy_m_s"]
    np.testing.assert_allclose(trace["event.apogee"], climb, rtol=1e-12)
    assert trace["event.apogee"].iloc[-1] <= 0.0 < trace["event.apogee"].iloc[-2]
    assert trace["altitude_km"].iloc[-1] == pytest.approx(case.metrics["apogee_altitude_km"], rel=1e-15)
    assert (trace.attrs["units"]["altitude_km"], trace.attrs["units"]["rhs.g"]) == ("km", "")
    assert (trace["initial.dv"] == trace["initial.dv"][0]).all()


def test_a_trace_is_the_same_under_a_profiler_which_goes_on(run):
    with cProfile.Profile() as profile:
        trace = run.case(17).trace()
        load_campaign("minimal", cases=2)
    assert trace.equals(run.case(17).trace())
    assert "load_campaign" in {getattr(entry.code, "co_name", "") for entry in profile.getstats()}


def test_a_trace_names_functions_inside_functions_and_fields_of_records(tmp_path):
    text = (SHIPPED / "minimal" / "model.py").read_text()
    (tmp_path / "campaign.toml").write_text((SHIPPED / "minimal" / "campaign.toml").read_text())
    for old, new in (
        ("@physics\ndef rhs", "@physics\ndef half(x):\n    part = 0.5 * x\n    return part\n\n\n@physics\ndef rhs"),
        ("    g = -MU", "    pull = State(half(s.x), 0.0, half(half(s.y)), 0.0)\n    g = -MU"),
        (
            "Inputs = inputs(",
            "Aim = namedtuple('Aim', 'x y')\n"
            "Memory = namedtuple('Memory', 'aim', defaults=[Aim(3.0, 4.0)])\n\n\nInputs = inputs(",
        ),
        ("from mc_engine.lanes", "from collections import namedtuple\n\nfrom mc_engine.lanes"),
        (" observe=observe,", " observe=observe, memory=Memory,"),
    ):
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "model.py").write_text(text)
    runner.run(load_campaign(tmp_path, cases=2), tmp_path / "run", workers=1)
    trace = open_run(tmp_path / "run").case(1).trace()
    assert (trace["rhs.half.part"] == 0.5 * trace["x_m"]).all()
    assert (trace["rhs.half[2].part"] == 0.5 * trace["y_m"]).all()
    assert (trace["rhs.half[3].part"] == 0.25 * trace["y_m"]).all()
    assert (trace["rhs.pull.vx"] == trace["rhs.half[3].part"]).all()
    assert (trace[["m.aim.x", "m.aim.y"]] == [3.0, 4.0]).all(axis=None)


def test_a_trace_has_a_state_and_the_output_of_its_name_apart(tmp_path):
    text = (SHIPPED / "minimal" / "model.py").read_text()
    for old, new in (
        ("Outputs = outputs(", 'Outputs = outputs(x_m="x from the launch site", '),
        ("return Outputs(", "return Outputs(x=s.x - 1000.0, "),
    ):
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "model.py").write_text(text)
    model = load_model("model.py", tmp_path)
    trace, end = trace_case(model, inputs_of(model, {}), 0, 1, 60.0)
    assert trace["s.x_m"].iloc[-1] == end["end_x_m"]
    assert (trace["x_m"] == trace["s.x_m"] - 1000.0).all()
    assert [trace.attrs["units"][name] for name in ("x_m", "s.x_m", "y_m")] == ["m", "m", "m"]
    assert "s.y_m" not in trace


def test_a_trace_that_is_not_the_case_of_the_run_or_has_no_physics_is_refused(run, tmp_path):
    case = run.case(17)
    with pytest.raises(StoreError, match=r"case 17 ended with end_x_m = 1\.0, its trace with"):
        replace(case, row={**case.row, "end_x_m": 1.0}).trace()
    with pytest.raises(StoreError, match=r"the trace of case 17 was given up after 0 s, at t = "):
        case.trace(seconds=0.0)
    runner.run(load_campaign(python_campaign(tmp_path / "ball", cases=2)), tmp_path / "run", workers=1)
    with pytest.raises(ModelError, match="was flown by a simulator, which has no physics to trace"):
        open_run(tmp_path / "run").case(1).trace()


def test_a_metric_or_a_case_by_a_wrong_name_is_answered_with_the_right_one(run):
    with pytest.raises(StoreError, match='there is no metric "apogee_altitude"; did you mean "apogee_altitude_km"'):
        run.metrics["apogee_altitude"]
    assert run.metrics.get("apogee_altitude") is None
    assert run.case(np.int64(17)).case_id == 17
    for wrong in ("a", 17.0, True, None):
        with pytest.raises(
            StoreError, match=f"case {wrong!r} is not there; cases are whole numbers, from 0 to 149, and"
        ):
            run.case(wrong)


def test_text_of_a_run_is_never_read_as_html(run):
    row = {**run.case(1).row, "status": "failed", "reason": "<script>"}
    page = mc_engine.Case(run.store, 1, row)._repr_html_()
    assert "&lt;script&gt;" in page
    assert "<script>" not in page


def test_figures_of_a_table_draw_its_cases_with_its_units(run):
    table = run.cases
    (bars,) = histogram(table, "apogee_altitude_km").drawing.plots
    assert sum(mark.top.sum() for mark in bars.marks if isinstance(mark, Bar)) == 150
    assert bars.x.label == "apogee altitude [km]"
    (cloud,) = scatter(table, "magnitude_error_pct", "apogee_altitude_km").drawing.plots
    assert np.array_equal(cloud.marks[0].x, table["magnitude_error_pct"])
    assert np.array_equal(cloud.marks[0].y, table["apogee_altitude_km"])
    (surface,) = fuel_map(table, "magnitude_error_pct", "pitch_error_deg", "apogee_altitude_km").drawing.plots
    assert [surface.y.label, *(field.label for field in surface.fields)] == [
        "pitch error [deg]",
        "apogee altitude [km]",
    ]


def test_a_trace_has_no_number_for_an_action_that_is_not_due():
    model = load_model("late_ball.py", FOLDER)
    trace, _ = trace_case(model, inputs_of(model, {}), 0, 1, 60.0)
    assert 0 < trace["m.mark_due"].notna().sum() < len(trace)
    assert trace["m.mark_due"].max() <= trace["t_s"].max()
