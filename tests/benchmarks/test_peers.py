"""The peers of the `test` environment fly to the same places as the engine; how fast is printed, not judged."""

import numpy as np
import pytest

from tests.benchmarks import peers, work_precision
from tests.benchmarks.peer_codes import engine, handwritten, problems, scipy_peer
from tests.benchmarks.peer_codes.contest import Contest, hold

OTHERS = ("transfer", "ballistic", "lifting")
A_MILLIMETRE = 1e-3
TEN_MICROMETRES = 1e-5


def told(contest):
    """Results of a short contest, printed."""
    results = hold(contest, 1, turn=0.005, all_cores=False)
    print("\n" + "\n".join(peers.lines(results)))
    return results


@pytest.mark.slow
@pytest.mark.parametrize("key", ["orbit", *OTHERS])
def test_engine_and_scipy_reach_the_same_millimetre_of_a_flight_in_80_bits(key):
    problem = problems.BY_KEY[key]()
    entrants = [engine.entrant(problem, "DOP853"), scipy_peer.entrant(problem)]
    for result in told(Contest(problem.title, entrants, A_MILLIMETRE)):
        assert result.error <= A_MILLIMETRE
        assert result.error > 1e-7  # no better than it was asked for: the error is measured, not nought


@pytest.mark.skipif(not handwritten.compilers(), reason="neither g++ nor clang++ is here")
@pytest.mark.parametrize(
    ("key", "step", "bound"),
    [("orbit", 60.0, TEN_MICROMETRES), pytest.param("satellite", 0.01, 1e-13, marks=pytest.mark.slow)],
)
def test_lanes_written_by_hand_take_the_engines_steps(key, step, bound):
    problem = problems.BY_KEY[key]().shortened(8)
    entrants = [engine.entrant(problem, "RK4", 8, (step,)), *handwritten.entrants(problem, step)]
    ours, *theirs = [one.build(problem, step, 1)() for one in entrants]
    for end in theirs:
        assert abs(end - ours)[slice(*problem.compared)].max() <= bound
    told(Contest(problem.title, entrants))


@pytest.mark.parametrize("key", ["orbit", pytest.param("satellite", marks=pytest.mark.slow)])
def test_one_case_at_a_time_ends_on_the_same_bits(key):
    problem = problems.BY_KEY[key]().shortened(8)
    alone, together = (engine.kernel_flight(problem, "RK4", 0.1 if key == "satellite" else 60.0, w)() for w in (1, 8))
    assert np.array_equal(alone, together)


def test_the_reference_closes_a_revolution_of_a_point_mass_to_a_nanometre():
    from tests.benchmarks import reference
    from tests.benchmarks.peer_codes import rates

    first = problems.two_body().first[:, :4].astype(reference.Real)
    mu = reference.Real(rates.MU_EARTH)
    axis = 1 / (2 / np.sqrt((first[:3] ** 2).sum(axis=0)) - (first[3:] ** 2).sum(axis=0) / mu)
    period = 2 * np.arccos(reference.Real(-1)) * np.sqrt(axis**3 / mu)
    end = first
    for _ in range(24):
        end = reference.great_step(lambda t, s: np.array(rates.two_body(np, s, ())), 0 * period, end, period / 24)
    assert abs(end - first)[:3].max() < 1e-9


@pytest.mark.slow
def test_a_day_keeps_energy_and_angular_momentum_to_the_order_of_the_method():
    rough, fine = work_precision.drift("RK4", 60.0), work_precision.drift("RK4", 30.0)
    for coarse, half in zip(rough, fine, strict=True):
        assert 4.5 < np.log2(coarse / half) < 5.5  # a fourth-order method loses energy with the fifth power
    assert max(work_precision.drift("DOP853", 1e-13)) < 1e-12


def test_a_peer_that_is_not_installed_is_named_and_is_no_error(monkeypatch):
    monkeypatch.setattr(peers, "CODES", dict.fromkeys(peers.CODES, "of_no_such_name"))
    contests = peers.contests(short=True)
    assert {name for contest in contests for name in contest.missing} >= set(peers.CODES)
    basilisk = next(contest for contest in contests if "Basilisk" in contest.missing)
    assert any(r.peer == "Basilisk" and r.note == "not installed" for r in told(basilisk))


def test_the_reference_and_a_taylor_series_in_80_bits_agree_to_fifteen_digits():
    heyoka = pytest.importorskip("heyoka")
    from tests.benchmarks.peer_codes import taylor

    real = np.longdouble
    for key in ("orbit", "ballistic", "lifting"):
        problem = problems.BY_KEY[key]()
        equations, event = taylor.system(problem)
        keys = {"pars": problem.parameters[:, 0].astype(real), "fp_type": real, "tol": real(1e-20)}
        if event is not None:
            falling = heyoka.event_direction.negative
            keys["t_events"] = [heyoka.t_event(event, direction=falling, fp_type=real)]
        taylor_series = heyoka.taylor_adaptive(equations, problem.first[:, 0].astype(real), compact_mode=True, **keys)
        taylor_series.propagate_until(real(problem.duration))
        apart = taylor_series.state[:3] - problems.reference_of(key)[:3, 0]
        assert np.sqrt((apart**2).sum()) < 2e-15 * 6.8e6


@pytest.mark.skipif(not handwritten.compilers(), reason="no C++ compiler is installed")
def test_the_peers_leave_the_arithmetic_of_this_process_alone():
    handwritten.library(handwritten.compilers()[0])
    assert np.float64(5e-324) * 1.0 > 0.0
