"""Along the flight: peaks, pull-out, exits, rolls, ends of the flight, lanes."""

import numpy as np
import pytest
from reentry_flights import assert_same_bits_alone, fly_cases, fly_one, history
from reentry_twin import G0, standard_density

from campaigns.reentry.published.values import EXACT, PLANAR, TEXTBOOK, ballistic

DISPERSED = {"entry_speed_error_m_s": 5.0, "entry_flight_path_angle_error_deg": 0.05, "density_deviation": 1.0}


def dispersed(n, seed):
    rng = np.random.default_rng(seed)
    inputs = {name: rng.normal(0.0, sigma, n) for name, sigma in DISPERSED.items()}
    return inputs | {"cd_factor": rng.normal(1.0, 0.03, n), "ld_factor": rng.normal(1.0, 0.04, n)}


@pytest.mark.parametrize(
    "inputs", [{}, {"vehicle": "soyuz"}, {"entry_speed_m_s": 11e3, "entry_flight_path_angle_deg": -7.0}]
)
def test_a_peak_is_the_largest_value_of_a_dense_history_and_comes_with_its_time_altitude_and_speed(inputs):
    row, seen = fly_one(**inputs, tolerance=1e-10), history(rows=20_001, **inputs, tolerance=1e-10)
    for name, column in (
        ("load", "load_g"), ("axial_load", "axial_load_g"), ("dynamic_pressure", "dynamic_pressure_pa"),
        ("heat_rate", "heat_rate_w_m2"),
    ):  # fmt: skip
        top = int(np.argmax(seen[column]))
        assert row[f"peak_{column}"] == pytest.approx(seen[column][top], rel=1e-6)
        assert row[f"peak_{column}"] >= seen[column][top] * (1.0 - 1e-9)
        step = seen["t_s"][1] - seen["t_s"][0]
        assert abs(row[f"peak_{name}_time_s"] - seen["t_s"][top]) <= step
        for what in ("altitude_km", "speed_m_s"):
            there = np.interp(row[f"peak_{name}_time_s"], seen["t_s"], seen[what])
            assert row[f"peak_{name}_{what}"] == pytest.approx(there, rel=1e-5)


def test_the_heat_load_is_the_integral_of_the_heat_rate():
    row, seen = fly_one(tolerance=1e-10), history(rows=20_001, tolerance=1e-10)
    assert np.trapezoid(seen["heat_rate_w_m2"], seen["t_s"]) == pytest.approx(row["heat_load_j_m2"], rel=1e-6)


def test_a_flight_that_ends_before_its_peak_has_its_largest_values_at_the_end():
    row = fly_one(stop_altitude_km=90.0)
    assert row["peak_load_time_s"] == row["flight_time_s"]
    assert row["peak_load_altitude_km"] == pytest.approx(90.0, abs=1e-6)
    assert row["peak_heat_rate_speed_m_s"] == row["final_speed_m_s"]


def test_total_and_axial_load_are_the_dynamic_pressure_on_the_vehicle():
    row = fly_one(
        drag_coefficient=1.2, lift_coefficient=0.5, trim_angle_deg=20.0, mass_kg=5000.0, reference_area_m2=12.0
    )
    pressure = row["peak_dynamic_pressure_pa"] * 12.0 / 5000.0 / G0
    assert row["peak_load_g"] == pytest.approx(pressure * 1.3, rel=1e-12)
    axial = 1.2 * np.cos(np.radians(20.0)) + 0.5 * np.sin(np.radians(20.0))
    assert row["peak_axial_load_g"] == pytest.approx(pressure * axial, rel=1e-12)


SKIP = {
    **TEXTBOOK, "entry_altitude_km": 80.0, "entry_speed_m_s": 7000.0, "entry_flight_path_angle_deg": -10.0,
    "mass_kg": 1000.0, "reference_area_m2": 0.68, "drag_coefficient": 1.0, "lift_coefficient": 1.0, "bank_deg": 0.0,
    "stop_altitude_km": 0.0, "exit_altitude_km": 55.0,
}  # fmt: skip


def test_a_vehicle_that_may_go_on_keeps_the_first_pull_out_and_the_first_exit():
    stopped, on = fly_one(**SKIP), fly_one(**SKIP, on_exit="continue", time_limit_s=1e5)
    assert stopped["exits"] == 1.0
    assert on["exits"] > 1.0
    exit_ = ("exit_time_s", "exit_speed_m_s", "exit_flight_path_angle_deg", "exit_apoapsis_altitude_km")
    for name in ("min_altitude_km", *exit_):
        assert on[name] == pytest.approx(stopped[name], rel=1e-9), name
    assert on["final_altitude_km"] == pytest.approx(0.0, abs=1e-6)


def test_between_skips_the_vehicle_reaches_the_apoapsis_of_its_exit():
    """Up to what the lift in the thin air above 55 km adds."""
    row, seen = fly_one(**SKIP), history(rows=20_001, **SKIP, on_exit="continue")
    after = (seen["t_s"] > row["exit_time_s"]) & (seen["t_s"] < row["exit_time_s"] + 200.0)
    assert seen["altitude_km"][after].max() == pytest.approx(row["exit_apoapsis_altitude_km"], rel=0.05)


# about a point mass, without air
GRAZING = {"gravity": "point", "shape": "sphere", "rotating": False, "density_factor": 0.0}
GRAZING |= {"entry_speed_m_s": 8e3, "entry_flight_path_angle_deg": -1.0}


def test_a_pass_that_never_sinks_below_the_exit_altitude_ends_where_it_is_back_at_its_entry_altitude():
    """It leaves as fast and as steeply as it came."""
    error = np.array([-2.0, 0.0, 2.0])
    rows = fly_cases(**GRAZING, exit_altitude_km=90.0, entry_altitude_error_km=error)
    assert rows["status"].tolist() == ["ok"] * 3
    assert rows["min_altitude_km"].min() > 90.0
    assert rows["final_altitude_km"] == pytest.approx(120.0 + error, abs=1e-5)
    assert rows["exits"].tolist() == [1.0] * 3
    assert rows["exit_flight_path_angle_deg"] == pytest.approx(1.0, abs=1e-6)


def test_a_flight_that_ends_at_stop_time_on_its_way_up_has_not_left_the_air():
    """Above the exit altitude, but not yet back at the entry altitude; a pass takes 647 s."""
    times = np.array([500.0, 600.0, 700.0])
    rows = fly_cases(**GRAZING, exit_altitude_km=90.0, stop_time_s=times)
    assert rows["status"].tolist() == ["ok"] * 3
    assert rows["exits"].tolist() == [0.0, 0.0, 1.0]
    assert np.isnan(rows["exit_time_s"]).tolist() == [True, True, False]


@pytest.mark.parametrize("exit_altitude", [0.0, 120.0])
def test_a_vehicle_that_climbs_from_its_exit_altitude_has_not_left_the_air(exit_altitude):
    place = np.linspace(-80.0, 80.0, 40)
    rows = fly_cases(
        entry_speed_m_s=7e3,
        entry_flight_path_angle_deg=np.linspace(0.1, 2.0, 40),
        entry_latitude_deg=place,
        exit_altitude_km=exit_altitude,
    )
    assert rows["exits"].tolist() == [0.0] * 40
    assert rows["final_altitude_km"] == pytest.approx(10.0, abs=1e-5)


DIP = {"vehicle": "apollo", "entry_speed_m_s": 11e3, "entry_flight_path_angle_deg": -6.5, "bank_deg": 10.0}
ROLLS = {"roll_flight_path_angle_deg": 1.0, "rolled_bank_deg": 170.0, "roll_back_flight_path_angle_deg": -0.5}


def test_the_vehicle_rolls_while_it_climbs_and_back_while_it_sinks():
    seen = history(rows=20_001, **DIP, **ROLLS, on_exit="continue")
    bank, path = seen["bank_deg"], seen["flight_path_angle_deg"]
    turns = np.flatnonzero(np.abs(np.diff(bank)) > 1.0)
    assert [round(float(bank[0])), *(round(float(bank[i + 1])) for i in turns)] == [10, 170, 10]
    assert path[turns[0]] == pytest.approx(1.0, abs=0.01)
    assert path[turns[1]] == pytest.approx(-0.5, abs=0.01)


def test_the_timer_ends_a_flight_and_the_time_limit_is_no_end():
    assert fly_one(stop_time_s=33.3)["flight_time_s"] == pytest.approx(33.3, abs=1e-12)
    assert fly_one(time_limit_s=33.3)["status"] == "no-stop"


def test_sixty_dispersed_cases_have_the_bits_of_each_alone_one_case_at_a_time():
    inputs = dispersed(60, 4) | {"bank_error_deg": np.linspace(-3.0, 3.0, 60)}
    assert_same_bits_alone(fly_cases(**inputs), range(0, 60, 7), width=1, each=inputs)


def test_a_ballistic_case_has_the_same_bits_beside_lifting_ones():
    lift = np.array([0.0, 0.4, 0.0, 0.3, 0.1])
    together = fly_cases(lift_coefficient=lift, density_deviation=np.array([0.0, 1.0, 0.5, 0.0, -1.0]))
    alone = fly_cases(lift_coefficient=0.0, density_deviation=0.0)
    assert {name: column[0] for name, column in together.items() if column[0] == column[0]} == {
        name: column[0] for name, column in alone.items() if column[0] == column[0]
    }


def test_a_case_that_does_not_end_leaves_its_neighbours_alone():
    """Upwards at 9 km/s the third goes into an orbit that has not come down in 3000 s."""
    path = np.array([-2.0, -2.1, 5.0, -2.2])
    inputs = {"entry_speed_m_s": 9000.0, "on_exit": "continue", "time_limit_s": 3000.0}
    healthy = fly_cases(**inputs, entry_flight_path_angle_deg=path[[0, 1, 3]] - 3.0)
    mixed = fly_cases(**inputs, entry_flight_path_angle_deg=np.where(path < 0.0, path - 3.0, path))
    assert mixed["status"].tolist() == ["ok", "ok", "no-stop", "ok"]
    assert np.isnan(mixed["peak_load_g"][2])
    assert mixed["peak_load_g"][[0, 1, 3]].tolist() == healthy["peak_load_g"].tolist()


def test_the_tolerance_of_the_campaigns_is_good_for_20_metres_of_range_and_a_thousandth_of_the_load():
    for vehicle in ("given", "soyuz"):
        inputs = dispersed(40, 9) | {"vehicle": vehicle}
        rough, exact = fly_cases(**inputs), fly_cases(**inputs, **EXACT)
        assert np.abs(rough["downrange_km"] - exact["downrange_km"]).max() < 0.020
        assert rough["peak_load_g"] == pytest.approx(exact["peak_load_g"], rel=1e-3)
        assert rough["heat_load_j_m2"] == pytest.approx(exact["heat_load_j_m2"], rel=1e-4)


def test_history_and_metrics_agree_at_the_end_and_on_the_density():
    row, seen = fly_one(), history()
    for metric, quantity in (
        ("final_altitude_km", "altitude_km"), ("final_speed_m_s", "speed_m_s"), ("final_mach", "mach"),
        ("downrange_km", "downrange_km"), ("crossrange_km", "crossrange_km"), ("heat_load_j_m2", "heat_load_j_m2"),
        ("final_latitude_deg", "latitude_deg"), ("final_longitude_deg", "longitude_deg"),
    ):  # fmt: skip
        assert seen[quantity][-1] == pytest.approx(row[metric], rel=1e-12), metric
    for i in (0, 500, 1000, 1500, 2000):
        assert seen["density_kg_m3"][i] == pytest.approx(standard_density(1e3 * seen["altitude_km"][i]), rel=1e-9)


def test_the_slow_density_error_is_the_digests_share_at_three_sigma():
    """10 % below 30 km, 60 % above 100 km, of a log-normal factor."""
    inputs = {**PLANAR, **ballistic(400.0)}
    plain, thick = history(**inputs), history(**inputs, density_deviation=3.0)
    for altitude, share in ((115.0, 1.60), (90.0, 1.45), (70.0, 1.30), (45.0, 1.15), (12.0, 1.10)):
        ratio = [np.exp(np.interp(-altitude, -h["altitude_km"], np.log(h["density_kg_m3"]))) for h in (plain, thick)]
        assert ratio[1] / ratio[0] == pytest.approx(share, rel=2e-3)


def test_the_target_lies_where_a_flight_that_hits_it_ends():
    """Over the ellipsoid, to the side; 1e-5 degrees are a metre."""
    entry = {"entry_latitude_deg": 45.5, "entry_longitude_deg": 170.0, "entry_heading_deg": 50.0, "bank_deg": 60.0}
    free = fly_one(**entry)
    hit = fly_one(**entry, target_downrange_km=free["downrange_km"], target_crossrange_km=free["crossrange_km"])
    assert hit["miss_km"] < 1e-6
    for name in ("latitude_deg", "longitude_deg"):
        assert hit[f"target_{name}"] == pytest.approx(hit[f"final_{name}"], abs=1e-5)
        assert np.isnan(free[f"target_{name}"])
