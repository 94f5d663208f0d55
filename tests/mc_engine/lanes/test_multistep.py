"""Adams-Bashforth-Moulton: weights, order, stability limit, energy, events, restarts, and a twin in plain Python."""

import math
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from flown_models import FOLDER, OSCILLATOR, RAIL, flown, same_bytes
from plain_steps import MIXED, ahead, dop853, fields, weighted

from mc_engine.flight.flight import fly_history, fly_interpreted
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.lanes.multistep import adams_weights, multistep_tables
from mc_engine.lanes.philox import Draws, noise_key

ORDERS = (8, 9, 10, 11, 12)


def by(model, order):
    """The model with a multistep method in place of its own."""
    return replace(model, clock=replace(model.clock, method=f"abm{order}"))


def test_the_weights_are_those_of_the_book():
    # Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., eqs (III.1.5) and (III.1.9)
    assert [24 * weight for weight in adams_weights(4, implicit=False)] == [55, -59, 37, -9]
    assert [720 * weight for weight in adams_weights(5, implicit=True)] == [251, 646, -264, 106, -19]


@pytest.mark.parametrize("order", ORDERS)
def test_a_formula_integrates_powers_of_time_exactly_up_to_its_order(order):
    for implicit in (False, True):
        weights = adams_weights(order, implicit)
        moments = [
            sum(weight * Fraction(int(implicit) - i) ** power for i, weight in enumerate(weights))
            for power in range(order + 1)
        ]
        assert moments[:-1] == [Fraction(1, power + 1) for power in range(order)]
        assert moments[-1] != Fraction(1, order + 1)


# steps in a second, at 1 rad/s, between which the error after 10 s lies above the rounding of the state
ORDER_STEPS = {8: (21, 24), 9: (18, 21), 10: (15, 21), 11: (12, 15), 12: (12, 15)}


@pytest.mark.parametrize("order", ORDERS)
def test_the_error_falls_with_the_order_of_the_method(order):
    counts = ORDER_STEPS[order]
    coarse, fine = (
        abs(flown(by(RAIL, order), rate_rad_s=1.0, x0_m=1.0, step_s=1.0 / count)["end_x_m"][0] - math.cos(10.0))
        for count in counts
    )
    assert math.log(coarse / fine) / math.log(counts[1] / counts[0]) == pytest.approx(order, abs=0.75)


# step times angular frequency: in 20 000 steps the amplitude does not grow at the first, and grows without bound at the
# second; and relative change of the amplitude in 20 000 steps of 0.05, 160 turns
STABLE = {8: (0.37, 0.38), 9: (0.26, 0.27), 10: (0.18, 0.19), 11: (0.12, 0.13), 12: (0.075, 0.08)}
DRIFT = {8: -5.46e-10, 9: 1.51e-10, 10: 1.58e-12, 11: -3.5e-13, 12: -3.1e-14}


@pytest.mark.parametrize("order", ORDERS)
def test_an_oscillation_keeps_its_energy_below_the_stability_limit_and_grows_above(order):
    rates = np.array([0.05, *STABLE[order]])
    columns = flown(by(RAIL, order), rate_rad_s=rates, x0_m=1.0, step_s=1.0, until_s=20_000.0)
    change = np.hypot(columns["end_x_m"], columns["end_v_m_s"] / rates) - 1.0
    assert change[0] == pytest.approx(DRIFT[order], rel=0.02, abs=5e-15)
    assert change[1] < 0.05
    assert not change[2] < 0.05


def twin(case, order, seed, h, inputs):
    """End state [m, m/s] of one case by a plain loop of steps h over Python floats."""
    row = {parameter.name: parameter.default for parameter in OSCILLATOR.parameters}
    row |= {name: float(value[case]) for name, value in inputs.items() if np.ndim(value)}
    p = OSCILLATOR.kernel_parameters(*(row[item.name] * item.si_factor for item in OSCILLATOR.parameters))
    s, m = OSCILLATOR.initial(p, None), OSCILLATOR.start(p, None)
    *_, explicit, implicit, at_end, n = multistep_tables(f"abm{order}")
    nothing = fields(lambda y: 0.0 * y, s)
    slopes, lost = [], nothing
    for step in range(int(np.ceil(inputs["until_s"] / h))):
        t, finish, sample = step * h, (step + 1) * h, step / inputs["every"]
        if sample.is_integer():
            m, slopes = OSCILLATOR.control(t, s, m, p, None, Draws(noise_key(seed), float(case), sample)), []

        def rhs(t, s, m=m):
            return OSCILLATOR.rhs(t, s, m, p, None)

        slopes = [rhs(t, s), *slopes][: n + 1]
        if len(slopes) < n + 1:
            s, lost = dop853(rhs, t, h, s), nothing
            continue
        differences = [fields(float.__sub__, *pair) for pair in pairwise(slopes)]
        mean = fields(float.__add__, slopes[0], weighted(explicit[:n], differences, nothing))
        news = fields(float.__sub__, rhs(finish, ahead(s, h, mean)), slopes[0])
        correction = ahead(weighted(implicit[:n], differences, nothing), at_end, news)
        change = fields(lambda f, c, e: h * (f + c) - e, slopes[0], correction, lost)
        end = fields(float.__add__, s, change)
        lost = fields(lambda y, new, d: (new - y) - d, s, end, change)
        s = end
    return s


@pytest.mark.parametrize("order", [8, 11])
@pytest.mark.parametrize("width", [1, 8])
def test_a_plain_loop_over_python_floats_gives_the_same_bits(order, width):
    columns = flown(by(OSCILLATOR, order), width=width, seed=9, **MIXED)
    for case in range(0, 21, 4):
        s = twin(case, order, 9, 0.1, MIXED)
        assert (columns["end_x_km"][case], columns["end_v_m_s"][case]) == (s.x / 1e3, s.v)


def test_a_case_keeps_its_bytes_at_every_width_in_any_order_and_company():
    model = by(OSCILLATOR, 11)
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
    model = by(OSCILLATOR, 10)
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
    columns = flown(by(RAIL, 11), rate_rad_s=1.0, x0_m=1.0, end_m=-0.3, step_s=0.05)
    assert columns["end_time_s"][0] == pytest.approx(math.acos(-0.3), abs=1e-13)
    assert columns["end_x_m"][0] == pytest.approx(-0.3, abs=1e-13)


def test_each_bounce_of_a_bead_comes_at_its_time_and_with_its_height():
    # half periods of a spring between bounces at the middle, each with 0.8 of the speed; a gate between changes nothing
    bead = {"rate_rad_s": 1.0, "x0_m": 1.0, "wall_m": 0.0, "restitution": 0.8, "last_s": 9.0}
    columns = flown(by(RAIL, 11), **bead, gate_s=[2.0, 1e9], step_s=0.05)
    assert columns["bounces"].tolist() == [3.0, 3.0]
    assert columns["bounced_at_s"] == pytest.approx(2.5 * math.pi, abs=1e-12)
    assert columns["end_x_m"] == pytest.approx(0.8**3 * math.sin(9.0 - 2.5 * math.pi), abs=1e-12)
    assert columns["gates"].tolist() == [1.0, 0.0]


def test_cases_with_events_keep_their_bytes_at_every_width():
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
    eight = flown(by(RAIL, 11), **mixed)
    assert {"ok", "no-stop"} <= set(eight["status"])
    same_bytes(eight, flown(by(RAIL, 11), width=1, **mixed))
    alone = flown(by(RAIL, 11), case_ids=[7], **{name: value[7] for name, value in mixed.items()})
    same_bytes(alone, {name: row[7:8] for name, row in eight.items()})
