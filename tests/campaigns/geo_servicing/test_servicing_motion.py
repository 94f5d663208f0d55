"""The motion against a second formulation flown by scipy, and what is known of the geostationary orbit."""

import numpy as np
import pytest
from servicing_flights import KEPLER, MODEL, SOURCE_BURNS, first_states, fly_cases, fly_one, history
from servicing_twin import MU, R0, RATE, SIDEREAL_DAY, Twin, elements, sidereal, sun_moon

from campaigns.geo_servicing.published.values import SCHEDULE as PUBLISHED
from mc_engine.model import load_model

FREE = {"phase": "free", "navigation": "perfect"}
EARTH_ALONE = FREE | {"sun_and_moon": False, "sunlight": False}
SYNCHRONOUS = {"initial_period_s": SIDEREAL_DAY, "initial_eccentricity": 0.0, "initial_longitude_deg": 95.0}
SYNCHRONOUS |= {"initial_inclination_deg": 0.0, "target_longitude_deg": 95.0}
TWENTY_REVOLUTIONS = 20.0 * SIDEREAL_DAY / 86_400.0  # days
EPOCH, EQUINOX = 58484.5, 58560.5


def place(row):
    return np.array([row[f"end_{axis}_m"] for axis in "xyz"])


def period_of(a):
    return 2.0 * np.pi * a**1.5 / np.sqrt(MU)


def deviation_deg(mean, t):
    """Mean longitude less that of 95 degrees east, a time t [s] after the epoch."""
    return np.degrees(np.angle(np.exp(1j * (mean - sidereal(EPOCH) - np.radians(95.0) - RATE * t))))


def test_thirty_free_days_agree_with_the_twin_to_a_metre():
    inputs = FREE | {"duration_days": 30.0, "sunlight": False}
    end = Twin(EPOCH).fly(0.0, first_states(**inputs)[0], 30.0 * 86_400.0, rtol=1e-13)
    assert np.linalg.norm(place(fly_one(**inputs)) - end[:3]) < 1.0


def test_sunlight_and_shadow_agree_with_the_twin_to_a_metre_in_the_season_of_eclipses():
    """The twin knows nothing of the shadow's edges: from five to seven hours it goes in steps of two minutes."""
    inputs = FREE | {"duration_days": 1.0, "sunlight": True, "epoch_utc": "2019-03-18T12:00:00", "tolerance": 1e-12}
    y, twin = first_states(**inputs)[0], Twin(EQUINOX, light=1.3 * 50.0 / 2500.0)
    in_sunlight = (np.arange(0.0, 18_000.0, 1200.0), np.arange(25_200.0, 86_400.0, 1200.0))
    for t in np.sort(np.concatenate([*in_sunlight, np.arange(18_000.0, 25_200.0, 120.0)])):
        longer = not 18_000.0 <= t < 25_200.0
        assert not longer or twin.seen(y[:3], sun_moon(EQUINOX + t / 86_400.0)[0]) == 1.0
        y = twin.fly(t, y, 1200.0 if longer else 120.0, rtol=1e-11)
    assert np.linalg.norm(place(fly_one(**inputs)) - y[:3]) < 1.0
    dark = place(fly_one(**inputs | {"sunlight": False}))
    assert np.linalg.norm(dark - y[:3]) > 100.0


def test_the_sources_burns_agree_with_the_twin():
    twin, t, y = Twin(EPOCH), 0.0, first_states(**PUBLISHED)[0]
    for coast, burn, sign in SOURCE_BURNS:
        y = twin.fly(t, y, coast)
        y = twin.fly(t + coast, y, burn, sign)
        t += coast + burn
    a, e, mean = elements(y)
    row = fly_one(**PUBLISHED)
    assert row["mean_longitude_deviation_deg"] == pytest.approx(deviation_deg(mean, t), abs=0.2 / 3600.0)
    assert row["period_error_s"] == pytest.approx(period_of(a) - SIDEREAL_DAY, abs=1e-3)
    assert row["eccentricity"] == pytest.approx(abs(e), abs=1e-9)
    assert row["transfer_time_s"] == pytest.approx(t, abs=1e-6)
    assert row["end_mass_left_kg"] == pytest.approx(y[6], abs=1e-6)


def test_the_flattened_earth_makes_a_craft_of_the_sidereal_period_drift_east():
    """Digest: osculating period T0, J2 alone: +0.0265 deg/rev."""
    inputs = EARTH_ALONE | SYNCHRONOUS | {"gravity_degree": 2.0, "gravity_order": 0.0}
    seen = history(**inputs, duration_days=TWENTY_REVOLUTIONS)
    drift = np.polyfit(seen["t_s"] / SIDEREAL_DAY, seen["longitude_deviation_deg"], 1)[0]
    assert drift == pytest.approx(0.0265, abs=3e-4)


def test_a_point_mass_and_nothing_else_keeps_the_orbit_and_the_longitude():
    row = fly_one(**FREE | KEPLER | SYNCHRONOUS, duration_days=30.0)
    assert row["final_longitude_deviation_deg"] == pytest.approx(0.0, abs=1e-6)
    assert row["final_eccentricity"] < 1e-10
    assert fly_one(**FREE | KEPLER)["final_eccentricity"] == pytest.approx(5e-4, abs=1e-10)


@pytest.mark.parametrize(
    ("e", "anomaly", "period_s"), [(2e-3, 0.7, 86_164.0), (0.0, 0.0, 86_150.0), (3e-4, -2.0, 86_150.0)]
)
def test_longitude_and_radius_move_as_to_first_order_in_drift_and_eccentricity(e, anomaly, period_s):
    """Equations (3.36) and (3.38)-(3.40) of the source, 0.4 days along: each of the four terms shows in a case."""
    start = {"initial_period_s": period_s, "initial_eccentricity": e, "initial_true_anomaly_deg": np.degrees(anomaly)}
    row = fly_one(**FREE | KEPLER | SYNCHRONOUS | start, duration_days=0.4)
    v, flown = 2.0 * np.pi * (SIDEREAL_DAY / period_s - 1.0), RATE * 0.4 * 86_400.0
    longitude = v * flown / (2.0 * np.pi) + 4.0 * e * np.sin(0.5 * flown) * np.cos(anomaly + 0.5 * flown)
    height = R0 * (-v / (3.0 * np.pi) - e * np.cos(anomaly + flown))
    second_order = 30.0 * (e + abs(v)) ** 2 + 4.0 * e * abs(v) * (flown + 1.0)
    assert np.radians(row["final_longitude_deviation_deg"]) == pytest.approx(longitude, abs=second_order + 1e-9)
    assert np.linalg.norm(place(row)) - R0 == pytest.approx(height, abs=R0 * second_order + 1.0)


def test_without_a_transfer_the_orbit_is_told_at_the_end_of_the_flight():
    row = fly_one(**FREE, duration_days=3.0, initial_longitude_deg=20.0, initial_inclination_deg=2.0)
    velocity = [row[f"end_v{axis}_m_s"] for axis in "xyz"]
    a, e, mean = elements(np.concatenate([place(row), velocity]))
    assert row["mean_longitude_deviation_deg"] == pytest.approx(deviation_deg(mean, 3.0 * 86_400.0), abs=1e-4)
    assert row["longitude_deviation_deg"] == row["final_longitude_deviation_deg"]
    assert row["period_error_s"] == pytest.approx(period_of(a) - SIDEREAL_DAY)
    assert row["eccentricity"] == row["final_eccentricity"] == pytest.approx(abs(e), rel=1e-9)
    assert row["inclination_deg"] == pytest.approx(2.0, abs=0.01)
    assert row["corrections"] == row["delta_v_m_s"] == 0.0
    assert np.isnan(row["transfer_time_s"])


def test_the_longitude_accelerates_as_the_transverse_pull_says():
    """d2(longitude)/dt2 = -3 g/r: at 95 E by 2 b_s = -1.34e-3 deg/rev^2 with degree 4."""
    seen = history(**EARTH_ALONE | SYNCHRONOUS, duration_days=TWENTY_REVOLUTIONS)
    revolutions, longitude = seen["t_s"] / SIDEREAL_DAY, seen["longitude_deviation_deg"]
    # the sample stays near 95 E: within half a degree the pull changes by 2 %
    assert 2.0 * np.polyfit(revolutions, longitude, 2)[0] == pytest.approx(-1.34e-3, rel=0.05)


@pytest.mark.parametrize("duration", [0.01, 0.25, 2.0, 7.25])
def test_a_flight_finds_sun_and_moon_until_its_end_whenever_it_begins(duration):
    """The tables reach as far as the flight: a step more or less of it changes nothing at any hour of the day."""
    errors = np.arange(0.0, 0.75, 0.0625)
    row = fly_cases(**FREE, duration_days=duration, epoch_error_days=errors)
    longer = fly_cases(**FREE, duration_days=duration, epoch_error_days=np.append(errors, 500.0))
    assert (row["status"] == "ok").all()
    assert (row["end_x_m"] == longer["end_x_m"][:-1]).all()


@pytest.mark.slow
def test_a_case_has_the_same_bits_whatever_the_width():
    inputs = {"phase": "inspection", "duration_days": 3.0, "epoch_utc": "2019-12-11T00:00:00"}
    inputs |= {"thrust_noise_pct": np.full(5, 0.5)}
    wide, other = fly_cases(**inputs), fly_cases(**inputs, width=1)
    for name in ("end_x_m", "end_vy_m_s", "min_range_m", "delta_v_m_s"):
        assert (wide[name] == other[name]).all()


def test_what_contradicts_itself_is_refused_with_a_sentence():
    order = fly_one(gravity_degree=2.0, gravity_order=3.0, phase="free")
    degree = fly_one(gravity_degree=1.0, gravity_order=0.0, phase="free")
    assert (order["status"], degree["status"]) == ("refused", "refused")
    assert "gravity_order" in order["reason"]
    assert "degree 1" in degree["reason"]
    assert fly_one(phase="free", mass_error_kg=-2500.0)["status"] == "refused"
    assert load_model("campaigns.geo_servicing") is MODEL
