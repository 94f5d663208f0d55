"""The motion against two others that share no line with it: inertial Cartesian, and Vinh's equations."""

import numpy as np
import pytest
from reentry_flights import MODEL, fly_cases, fly_one
from reentry_twin import Scenario, fly_inertial, fly_vinh, standard_density, textbook_density

N_CASES, DURATION = 10, 120.0  # s: down into the dense air and through the peak of the load
ONE_MILLIMETRE, TEN_MICRONS_A_SECOND = 1e-3, 1e-5
# over the corners of the 1976 standard no integrator knows its error: neither of the twins, nor ours
ROUGHER = 10.0


def random_cases(seed):
    """(inputs of the model, starts in Vinh's variables, scenarios) of entries from all over the Earth."""
    rng = np.random.default_rng(seed)
    latitude, longitude = rng.uniform(-80, 80, N_CASES), rng.uniform(-180, 180, N_CASES)
    heading, bank = rng.uniform(0, 360, N_CASES), rng.uniform(-100, 100, N_CASES)
    speed, path = rng.uniform(6000, 12_500, N_CASES), rng.uniform(-8, -2, N_CASES)
    radius = rng.uniform(6_440, 6_480, N_CASES)
    mass, drag, lift = rng.uniform(100, 600, N_CASES), rng.uniform(0.8, 1.5, N_CASES), rng.uniform(0.0, 0.5, N_CASES)
    inputs = {
        "entry_latitude_deg": latitude, "entry_longitude_deg": longitude, "entry_heading_deg": heading,
        "entry_speed_m_s": speed, "entry_flight_path_angle_deg": path, "entry_radius_km": radius, "mass_kg": mass,
        "reference_area_m2": 1.0, "drag_coefficient": drag, "lift_coefficient": lift, "bank_deg": bank,
    }  # fmt: skip
    angles = [np.radians(value) for value in (longitude, latitude, path, heading)]
    starts = np.array([1e3 * radius, angles[0], angles[1], speed, angles[2], angles[3]]).T
    return inputs, starts, [(drag[i] / mass[i], lift[i] / mass[i], np.radians(bank[i])) for i in range(N_CASES)]


def ends_of(inputs, **settings):
    """Place and velocity over ground [6, n] where the model is after DURATION."""
    columns = fly_cases(
        **inputs, **settings, speed_frame="relative", stop_altitude_km=-20.0, stop_time_s=DURATION, tolerance=1e-13,
        on_exit="continue",
    )  # fmt: skip
    assert set(columns["status"]) == {"ok"}
    assert columns["flight_time_s"] == pytest.approx(DURATION, abs=1e-12)
    return np.array([columns[f"end_{field.name}"] for field in MODEL.states[:6]])


WORLDS = {  # density, turning, oblate
    "turning ellipsoid, J2, 1976 standard": (standard_density, True, True),
    "turning ellipsoid, J2, textbook air": (textbook_density, True, True),
    "sphere at rest, 1976 standard": (standard_density, False, False),
}


@pytest.mark.parametrize("world", WORLDS)
def test_place_and_velocity_are_those_of_both_twins(world):
    density, turning, oblate = WORLDS[world]
    inputs, starts, vehicles = random_cases(list(WORLDS).index(world))
    settings = {"atmosphere": "us76" if density is standard_density else "exponential", "rotating": turning}
    settings |= {} if oblate else {"shape": "sphere", "gravity": "point"}
    ends = ends_of(inputs, **settings)
    rougher = ROUGHER if density is standard_density else 1.0
    for i, (drag, lift, bank) in enumerate(vehicles):
        case = Scenario(drag, lift, bank, density, turning, oblate)
        for twin in (fly_inertial, fly_vinh):
            place, velocity = twin(starts[i], DURATION, case)
            assert np.abs(ends[:3, i] - place).max() < ONE_MILLIMETRE * rougher, (i, twin.__name__)
            assert np.abs(ends[3:, i] - velocity).max() < TEN_MICRONS_A_SECOND * rougher, (i, twin.__name__)


def crossrange(bank):
    return fly_one(bank_deg=bank, entry_heading_deg=30.0, rotating=False)["crossrange_km"]


def test_lift_to_the_right_turns_the_flight_to_the_right():
    assert crossrange(60.0) > 100.0
    assert crossrange(-60.0) < -100.0
    assert abs(crossrange(0.0)) < 1.0


def test_a_flight_over_the_pole_is_like_any_other_on_a_sphere_at_rest():
    """Where Vinh's equations are singular."""
    sphere = {"shape": "sphere", "gravity": "point", "rotating": False, "speed_frame": "relative", "tolerance": 1e-11}
    across = fly_one(**sphere, entry_latitude_deg=80.0, entry_heading_deg=0.0, bank_deg=30.0)
    along = fly_one(**sphere, entry_latitude_deg=0.0, entry_heading_deg=90.0, bank_deg=30.0)
    for name in ("downrange_km", "crossrange_km", "peak_load_g", "flight_time_s", "heat_load_j_m2"):
        assert across[name] == pytest.approx(along[name], rel=2e-6), name
