"""The pulse modulator: closed forms, the engine's flight of them, and the printed pulse widths."""

from pathlib import Path

import numpy as np
import pytest
from deorbit_flights import fly_one

from campaigns.deorbit.published import PULSED, pulses
from mc_engine.flight.flight import fly
from mc_engine.model import load_model
from mc_engine.physics.pulse_modulators import lag_rate
from tests.campaigns.pulse_trains import first_on_time, pause_time, pulse_time

FOLDER = Path(__file__).resolve().parent / "modulator"
# Command 20 N, gain 1, level 30 N, on at 10 N, off at 5 N, time constant 5 s.  From the lag's exponential:
# 5 ln 2, 5 ln(4/3), 5 ln(3/2).
FIRST_ON, PULSE, PAUSE = 3.4657, 1.4384, 2.0273
MILLISECOND = 1e-3


def test_the_closed_forms_give_the_times_of_the_textbook_case():
    assert first_on_time(20.0, 1.0, 5.0, 10.0) == pytest.approx(FIRST_ON, abs=MILLISECOND)
    assert pulse_time(20.0, 1.0, 5.0, 30.0, 10.0, 5.0) == pytest.approx(PULSE, abs=MILLISECOND)
    assert pause_time(20.0, 1.0, 5.0, 10.0, 5.0) == pytest.approx(PAUSE, abs=MILLISECOND)


def test_inside_the_dead_band_the_thruster_stays_off_and_above_its_level_it_stays_on():
    assert first_on_time(10.0, 1.0, 5.0, 10.0) == np.inf
    assert pause_time(10.0, 1.0, 5.0, 10.0, 5.0) == np.inf
    assert pulse_time(35.0, 1.0, 5.0, 30.0, 10.0, 5.0) == np.inf


def test_the_lag_settles_where_the_gains_balance():
    assert lag_rate(3.0 * 20.0 - 30.0, 20.0, 30.0, 3.0, 1.0, 57.62) == 0.0
    assert lag_rate(0.0, 20.0, 0.0, 3.0, 1.0, 5.0) == pytest.approx(12.0)


@pytest.fixture(scope="module")
def trains():
    """Columns of pulse trains under constant commands, the textbook's first; and their inputs."""
    model = load_model("constant_command.py", FOLDER)
    draw = np.random.default_rng(20160421)
    inputs = {item.name: np.full(24, item.default) for item in model.parameters}
    inputs["command_n"][1:] = draw.uniform(13.0, 28.0, 23)
    inputs["gain"][1:] = draw.uniform(1.0, 1.5, 23)
    inputs["modulator_on_n"][1:] = draw.uniform(8.0, 12.0, 23)
    inputs["modulator_off_n"][1:] = draw.uniform(3.0, 7.0, 23)
    inputs["time_constant_s"][1:] = draw.uniform(1.0, 3.0, 23)
    return inputs, fly(model, inputs, np.arange(24), 1, folder=FOLDER)


def test_flown_by_the_engine_the_textbook_case_switches_on_time(trains):
    _, flown = trains
    assert flown["first_on_s"][0] == pytest.approx(FIRST_ON, abs=MILLISECOND)
    assert flown["pulse_s"][0] == pytest.approx(PULSE, abs=MILLISECOND)
    assert flown["pause_s"][0] == pytest.approx(PAUSE, abs=MILLISECOND)


def test_flown_pulse_trains_follow_the_closed_forms(trains):
    """An event is as exact as the steps: 0.1 s against a time constant of 1 s leaves (0.1)^5 / 120 a step."""
    i, flown = trains
    command, gain, tau = i["command_n"], i["gain"], i["time_constant_s"]
    on, off = i["modulator_on_n"], i["modulator_off_n"]
    assert set(flown["status"]) == {"ok"}
    np.testing.assert_allclose(flown["first_on_s"], first_on_time(command, gain, tau, on), rtol=2e-6)
    np.testing.assert_allclose(flown["pulse_s"], pulse_time(command, gain, tau, i["level_n"], on, off), rtol=2e-6)
    np.testing.assert_allclose(flown["pause_s"], pause_time(command, gain, tau, on, off), rtol=2e-6)


def test_the_count_and_the_impulse_of_the_pulses_are_those_of_the_history():
    _, widths = pulses()
    row = fly_one(**PULSED, step_s=0.01)
    assert row["pulse_count"] == len(widths) == 5
    assert widths.sum() == pytest.approx(168.2, abs=0.1)
    assert row["correction_impulse_m_s"] == pytest.approx(30.0 * widths.sum() / 100.0, abs=30.0 * 0.05 / 100.0)
    assert 100.0 * row["correction_impulse_m_s"] == pytest.approx(5045.0, abs=2.0)  # N s


@pytest.mark.parametrize("step", [0.1, 0.5, 1.0, 2.0])
def test_the_step_does_not_move_the_pulses(step):
    row = fly_one(**PULSED, step_s=step)
    assert row["pulse_count"] == 5
    assert row["correction_impulse_m_s"] == pytest.approx(50.43748, abs=1e-4)


def test_a_step_too_long_for_the_modulator_is_refused():
    """At 0.3 s the lag of steps of 1 s would run off and fire no pulse; there are 1448."""
    fast = PULSED | {"modulator_time_constant_s": 0.3}
    assert fly_one(**fast)["reason"].startswith("modulator_time_constant_s is below step_s")
    assert fly_one(**fast, step_s=0.1)["pulse_count"] == pytest.approx(1448, abs=2)
    assert fly_one(**fast | {"control": "clipped"})["status"] == "ok"
