"""The loop on a fixed grid over Python floats, for the twins of all its methods, and cases of multistep methods."""

from dataclasses import replace

import numpy as np
from flown_models import OSCILLATOR

from mc_engine.lanes.functions import fma
from mc_engine.lanes.philox import Draws, noise_key
from mc_engine.lanes.runge_kutta_pairs import DOP853

RANDOM = np.random.default_rng(4)
MIXED = {
    "rate_rad_s": RANDOM.uniform(0.2, 0.9, 21),
    "x0_km": RANDOM.normal(size=21),
    "v0_m_s": 1e3 * RANDOM.normal(size=21),
    "gain_1_s": RANDOM.uniform(0.0, 0.5, 21),
    "noise_m_s2": np.where(np.arange(21) % 3 == 0, 0.0, 100.0),
    "until_s": 5.3,
    "every": 17.0,
}


def ahead(s, h, slopes):
    """State plus h times its slopes, rounded once."""
    return type(s)(*(fma(h, slope, y) for y, slope in zip(s, slopes, strict=True)))


def weighted(weights, slopes, start):
    """Weighted sum of slopes, one rounding a term."""
    for weight, slope in zip(weights, slopes, strict=True):
        start = ahead(start, weight, slope)
    return start


def fields(function, *states):
    """function of each field of some states."""
    return type(states[0])(*(function(*row) for row in zip(*states, strict=True)))


def dop853(rhs, t, h, s):
    """State after one step of DOP853."""
    slopes, nothing = [rhs(t, s)], fields(lambda y: 0.0 * y, s)
    for node, row in zip(DOP853.nodes, DOP853.rows, strict=True):
        end = ahead(s, h, weighted(row.values(), [slopes[stage] for stage in row], nothing))
        slopes.append(rhs(t + node * h, end))
    return ahead(s, h, weighted(DOP853.weights.values(), [slopes[stage] for stage in DOP853.weights], nothing))


def by(model, method):
    """The model with a multistep method in place of its own."""
    rates = (model.clock.rates or (("x", "v"),)) if method.startswith("gj") else ()
    return replace(model, clock=replace(model.clock, method=method, rates=rates))


def twin(steps, case, seed, h, inputs):
    """End state [m, m/s] and memory of one case of the oscillator by a plain loop of steps h over Python floats.

    steps : of a method: steps.restart(), and steps.advance(rhs, step, h, s), the state at the end of one
    """
    row = {parameter.name: parameter.default for parameter in OSCILLATOR.parameters}
    row |= {name: float(value[case]) for name, value in inputs.items() if np.ndim(value)}
    p = OSCILLATOR.kernel_parameters(*(row[item.name] * item.si_factor for item in OSCILLATOR.parameters))
    s, m = OSCILLATOR.initial(p, None), OSCILLATOR.start(p, None)
    for step in range(int(np.ceil(inputs["until_s"] / h))):
        t, sample = step * h, step / inputs["every"]
        if sample.is_integer():
            m = OSCILLATOR.control(t, s, m, p, None, Draws(noise_key(seed), float(case), sample))
            steps.restart()

        def rhs(t, s, m=m):
            return OSCILLATOR.rhs(t, s, m, p, None)

        s = steps.advance(rhs, step, h, s)
    return s, m
