"""Gauss-Jackson: weights, order, stability limits, energy, events, restarts, and a twin in plain Python."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from flown_models import FOLDER, OSCILLATOR, RAIL, flown, same_bytes
from plain_steps import MIXED, dop853

from mc_engine.errors import ModelError
from mc_engine.flight.flight import fly_history, fly_interpreted
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.lanes.functions import fma
from mc_engine.lanes.gauss_jackson import gauss_jackson_tables, sum_weights
from mc_engine.lanes.philox import Draws, noise_key
from mc_engine.model import load_model

KEPLER = load_model("kepler.py", FOLDER)
ORDERS = (6, 7, 8, 9, 10)


def by(model, order):
    """The model with a Gauss-Jackson method in place of its own."""
    rates = model.clock.rates or (("x", "v"),)
    return replace(model, clock=replace(model.clock, method=f"gj{order}", rates=rates))


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
        columns = flown(by(RAIL, order), rate_rad_s=1.0, x0_m=1.0, step_s=1.0 / count, until_s=end)
        errors.append(math.hypot(columns["end_x_m"][0] - math.cos(end), columns["end_v_m_s"][0] + math.sin(end)))
    assert math.log(errors[0] / errors[1]) / math.log(counts[1] / counts[0]) == pytest.approx(order + 2, abs=0.5)


# 8 turns of eccentricity 0.1 with 100 steps a turn: distance from the true place, over the semi-major axis;
# 200 turns: relative error of the energy
MISSES = {6: 3.6e-8, 7: 1.7e-8, 8: 3.0e-9, 9: 1.5e-9, 10: 1.2e-10}
ENERGIES = {6: -1.3e-8, 7: 5.5e-9, 8: 3.8e-10, 9: -7.5e-10, 10: -1.8e-10}


@pytest.mark.parametrize("order", ORDERS)
def test_an_orbit_keeps_its_place_and_its_energy(order):
    short, long = (flown(by(KEPLER, order), eccentricity=0.1, until_s=turns) for turns in (8.0, 200.0))
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
    columns = flown(by(RAIL, order), rate_rad_s=rates, x0_m=1.0, step_s=1.0, until_s=20_000.0)
    change = np.hypot(columns["end_x_m"], columns["end_v_m_s"] / rates) - 1.0
    assert change[0] == pytest.approx(DRIFT[order], rel=0.02, abs=5e-15)
    assert change[1] < 0.05
    assert not change[2] < 0.05


@pytest.mark.parametrize("order", ORDERS)
def test_a_speed_that_friction_takes_dies_out_below_the_limit_of_damping_and_grows_above(order):
    columns = flown(by(RAIL, order), damping_1_s=DAMPED[order], v0_m_s=1.0, step_s=1.0, until_s=20_000.0)
    speeds = abs(columns["end_v_m_s"])
    assert speeds[0] < 1e-10
    assert not speeds[1] < 1.0


def twin(case, order, seed, h, inputs):
    """End state [m, m/s] of one case by a plain loop of steps h over Python floats."""
    row = {parameter.name: parameter.default for parameter in OSCILLATOR.parameters}
    row |= {name: float(value[case]) for name, value in inputs.items() if np.ndim(value)}
    p = OSCILLATOR.kernel_parameters(*(row[item.name] * item.si_factor for item in OSCILLATOR.parameters))
    s, m = OSCILLATOR.initial(p, None), OSCILLATOR.start(p, None)
    *_, predicted, present, n = gauss_jackson_tables(f"gj{order}")
    accelerations, first, second = [], 0.0, 0.0
    for step in range(int(np.ceil(inputs["until_s"] / h))):
        t, sample = step * h, step / inputs["every"]
        if sample.is_integer():
            m, accelerations = OSCILLATOR.control(t, s, m, p, None, Draws(noise_key(seed), float(case), sample)), []

        def rhs(t, s, m=m):
            return OSCILLATOR.rhs(t, s, m, p, None)

        accelerations = [rhs(t, s).v, *accelerations]
        if len(accelerations) < n:
            s = dop853(rhs, t, h, s)
            continue
        if len(accelerations) == n:
            of_rate, of_position = (summed(row[:n], accelerations) for row in present)
            first = fma(-h, of_rate, s.v)
            second, lost = fma(-h * h, of_position, fma(h, first, s.x)), [0.0, 0.0]
        else:
            first, lost[0] = added(first, fma(h, accelerations[0], -lost[0]))
            second, lost[1] = added(second, fma(h, first, -lost[1]))
        of_rate, of_position = (summed(row[:n], accelerations) for row in predicted)
        s = type(s)(fma(h * h, of_position, second), fma(h, of_rate, first))
    return s


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


@pytest.mark.parametrize("order", [6, 9])
@pytest.mark.parametrize("width", [1, 8])
def test_a_plain_loop_over_python_floats_gives_the_same_bits(order, width):
    columns = flown(by(OSCILLATOR, order), width=width, seed=9, **MIXED)
    for case in range(0, 21, 4):
        s = twin(case, order, 9, 0.1, MIXED)
        assert (columns["end_x_km"][case], columns["end_v_m_s"][case]) == (s.x / 1e3, s.v)


def test_a_case_keeps_its_bytes_at_every_width_in_any_order_and_company():
    model = by(OSCILLATOR, 8)
    whole = flown(model, **MIXED)
    for width in (1, 16):
        same_bytes(whole, flown(model, width=width, **MIXED))
    order = np.random.default_rng(1).permutation(21)
    shuffled = {name: value[order] if np.ndim(value) else value for name, value in MIXED.items()}
    back = np.argsort(order)
    same_bytes(whole, {name: row[back] for name, row in flown(model, case_ids=order, **shuffled).items()})
    few = {name: value[10:13] if np.ndim(value) else value for name, value in MIXED.items()}
    same_bytes({name: row[10:13] for name, row in whole.items()}, flown(model, case_ids=[10, 11, 12], **few))


def test_a_flight_by_python_and_a_history_give_the_bits_of_the_kernel():
    model = by(OSCILLATOR, 7)
    inputs = {item.name: item.default for item in (*OSCILLATOR.parameters, *OSCILLATOR.settings)}
    inputs |= {name: value[4] if np.ndim(value) else value for name, value in MIXED.items()}
    columns, history = fly_history(model, inputs, 4, 1, folder=FOLDER)
    same_bytes(columns, {name: row[4:5] for name, row in flown(model, **MIXED).items()})
    assert history["t_s"][-1] == columns["end_time_s"][0]
    assert history["x_km"][-1] == columns["end_x_km"][0]
    time, _, states, _ = fly_interpreted(InterpretedFlight(model), inputs, 4, 1)
    assert (time[0], states[0, 0] / 1e3, states[1, 0]) == tuple(
        columns[name][0] for name in ("end_time_s", "end_x_km", "end_v_m_s")
    )


def test_a_stop_is_found_to_the_last_digits():
    columns = flown(by(RAIL, 8), rate_rad_s=1.0, x0_m=1.0, end_m=-0.3, step_s=0.05)
    assert columns["end_time_s"][0] == pytest.approx(math.acos(-0.3), abs=1e-13)
    assert columns["end_x_m"][0] == pytest.approx(-0.3, abs=1e-13)


def test_each_bounce_of_a_bead_comes_at_its_time_and_with_its_height():
    # half periods of a spring between bounces at the middle, each with 0.8 of the speed; a gate between changes nothing
    bead = {"rate_rad_s": 1.0, "x0_m": 1.0, "wall_m": 0.0, "restitution": 0.8, "last_s": 9.0}
    columns = flown(by(RAIL, 8), **bead, gate_s=[2.0, 1e9], step_s=0.05)
    assert columns["bounces"].tolist() == [3.0, 3.0]
    assert columns["bounced_at_s"] == pytest.approx(2.5 * math.pi, abs=1e-12)
    assert columns["end_x_m"] == pytest.approx(0.8**3 * math.sin(9.0 - 2.5 * math.pi), abs=1e-12)
    assert columns["gates"].tolist() == [1.0, 0.0]


def test_a_case_whose_positions_have_other_derivatives_is_flown_right_beside_others():
    columns = flown(by(KEPLER, 8), eccentricity=0.1, drift_m_s=[0.0, 0.5, 0.0], until_s=0.4)
    for case, drift in enumerate((0.0, 0.5)):
        # Adams' method takes any derivative
        anyhow = InterpretedFlight(replace(KEPLER, clock=replace(KEPLER.clock, method="abm10")))
        inputs = {"eccentricity": 0.1, "drift_m_s": drift, "step_s": 0.005, "until_s": 0.4}
        x = fly_interpreted(anyhow, inputs, case, 1)[2][0, 0]
        assert columns["end_x_m"][case] == pytest.approx(x, abs=1e-9)
    assert abs(columns["end_x_m"][1] - columns["end_x_m"][0]) > 0.05
    alone = flown(by(KEPLER, 8), eccentricity=0.1, until_s=0.4)
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
