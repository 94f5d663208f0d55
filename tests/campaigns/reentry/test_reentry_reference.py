"""Design of the reference: the path, its linear system, the gains, and the tables that the flights read."""

import numpy as np
import pytest
from reentry_flights import PLANAR, fly_one, history, plan_of
from scipy.integrate import solve_ivp

from campaigns.reentry.guidance import reference
from campaigns.reentry.guidance.apollo_final_phase import FLOWN
from campaigns.reentry.guidance.reference import (
    PROFILE_SET,
    RANGE_SET,
    Planner,
    Weights,
    fly_reference,
    linear_system,
    reference_table_of,
    riccati_gains,
    steered_part,
)
from campaigns.reentry.guidance.reference_table import (
    LENGTH,
    RANGE,
    BySpeed,
    Influence,
    by_loss,
    by_speed,
    clocked_range,
)
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
    return fly_reference(Planner(plan))


def part_of(path):
    part = steered_part(path)
    return type(path)(*(column[part] for column in path))


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
    path = fly_reference(Planner(plan_of(**inputs)))
    row, seen = fly_one(**inputs, tolerance=1e-10), history(rows=801, **inputs, tolerance=1e-10)
    # Coriolis force takes the flight off the great circle along which its downrange counts
    a_kilometre, ten_metres = 1.0, 0.01
    error = a_kilometre if name == "turning" else ten_metres
    assert path.along[-1] / 1e3 == pytest.approx(row["downrange_km"], abs=error)
    assert path.t[-1] == pytest.approx(row["flight_time_s"], abs=0.05)
    for quantity, ours, error in (
        ("altitude_km", path.altitude / 1e3, 0.01), ("speed_m_s", path.speed, 1.0),
        ("flight_path_angle_deg", np.degrees(path.path), 0.02), ("axial_load_g", path.axial / 9.80665, 0.01),
    ):  # fmt: skip
        assert np.abs(np.interp(seen["t_s"], path.t, ours) - seen[quantity]).max() < error, quantity


def test_the_linear_system_carries_small_differences_along(plan, path):
    """A neighbouring flight, differences taken at equal speed."""
    planner, part = Planner(plan), part_of(path)
    a, b = linear_system(planner, part)
    lost = part.speed[0] - part.speed
    first, change = np.array([0.05, 0.005, 0.1]), 0.002  # km, deg, km; of the share of the lift

    def linear(x, y):
        m = np.array([np.interp(x, lost, column) for column in a.reshape(-1, 9).T]).reshape(3, 3)
        return m @ y + change * np.array([np.interp(x, lost, column) for column in b.T])

    end = lost[-1] * 0.9
    expected = solve_ivp(linear, (0.0, end), first, rtol=1e-9, atol=1e-9, max_step=20.0).y[:, -1]

    def flown(start, share):
        def rates(x, y):
            r, _, angle = y
            v = part.speed[0] - x
            latitude, heading = 0.0, 0.5 * np.pi
            six, along, _ = planner.motion(r, latitude, v, angle, heading, share)
            return np.array([six[0], along, six[4]]) / -six[3]

        return solve_ivp(rates, (0.0, end), start, "DOP853", rtol=1e-11, atol=1e-9).y[:, -1]

    start = np.array([part.r[0], part.along[0], part.path[0]])
    moved = start + np.array([1e3 * first[0], 1e3 * first[2], np.radians(first[1])])
    result = flown(moved, planner.plan.share + change) - flown(start, planner.plan.share)
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


def cost(plan, path, gains, weights, first):
    """Final and running cost of the linear system under gains, from first differences in km, deg, km."""
    part = part_of(path)
    a, b = linear_system(Planner(plan), part)
    lost = part.speed[0] - part.speed
    k = gains * np.array([1e3, np.pi / 180.0, 1e3])

    def rates(x, y):
        m = np.array([np.interp(x, lost, column) for column in a.reshape(-1, 9).T]).reshape(3, 3)
        v, g = (np.array([np.interp(x, lost, column) for column in each.T]) for each in (b, k))
        u = -g @ y[:3]
        return [*(m @ y[:3] + v * u), weights.control * u * u + weights.altitude * y[0] ** 2]

    end = solve_ivp(rates, (0.0, lost[-1]), [*first, 0.0], "LSODA", rtol=1e-7, atol=1e-9).y[:, -1]
    return end[3] + (np.array(weights.final) * end[:3] ** 2).sum()


@pytest.mark.parametrize("weights", [RANGE_SET, PROFILE_SET], ids=["range set", "profile set"])
def test_the_stored_gains_are_a_minimum_of_their_cost(plan, path, weights):
    part = part_of(path)
    best = riccati_gains(part.speed[0] - part.speed, *linear_system(Planner(plan), part), weights)
    first = (0.5, 0.05, 5.0)
    least = cost(plan, path, best, weights, first)
    for factor in (0.9, 1.1):
        assert cost(plan, path, factor * best, weights, first) > least
        for column in (0, 1) if weights is PROFILE_SET else (0, 1, 2):
            other = best.copy()
            other[:, column] *= factor
            assert cost(plan, path, other, weights, first) > least


def test_the_tables_hold_the_path_over_the_speed_and_over_the_speed_lost(table, path):
    part = part_of(path)
    assert len(table) == LENGTH
    at = slice(None, None, 37)
    row = BySpeed(*by_speed(table, 0.0, part.speed[at]))
    assert np.abs(row.altitude - part.altitude[at]).max() < 40.0
    assert np.abs(row.range - part.along[at]).max() < 60.0
    assert np.abs(row.path - part.path[at]).max() < 5e-3
    assert row.drag == pytest.approx(part.drag[at], rel=5e-3)
    lost = by_loss(table, 0.0, part.lost[at])
    assert np.abs(lost.speed - part.speed[at]).max() < 1.0
    assert lost.axial == pytest.approx(part.axial[at], rel=5e-3)
    assert np.exp(lost.log_axial) == pytest.approx(part.axial[at], rel=5e-3)
    assert np.abs(lost.range - part.along[at]).max() < 60.0
    assert table[RANGE] == path.along[-1]


def test_the_clock_tells_the_range_until_the_air_is_felt(table, path):
    early = path.lost == 0.0
    assert np.abs(clocked_range(table, 0.0, path.t[early]) - path.along[early]).max() < 500.0
    after = path.t[early][-1] + 10.0
    assert clocked_range(table, 0.0, after) - clocked_range(table, 0.0, after - 10.0) == pytest.approx(
        77_200.0, rel=0.01
    )


def test_a_plan_that_does_not_come_down_is_said_so():
    high = plan_of(**PLANNED, guidance="law1", plan_speed_m_s=11_500.0, plan_flight_path_angle_deg=-4.0)
    assert "does not come down" in reference_table_of(high)
    with pytest.raises(ModelError, match="no law could steer"):
        steered_part(fly_reference(Planner(plan_of(**PLANNED, guidance="law1", plan_stop_altitude_km=100.0))))


def test_a_plan_that_cannot_be_flown_is_said_so_at_once(monkeypatch):
    inside = plan_of(**PLANNED | {"plan_radius_km": 649.0}, guidance="law1")
    assert "lies below plan_stop_altitude_km" in reference_table_of(inside)
    monkeypatch.setattr(reference, "MOST_EVALUATIONS", 100)
    with pytest.raises(ModelError, match="cannot be integrated"):
        fly_reference(Planner(plan_of(**PLANNED, guidance="law1")))


@pytest.mark.parametrize("row", FLOWN, ids=lambda row: f"{row[0]:g} m/s")
def test_the_apollo_table_is_the_flown_one_at_its_own_speeds(row):
    result = Influence(*by_speed(reference_table_of(plan_of(**PLANNED, guidance="apollo")), 0.0, row[0]))
    scaled = (
        result.climb,
        result.drag,
        result.range / 1e3,
        result.by_drag / 1e3,
        result.by_climb / 1e3,
        result.by_lift / 1e3,
    )
    # linear between rows 70 m/s apart, which need not hit a corner of the printed ones
    assert scaled == pytest.approx(row[1:], rel=0.12)
