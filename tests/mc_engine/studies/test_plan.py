import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom, poisson

from mc_engine.numbers_in_text import chance_percent
from mc_engine.statistics.binomial import acceptance_number, lower_bound, smallest_sample
from mc_engine.studies.plan import plan_row, table_lines

# share, confidence: smallest samples for 0, 1, 2, ... failures.
# 59, 93, 124 and 299, 473: Wilks, Ann. Math. Stat. 12 (1941), one-sided tolerance limits; the others by scipy.
SAMPLES = [
    (0.9973, 0.90, [852, 1440, 1970, 2473]),
    (0.99865, 0.90, [1705, 2880, 3941, 4947]),
    (0.999, 0.90, [2302, 3889]),
    (0.95, 0.95, [59, 93, 124]),
    (0.99, 0.95, [299, 473]),
]
ROWS = [plan_row(0.9973, 0.90, failures) for failures in range(4)]


@pytest.mark.parametrize(("share", "confidence", "cases"), SAMPLES)
def test_the_smallest_samples_are_those_of_the_tables(share, confidence, cases):
    assert [plan_row(share, confidence, failures).cases for failures in range(len(cases))] == cases


@pytest.mark.parametrize("row", ROWS)
def test_a_row_says_what_share_it_demonstrates(row):
    assert row.demonstrated >= 0.9973 > lower_bound(row.cases - 1 - row.failures, row.cases - 1, 0.90)


@given(share=st.floats(0.5, 0.999), confidence=st.floats(0.5, 0.99), cases=st.integers(1, 5000))
def test_the_acceptance_number_is_the_last_that_demonstrates(share, confidence, cases):
    accepted = acceptance_number(cases, share, confidence)
    if accepted is None:
        assert smallest_sample(share, confidence) > cases
    else:
        assert smallest_sample(share, confidence, accepted) <= cases < smallest_sample(share, confidence, accepted + 1)


@pytest.mark.parametrize("row", ROWS)
def test_a_row_says_how_likely_a_system_passes_that_fails_half_as_often(row):
    assert row.half_rate == pytest.approx(binom.cdf(row.failures, row.cases, 0.00135), rel=1e-9)


def test_a_share_next_to_one_is_demonstrated_with_digits_and_chances_that_are_numbers():
    share, confidence = 1.0 - 1e-11, 0.99  # more than 2**31 cases
    row = plan_row(share, confidence, 1)
    assert row.half_rate == pytest.approx(poisson.cdf(1, 0.5e-11 * row.cases), rel=1e-6)
    shown = float(list(table_lines([row], share, confidence))[1].split()[3])
    assert share <= shown < 1.0


def test_a_chance_that_is_not_certain_never_reads_as_certain_or_impossible():
    def passes(share, failures):
        return list(table_lines([plan_row(share, 0.9, failures)], share, 0.9))[1].split(maxsplit=4)[4]

    assert (passes(0.5, 200), passes(0.9973, 0)) == ("> 99.9 %", "31.6 %")
    assert [chance_percent(chance) for chance in (1e-9, 0.0006, 0.9994, 0.99998)] == ["< 0.1", "0.1", "99.9", "> 99.9"]
