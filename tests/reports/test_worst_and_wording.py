"""What a reader acts on: the bad end of a two-sided metric, the inputs that matter, both outcomes, the words."""

import re
from pathlib import Path

import numpy as np
import pytest
from figure_marks import classes, marks_of
from synthetic_run import synthetic_run

import reports
from mc_engine.model.figures import MapFigure, ScatterFigure, to_record
from mc_engine.statistics.first_order import contributors
from mc_engine.statistics.maps import explained_share
from mc_engine.statistics.worst import Limits, limits_on
from reports.contents import build
from reports.document.blocks import FigureBlock, Table, blocks_of
from reports.drawing import screen
from reports.drawing.marks import Line, Points
from reports.figures.clouds import FEWER
from reports.sections.figure_blocks import FEWEST_SHOWN
from reports.text.numbers import column_texts

METRIC = "correction_impulse_m_s"  # here: an error of either sign


def requirement(name, metric, at_most, at_least, share=0.9):
    return {"name": name, "metric": metric, "at_most": at_most, "at_least": at_least, "share": share, "confidence": 0.9}


def two_sided(n=4000, **changes):
    """A run whose impulse is 0.5 VE - 1 by its inputs, required within ±8: its lower tail is the bad one."""
    made = synthetic_run(n, failed=0, requirements=[requirement("impulse", METRIC, 8.0, -8.0)], **changes)
    made.table[METRIC] = 0.5 * made.table["ve_pct"] - 1.0 + 1e-3 * made.table["oe_pct"]
    return made


def block(document, kind, caption):
    return next(one for one in blocks_of(document, kind) if one.caption.startswith(caption))


def scatter(run, x="ve_pct", y="oe_pct"):
    run.manifest["figures"] = [to_record(ScatterFigure(x, y, "Plane"))]
    return block(build(run, "run"), FigureBlock, "Plane")


def test_the_headline_of_a_two_sided_metric_names_both_ends_and_its_limits():
    run = two_sided(500)
    values = run.table[METRIC]
    card = next(one for one in build(run, "run").costs if one.label == "correction impulse")
    seen = re.search(r"([−\d.]+) to ([−\d.]+)\u202fm/s in the cases flown", card.answer).groups()
    low, high = (float(one.replace("−", "-")) for one in seen)
    assert (low, high) == pytest.approx((values.min(), values.max()), abs=5e-3)
    assert card.answer.endswith(", limits ±8\u202fm/s")
    assert "at most" not in card.answer


def test_a_metric_that_fails_one_of_its_requirements_comes_before_one_that_passes_all():
    run = two_sided()
    run.table["other_m"] = np.arange(len(run.table), dtype=np.float64)
    run.manifest["columns"].append({"name": "other_m", "unit": "m", "role": "metric", "description": "other"})
    run.manifest["requirements"] = [
        requirement("wide", "other_m", 1e6, -1e6),
        requirement("tight", METRIC, 0.1, -0.1),
        requirement("loose", METRIC, 1e6, -1e6),
    ]
    captions = [table.caption for table in blocks_of(build(run, "run"), Table)]
    worst = [caption for caption in captions if caption.startswith("Cases with")]
    assert ["correction impulse" in caption for caption in worst[:2]] == [True, False]


def test_the_worst_cases_of_a_two_sided_metric_have_the_smallest_margin_and_its_strongest_inputs():
    run = two_sided()
    run.table.insert(3, "area_factor", np.random.default_rng(3).normal(size=len(run.table)))
    run.manifest["columns"].insert(
        3, {"name": "area_factor", "unit": "", "role": "dispersion", "description": "no use"}
    )
    table = block(build(run, "run"), Table, "Cases with the smallest margin of correction impulse")
    margin = np.minimum(8.0 - run.table[METRIC], run.table[METRIC] + 8.0)
    expected = run.table["case_id"][np.argsort(margin, kind="stable")[:5]].tolist()
    assert [row[0].value for row in table.rows] == expected
    assert [row[2].value for row in table.rows] == pytest.approx(np.sort(margin)[:5].tolist())
    assert [column.title for column in table.columns[3:6]] == ["ve [%]", "oe [%]", "area factor"]


def test_worst_cases_with_one_value_are_not_printed_as_another_beside_their_limit():
    """Five cases at their limit of −1234.5678 were printed as −1235, inside it by 0.43, with a margin of 0."""
    run = two_sided()
    run.table[METRIC] = -1234.5678 - np.maximum(0.0, run.table["ve_pct"])
    run.manifest["requirements"] = [requirement("end", METRIC, -1234.5678, None)]
    table = block(build(run, "run"), Table, "Cases with the largest correction impulse")
    assert {tuple(cell.text for cell in row[1:3]) for row in table.rows} == {("−1234.5678", "0")}


def test_a_worst_case_just_beyond_its_limit_is_not_printed_as_the_limit():
    """−4.96 beside cases down to −30 was printed as −5.0, the limit, with a margin of 0.0."""
    run = two_sided()
    run.table[METRIC] = [-4.96, -12.3, -19.4, -25.2, -30.1, *np.linspace(-40.0, -50.0, len(run.table) - 5)]
    run.manifest["requirements"] = [requirement("end", METRIC, -5.0, None)]
    table = block(build(run, "run"), Table, "Cases with the largest correction impulse")
    assert [row[1].text for row in table.rows] == ["−4.96", "−12.30", "−19.40", "−25.20", "−30.10"]
    assert table.rows[0][2].text == "−0.04"


def test_a_margin_counts_to_the_nearest_of_all_limits_on_the_metric():
    records = [requirement("a", "y", 5.0, -5.0), requirement("b", "y", 3.0, None), requirement("c", "z", 1.0, None)]
    assert limits_on("y", records) == Limits(3.0, -5.0)
    values = np.array([2.0, -4.0, np.nan, 3.5])
    assert limits_on("y", records).margins(values) == pytest.approx([1 / 4, 1 / 4, np.nan, -0.5 / 4], nan_ok=True)
    assert not Limits(5.0, -5.0).largest_is_worst(np.array([-3.9, -1.8]))
    assert Limits(None, 2.0).margins(np.array([3.0])) == pytest.approx(0.5)


@pytest.mark.parametrize(
    "values",
    [[-2.0001, -2.00012, -2.00017], [1e-9, 1.1e-9, 3e-9], [123456.0, 123456.4], [1e8, 1e8 + 1], [0.0, -0.0, 1e-7, 5.0]],
)
def test_values_that_differ_never_print_alike(values):
    texts = column_texts(values)
    assert len(set(texts)) == len({value + 0.0 for value in values})
    assert column_texts([2.0, 2.0]) == ["2", "2"]
    assert column_texts([None, float("nan"), 1.0])[:2] == ["–", "not a number"]


@pytest.mark.parametrize("share", [0.003, 0.08, 0.5, 0.92])
def test_both_outcomes_are_drawn_in_proportion_and_the_larger_one_beneath(share):
    run = synthetic_run(10_000, failed=0)
    limit = float(run.table["propellant_kg"].quantile(share))
    run.manifest["requirements"] = [requirement("fuel", "propellant_kg", limit, None)]
    drawing = scatter(run).drawing
    n = [int((run.table["propellant_kg"] <= limit).sum()), int((run.table["propellant_kg"] > limit).sum())]
    assert sorted(classes(drawing).values()) == sorted(n)
    clouds = [mark for mark in marks_of(drawing, Points) if mark.cases is not None]
    shown = [one.x.size for one in sorted(clouds, key=lambda one: not one.name.startswith("inside"))]
    for k in (0, 1):
        assert shown[k] >= min(FEWEST_SHOWN, n[k])
        if n[k] >= 5 * FEWEST_SHOWN:
            assert shown[k] / n[k] == pytest.approx(0.2, abs=0.01)
    assert clouds[0].name.startswith("inside") == (n[0] >= n[1])
    beneath, above = screen.specifications(drawing)[0]["data"][:2]
    assert beneath["marker"]["opacity"] < above["marker"]["opacity"]


def test_few_cases_are_drawn_large_enough_to_be_seen():
    drawing = scatter(synthetic_run(20, failed=0)).drawing
    clouds = [mark for mark in marks_of(drawing, Points) if mark.cases is not None]
    assert {(cloud.size, cloud.opacity) for cloud in clouds} == {FEWER}


def test_a_normal_ellipse_that_leaves_the_physical_range_is_left_out():
    run = synthetic_run(2000, failed=0)
    inside = scatter(run, METRIC, "settling_time_s")
    assert any("ellipse" in line.text for line in marks_of(inside.drawing, Line))
    run.manifest["ranges"] = {METRIC: [0.0, None]}
    bounded = scatter(run, METRIC, "settling_time_s")
    regions = marks_of(bounded.drawing, Line)
    assert regions
    assert not any("ellipse" in region.text for region in regions)
    assert "physical range" in bounded.caption
    assert min(np.nanmin(region.x) for region in regions) >= 0.0
    lowest = min(np.nanmin(region.x) for region in marks_of(inside.drawing, Line))
    assert lowest < 0.0 <= run.table[METRIC].min()


def test_a_map_of_two_inputs_that_explain_little_is_a_sentence_that_names_those_that_do():
    run = synthetic_run(3000, failed=0)
    rng = np.random.default_rng(8)
    for name in ("wind_factor", "mass_factor"):
        run.table.insert(3, name, rng.normal(size=3000))
        run.manifest["columns"].insert(3, {"name": name, "unit": "", "role": "dispersion", "description": name})
    wind, mass = run.table["wind_factor"], run.table["mass_factor"]
    run.table["entry_speed_m_s"] = wind * mass + wind + mass + 0.05 * run.table["ve_pct"]
    run.manifest["figures"] = [to_record(MapFigure("entry_speed_m_s", "ve_pct", "oe_pct", "Noise"))]
    run.manifest["figures"] += [to_record(MapFigure("entry_speed_m_s", "wind_factor", "mass_factor", "Signal"))]
    section = next(one for one in build(run, "run").sections if one.anchor == "maps")
    said = " ".join(text for one in section.blocks for text in getattr(one, "paragraphs", ()))
    assert re.search(r"Noise: not drawn; ve and oe together explain \d\u202f% of the variance of entry speed", said)
    assert "the two inputs that explain most are" in said
    assert {"wind factor", "mass factor"} <= set(re.findall(r"(\w+ factor)", said))
    (drawn,) = [one for one in section.blocks if getattr(one, "drawing", None)]
    assert drawn.caption.startswith("Signal")
    assert explained_share(wind.to_numpy(), mass.to_numpy(), run.table["entry_speed_m_s"].to_numpy()) > 0.95


def test_two_inputs_that_act_only_together_are_found_to_explain_most():
    """Neither has a first-order effect: by that alone, two idle inputs were said to explain most, namely 0 %."""
    run = synthetic_run(1500, failed=0)
    rng = np.random.default_rng(2)
    names = [f"idle_{word}" for word in ("one", "two", "three", "four", "five", "six")] + ["wind_factor", "mass_factor"]
    for name in names:
        run.table[name] = rng.normal(size=1500)
        run.manifest["columns"].append({"name": name, "unit": "", "role": "dispersion", "description": name})
    run.table["propellant_kg"] = run.table["wind_factor"] * run.table["mass_factor"]
    run.manifest["figures"] = [to_record(MapFigure("propellant_kg", "ve_pct", "oe_pct", "Idle"))]
    blocks = build(run, "run").sections
    said = " ".join(text for one in blocks for block in one.blocks for text in getattr(block, "paragraphs", ()))
    (pair,) = re.findall(r"the two inputs that explain most are (\w+) factor and (\w+) factor, 100\u202f%", said)
    assert set(pair) == {"wind", "mass"}
    (worst,) = [block for one in blocks for block in one.blocks
                if getattr(block, "caption", "") == "Cases with the largest propellant"]  # fmt: skip
    assert {column.title for column in worst.columns[3:5]} == {"wind factor", "mass factor"}


def test_contributors_come_by_the_variance_that_they_explain():
    rng = np.random.default_rng(1)
    inputs = {name: rng.normal(size=5000) for name in ("a", "b", "c")} | {"same": np.ones(5000)}
    found = contributors(inputs, 1.0 * inputs["a"] + 3.0 * inputs["b"])
    assert [one.name for one in found] == ["b", "a", "c"]
    assert [one.share for one in found] == pytest.approx([0.9, 0.1, 0.0], abs=0.03)
    assert [one.name for one in contributors(inputs, inputs["c"][:5000] * np.nan)] == []


STRUCK = (
    "What drives it", "Share shown", "Limit shown", "One against another", "Published and ours", "What does it cost",
    "Will it work", "to its end", "to their end", "really holds", "normal cloud", "looked at after",
    "free of distribution", "foretell", "How the cases ended", "Choices compared", "What was asked", "stands beside",
    "went astray", "go astray", "any shape", "driver", "unless said", "held against", "in any company",
    "in other company", "refused with a sentence", "no problems", "Whoever flies", "verbs?", "VERB",
    "share of a bin", "share of success", "mean place",
)  # fmt: skip
OF_CARDS = ("cards.py", "cards.md", "card_code.py")  # NVIDIA's driver


def test_the_struck_words_are_in_no_text_that_a_person_reads():
    """In what reports and messages say, in the sources of texts and templates, in the help and the documentation."""
    root = Path(reports.__file__).parents[1]
    sources = [path for folder in ("reports", "mc_engine") for path in (root / folder).rglob("*.py")]
    sources += [*(root / "reports/templates").glob("report.*"), root / "README.md"]
    sources += [*(root / "mc_engine/documentation").rglob("*.md")]
    assert len(sources) > 250
    for path in sources:
        text = path.read_text(encoding="utf-8")
        found = re.findall(r'"((?:[^"\\\n]|\\.)*)"', text) if path.suffix == ".py" else [text]
        texts = [re.sub(r"\{[^{}]*\}", "", one) for one in found]
        for words in STRUCK:
            if words == "driver" and path.name in OF_CARDS:
                continue
            assert not [one for one in texts if re.search(rf"\b{words}\b", one)], (path.name, words)
