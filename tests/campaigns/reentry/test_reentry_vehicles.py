"""Vehicles whose coefficients go by the Mach number: the curves, a flight by them twice more, loads, reference."""

import numpy as np
import pytest
from guidance_twin import low, rates
from reentry_flights import assert_same_bits_alone, fly_cases, fly_one, history
from reentry_twin import G0
from scipy.integrate import solve_ivp

from campaigns.reentry.guidance.plan import plan_of
from campaigns.reentry.guidance.reference import ALONG, fly_reference
from campaigns.reentry.published.values import PLANAR
from campaigns.reentry.vehicles import apollo_shares

# C. A. Graves, J. C. Harpold, NASA TN D-6725 (1972), table I: Mach number, drag and lift coefficient at trim.
PRINTED = [
    (0.4, 0.85300, 0.24465), (0.7, 0.98542, 0.26325), (0.9, 1.10652, 0.32074), (1.1, 1.1697, 0.49373),
    (1.2, 1.1560, 0.47853), (1.35, 1.2788, 0.56282), (1.65, 1.2657, 0.55002), (2.0, 1.2721, 0.53247),
    (2.4, 1.2412, 0.50740), (3.0, 1.2167, 0.47883), (4.0, 1.2148, 0.44147), (10.0, 1.2246, 0.42856),
    (29.5, 1.2891, 0.38773),
]  # fmt: skip
APOLLO = {"vehicle": "apollo", **PLANAR}


@pytest.mark.parametrize(("mach", "drag", "lift"), PRINTED)
def test_the_flights_curves_hold_the_printed_coefficients(mach, drag, lift):
    shares = apollo_shares(mach)
    assert (1.2891 * shares[0], 0.38773 * shares[1]) == pytest.approx((drag, lift), rel=1e-12)


def sound(h):
    """Speed of sound [m/s] below 47 km, as the 1976 standard prints its temperatures."""
    z = 6_356_766.0 * h / (6_356_766.0 + h)
    return np.sqrt(
        1.4 * 287.05287 * np.interp(z, [0e3, 11e3, 20e3, 32e3, 47e3], [288.15, 216.65, 216.65, 228.65, 270.65])
    )


def test_the_capsule_slows_down_by_its_table_as_in_another_integration():
    """From 40 km and Mach 10 down to 10 km and Mach 0.5, over a sphere at rest."""
    mach, of_drag, of_lift = np.array(PRINTED).T

    def by_mach(t, y):
        m, area = y[1] / sound(y[0]), 12.017 / 5498.22
        return rates(t, y, 0.5, area * np.interp(m, mach, of_drag), area * np.interp(m, mach, of_lift))

    start = [40e3, 3200.0, np.radians(-8.0), 0.0]
    flown = solve_ivp(by_mach, (0.0, 1e3), start, "DOP853", rtol=1e-10, atol=1e-8, max_step=0.5, events=low)
    late = {"entry_altitude_km": 40.0, "entry_speed_m_s": 3200.0, "entry_flight_path_angle_deg": -8.0}
    row = fly_one(**APOLLO, **late, tolerance=1e-11)
    _, v, _, along = flown.y[:, -1]
    # the corners of the table cost either integrator a few digits
    assert row["downrange_km"] == pytest.approx(along / 1e3, abs=0.002)
    assert row["final_speed_m_s"] == pytest.approx(v, abs=0.01)
    assert row["flight_time_s"] == pytest.approx(flown.t[-1], abs=0.01)
    constant = fly_one(**PLANAR, **late, drag_coefficient=1.2891, lift_coefficient=0.38773)
    assert abs(constant["final_speed_m_s"] - v) > 10.0


def test_the_loads_are_those_of_the_coefficients_at_their_mach_number():
    seen, row = history(rows=4001, **APOLLO, tolerance=1e-10), fly_one(**APOLLO, tolerance=1e-10)
    mach, of_drag, of_lift = np.array(PRINTED).T
    drag, lift = np.interp(seen["mach"], mach, of_drag), np.interp(seen["mach"], mach, of_lift)
    pressure = seen["dynamic_pressure_pa"] * 12.017 / 5498.22 / G0
    assert seen["load_g"] == pytest.approx(pressure * np.hypot(drag, lift), rel=1e-6, abs=1e-9)
    along = drag * np.cos(np.radians(20.0)) + lift * np.sin(np.radians(20.0))
    assert seen["axial_load_g"] == pytest.approx(pressure * along, rel=1e-6, abs=1e-9)
    # the peak is looked for in the dynamic pressure, while the coefficients change by 1 % in a minute
    assert row["peak_load_g"] == pytest.approx(seen["load_g"].max(), rel=3e-5)
    assert row["peak_axial_load_g"] == pytest.approx(seen["axial_load_g"].max(), rel=3e-5)


def test_factors_multiply_the_coefficients_at_every_mach_number():
    table = fly_one(**APOLLO, cd_factor=1.1, mass_factor=1.1, tolerance=1e-11)
    plain = fly_one(**APOLLO, tolerance=1e-11)
    assert table["downrange_km"] == pytest.approx(plain["downrange_km"], abs=1e-4)


def test_the_reference_of_a_vehicle_with_a_table_is_its_flight():
    path, row = fly_reference(plan_of(**APOLLO)), fly_one(**APOLLO, tolerance=1e-10)
    ten_metres = 0.010
    assert path.state[ALONG, -1] / 1e3 == pytest.approx(row["downrange_km"], abs=ten_metres)
    seen = history(rows=801, **APOLLO, tolerance=1e-10)
    assert np.abs(np.interp(seen["t_s"], path.t, path.axial) / G0 - seen["axial_load_g"]).max() < 0.01


@pytest.mark.parametrize(("law", "miss_km"), [("law1", 0.5), ("law2r", 0.5), ("law3r", 0.5), ("apollo", 2.5)])
def test_a_vehicle_with_a_table_is_guided_to_the_end_of_its_reference(law, miss_km):
    """The flown coefficients of "apollo" belong to another reference, and its law knows the hypersonic lift alone."""
    assert fly_one(**APOLLO, guidance=law)["miss_km"] < miss_km


def test_vehicles_may_be_mixed_and_have_the_bits_of_each_alone():
    names = np.array(["apollo", "given", "sample_return", "apollo", "soyuz"] * 4, dtype=object)
    angle = np.linspace(-3.0, -2.0, 20)
    together = fly_cases(**PLANAR, vehicle=names, entry_flight_path_angle_deg=angle)
    each = {"vehicle": names, "entry_flight_path_angle_deg": angle}
    assert_same_bits_alone(together, range(5), each=each, **PLANAR)
