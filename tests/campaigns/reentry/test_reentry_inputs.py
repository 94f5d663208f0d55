"""From the inputs of a campaign file to the first state: frames, errors, vehicles, refusals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reentry_flights import MODEL, NOMINAL, fly_one
from reentry_twin import MU, OMEGA, RADIUS

from campaigns.reentry.vehicles import VEHICLES
from mc_engine.campaign.loading import load_campaign
from mc_engine.errors import CampaignError
from mc_engine.flight.flight import prepare


def prepared(**inputs):
    """Kernel parameters of one case by name, and the sentence of its refusal."""
    ready = prepare(MODEL, NOMINAL | inputs, 1)
    names = MODEL.kernel_parameters._fields
    return dict(zip(names, ready.parameters[:, 0], strict=True)), ready.refusals.reason[0]


def place_and_velocity(**inputs):
    p, reason = prepared(**inputs)
    assert reason == ""
    return np.array([p["x"], p["y"], p["z"]]), np.array([p["vx"], p["vy"], p["vz"]])


def test_at_the_equator_an_inertial_speed_to_the_east_is_less_over_ground():
    """The ground moves at omega r; the digest's sample return: 340 to 470 m/s and 0.2 degrees at 12.9 km/s."""
    fast = {"entry_speed_m_s": 12_900.0, "entry_flight_path_angle_deg": -8.2, "entry_radius_km": 6503.14}
    row = fly_one(**fast, vehicle="sample_return")
    level = 12_900.0 * np.cos(np.radians(8.2)) - OMEGA * 6503.14e3
    sinking = 12_900.0 * np.sin(np.radians(8.2))
    assert row["relative_speed_m_s"] == pytest.approx(np.hypot(level, sinking), rel=1e-12)
    assert row["relative_flight_path_angle_deg"] == pytest.approx(-np.degrees(np.arctan2(sinking, level)), rel=1e-12)


@given(
    latitude=st.floats(-85.0, 85.0), longitude=st.floats(-180.0, 180.0), heading=st.floats(0.0, 360.0),
    path=st.floats(-60.0, 5.0),
)  # fmt: skip
def test_relative_and_inertial_entries_differ_by_omega_cross_r(latitude, longitude, heading, path):
    inputs = {"entry_latitude_deg": latitude, "entry_longitude_deg": longitude, "entry_heading_deg": heading}
    inputs |= {"entry_flight_path_angle_deg": path}
    place, over_ground = place_and_velocity(**inputs, speed_frame="relative")
    _, inertial = place_and_velocity(**inputs, speed_frame="inertial")
    assert over_ground - inertial == pytest.approx(np.cross([0.0, 0.0, OMEGA], place), abs=1e-9)


def test_the_altitude_of_entry_is_over_the_ellipsoid():
    pole, _ = place_and_velocity(entry_latitude_deg=90.0)
    assert pole[2] == pytest.approx(6_356_752.3142 + 120e3, abs=1e-3)


def test_errors_are_added_to_the_planned_entry_and_leave_its_frame_alone():
    planned, _ = prepared(entry_latitude_deg=30.0)
    wrong, _ = prepared(
        entry_latitude_deg=30.0, entry_speed_error_m_s=10.0, entry_flight_path_angle_error_deg=0.1,
        entry_heading_error_deg=1.0, entry_latitude_error_deg=0.1, entry_longitude_error_deg=0.1,
        entry_altitude_error_km=1.0,
    )  # fmt: skip
    right, _ = prepared(
        entry_latitude_deg=30.1, entry_longitude_deg=0.1, entry_speed_m_s=7810.0, entry_flight_path_angle_deg=-1.9,
        entry_heading_deg=91.0, entry_radius_km=1e-3 * np.sqrt(sum(wrong[axis] ** 2 for axis in "xyz")),
    )  # fmt: skip
    for name in ("x", "y", "z", "vx", "vy", "vz", "relative_speed", "relative_flight_path_angle"):
        assert wrong[name] == pytest.approx(right[name], rel=1e-12, abs=1e-6), name
    for name in ("ex", "ey", "ez", "fx", "fy", "fz", "nx", "ny", "nz", "exit", "heading"):
        assert wrong[name] == planned[name], name


HYPERBOLA = {"arrival": "hyperbola", "vacuum_periapsis_km": 80.0, "rotating": False, "shape": "sphere"}


def test_a_hyperbola_arrives_with_the_energy_of_its_excess_speed_and_the_momentum_of_its_periapsis():
    place, velocity = place_and_velocity(**HYPERBOLA, excess_speed_m_s=3000.0)
    r, v2 = np.sqrt(place @ place), velocity @ velocity
    assert v2 / 2.0 - MU / r == pytest.approx(3000.0**2 / 2.0, rel=1e-9)
    periapsis = RADIUS + 80e3
    momentum = np.cross(place, velocity)
    assert np.sqrt(momentum @ momentum) == pytest.approx(
        periapsis * np.sqrt(3000.0**2 + 2.0 * MU / periapsis), rel=1e-9
    )
    assert place @ velocity < 0.0


def test_without_air_a_hyperbola_comes_down_to_its_vacuum_periapsis():
    row = fly_one(**HYPERBOLA, gravity="point", density_factor=0.0)
    assert row["min_altitude_km"] == pytest.approx(80.0, abs=1e-4)


def test_factors_multiply_what_they_are_named_after():
    plain, _ = prepared()
    assert prepared(mass_factor=1.1)[0]["drag"] == pytest.approx(plain["drag"] / 1.1, rel=1e-14)
    drag = prepared(cd_factor=1.1)[0]
    assert drag["drag"] == pytest.approx(1.1 * plain["drag"], rel=1e-14)
    assert drag["lift"] == pytest.approx(1.1 * plain["lift"], rel=1e-14)  # the lift-to-drag ratio stays
    lift = prepared(ld_factor=1.1)[0]
    assert lift["drag"] == plain["drag"]
    assert lift["lift"] == pytest.approx(1.1 * plain["lift"], rel=1e-14)
    assert prepared(nose_radius_factor=4.0)[0]["heating"] == pytest.approx(0.5 * plain["heating"], rel=1e-14)
    assert prepared(heating_factor=1.2)[0]["heating"] == pytest.approx(1.2 * plain["heating"], rel=1e-14)


@pytest.mark.parametrize("name", VEHICLES)
def test_a_vehicle_flies_like_its_numbers_given(name):
    v = VEHICLES[name]
    given_numbers = {
        "mass_kg": v.mass, "reference_area_m2": v.reference_area, "drag_coefficient": v.drag_coefficient,
        "lift_coefficient": v.lift_coefficient, "trim_angle_deg": np.degrees(v.trim_angle),
        "nose_radius_m": v.nose_radius,
    }  # fmt: skip
    named, reason = prepared(vehicle=name)
    other, _ = prepared(**given_numbers)
    assert reason == ""
    assert named == other
    assert named["planned_lift_to_drag"] == v.lift_coefficient / v.drag_coefficient


FLAT = {"shape": "flat", "gravity": "point", "rotating": False}
MARS = {"planet": "mars", "atmosphere": "exponential", "gravity": "point"}
REFUSED = [
    ({"planet": "mars", "gravity": "point", "shape": "sphere"}, 'the atmosphere "us76" is that of the Earth'),
    (MARS | {"gravity": "j2"}, 'the gravity "j2" is that of the Earth; take "point"'),
    (MARS | {"weather": True}, "the random air of weather = true is that of the Earth"),
    (MARS | {"heating": "detra_kemp_riddell"}, 'the heating "detra_kemp_riddell" is that of the Earth\'s air'),
    ({"shape": "flat", "gravity": "point"}, "a flat Earth does not turn; set rotating = false"),
    ({"shape": "flat", "rotating": False}, 'a flat Earth has the gravity "point", which is uniform, or "none"'),
    (FLAT | {"guidance": "law1"}, "the guidance laws want a round planet"),
    (
        {"vehicle": "apollo", "mass_kg": 5000.0},
        'mass_kg is that of the vehicle "apollo"; for another, set vehicle = "given"',
    ),
    ({"entry_altitude_km": 9.0}, "the entry is not above stop_altitude_km"),
    ({"entry_altitude_error_km": -111.0}, "the entry with its errors is not above stop_altitude_km"),
    ({"arrival": "hyperbola", "vacuum_periapsis_km": 130.0}, "the vacuum periapsis lies above the entry altitude"),
    ({"guidance": "law1", "vehicle": "soyuz"}, "a guidance law needs a vehicle with lift"),
    (
        {"guidance": "law1", "entry_speed_m_s": 11_500.0, "entry_flight_path_angle_deg": -4.0},
        "the planned entry does not come down to plan_stop_altitude_km, so that there is no reference path",
    ),
    (
        {"guidance": "law1", "plan_stop_altitude_km": 100.0},
        "the planned entry never has 0.15 g of drag, so that no law could steer",
    ),
    (
        {"guidance": "law1", "trim_angle_deg": -90.0},
        "on the planned entry the accelerometer along the axis feels no drag; check trim_angle_deg",
    ),
]


@pytest.mark.parametrize(("inputs", "sentence"), REFUSED, ids=lambda one: one if isinstance(one, str) else "")
def test_what_contradicts_itself_is_refused_with_a_reason(inputs, sentence):
    assert prepared(**inputs)[1] == sentence


@pytest.mark.parametrize(("planet", "speed"), [("mars", 5500.0), ("venus", 11_000.0)])
def test_other_planets_fly_with_their_textbook_atmospheres(planet, speed):
    row = fly_one(
        **{**MARS, "planet": planet}, vehicle="sample_return", entry_speed_m_s=speed, entry_altitude_km=200.0,
        stop_altitude_km=0.0, entry_flight_path_angle_deg=-20.0,
    )  # fmt: skip
    assert row["status"] == "ok"
    assert row["peak_load_g"] > 5.0


def test_a_flat_flight_has_its_range_ahead_and_its_crossrange_to_the_right():
    flat = FLAT | {"speed_frame": "relative", "entry_heading_deg": 33.0}
    row = fly_one(**flat, bank_deg=60.0, entry_heading_error_deg=1.0)
    assert row["downrange_km"] > 500.0
    assert row["crossrange_km"] > np.sin(np.radians(1.0)) * 500.0
    assert fly_one(**flat, bank_deg=0.0, density_factor=0.0, stop_altitude_km=100.0)["crossrange_km"] == pytest.approx(
        0.0, abs=1e-9
    )


def test_a_flight_cannot_end_at_its_start_where_no_event_happens(tmp_path):
    campaign = tmp_path / "campaign.toml"
    campaign.write_text('[campaign]\nmodel = "campaigns.reentry"\ncases = 1\n[parameters]\nstop_time_s = 0.0\n')
    with pytest.raises(CampaignError, match=r"parameters\.stop_time_s: 0"):
        load_campaign(campaign)
