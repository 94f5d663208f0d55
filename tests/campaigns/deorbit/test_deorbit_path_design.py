"""Design of the de-orbit path and burn, against the printed values and the laws of conic motion."""

import numpy as np
import pytest
from deorbit_flights import NOMINAL, fly_cases, fly_one
from deorbit_twin import MU

from campaigns.deorbit.published import DEMONSTRATION, rounded_entry

R, V, GAMMA, THETA = 6491e3, 7800.0, np.radians(2.0), 60.0  # the entry state that the path is designed for
R_INITIAL = 6639e3


@pytest.fixture(scope="module")
def nominal():
    return fly_one()


@pytest.fixture(scope="module")
def ascending():
    return fly_one(burn_point="ascending")


def test_the_crossings_mirror_each_other_in_the_line_of_apsides(nominal, ascending):
    middle = nominal["burn_latitude_argument_deg"] + ascending["burn_latitude_argument_deg"]
    assert middle == pytest.approx(2.0 * nominal["desired_perigee_argument_deg"], abs=1e-9)


def test_the_crossings_need_the_same_burn_and_its_mirror(nominal, ascending):
    assert ascending["burn_dv_m_s"] == pytest.approx(nominal["burn_dv_m_s"], rel=1e-12)
    assert ascending["burn_angle_deg"] == pytest.approx(nominal["burn_angle_deg"], rel=1e-12)


def test_from_the_ascending_crossing_the_way_leads_over_the_apogee_and_takes_1493_s(ascending):
    assert ascending["entry_time_s"] == pytest.approx(1493.5, abs=0.05)
    assert ascending["planned_entry_time_s"] == pytest.approx(ascending["entry_time_s"], abs=1e-6)
    assert ascending["correction_impulse_m_s"] < 1e-6


@pytest.mark.parametrize("point", ["descending", "ascending"])
def test_the_burn_closes_the_velocity_triangle(point):
    """The law of cosines with speeds by vis-viva and a flight-path angle by the focal property: eqs (18)-(23)."""
    row = fly_one(burn_point=point)
    a, e = 1e3 * row["desired_semi_major_axis_km"], row["desired_eccentricity"]
    f = np.radians(row["burn_latitude_argument_deg"] - row["desired_perigee_argument_deg"])
    before, after = np.sqrt(MU / R_INITIAL), np.sqrt(2.0 * MU * (1.0 / R_INITIAL - 1.0 / (2.0 * a)))
    slope = np.arctan(e * np.sin(f) / (1.0 + e * np.cos(f)))
    dv = np.sqrt(before**2 + after**2 - 2.0 * before * after * np.cos(slope))
    assert row["burn_dv_m_s"] == pytest.approx(dv, rel=1e-10)  # the cosine costs six of sixteen digits
    assert row["burn_angle_deg"] == pytest.approx(np.degrees(np.arcsin(after / dv * abs(np.sin(slope)))), rel=1e-9)
    assert a * (1.0 - e * e) / (1.0 + e * np.cos(f)) == pytest.approx(R_INITIAL, rel=1e-12)


def test_the_rounded_elements_of_table_2_come_back_from_their_own_entry_state():
    """The entry state of the printed ellipse gives its elements again, and the burn of the digest for them."""
    row = fly_one(**rounded_entry(), **DEMONSTRATION)
    assert row["desired_semi_major_axis_km"] == pytest.approx(6431.5, rel=1e-12)
    assert row["desired_eccentricity"] == pytest.approx(0.0361, rel=1e-12)
    assert row["desired_perigee_argument_deg"] == pytest.approx(166.8, rel=1e-12)
    assert row["burn_latitude_argument_deg"] == pytest.approx(12.543, abs=5e-4)
    assert row["burn_dv_m_s"] == pytest.approx(177.174, abs=5e-4)
    assert row["burn_angle_deg"] == pytest.approx(44.199, abs=5e-4)
    assert row["planned_entry_time_s"] == pytest.approx(706.745, abs=5e-4)
    # and with them the restored 163.1 deg of Table 3, which the exact design inputs miss: 163.155 deg
    assert row["actual_perigee_argument_deg"] == pytest.approx(163.1, abs=0.05)


def test_without_errors_the_craft_enters_as_designed_and_spends_nothing(nominal):
    assert nominal["entry_speed_m_s"] == pytest.approx(V, rel=1e-10)
    assert nominal["entry_flight_path_angle_deg"] == pytest.approx(-np.degrees(GAMMA), rel=1e-10)
    assert nominal["entry_latitude_argument_deg"] == pytest.approx(THETA, rel=1e-10)
    assert nominal["entry_radius_km"] == pytest.approx(1e-3 * R, rel=1e-12)
    assert nominal["correction_impulse_m_s"] < 1e-6
    assert nominal["final_position_error_m"] < 1e-6


@pytest.mark.parametrize(
    ("ve", "oe"), [(-20.0, 10.0), (20.0, 15.0), (-20.0, 15.0), (20.0, 0.0), (0.0, 24.0), (-100.0, 0.0)]
)
def test_the_first_velocity_error_is_the_third_side_of_the_burn_triangle(nominal, ve, oe):
    """OE turns the burn by a share of its own angle alpha: |dv0| = |dV| sqrt(1 + s^2 - 2 s cos(alpha OE))."""
    s, turn = 1.0 + ve / 100.0, np.radians(nominal["burn_angle_deg"]) * oe / 100.0
    side = nominal["burn_dv_m_s"] * np.sqrt((1.0 - s) ** 2 + 4.0 * s * np.sin(0.5 * turn) ** 2)
    assert fly_one(ve_pct=ve, oe_pct=oe)["initial_velocity_error_m_s"] == pytest.approx(side, rel=1e-10)


ESCAPE = float(np.sqrt(2.0 * MU / R))
NO_ELLIPSE = "no ellipse reaches the entry state: its speed is at or above escape"
NO_CROSSING = "the initial orbit and the path to the entry state do not intersect"
REFUSED = [  # input, its wrong value, the sentence
    ("target_speed_m_s", ESCAPE * (1.0 + 1e-12), NO_ELLIPSE),
    ("target_speed_m_s", 12000.0, NO_ELLIPSE),
    ("initial_semi_major_axis_km", 6664.0, NO_CROSSING),  # apogee of the path: 6663.7 km
    ("initial_semi_major_axis_km", 6480.0, "the initial orbit is not above the entry interface to come down to"),
    ("initial_semi_major_axis_km", 6491.0, "the initial orbit is not above the entry interface to come down to"),
    ("modulator_on_n", 2.34, "modulator_on_n must be above modulator_off_n"),
    ("ve_pct", np.nan, "ve_pct is not a number"),
    ("ve_pct", -100.5, "ve_pct is outside -100 to inf %"),
    ("target_speed_m_s", np.nan, "target_speed_m_s is not a number"),
    ("initial_mass_kg", -100.0, "initial_mass_kg is outside 0.001 to inf kg"),
    ("out_of_plane_error_deg", 91.0, "out_of_plane_error_deg is outside -90 to 90 deg"),
]


@pytest.mark.parametrize(("name", "wrong", "sentence"), REFUSED)
def test_a_case_that_cannot_start_says_why_and_leaves_its_neighbours_alone(name, wrong, sentence):
    inputs = {"ve_pct": np.linspace(-20.0, 20.0, 11)}
    inputs[name] = inputs.get(name, np.full(11, NOMINAL[name])).copy()
    healthy = fly_cases(**inputs)
    inputs[name][4] = wrong
    flown = fly_cases(**inputs)
    assert flown["status"][4] == "refused"
    assert flown["reason"][4] == sentence
    assert np.isnan(flown["propellant_kg"][4])
    assert np.isnan(flown["entry_speed_m_s"][4])
    spared = np.arange(11) != 4
    assert list(healthy["status"]) == ["ok"] * 11
    for column in flown:
        np.testing.assert_array_equal(flown[column][spared], healthy[column][spared])


def test_a_circle_through_the_entry_place_is_no_path_to_come_down_on():
    row = fly_one(target_speed_m_s=float(np.sqrt(MU / R)), target_flight_path_angle_deg=0.0)
    assert row["status"] == "refused"
    assert row["reason"] == "the entry state lies on a circle, which has no perigee to aim with"


def test_a_step_too_long_for_the_gain_is_refused():
    """At a gain of 2 1/s, a step of 1 s would give an impulse of 375 m/s; the flown one is 47.6 m/s."""
    assert fly_one(gain_1_s=2.0)["reason"].startswith("gain_1_s times step_s is above 0.3")
    assert fly_one(gain_1_s=2.0, step_s=0.1)["status"] == "ok"


def test_an_entry_above_the_horizon_is_refused():
    assert "target_flight_path_angle_deg is outside" in fly_one(target_flight_path_angle_deg=-2.0)["reason"]


def test_a_burn_that_never_fires_leaves_an_uncontrolled_craft_in_orbit():
    row = fly_one(ve_pct=-100.0, control="off")
    assert row["status"] == "no-stop"
    assert row["end_time_s"] == 3000.0


def test_a_path_that_is_level_at_entry_is_refused_and_one_that_hardly_falls_is_flown():
    level, falling = (fly_one(target_speed_m_s=7920.0, target_flight_path_angle_deg=angle) for angle in (0.0, 0.01))
    assert level["reason"] == "the path is level at entry: it touches the interface and does not fall through it"
    assert falling["entry_flight_path_angle_deg"] == pytest.approx(-0.01, rel=1e-6)
