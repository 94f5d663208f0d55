"""The inspection law, its procedure beside a twin of it, and what it holds."""

from types import SimpleNamespace

import numpy as np
import pytest
from procedure_twin import settled_ranges
from servicing_flights import INSPECTION, first_states, fly_cases, fly_one, history
from servicing_twin import MU, R0, RATE, SIDEREAL_DAY, Twin, elements

from campaigns.geo_servicing.inspection import Relative, correction, relative_orbit, wait_until
from campaigns.geo_servicing.navigation import EXACT
from mc_engine.physics.orbital_elements import state_of_elements

EPOCH, DAY = 58828.0, 86_400.0
AXES = ("x", "y", "z", "vx", "vy", "vz")
FIVE_DAYS = {"duration_days": 5.0, "settle_time_days": 4.0}
EXECUTION = {"thrust_noise_pct": 0.5, "pointing_noise_deg": 1.0 / 6.0}
GOOD_FIXES = {"navigation": "raw", "nav_position_m": 0.1, "nav_velocity_m_s": 1e-5}
PRINTED_FIXES = {"nav_position_m": 1.0, "nav_velocity_m_s": 0.1}
FILTERED = PRINTED_FIXES | {
    "navigation": "filtered", "inspection_law": "pairs", "observation_days": 1.0, "fix_period_s": 600.0,
    "filter_noise_m_s2": 1e-10,
}  # fmt: skip
LOW, HIGH = 19.1, 82.0  # m, the range of all trials in the source


def test_the_law_gives_the_digests_number():
    assert correction(0.001, -0.0005, 1.0, 0.25, 0.0, 0.1, 0.005) == pytest.approx(-2.777713e-4, abs=1e-9)


@pytest.mark.parametrize("chi1", [0.0, 0.25, 0.85])
def test_without_weights_a_correction_takes_its_share_of_the_deviation(chi1):
    """y is multiplied by chi1/(t^2 + chi1), the drift left is -y t/(t^2 + chi1)."""
    y, v, t = 40.0, 300.0, 1.3
    left = v + correction(y, v, t, chi1, 0.0, 0.0, 0.0)
    assert left == pytest.approx(-y * t / (t * t + chi1))
    assert y + left * t == pytest.approx(y * chi1 / (t * t + chi1))


@pytest.mark.parametrize(("end", "expected"), [(0.0, 73_077.9), (np.pi, 116_160.0)])
def test_the_coast_to_the_ends_of_the_relative_ellipse_is_the_digests(end, expected):
    """(3.45), of the relative ellipse by (3.43), (3.44): the triangle of both eccentricity vectors."""
    crafts = {"": on_x_axis(3.25e-4, 54.99), "target_": on_x_axis(3.15e-4, 55.0)}
    named = {f"{name}{axis}": value for name, y in crafts.items() for axis, value in zip(AXES, y, strict=True)}
    flown = relative_orbit(SimpleNamespace(**named), EXACT)
    assert flown.e == pytest.approx(1.0e-5, rel=1e-3)
    cosine_rule = 3.25e-4**2 + 3.15e-4**2 - 2 * 3.25e-4 * 3.15e-4 * np.cos(np.radians(0.01))
    assert flown.e**2 == pytest.approx(cosine_rule, rel=1e-6)
    assert np.degrees(flown.phase) == pytest.approx(54.675, abs=0.01)
    assert SIDEREAL_DAY * wait_until(flown, end, 0.75) == pytest.approx(expected, abs=1.0)


def on_x_axis(e, anomaly_deg):
    """State of an equatorial orbit of the geostationary semi-major axis, the craft being on the x axis."""
    anomaly = np.radians(anomaly_deg)
    return state_of_elements(R0, e, 0.0, 0.0, -anomaly, anomaly, MU)


def test_waiting_ends_at_the_phase_and_is_never_shorter_than_allowed():
    for phase in np.linspace(-3.0, 6.0, 31):
        for wanted in (0.0, np.pi):
            wait = wait_until(Relative(0.0, 0.0, 0.0, phase), wanted, 0.75)
            assert 0.75 <= wait < 1.75
            assert np.exp(1j * (phase + 2.0 * np.pi * wait)) == pytest.approx(np.exp(1j * wanted), abs=1e-12)


def test_the_start_is_the_digests():
    seen = {name: values[0] for name, values in history(**INSPECTION | FIVE_DAYS, rows=50).items()}
    assert seen["range_m"] == pytest.approx(7374.3, rel=1e-3)
    assert seen["relative_drift_m"] == pytest.approx(2369.7, rel=1e-3)
    assert seen["relative_eccentricity"] == pytest.approx(1e-5, rel=1e-3)
    module, target = pair(**INSPECTION)
    ahead = R0 * np.angle(np.exp(1j * (elements(module)[2] - elements(target)[2])))
    assert ahead == pytest.approx(-8046.9, rel=1e-3)


def pair(**inputs):
    """State with mass of both craft as the kernel gets them."""
    module, target = first_states(**inputs)
    return module, np.append(target, 2500.0)


def relative(module, target):
    """(y less the nominal place, drift [m/rev], length of the eccentricity vectors' difference, its phase)."""
    (a_s, e_s, mean_s), (a_t, e_t, mean_t) = elements(module), elements(target)
    along = R0 * np.angle(np.exp(1j * (mean_s - mean_t)))
    true = np.arctan2(module[1], module[0])
    return along + 39.5, -3.0 * np.pi * R0 * (a_s - a_t) / a_t, abs(e_s - e_t), true - np.angle(e_s - e_t)


def law(y, v, chi1=0.85, sigma=0.005):
    q = 1.0 + chi1
    return -(y + q * v) / ((1.0 + sigma**2) * q)


def twin_burns(count):
    """[(time [day], velocity change [m/s])] by the digest's procedure 6.3, flown by the twin."""
    twin, t, out = Twin(EPOCH), 0.0, []
    module, target = pair(**INSPECTION)
    while len(out) < count:
        y, v, _, alpha = relative(module, target)
        waits = []
        for phase, sign in ((0.0, 1.0), (np.pi, -1.0)):
            wait = ((phase - alpha) / (2.0 * np.pi)) % 1.0
            while wait < 0.75:
                wait += 1.0
            if law(y + v * wait, v) * sign > 0.0:
                waits.append(wait)
        length = SIDEREAL_DAY * min(waits, default=1.0)
        module, target, t = twin.fly(t, module, length), twin.fly(t, target, length), t + length
        if not waits:
            continue
        y, v, _, _ = relative(module, target)
        dv = -law(y, v) * RATE / (6.0 * np.pi)
        out.append((t / DAY, dv))
        burn = module[6] * abs(dv)
        module, target = twin.fly(t, module, burn, np.sign(dv)), twin.fly(t, target, burn)
        t += burn
    return np.array(out)


@pytest.fixture(scope="module")
def first_burns():
    return twin_burns(3)


def test_the_first_burns_of_the_twin_are_the_digests(first_burns):
    assert first_burns[:, 1] == pytest.approx([-3.341e-3, 1.0154e-2, 1.287e-3], rel=0.03)
    assert first_burns[:, 0] == pytest.approx([0.845, 2.341, 3.338], rel=0.03)


def test_the_flight_burns_when_and_what_its_twin_burns(first_burns):
    seen = history(**INSPECTION | {"duration_days": 3.6, "settle_time_days": 3.5}, rows=5185)
    after = np.flatnonzero(np.diff(seen["corrections"]) > 0.5) + 1
    spent = np.diff(np.append(0.0, seen["delta_v_m_s"][after]))
    assert spent == pytest.approx(np.abs(first_burns[:, 1]), rel=1e-3)
    assert seen["t_s"][after] / DAY == pytest.approx(first_burns[:, 0], abs=150.0 / DAY)


def test_the_band_after_fifteen_days_is_the_digests():
    row = fly_one(**INSPECTION)
    assert row["settled_min_range_m"] == pytest.approx(23.8, abs=4.0)
    assert row["settled_max_range_m"] == pytest.approx(55.2, abs=4.0)
    assert row["relative_eccentricity"] == pytest.approx(1.86e-7, rel=0.01)
    assert row["steady"] == 1.0
    wider = fly_one(**INSPECTION, chi1=0.9)
    assert (wider["settled_min_range_m"], wider["settled_max_range_m"]) == pytest.approx((32.0, 47.0), abs=4.0)


def held(row):
    return (row["settled_min_range_m"] >= LOW) & (row["settled_max_range_m"] <= HIGH)


def twin_share(chi1, **errors):
    least, largest = settled_ranges(1000, chi1, 0.1, 1e-5, **errors)
    return ((least >= LOW) & (largest <= HIGH)).mean()


@pytest.mark.parametrize("chi1", [0.85, pytest.param(0.9, marks=pytest.mark.slow)])
def test_as_many_runs_hold_the_sources_band_as_of_a_twin_on_point_mass_orbits(chi1):
    """0.1 m and 1e-5 m/s relative, every look a fix of its own; fresh errors of thrust and pointing in every burn."""
    share = held(fly_cases(**INSPECTION | GOOD_FIXES | EXECUTION, chi1=np.full(1000, chi1))).mean()
    assert share == pytest.approx(twin_share(chi1, thrust=0.005, pointing=np.radians(1.0 / 6.0)), abs=0.04)


def test_navigation_of_a_decimetre_holds_the_sources_band_if_the_gain_is_right():
    """0.1 m and 1e-5 m/s relative, used as they come: 99 % with chi1 = 0.9."""
    assert held(fly_cases(**INSPECTION | GOOD_FIXES, chi1=np.full(400, 0.9))).mean() >= 0.95


@pytest.mark.slow
def test_with_the_gain_of_the_ideal_case_one_trial_in_eight_leaves_the_sources_band():
    """The source has all of them inside; nine in ten were hoped for.  The procedure with chi1 = 0.85 leaves a relative
    ellipse of half the band already without errors, and goes 4.7 m near the limit; drift errors of 3 m in a revolution
    do the rest.  Without errors of thrust it is one in six, because that ellipse is then always as wide.
    """
    chi1 = np.full(1000, 0.85)
    share = held(fly_cases(**INSPECTION | GOOD_FIXES | EXECUTION, chi1=chi1)).mean()
    assert share == pytest.approx(0.88, abs=0.03)
    assert held(fly_cases(**INSPECTION | GOOD_FIXES, chi1=chi1)).mean() == pytest.approx(0.845, abs=0.035)


def test_corrections_in_pairs_hold_the_sources_band_in_every_trial():
    """The same errors: the pair takes the relative ellipse away, whatever the gain."""
    for chi1 in (0.5, 0.85):
        pairs = INSPECTION | GOOD_FIXES | EXECUTION | {"inspection_law": "pairs"}
        assert held(fly_cases(**pairs, chi1=np.full(200, chi1))).all()


def test_fixes_of_both_craft_err_as_one_relative_fix_of_their_root_sum_square():
    both = {"nav_position_m": 0.06, "target_nav_position_m": 0.08, "nav_velocity_m_s": 6e-6} | FIVE_DAYS
    row = fly_one(**INSPECTION | {"navigation": "raw"} | both | {"target_nav_velocity_m_s": 8e-6})
    relative_fix = fly_one(**INSPECTION | GOOD_FIXES | FIVE_DAYS)
    assert row["delta_v_m_s"] == pytest.approx(relative_fix["delta_v_m_s"], rel=1e-9)
    assert row["delta_v_m_s"] != fly_one(**INSPECTION | {"navigation": "raw"} | both)["delta_v_m_s"]


def test_a_flight_that_ends_before_it_counts_as_settled_has_no_settled_range():
    """A range of none would meet every limit."""
    row = fly_one(**INSPECTION | {"duration_days": 1.0, "settle_time_days": 2.0})
    assert np.isnan([row["settled_min_range_m"], row["settled_max_range_m"]]).all()
    assert row["steady"] == 0.0


def test_without_a_time_to_settle_the_settled_range_is_that_of_the_flight():
    row = fly_one(**INSPECTION | {"duration_days": 1.0, "settle_time_days": 0.0})
    assert row["settled_min_range_m"] == row["min_range_m"]
    assert row["settled_max_range_m"] == row["max_range_m"]


def test_the_printed_errors_are_enough_for_a_filter():
    row = fly_cases(**INSPECTION | EXECUTION | FILTERED, chi1=np.full(100, 0.85))
    assert held(row).mean() >= 0.99
    assert row["min_range_m"].min() > 30.0
    assert row["settled_max_range_m"].max() < 45.0


def test_pairs_take_the_relative_ellipse_away_to_first_order():
    row = fly_one(**INSPECTION, inspection_law="pairs")
    assert row["relative_eccentricity"] < 1e-9
    assert row["settled_max_range_m"] - row["settled_min_range_m"] < 1.0
    assert row["settled_min_range_m"] == pytest.approx(39.5, abs=0.5)


def test_a_place_ahead_reached_from_behind_passes_close_to_the_target():
    row = fly_one(**INSPECTION | {"inspection_law": "pairs", "geometry": "ahead"})
    assert row["settled_min_range_m"] == pytest.approx(39.5, abs=0.5)
    assert row["min_range_m"] < 10.0


def test_a_fly_around_stays_between_its_ranges_and_goes_around():
    """The relative ellipse has the half axes R0 e outward and 2 R0 e ahead."""
    inputs = INSPECTION | {"inspection_law": "pairs", "geometry": "around"}
    row, seen = fly_one(**inputs), history(**inputs, rows=3001)
    assert 20.0 < row["settled_min_range_m"] < row["settled_max_range_m"] < 80.0
    assert row["settled_max_range_m"] == pytest.approx(2.0 * row["settled_min_range_m"], rel=0.02)
    assert row["settled_min_range_m"] == pytest.approx(R0 * row["relative_eccentricity"], rel=0.02)
    late = seen["t_s"] > 20.0 * DAY
    turns = np.unwrap(np.arctan2(seen["radial_m"][late], seen["along_track_m"][late]))
    assert abs(turns[-1] - turns[0]) / (2.0 * np.pi) == pytest.approx(10.0 * DAY / SIDEREAL_DAY, abs=0.2)
