"""Guided flights: the laws on the planar baseline, their sensors, the bank, reversals to the side."""

import numpy as np
import pytest
from guidance_twin import Stored, fly_guided
from reentry_flights import assert_same_bits_alone, fly_cases, fly_one, history

from campaigns.reentry.guidance.plan import plan_of
from campaigns.reentry.published.values import PLANAR, PLANAR_SIGMA, off_nominal

PLANNED = PLANAR | {"plan": "given"}
REFERENCE_KM = 2548.676
LAWS = ("law1", "law2", "law2r", "law3", "law3r", "apollo")


@pytest.fixture(scope="module")
def flown():
    """Columns by law, all on the same cases."""
    cases = off_nominal(PLANAR_SIGMA, 1200)
    return {law: fly_cases(**PLANNED, **cases, guidance=law) for law in ("none", *LAWS)}


def scatter(columns):
    return columns["downrange_km"].std()


@pytest.mark.parametrize(
    ("law", "sigma_km", "bias_km"), [("law1", 1.5, 0.1), ("law3r", 5.0, 1.5), ("apollo", 1.5, 1.5)]
)
def test_a_law_that_knows_the_range_lands_near_its_end(flown, law, sigma_km, bias_km):
    """The Apollo final phase does so from its printed table."""
    assert scatter(flown[law]) < sigma_km
    assert abs(flown[law]["downrange_km"].mean() - REFERENCE_KM) < bias_km


def test_law_2_with_range_is_as_good_as_law_1_and_law_3_is_not(flown):
    """Although it knows no altitude: drag is what the range is made of; the altitude of a thicker air is not."""
    assert scatter(flown["law2r"]) <= scatter(flown["law1"]) < scatter(flown["law3r"])


@pytest.mark.parametrize("law", ["law2", "law3"])
def test_since_the_miss_is_there_before_the_air_is_felt(law):
    """With entry errors alone: the distance over ground at 80 km, where the drag is 0.15 g, tells the later miss."""
    cases = {name: values for name, values in off_nominal(PLANAR_SIGMA, 300, 8).items() if name.startswith("entry")}
    early = fly_cases(**PLANNED, **cases, stop_altitude_km=80.0)["downrange_km"]
    landed = fly_cases(**PLANNED, **cases, guidance=law)["downrange_km"]
    assert np.corrcoef(early, landed)[0, 1] > 0.99
    assert landed.std() > early.std()


@pytest.mark.parametrize("law", ["law2", "law3"])
def test_a_law_without_range_holds_the_profile_and_takes_little_from_the_miss(flown, law):
    """The scatter of the largest load shrinks although the miss does not."""
    assert 0.8 < scatter(flown[law]) / scatter(flown["none"]) < 0.98
    assert flown[law]["peak_load_g"].std() < 0.85 * flown["none"]["peak_load_g"].std()
    assert flown[law]["peak_load_g"].max() < flown["none"]["peak_load_g"].max()


@pytest.mark.parametrize("law", ["law1", "law2", "law2r", "law3", "law3r"])
def test_the_nominal_case_flies_its_reference(law):
    row = fly_one(**PLANNED, guidance=law)
    assert row["reference_range_km"] == pytest.approx(REFERENCE_KM, abs=1e-3)
    assert row["downrange_km"] == pytest.approx(REFERENCE_KM, abs=0.2)
    assert row["peak_load_g"] == pytest.approx(3.665, abs=0.001)
    assert row["reversals"] == 0.0
    assert row["saturated_share"] < 0.02


@pytest.mark.parametrize("law", ["law1", "law2r", "law3r"])
def test_a_guided_flight_is_that_of_an_independent_one_second_by_second(law):
    stored = Stored(plan_of(**PLANNED, guidance=law))
    # law 2 above its altitude bounds; both in thin and thick air
    for angle, density, drag in ((0.1, 1.0, 1.0), (-0.08, 1.2, 0.97), (0.02, 0.85, 1.05)):
        area = 1.2569 * 12.017 / 5498.22 * drag * density
        start = (120e3, 7800.0, np.radians(-2.0 + angle))
        range_m, time = fly_guided(law, stored, start, area, 0.3 * area)
        row = fly_one(
            **PLANNED, guidance=law, entry_flight_path_angle_error_deg=angle, density_factor=density, cd_factor=drag,
            tolerance=1e-10,
        )  # fmt: skip
        # the kernel's gains are linear between rows 70 m/s apart at the end, where they change fast
        assert row["downrange_km"] == pytest.approx(range_m / 1e3, abs=0.15)
        assert row["flight_time_s"] == pytest.approx(time, abs=0.5)


@pytest.mark.parametrize("law", ["law1", "law2r", "law3r", "apollo"])
@pytest.mark.parametrize("farther", [-60.0, 40.0])
def test_another_target_moves_the_landing(law, farther):
    row = fly_one(**PLANNED, guidance=law, target_downrange_km=REFERENCE_KM + farther)
    assert row["miss_km"] < 1.5
    assert row["downrange_km"] == pytest.approx(REFERENCE_KM + farther, abs=1.5)


def test_a_scale_error_of_the_accelerometer_costs_law_3_its_range_and_law_1_nothing():
    wrong = {"accelerometer_scale_error": 0.01}
    shift = {law: fly_one(**PLANNED, guidance=law, **wrong)["downrange_km"] - REFERENCE_KM for law in ("law1", "law3r")}
    assert abs(shift["law1"]) < 0.2
    assert abs(shift["law3r"]) > 2.0


def test_a_load_above_the_limit_calls_for_all_the_lift():
    steep = PLANNED | {"guidance": "law1", "entry_flight_path_angle_error_deg": -0.15}
    plain, limited = (fly_one(**steep, load_limit_g=limit) for limit in (10.0, 3.0))
    seen = history(rows=2001, **steep, load_limit_g=3.0)
    above = np.flatnonzero(seen["load_g"] > 3.05)
    assert np.abs(seen["bank_deg"][above]).max() < 1e-9
    assert limited["peak_load_g"] < plain["peak_load_g"]


def test_dispersed_guided_cases_have_the_bits_of_each_alone():
    cases = off_nominal(PLANAR_SIGMA, 24, 5) | {
        "bank_lag_s": np.linspace(0.0, 2.0, 24),
        "accelerometer_noise_g": np.full(24, 1e-3),
    }
    together = fly_cases(**PLANNED, guidance="law3r", **cases)
    assert_same_bits_alone(together, (0, 9, 23), each=cases, **PLANNED, guidance="law3r")


# ---- with a side

ENTRY = {
    "speed_m_s": 7800.0, "flight_path_angle_deg": -2.0, "heading_deg": 53.9639, "latitude_deg": 45.5379,
    "longitude_deg": 41.4994, "radius_km": 6491.0,
}  # fmt: skip
TURNING = {f"{kind}_{name}": value for kind in ("entry", "plan") for name, value in ENTRY.items()}
TURNING |= {"plan": "given", "target_downrange_km": 2647.561, "bank_lag_s": 1.5}


@pytest.mark.parametrize("law", ["law1", "law2r", "law3r", "apollo"])
def test_over_the_turning_earth_reversals_bring_the_lift_back_to_the_target(law):
    cases = off_nominal(PLANAR_SIGMA, 200, 11) | {"entry_heading_error_deg": np.linspace(-0.05, 0.05, 200)}
    flown = fly_cases(**TURNING, **cases, guidance=law)
    assert set(flown["status"]) == {"ok"}
    assert np.abs(flown["crossrange_km"]).max() < 6.0
    assert flown["downrange_km"].std() < 5.0
    assert flown["reversals"].min() >= 3.0


def test_a_target_to_the_left_is_flown_to():
    row = fly_one(**TURNING, guidance="law1", target_crossrange_km=-60.0)
    assert row["crossrange_km"] == pytest.approx(-60.0, abs=3.0)


def test_the_bank_is_late_and_not_faster_than_its_limit():
    seen = history(rows=8001, **TURNING, guidance="law1", bank_rate_limit_deg_s=15.0)
    rate = np.gradient(seen["bank_deg"], seen["t_s"])
    assert 14.5 < np.abs(rate).max() < 15.0 * 1.2  # the cubic goes up to a fifth over it where the rate changes fast
    reversal = int(np.argmax(np.abs(np.diff(np.sign(seen["bank_deg"])))))
    assert np.ptp(seen["bank_deg"][reversal - 100 : reversal + 100]) > 60.0


def test_the_plan_gives_the_frame_of_the_distances_to_cases_that_enter_elsewhere():
    """As chained cases do, whose entry is a number of each and whose target is one for all."""
    moved = TURNING | {"entry_latitude_deg": 45.5379 + 0.05}
    assert fly_one(**moved, guidance="law1")["miss_km"] < 3.0
    own, given = fly_one(**moved | {"plan": "entry"}), fly_one(**moved)
    assert given["crossrange_km"] - own["crossrange_km"] == pytest.approx(
        -0.05 * 111.2 * np.sin(np.radians(54.0)), abs=1.0
    )
    assert given["final_latitude_deg"] == own["final_latitude_deg"]


# ---- the plan

NAMED = {name: value for name, value in TURNING.items() if name.startswith("entry_")}  # what a file need say, no more


@pytest.mark.parametrize("law", LAWS)
def test_a_law_plans_from_the_entry_the_vehicle_and_the_bank_of_the_case_unless_told(law):
    row = fly_one(**NAMED, guidance=law)
    assert row["status"] == "ok"
    assert row["reference_range_km"] == pytest.approx(TURNING["target_downrange_km"], abs=1e-3)
    # laws without range leave it to the reference, which knows no reversals
    assert row["miss_km"] < (20.0 if law in ("law2", "law3") else 1.5)


def test_the_plan_knows_no_errors_and_no_factors():
    errors = {
        "entry_speed_error_m_s": 5.0, "entry_flight_path_angle_error_deg": 0.1, "entry_heading_error_deg": 0.1,
        "entry_latitude_error_deg": 0.1, "entry_longitude_error_deg": 0.1, "entry_altitude_error_km": 1.0,
        "cd_factor": 1.1, "ld_factor": 0.9, "mass_factor": 1.02, "density_factor": 1.2, "bank_error_deg": 2.0,
        "stop_altitude_km": 9.0,
    }  # fmt: skip
    assert plan_of(**NAMED, guidance="law1", **errors) == plan_of(**NAMED, guidance="law1")


@pytest.mark.parametrize(
    ("name", "inputs"),
    [
        ("speed", {"entry_speed_m_s": 7900.0}), ("path", {"entry_flight_path_angle_deg": -2.5}),
        ("latitude", {"entry_latitude_deg": 10.0}), ("r", {"entry_radius_km": 6495.0}),
        ("drag", {"mass_kg": 5000.0}), ("lift_to_drag", {"lift_coefficient": 0.3}), ("share", {"bank_deg": 50.0}),
        ("trim", {"trim_angle_deg": 20.0}), ("lift_to_drag", {"vehicle": "apollo"}),
        ("end", {"plan_stop_altitude_km": 12.0}),
    ],
)  # fmt: skip
def test_another_entry_vehicle_or_bank_is_another_plan(name, inputs):
    plain, other = (plan_of(**NAMED | changed, guidance="law1") for changed in ({}, inputs))
    assert getattr(plain, name) != getattr(other, name)


def test_a_planned_arrival_on_a_hyperbola_is_that_of_its_periapsis():
    arrival = {"arrival": "hyperbola", "excess_speed_m_s": 3000.0, "vacuum_periapsis_km": 60.0, "rotating": False}
    plan, row = plan_of(**arrival, guidance="law1"), fly_one(**arrival)
    assert plan.speed == pytest.approx(row["relative_speed_m_s"], rel=1e-12)
    assert np.degrees(plan.path) == pytest.approx(row["relative_flight_path_angle_deg"], rel=1e-12)


def test_cases_of_several_plans_have_the_bits_of_each_alone():
    bank = np.array([60.0, 55.0, 65.0, 55.0, 60.0, 65.0, 60.0])
    law = np.array(["law1", "law1", "none", "law3r", "law3r", "law1", "law2"], dtype=object)
    angle = np.linspace(-0.1, 0.1, 7)
    cases = {"bank_deg": bank, "guidance": law, "entry_flight_path_angle_error_deg": angle}
    cases["weather_draw"] = np.linspace(0.1, 0.9, 7)
    together = fly_cases(**PLANAR, **cases, weather=True)
    assert set(together["status"]) == {"ok"}
    assert len(set(together["reference_range_km"][[0, 1, 5]])) == 3
    assert_same_bits_alone(together, range(7), each=cases, **PLANAR, weather=True)
