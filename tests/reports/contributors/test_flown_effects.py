"""The section and the data of a run that flew further cases for its contributors."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from synthetic_run import synthetic_run

import mc_engine
from mc_engine import open_store
from mc_engine.statistics.pick_freeze import layout_of, pick_freeze
from reports.contents import build
from reports.contributors.companion import companion_blocks, sigma_contribution
from reports.document.blocks import Table, blocks_of
from reports.formats.json_data import render_json
from reports.formats.markdown import render_markdown
from reports.run.chosen_units import spread_text
from reports.run.contributions import Contributions, Contributor, _ranked
from reports.run.default_figures import scatter_figures
from reports.run.flown import Flown

MODEL = Path(__file__).parents[2] / "mc_engine" / "runner" / "contributions" / "model.py"
HEAD = '[campaign]\nmodel = "model.py"\ncases = 60\ndesign = "mc"\nseed = 3\n[sensitivity]\ncases = 256\n'
INPUTS = "".join(
    f'[dispersion.{name}]\ndist = "uniform"\nlower = 0.0\nupper = 1.0\n' for name in ("x1", "x2", "x3", "x4")
)
LINE = '[requirement.line]\nmetric = "line"\nat_most = 9.0\nshare = 0.9\n'


def test_the_data_hold_the_effects_on_metrics_without_a_requirement_too(tmp_path):
    shutil.copy(MODEL, tmp_path)
    (tmp_path / "campaign.toml").write_text(HEAD + INPUTS + LINE)
    run = mc_engine.run(mc_engine.load_campaign(tmp_path / "campaign.toml"), tmp_path / "run", workers=1)
    document = build(run, "run")
    effects = {}
    for row in json.loads(render_json(document))["contributors"]:
        effects.setdefault(row["metric"], []).append((row["input"], row["total"]))
    assert [*effects] == ["line", "ishigami", "sobol_g", "noise", "scaled"]
    assert effects["noise"][0][0] == "random draws"
    assert {name for name, total in effects["sobol_g"] if total > 0.1} == {"x1", "x2"}
    (table,) = [one for one in blocks_of(document, Table) if one.caption.startswith("Contributors to each metric")]
    assert {row[0].text for row in table.rows} == {"line"}
    assert "The effects on 4 other metrics are in report.json." in render_markdown(document).decode()


def test_effects_and_their_intervals_are_possible_ones(tmp_path):
    """From 32 blocks some estimates are below 0 or above 1 by chance."""
    shutil.copy(MODEL, tmp_path)
    (tmp_path / "campaign.toml").write_text(HEAD.replace("256", "32") + INPUTS + LINE)
    run = mc_engine.run(mc_engine.load_campaign(tmp_path / "campaign.toml"), tmp_path / "run", workers=1)
    rows = json.loads(render_json(build(run, "run")))["contributors"]
    for row in rows:
        for name in ("first", "total"):
            low, high = row[f"{name}_interval"]
            assert 0.0 <= low <= row[name] <= high <= 1.0
    store = open_store(tmp_path / "run" / "sensitivity")
    cases = store.cases()
    names = [column.name for column in store.columns if column.role == "metric"]
    values = {name: cases[name].to_numpy() for name in names}
    estimates = pick_freeze(layout_of(store.manifest["sensitivity"]), cases["case_id"].to_numpy(), values)
    below = [(estimates.metrics[k], estimates.groups[g]) for g, k in np.argwhere(estimates.first < -0.01)]
    assert below
    for row in rows:
        if (row["metric"], row["input"]) in below:
            assert row["first"] == 0.0 < row["first_interval"][1]


def test_an_input_is_not_called_the_strongest_contributor_where_the_random_draws_are_stronger():
    draws = Contributor("propellant_kg", "random draws", 1.0, 0.99, (1.0, 1.0), (0.95, 1.0))
    ve = Contributor("propellant_kg", "ve_pct", 0.1, 0.2, (0.05, 0.15), (0.15, 0.25))
    run, titles = synthetic_run(300, failed=0), []
    run.manifest["figures"] = []
    for rows in ((draws, ve), (ve, draws)):
        flown = Flown(run, "run")
        flown.contributions = Contributions(
            {"propellant_kg": rows}, 300, {}, {}, {"random draws": [], "ve_pct": ["ve_pct"]}
        )
        titles.append(next(figure.title for figure in scatter_figures(flown) if figure.y == "propellant_kg"))
    assert titles == ["Propellant over ve", "Propellant over its strongest contributor, ve"]


def test_of_the_cases_of_another_run_the_input_that_matters_stands_for_their_effect(tmp_path):
    """The group of these cases had no inputs: a metric was drawn over the only other one, that explains nothing."""
    shutil.copy(MODEL, tmp_path)
    (tmp_path / "first.toml").write_text(HEAD.replace("60", "200").replace("256", "32") + INPUTS + LINE)
    first = mc_engine.load_campaign(tmp_path / "first.toml")
    mc_engine.run(first, tmp_path / "first", workers=1)
    own = INPUTS[INPUTS.index("[dispersion.x4]") :]
    taken = '[inputs]\nfrom = "first"\n[inputs.columns]\nx1 = "scaled"\nx3 = "line"\n'
    head = HEAD.replace("cases = 60\n", "").replace("seed = 3", "seed = 4")
    (tmp_path / "second.toml").write_text(head + own + taken + LINE)
    run = mc_engine.run(mc_engine.load_campaign(tmp_path / "second.toml"), tmp_path / "second", workers=1)
    flown = Flown(run, "run")
    assert flown.contributions.by_metric["line"][0].input == "cases of first"
    assert next(contributor.name for contributor in flown.contributors("line")) == "x3"
    titles = [figure.title for figure in scatter_figures(flown) if figure.y == "line"]
    assert titles == ["Line over its strongest contributor, x3"]


def test_the_note_bounds_the_columns_that_are_bounded_and_no_others():
    """A variance may grow where an input that interacts is held at its nominal value."""
    row = Contributor("propellant_kg", "ve_pct", 0.4, 0.9, (0.3, 0.5), (0.8, 1.0), -0.25, (-0.4, -0.1))
    flown = Flown(synthetic_run(300), "run")
    rows = {metric: () for metric in flown.key_metrics} | {"propellant_kg": (row,)}
    found = Contributions(rows, 768, dict.fromkeys(rows, 128), 128, {})
    table = next(block for block in companion_blocks(flown, found) if isinstance(block, Table))
    values = {column.title: cell.value for column, cell in zip(table.columns, table.rows[0], strict=True)}
    assert values["Variance reduction at nominal"] == -0.25
    assert "First-order and total effects and their intervals are within 0 to 1." in table.note
    assert "Effects and intervals are" not in table.note


def test_a_first_order_effect_without_a_total_effect_is_chance():
    """Of many inputs without any effect, one has a first-order effect whose interval excludes zero."""
    sure = Contributor("propellant_kg", "ve_pct", 1.0, 0.9, (0.9, 1.0), (0.8, 1.0))
    chance = Contributor("propellant_kg", "oe_pct", 0.02, 0.0, (0.001, 0.04), (0.0, 0.002))
    flown = Flown(synthetic_run(300), "run")
    rows = {metric: () for metric in flown.key_metrics} | {"propellant_kg": (sure, chance)}
    found = Contributions(rows, 768, dict.fromkeys(rows, 128), 128, {})
    table = next(block for block in companion_blocks(flown, found) if isinstance(block, Table))
    assert [row[1].text for row in table.rows] == ["ve"]
    assert sigma_contribution(sure, 2.0) == 2.0
    assert sigma_contribution(replace(sure, first=0.25), 2.0) == 1.0  # the root of the share of the variance
    assert sigma_contribution(chance, 2.0) is None
    assert "a first-order effect larger than its total effect" in table.note
    rows["propellant_kg"] = (replace(sure, total=1.0), replace(sure, input="oe_pct", first=0.2, total=0.2))
    table = next(block for block in companion_blocks(flown, found) if isinstance(block, Table))
    assert "larger than its total effect" not in table.note
    assert table.rows[0][0].small.endswith("above σ by chance in the estimates")


def test_the_root_sum_square_of_the_contributions_and_the_rest_make_up_sigma():
    rows = [Contributor("propellant_kg", name, first, first, (first - 0.01, 1.0), (first - 0.01, 1.0))
            for name, first in (("ve_pct", 0.2), ("oe_pct", 0.16))]  # fmt: skip
    flown = Flown(synthetic_run(300), "run")
    effects = {metric: () for metric in flown.key_metrics} | {"propellant_kg": tuple(rows)}
    found = Contributions(effects, 768, dict.fromkeys(effects, 128), 128, {})
    table = next(block for block in companion_blocks(flown, found) if isinstance(block, Table))
    sigma = flown.summaries["propellant_kg"].sd
    told = [spread_text(flown, "propellant_kg", part * sigma) for part in (1.0, 0.6, 0.8)]
    assert table.rows[0][0].small == "σ {}; root sum square {}, rest {}".format(*told)
    place = [column.title for column in table.columns].index("1σ contribution")
    assert [row[place].value for row in table.rows] == pytest.approx([0.2**0.5 * sigma, 0.4 * sigma], rel=1e-12)


def test_effects_are_ranked_by_the_total_one_with_intervals_of_the_stated_confidence_inside_zero_to_one():
    first = np.array([0.05, 0.9, np.nan, -0.03, 0.02]), np.array([0.02, 0.02, np.nan, 0.01, 0.05])
    total = np.array([0.25, 0.6, np.nan, 0.04, 0.99]), np.array([0.02, 0.1, np.nan, 0.01, 0.02])
    flown = SimpleNamespace(stated=SimpleNamespace(confidence=0.9))
    shares = [(value[:, None], error[:, None]) for value, error in (first, total)]
    rows = _ranked(flown, "y", ("a", "b", "gone", "c", "d"), shares, 0, unassigned=0.05)
    assert [row.input for row in rows] == ["d", "b", "a", "c"]
    assert [row.size for row in rows] == pytest.approx([0.99, 0.6 + 1.644854 * 0.1 + 0.05, 0.25, 0.04])
    d, b, a, c = rows
    assert a.first_interval == pytest.approx((0.05 - 1.644854 * 0.02, 0.05 + 1.644854 * 0.02))
    assert a.total_interval == pytest.approx((0.25 - 1.644854 * 0.02, 0.25 + 1.644854 * 0.02 + 0.05))
    assert (c.first, c.first_interval) == (0.0, pytest.approx((0.0, 1.644854 * 0.01)))
    assert d.first_interval == pytest.approx((0.0, 0.02 + 1.644854 * 0.05))
    assert d.total_interval == pytest.approx((0.99 - 1.644854 * 0.02, 1.0))
    assert b.bounded_first == b.total_interval[1] < b.first
    assert (b.fall, b.fall_interval) == (None, None)
    assert [row.surely_acts for row in rows] == [True] * 4


def test_an_input_that_names_a_draw_is_said_so_in_the_manifest_and_has_no_share_without_flights(tmp_path):
    shutil.copy(MODEL, tmp_path)
    ticket = '[dispersion.ticket]\ndist = "uniform"\nlower = 0.0\nupper = 1.0\n'
    text = HEAD.replace("[sensitivity]\ncases = 256\n", "").replace("line", "raffle").replace("60", "200")
    (tmp_path / "campaign.toml").write_text(text + INPUTS + ticket + LINE.replace("line", "raffle"))
    run = mc_engine.run(mc_engine.load_campaign(tmp_path / "campaign.toml"), tmp_path / "run", workers=1)
    assert [one["name"] for one in run.manifest["inputs"] if one.get("random_draw")] == ["ticket"]
    rows = json.loads(render_json(build(run, "run")))["contributors"]
    raffle = {row["input"]: row["total"] for row in rows if row["metric"] == "raffle"}
    reach = [row["total_interval"][1] for row in rows if row["metric"] == "raffle" and row["input"] != "unexplained"]
    assert min(reach) >= raffle["unexplained"]  # which may be any input's
    assert "ticket" not in raffle
    assert raffle["unexplained"] > 0.9


def test_a_table_of_few_cases_has_no_total_effects():
    """A surrogate of few cases misses more than its errors tell: of 199 there are first-order effects alone."""
    few = Flown(synthetic_run(199), "run")
    assert {row.total for row in few.contributions.rows()} == {None}
    table = next(block for block in companion_blocks(few, few.contributions) if isinstance(block, Table))
    assert table.note.endswith(
        "Total effects need 200 cases with a number, and 40 that make up 95\u202f% of the variance, or a section "
        "[sensitivity] of the campaign."
    )
