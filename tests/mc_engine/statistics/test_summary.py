"""Summaries of a metric."""

import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest

from mc_engine.statistics import summarize
from mc_engine.statistics.streaming import stream

DRAW = np.random.Generator(np.random.Philox(key=2))


def test_moments_are_those_of_numpy():
    values = DRAW.gamma(2.0, size=4000)
    summary = summarize(values)
    assert summary.mean == pytest.approx(values.mean(), rel=1e-13)
    assert summary.sd == pytest.approx(values.std(ddof=1), rel=1e-13)


@pytest.mark.parametrize(
    ("values", "sd"),
    [([7.0], None), ([1.0, 3.0], 2.0**0.5), ([2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0], (32 / 7) ** 0.5)],
)
def test_the_deviation_of_a_few_values_is_that_of_the_textbook(values, sd):
    assert summarize(np.array(values)).sd == (None if sd is None else pytest.approx(sd, rel=1e-15))


def test_a_constant_metric_keeps_its_bits_and_has_no_spread():
    summary = summarize(np.full(10_001, 0.1))
    assert summary.constant
    assert (summary.mean, summary.sd, summary.at(0.5).value, summary.shape) == (0.1, 0.0, 0.1, None)


@pytest.mark.parametrize(
    ("values", "constant"),
    [([7000.000000000001, 7000.000000000012], True), ([-0.3, -0.2999999999999999], True), ([0.0, 0.0], True),
     ([7000.0, 7000.0001], False), ([0.0, 1e-17], False), ([-0.3, 0.3], False)],
)  # fmt: skip
def test_what_differs_by_rounding_alone_is_constant_and_has_no_spread(values, constant):
    summary = summarize(np.array(values))
    assert summary.constant is constant
    assert summary.spread == (None if constant else summary.sd)


@pytest.mark.parametrize("values", [[], [np.nan], [np.nan] * 500])
def test_without_a_number_there_is_no_statistic_and_no_warning(values):
    summary = summarize(np.array(values))
    assert (summary.n_used, summary.n_tried) == (0, len(values))
    assert summary.mean is summary.sd is summary.minimum is None
    assert summary.quantiles == ()


def test_ten_thousand_cases_reach_the_three_sigma_limits_with_their_intervals():
    summary = summarize(DRAW.normal(size=10_000))
    assert [item.probability for item in summary.quantiles] == [0.00135, 0.02275, 0.5, 0.97725, 0.99865]
    assert all(item.lower < item.value < item.upper for item in summary.quantiles)
    assert summary.at(0.99865).value == pytest.approx(3.0, abs=0.3)


# ---- the same, part by part


def in_parts(values, ends, order):
    """The parts of a table with one column, cut at `ends`, in this order."""
    parts = np.split(values, ends)
    return lambda _: ({"metric": parts[place]} for place in order)


def awkward(kind, n):
    draw = np.random.Generator(np.random.Philox(key=n))
    values = {
        "normal": draw.normal(7e6, 3.0, n),
        "heavy": draw.standard_cauchy(n),
        "wide": draw.normal(size=n) * 10.0 ** draw.integers(-200, 200, n),
        "counts": np.round(draw.normal(0.0, 4.0, n)),
        "constant": np.full(n, 0.1),
    }[kind]
    values[::97] = np.nan
    values[5::1009] = np.inf
    return values


@pytest.mark.parametrize("kind", ["normal", "heavy", "wide", "counts", "constant"])
@pytest.mark.parametrize("n", [0, 1, 2, 3, 19, 100_000])
def test_part_by_part_gives_the_bits_of_the_whole_in_any_order_of_the_parts(kind, n):
    values = awkward(kind, n)
    whole = summarize(values)
    for ends, order in (([], [0]), (sorted([n // 3, n // 3 + 1, n // 2]), [2, 0, 3, 1]), ([0, n], [1, 2, 0])):
        assert stream(in_parts(values, ends, order), ["metric"]).summaries == {"metric": whole}


def test_the_moments_are_right_to_the_last_digits():
    values = awkward("normal", 20_000)
    fractions = [Fraction(value) for value in values[np.isfinite(values)].tolist()]
    mean = sum(fractions) / len(fractions)
    variance = sum((fraction - mean) ** 2 for fraction in fractions) / (len(fractions) - 1)
    summary = summarize(values)
    assert summary.mean == float(mean)
    assert summary.sd == pytest.approx(float(variance) ** 0.5, rel=1e-15)


@pytest.mark.slow
def test_ten_million_rows_are_summarised_in_bounded_memory():
    done = subprocess.run([sys.executable, "-c", TEN_MILLION], capture_output=True, text=True, timeout=600, check=True)
    before, peak, used, mean, tail = map(float, done.stdout.split())
    assert used == 10_000_000
    assert mean == pytest.approx(0.0, abs=5.0 / 10_000_000**0.5)
    assert tail == pytest.approx(2.99998, abs=5.0 * (0.00135 * 0.99865 / 1e7) ** 0.5 / 0.00443)
    # The table has 80 MB; a part of it 0.5 MB, the counts of twenty ranks 10 MB.
    assert peak - before < 40.0


TEN_MILLION = """
import resource
import numpy as np
from mc_engine.statistics.streaming import stream

def parts(names):
    for part in range(160):
        yield {"metric": np.random.Generator(np.random.Philox(key=part)).normal(size=62_500)}

def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0

stream(lambda _: ({"metric": np.zeros(62_500)} for _ in range(2)), ["metric"])
before = peak()
found = stream(parts, ["metric"]).summaries["metric"]
print(before, peak(), found.n_used, found.mean, found.at(0.99865).value)
"""


def test_values_that_are_no_numbers_count_as_tried_and_not_as_used():
    summary = summarize(np.array([1.0, np.nan, 3.0, np.inf, 5.0]))
    assert (summary.n_used, summary.n_tried) == (3, 5)
    assert (summary.mean, summary.sd, summary.minimum, summary.maximum) == (3.0, 2.0, 1.0, 5.0)
