"""Inputs of the campaign do what their names say: the sign of an effect, and its size where a law gives it."""

import numpy as np
import pytest
from deorbit_flights import fly_cases, fly_one

from campaigns.deorbit.published import DEMONSTRATION, PULSED

OFF = {"control": "off"}
SPEED, ANGLE = "entry_speed_m_s", "entry_flight_path_angle_deg"
PLACE, LATITUDE = "entry_latitude_argument_deg", "entry_latitude_deg"
IMPULSE, WORST = "correction_impulse_m_s", "max_position_error_m"

# what the random cases of the twins leave alone: parameter, from, to, what else, column, its sign of change, why
EFFECTS = [
    ("greenwich_angle_deg", 0.0, 10.0, {}, "entry_longitude_deg", -1, "an Earth turned east meets the craft west"),
    ("modulator_feedback_gain", 1.0, 1.1, PULSED, IMPULSE, -1, "stronger feedback fires less"),
    ("modulator_time_constant_s", 57.62, 40.0, PULSED, "pulse_count", +1, "a faster lag fires shorter and more often"),
    ("modulator_off_n", 2.34, 3.0, PULSED, "pulse_count", +1, "a narrower trigger fires more often"),
]


@pytest.mark.parametrize(
    ("name", "before", "after", "others", "column", "sign"),
    [effect[:6] for effect in EFFECTS],
    ids=[f"{effect[0]}: {effect[6]}" for effect in EFFECTS],
)
def test_each_parameter_acts_in_its_direction(name, before, after, others, column, sign):
    first, then = (fly_one(**others | {name: value}) for value in (before, after))
    assert (first["status"], then["status"]) == ("ok", "ok")
    change = then[column] - first[column]
    # far above rounding, so that the sign is physics
    assert sign * change > 1e-6 * max(1.0, abs(first[column]))


def test_a_delayed_burn_turns_the_whole_path_by_the_motion_on_the_circle():
    on_time, late = fly_one(**OFF), fly_one(burn_delay_s=10.0, **OFF)
    turned = np.degrees(10.0 * np.sqrt(3.986004418e14 / 6639e3**3))
    assert late["entry_time_s"] - on_time["entry_time_s"] == pytest.approx(10.0, abs=1e-6)
    assert late[PLACE] - on_time[PLACE] == pytest.approx(turned, abs=1e-8)
    assert late[SPEED] == pytest.approx(on_time[SPEED], rel=1e-12)
    assert late[ANGLE] == pytest.approx(on_time[ANGLE], rel=1e-10)


def test_while_a_burn_is_late_the_earth_turns_on_under_it():
    """The path is the same, turned along its orbit: only the longitude loses the turn of the Earth as well."""
    late = fly_one(burn_delay_s=100.0, **OFF)
    place, lean = np.radians(late[PLACE]), np.radians(55.5)
    ascension = np.degrees(np.arctan2(np.cos(lean) * np.sin(place), np.cos(place)))
    turned = np.degrees(7.292115e-5 * (fly_one(**OFF)["entry_time_s"] + 100.0))
    assert late["entry_longitude_deg"] == pytest.approx(ascension - turned, abs=1e-6)


def test_twice_the_mass_needs_twice_the_force_and_the_propellant_but_the_same_impulse():
    one, two = fly_one(**DEMONSTRATION), fly_one(initial_mass_kg=200.0, **DEMONSTRATION)
    assert two["peak_force_n"] == pytest.approx(2.0 * one["peak_force_n"], rel=1e-12)
    assert two["propellant_kg"] == pytest.approx(2.0 * one["propellant_kg"], rel=1e-12)
    assert two[IMPULSE] == pytest.approx(one[IMPULSE], rel=1e-12)


def test_the_craft_enters_at_the_place_and_in_the_state_that_are_asked_for():
    targets = {"target_speed_m_s": 7815.0, "target_flight_path_angle_deg": 1.8, "target_radius_km": 6485.0}
    row = fly_one(**targets, target_latitude_argument_deg=200.0, inclination_deg=97.8)
    assert row[SPEED] == pytest.approx(7815.0, rel=1e-9)
    assert row[ANGLE] == pytest.approx(-1.8, rel=1e-9)
    assert row["entry_radius_km"] == pytest.approx(6485.0, rel=1e-12)
    assert row[PLACE] == pytest.approx(200.0, rel=1e-9)
    theta, lean = np.radians(200.0), np.radians(97.8)
    assert row[LATITUDE] == pytest.approx(np.degrees(np.arcsin(np.sin(lean) * np.sin(theta))), rel=1e-9)
    node = np.degrees(np.arctan2(np.cos(lean) * np.sin(theta), np.cos(theta)))
    assert row["entry_right_ascension_deg"] == pytest.approx(node, rel=1e-9)
    # Clairaut: cos i = cos(latitude) sin(heading); past the descending node's turn the craft flies south and west
    heading = np.degrees(np.arctan2(np.cos(lean), np.sin(lean) * np.cos(theta))) % 360.0
    assert row["entry_heading_deg"] == pytest.approx(heading, rel=1e-9)
    turned = np.degrees(7.292115e-5 * row["entry_time_s"])
    assert row["entry_longitude_deg"] == pytest.approx((node - turned + 180.0) % 360.0 - 180.0, rel=1e-9)


def test_without_disturbances_the_plane_of_the_orbit_does_not_matter():
    row, polar = (
        fly_one(**DEMONSTRATION),
        fly_one(inclination_deg=90.0, target_latitude_argument_deg=0.0, **DEMONSTRATION),
    )
    for column in (IMPULSE, WORST, "entry_time_s", SPEED, ANGLE, "settling_time_s", "overshoot_omega_pct"):
        assert polar[column] == pytest.approx(row[column], rel=1e-8)


@pytest.mark.parametrize("part", ["radial", "transverse", "normal"])
def test_a_constant_navigation_error_is_flown_in_full(part):
    """The law zeroes what it sees: 100 m of place end as 100 m, 1 m/s as 2/k m.

    The error turns with the orbit, 1.2e-3 rad/s against k = 0.0175 1/s: that is worth (0.07)^2, half a percent.
    """
    place = fly_one(**{f"navigation_{part}_position_error_m": 100.0})["final_position_error_m"]
    speed = fly_one(**{f"navigation_{part}_velocity_error_m_s": 1.0})["final_position_error_m"]
    assert place == pytest.approx(100.0, rel=0.01)
    assert speed == pytest.approx(2.0 / 0.0175, rel=0.01)


@pytest.mark.parametrize("steps", [1.0, 4.0])
@pytest.mark.parametrize("noise", ["position", "velocity"])
def test_noisy_fixes_shake_the_craft_as_white_noise_through_the_law(noise, steps):
    """Fixes T apart: the place shakes by sigma sqrt(k T / 4) on each axis, by sigma_v sqrt(T / k) for velocities.

    Both are the noise bandwidth of the critically damped law; 1536 draws hold a deviation to 2 %, taken fourfold.
    """
    sigma, name = (100.0, "position_noise_m") if noise == "position" else (0.1, "velocity_noise_m_s")
    expected = sigma * np.sqrt(0.0175 * steps / 4.0) if noise == "position" else sigma * np.sqrt(steps / 0.0175)
    flown = fly_cases(ve_pct=np.zeros(512), steps_per_fix=steps, **{f"navigation_{name}": sigma})
    ends = np.array([flown[f"end_deviation_{axis}_m"] for axis in "xyz"])
    assert np.sqrt(np.mean(ends**2)) == pytest.approx(expected, rel=0.08)
    assert abs(np.corrcoef(ends)[np.triu_indices(3, 1)]).max() < 0.2


def test_cases_draw_their_own_noise_and_the_first_errors_none():
    flown = fly_cases(ve_pct=np.zeros(16), navigation_position_noise_m=10.0)
    assert len(set(flown[IMPULSE])) == 16
    assert set(fly_cases(ve_pct=np.zeros(16))[IMPULSE]) == {fly_one()[IMPULSE]}


def test_a_law_that_knows_the_oblateness_leaves_no_error_and_pays_for_it():
    blind, knowing = fly_one(j2=True), fly_one(j2=True, j2_feedforward=True)
    assert blind["final_position_error_m"] > 10.0
    assert knowing["final_position_error_m"] < 1e-6
    assert knowing[IMPULSE] > 5.0


def test_drag_brakes_a_craft_without_control_and_costs_one_with_control():
    falling, held = fly_one(drag=True, **OFF), fly_one(drag=True)
    assert falling[SPEED] < fly_one(**OFF)[SPEED]
    assert falling["final_position_error_m"] > 2.0 * held["final_position_error_m"] > 0.0
    assert held[IMPULSE] > 0.1


def test_a_law_without_gain_steers_nothing_but_gravity():
    """k = 0 leaves x'' = 0: the craft drifts away from its place in a straight line."""
    row = fly_one(gain_1_s=0.0, ve_pct=-1.0)
    drift = row["initial_velocity_error_m_s"] * row["entry_time_s"]
    assert row["final_position_error_m"] == pytest.approx(drift, rel=1e-9)


def test_a_flight_past_its_time_limit_ends_without_a_stop():
    row = fly_one(time_limit_s=600.0)
    assert (row["status"], row["end_time_s"]) == ("no-stop", 600.0)
