import numpy as np
from cart import small_store

from mc_engine.run_summary import case_line, failed_cases, verdict_line, verdicts


def test_numbers_of_a_verdict_count_failed_cases_as_not_inside(tmp_path):
    store = small_store(tmp_path / "flown")
    fuel, zero = verdicts(store)
    assert (fuel.passed, fuel.tried) == (36, 40)
    assert zero.passed == 0
    assert failed_cases(store) == 4
    assert np.isnan(store.cases()["propellant_kg"]).sum() == 4


def test_the_case_line_puts_the_commonest_status_first(tmp_path):
    assert case_line(small_store(tmp_path / "flown", cases=1000)) == "40 of 1,000 cases: 36 ok, 4 no-stop"
    assert case_line(small_store(tmp_path / "empty", fly=False)) == "0 of 40 cases"


def test_a_verdict_reads_as_a_sentence_with_its_unit(tmp_path):
    store = small_store(tmp_path / "flown")
    line = verdict_line(verdicts(store)[0], store.units)
    assert line == "fuel: pass, propellant_kg ≤ 100 kg in 36 of 40 cases (wanted 50 % with 90 % confidence)"
