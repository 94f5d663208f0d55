"""The comparison of two runs as a page and as a PDF."""

import warnings
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from synthetic_run import COLUMNS, kept, synthetic_run

from mc_engine.errors import StoreError
from mc_engine.studies.comparison import compare_runs
from reports.document.blocks import FigureBlock, Table, blocks_of
from reports.drawing.marks import Points
from reports.drawing.ticks import axis_ticks
from reports.formats.html import render_html
from reports.run import all_cases
from reports.studies.comparison import build_comparison, write_comparison
from reports.text.numbers import count

INJECTION = "<script>alert(1)</script>"


def compared(shift=0.0, seed=1, n=400, failed=3, text="", names=("before", "after")):
    runs = []
    for own, moved, words in ((1, 0.0, "[campaign]"), (seed, shift, text or "[campaign]")):
        made = synthetic_run(n, failed=min(failed, n), seed=own)
        made.table["peak_force_n"] += moved
        made.campaign_text = words
        runs.append(made)
    return compare_runs(*runs, names)


def tables(document):
    return {table.caption: table for table in blocks_of(document, Table)}


def test_the_headline_says_what_changed_and_the_table_by_how_much():
    found = compared(shift=8.0, seed=2)
    document = build_comparison(found)
    assert document.subtitle.endswith("chance of any false alarm).")
    assert [(card.label, card.tone) for card in document.verdicts][:2] == [("Requirements", ""), ("Shift", "")]
    (row,) = [row for row in tables(document)["Metrics of both runs"].rows if row[0].text.startswith("peak force")]
    assert (row[4].text[-2:], row[4].tone) == ("\u202f*", "")  # a change alone is neither good nor bad
    change = next(one for one in found.metrics if one.metric == "peak_force_n")
    assert row[3].value == pytest.approx(change.shift.value / change.deviation[0])
    (figure,) = blocks_of(document, FigureBlock)
    assert "peak force" in figure.drawing.alternative


def test_outlines_of_selected_cases_say_so(tmp_path, monkeypatch):
    """They looked like the distributions of all cases."""
    runs = [synthetic_run(4000, failed=0, seed=seed) for seed in (1, 2)]
    stores = [kept(tmp_path / name, run.manifest, run.table) for run, name in zip(runs, "ab", strict=True)]
    monkeypatch.setattr(all_cases, "MOST_CELLS", 2000 * len(COLUMNS))
    figures = blocks_of(build_comparison(compare_runs(*stores, ("before", "after")), tuple(stores)), FigureBlock)
    (figure,) = [figure for figure in figures if figure.caption.startswith("Distributions")]
    these = f"{count(2000)} cases picked evenly from {count(4000)}"
    assert figure.caption.endswith(f" Outlines of run A: {these}. Outlines of run B: {these}.")


def test_a_large_change_within_chance_stands_below_a_small_one_beyond_it():
    found = compared(shift=8.0, seed=2)
    scattered, moved = (
        next(one for one in found.metrics if one.metric == name) for name in ("settling_time_s", "peak_force_n")
    )
    chance = replace(scattered, ratio=replace(scattered.ratio, value=50.0), shift_adjusted=1.0, spread_adjusted=1.0)
    assert chance.effect > moved.effect
    metrics = [chance if one is scattered else one for one in found.metrics]
    rows = tables(build_comparison(replace(found, metrics=metrics)))["Metrics of both runs"].rows
    place = {name: k for k, row in enumerate(rows) for name in ("peak force", "settling time") if name in row[0].text}
    assert place["peak force"] < place["settling time"]


def two_runs(tmp_shift):
    """Runs that fly the same cases; in B all are inside the limit on force, and a metric without spread has moved."""
    runs = []
    for limit, moved in ((20.0, 0.0), (1e3, tmp_shift)):
        made = synthetic_run(1200, failed=0)
        made.manifest["requirements"][1]["at_most"] = limit
        made.table["entry_speed_m_s"] = 7800.0 + 1e-6 * made.table["ve_pct"] + 1e-3 * moved
        made.table["settling_time_s"] += moved
        made.campaign_text = "[campaign]"
        runs.append(made)
    return runs


def test_requirements_come_first_and_in_words():
    a, b = two_runs(1.0)
    found = compare_runs(a, b, ("before", "after"))
    document = build_comparison(found, (a, b))
    assert document.sections[0].anchor == "requirements"
    passed = [int((run.table["peak_force_n"] <= limit).sum()) for run, limit in ((a, 20.0), (b, 1e3))]
    card = document.verdicts[0]
    assert (card.label, card.answer, card.tone) == ("force", "fail → pass", "good")
    counts = f"{passed[0]:,} → {passed[1]:,} of {len(a.table):,}".replace(",", "\u202f")
    assert card.detail == f"{counts} cases inside; in B the limit is different"
    assert "force: fail → pass" in document.subtitle
    assert dict(document.facts)["Cases"] == "Paired: 1\u202f200 cases have the same inputs in both runs"
    tones = {row[0].text: (row[2].text, row[2].tone) for row in next(iter(tables(document).values())).rows}
    assert tones["force"] == ("pass", "good")
    assert tones["all at once"] == ("fail", "bad")  # as before; it is no less a failure for that


def test_shifts_of_thousands_of_sigma_and_of_a_few_are_both_seen_in_the_figure():
    a, b = two_runs(1.0)
    b.table["peak_force_n"] += 5000.0 * a.table["peak_force_n"].std()
    document = build_comparison(compare_runs(a, b, ("before", "after")))
    (figure,) = blocks_of(document, FigureBlock)
    plot = figure.drawing.plots[0]
    assert plot.title.splitlines() == ["Shift [σ of run A]", "logarithmic beyond 1 σ"]
    marks = [mark for mark in plot.marks if isinstance(mark, Points)]
    places = sorted(abs(place) / plot.x.reach[1] for mark in marks for place in mark.x)
    assert len(places) == 3
    assert places[0] > 0.03  # a third of a σ
    assert places[-1] < 1.0
    ticks = {text: place for place, text in plot.x.ticks}
    assert 0.0 == ticks["0"] < ticks["1"] < ticks["10"] < ticks["1000"] < plot.x.reach[1]
    assert "peak force: 5000" in figure.drawing.alternative
    rows = tables(document)["Metrics of both runs"].rows
    names = [row[0].text.split(" [")[0].split("\u202f")[0] for row in rows]
    assert names == ["peak force", "entry speed", "settling time"]


def test_many_changes_are_drawn_in_panels_that_find_room_on_a_page_that_is_begun():
    runs = []
    for seed in (1, 2):
        made = synthetic_run(300, seed=seed)
        draws = np.random.Generator(np.random.Philox(key=seed)).normal(size=(30, 300))
        for k, values in enumerate(draws):
            made.table[f"error_{k}_m"] = values
            made.manifest["columns"].append({"name": f"error_{k}_m", "unit": "m", "role": "metric", "description": ""})
        runs.append(made)
    document = build_comparison(compare_runs(*runs, ("before", "after")))
    (drawing,) = [one.drawing for one in blocks_of(document, FigureBlock) if one.drawing.form.startswith("Changes")]
    rows = [text for plot in drawing.plots[::2] for _, text in plot.y.ticks]
    assert len(rows) == len(set(rows)) > 30
    assert max(len(plot.y.ticks) for plot in drawing.plots) <= 18
    for kind in (drawing.plots[::2], drawing.plots[1::2]):
        assert len({plot.x.reach for plot in kind}) == 1


def test_both_runs_are_laid_over_one_another_with_the_counts_of_the_table():
    a, b = two_runs(1.0)
    document = build_comparison(compare_runs(a, b, ("before", "after")), (a, b))
    section = next(one for one in document.sections if one.anchor == "overlays")
    distribution = section.blocks[0].drawing.plots[1]
    assert distribution.x.label == "settling time [s]"
    for mark, run in zip(distribution.marks, (a, b), strict=True):
        values, edges = run.table["settling_time_s"], np.unique(mark.x)
        assert mark.y[1:-1:2] == pytest.approx(np.histogram(values, edges)[0] / 1200)
    keys = {mark.key[:5] for panel in section.blocks[1].drawing.plots for mark in panel.marks}
    assert keys == {"run A", "run B"}
    page = render_html(document).decode()
    assert "run B: fraction of the cases" in page


def test_a_run_with_few_histories_is_not_drawn_as_one_without_spread_beside_the_other():
    a, b = two_runs(1.0)
    one = a.history[a.history["case_id"] == 0]
    nominal = a.history[a.history["case_id"] == -1]
    a.history = pd.concat([nominal, *(one.assign(case_id=case) for case in range(30))])
    b.history = b.history[b.history["case_id"] < 3].copy()  # too few for envelopes
    document = build_comparison(compare_runs(a, b, ("before", "after")), (a, b))
    section = next(one for one in document.sections if one.anchor == "overlays")
    keys = {mark.key for panel in section.blocks[1].drawing.plots for mark in panel.marks}
    assert keys == {"run A: nominal", "run B: nominal"}


def test_rounding_errors_of_nominal_cases_are_not_drawn_over_one_another():
    a, b = two_runs(1.0)
    for seed, run in enumerate((a, b)):
        keep = run.history["case_id"] < 3  # too few for envelopes
        run.history = run.history[keep].copy()
        nominal = run.history["case_id"] == -1
        assert nominal.any()
        run.history.loc[nominal, "force_n"] = 1e-13 * np.random.default_rng(seed).random(nominal.sum())
    document = build_comparison(compare_runs(a, b, ("before", "after")), (a, b))
    section = next(one for one in document.sections if one.anchor == "overlays")
    labels = [panel.y.label for panel in section.blocks[1].drawing.plots]
    assert "position error [m]" in labels
    assert "force [N]" not in labels
    assert section.blocks[2].paragraphs == ("Not drawn, rounding errors only in both nominal cases: force_n.",)


def test_an_angle_that_jumps_by_a_turn_in_one_of_the_runs_is_a_warning():
    """A course of 0 deg ± 5 deg, whose mean is no course of any case, was compared without a word."""
    runs = two_runs(0.0)
    runs[1].table["entry_flight_path_angle_deg"] = np.linspace(355.0, 365.0, 1200) % 360.0
    (told,) = build_comparison(compare_runs(*runs, ("before", "after")), tuple(runs)).warnings
    assert told.startswith("Run B, entry flight path angle: the cases lie near both ends of a full turn")


def test_the_same_run_twice_has_no_figure_and_says_so():
    document = build_comparison(compared())
    assert document.subtitle.startswith("No significant change")
    assert not list(blocks_of(document, FigureBlock))
    page = render_html(document).decode()
    assert "The same in both runs, in the cases with a number in both: correction impulse" in page
    assert "Code: the same in both runs." in page


@pytest.mark.parametrize(("n", "failed"), [(0, 0), (1, 0), (2, 0), (40, 40)])
def test_few_cases_and_failed_ones_make_a_page_without_a_warning(n, failed, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = compared(shift=1.0, seed=2, n=n, failed=failed)
        write_comparison(found, tmp_path / "compare.html")
        write_comparison(found, tmp_path / "compare.pdf")
    assert (tmp_path / "compare.html").stat().st_size > 10_000


def test_names_and_campaign_lines_stay_text():
    page = render_html(build_comparison(compared(text=INJECTION, names=(INJECTION, "b")))).decode()
    assert INJECTION not in page
    assert page.count("&lt;script&gt;alert(1)&lt;/script&gt;") >= 2


@pytest.mark.parametrize(
    ("names", "shown"),
    [
        (("/data/runs/a", "/data/runs/b"), ("a", "b")),
        (("/data/old/run", "/data/new/run"), ("old/run", "new/run")),
        (("runs/a", "https://host/b"), ("runs/a", "https://host/b")),
        (("/data/a", "/data/a"), ("a", "a")),
    ],
)
def test_a_comparison_names_its_runs_without_the_path_of_a_disk(names, shown):
    document = build_comparison(compared(names=names))
    assert [value.split(": ")[0] for _, value in document.facts[:2]] == list(shown)
    assert "/data" not in repr(document)


def test_a_mean_that_a_few_extreme_cases_move_is_not_said_to_be_the_same():
    """The test of the shift is one of ranks: the page said that no mean had changed."""
    run, other = synthetic_run(400, failed=0), synthetic_run(400, failed=0, seed=2)
    other.table.loc[:1, "peak_force_n"] += 1e5
    found = compare_runs(run, other, ("before", "after"))
    change = next(one for one in found.metrics if one.metric == "peak_force_n")
    assert change.mean[1] - change.mean[0] > 10.0 * change.deviation[0]
    assert not found.shifted
    told = {card.label: (card.answer, card.detail) for card in build_comparison(found).verdicts}
    assert told["Shift"] == ("none significant", f"none of {len(found.metrics)} metrics")


def test_a_metric_without_a_number_is_not_counted_among_those_without_a_change():
    run, other = synthetic_run(400, failed=0), synthetic_run(400, failed=0, seed=2)
    for one in (run, other):
        one.table["settling_time_s"] = np.nan
    found = compare_runs(run, other, ("before", "after"))
    assert found.absent == ("settling_time_s",)
    told = {card.label: card.detail for card in build_comparison(found).verdicts}
    assert told["Spread"] == f"none of {len(found.metrics) - 1} metrics"


def test_the_mean_of_each_run_has_the_digits_of_its_own_spread():
    found = compared(shift=9000.0)
    change = next(one for one in found.metrics if one.metric == "peak_force_n")
    wide = replace(change, mean=(0.0355, 9433.6055), deviation=(0.0201, 5000.0))
    metrics = [wide if one is change else one for one in found.metrics]
    rows = tables(build_comparison(replace(found, metrics=metrics)))["Metrics of both runs"].rows
    (row,) = [row for row in rows if "peak force" in row[0].text]
    assert [cell.text for cell in row[1:3]] == ["0.0355", "9434"]


def test_page_and_pdf_are_the_same_bytes_twice(tmp_path):
    found = compared(shift=8.0, seed=2)
    for name in ("compare.html", "compare.pdf"):
        first = write_comparison(found, tmp_path / name).read_bytes()
        assert write_comparison(found, tmp_path / name).read_bytes() == first
    assert sorted(path.name for path in tmp_path.iterdir()) == ["compare.html", "compare.pdf"]


def test_a_folder_that_is_not_there_is_said(tmp_path):
    with pytest.raises(StoreError, match="No such file"):
        write_comparison(compared(), tmp_path / "none" / "compare.html")


@pytest.mark.parametrize("span", [(0.97, 1.02), (0.8, 1.1), (0.5, 3.0), (0.1, 8.0), (1e-4, 1e3)])
def test_the_ticks_of_a_ratio_lie_inside_and_hold_one(span):
    ticks = axis_ticks(*span, 6, log=True)
    assert 1.0 in ticks
    assert 2 <= len(ticks) <= 9
    assert np.all(np.diff(ticks) > 0.0)
    assert span[0] <= ticks[0] <= ticks[-1] <= span[1]


def test_a_significant_change_that_ties_hide_has_no_size_of_no_change():
    runs = []
    for pulses in (0.1, 0.3):  # of most cases there is none in both runs
        made = synthetic_run(1000, failed=0, seed=len(runs) + 1)
        draws = np.random.Generator(np.random.Philox(key=7)).random(1000)
        made.table["settling_time_s"] = np.where(draws < pulses, 1.0, 0.0)
        runs.append(made)
    found = compare_runs(*runs, ("before", "after"))
    change = next(one for one in found.metrics if one.metric == "settling_time_s")
    assert change.shift_adjusted <= found.alpha
    assert abs(change.shift.upper) < 1e-6
    rows = tables(build_comparison(found))["Metrics of both runs"].rows
    (row,) = [row for row in rows if row[0].text.startswith("settling time")]
    assert (row[3].text, row[3].small, row[4].text[-2:]) == ("–", "ties", "\u202f*")


def test_the_largest_and_the_smallest_of_few_cases_are_in_the_distributions():
    runs = synthetic_run(40, failed=0), synthetic_run(40, failed=0, seed=2)
    for made in runs:
        made.campaign_text = "[campaign]"
    document = build_comparison(compare_runs(*runs, ("a", "b")), runs)
    (figure,) = [
        block for block in blocks_of(document, FigureBlock) if block.caption.startswith("Distributions of the metrics")
    ]
    for plot in figure.drawing.plots:
        for line in plot.marks:
            assert line.y[1:-1:2].sum() == pytest.approx(1.0)
