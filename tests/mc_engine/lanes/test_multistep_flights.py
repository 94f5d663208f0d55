"""Flights by multistep methods: bytes at every width and among any other cases, histories, stops and events."""

import math
from dataclasses import replace

import numpy as np
import pytest
from flown_models import CORNERS, FOLDER, OSCILLATOR, RAIL, flown, inputs_of, same_bytes
from plain_steps import MIXED, by

from mc_engine.flight.flight import fly_history, fly_interpreted
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.model import load_model


@pytest.mark.parametrize(
    ("method", "widths"),
    [("abm11", (1, 16)), ("gj8", (1,)), pytest.param("gj8", (16,), marks=pytest.mark.slow)],
    ids=["abm11", "gj8", "gj8 wide"],
)
def test_a_case_keeps_its_bytes_at_every_width_in_any_order_among_any_cases(method, widths):
    model = by(OSCILLATOR, method)
    whole = flown(model, **MIXED)
    for width in widths:
        same_bytes(whole, flown(model, width=width, **MIXED))
    order = np.random.default_rng(1).permutation(21)
    shuffled = {name: value[order] if np.ndim(value) else value for name, value in MIXED.items()}
    back = np.argsort(order)
    same_bytes(whole, {name: row[back] for name, row in flown(model, case_ids=order, **shuffled).items()})
    few = {name: value[10:13] if np.ndim(value) else value for name, value in MIXED.items()}
    same_bytes({name: row[10:13] for name, row in whole.items()}, flown(model, case_ids=[10, 11, 12], **few))


@pytest.mark.parametrize("method", ["abm10", "gj7"])
def test_a_flight_by_python_and_a_history_give_the_bits_of_the_kernel(method):
    model = by(OSCILLATOR, method)
    inputs = inputs_of(OSCILLATOR, {name: value[4] if np.ndim(value) else value for name, value in MIXED.items()})
    columns, history = fly_history(model, inputs, 4, 1, folder=FOLDER, width=8)
    same_bytes(columns, {name: row[4:5] for name, row in flown(model, **MIXED).items()})
    assert history["t_s"][-1] == columns["end_time_s"][0]
    assert history["x_km"][-1] == columns["end_x_km"][0]
    time, _, states, _ = fly_interpreted(InterpretedFlight(model), inputs, 4, 1)
    assert (time[0], states[0, 0] / 1e3, states[1, 0]) == tuple(
        columns[name][0] for name in ("end_time_s", "end_x_km", "end_v_m_s")
    )


class Counted(InterpretedFlight):
    """A flight by Python that notes the times of its right-hand sides."""

    def call(self, name, function, arguments):
        if name == "rhs":
            self.times.append(float(arguments[0]))
        return super().call(name, function, arguments)


def test_a_discrete_state_with_what_is_not_a_number_yet_is_no_other_one():
    # the times of events that have not happened: each sample would seem a change, after which DOP853 begins anew
    rocket = load_model("phased_rocket.py", FOLDER)
    model = by(replace(rocket, clock=replace(rocket.clock, until=6.0)), "abm10")
    flight = Counted(model)
    flight.times = []
    _, _, states, _ = fly_interpreted(flight, inputs_of(model, {}), 0, 1)
    coasting = [t for t in flight.times if 4.0 < t <= 6.0]
    assert len(coasting) <= 2 * 200 + 2
    columns = flown(model)
    assert [columns[f"end_{item.name}"][0] for item in model.states] == states[:, 0].tolist()


# 400 swings x = a cos(w t - phase) of ten seconds, whose first crest is anywhere, also in the first steps and the last
RANDOM = np.random.default_rng(5)
AMPLITUDE, PHASE, RATE = RANDOM.uniform(0.5, 2.0, 400), RANDOM.uniform(0.01, 6.2, 400), RANDOM.uniform(0.3, 1.0, 400)
SWINGS = {
    "rate_rad_s": RATE,
    "x0_km": AMPLITUDE * np.cos(PHASE),
    "v0_m_s": 1e3 * AMPLITUDE * RATE * np.sin(PHASE),
    "every": 1e6,
}


# errors of a height [km], of its time [s], of a last time [s]; with three looks, steps of 0.1 s: 3e-4, 0.05, 0.003
@pytest.mark.parametrize(("method", "step", "errors"), [
    ("abm8", 0.1, (4e-9, 1e-8, 1e-8)), ("abm11", 0.2, (3e-7, 2e-7, 2e-7)), ("gj8", 0.1, (1e-11, 2e-10, 2e-10)),
])  # fmt: skip
def test_extremes_and_last_times_between_grid_points_are_as_exact_as_the_states(method, step, errors):
    columns = flown(by(OSCILLATOR, method), **SWINGS, step_s=step)
    end, crest = columns["end_time_s"], PHASE / RATE
    seen = crest < end
    first = seen & (crest + 2.0 * np.pi / RATE > end)
    assert (crest < 8.0 * step).sum() > 30
    assert (seen & (crest > end - step)).sum() >= (step > 0.1)
    np.testing.assert_allclose(columns["top_km"][seen], AMPLITUDE[seen], rtol=0.0, atol=errors[0])
    np.testing.assert_allclose(columns["top_time_s"][first], crest[first], rtol=0.0, atol=errors[1])
    half = np.arccos(np.minimum(0.5 / AMPLITUDE, 1.0))
    fall = (PHASE + half + 2.0 * np.pi * np.floor((RATE * end - PHASE - half) / (2.0 * np.pi))) / RATE
    falls = (AMPLITUDE > 0.52) & (fall > 0.0) & (AMPLITUDE * np.cos(RATE * end - PHASE) < 0.5)
    assert falls.sum() > 200
    np.testing.assert_allclose(columns["late_time_s"][falls], fall[falls], rtol=0.0, atol=errors[2])


def test_extremes_beside_samples_of_the_control_are_searched_on_the_motion_before_and_behind():
    columns = flown(by(OSCILLATOR, "abm11"), **{**SWINGS, "every": 5.0}, step_s=0.1)
    seen = PHASE / RATE < 9.9
    error = np.abs(columns["top_km"] - AMPLITUDE)[seen]
    assert np.median(error) < 1e-8  # by the parabola 1e-7 with steps of 0.1 s
    assert error.max() < 4e-6
    for width in (1, 16):
        same_bytes(columns, flown(by(OSCILLATOR, "abm11"), width=width, **{**SWINGS, "every": 5.0}, step_s=0.1))


def test_a_corner_or_a_jump_among_the_looks_makes_no_extreme_of_the_polynomial():
    columns = flown(by(CORNERS, "abm8"), phase_rad=np.linspace(0.0, 6.28, 200))
    for name in ("lit", "relay"):  # by the polynomial up to 2.3, by a parabola that ends at the jump 1.25
        np.testing.assert_array_equal(columns[f"{name}_top"], 1.0)
        np.testing.assert_array_equal(columns[f"{name}_bottom"], 0.0 if name == "lit" else -1.0)
    step = 0.05  # in which the wave rises by 0.09; three motions, each with a limit in its midst
    finer = replace(CORNERS, clock=replace(CORNERS.clock, step=step, until=9.0))
    finer = flown(by(finer, "abm8"), phase_rad=np.linspace(0.0, 0.4, 400))
    assert (finer["limited_top"] - 1.0).max() < 0.005 * step  # by the polynomial up to 0.2 of the rise
    np.testing.assert_allclose(columns["wave_top"], 2.0, rtol=1e-6)


@pytest.mark.parametrize("until", [9.1, 9.5])
def test_a_corner_among_the_looks_leaves_a_last_time_to_the_chord(until):
    step, phases = 0.05, np.linspace(0.0, 0.4, 400)  # the wave leaves its limit two steps before it falls below 0.8
    finer = replace(CORNERS, clock=replace(CORNERS.clock, step=step, until=until))
    columns = flown(by(finer, "abm8"), phase_rad=phases)
    error = columns["limited_last_s"] - (3.0 * np.pi - np.arcsin(0.4) - phases)
    assert np.abs(error).max() < 0.01 * step  # by the polynomial up to 0.7


@pytest.mark.parametrize(("every", "steps"), [(2.0, 60), (3.0, 60), (1e6, 1), (1e6, 2)])
def test_a_last_time_in_an_arc_of_few_steps_is_that_of_the_chord(every, steps):
    # each sample changes the discrete state a little; x falls through 500 m once, in any step
    fall = np.linspace(0.05, steps - 0.05, 150) * 0.1
    phase = fall - np.pi / 3.0
    swings = {"x0_km": np.cos(phase), "v0_m_s": 1e3 * np.sin(phase), "gain_1_s": 1e-9, "every": every}
    columns = flown(by(OSCILLATOR, "abm8"), **swings, until_s=0.1 * steps, step_s=0.1)
    once = np.cos(columns["end_time_s"] - phase) < 0.5
    assert once.sum() > 100
    np.testing.assert_allclose(columns["late_time_s"][once], fall[once], rtol=0.0, atol=0.001)
    same_bytes(columns, flown(by(OSCILLATOR, "abm8"), width=1, **swings, until_s=0.1 * steps, step_s=0.1))


def test_a_crest_before_a_sample_is_the_same_beside_a_case_that_ends_in_that_step():
    # crests before the look at 3.1 s, the last before a sample; two cases break, one of them in the step after
    crests = np.append(np.linspace(3.04, 3.09, 6), [3.1, 3.1])
    swings = {"x0_km": np.cos(crests), "v0_m_s": 1e3 * np.sin(crests), "every": 32.0, "until_s": 6.0, "step_s": 0.1}
    breaks = np.append(np.full(6, 1e9), [3.05, 3.15])
    columns = flown(by(OSCILLATOR, "gj8"), **swings, breaks_at_s=breaks)
    assert columns["status"].tolist() == ["ok"] * 6 + ["not-finite"] * 2
    same_bytes(columns, flown(by(OSCILLATOR, "gj8"), width=1, **swings, breaks_at_s=breaks))
    np.testing.assert_allclose(columns["top_km"][:6], 1.0, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("method", ["abm11", "gj8"])
def test_a_stop_is_found_to_the_last_digits(method):
    columns = flown(by(RAIL, method), rate_rad_s=1.0, x0_m=1.0, end_m=-0.3, step_s=0.05)
    assert columns["end_time_s"][0] == pytest.approx(math.acos(-0.3), abs=1e-13)
    assert columns["end_x_m"][0] == pytest.approx(-0.3, abs=1e-13)


@pytest.mark.parametrize("method", ["abm11", "gj8"])
def test_each_bounce_of_a_bead_comes_at_its_time_and_with_its_height(method):
    # half periods of a spring between bounces at the middle, each with 0.8 of the speed; a gate between changes nothing
    bead = {"rate_rad_s": 1.0, "x0_m": 1.0, "wall_m": 0.0, "restitution": 0.8, "last_s": 9.0}
    columns = flown(by(RAIL, method), **bead, gate_s=[2.0, 1e9], step_s=0.05)
    assert columns["bounces"].tolist() == [3.0, 3.0]
    assert columns["bounced_at_s"] == pytest.approx(2.5 * math.pi, abs=1e-12)
    assert columns["end_x_m"] == pytest.approx(0.8**3 * math.sin(9.0 - 2.5 * math.pi), abs=1e-12)
    assert columns["gates"].tolist() == [1.0, 0.0]


@pytest.mark.parametrize("method", [pytest.param("abm11", marks=pytest.mark.slow), "gj8"])
def test_cases_with_events_keep_their_bytes_at_every_width(method):
    n = 30
    random = np.random.default_rng(11)
    mixed = {
        "rate_rad_s": random.uniform(0.0, 1.0, n),
        "gravity_m_s2": random.uniform(0.0, 3.0, n),
        "x0_m": random.uniform(0.0, 5.0, n),
        "wall_m": np.where(np.arange(n) % 3 == 0, -1e9, -1.0),
        "restitution": random.uniform(0.2, 1.0, n),
        "gate_s": random.uniform(0.0, 12.0, n),
        "end_m": np.where(np.arange(n) % 3 == 0, -0.5, -1e9),
        "last_s": np.where(np.arange(n) % 7 == 0, 1e9, random.uniform(0.5, 9.5, n)),
    }
    eight = flown(by(RAIL, method), **mixed)
    assert {"ok", "no-stop"} <= set(eight["status"])
    same_bytes(eight, flown(by(RAIL, method), width=1, **mixed))
    alone = flown(by(RAIL, method), case_ids=[7], **{name: value[7] for name, value in mixed.items()})
    same_bytes(alone, {name: row[7:8] for name, row in eight.items()})
