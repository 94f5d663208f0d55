"""What figures draw, against the same numbers computed in another way."""

import io
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from figure_marks import drawings, marks_of
from landing_run import FOOTPRINT, landing_run
from PIL import Image
from scipy import stats
from synthetic_run import synthetic_run

from mc_engine.statistics.geodesy import LocalPlane
from reports.contents import build
from reports.contributors.companion import sigma_contribution
from reports.contributors.tornado_figure import strongest
from reports.document.blocks import FigureBlock, Table, blocks_of
from reports.drawing.marks import Bar, Limit, Line, Points
from reports.figures.statistics import plotting_positions, probability_plot, shown_ranks
from reports.footprint.coastlines import coastlines, nearest_coast
from reports.replays import replay_drawing, replay_picture
from reports.run.contributions import Contributor
from reports.run.flown import Flown
from reports.run.history_bands import OUTER, history_envelopes, outer_percentile
from reports.run.history_limits import history_limits
from reports.sections.diagnostics import rank_correlations
from reports.sections.single_cases import case_data
from reports.text.numbers import number

TIMES = np.linspace(0.0, 10.0, 101)


def section(run, anchor):
    return next(one for one in build(run, "run").sections if one.anchor == anchor)


# ---- contributors


def test_a_budget_adds_up_to_the_sigma_of_the_cases():
    run = synthetic_run(4000, failed=0)
    table = next(one for one in section(run, "drivers").blocks if isinstance(one, Table))
    rows = [row for row in table.rows if row[0].text == "settling time"]
    place = [column.title for column in table.columns].index("1σ contribution")
    found = {row[1].text: row[place].value for row in rows}
    # settling = 350 + 0.4 VE + 0.2 OE: each contribution is a coefficient times the spread of its input
    assert found["ve"] == pytest.approx(0.4 * run.table["ve_pct"].std(), rel=0.02)
    assert found["oe"] == pytest.approx(0.2 * run.table["oe_pct"].std(), rel=0.05)
    sigma, sums = run.table["settling_time_s"].std(), np.hypot(found["ve"], found["oe"])
    assert f"; σ {number(sigma, 3)}\u202fs; root sum square {number(sums, 3)}\u202fs, rest " in rows[0][0].small
    assert sums == pytest.approx(sigma, rel=0.02)


def test_an_effect_that_noise_could_have_made_contributes_nothing_to_sigma():
    sure = Contributor("miss", "ve", 0.25, 0.3, (0.2, 0.3), (0.25, 0.35))
    unsure = Contributor("miss", "oe", 0.04, 0.3, (-0.01, 0.09), (0.25, 0.35))
    assert sigma_contribution(sure, 2.0) == pytest.approx(1.0)
    assert sigma_contribution(unsure, 2.0) is None
    assert strongest([unsure, sure]) == [unsure, sure]  # its total effect is sure
    assert strongest([sure, replace(unsure, total=0.1, total_interval=(-0.02, 0.22))]) == [sure]


def test_an_input_contributes_no_more_than_its_total_effect_may_be_and_is_ranked_by_that():
    """Of 30 inputs some have a first-order effect by chance: one of 0.001 of the variance got a quarter of σ."""
    chance = Contributor("miss", "ve", 0.06, 0.001, (0.01, 0.10), (0.0005, 0.0016))
    weak = Contributor("miss", "oe", 0.03, 0.034, (0.01, 0.07), (0.03, 0.04))
    assert sigma_contribution(chance, 2.0) == pytest.approx(0.08)
    assert chance.size < weak.size
    alone = Contributor("miss", "ve", 0.06, None, (0.01, 0.10), None)
    assert (alone.size, sigma_contribution(alone, 2.0)) == (0.06, pytest.approx(0.4899, abs=1e-4))


# ---- histories


def peaked(peaks, seen=1.0, name="peak_force_n"):
    """A run whose saved forces rise to `peaks` and fall again; its table says `seen` times as much."""
    run = synthetic_run(300, failed=0)
    run.table.loc[: len(peaks) - 1, name] = seen * peaks
    shape = 1.0 - np.abs(TIMES - 5.03) / 5.03
    frames = [pd.DataFrame({"case_id": case, "t_s": TIMES, "force_n": peak * shape}) for case, peak in enumerate(peaks)]
    run.history = pd.concat(frames, ignore_index=True)
    return run


PEAKS = np.linspace(50.0, 90.0, 40)


def test_a_limit_is_drawn_where_the_metric_is_the_extreme_of_the_quantity_in_all_saved_cases():
    drawing = drawings(build(peaked(PEAKS), "run"), "histories")[0]
    (limit,) = [mark for mark in drawing.plots[0].marks if isinstance(mark, Limit)]
    assert (limit.at, limit.axis, limit.key) == (100.0, "y", "required limit")


@pytest.mark.parametrize("run", [peaked(PEAKS, 1.05), peaked(PEAKS, 0.9), peaked(PEAKS, name="propellant_kg")])
def test_a_limit_that_the_saved_histories_do_not_bear_out_is_not_drawn(run):
    assert history_limits(Flown(run, "run"), ["force_n"]) == {}


def test_a_limit_is_drawn_on_the_output_that_the_model_declares_for_the_metric_whatever_their_names():
    run = peaked(PEAKS)
    run.history = run.history.rename(columns={"force_n": "load_n"})
    run.manifest["quantities"] = [{"name": "load_n", "unit": "N", "description": "load"}]
    assert history_limits(Flown(run, "run"), ["load_n"]) == {}
    run.manifest["metric_outputs"] = {"peak_force_n": "load_n"}
    (limit,) = history_limits(Flown(run, "run"), ["load_n"])["load_n"]
    assert (limit.at, limit.key) == (100.0, "required limit")


def test_an_envelope_reaches_to_the_percentile_that_its_cases_support():
    assert [outer_percentile(n) for n in (20, 100, 200, 740, 741)] == [0.05, 0.01, 0.005, 0.005, 0.00135]
    slopes = np.random.Generator(np.random.Philox(key=7)).normal(size=800)
    rows = pd.DataFrame({"case_id": np.repeat(np.arange(800), 2), "t_s": np.tile([0.0, 1.0], 800)})
    rows["x_m"] = np.column_stack([0.0 * slopes, slopes]).ravel()
    curves = history_envelopes(rows, range(800), ["x_m"])["x_m"].curves
    for p in (0.0, OUTER[0], 0.5, 1.0 - OUTER[0], 1.0):
        assert curves[p][-1] == pytest.approx(np.quantile(slopes, p), rel=1e-12)


def test_a_replays_picture_has_nominal_envelopes_and_limits():
    run = peaked(PEAKS)
    history = run.history[run.history["case_id"] == 3].assign(case_id=77)
    marks = replay_drawing(run, 77, history).plots[0].marks
    names = [mark.name for mark in marks]
    assert {"case 77", "median of them", "smallest to largest of 40 saved cases"} <= set(names)
    assert any(isinstance(mark, Limit) and mark.at == 100.0 for mark in marks)
    assert Image.open(io.BytesIO(replay_picture(run, 77, history))).width > 1000


def test_a_result_is_drawn_however_small_it_is_beside_others_of_its_unit():
    run = peaked(PEAKS)
    draw = np.random.Generator(np.random.Philox(key=11)).normal(size=(3, len(run.history)))
    lost = (run.history["case_id"] == 39) & (run.history["t_s"] == 10.0)
    quantities = {
        "sun_distance_m": 1.5e11 + run.history["force_n"],
        "navigation_error_m": 0.02 * draw[0],  # at most 6e-13 of the distance
        "downrange_m": np.where(lost, 3e20, 1e3 * draw[1]),  # of a flight that is lost
        "reynolds": 1e7 + run.history["force_n"],
        "eccentricity_error": 1e-8 * draw[2],  # without a unit, as the other
    }
    run.history = run.history.assign(**quantities)
    units = {name: name.split("_")[-1] if name.endswith("_m") else "" for name in quantities}
    run.manifest["quantities"] = [
        {"name": name, "unit": unit, "description": ""} for name, unit in {"force_n": "N", **units}.items()
    ]
    run.manifest["figures"] = []
    document, names = build(run, "run"), set(run.history) - {"case_id", "t_s"}
    assert {plot.quantity for one in drawings(document, "histories") for plot in one.plots} == names
    history = run.history[run.history["case_id"] == 3].assign(case_id=77)
    assert {plot.quantity for plot in replay_drawing(run, 77, history).plots} == names
    assert set(case_data(Flown(run, "run"), document.sections).quantities) == names


def test_a_metric_is_drawn_however_small_it_is_beside_others_of_its_unit():
    run = synthetic_run(300, failed=0)
    draw = np.random.Generator(np.random.Philox(key=12)).normal(size=300)
    run.table["navigation_error_m"], run.table["sun_distance_m"] = 0.02 * draw, 1.5e11 * (1.0 + 0.01 * draw)
    for name in ("navigation_error_m", "sun_distance_m"):
        run.manifest["columns"].append({"name": name, "unit": "m", "role": "metric", "description": ""})
    document = build(run, "run")
    assert Flown(run, "run").undrawn("navigation_error_m") == ""
    labels = [plot.x.label for block in blocks_of(document, FigureBlock) for plot in block.drawing.plots]
    assert any(label.startswith("navigation error") for label in labels)


def test_a_model_without_figures_has_its_saved_histories_and_scatters():
    run = peaked(PEAKS)
    run.manifest["figures"] = []
    document = build(run, "run")
    titles = [one.caption for one in blocks_of(document, FigureBlock)]
    assert "Saved time histories" in titles
    assert "Propellant over its strongest contributor, ve." in titles


# ---- footprints


def footprint(target_limit=None, place=(36.0, -5.35)):
    parameters = [{"name": "aim_latitude_deg", "value": place[0]}, {"name": "aim_longitude_deg", "value": place[1]}]
    figure = FOOTPRINT | {"target": ["aim_latitude_deg", "aim_longitude_deg"]}
    changes = {}
    run = landing_run(figures=[figure], parameters=parameters, place=place)
    if target_limit is not None:
        there = run.table[["latitude_deg", "longitude_deg"]].to_numpy()
        run.table["miss_km"] = np.hypot(*LocalPlane(*place).points(*there.T).T) / 1000.0
        run.manifest["columns"].append({"name": "miss_km", "unit": "km", "role": "metric", "description": "miss"})
        one = {"name": "landing", "metric": "miss_km", "at_most": target_limit, "at_least": None, "share": 0.9}
        changes = {"requirements": [*run.manifest["requirements"], {**one, "confidence": 0.9}]}
    run.manifest.update(changes)
    return drawings(build(run, "run"), "footprint")[0]


def test_the_distance_from_the_target_is_the_metric_where_the_model_has_one():
    parameters = [{"name": "aim_latitude_deg", "value": 54.5}, {"name": "aim_longitude_deg", "value": -179.5}]
    run = landing_run(
        figures=[FOOTPRINT | {"target": ["aim_latitude_deg", "aim_longitude_deg"]}], parameters=parameters
    )
    there = run.table[["latitude_deg", "longitude_deg"]].to_numpy()
    geodesic = np.hypot(*LocalPlane(54.5, -179.5).points(*there.T).T) / 1000.0
    # a sphere differs from the ellipsoid by 0.3 %, and a short distance by more of itself
    for factor, more_km, of_metric in ((1.003, 0.0, True), (1.0, 0.1, True), (1.02, 0.0, False)):
        run.table["miss_km"] = factor * geodesic + more_km
        miss = {"name": "miss_km", "unit": "km", "role": "metric", "description": "distance from the target"}
        run.manifest["columns"] = [*landing_run(n=20).manifest["columns"], miss]
        tables = [block for block in section(run, "footprint").blocks if isinstance(block, Table)]
        came_down = (run.table["status"] == "ok") & (run.table["end_altitude_km"] < 30.0)
        told = run.table["miss_km"] if of_metric else geodesic
        assert tables[1].rows[0][2].value == pytest.approx(np.median(told[came_down]), rel=1e-6)
        assert ("the metric miss" in tables[1].note) == of_metric


def test_the_distance_is_the_metric_that_deviates_least_and_each_required_one_has_a_circle():
    parameters = [{"name": "aim_latitude_deg", "value": 54.5}, {"name": "aim_longitude_deg", "value": -179.5}]
    run = landing_run(
        figures=[FOOTPRINT | {"target": ["aim_latitude_deg", "aim_longitude_deg"]}], parameters=parameters
    )
    there = run.table[["latitude_deg", "longitude_deg"]].to_numpy()
    geodesic = np.hypot(*LocalPlane(54.5, -179.5).points(*there.T).T)
    landed = int(np.flatnonzero((run.table["status"] == "ok") & (run.table["end_altitude_km"] < 30.0))[0])
    run.table["range_miss_km"], run.table["miss_m"] = 1.004 * geodesic / 1000.0, geodesic
    run.table.loc[landed, "miss_m"] = np.nan
    run.table["seldom_m"] = np.where(run.table["case_id"] == landed, geodesic, np.nan)
    for name in ("range_miss_km", "seldom_m", "miss_m"):
        unit = name.rsplit("_", 1)[1]
        run.manifest["columns"] = [
            *run.manifest["columns"],
            {"name": name, "unit": unit, "role": "metric", "description": ""},
        ]
    limits = [("miss_m", 30e3), ("range_miss_km", 60.0), ("miss_m", 100e3), ("miss_m", 100e3)]
    run.manifest["requirements"] = [
        {"name": f"r{k}", "metric": name, "at_most": limit, "at_least": None, "share": 0.5 + 0.1 * k, "confidence": 0.9}
        for k, (name, limit) in enumerate(limits)
    ]
    found = section(run, "footprint").blocks
    table = [block for block in found if isinstance(block, Table)][1]
    assert "the metric miss," in table.note
    drawing = next(block.drawing for block in found if isinstance(block, FigureBlock))
    circles = marks_of(drawing, Line, "required")
    (aim,) = marks_of(drawing, Points, "target")
    radii = [np.hypot(line.x - aim.x, line.y - aim.y) for line in circles]
    np.testing.assert_allclose(np.mean(radii, axis=1), [30.0, 60.0, 100.0], rtol=1e-9)
    assert len({line.dash for line in circles}) == 3


def test_the_circular_error_probable_holds_half_of_the_cases_and_the_limit_is_a_circle():
    drawing = footprint(target_limit=40.0)
    circles = {kind: marks_of(drawing, Line, kind)[0] for kind in ("CEP", "required")}
    (aim,) = marks_of(drawing, Points, "target")
    radii = {kind: np.hypot(line.x - aim.x, line.y - aim.y) for kind, line in circles.items()}
    east, north = (values for _, _, values in drawing.places.values())
    inside = np.hypot(east - aim.x, north - aim.y) <= radii["CEP"].mean()
    assert inside.mean() == pytest.approx(0.5, abs=0.01)
    np.testing.assert_allclose(radii["required"], 40.0, rtol=1e-9)
    assert not marks_of(footprint(), Line, "required")


def test_a_coast_in_the_window_is_on_the_map_and_a_far_one_on_a_wider_map():
    strait, ocean = footprint(), footprint(place=(-47.0, -120.0))
    assert len(ocean.plots) == len(strait.plots) + 1
    assert [len(marks_of(one, Line, "coastline")) for one in (strait, ocean)] == [1, 1]
    plane = LocalPlane(-47.0, -120.0)
    assert nearest_coast(plane) / 1000.0 < ocean.plots[-1].y.reach[1]
    for plot in (strait.plots[0], ocean.plots[-1]):
        coast = plot.marks[0]
        inside = [low <= x <= high for x, (low, high) in zip(coast_near(coast), plot.ends, strict=True)]
        assert all(inside)


def coast_near(coast):
    """The coast's point nearest to the middle of the map."""
    assert isinstance(coast, Line)
    nearest = np.nanargmin(np.hypot(coast.x, coast.y))
    return coast.x[nearest], coast.y[nearest]


def test_the_coast_lies_where_it_is():
    # Land’s End, Tarifa and Cape Agulhas to the few kilometres of the data; Null Island is far from land
    for latitude, longitude in ((50.07, -5.72), (36.0, -5.61), (-34.83, 20.0)):
        assert nearest_coast(LocalPlane(latitude, longitude)) < 12e3
    assert nearest_coast(LocalPlane(0.0, 0.0)) > 400e3
    assert coastlines(LocalPlane(0.0, 0.0), 300e3) == []


# ---- diagnostics


def test_rank_correlations_are_those_of_pandas_over_the_cases_with_both_numbers():
    draw = np.random.Generator(np.random.Philox(key=8))
    a = draw.normal(size=400)
    table = np.array([a, a**3 + draw.normal(size=400), np.round(3.0 * draw.normal(size=400) - a), np.abs(a)])
    table[3, :50] = np.nan
    rho, fewest = rank_correlations(table)
    np.testing.assert_allclose(rho, pd.DataFrame(table.T).corr("spearman"), atol=1e-12)
    assert fewest == 350


def test_a_probability_plot_puts_each_case_at_its_rank_and_normal_cases_on_the_line():
    values = np.sort(np.random.Generator(np.random.Philox(key=9)).normal(5.0, 2.0, 3000))
    plot = probability_plot(values, np.arange(3000), "x", "", 0.9, (7.0, 100.0))
    (points,) = [mark for mark in plot.marks if isinstance(mark, Points)]
    (line,) = [mark for mark in plot.marks if isinstance(mark, Line)]
    for x, z in zip(points.x, points.y, strict=True):
        assert stats.norm.cdf(z) == pytest.approx(((values <= x).sum() - 0.375) / 3000.25, abs=1e-12)
    on_line = np.interp(points.y, line.y, line.x)
    assert np.abs(points.x - on_line)[np.abs(points.y) < 2.0].max() < 0.25
    assert [mark.at for mark in plot.marks if isinstance(mark, Limit)] == [7.0]
    assert {0, 1, 2998, 2999} <= set(shown_ranks(3000).tolist())
    assert shown_ranks(3000).size < 200
    assert plotting_positions(3)[1] == 0.0


def test_every_new_section_of_a_report_has_its_figure():
    run = synthetic_run(600, failed=3)
    (matrix,) = section(run, "correlations").blocks
    cells = next(mark for mark in matrix.drawing.plots[0].marks if isinstance(mark, Bar))
    whole = run.table[run.table["status"] == "ok"]
    expected = whole["peak_force_n"].corr(whole["ve_pct"], method="spearman")
    told = dict(text.rsplit(": ", 1) for text in cells.texts)
    name = next(one for one in told if set(one.split(", ")) == {"ve", "peak force"})
    assert float(told[name].replace("−", "-")) == pytest.approx(expected, abs=0.006)
    assert len(section(run, "normality").blocks[0].drawing.plots) >= 3
