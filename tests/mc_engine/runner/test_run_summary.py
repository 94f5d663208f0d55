import numpy as np
from cart import small_store

from mc_engine.runner.summary import failed_cases, judgement, summaries, summary_lines, verdict_line
from mc_engine.statistics import summarize
from mc_engine.status import OK, STATUS_NAME


def test_numbers_of_a_verdict_count_failed_cases_as_not_inside(tmp_path):
    store = small_store(tmp_path / "flown")
    fuel, zero = judgement(store)[0]
    assert (fuel.passed, fuel.tried) == (36, 40)
    assert zero.passed == 0
    assert failed_cases(store) == 4
    assert np.isnan(store.cases()["propellant_kg"]).sum() == 4


def test_a_verdict_reads_as_a_sentence_with_its_unit(tmp_path):
    store = small_store(tmp_path / "flown")
    line = verdict_line(judgement(store)[0][0], store.units)
    assert line == "fuel: pass, propellant_kg ≤ 100 kg in 36 of 40 cases (required: 50 % with 90 % confidence)"


def test_a_run_read_part_by_part_has_the_summaries_of_its_whole_table(tmp_path):
    store = small_store(tmp_path / "flown")
    table = store.cases()
    ok = table["status"] == STATUS_NAME[OK]
    found = summaries(store)
    assert list(found) == [column.name for column in store.columns if column.role == "metric"]
    for name, summary in found.items():
        assert summary == summarize(np.where(ok, table[name], np.nan), confidence=0.8)
    assert (found["propellant_kg"].n_used, found["propellant_kg"].n_tried) == (36, 40)


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
