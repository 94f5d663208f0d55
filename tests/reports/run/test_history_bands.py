"""Percentile bands over the histories of many cases."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from figure_marks import drawings
from synthetic_run import synthetic_run

import campaigns
import mc_engine
from mc_engine.campaign.loading import load_campaign
from reports.contents import build
from reports.drawing import paper, screen
from reports.drawing.marks import Band, Line
from reports.run.flown import Flown
from reports.run.history_bands import fair_cases, history_envelopes

TIMES = np.linspace(0.0, 10.0, 101)


def histories(slopes, times=None):
    """A straight line a case; `times` a list of one grid each, or the same for all."""
    frames = []
    for case, slope in enumerate(slopes):
        t = TIMES if times is None else times[case]
        frames.append(pd.DataFrame({"case_id": case, "t_s": t, "x_m": slope * t, "y_m": -slope * t}))
    return pd.concat(frames, ignore_index=True)


def test_the_band_holds_the_quantiles_of_the_cases_at_every_time():
    slopes = np.random.Generator(np.random.Philox(key=2)).normal(size=200)
    bands = history_envelopes(histories(slopes), range(200), ["x_m", "y_m"])
    for name, sign in (("x_m", 1.0), ("y_m", -1.0)):
        band = bands[name]
        np.testing.assert_array_equal(band.at, TIMES)
        assert band.n_cases == 200
        for probability, curve in band.curves.items():
            expected = [np.quantile(sign * slopes * t, probability) for t in TIMES]
            np.testing.assert_allclose(curve, expected, rtol=1e-12, atol=1e-12)


def test_flights_of_their_own_steps_are_met_at_common_times_and_count_until_their_end():
    """Cases 0 to 29 end at 5 s, 30 to 54 at 10 s, each with other steps; straight lines are met exactly."""
    ends = [5.0] * 30 + [10.0] * 25
    times = [np.linspace(0.0, end, 20 + case) for case, end in enumerate(ends)]
    slopes = np.arange(55.0)
    band = history_envelopes(histories(slopes, times), range(55), ["x_m"])["x_m"]
    assert band.at[-1] == 10.0
    early, late = band.at < 4.99, band.at > 5.01
    np.testing.assert_allclose(band.curves[0.5][early], 27.0 * band.at[early], rtol=1e-9)
    np.testing.assert_allclose(band.curves[0.5][late], 42.0 * band.at[late], rtol=1e-9)


def test_where_few_still_fly_median_and_percentiles_end_and_the_extremes_go_on_to_the_last_flight():
    """A band that ended with the twentieth flight before the last was said to be "smallest to largest" of all."""
    times = [np.linspace(0.0, 10.0 if case < 5 else 4.0, 50) for case in range(40)]
    slopes = np.where(np.arange(40) == 0, 2.0, 1.0)
    band = history_envelopes(histories(slopes, times), range(40), ["x_m"])["x_m"]
    assert band.at[-1] == 10.0
    late = band.at > 4.01
    np.testing.assert_allclose(band.curves[1.0][late], 2.0 * band.at[late])
    np.testing.assert_allclose(band.curves[0.0][late], band.at[late])
    for probability in set(band.curves) - {0.0, 1.0}:
        assert np.isnan(band.curves[probability][late]).all()
        assert np.isfinite(band.curves[probability][band.at < 4.0]).all()


def test_a_peak_between_two_instants_is_in_the_band_of_the_extremes():
    times = [np.linspace(0.0, 10.0 - 0.001 * case, 1501) for case in range(30)]
    table = histories(np.zeros(30), times)
    table.loc[(table["case_id"] == 7) & (abs(table["t_s"] - 4.0) < 0.004), ["x_m", "y_m"]] = 5.0, -3.0
    bands = history_envelopes(table, range(30), ["x_m", "y_m"])
    assert (max(bands["x_m"].curves[1.0]), min(bands["y_m"].curves[0.0])) == (5.0, -3.0)
    assert abs(bands["x_m"].at[np.argmax(bands["x_m"].curves[1.0])] - 4.0) < 0.05


def test_where_flights_are_infinite_there_is_no_band_of_them():
    """A distance to what is not yet in sight: a warning about an invalid subtraction, and -inf as the smallest."""
    flown = histories(np.arange(40.0))
    flown.loc[flown["t_s"] < 3.0, "x_m"] = np.inf
    flown.loc[flown["case_id"] < 2, "y_m"] = -np.inf
    with np.errstate(all="raise"):
        bands = history_envelopes(flown, range(40), ["x_m", "y_m"])
    early = TIMES < 2.99
    assert np.isnan(bands["x_m"].curves[0.0][early]).all()
    np.testing.assert_allclose(bands["x_m"].curves[1.0][TIMES > 3.1], 39.0 * TIMES[TIMES > 3.1])
    np.testing.assert_allclose(bands["y_m"].curves[0.0], -39.0 * TIMES)
    np.testing.assert_allclose(bands["y_m"].curves[1.0], -2.0 * TIMES)


def test_a_handful_of_cases_makes_no_band():
    assert history_envelopes(histories(np.ones(19)), range(19), ["x_m"]) == {}


def test_only_cases_kept_for_no_reason_are_in_a_band():
    """The nominal is no case; 7 and 90 were kept because they are among the worst."""
    for saved, fair in (([-1, 0, 1, 2, 3, 4, 7, 90], [0, 1, 2, 3, 4]), ([-1, 3, 4], [])):
        run = synthetic_run(100, failed=0)
        run.manifest["campaign"]["design"], run.history = "mc", pd.DataFrame({"case_id": np.repeat(saved, 3)})
        assert fair_cases(Flown(run, "run")) == fair


def test_a_worst_case_that_follows_the_first_ones_without_a_gap_is_in_no_band(tmp_path):
    """With `first = 30` the worst case is sometimes case 30: the envelope of "the first 31 cases" went as far as it."""
    folder = Path(campaigns.__file__).parent / "minimal"
    worst = '[retention.histories]\nfirst = 30\nworst = { metric = "top_speed_m_s", count = 60 }\n'
    text = (folder / "campaign.toml").read_text().partition("[sensitivity]")[0] + worst
    run = mc_engine.run(load_campaign("minimal", text=text, directory=folder, cases=60), tmp_path / "run", workers=1)
    assert run.histories()["case_id"].max() == 59
    assert fair_cases(Flown(run, "run")) == [*range(30)]


def test_a_failed_case_without_a_history_is_no_gap_and_is_counted():
    """Of first = 30 the cases 2 and 9 were refused: a report of 28 histories said that envelopes need 20."""
    run = synthetic_run(100, failed=0)
    run.table.loc[[2, 9], "status"] = "refused"
    saved = histories(np.ones(30)).rename(columns={"x_m": "force_n"})
    run.history = saved[~saved["case_id"].isin([2, 9])].reset_index(drop=True)
    assert fair_cases(Flown(run, "run")) == [case for case in range(30) if case not in (2, 9)]
    said = repr(build(run, "run"))
    assert "median of the first 28 saved cases (2 failed cases among them left no history)" in said
    assert "Envelopes need" not in said


@pytest.fixture(scope="module")
def drawing():
    run = synthetic_run(300, failed=0)
    slopes = np.random.Generator(np.random.Philox(key=3)).normal(size=60)
    names = ["semi_major_axis_error_km", "eccentricity_error", "force_n", "position_error_m"]
    lines = [
        pd.DataFrame({"case_id": case, "t_s": TIMES} | {name: slope * TIMES for name in names[:3]} | {names[3]: 1.0})
        for case, slope in enumerate([0.0, *slopes], start=-1)
    ]
    run.history = pd.concat(lines, ignore_index=True)
    document = build(run, "run")
    return document, drawings(document, "histories")[0]


def test_a_report_draws_bands_with_the_nominal_and_the_two_worst(drawing):
    _, histories_drawing = drawing
    plots = [plot for plot in histories_drawing.plots if any(isinstance(mark, Band) for mark in plot.marks)]
    assert [plot.quantity for plot in plots] == ["semi_major_axis_error_km", "eccentricity_error", "force_n"]
    lines = [mark.name for mark in histories_drawing.plots[0].marks if isinstance(mark, Line)]
    assert (len(lines), lines[0], lines[-1]) == (4, "median of them", "nominal")
    texts = [mark.key for mark in histories_drawing.key]
    assert "2.5\u202f% to 97.5\u202f% of 60 saved cases" in texts  # 60 cases support no percentile farther out
    assert "smallest to largest of 60 saved cases" in texts
    filled = [trace for trace in screen.specifications(histories_drawing)[0]["data"] if trace.get("fill") == "toself"]
    assert len(filled) == 2
    assert paper.svg(histories_drawing) == paper.svg(histories_drawing)


def test_a_quantity_that_never_changes_is_named_instead_of_drawn(drawing):
    document, _ = drawing
    assert "Not drawn, the same in all saved cases at all times: position error." in repr(document)
