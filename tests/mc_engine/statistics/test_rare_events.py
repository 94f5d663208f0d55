"""Small probabilities in closed form, by both methods: bias and coverage over 50 seeds; hard and hopeless margins.

Normal tails: Abramowitz & Stegun, Table 26.2 gives 1 - Phi(3.5) = 2.326e-4.
"""

import math

import numpy as np
import pytest
from scipy import stats
from scipy.special import log_ndtr, ndtri

from mc_engine.sampling.streams import uniforms
from mc_engine.statistics import clopper_pearson
from mc_engine.statistics.importance_sampling import cross_entropy
from mc_engine.statistics.rare_events import Level, interval_of_mean
from mc_engine.statistics.subset_simulation import Climb, _remarks, subset_simulation

SEEDS = 50
# Cases per level: fewer serve importance sampling.
METHODS = {"subset": (subset_simulation, 10_000), "cross-entropy": (cross_entropy, 1_000)}
MILLIONTH = float(stats.norm.isf(1e-6))
SQUARES = float(stats.chi2.isf(1e-6, 5))
SUM = float(stats.gamma.isf(1e-6, 5))


def plane(u):
    return 3.5 - (u[:, 0] + u[:, 1]) / math.sqrt(2.0)


def twenty_inputs(u):
    return MILLIONTH - u.sum(axis=1) / math.sqrt(20.0)


def four_branches(u):
    return 4.5 - np.abs(u).max(axis=1)


def sphere(u):
    return SQUARES - (u * u).sum(axis=1)


def sum_of_exponentials(u):
    return SUM + log_ndtr(-u).sum(axis=1)


LIMIT_STATES = {
    "a plane": (plane, 2, 2.326e-4),
    "a plane of 20 inputs": (twenty_inputs, 20, 1e-6),
    "four branches": (four_branches, 2, 1.0 - (1.0 - 2.0 * stats.norm.sf(4.5)) ** 2),
    "outside a sphere": (sphere, 5, 1e-6),
    "a sum of exponentials": (sum_of_exponentials, 5, 1e-6),
}


# two more examples, and two that importance sampling takes long for and that are easier than the four branches
FURTHER = [(name, method) for name in ("a plane of 20 inputs", "a sum of exponentials") for method in METHODS]
FURTHER += [(name, "cross-entropy") for name in ("a plane", "outside a sphere")]


@pytest.mark.parametrize(
    ("name", "method"),
    [
        pytest.param(name, method, marks=pytest.mark.slow if (name, method) in FURTHER else ())
        for name in LIMIT_STATES
        for method in METHODS
    ],
)
def test_known_probabilities_are_met_without_bias_and_inside_the_interval(name, method):
    margin, n_inputs, p = LIMIT_STATES[name]
    estimate, cases = METHODS[method]
    events = [estimate(margin, n_inputs, cases_per_level=cases, seed=seed) for seed in range(SEEDS)]
    assert abs(np.mean([math.log10(event.probability / p) for event in events])) <= 0.05
    assert abs(math.log10(np.mean([event.probability for event in events]) / p)) <= 0.05
    assert sum(event.lower <= p <= event.upper for event in events) >= 0.9 * SEEDS
    # An interval that holds the truth by being wide would be no achievement.
    assert np.median([math.log10(event.upper / event.lower) for event in events]) < 0.45
    assert np.median([event.plain_cases / event.n_cases for event in events]) > 5.0


def noisy(share, distance=4.0):
    """A plane, `distance` standard deviations off, a share of whose variance is noise of the flight."""

    def margin(u, addresses):
        z = ndtri(np.clip(uniforms(7, "noise", addresses), 1e-16, 1.0 - 1e-16))
        return distance - math.sqrt(1.0 - share) * u[:, 0] - math.sqrt(share) * z

    return margin


@pytest.mark.parametrize(("method", "share"), [("subset", 0.5), ("cross-entropy", 0.1)])
def test_noise_of_the_flight_belongs_to_the_probability(method, share):
    estimate, cases = METHODS[method]
    events = [estimate(noisy(share), 1, cases_per_level=cases, seed=seed, noise=True) for seed in range(20)]
    p = stats.norm.sf(4.0)
    assert abs(np.mean([math.log10(event.probability / p) for event in events])) <= 0.05
    assert sum(event.lower <= p <= event.upper for event in events) >= 18


def test_the_interval_reaches_to_that_of_plain_cases_where_noise_decides_the_failures():
    """Chains with new noise hardly ever come to rare failures, and 15 levels that keep theirs lead elsewhere."""
    event = subset_simulation(noisy(0.9, distance=4.75), 1, cases_per_level=1_000, seed=2, noise=True)
    assert event.lower < stats.norm.sf(4.75) < event.upper == pytest.approx(1.0 - 0.025**1e-3)
    assert "fewer than 1 % of the steps with new noise of the flight were accepted" in event.remarks[-1]


def test_importance_sampling_names_subset_simulation_where_noise_decides_the_failures():
    event = cross_entropy(noisy(0.7, distance=2.5), 1, cases_per_level=1_000, seed=2, noise=True)
    halted, few = event.remarks
    assert halted.startswith("Levels came to a halt before the failures, as where the noise of the flight decides them")
    assert halted.endswith("the interval may be too narrow. Use subset simulation.")
    assert few.startswith("The estimate rests on as much as ")
    assert event.lower <= stats.norm.sf(2.5) <= event.upper


@pytest.mark.parametrize("method", METHODS)
def test_weights_of_the_failed_cases_add_up_to_the_probability(method):
    event = METHODS[method][0](plane, 2, cases_per_level=2_000, seed=3)
    cases = event.cases
    assert cases.weight[cases.failed].sum() == pytest.approx(event.probability, rel=1e-12)
    np.testing.assert_array_equal(cases.margin, plane(cases.u))
    if method == "subset":  # chains keep the distribution, so any weighted mean is that of plain cases
        assert cases.weight.sum() == pytest.approx(1.0, rel=1e-12)
        assert cases.weight @ (cases.margin < 1.5) == pytest.approx(stats.norm.sf(2.0), rel=0.15)


@pytest.mark.parametrize("method", METHODS)
def test_each_level_has_the_probability_of_its_margin(method):
    event = METHODS[method][0](plane, 2, cases_per_level=2_000, seed=3, confidence=0.9)
    exact = [stats.norm.sf(3.5 - level.margin) for level in event.levels]
    assert [level.probability for level in event.levels] == pytest.approx(exact, rel=0.5)
    assert sum(level.cases for level in event.levels) == event.n_cases
    assert all(0.0 < level.accepted <= 1.0 for level in event.levels)
    if method == "subset":  # the interval tells the variance s^2 of the logarithms of the runs (Cox), and so the error
        reach = 0.5 * math.log(event.upper / event.lower) / (1.2 * stats.t.ppf(0.95, 9))
        variance = 0.9 * (math.sqrt(1.0 + 20.0 * reach**2 / 0.9) - 1.0)
        assert event.relative_error == pytest.approx(math.sqrt(variance / 10.0), rel=0.4)


def test_runs_that_disagree_or_found_nothing_are_said():
    def remarks_of(estimates, accepted=0.5):
        return _remarks(Climb(None, None, (Level(0.0, 1.0, 10, 100, accepted),), None, False, 1.0), np.array(estimates))

    for least, found in ((3.4e-8, ""), (3.3e-8, "The runs disagree"), (0.0, "1 of 10 runs found no")):
        remarks = " ".join(remarks_of([least, *9 * [1e-6]]))
        assert remarks.startswith(found), least
        assert bool(remarks) == bool(found)
    assert remarks_of(10 * [0.0])[0].startswith("No case failed in 1 levels")
    assert remarks_of(10 * [1.0], 0.051) == []
    assert "only 4.9% of the steps" in remarks_of(10 * [1.0], 0.049)[0]


@pytest.mark.parametrize("method", METHODS)
def test_the_same_seed_gives_the_same_cases(method):
    first, again, other = (METHODS[method][0](plane, 2, cases_per_level=1_000, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.cases.u, again.cases.u)
    assert (first.probability, first.upper) == (again.probability, again.upper)
    assert first.probability != other.probability


@pytest.mark.parametrize("method", METHODS)
def test_a_margin_that_is_not_a_number_has_failed(method):
    def lost(u):
        return np.where(plane(u) < 0.0, np.nan, plane(u))

    event, whole = (METHODS[method][0](margin, 2, cases_per_level=2_000, seed=5) for margin in (lost, plane))
    assert np.isneginf(event.cases.margin[event.cases.failed]).all()
    assert event.lower <= 2.326e-4 <= event.upper
    assert whole.probability > 0.0


@pytest.mark.parametrize("method", METHODS)
def test_steps_in_the_margin_are_climbed(method):
    def stairs(u):
        return np.ceil(4.0 * plane(u)) / 4.0

    event = METHODS[method][0](stairs, 2, cases_per_level=5_000, seed=2)
    assert event.lower <= 2.326e-4 <= event.upper


@pytest.mark.parametrize("method", METHODS)
def test_failures_on_the_other_side_of_a_misleading_slope_are_found_or_doubted(method):
    """A slope that leads to the far rarer of two failures.  Breitung, Rel. Eng. & Sys. Safety 192 (2019) 106337."""

    def misleading(u):
        x, y = u[:, 0], u[:, 1]
        return np.minimum(np.where(x > 3.5, 4.0 - x, 0.85 - 0.1 * x), np.where(y > 2.0, 0.5 - 0.1 * y, 2.3 - y))

    p = stats.norm.sf(4.0)
    for seed in range(4):
        event = METHODS[method][0](misleading, 2, cases_per_level=5_000, seed=seed)
        assert event.lower <= p <= event.upper or "failures that some of them did not find" in " ".join(event.remarks)


@pytest.mark.parametrize("method", METHODS)
def test_a_margin_without_slope_is_counted_with_its_exact_interval(method):
    event = METHODS[method][0](lambda u: np.ones(len(u)), 3, cases_per_level=1_000, seed=1)
    assert (event.method, event.probability, event.lower) == ("plain", 0.0, 0.0)
    # Clopper-Pearson, none of 1000: 1 - 0.025^(1/1000)
    assert event.upper == pytest.approx(1.0 - 0.025**0.001, rel=1e-9)
    assert "points towards the failures" in event.remarks[0]


def test_what_cannot_fail_is_below_the_last_level():
    event = subset_simulation(lambda u: 1e-3 + np.exp(-u[:, 0]), 1, cases_per_level=500, seed=1)
    assert event.probability == event.lower == 0.0
    assert 0.0 < event.upper < 1e-10
    assert math.isinf(event.plain_cases)
    assert "No case failed" in event.remarks[0]


def test_importance_sampling_without_a_failure_has_the_bound_of_its_plain_cases_alone():
    """The estimate of a level once was the bound: 1.8e-17, from weights of 500 cases that all passed."""
    event = cross_entropy(lambda u: 1e-3 + np.exp(-u[:, 0]), 1, cases_per_level=500, seed=1, confidence=0.9)
    assert event.probability == event.lower == 0.0
    assert event.upper == pytest.approx(1.0 - 0.05 ** (1 / 500), rel=1e-9)  # Clopper-Pearson, none of 500
    assert "importance sampling demonstrates nothing" in event.remarks[0]


def test_with_runs_at_zero_the_upper_end_is_no_less_than_the_largest_estimate():
    assert interval_of_mean(np.array([2e-5, *9 * [0.0]]), 0.9)[1] == 2e-5  # Student's alone is less


def test_upper_ends_hold_where_few_cases_leave_some_runs_without_a_failure():
    distance, p = float(stats.norm.isf(1e-5)), 1e-5
    events = [
        subset_simulation(lambda u: distance - u[:, 0], 2, cases_per_level=500, seed=seed, confidence=0.9)
        for seed in range(40)
    ]
    assert sum(event.upper < p for event in events) <= 4


def test_the_interval_on_the_mean_of_runs_is_coxs_with_the_stated_allowance():
    """Olsson (2005), modified Cox: mean log + s^2/2 +- t sqrt(s^2/n + s^4 / (2 (n - 1))), here 1.2 times as far."""
    estimates = np.array([1.0, 2.0, 4.0, 8.0]) * 1e-6  # logarithms with variance 5/3 (ln 2)^2
    variance = 5.0 / 3.0 * math.log(2.0) ** 2
    centre = math.log(math.sqrt(8.0) * 1e-6) + 0.5 * variance
    reach = 1.2 * 2.353363 * math.sqrt(variance / 4.0 + variance**2 / 6.0)  # t with 3 degrees of freedom, 95 %
    assert interval_of_mean(estimates, 0.9) == pytest.approx((math.exp(centre - reach), math.exp(centre + reach)))
    with_zero = np.array([0.0, 1.0, 2.0, 3.0])  # Student's, cut at zero: 1.5 +- 1.2 t sqrt(5/3 / 4)
    reach = 1.2 * 2.353363 * math.sqrt(5.0 / 12.0)
    assert interval_of_mean(with_zero, 0.9) == pytest.approx((0.0, 1.5 + reach))


@pytest.mark.parametrize("method", METHODS)
def test_frequent_failures_are_those_of_so_many_plain_cases(method):
    event = METHODS[method][0](lambda u: 0.3 - u[:, 0], 2, cases_per_level=1_000, seed=1, confidence=0.9)
    failed = int(event.cases.failed.sum())
    assert (event.method, event.n_cases, event.probability) == ("plain", 1000, failed / 1000)
    assert (event.lower, event.upper) == clopper_pearson(failed, 1000, 0.9)
    assert event.relative_error == pytest.approx(math.sqrt((1.0 - failed / 1000) / failed), rel=1e-12)
    assert event.plain_cases == pytest.approx(1000, rel=1e-12)


def test_the_interval_of_importance_sampling_is_that_of_the_mean_of_its_weights():
    event = cross_entropy(plane, 2, cases_per_level=1_000, seed=3, confidence=0.9)
    cases = event.cases
    last = cases.level == cases.level.max()
    weight = 1000 * (cases.weight * cases.failed)[last]
    assert (last.sum(), cases.weight[~last].sum()) == (1000, 0.0)
    error = stats.sem(weight) / weight.mean()
    reach = math.exp(1.2 * 1.6448536 * error)  # the stated allowance
    assert event.levels[-1].accepted == pytest.approx(weight.sum() ** 2 / (weight @ weight) / 1000, rel=1e-9)  # Kish
    told = event.probability, event.relative_error, event.lower, event.upper
    assert told == pytest.approx((weight.mean(), error, weight.mean() / reach, weight.mean() * reach), rel=1e-6)
    density = np.exp(-0.5 * (cases.u[last] ** 2).sum(axis=1)) / (2.0 * math.pi)
    drawn = density / (1000 * cases.weight[last])  # what the cases were drawn from, a density: its mean reciprocal
    inside = np.abs(cases.u[last] - [2.6, 2.6]).max(axis=1) < 0.4  # in a box is the area of the box
    assert np.mean(inside / drawn) == pytest.approx(0.64, rel=0.2)


def test_the_interval_on_the_mean_of_log_normal_estimates_holds_it():
    rng = np.random.default_rng(1)
    held = 0
    for _ in range(2_000):
        lower, upper = interval_of_mean(np.exp(0.6 * rng.standard_normal(10)), 0.95)
        held += lower <= math.exp(0.5 * 0.6**2) <= upper
    assert held / 2_000 > 0.95
