"""Events: found to full order inside a step, switched and stopped at, each crossing met once."""

import math

import numpy as np
import pytest
from flown_models import FOLDER, RAIL, flown, inputs_of, same_bytes

from mc_engine.flight.flight import fly_interpreted
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.model import load_model


def swing_down(step):
    """Time at which cos(t) falls through 0.3, flown with this step."""
    return flown(RAIL, rate_rad_s=1.0, x0_m=1.0, end_m=0.3, step_s=step)["end_time_s"][0]


def test_a_stop_is_found_with_the_order_of_the_integrator():
    # the grids of both steps leave the event at the same share of a step
    exact = math.acos(0.3)
    coarse, fine = (abs(swing_down(exact / (n + 0.5)) - exact) for n in (8, 16.5))
    assert coarse < 1e-5
    assert coarse / fine == pytest.approx((17.0 / 8.5) ** 4, rel=0.1)


def test_an_event_function_that_is_rounded_is_looked_at_a_few_times():
    # floats of this place lie 1e-9 m apart, which the fall takes a thousand times as long as times are exact to
    class Counted(InterpretedFlight):
        looks = 0

        def call(self, name, function, arguments):
            self.looks += name == "events" and arguments[0] % 4.0 > 0.0
            return super().call(name, function, arguments)

    for end in np.linspace(6_388_000.0, 6_388_500.0, 20):
        fall = {"gravity_m_s2": 9.5, "v0_m_s": -130.0, "x0_m": 6_389_000.0, "end_m": float(end), "step_s": 4.0}
        flight = Counted(RAIL)
        assert fly_interpreted(flight, inputs_of(RAIL, fall), 0, 1)[2][0] == pytest.approx(end, abs=2e-9)
        assert 3 <= flight.looks <= 30  # 60 to 90 where each went no further than the tolerance


def test_a_time_limit_before_the_stop_is_no_stop_and_keeps_the_last_state():
    columns = flown(RAIL, gravity_m_s2=2.0, x0_m=[1.0, 1e6, 4.0], end_m=0.0)
    assert list(columns["status"]) == ["ok", "no-stop", "ok"]
    assert columns["end_time_s"] == pytest.approx([1.0, 10.0, 2.0], abs=1e-12)
    assert columns["end_x_m"][1] == pytest.approx(1e6 - 100.0)
    assert np.isnan(columns["bounces"]).tolist() == [False, True, False]


def test_an_event_exactly_at_the_end_of_a_step_is_met_there():
    # x = 9 - t**2 is zero at t = 3 to the last bit, four steps of three quarters
    columns = flown(RAIL, gravity_m_s2=2.0, x0_m=9.0, end_m=0.0, step_s=0.75)
    assert (columns["end_time_s"][0], columns["end_x_m"][0], columns["end_v_m_s"][0]) == (3.0, 0.0, -6.0)


def test_a_bounce_exactly_at_the_end_of_a_step_happens_once():
    # up and down again in 2 s: hits at t = 1, 3, 5, 7, 9, all on the grid
    columns = flown(RAIL, gravity_m_s2=2.0, x0_m=1.0, wall_m=0.0, step_s=0.25, last_s=9.5)
    assert columns["bounces"][0] == 5.0
    assert columns["bounced_at_s"][0] == pytest.approx(9.0, abs=1e-9)
    assert columns["end_x_m"][0] == pytest.approx(1.0 - 0.5**2, abs=1e-8)


@pytest.mark.parametrize("step", [0.1, 0.3, 0.7, 0.01])
def test_an_event_of_the_clock_on_any_place_of_the_grid_is_met_once(step):
    # the times as a person writes them, so by a rounding beside k * step and beside (k - 1) * step + step
    gates = np.round(step * np.arange(1, 141), 6)
    columns = flown(RAIL, gate_s=gates, last_s=141 * step, step_s=step, until_s=142 * step)
    assert set(columns["status"]) == {"ok"}
    assert set(columns["gates"]) == {1.0}
    np.testing.assert_allclose(columns["gated_at_s"], gates, rtol=1e-14)


def test_a_function_that_starts_at_zero_and_leaves_has_not_crossed():
    # thrown up from the wall, and from the end: back after 2 s, and only then an event
    thrown = {"gravity_m_s2": 1.0, "v0_m_s": 1.0}
    bounced = flown(RAIL, **thrown, wall_m=0.0, last_s=2.5)
    assert (bounced["bounces"][0], bounced["bounced_at_s"][0]) == (1.0, pytest.approx(2.0, abs=1e-14))
    ended = flown(RAIL, **thrown, end_m=0.0)
    assert ended["end_time_s"][0] == pytest.approx(2.0, abs=1e-14)


def test_several_events_in_one_step_happen_in_their_order():
    # one step of 2 s: dropped from 1 m with g = 2, a hit at 1 s, gates at 0.5, 0.9, 1.3 and 1.7 s, the end at 1.8 s
    fall = {"gravity_m_s2": 2.0, "x0_m": 1.0, "wall_m": 0.0}
    columns = flown(RAIL, **fall, gate_s=0.5, gate_every_s=0.4, last_s=1.8, step_s=2.0)
    assert columns["status"][0] == "ok"
    assert (columns["bounces"][0], columns["gates"][0]) == (1.0, 4.0)
    assert columns["bounced_at_s"][0] == pytest.approx(1.0, abs=1e-15)
    assert columns["gated_at_s"][0] == pytest.approx(1.7, abs=1e-15)
    assert columns["end_time_s"][0] == pytest.approx(1.8, abs=1e-15)
    assert columns["end_x_m"][0] == pytest.approx(2.0 * 0.8 - 0.8**2, abs=1e-14)


def test_each_bounce_of_a_ball_comes_at_its_time_and_with_its_height():
    # hits at t1 (1 + 2 e (1 - e**n) / (1 - e)), n = 0, 1, ...
    e, first = 0.8, math.sqrt(2.0 * 3.0 / 9.81)
    hits = first * (1.0 + 2.0 * e * (1.0 - e ** np.arange(8)) / (1.0 - e))
    between = 0.5 * (hits[1:] + hits[:-1])
    ball = {"gravity_m_s2": 9.81, "x0_m": 3.0, "wall_m": 0.0, "restitution": e}
    columns = flown(RAIL, **ball, last_s=between)
    assert columns["bounces"].tolist() == [1, 2, 3, 4, 5, 6, 7]
    np.testing.assert_allclose(columns["bounced_at_s"], hits[:-1], rtol=1e-13)
    np.testing.assert_allclose(columns["end_x_m"], 3.0 * e ** (2 * np.arange(1, 8)), rtol=1e-12)


def test_more_than_32_events_in_a_step_are_a_status_of_that_case_alone():
    # gates at 0.01, 0.04, ... 0.97 s are 33 in the first step of 1 s; from 0.05 s on they are 32
    clock = {"gate_every_s": 0.03, "last_s": 1.5, "step_s": 1.0}
    columns = flown(RAIL, **clock, gate_s=[0.05, 0.01, 0.5])
    assert list(columns["status"]) == ["ok", "event-limit", "ok"]
    assert columns["gates"][[0, 2]].tolist() == [49, 34]
    assert math.isnan(columns["gates"][1])
    assert np.isfinite([columns["end_time_s"], columns["end_x_m"]]).all()
    alone = flown(RAIL, **clock, gate_s=0.5, case_ids=[2])
    same_bytes(alone, {name: row[2:] for name, row in columns.items()})


RANDOM = np.random.default_rng(11)
MIXED = {
    "rate_rad_s": RANDOM.uniform(0.0, 2.0, 50),
    "gravity_m_s2": RANDOM.uniform(0.0, 10.0, 50),
    "x0_m": RANDOM.uniform(0.0, 5.0, 50),
    "v0_m_s": RANDOM.normal(size=50),
    "wall_m": np.where(np.arange(50) % 3 == 0, -1e9, -1.0),
    "restitution": RANDOM.uniform(0.2, 1.0, 50),
    "gate_s": RANDOM.uniform(0.0, 12.0, 50),
    "end_m": np.where(np.arange(50) % 3 == 0, -0.5, -1e9),
    "last_s": np.where(np.arange(50) % 7 == 0, 1e9, RANDOM.uniform(0.5, 9.5, 50)),
}


@pytest.mark.parametrize("width", [1, pytest.param(16, marks=pytest.mark.slow)])
def test_cases_with_events_keep_their_bytes_at_every_width(width):
    eight = flown(RAIL, **MIXED)
    assert {"ok", "no-stop"} <= set(eight["status"])
    same_bytes(eight, flown(RAIL, width=width, **MIXED))


def test_a_case_keeps_what_its_control_held_when_it_stopped_however_long_its_neighbours_fly():
    """From 5 n^2 m at 10 m/s^2 the ground comes after n s; samples are taken every 0.5 s, none at the stop itself."""
    seconds = np.array([1.1, 4.3, 2.2, 0.3, 3.4, 1.6, 0.8, 2.9])
    columns = flown(load_model("sampled_fall.py", FOLDER), height_m=5.0 * seconds**2, every=2.0)
    np.testing.assert_allclose(columns["end_time_s"], seconds, rtol=1e-12)
    np.testing.assert_array_equal(columns["samples"], np.ceil(seconds / 0.5))
    np.testing.assert_array_equal(columns["sampled_at_s"], 0.5 * np.floor(seconds / 0.5))


def test_switch_counts_for_the_cases_that_met_an_event_and_for_no_neighbour():
    columns = flown(RAIL, **MIXED)
    flew = columns["status"] == "ok"
    np.testing.assert_array_equal(columns["switches"][flew], (columns["bounces"] + columns["gates"])[flew])
    assert {0.0, 1.0, 2.0} <= set(columns["switches"][flew])
