"""The free-time optimum against independent numbers and what makes it one; no guess is given for any point."""

from dataclasses import replace

import numpy as np
import pytest
from geo_arcs import arcs
from geo_sequences import PARKING, elements, impulses_kg, sequence, solution, used_kg

from campaigns.geo_injection.design.continuation import optimum
from campaigns.geo_injection.design.optimal import is_optimal
from mc_engine.errors import ModelError

# Burns, inclination [deg], and the propellant [kg] that the source prints (tables 2 to 8).
TOTALS = [(2, 28.5, 16_775.0), (2, 55.0, 18_411.0), (2, 0.0, 15_931.0), (3, 28.5, 16_496.0), (3, 0.0, 15_672.0)]
STRONG = 9000.0  # N: from here on two burns are short enough to be the best that may be done


@pytest.mark.parametrize(("burns", "inclination", "published"), TOTALS)
def test_totals_lie_between_two_impulses_and_the_published_ones(burns, inclination, published):
    best = solution(burns, inclination)
    assert impulses_kg(best.problem) < used_kg(best) < published
    a, e, i = elements(best.states[-1])
    assert a == pytest.approx(42_164.137, abs=1e-6)
    assert e < 1e-9
    assert i < 1e-8


@pytest.mark.parametrize(("burns", "inclination"), [(n, i) for n, i, *_ in TOTALS])
def test_the_hamiltonian_is_zero_along_every_arc_and_thrust_pays_exactly_where_it_is_on(burns, inclination):
    flown = arcs(solution(burns, inclination))
    assert [arc.burning for arc in flown] == [True, False] * (burns - 1) + [True]
    for arc in flown:
        assert np.abs(arc.hamiltonian).max() < 1e-9
        inside = arc.switching[5:-5] if arc.burning else -arc.switching[5:-5]
        assert (inside < -1e-6).all()
        assert np.abs(arc.switching[[0, -1]])[arc.t[[0, -1]] > 0.0].max() < 1e-9
    assert is_optimal(solution(burns, inclination))


def test_two_burns_of_a_weak_thrust_are_told_from_an_optimum():
    """Within the long first burn thrust does not pay: two burns in its place save propellant."""
    two = solution(2, 0.0, 5e3)
    assert not is_optimal(two)
    assert arcs(two)[0].switching.max() > 1e-3
    assert is_optimal(solution(3, 0.0, 5e3))


def test_the_first_burn_is_about_the_ascending_node():
    for burns, inclination, *_ in TOTALS[:2]:
        start, end = solution(burns, inclination).states[:2]
        assert start[2] < 0.0 < end[2]
        assert start[0] > 0.0


# Corners and middle of the range that is promised.
@pytest.mark.parametrize("burns", [2, 3])
@pytest.mark.parametrize(
    ("inclination", "thrust"),
    [
        (60.0, 4e4),
        (0.0, 5e3),
        pytest.param(60.0, 5e3, marks=pytest.mark.slow),
        pytest.param(0.1, 4e4, marks=pytest.mark.slow),
        pytest.param(3.0, 1e4, marks=pytest.mark.slow),
    ],
)
def test_it_converges_from_0_to_60_degrees_and_from_5_to_40_kilonewtons(burns, inclination, thrust):
    best = solution(burns, inclination, thrust)
    assert elements(best.states[-1]) == pytest.approx((42_164.137, 0.0, 0.0), abs=1e-6)
    assert used_kg(best) > impulses_kg(best.problem)


def points(seed, n):
    """(inclination [deg], thrust [N]) in the range, every fourth one nearly planar."""
    random = np.random.default_rng(seed)
    for k in range(n):
        inclination = 10.0 ** random.uniform(-3.0, 0.5) if k % 4 == 3 else random.uniform(0.0, 60.0)
        yield float(inclination), float(5e3 * 8.0 ** random.uniform())


def assert_is_an_optimum(burns, inclination, thrust):
    """The propellant [kg] of the optimum, which keeps every condition of one and is above its bound of impulses.

    Two burns of a weak thrust are only the best of their kind: within a long burn thrust need not pay.
    """
    best = solution(burns, inclination, thrust)
    assert elements(best.states[-1]) == pytest.approx((42_164.137, 0.0, 0.0), abs=1e-6)
    flown = arcs(best, 60)
    assert is_optimal(best) == all(((arc.switching if arc.burning else -arc.switching) < 1e-9).all() for arc in flown)
    for arc in flown:
        assert np.abs(arc.hamiltonian).max() < 1e-9
        if burns == 3 or thrust > STRONG:
            assert ((arc.switching if arc.burning else -arc.switching) < 1e-9).all()
    assert used_kg(best) > impulses_kg(best.problem)
    return used_kg(best)


STEEP, NEARLY_PLANAR = list(points(6, 4))[2:]


@pytest.mark.parametrize(("inclination", "thrust"), [pytest.param(*STEEP, marks=pytest.mark.slow), NEARLY_PLANAR])
def test_two_and_three_burns_are_optima_where_the_range_is_sampled(inclination, thrust):
    two, three = (assert_is_an_optimum(burns, inclination, thrust) for burns in (2, 3))
    assert three < two


@pytest.mark.parametrize(
    ("inclination", "ratio"), [(28.5, 12.2), (0.0, 60.0), (60.0, 45.0), (90.0, 400_000.0 / 6578.137)]
)
def test_a_distant_circle_is_reached_in_its_own_direction_for_what_two_impulses_need(inclination, ratio):
    problem = replace(sequence(2, inclination).problem().with_thrust(100.0), ratio=ratio)
    best = optimum(problem)
    assert used_kg(best) == pytest.approx(impulses_kg(problem), rel=1e-4)
    end = best.states[-1]
    assert np.cross(end[:3], end[3:6])[2] == pytest.approx(np.sqrt(ratio), rel=1e-9)


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


@pytest.mark.parametrize("thrust", [pytest.param(7000.0, marks=pytest.mark.slow), 5000.0])
def test_weak_thrust_comes_back_to_the_first_perigee_and_waits_for_no_revolution(thrust):
    """Planar, three burns: growing the added burn at the wanted thrust led back to the propellant of two burns."""
    assert assert_is_an_optimum(3, 0.0, thrust) < 0.985 * used_kg(solution(2, 0.0, thrust))
    best = solution(3, 0.0, thrust)
    a_km, _, _ = elements(best.states[1])  # at the end of the first burn
    assert best.coasts[0] < 2.0 * np.pi * (1e3 * a_km / PARKING) ** 1.5


def test_a_sequence_that_burns_more_than_the_stage_has_is_refused_with_how_far_the_search_got():
    # an exhaust speed of 700 m/s would need a mass ratio of 300 and arcs of most of the parking orbit
    problem = sequence(2, 28.5).problem()
    with pytest.raises(ModelError, match=r"search for the optimal .*burns (did not start|stopped at)"):
        optimum(replace(problem, thrust=problem.thrust / 50.0))
