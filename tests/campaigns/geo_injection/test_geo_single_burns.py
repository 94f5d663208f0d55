"""The source's single burns: the example of table 1, and the burns between its stated orbits."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from geo_sequences import FLOW, GEO, MASS, MU, PARKING, THRUST, sequence

from campaigns.geo_injection.avoidance import AVOIDANCE, analytic_guess, converged
from campaigns.geo_injection.design.single_burn import Stage, circle, fly_shortest, rise_guess
from campaigns.geo_injection.design.staged import Orbit, rising, staged

SOURCE = {
    "planar, 2 burns": (2, 0.0, [(24_588, 0.7142, 0.0)]),
    "28.5 deg, 2 burns": (2, 28.5, [(24_588, 0.7142, 26.0)]),
    "55 deg, 2 burns": (2, 55.0, [(24_588, 0.7142, 52.0)]),
    "planar, 3 burns": (3, 0.0, [(8733.1, 0.2456, 0.0), (24_438, 0.7247, 0.0)]),
    "28.5 deg, 3 burns": (3, 28.5, [(8733.1, 0.2456, 27.0), (24_438, 0.7247, 25.0)]),
}


def burn_s(name, number):
    """Least time [s] of a burn of the staged sequence, counted from 0."""
    return sequence(*SOURCE[name][:2]).time_unit * staged_burns(name)[number].burn.duration


def iterations(name):
    """Steps of the search of each burn of the staged sequence."""
    return [one.burn.iterations for one in staged_burns(name)]


@cache
def staged_burns(name):
    """The burns of a sequence over the source's orbits."""
    burns, inclination, between = SOURCE[name]
    orbits = tuple(Orbit(1e3 * a / PARKING, e, np.radians(i)) for a, e, i in between)
    return staged(sequence(burns, inclination).problem(), orbits)


def first_burn_s(name):
    return burn_s(name, 0)


def apogee_burn_s(a_km, e, inclination_deg, propellant_so_far_kg, placing):
    """Least time [s] from a stated transfer orbit, its apogee on the node, to the geostationary circle."""
    problem, unit = sequence(2, 28.5).problem(), sequence(2, 28.5).time_unit
    a, i = 1e3 * a_km / PARKING, np.radians(inclination_deg)
    speed = np.sqrt((1 - e) / ((1 + e) * a))
    reference = np.array([-a * (1 + e), 0.0, 0.0, 0.0, -speed * np.cos(i), -speed * np.sin(i)])
    mass = 1.0 - propellant_so_far_kg / MASS
    stage = Stage(reference, mass, problem.thrust, problem.flow, circle(problem.ratio), placing)
    change = np.array([0.0, -np.sqrt(1.0 / problem.ratio), 0.0]) - reference[3:]
    return unit * fly_shortest(stage, change, np.zeros(3), 600.0 / unit, -300.0 / unit).duration


@pytest.mark.parametrize(
    ("a_km", "e", "degrees", "used_kg"),
    [(24_588, 0.7142, 0.0, 12_480.0), (24_438, 0.7247, 0.0, 11_984.1), (24_588, 0.7142, 26.0, 12_683.0)],
)
def test_the_source_s_guess_for_burns_between_ellipses_leads_to_the_same_apogee_burns(a_km, e, degrees, used_kg):
    """Eq. (23), though it gives less than a third of their time."""
    problem, unit = sequence(2, 28.5).problem(), sequence(2, 28.5).time_unit
    a, i = 1e3 * a_km / PARKING, np.radians(degrees)
    speed = np.sqrt((1 - e) / ((1 + e) * a))
    up, along = np.array([-1.0, 0.0, 0.0]), np.array([0.0, -np.cos(i), -np.sin(i)])
    mass = 1.0 - used_kg / MASS
    stage = Stage(np.concatenate([a * (1 + e) * up, speed * along]), mass, problem.thrust, problem.flow,
                  circle(problem.ratio))  # fmt: skip
    guess = rise_guess((problem.ratio - a * (1 + e)) * mass / problem.thrust)
    found = rising(stage, problem.ratio, up, along).duration
    assert unit * found == pytest.approx(apogee_burn_s(a_km, e, degrees, used_kg, "centred"), abs=1e-6)
    assert guess[0] < found / 3.0
    assert guess[2] == pytest.approx(guess[1] ** 2, rel=1e-12)


@pytest.mark.parametrize("placing", ["centred", "free"])
def test_the_planar_apogee_burns_last_as_long_as_published(placing):
    """Tables 4 and 8 print 562 and 600.6 s."""
    assert apogee_burn_s(24_588, 0.7142, 0.0, 12_480.0, placing) == pytest.approx(561.99, abs=0.1)
    assert apogee_burn_s(24_438, 0.7247, 0.0, 5554.6 + 6429.5, placing) == pytest.approx(600.61, abs=0.1)


def test_the_apogee_burn_from_25_degrees_lasts_as_long_as_published_where_it_is_placed_best():
    """Table 7 prints 658.6 s; centred on the apogee it lasts a second longer."""
    assert apogee_burn_s(24_438, 0.7247, 25.0, 6022.4 + 6429.8, "free") == pytest.approx(658.63, abs=0.3)
    assert apogee_burn_s(24_438, 0.7247, 25.0, 6022.4 + 6429.8, "centred") == pytest.approx(659.71, abs=0.3)


def test_the_published_apogee_burns_of_two_burns_are_above_the_least_time_of_their_own_orbits():
    """Tables 2 and 3 print 666.4 and 918.3 s: 3.6 and 14 % more than the least; not reproduced, cause unknown."""
    assert apogee_burn_s(24_588, 0.7142, 26.0, 12_683.0, "free") == pytest.approx(643.40, abs=0.1)
    assert apogee_burn_s(24_588, 0.7142, 52.0, 12_772.0, "free") == pytest.approx(806.25, abs=0.1)


# [s] of independent solutions, and as the source prints them: its three-dimensional ones begin on the node
FIRST_BURNS = [
    ("planar, 2 burns", 2027.9, 2033.0),
    ("planar, 3 burns", 904.3, 905.0),
    ("28.5 deg, 2 burns", 2051.2, 2065.6),
    ("55 deg, 2 burns", 2061.3, 2080.2),
    ("28.5 deg, 3 burns", 928.1, 980.8),
]


@pytest.mark.parametrize(("name", "ours", "published"), FIRST_BURNS)
def test_the_first_burns_last_as_long_as_an_independent_solution_and_less_than_published(name, ours, published):
    found = first_burn_s(name)
    assert found == pytest.approx(ours, abs=0.5)
    assert found < published


@pytest.mark.parametrize("name", SOURCE)
def test_staged_burns_make_one_continuous_flight_to_the_geostationary_circle(name):
    burns, inclination, between = SOURCE[name]
    one = sequence(burns, inclination)
    stages = staged(one.problem(), tuple(Orbit(1e3 * a / PARKING, e, np.radians(i)) for a, e, i in between))
    end = stages[-1].burn.end
    assert np.linalg.norm(end[:3]) * PARKING == pytest.approx(GEO, abs=0.01)
    assert np.linalg.norm(end[3:6]) * one.speed_unit == pytest.approx(np.sqrt(MU / GEO), abs=1e-6)
    for stage, after in pairwise(stages):
        assert after.burn.start[:6] == pytest.approx(_coasted(stage, after), abs=1e-9)
        assert after.burn.ignition == pytest.approx(-0.5 * after.burn.duration, abs=1e-9)


def _coasted(stage, after):
    from campaigns.geo_injection.design.coast import coast

    wait = after.ignition - stage.ignition - stage.burn.duration
    return coast(np.append(stage.burn.end[:6], np.ones(6))[None], np.array([wait]))[0, :6]


def test_table_1_analytic_row():
    """0.7441893, 0.138454; the printed 0.4720947 is read as 0.3720947, half of the first and the root of the last."""
    time, radial, transverse = analytic_guess(AVOIDANCE)
    assert time == pytest.approx(0.7441893, abs=1e-5)
    assert radial == pytest.approx(0.3720947, abs=1e-5)
    assert transverse == pytest.approx(0.138454, abs=1e-6)


def test_table_1_converged_row_is_only_loosely_converged_in_the_source():
    """Printed are 0.7379, 0.3389, 0.1181: 0.24, 0.2 and 1.7 % from the solution."""
    time, radial, transverse = converged(AVOIDANCE)
    assert time == pytest.approx(0.73615, abs=2e-4)
    assert radial == pytest.approx(0.33957, abs=2e-4)
    assert transverse == pytest.approx(0.12014, abs=2e-4)
    assert abs(time / 0.7379 - 1.0) == pytest.approx(0.0024, abs=2e-4)
    assert abs(transverse / 0.1181 - 1.0) == pytest.approx(0.017, abs=1e-3)


def test_table_1_costates_keep_the_symmetry_of_a_free_longitude():
    """l_y = l_vx at the start, as the source takes it."""
    from campaigns.geo_injection.avoidance import burn_of

    start = burn_of(AVOIDANCE).start
    assert start[10] == pytest.approx(-start[6], rel=1e-6)


def test_the_engine_that_the_tables_identify_has_332_seconds():
    """20 kN and 6.14 kg/s."""
    assert THRUST / FLOW / 9.80665 == pytest.approx(332.16, abs=0.01)
