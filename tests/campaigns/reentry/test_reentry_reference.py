"""Design of the reference: the path, its linear system, the gains, and the tables that the flights read."""

import numpy as np
import pytest
from reentry_flights import fly_one, history
from scipy.integrate import solve_ivp

from campaigns.reentry.guidance import reference
from campaigns.reentry.guidance.plan import plan_of
from campaigns.reentry.guidance.reference import (
    ALONG,
    LOST,
    PATH,
    PROFILE_SET,
    RANGE_SET,
    SPEED,
    R,
    Weights,
    fly_reference,
    linear_system,
    motion,
    reference_table_of,
    riccati_gains,
    steered_part,
)
from campaigns.reentry.guidance.reference_table import (
    COLUMNS,
    FLOWN,
    LOST_TABLE,
    ROWS,
    BySpeed,
    Header,
    Influence,
    by_loss,
    by_speed,
    clocked_range,
)
from campaigns.reentry.published.values import PLANAR
from mc_engine.errors import ModelError

PLANNED = PLANAR | {"plan": "given"}


@pytest.fixture(scope="module")
def plan():
    return plan_of(**PLANNED, guidance="law1")


@pytest.fixture(scope="module")
def table(plan):
    return reference_table_of(plan)


@pytest.fixture(scope="module")
def path(plan):
    return fly_reference(plan)


@pytest.fixture(scope="module")
def part(path):
    return steered_part(path)


def lost_of(part):
    """Speed lost [m/s] along the steered part."""
    return part.state[SPEED, 0] - part.state[SPEED]


SCENARIOS = {
    "planar": PLANNED,
    "turning": {
        "plan": "given", "planar": True, "plan_heading_deg": 53.9639, "plan_latitude_deg": 45.5379,
        "plan_radius_km": 6491.0, "entry_heading_deg": 53.9639, "entry_latitude_deg": 45.5379,
        "entry_radius_km": 6491.0,
    },
    "textbook air": PLANNED | {"atmosphere": "exponential"},
    "Apollo at Mars": PLANNED | {
        "planet": "mars", "atmosphere": "exponential", "vehicle": "apollo",
        "plan_speed_m_s": 5600.0, "entry_speed_m_s": 5600.0, "plan_flight_path_angle_deg": -14.0,
        "entry_flight_path_angle_deg": -14.0,
    },
}  # fmt: skip


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_reference_is_the_flight_of_the_planned_vehicle(name):
    inputs = SCENARIOS[name]
    path = fly_reference(plan_of(**inputs))
    row, seen = fly_one(**inputs, tolerance=1e-10), history(rows=801, **inputs, tolerance=1e-10)
    # Coriolis force takes the flight off the great circle along which its downrange counts
    a_kilometre, ten_metres = 1.0, 0.01
    error = a_kilometre if name == "turning" else ten_metres
    assert path.state[ALONG, -1] / 1e3 == pytest.approx(row["downrange_km"], abs=error)
    assert path.t[-1] == pytest.approx(row["flight_time_s"], abs=0.05)
    for quantity, ours, error in (
        ("altitude_km", path.altitude / 1e3, 0.01), ("speed_m_s", path.state[SPEED], 1.0),
        ("flight_path_angle_deg", np.degrees(path.state[PATH]), 0.02), ("axial_load_g", path.axial / 9.80665, 0.01),
    ):  # fmt: skip
        assert np.abs(np.interp(seen["t_s"], path.t, ours) - seen[quantity]).max() < error, quantity


def test_the_linear_system_carries_small_differences_along(plan, part):
    """A neighbouring flight, differences taken at equal speed."""
    (a, b), lost = linear_system(plan, part), lost_of(part)
    first, change = np.array([0.05, 0.005, 0.1]), 0.002  # km, deg, km; of the share of the lift

    def linear(x, y):
        m = np.array([np.interp(x, lost, column) for column in a.reshape(-1, 9).T]).reshape(3, 3)
        return m @ y + change * np.array([np.interp(x, lost, column) for column in b.T])

    end = lost[-1] * 0.9
    expected = solve_ivp(linear, (0.0, end), first, rtol=1e-9, atol=1e-9, max_step=20.0).y[:, -1]

    def flown(start, share):
        def rates(x, y):
            r, along, angle = y
            state = np.array([r, 0.0, 0.0, part.state[SPEED, 0] - x, angle, 0.5 * np.pi, along, x])
            seven = np.array(motion(plan, state, share)[0])
            return seven[[R, ALONG, PATH]] / -seven[SPEED]

        return solve_ivp(rates, (0.0, end), start, "DOP853", rtol=1e-11, atol=1e-9).y[:, -1]

    start = part.state[[R, ALONG, PATH], 0]
    moved = start + np.array([1e3 * first[0], 1e3 * first[2], np.radians(first[1])])
    result = flown(moved, plan.share + change) - flown(start, plan.share)
    assert np.array([result[0] / 1e3, np.degrees(result[2]), result[1] / 1e3]) == pytest.approx(
        expected, rel=0.03, abs=0.003
    )


def test_the_gain_on_an_integrator_is_its_closed_form():
    """x' = u, final weight S, control weight R: K = 1 / (R/S + what is left); units of km carried through."""
    lost = np.linspace(0.0, 50.0, 201)
    a, b = np.zeros((201, 3, 3)), np.zeros((201, 3))
    b[:, 2] = 1.0
    gains = riccati_gains(lost, a, b, Weights((0.0, 0.0, 0.25), 0.0, 2.0))
    assert gains[:, 2] == pytest.approx(1e-3 / (2.0 / 0.25 + 50.0 - lost), rel=1e-5)
    assert np.abs(gains[:, :2]).max() == 0.0


def cost(plan, part, gains, weights, first):
    """Final and running cost of the linear system under gains, from first differences in km, deg, km."""
    (a, b), lost = linear_system(plan, part), lost_of(part)
    k = gains * np.array([1e3, np.pi / 180.0, 1e3])

    def rates(x, y):
        m = np.array([np.interp(x, lost, column) for column in a.reshape(-1, 9).T]).reshape(3, 3)
        v, g = (np.array([np.interp(x, lost, column) for column in each.T]) for each in (b, k))
        u = -g @ y[:3]
        return [*(m @ y[:3] + v * u), weights.control * u * u + weights.altitude * y[0] ** 2]

    end = solve_ivp(rates, (0.0, lost[-1]), [*first, 0.0], "LSODA", rtol=1e-7, atol=1e-9).y[:, -1]
    return end[3] + (np.array(weights.final) * end[:3] ** 2).sum()


@pytest.mark.parametrize("weights", [RANGE_SET, PROFILE_SET], ids=["range set", "profile set"])
def test_the_stored_gains_are_a_minimum_of_their_cost(plan, part, weights):
    best = riccati_gains(lost_of(part), *linear_system(plan, part), weights)
    first = (0.5, 0.05, 5.0)
    least = cost(plan, part, best, weights, first)
    for factor in (0.9, 1.1):
        assert cost(plan, part, factor * best, weights, first) > least
        for column in (0, 1) if weights is PROFILE_SET else (0, 1, 2):
            other = best.copy()
            other[:, column] *= factor
            assert cost(plan, part, other, weights, first) > least


def test_the_tables_hold_the_path_over_the_speed_and_over_the_speed_lost(table, path, part):
    assert len(table) == LOST_TABLE + ROWS * COLUMNS
    assert Header(*table[:8]).range == path.state[ALONG, -1]
    at = slice(None, None, 37)
    _, _, _, speed, angle, _, along, by_accelerometer = part.state[:, at]
    row = BySpeed(*by_speed(table, 0.0, speed))
    assert np.abs(row.altitude - part.altitude[at]).max() < 40.0
    assert np.abs(row.range - along).max() < 60.0
    assert np.abs(row.path - angle).max() < 5e-3
    assert row.drag == pytest.approx(part.drag[at], rel=5e-3)
    lost = by_loss(table, 0.0, by_accelerometer)
    assert np.abs(lost.speed - speed).max() < 1.0
    assert lost.axial == pytest.approx(part.axial[at], rel=5e-3)
    assert np.exp(lost.log_axial) == pytest.approx(part.axial[at], rel=5e-3)
    assert np.abs(lost.range - along).max() < 60.0


def test_the_clock_tells_the_range_until_the_air_is_felt(table, path):
    early = path.state[LOST] == 0.0
    assert np.abs(clocked_range(table, 0.0, path.t[early]) - path.state[ALONG, early]).max() < 500.0
    after = path.t[early][-1] + 10.0
    assert clocked_range(table, 0.0, after) - clocked_range(table, 0.0, after - 10.0) == pytest.approx(
        77_200.0, rel=0.01
    )


def test_a_plan_that_does_not_come_down_is_said_so():
    high = plan_of(**PLANNED, guidance="law1", plan_speed_m_s=11_500.0, plan_flight_path_angle_deg=-4.0)
    assert "does not come down" in reference_table_of(high)
    with pytest.raises(ModelError, match="no law could steer"):
        steered_part(fly_reference(plan_of(**PLANNED, guidance="law1", plan_stop_altitude_km=100.0)))


def test_a_plan_that_cannot_be_flown_is_said_so_at_once(monkeypatch):
    inside = plan_of(**PLANNED | {"plan_radius_km": 649.0}, guidance="law1")
    assert "lies below plan_stop_altitude_km" in reference_table_of(inside)
    monkeypatch.setattr(reference, "MOST_EVALUATIONS", 100)
    with pytest.raises(ModelError, match="cannot be integrated"):
        fly_reference(plan_of(**PLANNED, guidance="law1"))


@pytest.mark.parametrize("row", FLOWN, ids=lambda row: f"{row[0]:g} m/s")
def test_the_apollo_table_is_the_flown_one_at_its_own_speeds(row):
    result = Influence(*by_speed(reference_table_of(plan_of(**PLANNED, guidance="apollo")), 0.0, row[0]))
    # linear between rows 70 m/s apart, which need not hit a corner of the printed ones
    assert np.array(result[:6]) / (1.0, 1.0, 1e3, 1e3, 1e3, 1e3) == pytest.approx(row[1:], rel=0.12)
