"""Failure drivers: planted ones are found with the right place and size, and chance is held at its rate."""

import numpy as np
import pytest
from scipy import stats

from mc_engine.sampling.designs import unit_cube
from mc_engine.sampling.streams import uniforms
from mc_engine.statistics import clopper_pearson
from mc_engine.statistics.drivers import MOST_ROWS, _adjusted, _tested_rows, failure_drivers, success_along
from mc_engine.statistics.input_columns import average_ranks


def draws(count, n, seed=5):
    return {f"x{k}": uniforms(seed, f"x{k}", np.arange(n)) for k in range(count)}


@pytest.mark.parametrize(
    ("where", "beyond"),
    [
        ("high", lambda u: u > 0.98),
        ("low", lambda u: u < 0.02),
        ("at both ends", lambda u: np.abs(u - 0.5) > 0.49),
        ("in the middle", lambda u: np.abs(u - 0.5) < 0.01),
    ],
)
def test_a_planted_driver_is_found_where_it_is(where, beyond):
    x = draws(8, 2000)
    drivers = failure_drivers(x, {"limit": beyond(x["x3"])})
    assert [driver.inputs for driver in drivers.singles] == [("x3",)]
    assert drivers.singles[0].where == (where,)
    # it tells every failed case from every passed one, but that the middle of ranks is not quite 0.5
    assert drivers.singles[0].effect == pytest.approx(1.0, abs=2e-3)
    assert drivers.singles_tested == 8


@pytest.mark.parametrize(
    ("beyond", "right"),
    [
        (lambda z: z > 2.2, ("high", "at the high end")),
        (lambda z: z < -2.2, ("low", "at the low end")),
        (lambda z: np.abs(z) > 2.4, ("at both ends",)),
    ],
)
def test_among_failures_of_other_causes_one_end_is_seldom_taken_for_both(beyond, right):
    """6 % of the cases fail by themselves, 1.4 % at the end of an input, as 12 of 75 failures of a campaign did."""
    told = []
    for seed in range(100):
        x = {"x": stats.norm.ppf(uniforms(seed, "x", np.arange(1000)))}
        failed = beyond(x["x"]) | (uniforms(seed, "luck", np.arange(1000)) < 0.06)
        told += [driver.where[0] for driver in failure_drivers(x, {"limit": failed}).singles]
    assert len(told) > 50
    assert np.mean([where in right for where in told]) > 0.8


def test_the_effect_is_cliffs_delta():
    x = draws(1, 400)["x0"]
    failed = uniforms(9, "luck", np.arange(400)) < 0.1 + 0.5 * x
    delta = np.sign(x[failed][:, None] - x[~failed][None, :]).mean()
    (drivers,) = failure_drivers({"x": x}, {"limit": failed}).singles
    assert drivers.effect == pytest.approx(delta, rel=1e-12)


def test_a_planted_pair_is_found_and_neither_of_the_two_alone():
    x = draws(10, 4000)
    failed = (x["x2"] > 0.5) == (x["x7"] > 0.5)
    failed &= uniforms(1, "luck", np.arange(4000)) < 0.08
    drivers = failure_drivers(x, {"limit": failed})
    assert drivers.singles == ()
    assert [pair.inputs for pair in drivers.pairs] == [("x2", "x7")]
    assert drivers.pairs_tested == 45
    assert drivers.pairs[0].where in (("low", "low"), ("high", "high"))
    assert drivers.pairs[0].inside_failed / drivers.pairs[0].inside_tried == pytest.approx(0.08, abs=0.04)


def test_two_drivers_that_add_are_no_pair():
    x = draws(6, 4000)
    failed = uniforms(1, "luck", np.arange(4000)) < 0.02 + 0.1 * x["x0"] + 0.1 * x["x1"]
    drivers = failure_drivers(x, {"limit": failed})
    assert {driver.inputs for driver in drivers.singles} == {("x0",), ("x1",)}
    assert drivers.pairs == ()


@pytest.mark.parametrize("n_failed", [12, 150])
def test_campaigns_without_a_driver_show_one_at_most_at_the_stated_rate(n_failed):
    singles = pairs = 0
    for seed in range(100):
        x = draws(6, 500, seed)
        failed = np.argsort(uniforms(seed, "luck", np.arange(500))) < n_failed
        drivers = failure_drivers(x, {"limit": failed})
        singles += bool(drivers.singles)
        pairs += bool(drivers.pairs)
    # of 100 campaigns 5 expected: 11 and more have a probability of 1 %
    assert singles <= 10
    assert pairs <= 10


def test_words_and_switches_drive_by_their_levels():
    n = 3000
    u, luck = draws(1, n)["x0"], uniforms(1, "luck", np.arange(n))
    word = np.array(["aim", "coast", "burn"], dtype=object)[(3.0 * u).astype(int)]
    failed = (word == "coast") & (luck < 0.05)
    drivers = failure_drivers({"word": word, "switch": luck < 0.025}, {"limit": failed})
    by_name = {driver.inputs[0]: driver for driver in drivers.singles}
    assert by_name["word"].where == ("coast",)
    assert by_name["word"].effect == pytest.approx(1.0 - ((word == "coast") & ~failed).sum() / (~failed).sum())
    assert by_name["switch"].where == ("yes",)


def test_a_level_that_spares_cases_is_named_and_its_p_value_is_fishers():
    """Fisher's exact test of each of three levels, doubled for its two sides, and times the number of levels."""
    word = np.repeat(["aim", "burn", "coast"], 50)
    failed = np.isin(np.arange(150), [*range(0, 50, 5), *range(51, 96, 5)])
    (found,) = failure_drivers({"word": word}, {"limit": failed}).singles
    assert (found.where, found.effect) == (("not coast",), pytest.approx(50 / 131))
    assert found.p_value == pytest.approx(6.0 * stats.hypergeom.cdf(0, 150, 19, 50), rel=1e-9)


def test_of_very_many_cases_all_failed_ones_are_tested_and_an_even_choice_of_the_others():
    failed = np.zeros(60_000, dtype=bool)
    failed[7::4000] = True
    rows = _tested_rows(failed)
    lost = np.flatnonzero(failed)
    assert np.isin(lost, rows).all()
    assert rows.size == lost.size + MOST_ROWS // 2
    assert (np.diff(rows) > 0).all()
    assert np.diff(rows).max() <= 12  # one of each six
    assert _tested_rows(failed[:MOST_ROWS]).size == MOST_ROWS


def test_failures_at_both_ends_are_so_named_where_one_end_has_more_of_them():
    """An eighth of the cases fail above, a fifteenth below: they were said to fail at the high end."""
    for key in range(20):
        z = np.random.Generator(np.random.Philox(key=key)).normal(size=250)
        (driver,) = failure_drivers({"a": z}, {"limit": (z > 1.15) | (z < -1.5)}).singles
        assert driver.where == ("at both ends",)


def test_sobol_points_need_more_failed_cases_and_are_not_tested_for_pairs():
    """The 14 points of 500 at the high end of the first input lie in one half of others, which have no effect."""
    names = [f"x{k}" for k in range(10)]
    inputs = dict(zip(names, map(stats.norm.ppf, unit_cube("sobol", 1, names, np.arange(500), 500)), strict=True))
    few, enough = ({"limit": inputs["x0"] > least} for least in (1.9, 1.5))
    assert len(failure_drivers(inputs, few).singles) > 1
    assert failure_drivers(inputs, few, sobol=True).undecided == ("limit",)
    found = failure_drivers(inputs, enough, sobol=True)
    assert [driver.inputs for driver in found.singles] == [("x0",)]
    assert found.pairs_tested == 0


def test_success_along_an_input_counts_its_cases_and_has_exact_limits():
    x = draws(1, 1000)["x0"]
    passed = x < 0.9
    curve = success_along(x, passed)
    assert curve.tried.tolist() == [100] * 10
    assert curve.passed.sum() == passed.sum()
    assert (curve.low[1:] > curve.high[:-1]).all()
    assert ((curve.low <= curve.middle) & (curve.middle <= curve.high)).all()
    assert (curve.lower[0], curve.upper[0]) == clopper_pearson(100, 100, 0.95)


def test_a_number_of_few_values_has_a_bin_for_each_however_rare():
    curve = success_along(np.repeat([1.0, 2.0, 5.0], [97, 2, 1]), np.arange(100) < 98)
    assert (curve.middle.tolist(), curve.tried.tolist()) == ([1.0, 2.0, 5.0], [97, 2, 1])
    assert curve.passed.tolist() == [97, 1, 0]
    assert (curve.lower[1], curve.upper[1]) == clopper_pearson(1, 2, 0.95)


@pytest.mark.parametrize("shape", [0, 1, 200, (60, 3)])
def test_ranks_and_adjusted_p_values_are_those_of_scipy(shape):
    draw = np.random.Generator(np.random.Philox(key=9))
    values = np.round(draw.normal(size=shape), 1)
    assert np.array_equal(average_ranks(values), stats.rankdata(values, axis=0))
    p_values = draw.random(40) ** 3
    assert _adjusted(p_values) == pytest.approx(stats.false_discovery_control(p_values, method="bh"), rel=1e-14)


def test_cases_without_an_input_are_tested_by_the_others():
    """Of a chain, the cases that failed upstream lack what they would have taken from there: they were left out, so
    that their failures had no driver, and those of the requirement the wrong one."""
    rng = np.random.default_rng(12)
    angle, drag = rng.uniform(-1.0, 1.0, (2, 1000))
    lost = angle > 0.3
    reach = np.where(lost, np.nan, drag - 0.5 * angle)
    beyond = lost | (reach > 0.9)
    found = failure_drivers({"angle": angle, "drag": drag, "reach": reach}, {"reach": beyond, "completed": lost})
    where = {(driver.requirement, driver.inputs[0]): (driver.where[0], driver.effect) for driver in found.singles}
    expected = (
        2.0 * stats.mannwhitneyu(angle[beyond], angle[~beyond]).statistic / (beyond.sum() * (~beyond).sum()) - 1.0
    )
    assert where["reach", "angle"] == ("high", pytest.approx(expected))
    assert where["completed", "angle"] == ("high", 1.0)
    assert where["reach", "reach"] == ("high", 1.0)
    assert found.singles_tested == 5
    assert {driver.inputs for driver in found.pairs} <= {("angle", "drag")}


def test_failed_cases_of_a_cell_are_counted_in_all_cases_of_a_large_run():
    """Three in ten cases of one cell of nine fail, as many as in any selection of cases by chance."""
    random = np.random.default_rng(1)
    x, y, chance = random.random((3, 60_000))
    cell = (x > 2.0 / 3.0) & (y > 2.0 / 3.0)
    failed = cell & (chance < 0.3)
    (pair,) = failure_drivers({"x": x, "y": y}, {"r": failed}).pairs
    assert pair.where == ("high", "high")
    assert pair.inside_failed == pytest.approx(failed.sum(), rel=0.02)
    assert pair.inside_tried == pytest.approx(cell.sum(), rel=0.02)
    assert pair.effect == pytest.approx(1.0 - (cell & ~failed).sum() / (~failed).sum(), abs=0.02)


def test_in_a_large_run_the_failures_of_one_requirement_make_no_contributor_to_another():
    x, chance = np.random.default_rng(1).random((2, 60_000))
    found = failure_drivers({"x": x}, {"by chance": chance < 0.02, "by x": x > 0.9}).singles
    assert [one.requirement for one in found] == ["by x"]
