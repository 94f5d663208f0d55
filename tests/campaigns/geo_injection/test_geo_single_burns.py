"""The source's single burns: the example of table 1, and the burns between its stated orbits."""

from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from geo_sequences import GEO, MASS, MU, PARKING, SOURCE, sequence, staged_over

from campaigns.geo_injection.design.coast import coast
from campaigns.geo_injection.design.staged import Stage, circle_reached, fly_shortest, rise_guess, rising
from campaigns.geo_injection.published.values import avoidance, burn_s


@pytest.mark.parametrize(
    ("transfer", "used_kg"),
    [((24_588, 0.7142, 0.0), 12_480.0), ((24_438, 0.7247, 0.0), 11_984.1), ((24_588, 0.7142, 26.0), 12_683.0)],
)
def test_the_source_s_guess_for_burns_between_ellipses_leads_to_the_same_apogee_burns(transfer, used_kg):
    """Eq. (23), though it gives less than a third of their time; the guess beside it is an impulse."""
    problem, unit, mass = sequence(2, 28.5).problem(), sequence(2, 28.5).time_unit, 1.0 - used_kg / MASS
    a, e, i = 1e3 * transfer[0] / PARKING, transfer[1], np.radians(transfer[2])
    speed = np.sqrt((1 - e) / ((1 + e) * a))
    apogee = np.array([-a * (1 + e), 0.0, 0.0, 0.0, -speed * np.cos(i), -speed * np.sin(i)])
    stage = Stage(apogee, mass, problem.thrust, problem.flow, partial(circle_reached, problem.ratio))
    change = np.array([0.0, -np.sqrt(1.0 / problem.ratio), 0.0]) - apogee[3:]
    by_impulse = fly_shortest(stage, change, np.zeros(3), 600.0 / unit, -300.0 / unit).duration
    guess = rise_guess((problem.ratio + apogee[0]) * mass / problem.thrust)
    burn = rising(stage, problem.ratio).duration
    assert unit * burn == pytest.approx(unit * by_impulse, abs=1e-6)
    assert guess[0] < burn / 3.0
    assert guess[2] == pytest.approx(guess[1] ** 2, rel=1e-12)


@pytest.mark.parametrize("name", SOURCE)
def test_staged_burns_make_one_continuous_flight_to_the_geostationary_circle(name):
    item, burns = staged_over(name)
    end = burns[-1].end
    assert np.linalg.norm(end[:3]) * PARKING == pytest.approx(GEO, abs=0.01)
    assert np.linalg.norm(end[3:6]) * item.speed_unit == pytest.approx(np.sqrt(MU / GEO), abs=1e-6)
    for burn, after in pairwise(burns):
        wait = np.array([after.ignition - burn.ignition - burn.duration])
        assert after.start[:6] == pytest.approx(coast(burn.end, wait)[0, :6], abs=1e-9)
        middle = coast(after.start, np.array([0.5 * after.duration]))[0]  # had the burn not begun: at an apsis
        assert middle[:3] @ middle[3:6] == pytest.approx(0.0, abs=1e-9)


# [s] of independent solutions: first burns ignited on the node, second burns centred on the printed perigee
IN_CONVENTIONS = [
    ("two_burns_planar", 1, 2027.9),
    ("two_burns_28_5", 1, 2060.7),
    ("two_burns_55", 1, 2074.3),
    ("three_burns_planar", 1, 904.3),
    ("three_burns_planar", 2, 1045.4),
    ("three_burns_28_5", 1, 979.7),
    ("three_burns_28_5", 2, 1034.5),
]


@pytest.mark.parametrize(("name", "number", "seconds"), IN_CONVENTIONS)
def test_burns_in_the_source_s_conventions_last_as_long_as_an_independent_solution(name, number, seconds):
    assert burn_s(name, number) == pytest.approx(seconds, abs=0.1)


def test_table_1_costates_keep_the_symmetry_of_a_free_longitude():
    """l_y = l_vx at the start, as the source takes it."""
    start = avoidance().start
    assert start[10] == pytest.approx(-start[6], rel=1e-6)
