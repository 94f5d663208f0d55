"""The free-time optimum against independent numbers, and against what makes it an optimum."""

import numpy as np
import pytest
from geo_sequences import MASS, elements, propellant_kg, sequence, solution

from campaigns.geo_injection.design.continuation import optimum
from campaigns.geo_injection.design.impulsive import propellant_share, two_impulses
from campaigns.geo_injection.design.optimality import arcs, is_optimal
from mc_engine.errors import ModelError

# Burns, inclination [deg], and the propellant [kg] that the source prints (tables 2 to 8).
TOTALS = [(2, 28.5, 16_775.0), (2, 55.0, 18_411.0), (2, 0.0, 15_931.0), (3, 28.5, 16_496.0), (3, 0.0, 15_672.0)]


@pytest.mark.parametrize(("burns", "inclination", "published"), TOTALS)
def test_totals_lie_between_two_impulses_and_the_published_ones(burns, inclination, published):
    problem = sequence(burns, inclination).problem()
    two = two_impulses(problem.plane_change, problem.ratio)
    bound = MASS * propellant_share(two.first + two.second, problem.exhaust)
    assert bound < propellant_kg(burns, inclination) < published


@pytest.mark.parametrize(("burns", "inclination"), [(n, i) for n, i, *_ in TOTALS])
def test_the_final_orbit_is_the_geostationary_circle(burns, inclination):
    a, e, i = elements(solution(burns, inclination).states[-1])
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


def test_the_first_burn_is_about_the_ascending_node():
    for burns, inclination, *_ in TOTALS[:2]:
        best = solution(burns, inclination)
        start, end = best.states[0], best.states[1]
        assert start[2] < 0.0 < end[2]
        assert start[0] > 0.0


# Corners and middle of the range that is promised: no guess is given for any of them.
@pytest.mark.parametrize("burns", [2, 3])
@pytest.mark.parametrize(("inclination", "thrust"), [(0.1, 4e4), (60.0, 4e4), (3.0, 1e4), (60.0, 5e3), (0.0, 5e3)])
def test_it_converges_from_0_to_60_degrees_and_from_5_to_40_kilonewtons(burns, inclination, thrust):
    problem = sequence(burns, inclination, thrust=thrust).problem()
    two = two_impulses(problem.plane_change, problem.ratio)
    a, e, i = elements(solution(burns, inclination, thrust).states[-1])
    assert (a, e, i) == pytest.approx((42_164.137, 0.0, 0.0), abs=1e-6)
    assert propellant_kg(burns, inclination, thrust) > MASS * propellant_share(two.first + two.second, problem.exhaust)


def test_a_sequence_that_burns_more_than_the_stage_has_is_refused_with_how_far_the_search_got():
    # an exhaust speed of 700 m/s would need a mass ratio of 300 and arcs of most of the parking orbit
    weak = sequence(2, 28.5)
    problem = weak.problem()
    hopeless = type(problem)(2, problem.plane_change, problem.ratio, problem.thrust / 50.0, problem.flow)
    with pytest.raises(ModelError, match=r"search for the optimal .*burns (did not start|stopped at)"):
        optimum(hopeless)
