"""`mc-engine compare`: pairing, what changed, the answer and its exit status."""

from dataclasses import replace

import numpy as np
import pytest
from comparable_runs import COLUMNS, TEXT, run

from mc_engine.sampling.streams import uniforms
from mc_engine.studies.comparison import compare_runs, pair_cases
from mc_engine.studies.comparison_lines import comparison_lines
from reports.studies.comparison import build_comparison
from tests.mc_engine.command_line.cart import REQUIREMENT, call


def compared(a, b, **options):
    return compare_runs(a, b, ("a", "b"), **options)


def test_the_same_run_again_is_no_change(tmp_path):
    found = compared(run(tmp_path / "a"), run(tmp_path / "b"))
    assert found.pairing.paired
    assert not found.changed
    assert all(one.same for one in found.metrics)
    assert (found.code, found.campaign, found.diff) == ((), (), ())
    assert "no significant change" in list(comparison_lines(found))[-1]


def test_one_case_and_one_test_are_counted_as_one(tmp_path):
    found = compared(run(tmp_path / "a"), run(tmp_path / "b"))
    first, *_, last = comparison_lines(
        replace(found, cases=(1, 400), wanted=(1, 400), metrics=(), shares=found.shares[:1])
    )
    assert first.endswith("a: 1 case, 400 completed")
    assert "(1 test, at most" in last


def test_counts_by_the_limits_of_one_run_and_of_each_are_told_apart(tmp_path):
    lines = list(comparison_lines(compared(run(tmp_path / "a"), run(tmp_path / "b", limit=2.0))))
    verdict = next(line for line in lines if line.startswith("requirement fuel"))
    heading = lines.index("cases completed, and inside the limits of run B in both runs:")
    (counted,) = [line for line in lines if line.startswith("fuel: ")]
    assert lines.index(verdict) < heading < lines.index(counted)
    before, after = counted.removeprefix("fuel: ").split(",")[0].split(" -> ")
    assert before == after  # the same cases
    assert not verdict.startswith(f"requirement fuel: {before}")
    assert verdict.endswith("of 400 cases inside; in B the limit is different")


def test_a_requirement_of_another_metric_names_both_metrics(tmp_path):
    a = run(tmp_path / "a")
    (record,) = a.manifest["requirements"]
    b = run(tmp_path / "b", requirements=[{**record, "metric": "range_m", "at_most": 2e6}])
    line = next(line for line in comparison_lines(compared(a, b)) if line.startswith("requirement fuel"))
    assert line.endswith("of 400 cases inside; in B the metric is range_m, in A propellant_kg")


def test_a_shift_is_found_in_the_metric_that_moved_alone(tmp_path):
    found = compared(run(tmp_path / "a"), run(tmp_path / "b", shift=0.4, noise=2))
    assert [one.metric for one in found.shifted] == ["propellant_kg"]
    assert (found.spread, found.worse_verdicts) == ((), ())
    assert found.shifted[0].shift.value == pytest.approx(0.4, abs=0.15)
    assert found.changed
    assert any(line.startswith("in brackets: 90 % intervals") for line in comparison_lines(found))


def test_other_inputs_are_compared_unpaired_and_said(tmp_path):
    found = compared(run(tmp_path / "a"), run(tmp_path / "b", seed=2, noise=2))
    assert not found.pairing.paired
    assert found.pairing.reason == "not paired: the same case numbers have other inputs (ve_pct)"
    assert not found.changed
    assert [(one.what, one.before, one.after) for one in found.campaign] == [("seed", "1", "2")]


def test_a_longer_run_is_paired_on_the_cases_of_the_shorter(tmp_path):
    found = compared(run(tmp_path / "a", n=300), run(tmp_path / "b", n=400))
    assert found.pairing.paired
    assert [rows.size for rows in found.pairing.rows] == [300, 300]
    assert "100 cases that only one run has" in found.pairing.reason
    assert not found.changed
    few = compared(run(tmp_path / "c", n=1), run(tmp_path / "d", n=2)).pairing.reason
    assert few.startswith("paired: 1 case has the same inputs in both runs; 1 case that only one run has, or with")
    assert few.endswith("is left out")


def test_pairs_need_half_of_the_smaller_run(tmp_path):
    a, b = run(tmp_path / "a", n=20).cases(), run(tmp_path / "b", n=20).cases()
    for same, paired in ((20, True), (10, True), (9, False), (0, False)):
        other = b.copy()
        other.loc[same:, "ve_pct"] += 1.0
        assert pair_cases((a, other), (["ve_pct", "mode"], ["mode", "ve_pct"])).paired == paired


def test_failed_cases_are_a_share_that_changed(tmp_path):
    found = compared(run(tmp_path / "a"), run(tmp_path / "b", failed=40))
    assert [one.name for one in found.moved_shares] == ["completed", "fuel"]
    assert (found.shares[0].lost, found.shares[0].gained) == (40, 0)
    assert found.metrics[0].n_used == (360, 360)
    said = "\n".join(comparison_lines(found))  # 40 cases of run A have numbers that nothing is compared with
    assert "the same in both runs, in the cases with a number in both: propellant_kg" in said


def test_a_requirement_that_stands_worse_on_the_same_cases_is_a_change(tmp_path):
    found = compared(run(tmp_path / "a", limit=3.0), run(tmp_path / "b", limit=0.5))
    assert [(one.name, one.before, one.after) for one in found.worse_verdicts] == [("fuel", "pass", "fail")]
    assert found.moved_shares == ()  # counted by the limits of B in both
    assert found.changed
    better = compared(run(tmp_path / "c", limit=0.5), run(tmp_path / "d", limit=3.0))
    assert not better.changed


def test_fewer_cases_of_the_same_code_are_no_worse_verdict(tmp_path):
    found = compared(run(tmp_path / "a", n=200), run(tmp_path / "b", n=21))
    (fuel,) = found.verdicts
    assert fuel.inside == ((21, 21), (21, 21))
    assert fuel.words == "not demonstrable in both runs"
    assert not found.changed


@pytest.mark.parametrize("requirement_of", ["A", "B"])
def test_the_only_requirement_of_a_run_is_its_joint_verdict(tmp_path, requirement_of):
    one, two = (REQUIREMENT | {"name": name, "metric": metric, "at_most": limit, "share": 0.9}
                for name, metric, limit in (("fuel", "propellant_kg", 3.0), ("range", "range_m", 2e6)))  # fmt: skip
    sets = {"A": [one, two], "B": [one, two]} | {requirement_of: [one]}
    found = compared(*(run(tmp_path / name, requirements=records) for name, records in sets.items()))
    joint = next(verdict for verdict in found.verdicts if verdict.name == "all at once")
    assert joint.words == "pass in both runs"
    (line,) = [line for line in comparison_lines(found) if line.startswith("requirement all at once")]
    assert line.endswith(f"of 400 cases inside; in {requirement_of} fuel is the only requirement")
    nothing = compared(run(tmp_path / "c", requirements=[one, two]), run(tmp_path / "d", requirements=[]))
    assert {verdict.words for verdict in nothing.verdicts} == {"pass → not required"}


def tied(path, seed, pulses):
    """A run of other cases, of which most have no pulse and so are equal to each other."""
    return run(path, n=1000, seed=seed, pulses=np.where(uniforms(7, "own", np.arange(1000)) < pulses, 1.0, 0.0))


def test_a_terminal_shows_no_size_of_a_change_that_ties_hide(tmp_path):
    lines = list(comparison_lines(compared(tied(tmp_path / "a", 1, 0.1), tied(tmp_path / "b", 2, 0.3))))
    (row,) = [line for line in lines if line.startswith("pulses ")]
    _, shift, in_sigma, _, star, *_ = row.split()
    assert (shift, in_sigma, star) == ("ties", "ties", "*")
    assert any(line.startswith("ties: ") for line in lines)


def test_two_pairs_that_differ_among_many_have_no_interval_and_no_infinite_ends(tmp_path):
    some = np.arange(1000) % 7.0
    moved = np.where(np.arange(1000) < 2, some + 1.0, some)
    found = compared(run(tmp_path / "a", n=1000, pulses=some), run(tmp_path / "b", n=1000, pulses=moved))
    lines = list(comparison_lines(found))
    (row,) = [line for line in lines if line.startswith("pulses ")]
    assert "[no interval]" in row
    assert any(line.startswith("no interval: ") for line in lines)
    assert "inf]" not in "".join(lines)
    shown = str(build_comparison(found))
    assert "'no interval'" in shown
    assert "∞]" not in shown


def test_a_shift_of_some_pairs_is_not_told_as_one_of_all_cases(tmp_path):
    some = np.arange(400) % 7.0
    moved = np.where(np.arange(400) < 40, some + 1.0, some)
    found = compared(run(tmp_path / "a", pulses=some), run(tmp_path / "b", pulses=moved, shift=0.4))
    lines = list(comparison_lines(found))
    assert [line for line in lines if line.startswith("shift of the pairs that differ")] == [
        "shift of the pairs that differ, not of all: pulses (40 of 400)"
    ]
    assert "of pairs, only of those that differ" in str(build_comparison(found))
    unpaired = compared(run(tmp_path / "c", pulses=some), run(tmp_path / "d", seed=2, pulses=moved))
    assert not [line for line in comparison_lines(unpaired) if line.startswith("shift of the pairs")]


def test_a_comparison_says_when_it_tests_a_selection_of_the_numbers(tmp_path, monkeypatch):
    found = compared(run(tmp_path / "a"), run(tmp_path / "b", shift=0.4))
    told = "hifts of more than 399 pairs that differ are computed from that many, selected"
    assert told not in "\n".join(comparison_lines(found)) + str(build_comparison(found))
    monkeypatch.setattr("mc_engine.studies.comparison.MOST_CASES", 399)
    assert told in "\n".join(comparison_lines(found))
    assert told in str(build_comparison(found))


def test_what_changed_in_code_and_campaign_is_told(tmp_path):
    changes = {
        "engine": "0.3.0",
        "model": {"name": "m", "digest": "9c2e" * 16},
        "provenance": {
            "python": "3.11.7",
            "packages": {"numpy": "2.4.0"},
            "git": {"commit": "0123" * 10, "dirty": True},
        },
        "inputs": [{"name": "ve_pct", "distribution": "normal, 3σ = 4 %", "bounds": "", "nominal": 0.0}],
    }
    text = TEXT.replace("seed = 1", "seed = 1\nnote = 'new'")
    found = compared(run(tmp_path / "a"), run(tmp_path / "b", text=text, **changes))
    assert [one.what for one in found.code] == ["engine", "model sources", "git", "package numpy"]
    assert found.code[2].after == "012301230123 with uncommitted changes"
    assert [(one.what, one.after) for one in found.campaign] == [("dispersion ve_pct", "normal, 3σ = 4 %")]
    assert "+note = 'new'" in found.diff
    assert not found.changed


def test_the_number_of_cases_of_a_run_until_verdict_is_the_largest_that_it_may_fly(tmp_path):
    found = compared(run(tmp_path / "a"), run(tmp_path / "b", n=400, looks=[100, 200, 400]))
    assert [(one.what, one.before, one.after) for one in found.campaign] == [
        ("cases", "400", "until verdict, at most 400")
    ]


@pytest.mark.parametrize("n", [1, 2])
def test_a_case_or_two_are_compared_without_a_test(tmp_path, n):
    found = compared(run(tmp_path / "a", n=n), run(tmp_path / "b", n=n, shift=1.0, noise=2))
    assert all(np.isnan(one.shift_p) for one in found.metrics)
    assert not found.shifted
    assert list(comparison_lines(found))


def test_the_verb_answers_with_its_exit_status(tmp_path):
    run(tmp_path / "a")
    run(tmp_path / "b")
    run(tmp_path / "c", shift=0.4, noise=2)
    same = call("compare", tmp_path / "a", tmp_path / "b")
    assert same.exit_code == 0
    assert "paired: 400 cases" in same.output
    assert "the same in both runs: propellant_kg, range_m, pulses" in same.output
    changed = call("compare", tmp_path / "a", tmp_path / "c")
    assert changed.exit_code == 1
    assert "changed: shift of propellant_kg" in changed.output
    assert call("compare", tmp_path / "a", tmp_path / "c", "--alpha", "1e-30").exit_code == 0
    assert call("compare", tmp_path / "a", tmp_path / "c", "--tolerance", "100").exit_code == 0


def test_a_requirement_is_not_demonstrable_on_chosen_cases_and_the_tests_are_said_not_to_hold(tmp_path):
    """It was "pass → not required", beside p-values without a word."""
    grid = {"name": "test", "cases": 400, "design": "grid", "seed": 1}
    found = compared(run(tmp_path / "a"), run(tmp_path / "b", campaign=grid))
    (fuel,) = found.verdicts
    assert fuel.words == "pass → not demonstrable"
    assert found.worse_verdicts == ()  # of the design alone
    *_, note, answer = comparison_lines(found)
    assert note.startswith("note: the cases of run B (design grid) were chosen, not drawn at random: p-values")
    assert "false alarm" not in answer
    assert compared(run(tmp_path / "c"), run(tmp_path / "d")).chosen == ""


def test_a_failed_case_has_no_value_whatever_its_row_contains(tmp_path):
    a, b = run(tmp_path / "a"), run(tmp_path / "b", failed=3)
    part, worse = b.parts[0], b.cases()
    columns = {name: worse[name].to_numpy() for name in worse.columns}
    columns["propellant_kg"] = np.where(worse["status"] == "ok", worse["propellant_kg"], 99.0)
    b.withdraw(part)
    b.append(0, 400, columns)
    assert repr(compared(a, b).metrics) == repr(compared(a, run(tmp_path / "c", failed=3)).metrics)


def test_intervals_have_the_confidence_of_the_second_report_and_metrics_need_one_unit(tmp_path):
    other = [replace(column, unit="km") if column.name == "range_m" else column for column in COLUMNS]
    b = run(tmp_path / "b", columns=other, report={"confidence": 0.99})
    found = compared(run(tmp_path / "a", report={"confidence": 0.6}), b)
    assert found.confidence == 0.99
    assert [one.metric for one in found.metrics] == ["propellant_kg", "pulses"]
    assert found.left_out == ("range_m: in m in A, in km in B",)


@pytest.mark.parametrize(
    ("looks", "extended", "outcome"),
    [([], 25, "pass"), ([25], 25, "not demonstrable"), ([], 90, "not demonstrable")],
)
def test_verdicts_on_pairs_have_the_bounds_of_the_run_whose_size_was_not_fixed(tmp_path, looks, extended, outcome):
    """Time-uniform bounds ask for more cases than those of a run of fixed size."""
    a, b = run(tmp_path / "a", n=25, limit=99.0), run(tmp_path / "b", n=25, limit=99.0, looks=looks)
    if extended > 25:  # and interrupted before the first of the new cases
        b.note("extended", cases=extended)
    flown = "25 of 90 cases" if extended > 25 else "25 cases"
    found = compared(a, b)
    [verdict] = found.verdicts
    assert list(comparison_lines(found))[:2] == ["A  a: 25 cases, 25 completed", f"B  b: {flown}, 25 completed"]
    assert (verdict.before, verdict.after) == (outcome, outcome)
