"""The closed loop under errors of the navigation that it aims from."""

import numpy as np
import pytest
from geo_sequences import MU, fly_one

from campaigns.geo_injection.aiming import known
from campaigns.geo_injection.design.kept_programs import SEQUENCES
from campaigns.geo_injection.design.program import program_for
from campaigns.geo_injection.dynamics import State

CLOSED = {"guidance": "re_aimed", "shutdown": "sensed_velocity"}


def test_navigation_errors_do_nothing_to_a_stored_program():
    row, nominal = fly_one(navigation_position_r_m=500.0, navigation_velocity_t_m_s=5.0), fly_one()
    assert row["semi_major_axis_km"] == nominal["semi_major_axis_km"]
    assert row["inclination_deg"] == nominal["inclination_deg"]


def test_navigation_errors_count_along_the_true_radial_transverse_and_normal_axes():
    names = [f"navigation_{what}_{axis}" for what in ("position", "velocity") for axis in "rtn"]
    errors = type("Errors", (), dict(zip(names, (10.0, 20.0, 30.0, 1.0, 2.0, 3.0), strict=True)))
    state = State(0.0, 7e6, 0.0, -6e3, 1e3, 0.0, 1.0)  # transverse is -x, the normal is z
    assert tuple(known(state, errors)) == pytest.approx((-20.0, 7e6 + 10.0, 30.0, -6002.0, 1001.0, 3.0), abs=1e-9)


def test_a_stage_that_takes_itself_to_be_a_second_further_burns_a_second_early():
    """Place and velocity of the same orbit a second later: nothing but the time of the last burn may change."""
    place, velocity = np.reshape(program_for(SEQUENCES["two_burns_28_5"]).burns[0].end, (2, 3))
    r = np.linalg.norm(place)
    radial = place @ velocity / r
    transverse = np.sqrt(velocity @ velocity - radial**2)
    fooled = fly_one(
        **CLOSED,
        navigation_position_r_m=radial - 0.5 * MU / r**2,
        navigation_position_t_m=transverse,
        navigation_velocity_r_m_s=-MU / r**2,
    )
    nominal = fly_one(**CLOSED)
    assert fooled["last_burn_out_s"] == pytest.approx(nominal["last_burn_out_s"] - 1.0, abs=0.02)
    assert fooled["propellant_kg"] == pytest.approx(nominal["propellant_kg"], abs=0.05)
    assert fooled["eccentricity"] < 1e-3
    blind = fly_one(**CLOSED, navigation_velocity_t_m_s=2.0)
    assert abs(blind["longitude_drift_deg_day"]) > 0.05


def test_the_last_burn_is_aimed_as_well_as_navigation_knows_the_orbit():
    errors = [fly_one(**CLOSED, navigation_velocity_n_m_s=size)["plane_error_deg"] for size in (0.0, 10.0, 20.0)]
    assert errors[0] < 1e-4
    assert errors[2] == pytest.approx(2.0 * errors[1], rel=0.05)
