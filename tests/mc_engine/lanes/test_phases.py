"""Phases, delayed events and values at events: against scipy phase by phase, closed forms, and in every byte."""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from flown_models import FOLDER, flown, same_bytes
from scipy.integrate import solve_ivp

from mc_engine.flight.flight import bound_flight, fly_history, fly_interpreted
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.model import FixedStep, load_model

ROCKETS = {name: load_model(f"{name}.py", FOLDER) for name in ("phased_rocket", "phased_rocket_adaptive")}
N_CASES = 37  # no whole number of vectors
GRAVITY, SLOPE, DRAG, CHUTE, SCALE_HEIGHT, KICK = 9.80665, 0.1, 1e-3, 0.05, 8000.0, 4.0


@pytest.fixture(scope="module", params=ROCKETS)
def model(request):
    return ROCKETS[request.param]


@pytest.fixture(scope="module")
def inputs():
    random = np.random.default_rng(5)
    return {
        "rail_m": random.uniform(2.0, 12.0, N_CASES),
        "burn_s": random.uniform(1.5, 4.0, N_CASES),
        "thrust_m_s2": random.uniform(30.0, 70.0, N_CASES),
        "lag_s": random.uniform(0.0, 2.0, N_CASES),
    }


@pytest.fixture(scope="module")
def whole(model, inputs):
    columns = flown(model, **inputs)
    assert set(columns["status"]) == {"ok"}
    assert set(columns["end_phase"]) == {"descent"}
    return columns


def air(_, y, factor, thrust=0.0):
    speed = np.hypot(y[2], y[3])
    drag = factor * speed * np.exp(-y[1] / SCALE_HEIGHT) - (thrust / speed if thrust else 0.0)
    return [y[2], y[3], -drag * y[2], -drag * y[3] - GRAVITY]


def leg(rhs, t, y, event=None, length=300.0):
    """(time, state) at the event, or after the length."""
    if event is not None:
        event.terminal = True
    done = solve_ivp(rhs, (t, t + length), y, "DOP853", events=event, rtol=1e-13, atol=1e-13)
    return (done.t_events[0][0], done.y_events[0][0]) if event is not None else (done.t[-1], done.y[:, -1])


def reference(rail, burn, thrust, lag):
    """The columns of one case, by scipy, one phase after another."""
    t, y = leg(lambda t, y: [SLOPE * y[3], y[3], SLOPE * (thrust - GRAVITY), thrust - GRAVITY], 0.0, np.zeros(4),
               lambda t, y: y[1] - rail)  # fmt: skip
    found = {"exit_m_s": np.hypot(*y[2:])}
    t, y = leg(lambda t, y: air(t, y, DRAG, thrust), t, y, length=burn - t)
    found["burnout_m_s"] = np.hypot(*y[2:])
    y[2:] *= 1.0 + KICK / np.hypot(*y[2:])
    found["top_m_s"] = np.hypot(*y[2:])
    t, y = leg(lambda t, y: air(t, y, DRAG), t, y, lambda t, y: y[3])
    found |= {"apogee_m": y[1], "apogee_s": t}
    opened, y = leg(lambda t, y: air(t, y, DRAG), t, y, length=lag)
    t, y = leg(lambda t, y: air(t, y, CHUTE), opened, y, lambda t, y: y[1])
    return found | {"ground_m_s": np.hypot(*y[2:]), "landing_s": t, "under_parachute_s": t - opened, "end_x_m": y[0]}


def test_a_rocket_in_four_phases_flies_as_scipy_does_phase_by_phase(model, inputs, whole):
    for case in range(12):
        expected = reference(*(column[case] for column in inputs.values()))
        assert {name: whole[name][case] for name in expected} == pytest.approx(expected, rel=1e-8)


def test_control_is_sampled_in_its_own_phase_alone(inputs, whole):
    exit_speed = whole["exit_m_s"] / np.hypot(1.0, SLOPE)
    exits = exit_speed / (inputs["thrust_m_s2"] - GRAVITY)  # v = a t on the rail
    samples = np.floor(inputs["burn_s"] / 0.5) - np.floor(exits / 0.5)
    np.testing.assert_array_equal(whole["samples"], samples)


def test_a_phase_without_control_is_flown_in_long_steps_between_the_same_samples():
    """Adaptive steps, 200 attempts at most, beside those of the grid of the samples: an hour's coast has 36,000."""
    coasting = load_model("long_coast.py", FOLDER)
    gridded = replace(coasting, clock=FixedStep(step=0.1, until=10_000.0))
    wakes = np.random.default_rng(3).uniform(3000.0, 4000.0, N_CASES)
    ours, theirs = (flown(model, wake_s=wakes) for model in (coasting, gridded))
    assert set(ours["status"]) == {"ok"}
    np.testing.assert_array_equal(ours["samples"], 51 + np.floor((wakes + 5.03) / 0.1) - np.floor(wakes / 0.1))
    np.testing.assert_allclose(ours["first_s"], 0.1 * np.ceil(wakes / 0.1), rtol=1e-14)
    for name in ("samples", "noise"):
        np.testing.assert_array_equal(ours[name], theirs[name])
    same_bytes(ours, flown(coasting, width=1, wake_s=wakes))


def test_a_phase_with_control_that_begins_at_a_sample_has_that_sample():
    coasting = load_model("long_coast.py", FOLDER)
    gridded = replace(coasting, clock=FixedStep(step=0.1, until=10_000.0))
    wakes = np.array([5.2, 12.3, 60.0, 1000.3, 2000.0, 3599.9, 3600.0, 7200.0])
    ours, theirs = (flown(model, wake_s=wakes) for model in (coasting, gridded))
    np.testing.assert_array_equal(ours["samples"], 102.0)
    np.testing.assert_array_equal(ours["noise"], theirs["noise"])


@pytest.mark.parametrize(
    ("model", "width", "chunk", "threads"),
    [
        ("phased_rocket", 8, 1, 2),
        ("phased_rocket", 16, 7, 2),
        pytest.param("phased_rocket", 1, 5, 1, marks=pytest.mark.slow),
        ("phased_rocket_adaptive", 8, 1, 2),
        pytest.param("phased_rocket_adaptive", 16, 7, 2, marks=pytest.mark.slow),
        pytest.param("phased_rocket_adaptive", 1, 5, 1, marks=pytest.mark.slow),
    ],
    indirect=["model"],
    scope="module",
)
def test_bytes_depend_on_no_width_chunk_thread_or_order(model, inputs, whole, width, chunk, threads):
    cases = np.random.default_rng(width).permutation(N_CASES)
    parts = [cases[first : first + chunk] for first in range(0, N_CASES, chunk)]

    def part(ids):
        return flown(model, width, ids, **{name: column[ids] for name, column in inputs.items()})

    with ThreadPoolExecutor(threads) as pool:
        done = list(pool.map(part, parts))
    ours = {name: np.concatenate([columns[name] for columns in done]) for name in whole}
    same_bytes(ours, {name: column[cases] for name, column in whole.items()})


def test_a_replay_has_the_bytes_of_the_batch_and_names_the_phases(model, inputs, whole):
    one = {name: column[3] for name, column in inputs.items()}
    columns, history = fly_history(model, one, 3, 1, folder=FOLDER, rows=500, width=8)
    same_bytes(columns, {name: column[3:4] for name, column in whole.items()})
    assert list(dict.fromkeys(history["phase"])) == ["rail", "powered", "coast", "descent"]
    np.testing.assert_array_equal(history["on_rail"] == 1.0, history["phase"] == "rail")
    begun = whole["apogee_s"][3] + one["lag_s"]
    late = history["t_s"][history["phase"] == "descent"]
    np.testing.assert_allclose(history["since_s"][history["phase"] == "descent"], late - begun, atol=1e-12)


def test_the_interpreted_flight_of_a_case_has_the_bits_of_the_kernel(model, inputs, whole):
    one = {name: column[3] for name, column in inputs.items()} | {"burn_s": inputs["burn_s"][3]}
    time, status, states, results = fly_interpreted(InterpretedFlight(model), one, 3, 1)
    assert status[0] == 0.0
    assert time[0] == whole["end_time_s"][3]
    assert states[0, 0] == whole["end_x_m"][3]
    assert results[2, 0] == whole["apogee_m"][3]
    assert results[-1, 0] == 3.0  # the phase


def test_a_case_that_reaches_the_time_limit_says_in_which_phase(model):
    columns = flown(model, burn_s=[3.0, 500.0], thrust_m_s2=[60.0, 20.0])
    assert list(columns["status"]) == ["ok", "no-stop"]
    assert list(columns["reason"]) == ["", 'in the phase "powered"']
    assert list(columns["end_phase"]) == ["descent", "powered"]


def test_a_model_without_phases_has_no_column_for_them():
    columns = flown(load_model("rail.py", FOLDER))
    assert "end_phase" not in columns


BALL = load_model("late_ball.py", FOLDER)


def test_a_delay_is_kept_to_the_last_digits():
    # dropped from 100 m with g = 10: the mark at 55 m is passed at 3 s, and the brake holds the speed from its time on
    columns = flown(BALL, height_m=100.0, mark_m=55.0, lag_s=[0.25, 0.5, 1.0], floor_m=0.0)
    passed, braked = 3.0, 3.0 + np.array([0.25, 0.5, 1.0])
    np.testing.assert_allclose(columns["passed_s"], passed, rtol=5e-14)
    np.testing.assert_allclose(columns["braked_s"], braked, rtol=5e-14)
    np.testing.assert_allclose(columns["speed_m_s"], 10.0 * braked, rtol=1e-13)
    falling = 100.0 - 5.0 * braked**2
    np.testing.assert_allclose(columns["end_time_s"], braked + falling / (10.0 * braked) + 0.125, rtol=1e-13)
    np.testing.assert_allclose(columns["ground_s"], columns["end_time_s"] - 0.125, rtol=1e-13)


def test_a_delay_of_nothing_or_less_acts_at_the_crossing():
    columns = flown(BALL, height_m=100.0, mark_m=55.0, lag_s=[0.0, -1.0], floor_m=0.0)
    np.testing.assert_allclose(columns["braked_s"], 3.0, rtol=5e-14)


def test_an_action_that_is_due_happens_in_whatever_phase_the_case_is_by_then():
    # past the second mark at 2 s the ball is in another phase, when the action of the first comes at 3.25 s
    columns = flown(BALL, height_m=100.0, mark_m=95.0, lag_s=2.25, second_m=80.0, floor_m=0.0)
    np.testing.assert_allclose(columns["passed_s"], 1.0, rtol=5e-14)
    np.testing.assert_allclose(columns["second_s"], 2.0, rtol=5e-14)
    np.testing.assert_allclose(columns["braked_s"], 3.25, rtol=1e-13)
    assert columns["braked_from"][0] == 1.0


def test_an_event_that_never_comes_has_neither_time_nor_value():
    columns = flown(BALL, height_m=100.0, mark_m=-50.0, lag_s=1.0, floor_m=0.0)
    assert columns["status"][0] == "ok"
    assert np.isnan(columns["passed_s"][0])
    assert np.isnan(columns["height_there_m"][0])


def seconds(model):
    """Processor time of a kernel alone: 64 cases, of which two seconds of forty are dear."""
    columns = {"change_s": np.random.default_rng(0).uniform(1.5, 2.5, 64), "first_x_m": 1.0}
    flight, _, _ = bound_flight(model, columns, np.arange(64), 1, folder=FOLDER, width=8)
    times = []
    for _ in range(7):
        begin = time.process_time()
        flight()
        times.append(time.process_time() - begin)
    return min(times)


def test_what_the_phase_of_no_case_needs_is_not_computed():
    by_phases, by_where = (load_model(f"{name}.py", FOLDER) for name in ("two_motions", "two_motions_by_where"))
    assert seconds(by_phases) < 0.7 * seconds(by_where)  # 0.16 was measured
