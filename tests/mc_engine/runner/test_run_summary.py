from dataclasses import replace

import numpy as np
import pytest

from mc_engine.runner.summary import (
    failed_cases,
    judgement,
    metric_parts,
    nominal_line,
    outcomes,
    summaries,
    summary_lines,
    verdict_line,
)
from mc_engine.statistics import summarize
from mc_engine.status import OK, STATUS_NAME
from tests.mc_engine.command_line.cart import small_store
from tests.mc_engine.store.small_run import block


def test_numbers_of_a_verdict_count_failed_cases_as_not_inside(tmp_path):
    store = small_store(tmp_path / "flown")
    fuel, zero = judgement(store)[0]
    assert (fuel.passed, fuel.tried) == (36, 40)
    assert zero.passed == 0
    assert failed_cases(store.status_counts()) == 4
    assert np.isnan(store.cases()["propellant_kg"]).sum() == 4


def test_outcomes_are_the_verdicts_without_their_bounds_from_one_reading_of_the_parts(tmp_path, monkeypatch):
    store, passes = small_store(tmp_path / "flown"), []
    verdicts, joint = judgement(store)
    assert any(verdict.demonstrated is not None for verdict in verdicts)

    def counted(*asked):
        passes.append(asked)
        return metric_parts(*asked)

    monkeypatch.setattr("mc_engine.runner.summary.metric_parts", counted)
    assert outcomes(store) == ([replace(verdict, demonstrated=None, enclosed=None) for verdict in verdicts], joint)
    assert len(passes) == 1


def test_a_nominal_case_that_failed_is_told_with_its_reason(tmp_path):
    store = small_store(tmp_path / "flown")
    assert nominal_line(store) == ""
    row = {column.name: store.cases()[column.name].iloc[0] for column in store.columns}
    store.write_nominal({**row, "status": "ok", "reason": ""})
    assert nominal_line(store) == ""
    store.write_nominal({**row, "status": "step-limit", "reason": 'in the phase "hover"'})
    assert nominal_line(store) == 'failed: step-limit, in the phase "hover"'


def test_a_verdict_reads_as_a_sentence_with_its_unit(tmp_path):
    store = small_store(tmp_path / "flown")
    verdict = judgement(store)[0][0]
    line = verdict_line(verdict, store.units)
    assert line == "fuel: pass, propellant_kg ≤ 100 kg in 36 of 40 cases (required: 50 % with 90 % confidence)"
    assert "propellant_kg ≤ 120,000,000 kg in" in verdict_line(replace(verdict, at_most=1.2e8), store.units)
    assert "propellant_kg ≤ 2,459,000.12345 kg in" in verdict_line(replace(verdict, at_most=2459000.12345), store.units)


def test_parts_are_read_in_order_and_a_failed_case_has_no_value_whatever_its_row_contains(tmp_path):
    store = small_store(tmp_path / "flown", fly=False)
    for first in range(0, 40, 5):  # more parts than are read ahead
        store.append(first, 5, {**block(first, 5), "propellant_kg": np.arange(first, first + 5.0)})
    failed = (store.cases()["status"] != STATUS_NAME[OK]).to_numpy()
    values = np.concatenate([numbers["propellant_kg"] for _, numbers in metric_parts(store, ["propellant_kg"])])
    np.testing.assert_array_equal(values, np.where(failed, np.nan, np.arange(40.0)))
    assert failed.sum() == summaries(store)["propellant_kg"].n_tried - summaries(store)["propellant_kg"].n_used == 4


def test_a_run_read_part_by_part_has_the_summaries_of_its_whole_table(tmp_path):
    store = small_store(tmp_path / "flown")
    table = store.cases()
    ok = table["status"] == STATUS_NAME[OK]
    found = summaries(store)
    assert list(found) == [column.name for column in store.columns if column.role == "metric"]
    for name, summary in found.items():
        assert summary == summarize(np.where(ok, table[name], np.nan), confidence=0.8)
    assert (found["propellant_kg"].n_used, found["propellant_kg"].n_tried) == (36, 40)


def test_a_summary_has_the_percentiles_that_the_report_states(tmp_path):
    store = small_store(tmp_path / "flown")
    store.manifest["report"] = {"probability": 0.8, "confidence": 0.9}
    found = summaries(store)["propellant_kg"]
    values = store.cases()["propellant_kg"]
    assert [one.probability for one in found.quantiles] == [0.00135, 0.02275, 0.1, 0.5, 0.9, 0.97725, 0.99865]
    assert found.at(0.9).value == pytest.approx(np.quantile(values.dropna(), 0.9, method="median_unbiased"), rel=0.05)


def test_a_grid_has_ends_and_no_percentiles(tmp_path):
    store = small_store(tmp_path / "flown")
    store.manifest["campaign"]["design"] = "grid"
    found = summaries(store)["propellant_kg"]
    assert (found.quantiles, found.maximum) == ((), store.cases()["propellant_kg"].max())
    assert " ".join(summary_lines("propellant_kg", found, "kg", random=False)[1].split()[::2]) == "from to"


def test_bounds_of_percentiles_in_lines_hold_those_that_were_found():
    summary = summarize(np.random.default_rng(1).normal(1e6, 3.0, 1000), probabilities=(0.5,))
    lower, upper = summary_lines("range_m", summary, "m", random=True)[2].split("[")[1].removesuffix("]").split(", ")
    (median,) = summary.quantiles
    assert median.lower - 0.1 < float(lower) < median.lower < median.upper < float(upper) < median.upper + 0.1


def test_a_summary_in_lines_says_how_many_cases_it_rests_on():
    lines = summary_lines("fuel_kg", summarize(np.array([1.0, np.nan, 2.0])), "kg", random=True)
    assert lines[0] == "fuel_kg [kg]: 2 of 3 cases have a number"
    assert lines[1] == "  mean 1.5, sd 0.707107, from 1 to 2"
    assert lines[4] == "   50.000 %  1.5  [too few cases, too few cases]"
    assert "[" not in summary_lines("fuel_kg", summarize(np.array([1.0, 2.0])), "kg", random=False)[4]
    epochs = summary_lines("epoch_days", summarize(2460000.5 + np.array([0.0, 1e-6, 4e-6])), "day", random=False)
    assert epochs[1] == "  mean 2460000.50000167, sd 2.08172e-06, from 2460000.5 to 2460000.500004"
    assert summary_lines("fuel_kg", summarize(np.array([np.nan])), "kg", True) == [
        "fuel_kg [kg]: 0 of 1 cases have a number"
    ]


def test_a_percentile_next_to_an_end_is_printed_with_all_its_digits():
    summary = summarize(np.array([1.0, 2.0]), probabilities=(0.00000135, 0.5, 0.99999865))
    lines = summary_lines("fuel_kg", summary, "kg", random=False)[2:]
    assert [line.split()[0] for line in lines] == ["0.000135", "50.000000", "99.999865"]
    assert len({line.index("%") for line in lines}) == 1
