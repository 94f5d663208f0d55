import numpy as np
import pytest

import mc_engine
from mc_engine import load_campaign, open_run
from mc_engine.errors import StoreError
from mc_engine.runner import runner
from reports.drawing.marks import Bar
from reports.figures.table_figures import fuel_map, histogram, scatter


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
    monkeypatch.setattr(runner, "replay", None)  # a kept one is not flown
    assert set(run.case(2).history()["case_id"]) == {2}


def test_a_replay_is_bit_exact_and_the_nominal_case_has_none(run):
    assert run.case(17).replay().equal
    assert run.nominal.inputs["magnitude_error_pct"] == 0.0
    assert len(run.nominal.history())
    with pytest.raises(StoreError, match="nominal case cannot be replayed"):
        run.nominal.replay()


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
    assert [surface.y.label, surface.field.label] == ["pitch error [deg]", "apogee altitude [km]"]
