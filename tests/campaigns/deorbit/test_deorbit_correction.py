"""The correction of the de-orbit path: the numbers of the published case, its neighbours and its variants."""

import numpy as np
import pytest
from deorbit_flights import fly_cases, fly_grid, fly_one, history

from campaigns.deorbit.published import DEMONSTRATION

ALONE = 1.0 + 2.0 * np.exp(-2.0)  # S / |dv0| of the law without gravity, whatever its gain


@pytest.fixture(scope="module")
def published_case():
    return fly_one(**DEMONSTRATION)


@pytest.fixture(scope="module")
def published_history():
    return history(**DEMONSTRATION)


def test_the_force_stays_in_the_orbital_plane_as_printed(published_history):
    assert np.abs(published_history["force_normal_n"]).max() < 1e-9


def test_a_faultless_burn_needs_no_correction():
    assert fly_one()["correction_impulse_m_s"] < 1e-6


def test_the_impulse_is_1_27_times_the_velocity_error_over_the_whole_map():
    flown = fly_grid(np.linspace(-30.0, 30.0, 25), np.linspace(-24.0, 24.0, 21))
    wrong = (flown["ve_pct"] != 0.0) | (flown["oe_pct"] != 0.0)
    ratio = flown["correction_impulse_m_s"][wrong] / flown["initial_velocity_error_m_s"][wrong]
    assert ratio.min() == pytest.approx(1.2695, rel=0.0, abs=5e-5)
    assert ratio.max() == pytest.approx(1.2727, rel=0.0, abs=5e-5)
    assert ratio.min() < ALONE < ratio.max()


def test_the_peak_force_is_the_damping_of_the_first_velocity_error(published_case):
    """At the burn the craft is where it should be, so the law only damps: 2 k m |dv0|."""
    expected = 2.0 * 0.0175 * 100.0 * published_case["initial_velocity_error_m_s"]
    assert published_case["peak_force_n"] == pytest.approx(expected, rel=1e-12)


def test_the_propellant_follows_from_the_impulse_by_equation_40(published_case):
    spent = 100.0 * (1.0 - np.exp(-published_case["correction_impulse_m_s"] / (9.80665 * 246.0)))
    assert published_case["propellant_kg"] == pytest.approx(spent, rel=1e-12)
    assert published_case["entry_mass_kg"] == pytest.approx(100.0 - spent, rel=1e-12)


def test_a_mass_that_burns_off_needs_less_force_but_the_same_impulse(published_case):
    """The law commands acceleration: equation 40 gives the same propellant for a constant and a falling mass."""
    burning = fly_one(mass_model="burning", **DEMONSTRATION)
    assert burning["propellant_kg"] == pytest.approx(published_case["propellant_kg"], rel=1e-12)
    force, constant = (history(mass_model=model, **DEMONSTRATION)["force_n"] for model in ("burning", "constant"))
    assert force[170] < 0.99 * constant[170]


# column, value at r = 6491 km; printed with the digest to six or seven digits
UNCONTROLLED = [
    ("entry_speed_m_s", 7832.315),
    ("entry_flight_path_angle_deg", -1.58057),
    ("entry_latitude_argument_deg", 69.44535),
    ("entry_time_s", 843.457),
]


@pytest.mark.parametrize(("column", "value"), UNCONTROLLED)
def test_without_control_the_craft_enters_late_fast_and_shallow(column, value):
    assert fly_one(control="off", **DEMONSTRATION)[column] == pytest.approx(value, rel=1e-5)


@pytest.fixture(scope="module")
def clipped():
    return fly_one(control="clipped", **DEMONSTRATION)


def test_clipped_at_30_n_the_correction_takes_longer_and_costs_more(clipped):
    assert clipped["correction_impulse_m_s"] == pytest.approx(66.853, rel=1e-3)
    assert clipped["max_position_error_m"] == pytest.approx(2340.3, rel=1e-3)
    assert clipped["peak_force_n"] == pytest.approx(30.0, rel=1e-15)
    assert clipped["settling_time_s"] == pytest.approx(490.0, abs=1.0)  # "about 490 s"


@pytest.fixture(scope="module")
def fuel_map():
    """The grid of map.toml: 41 x 31 cases, a percent apart."""
    return fly_grid(np.linspace(-20.0, 20.0, 41), np.linspace(-15.0, 15.0, 31))


def test_the_dearest_case_of_the_map_is_its_corner_of_too_large_and_too_far_turned(fuel_map):
    dearest = np.argmax(fuel_map["propellant_kg"])
    assert (fuel_map["ve_pct"][dearest], fuel_map["oe_pct"][dearest]) == (20.0, 15.0)
    assert fuel_map["propellant_kg"][dearest] == pytest.approx(2.188, abs=5e-4)


def test_cases_of_all_control_modes_may_be_flown_together():
    words = np.array(["continuous", "clipped", "pulsed", "off"] * 3)
    together = fly_cases(control=words, **DEMONSTRATION)
    for word in words[:4]:
        for name, value in fly_one(control=word, **DEMONSTRATION).items():
            np.testing.assert_array_equal(together[name][words == word], np.array([value] * 3))
