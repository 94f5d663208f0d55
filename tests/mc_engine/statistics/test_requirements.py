"""Requirement verdicts."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from mc_engine.statistics import judge, judge_all, pass_probability, was_looked_at
from mc_engine.statistics.limits import LimitCounts

FUEL = {"name": "fuel", "metric": "propellant_kg", "at_most": 1.0, "at_least": None, "share": 0.9973, "confidence": 0.9}


def cases(passed, failed):
    """Values for a limit of 1.0, and that all were flown to their end."""
    return np.r_[np.linspace(0.1, 0.9, passed), np.linspace(1.1, 1.9, failed)], np.ones(passed + failed, dtype=bool)


def test_no_failure_in_2302_cases_shows_0999_with_90_percent_confidence():
    assert pass_probability(2302, 2302)[1] >= 0.999 > pass_probability(2301, 2301)[1]


# Smallest N that shows 0.9973 with 90 % for 0 ... 3 failures (NASA/TP-2010-216447's three-sigma level).
@pytest.mark.parametrize(("failures", "tried"), [(0, 852), (1, 1440), (2, 1970), (3, 2473)])
def test_the_verdict_turns_to_pass_at_the_known_sample_sizes(failures, tried):
    assert judge(FUEL, *cases(tried - failures, failures)).outcome == "pass"
    short = judge(FUEL, *cases(tried - failures - 1, failures), "lhs")
    assert (short.outcome, short.needed) == ("not demonstrable", tried)


@pytest.mark.parametrize("confidence", [0.5, 0.9, 0.99])
def test_a_verdict_its_failures_allowed_and_its_margin_agree_exactly_at_the_required_share(confidence):
    """Of shares within a last digit of their lower bound, one in six passed with no failures allowed and no margin."""
    for passed in range(1, 200):
        bound = pass_probability(passed, passed, confidence)[1]
        for share in (bound, np.nextafter(bound, 0.0), np.nextafter(bound, 1.0), (1.0 - confidence) ** (1.0 / passed)):
            verdict = judge({**FUEL, "share": share, "confidence": confidence}, *cases(passed, 0))
            demonstrated = verdict.outcome == "pass"
            assert (verdict.accepted is not None, verdict.margin is not None) == (demonstrated, demonstrated)


@pytest.mark.parametrize("design", ["mc", "sobol"])
def test_a_run_that_is_extended_to_the_cases_needed_demonstrates_the_share(design):
    short = judge(FUEL, *cases(498, 2), design)
    extended = [judge(FUEL, *cases(n - 2, 2), design, looked=True) for n in (short.needed - 1, short.needed)]
    assert [verdict.outcome for verdict in extended] == ["not demonstrable", "pass"]


def test_a_share_below_its_own_upper_bound_fails():
    verdict = judge(FUEL, *cases(900, 100))
    assert verdict.outcome == "fail"
    assert verdict.lower < 0.9 < verdict.upper < 0.9973


def test_failed_cases_and_numbers_that_are_none_count_against_the_requirement():
    values, ok = cases(2302, 0)
    values[:4], values[4] = np.nan, -np.inf  # which is below every limit and no number
    ok[5:8] = False
    verdict = judge(FUEL, values, ok)
    assert (verdict.passed, verdict.tried, verdict.no_number) == (2294, 2302, 8)


def test_both_limits_together_make_a_band():
    verdict = judge({**FUEL, "at_least": 0.5}, np.array([0.4, 0.5, 0.7, 1.0, 1.1]), np.ones(5, dtype=bool))
    assert verdict.passed == 3
    assert verdict.demonstrated is None
    assert verdict.enclosed is None
    assert verdict.margin is None


def test_two_limits_are_both_moved_by_the_margin_that_the_cases_show():
    """Of 1440 cases one may be outside (Wilks), so that the second nearest to a limit decides, whichever it is near."""
    values, ok = np.linspace(0.1, 0.9, 1440), np.ones(1440, dtype=bool)
    band = {**FUEL, "at_least": 0.0}
    for bad, enclosed in (([], (0.1, 0.9)), ([1.2], (0.1, 0.9)), ([-3.0], (0.1, 0.9)), ([0.02, 0.99], (0.02, 0.98))):
        flown = np.concatenate([values[len(bad) :], bad])
        verdict = judge(band, flown, ok)
        assert verdict.outcome == "pass"
        assert verdict.enclosed == pytest.approx(enclosed, abs=6e-4)
        assert verdict.margin == pytest.approx(enclosed[0], abs=6e-4)
    assert judge(band, values[1:], ok[1:]).enclosed == pytest.approx((0.1, 0.9), abs=6e-4)  # 1439 cases: the nearest
    assert judge(band, values[:800], ok[:800]).enclosed is None


@pytest.mark.parametrize("looked", [False, True])
def test_a_margin_is_not_negative_exactly_where_the_requirement_passes(looked):
    """Bounds that each left out half of what may be outside contradicted the verdict where all was on one side."""
    random = np.random.Generator(np.random.Philox(6))
    outcomes = set()
    for n in (700, 900, 2000, 5000):
        for outside in range(0, 16, 3):
            for above in (0.0, 0.5, 1.0):
                values, ok = random.uniform(0.2, 0.8, n), np.ones(n, dtype=bool)
                values[:outside] = np.where(random.random(outside) < above, 1.1, -0.1)
                verdict = judge({**FUEL, "at_least": 0.0}, values, ok, looked=looked)
                outcomes.add(verdict.outcome)
                assert (verdict.margin is not None and verdict.margin >= 0.0) == (verdict.outcome == "pass")
    assert outcomes >= {"pass", "not demonstrable"}


def test_at_least_is_at_most_turned_round():
    values, ok = cases(2000, 1)
    mirrored = judge({**FUEL, "at_most": None, "at_least": -1.0}, -values, ok)
    straight = judge(FUEL, values, ok)
    assert mirrored.passed == straight.passed
    assert mirrored.demonstrated == -straight.demonstrated
    assert mirrored.margin == pytest.approx(straight.margin)


def test_failed_cases_take_the_worst_ranks_of_the_limit_shown():
    values, ok = cases(1440, 0)
    ok[np.argmin(values)] = False  # the best value is lost, and with it a rank at the bad end
    assert judge(FUEL, values, ok).demonstrated == values.max()
    ok[np.argmin(np.where(ok, values, 9.0))] = False
    assert judge(FUEL, values, ok).demonstrated is None


def test_a_grid_gives_counts_but_no_verdict():
    verdict = judge(FUEL, *cases(5000, 0), design="grid")
    assert (verdict.outcome, verdict.passed, verdict.lower, verdict.needed) == ("not demonstrable", 5000, None, None)


# Probability that 852 cases with no failure, or 1440 with one, pass a system that just misses 0.9973.
@pytest.mark.parametrize(("tried", "accepted"), [(852, 0), (1440, 1), (2473, 3)])
def test_consumers_and_producers_risk_are_binomial(tried, accepted):
    verdict = judge(FUEL, *cases(tried - 5, 5))
    assert verdict.accepted == accepted
    assert verdict.consumer_risk == pytest.approx(binom.cdf(accepted, tried, 0.0027), rel=1e-9)
    assert 0.095 < verdict.consumer_risk <= 0.1
    assert verdict.producer_risk == pytest.approx(binom.sf(accepted, tried, 0.00135), rel=1e-9)


def test_the_number_accepted_is_where_the_verdict_turns():
    for tried in (852, 3000):
        for looked in (False, True):
            accepted = judge(FUEL, *cases(tried, 0), looked=looked).accepted
            if accepted is not None:
                assert judge(FUEL, *cases(tried - accepted, accepted), looked=looked).outcome == "pass"
                assert judge(FUEL, *cases(tried - accepted - 1, accepted + 1), looked=looked).outcome != "pass"


@pytest.mark.parametrize(
    ("manifest", "n_cases", "looked"),
    [
        ({"campaign": {"cases": 100}}, 100, False),
        ({"campaign": {"cases": 100}}, 200, True),
        ({"campaign": {"cases": 100}, "looks": [100, 150]}, 100, True),
        ({"campaign": {"cases": 100}, "looks": []}, 100, False),
        ({}, 100, False),
    ],
)
def test_a_run_was_looked_at_when_it_flew_by_looks_or_was_extended(manifest, n_cases, looked):
    assert was_looked_at(manifest, n_cases) is was_looked_at(manifest, n_cases, n_cases) is looked
    assert was_looked_at(manifest, n_cases, n_cases - 1)  # interrupted


def test_a_shard_has_fewer_cases_as_it_was_to_have():
    part = {"campaign": {"cases": 100}, "shard": {"number": 1, "of": 2, "first": 0, "stop": 50}}
    assert not was_looked_at(part, 100, 50)
    assert was_looked_at(part, 100, 49)


SPEED = {**FUEL, "name": "speed", "metric": "speed_m_s", "at_most": None, "at_least": 5.0, "confidence": 0.95}


def both(fuel, speed, ok=None, **changes):
    table = {"propellant_kg": np.asarray(fuel, dtype=float), "speed_m_s": np.asarray(speed, dtype=float)}
    ok = np.ones(len(fuel), dtype=bool) if ok is None else ok
    return judge_all([FUEL, SPEED], table.__getitem__, ok, **changes)


def test_the_joint_verdict_counts_cases_inside_every_limit_at_once():
    verdicts, joint = both([0.5, 1.5, 0.5, 1.5, np.nan], [6.0, 6.0, 4.0, 4.0, 6.0])
    assert [verdict.passed for verdict in verdicts] == [2, 3]
    assert (joint.passed, joint.tried, joint.no_number) == (1, 5, 1)


def test_counts_of_limits_add_up_over_the_parts_of_a_table():
    table = {"propellant_kg": np.array([0.5, 1.5, 0.5, 1.5, np.nan]), "speed_m_s": np.array([6.0, 6.0, 4.0, 4.0, 6.0])}
    counts = LimitCounts([FUEL, SPEED])
    for part in (slice(0, 2), slice(2, 5)):
        counts.add(lambda name, part=part: table[name][part], np.ones(5, dtype=bool)[part])
    assert (counts.outside(0), counts.outside(1), counts.outside()) == (3, 2, 4)
    assert (counts.without_number(0), counts.without_number(1), counts.without_number()) == (1, 0, 1)


def test_a_joint_verdict_names_the_requirement_that_fails_it_alone():
    fuel = np.full(2000, 0.5)
    fuel[:100] = 1.5
    table = {"propellant_kg": fuel, "speed_m_s": np.full(2000, 6.0)}
    joint = judge_all([FUEL, {**SPEED, "share": 0.5}], table.__getitem__, np.ones(2000, dtype=bool))[1]
    assert (joint.outcome, joint.failing) == ("fail", ("fuel",))
    assert joint.remark == "fuel fails with confidence shared"
    three = replace(joint, failing=("fuel", "load", "miss"))
    assert three.remark == "fuel, load and miss fail with confidence shared"
    passing = both(np.full(5000, 0.5), np.full(5000, 6.0))[1]
    assert (passing.outcome, passing.failing, passing.remark) == ("pass", (), "")


def test_the_joint_share_is_one_less_what_each_may_miss_and_its_confidence_the_smallest():
    joint = both([0.5] * 1200, [6.0] * 1200)[1]
    assert joint.share == pytest.approx(1.0 - 0.0027 - 0.0027)
    assert joint.confidence == 0.9
    assert joint.outcome == "pass"
    assert joint.lower == pytest.approx(0.1 ** (1.0 / 1200.0))


@pytest.mark.parametrize(("shares", "together"), [((0.9, 0.8), 0.7), ((0.5, 0.5), None), ((0.4, 0.5), None)])
def test_requirements_that_leave_nothing_to_ask_for_together_have_no_joint_verdict(shares, together):
    asked = [{**FUEL, "share": shares[0]}, {**SPEED, "share": shares[1]}]
    table = {"propellant_kg": np.full(50, 0.5), "speed_m_s": np.full(50, 6.0)}
    verdicts, joint = judge_all(asked, table.__getitem__, np.ones(50, dtype=bool))
    assert (joint and joint.share) == (together and pytest.approx(together))
    alone = judge(asked[0], table["propellant_kg"], np.ones(50, dtype=bool))
    assert (verdicts[0].outcome, verdicts[0].lower) == (alone.outcome, alone.lower)


def test_requirements_that_pass_alone_can_fail_together():
    fuel, speed = np.full(10_000, 0.5), np.full(10_000, 6.0)
    fuel[:19], speed[19:38] = 1.5, 4.0
    verdicts, joint = both(fuel, speed)
    assert [verdict.outcome for verdict in verdicts] == ["pass", "not demonstrable"]
    assert (joint.passed, joint.outcome) == (10_000 - 38, "not demonstrable")
    assert joint.lower > joint.share  # shown, but speed is not
    assert joint.needed == verdicts[1].needed
    fuel, speed = np.full(10_000, 0.5), np.full(10_000, 6.0)
    fuel[:36], speed[36:72] = 1.5, 4.0
    verdicts, joint = both(fuel, speed)
    assert [verdict.shared_outcome for verdict in verdicts] == ["not demonstrable", "not demonstrable"]
    assert joint.outcome == "fail"  # 72 in all are too many, 36 of each are not surely


def test_the_cases_needed_together_are_enough_for_a_requirement_that_has_passed_once_the_run_is_extended():
    asked = [{**FUEL, "share": 0.9}, {**SPEED, "share": 0.96, "confidence": 0.9}]

    def judged(n, looked):
        table = {"propellant_kg": np.full(n, 0.5), "speed_m_s": np.full(n, 6.0)}
        table["propellant_kg"][:2] = 1.5
        return judge_all(asked, table.__getitem__, np.ones(n, dtype=bool), looked=looked)

    verdicts, joint = judged(56, False)
    assert [verdict.outcome for verdict in verdicts] == ["pass", "not demonstrable"]  # 52 are enough for fuel
    assert joint.needed > verdicts[1].needed
    for n, outcome in ((joint.needed, "pass"), (joint.needed - 1, "not demonstrable")):
        assert judged(n, True)[1].outcome == outcome


def test_a_shared_confidence_asks_more_of_each():
    alone = both([0.5] * 1000, [6.0] * 1000)[0][0]
    assert (alone.outcome, alone.shared_outcome) == ("pass", "not demonstrable")  # 852 at 90 %, 1259 at 96.67 %
    verdicts, joint = both([0.5] * 900, [6.0] * 900)
    assert joint.lower > joint.share
    assert (joint.outcome, joint.shared_outcome) == ("not demonstrable", "not demonstrable")  # speed is not shown
    verdicts, joint = both([0.5] * 500, [6.0] * 500)
    assert joint.needed == verdicts[1].needed > verdicts[0].needed == 1104  # speed, with 95 %, takes the most
    enough = both([0.5] * 1259, [6.0] * 1259)[0][0]
    assert enough.shared_outcome == "pass"
    assert judge(FUEL, *cases(852, 0)).shared_outcome == "pass"  # a single one shares with none


@pytest.mark.parametrize("looked", [False, True])
@pytest.mark.parametrize("n", [0, 1, 2, 50])
@pytest.mark.parametrize("kind", ["constant", "not a number", "failed", "infinite"])
def test_runs_of_hardly_anything_are_judged_together_without_a_warning(n, kind, looked):
    value = {"constant": 0.5, "not a number": np.nan, "failed": 0.5, "infinite": np.inf}[kind]
    verdicts, joint = both(np.full(n, value), np.full(n, 6.0), np.full(n, kind != "failed"), looked=looked)
    usable = kind == "constant"
    assert joint.passed == (n if usable else 0)
    assert verdicts[0].no_number == (0 if usable else n)
    assert verdicts[0].outcome == ("fail" if n and not usable else "not demonstrable")
    assert verdicts[0].demonstrated is None
