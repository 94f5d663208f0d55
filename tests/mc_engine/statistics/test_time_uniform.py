"""Limits that hold at every number of cases at once."""

import numpy as np
import pytest
from scipy.integrate import quad

from mc_engine.statistics import binomial, time_uniform
from mc_engine.statistics.time_uniform import acceptance_number, lower_bound, smallest_sample, upper_bound


def mixed_ratio(failures, tried, rate, side):
    """e(q0) of the module's first page by quadrature, weights q^(-1/2) on one side of q0; v = sqrt(q)."""
    ends = {"below": (0.0, rate**0.5), "above": (rate**0.5, 1.0)}[side]
    against = failures * np.log(rate) + (tried - failures) * np.log1p(-rate)

    def ratio(v):
        q = v * v
        return np.exp(failures * np.log(q) + (tried - failures) * np.log1p(-q) - against) if 0.0 < q < 1.0 else 0.0

    peak = min(max((failures / tried) ** 0.5, ends[0]), ends[1])
    mass = sum(quad(ratio, *piece, limit=500)[0] for piece in ((ends[0], peak), (peak, ends[1])))
    return mass / (ends[1] - ends[0])


@pytest.mark.parametrize(("failures", "tried"), [(1, 10), (5, 300), (30, 1000), (999, 1000)])
@pytest.mark.parametrize("confidence", [0.9, 0.95])
def test_at_a_limit_the_mixed_ratio_is_what_ville_allows(failures, tried, confidence):
    highest, lowest = (1.0 - bound(tried - failures, tried, confidence) for bound in (lower_bound, upper_bound))
    assert mixed_ratio(failures, tried, highest, "below") == pytest.approx(1.0 / (1.0 - confidence), rel=1e-6)
    assert mixed_ratio(failures, tried, lowest, "above") == pytest.approx(1.0 / (1.0 - confidence), rel=1e-6)


@pytest.mark.parametrize(("share", "confidence"), [(0.9973, 0.9), (0.95, 0.95)])
def test_more_cases_are_needed_than_where_their_number_is_fixed_but_not_twice_as_many(share, confidence):
    for failures in range(4):
        cases = smallest_sample(share, confidence, failures)
        assert lower_bound(cases - failures, cases, confidence) >= share
        assert lower_bound(cases - 1 - failures, cases - 1, confidence) < share
        assert 1.0 < cases / binomial.smallest_sample(share, confidence, failures) < 1.6
        assert acceptance_number(cases, share, confidence) == failures
    assert acceptance_number(smallest_sample(share, confidence) - 1, share, confidence) is None


@pytest.mark.parametrize("rate", [0.01, 0.05, 0.4])
def test_whoever_looks_after_every_case_is_misled_no_more_often_than_promised(rate):
    draw = np.random.Generator(np.random.Philox(key=11))
    failures = np.cumsum(draw.random((2000, 600)) < rate, axis=1)
    tried = np.arange(1, 601)
    held = {limits: np.ones(2000, dtype=bool) for limits in (time_uniform, binomial)}
    for limits, kept in held.items():
        most = np.array([_most_seen(limits, n, 1.0 - rate) for n in tried])  # failures that still keep the lower limit
        kept &= (failures >= most).all(axis=1)
    assert held[time_uniform].mean() >= 0.9
    assert held[binomial].mean() < 0.87  # what the correction is for


def _most_seen(limits, tried, share):
    """The fewest failures among `tried` with which the lower limit stays at or below the true share."""
    accepted = limits.acceptance_number(int(tried), share, 0.9)
    return 0 if accepted is None else accepted + 1
