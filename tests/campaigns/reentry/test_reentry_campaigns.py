"""The campaign files: each kind of entry does what it is there to show."""

import numpy as np
import pytest
from reentry_flights import fly_cases
from reentry_twin import MU, RADIUS

from campaigns.reentry.closed_forms import circular_speed
from campaigns.reentry.critical_trajectories import critical_periapses, interface_km
from campaigns.reentry.published.values import PLANAR
from mc_engine.campaign.loading import load_campaign
from mc_engine.campaign.search import list_campaigns
from mc_engine.flight.flight import chosen_case

NAMES = sorted(campaign.name for campaign in list_campaigns() if campaign.name.split("/")[0] == "reentry")
AIMED = [name for name in NAMES if "target_downrange_km" in load_campaign(name).parameters and "from_" not in name]
CHAINED = [name for name in NAMES if "from_" in name]
AEROBRAKE = (
    "excess_speed_m_s", "gravity", "atmosphere", "mass_kg", "reference_area_m2", "drag_coefficient", "lift_coefficient",
    "stop_altitude_km",
)  # fmt: skip
GUIDED = {"guided", "guided_law2r", "guided_law3r"}


def nominal(name, **inputs):
    """The row of a file's nominal case."""
    campaign = load_campaign(name)
    return chosen_case(campaign.model, {**campaign.nominal, **inputs}, seed=1)


@pytest.mark.parametrize("name", NAMES)
def test_the_nominal_case_of_each_file_flies_to_its_end(name):
    assert nominal(name)["status"] == "ok"


@pytest.mark.parametrize("name", AIMED)
def test_the_target_of_a_file_is_where_its_nominal_case_ends(name):
    ten_metres = 0.010
    assert nominal(name)["miss_km"] < ten_metres


@pytest.mark.parametrize("name", CHAINED)
def test_a_chained_file_aims_where_the_guided_one_does(name):
    """Each of its cases enters elsewhere, so that it says the plan and the target of all."""
    campaign, guided = load_campaign(name), load_campaign("reentry/guided")
    assert campaign.parameters["target_downrange_km"] == pytest.approx(
        nominal("reentry/guided")["reference_range_km"], abs=0.001
    )
    for key, value in campaign.parameters.items():
        if key.startswith("plan_"):
            assert value == guided.nominal[key.replace("plan_", "entry_")], key


@pytest.mark.parametrize("name", sorted(GUIDED))
def test_a_guided_file_flies_to_the_end_of_its_reference_and_draws_what_the_open_loop_draws(name):
    campaign, open_loop = load_campaign(f"reentry/{name}"), load_campaign("reentry")
    one_and_a_half_kilometres = 1.5
    assert nominal(campaign.name)["miss_km"] < one_and_a_half_kilometres
    assert campaign.seed == open_loop.seed
    mine = {dispersion.name: dispersion for dispersion in campaign.dispersions}
    assert all(mine[dispersion.name].distribution == dispersion.distribution for dispersion in open_loop.dispersions)


def test_the_main_campaign_enters_where_the_deorbit_campaign_aims():
    aimed, flown = nominal("deorbit"), load_campaign("reentry").nominal
    for what in ("speed_m_s", "flight_path_angle_deg", "heading_deg", "latitude_deg", "longitude_deg", "radius_km"):
        assert flown[f"entry_{what}"] == pytest.approx(aimed[f"entry_{what}"], abs=1e-4), what


def test_the_double_dip_stays_inside_and_would_leave_without_its_roll():
    assert nominal("reentry/double_dip")["exits"] == 0.0
    assert nominal("reentry/double_dip", roll_flight_path_angle_deg=90.0)["exits"] > 0.0


@pytest.fixture(scope="module")
def periapses():
    return critical_periapses(load_campaign("reentry/aerobraking").nominal)


def test_at_the_first_critical_trajectory_the_vehicle_leaves_at_escape_speed(periapses):
    campaign = load_campaign("reentry/aerobraking").nominal
    for step, lost in ((1e-4, True), (-1e-4, False)):
        row = nominal("reentry/aerobraking", vacuum_periapsis_km=periapses.capture + step)
        escape = np.sqrt(2.0 * MU / (RADIUS + 1e3 * campaign["entry_altitude_km"]))
        assert row["exit_speed_m_s"] == pytest.approx(escape, rel=1e-5)
        assert np.isnan(row["exit_apoapsis_altitude_km"]) == lost


def test_below_the_second_critical_trajectory_the_vehicle_comes_down_at_once(periapses):
    above = nominal("reentry/aerobraking", vacuum_periapsis_km=periapses.entry + 1e-4)
    below = nominal("reentry/aerobraking", vacuum_periapsis_km=periapses.entry - 1e-4)
    assert (above["exits"], below["exits"]) == (1.0, 0.0)
    assert below["final_altitude_km"] == pytest.approx(0.0, abs=1e-6)
    # it leaves below circular speed, almost level
    assert above["exit_speed_m_s"] < circular_speed(120.0)
    assert above["exit_flight_path_angle_deg"] < 0.1


@pytest.mark.parametrize("planet", ["mars", "venus"])
def test_critical_trajectories_are_found_at_other_planets_from_where_their_air_begins(planet):
    """Both in the air, the capture higher; on Venus, whose entries begin at 328 km, above 120 km."""
    inputs = {name: load_campaign("reentry/aerobraking").nominal[name] for name in AEROBRAKE}
    periapses = critical_periapses({**inputs, "planet": planet})
    assert 0.3 * interface_km(planet) < periapses.entry < periapses.capture < 0.9 * interface_km(planet)
    height = {"venus": 15.9, "mars": 11.1}[planet]
    assert 0.5 < (periapses.capture - periapses.entry) / height < 3.0  # a scale height or two


def test_captured_passes_come_back_with_falling_apoapses():
    """Between the two critical trajectories: the next passes keep their periapsis and lose apoapsis."""
    campaign = load_campaign("reentry/aerobraking")
    first = nominal(campaign.name)
    assert first["exit_apoapsis_altitude_km"] > 10_000.0
    # the orbit that the first pass leaves, entered again on its way down
    second = nominal(
        campaign.name, arrival="state", entry_speed_m_s=first["exit_speed_m_s"],
        entry_flight_path_angle_deg=-first["exit_flight_path_angle_deg"],
    )  # fmt: skip
    assert second["exits"] == 1.0
    assert second["exit_apoapsis_altitude_km"] < first["exit_apoapsis_altitude_km"]
    assert second["min_altitude_km"] == pytest.approx(first["min_altitude_km"], abs=2.0)


def test_open_loop_misses_have_the_scatter_of_the_linear_root_sum_square():
    """The digest's planar baseline and dispersions: 56.76 km within 8 %."""
    rng, n = np.random.default_rng(20030401), 4000
    sigma = {
        "entry_speed_error_m_s": 5.0, "entry_flight_path_angle_error_deg": 0.05, "density_factor": 0.1,
        "cd_factor": 0.1 / 3, "ld_factor": 0.1 / 3, "mass_factor": 0.02 / 3,
    }  # fmt: skip
    inputs = {name: rng.normal(1.0 if name.endswith("factor") else 0.0, s, n) for name, s in sigma.items()}
    flown = fly_cases(**PLANAR, **inputs)["downrange_km"]
    assert flown.std() == pytest.approx(56.76, rel=0.08)
