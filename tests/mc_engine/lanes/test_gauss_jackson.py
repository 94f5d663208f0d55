"""Gauss-Jackson: weights, order, stability limits, energy, events, restarts, and a twin in plain Python."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from flown_models import FOLDER, OSCILLATOR, RAIL, flown, same_bytes
from plain_steps import MIXED, by, dop853, twin

from mc_engine.errors import ModelError
from mc_engine.flight.flight import fly_interpreted
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.lanes.functions import fma
from mc_engine.lanes.gauss_jackson import gauss_jackson_tables, sum_weights
from mc_engine.model import load_model

KEPLER = load_model("kepler.py", FOLDER)
TURNING_FRAME = load_model("turning_frame.py", FOLDER)
ORDERS = (6, 7, 8, 9, 10)


def test_the_weights_are_those_of_the_source():
    # Berry & Healy (2004), tables 5 and 6, eighth order: b_44, where the first sum has half of the newest acceleration;
    # a_44 to a_4-4, and the first of the predicted position
    (rate, present), (_, ahead) = sum_weights(9, predicted=False), sum_weights(9, predicted=True)
    assert rate[0] + Fraction(1, 2) == Fraction(-19087, 89600)
    assert [str(weight) for weight in present[:3]] == ["3250433/53222400", "572741/5702400", "-8701681/39916800"]
    assert [str(weight) for weight in present[3:6]] == ["4026311/13305600", "-917039/3193344", "7370669/39916800"]
    assert [str(weight) for weight in present[6:]] == ["-1025779/13305600", "754331/39916800", "-330157/159667200"]
    assert str(ahead[0]) == "103798439/159667200"


@pytest.mark.parametrize("order", ORDERS)
def test_a_step_integrates_powers_of_time_exactly_up_to_its_order(order):
    (rate_ahead, ahead), (rate, position) = (sum_weights(order + 1, predicted) for predicted in (True, False))
    # both ends of a step have the same sums: what is left of their difference are the integrals over the step
    once = [a - b for a, b in zip(rate_ahead, rate, strict=True)]
    twice = [a - b - c for a, b, c in zip(ahead, position, rate, strict=True)]
    for power in range(order + 2):
        moments = [sum(w * Fraction(-i) ** power for i, w in enumerate(weights)) for weights in (once, twice)]
        exact = [Fraction(1, power + 1), Fraction(1, (power + 1) * (power + 2))]
        assert (moments == exact) == (power <= order)


# of an oscillation of 1 rad/s: end [s] and steps in a second, between which the error lies above rounding
ORDER_STEPS = {6: (40.0, 14, 18), 7: (10.0, 12, 15), 8: (40.0, 12, 14), 9: (10.0, 10, 12)}


@pytest.mark.parametrize("order", ORDER_STEPS)
def test_the_error_falls_with_two_orders_more_than_the_differences(order):
    end, *counts = ORDER_STEPS[order]
    errors = []
    for count in counts:
        columns = flown(by(RAIL, f"gj{order}"), rate_rad_s=1.0, x0_m=1.0, step_s=1.0 / count, until_s=end)
        errors.append(math.hypot(columns["end_x_m"][0] - math.cos(end), columns["end_v_m_s"][0] + math.sin(end)))
    assert math.log(errors[0] / errors[1]) / math.log(counts[1] / counts[0]) == pytest.approx(order + 2, abs=0.5)


# 8 turns of eccentricity 0.1 with 100 steps a turn: distance from the true place, over the semi-major axis;
# 200 turns: relative error of the energy
MISSES = {6: 3.6e-8, 7: 1.7e-8, 8: 3.0e-9, 9: 1.5e-9, 10: 1.2e-10}
ENERGIES = {6: -1.3e-8, 7: 5.5e-9, 8: 3.8e-10, 9: -7.5e-10, 10: -1.8e-10}


@pytest.mark.parametrize("order", ORDERS)
def test_an_orbit_keeps_its_place_and_its_energy(order):
    short, long = (flown(by(KEPLER, f"gj{order}"), eccentricity=0.1, until_s=turns) for turns in (8.0, 200.0))
    assert short["miss_m"][0] == pytest.approx(MISSES[order], rel=0.05)
    assert long["energy"][0] == pytest.approx(ENERGIES[order], rel=0.05)


# step times angular frequency, and step times damping rate: in 20 000 steps the motion does not grow at the first, and
# grows without bound at the second; and relative change of the amplitude in 20 000 steps of 0.05, 160 turns
STABLE = {6: (0.33, 0.34), 7: (0.24, 0.25), 8: (0.17, 0.18), 9: (0.12, 0.13), 10: (0.09, 0.10)}
DAMPED = {6: (0.0235, 0.025), 7: (0.012, 0.013), 8: (0.0062, 0.0068), 9: (0.0032, 0.0035), 10: (0.0016, 0.0018)}
DRIFT = {6: 5.385e-11, 7: 2.63e-13, 8: -1.25e-13, 9: 0.0, 10: 0.0}


@pytest.mark.parametrize("order", ORDERS)
def test_an_oscillation_keeps_its_energy_below_the_stability_limit_and_grows_above(order):
    rates = np.array([0.05, *STABLE[order]])
    columns = flown(by(RAIL, f"gj{order}"), rate_rad_s=rates, x0_m=1.0, step_s=1.0, until_s=20_000.0)
    change = np.hypot(columns["end_x_m"], columns["end_v_m_s"] / rates) - 1.0
    assert change[0] == pytest.approx(DRIFT[order], rel=0.02, abs=5e-15)
    assert change[1] < 0.05
    assert not change[2] < 0.05


@pytest.mark.parametrize("order", ORDERS)
def test_a_speed_that_friction_takes_dies_out_below_the_limit_of_damping_and_grows_above(order):
    columns = flown(by(RAIL, f"gj{order}"), damping_1_s=DAMPED[order], v0_m_s=1.0, step_s=1.0, until_s=20_000.0)
    speeds = abs(columns["end_v_m_s"])
    assert speeds[0] < 1e-10
    assert not speeds[1] < 1.0


@pytest.mark.parametrize("order", ORDERS)
def test_a_turning_frame_has_the_limit_of_damping(order):
    turns = np.array([DAMPED[order][0], 1.3 * DAMPED[order][1]]) / 2.0  # the acceleration is twice that times the speed
    columns = flown(by(TURNING_FRAME, f"gj{order}"), turn_rad_s=turns, step_s=1.0, until_s=20_000.0)
    kept, grown = columns["end_speed_m_s"]
    assert kept == pytest.approx(1.0, abs=1e-9)
    assert not grown < 2.0


class GaussJacksonSteps:
    """Steps by Gauss-Jackson over Python floats."""

    def __init__(self, order):
        *_, self.predicted, self.present, self.n = gauss_jackson_tables(f"gj{order}")
        self.restart()

    def restart(self):
        self.accelerations, self.first, self.second, self.lost = [], 0.0, 0.0, [0.0, 0.0]

    def advance(self, rhs, step, h, s):
        n = self.n
        self.accelerations = [rhs(step * h, s).v, *self.accelerations]
        if len(self.accelerations) < n:
            return dop853(rhs, step * h, h, s)
        if len(self.accelerations) == n:
            of_rate, of_position = (summed(row[:n], self.accelerations) for row in self.present)
            self.first = fma(-h, of_rate, s.v)
            self.second = fma(-h * h, of_position, fma(h, self.first, s.x))
        else:
            self.first, self.lost[0] = added(self.first, fma(h, self.accelerations[0], -self.lost[0]))
            self.second, self.lost[1] = added(self.second, fma(h, self.first, -self.lost[1]))
        of_rate, of_position = (summed(row[:n], self.accelerations) for row in self.predicted)
        return type(s)(fma(h * h, of_position, self.second), fma(h, of_rate, self.first))


def summed(weights, values):
    """Weighted sum, one rounding a term."""
    total = 0.0
    for weight, value in zip(weights, values, strict=False):
        total = fma(weight, value, total)
    return total


def added(total, change):
    """(sum, its rounding error)."""
    end = total + change
    return end, (end - total) - change


@pytest.mark.parametrize(
    ("order", "width"),
    [(6, 8), *(pytest.param(*more, marks=pytest.mark.slow) for more in ((9, 1), (6, 1), (9, 8)))],
)
def test_a_plain_loop_over_python_floats_gives_the_same_bits(order, width):
    columns = flown(by(OSCILLATOR, f"gj{order}"), width=width, seed=9, **MIXED)
    for case in range(0, 21, 4):
        s, _ = twin(GaussJacksonSteps(order), case, 9, 0.1, MIXED)
        assert (columns["end_x_km"][case], columns["end_v_m_s"][case]) == (s.x / 1e3, s.v)


def test_a_case_whose_positions_have_other_derivatives_is_flown_right_beside_others():
    columns = flown(by(KEPLER, "gj8"), eccentricity=0.1, drift_m_s=[0.0, 0.5, 0.0], until_s=0.4)
    for case, drift in enumerate((0.0, 0.5)):
        # Adams' method takes any derivative
        anyhow = InterpretedFlight(replace(KEPLER, clock=replace(KEPLER.clock, method="abm10")))
        inputs = {"eccentricity": 0.1, "drift_m_s": drift, "step_s": 0.005, "until_s": 0.4}
        x = fly_interpreted(anyhow, inputs, case, 1)[2][0, 0]
        assert columns["end_x_m"][case] == pytest.approx(x, abs=1e-9)
    assert abs(columns["end_x_m"][1] - columns["end_x_m"][0]) > 0.05
    alone = flown(by(KEPLER, "gj8"), eccentricity=0.1, until_s=0.4)
    same_bytes(alone, {name: row[:1] for name, row in columns.items()})


@pytest.mark.parametrize(
    ("rates", "sentence"),
    [
        ((), 'the clock\'s `rates` name no state; the method "gj8" needs each of the states "x", "vy", "vx"'),
        ((("x", "vx"),), 'name "x", "vx"; the method "gj8" needs each'),
        ((("x", "vx"), ("x", "vy")), 'name "x", "vx", "x", "vy"; the method'),
        ((("x", "v"), ("y", "vy")), 'the clock\'s `rates` have the state "v"'),
    ],
)
def test_states_that_are_not_in_pairs_are_refused(rates, sentence):
    with pytest.raises(ModelError) as refusal:
        replace(KEPLER, clock=replace(KEPLER.clock, rates=rates))
    assert sentence in str(refusal.value)


def test_a_state_that_is_not_the_derivative_is_refused_by_its_first_flight():
    model = replace(KEPLER, clock=replace(KEPLER.clock, rates=(("x", "vy"), ("y", "vx"))))
    with pytest.raises(ModelError, match=r'`rhs` gives 0 for "x"; it must give s\.vy, here 6\.28319'):
        flown(model)
