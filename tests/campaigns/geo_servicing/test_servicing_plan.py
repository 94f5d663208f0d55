"""Drift model, Bellman's recursion and the designed corrections."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from servicing_flights import KEPLER, NOMINAL, SOURCE_BURNS, fly_one
from servicing_twin import MU, R0, RATE, SIDEREAL_DAY, Twin, sidereal

from campaigns.geo_servicing import drift_model as drift
from campaigns.geo_servicing.drift_model import best_corrections, planned_cost
from campaigns.geo_servicing.inspection import correction
from campaigns.geo_servicing.model import MODEL
from campaigns.geo_servicing.published.values import craft_of
from mc_engine.errors import ModelError
from mc_engine.flight.flight import settings_of

PERFECT = {"navigation": "perfect", "schedule": "designed"}
DAY = 86_400.0
PROJECT = str(Path(__file__).parents[3])
DRIFT = 360.0 * (SIDEREAL_DAY - 85_796.0) / 85_796.0  # deg/rev at the start
SHORTEST = np.array([0.5, 0.25, 0.25])  # rev


def velocity_changes():
    """The source's burns [m/s]: 2500 kg, 1 N, 1600 s."""
    exhaust, mass, out = 1600.0 * 9.80665, 2500.0, []
    for _, burn, sign in SOURCE_BURNS:
        out.append(sign * exhaust * np.log(mass / (mass - burn / exhaust)))
        mass -= burn / exhaust
    return np.array(out)


def test_the_drift_of_a_velocity_change_and_the_sources_burns_are_those_of_the_digest():
    assert np.degrees(drift.DRIFT_PER_DV) == pytest.approx(-0.35126, abs=5e-6)
    assert velocity_changes() == pytest.approx([3.0908, 1.8281, -0.5163], rel=1e-3)


def test_the_drift_model_ends_the_sources_corrections_where_the_digest_has_it():
    y, v, before = -2.5, DRIFT, 0.0
    u = np.degrees(drift.DRIFT_PER_DV) * velocity_changes()
    for (coast, burn, _), change in zip(SOURCE_BURNS, u, strict=True):
        y, v = y + v * (before + coast + 0.5 * burn) / SIDEREAL_DAY, v + change
        before = 0.5 * burn
    y += v * before / SIDEREAL_DAY
    assert (y, v) == (pytest.approx(-0.03686, abs=1e-4), pytest.approx(-0.00196, abs=1e-4))


def test_the_perturbation_coefficients_are_those_of_the_digest():
    b_s, b_r = np.degrees(drift.perturbation_coefficients(4.417e-8, -8.26e-6))
    assert (b_s, b_r) == (pytest.approx(-6.7e-4, abs=0.05e-4), pytest.approx(0.0265, abs=1e-4))
    assert drift.after_correction(1.0, 2.0, 0.5, 2.0, b_s=0.25, b_r=0.1) == pytest.approx((7.2, 3.5))


def test_the_mean_pull_of_a_plan_is_that_of_the_geopotential_and_of_the_twins_sun_and_moon():
    quiet = {"sun_and_moon": False, "sunlight": False}
    assert craft_of(**KEPLER).pull == pytest.approx((0.0, 0.0), abs=1e-15)
    earth = craft_of(**quiet).pull
    assert earth == pytest.approx(drift.perturbation_coefficients(4.417e-8, -8.26e-6), rel=5e-3)
    twin, radial = Twin(58484.5, degree=0), []
    aim = sidereal(58484.5) + np.radians(95.0)
    for t in np.linspace(0.0, SIDEREAL_DAY, 24, endpoint=False):
        up = np.array([np.cos(aim + RATE * t), np.sin(aim + RATE * t), 0.0])
        radial.append(up @ twin.acceleration(t, R0 * up) + MU / R0**2)
    bodies = craft_of(sunlight=False).pull[1] - earth[1]
    assert bodies == pytest.approx(drift.perturbation_coefficients(0.0, np.mean(radial))[1], rel=1e-3)


def test_brake_only_gives_the_first_coast_of_the_digest():
    """Last correction 0.1 deg/rev, three corrections, least coasts: 1.469 rev; it ends at the place without drift."""
    u, t = drift.braking(-2.5, DRIFT, 0.1, SHORTEST)
    assert t[0] == pytest.approx(1.469, abs=1e-3)
    assert u[-1] == pytest.approx(-0.1)
    assert_at_the_place_without_drift(DRIFT, u, t)


def assert_at_the_place_without_drift(v, u, t):
    """2.5 deg away with a drift v at first, corrections u after the coasts t."""
    drifts = v + np.concatenate([[0.0], np.cumsum(u)])
    assert -2.5 + (drifts[:-1] * t).sum() == pytest.approx(0.0, abs=1e-12)
    assert drifts[-1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("shortest", [np.array([0.5, 0.8]), SHORTEST])
def test_the_fastest_profile_of_two_impulses_or_more_ends_at_the_place_without_drift(shortest):
    u, t = drift.fastest(-2.5, 1.5, 0.1, shortest)
    assert_at_the_place_without_drift(1.5, u, t)
    assert (t >= shortest).all()
    assert len(t) > 2 or (t == shortest).all()


def test_the_fastest_profile_is_faster_than_the_braking_one():
    t = drift.fastest(-2.5, 1.5, 0.1, SHORTEST)[1]
    assert t.sum() < drift.braking(-2.5, 1.5, 0.1, SHORTEST)[1].sum()


def test_the_largest_last_correction_is_the_digests():
    assert drift.largest_last(0.05, 0.0209, 4e-4, 0.005, 0.5) == pytest.approx(0.216)


def random_system(seed, n=4):
    rng = np.random.default_rng(seed)
    t = rng.uniform(0.25, 2.0, n)
    a = np.array([[[1.0, one], [0.0, 1.0]] for one in t])
    half = rng.normal(size=(2, 2))
    return a, np.column_stack([t, np.ones(n)]), 0.3, half @ half.T + np.eye(2)


def mean_cost(a, b, weight, terminal, sigma, gains, first):
    """The mean cost of corrections by any such gains from the state `first`, by its second moments."""
    second, cost = np.outer(first, first), 0.0
    for k in range(len(a)):
        u2 = gains[k] @ second @ gains[k]
        cost += weight * u2
        closed = a[k] - np.outer(b[k], gains[k])
        second = closed @ second @ closed.T + sigma**2 * u2 * np.outer(b[k], b[k])
    return float(cost + np.trace(terminal @ second))


@pytest.mark.parametrize("seed", range(5))
def test_no_change_of_any_gain_lowers_the_mean_cost(seed):
    system, first = (*random_system(seed), 0.3), np.array([1.3, -0.4])
    gains, costs = best_corrections(*system)
    least = mean_cost(*system, gains, first)
    assert least == pytest.approx(first @ costs[0] @ first, rel=1e-12)
    rng = np.random.default_rng(seed)
    for _ in range(50):
        assert mean_cost(*system, gains + 1e-2 * rng.normal(size=(4, 2)), first) > least


def test_the_mean_cost_is_that_of_many_noisy_trials():
    a, b, weight, terminal = random_system(7)
    gains, _ = best_corrections(a, b, weight, terminal, 0.3)
    rng, n = np.random.default_rng(1), 200_000
    x, cost = np.tile([1.3, -0.4], (n, 1)), np.zeros(n)
    for k in range(4):
        u = -x @ gains[k]
        cost += weight * u**2
        x = x @ a[k].T + np.outer(u * (1.0 + 0.3 * rng.normal(size=n)), b[k])
    cost += np.einsum("ni,ij,nj->n", x, terminal, x)
    exact = mean_cost(a, b, weight, terminal, 0.3, gains, [1.3, -0.4])
    assert cost.mean() == pytest.approx(exact, abs=4.0 * cost.std() / np.sqrt(n))


def test_one_step_of_the_recursion_is_the_inspection_law():
    t, chi1, chi2, weight, sigma = 1.7, 0.6, 0.2, 0.1, 0.05
    terminal = np.array([[1.0, chi2], [chi2, chi1]])
    step = (np.array([[[1.0, t], [0.0, 1.0]]]), np.array([[t, 1.0]]))
    gain = best_corrections(*step, weight, terminal, sigma)[0][0]
    y, v = 0.3, -0.7
    assert -gain @ [y, v] == pytest.approx(correction(y, v, t, chi1, chi2, weight, sigma), rel=1e-12)


def test_errors_of_the_plan_that_are_answered_cost_what_the_recursion_says():
    a, b, _, terminal = random_system(3)
    u = np.array([1.0, -0.5, 0.2, 0.1])
    gains, costs = best_corrections(a, b, 1e-9, terminal, 0.0)
    rng, n = np.random.default_rng(2), 200_000
    x = np.zeros((n, 2))
    for k in range(4):  # deviations from the plan; the answers themselves are exact
        x = x @ (a[k] - np.outer(b[k], gains[k])).T + np.outer(0.01 * u[k] * rng.normal(size=n), b[k])
    cost = np.einsum("ni,ij,nj->n", x, terminal, x)
    expected = planned_cost(b, costs, u, 0.01)
    assert cost.mean() == pytest.approx(expected, abs=4.0 * cost.std() / np.sqrt(n) + 1e-6 * expected)


@pytest.fixture(scope="module")
def designed():
    return fly_one(**PERFECT)


def test_the_designed_corrections_meet_all_tolerances_for_less_than_the_sources(designed):
    assert abs(designed["daily_mean_longitude_deviation_deg"]) < 1e-3
    assert abs(designed["longitude_deviation_deg"]) < 0.05
    assert abs(designed["mean_longitude_deviation_deg"]) < 0.05
    assert designed["actual_drift_rate_deg_rev"] == pytest.approx(0.012, abs=5e-4)
    assert abs(designed["actual_period_error_s"]) < 5.0
    assert abs(designed["period_error_s"]) < 5.0
    assert designed["eccentricity"] < 4e-4
    assert designed["delta_v_m_s"] < 5.43
    assert designed["transfer_time_s"] < 10.0 * DAY


def test_a_plan_from_the_east_that_settles_slowly_meets_all_tolerances():
    """Its last correction has nothing to do, so that each pass of the design only halves what is lacking."""
    place = {"target_longitude_deg": -120.0, "initial_longitude_deg": -117.5, "initial_period_s": 86_532.0}
    flown = fly_one(**PERFECT, **place)
    assert abs(flown["daily_mean_longitude_deviation_deg"]) < 1e-3
    assert abs(flown["actual_period_error_s"]) < 5.0
    assert abs(flown["period_error_s"]) < 5.0
    assert flown["eccentricity"] < 4e-4


PLAN = """
import numpy as np
from campaigns.geo_servicing.model import MODEL
from mc_engine.flight.flight import settings_of

codes = np.array([setting.code(setting.default) for setting in MODEL.settings])
print(settings_of(MODEL, codes).tables.tobytes().hex())
"""


def test_the_plan_is_the_same_whatever_threads_blas_has(tmp_path):
    (tmp_path / "plan.py").write_text(PLAN)
    plans = []
    for threads in "12":
        chosen = {"OPENBLAS_NUM_THREADS": threads, "MC_ENGINE_CACHE": str(tmp_path / threads), "PYTHONPATH": PROJECT}
        command = [sys.executable, tmp_path / "plan.py"]
        plans.append(subprocess.run(command, env=os.environ | chosen, capture_output=True, check=True).stdout)
    assert plans[0] == plans[1]


@pytest.mark.parametrize(
    ("first", "least", "longest", "last", "chosen"),
    [
        (12.0, 6.0, 10.0, 0.216, {}),
        (30.0, 9.0, 3.0, 0.08, {"first_coast_h": 30.0, "least_coast_h": 9.0, "longest_transfer_days": 3.0}),
    ],
)
def test_the_plan_keeps_its_limits_on_coasts_time_and_last_burn(first, least, longest, last, chosen):
    """The standard last correction is the largest whose error of thrust ends within the tolerances (3 sigma)."""
    chosen = chosen | {"largest_last_deg_rev": last} if chosen else chosen
    codes = np.array([one.code((NOMINAL | PERFECT | chosen)[one.name]) for one in MODEL.settings])
    rows = settings_of(MODEL, codes).tables[1:19].reshape(3, 6)
    burns = 2500.0 * np.abs(rows[:, 1])  # of 1 N; longer than they are by a thousandth
    ends = rows[:, 0] + burns
    assert rows[0, 0] >= first * 3600.0 - 1e-3
    assert (rows[1:, 0] - ends[:-1] >= least * 3600.0 - 10.0).all()
    assert ends[-1] < longest * DAY
    assert abs(np.degrees(drift.DRIFT_PER_DV) * rows[-1, 1]) <= last + 1e-6
    assert np.abs(rows[:, 1]).sum() < 5.43


@pytest.mark.parametrize("least", [6.0, 0.0])
def test_a_plan_that_begins_with_a_burn_is_flown_from_its_start(least):
    """Warnings are errors here: without a least coast, the first approximation has no two impulses at once."""
    at_once = {"aim": "time", "first_coast_h": 0.0, "eccentricity_tolerance": 0.01, "initial_longitude_deg": 88.0}
    flown = fly_one(**PERFECT, **at_once, least_coast_h=least)
    assert flown["corrections"] == 3.0
    assert abs(flown["daily_mean_longitude_deviation_deg"]) < 1e-3


def test_two_corrections_cannot_keep_all_limits_and_that_is_said():
    with pytest.raises(ModelError, match="no phasing plan"):
        fly_one(**PERFECT, planned_corrections=2.0)


def test_coasts_longer_than_the_whole_transfer_may_take_are_refused():
    with pytest.raises(ModelError, match=r"coasts of 3 corrections take 1\.00 days: give more longest_transfer_days"):
        fly_one(**PERFECT, longest_transfer_days=0.9)


def test_a_flight_that_ends_before_the_day_after_a_designed_transfer_is_refused():
    """Its metrics would be missing: the transfer takes 2.07 days, and the place is that of the day after."""
    with pytest.raises(ModelError, match=r"take 3\.07 days: give duration_days 3\.2 or more"):
        fly_one(**PERFECT, duration_days=3.0)
    row = fly_one(**PERFECT, duration_days=3.2)
    assert abs(row["daily_mean_longitude_deviation_deg"]) < 1e-3
