"""The promised range, sampled: inclinations of 0 to 60 degrees, thrusts of 5 to 40 kN, no guess given for any point."""

import numpy as np
import pytest
from geo_sequences import MASS, PARKING, elements, propellant_kg, solution

from campaigns.geo_injection.design.impulsive import propellant_share, two_impulses
from campaigns.geo_injection.design.optimality import arcs
from mc_engine.errors import ModelError

STRONG = 9000.0  # N: from here on two burns are short enough to be the best that may be done


def points(seed, n):
    """(inclination [deg], thrust [N]), every fourth one nearly planar."""
    random = np.random.default_rng(seed)
    for k in range(n):
        inclination = 10.0 ** random.uniform(-3.0, 0.5) if k % 4 == 3 else random.uniform(0.0, 60.0)
        yield float(inclination), float(5e3 * 8.0 ** random.uniform())


def assert_is_an_optimum(burns, inclination, thrust):
    """The propellant [kg] of the optimum, which keeps every condition of one and is above its bound of impulses."""
    best = solution(burns, inclination, thrust)
    problem = best.problem
    assert elements(best.states[-1]) == pytest.approx((42_164.137, 0.0, 0.0), abs=1e-6)
    for arc in arcs(best, 60):
        assert np.abs(arc.hamiltonian).max() < 1e-9
        if arc.burning:
            assert (arc.switching < 1e-9).all()
        elif burns == 3 or thrust > STRONG:
            assert (arc.switching > -1e-9).all()
    two = two_impulses(problem.plane_change, problem.ratio)
    used = MASS * problem.flow * best.durations.sum()
    assert used > MASS * propellant_share(two.first + two.second, problem.exhaust)
    return used


@pytest.mark.parametrize(("inclination", "thrust"), list(points(6, 4)))
def test_two_and_three_burns_are_optima_where_the_range_is_sampled(inclination, thrust):
    two, three = (assert_is_an_optimum(burns, inclination, thrust) for burns in (2, 3))
    assert three < two


@pytest.mark.slow
def test_hardly_a_point_of_the_range_has_no_optimum_and_then_it_is_said():
    failed = []
    for inclination, thrust in points(7, 60):
        for burns in (2, 3):
            try:
                assert_is_an_optimum(burns, inclination, thrust)
            except ModelError as error:
                failed.append(str(error))
    assert all("the search for" in text for text in failed)
    assert len(failed) <= 2, failed


@pytest.mark.parametrize("thrust", [7000.0, 5000.0])
def test_weak_thrust_comes_back_to_the_first_perigee_and_waits_for_no_revolution(thrust):
    """Planar, three burns: growing the added burn at the wanted thrust led back to the propellant of two burns."""
    assert assert_is_an_optimum(3, 0.0, thrust) < 0.985 * propellant_kg(2, 0.0, thrust)
    best = solution(3, 0.0, thrust)
    a_km, _, _ = elements(best.states[1])  # at the end of the first burn
    assert best.coasts[0] < 2.0 * np.pi * (1e3 * a_km / PARKING) ** 1.5
