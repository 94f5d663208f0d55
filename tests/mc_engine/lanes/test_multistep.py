"""Adams-Bashforth-Moulton: weights, order, stability limit, energy, events, restarts, and a twin in plain Python."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from flown_models import OSCILLATOR, RAIL, flown
from plain_steps import MIXED, ahead, by, dop853, fields, twin, weighted

from mc_engine.lanes.multistep import adams_weights, multistep_tables
from mc_engine.model import FixedStep

ORDERS = (8, 9, 10, 11, 12)


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
        abs(flown(by(RAIL, f"abm{order}"), rate_rad_s=1.0, x0_m=1.0, step_s=1.0 / count)["end_x_m"][0] - math.cos(10.0))
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
    columns = flown(by(RAIL, f"abm{order}"), rate_rad_s=rates, x0_m=1.0, step_s=1.0, until_s=20_000.0)
    change = np.hypot(columns["end_x_m"], columns["end_v_m_s"] / rates) - 1.0
    assert change[0] == pytest.approx(DRIFT[order], rel=0.02, abs=5e-15)
    assert change[1] < 0.05
    assert not change[2] < 0.05


def test_the_limits_that_are_documented_are_those_of_stable_steps():
    limits = ", ".join(f"{stable:g}" for stable, _ in STABLE.values())
    assert f"below {limits} for the five orders of ABM;" in " ".join(FixedStep.__doc__.split())


class AdamsSteps:
    """Steps by Adams-Bashforth-Moulton over Python floats."""

    def __init__(self, order):
        *_, self.explicit, self.implicit, self.at_end, self.n = multistep_tables(f"abm{order}")
        self.restart()

    def restart(self):
        self.slopes, self.lost = [], None

    def advance(self, rhs, step, h, s):
        t, n, nothing = step * h, self.n, fields(lambda y: 0.0 * y, s)
        self.slopes = [rhs(t, s), *self.slopes][: n + 1]
        if len(self.slopes) < n + 1:
            self.lost = None
            return dop853(rhs, t, h, s)
        differences = [fields(float.__sub__, *pair) for pair in pairwise(self.slopes)]
        mean = fields(float.__add__, self.slopes[0], weighted(self.explicit[:n], differences, nothing))
        news = fields(float.__sub__, rhs((step + 1) * h, ahead(s, h, mean)), self.slopes[0])
        correction = ahead(weighted(self.implicit[:n], differences, nothing), self.at_end, news)
        change = fields(lambda f, c, e: h * (f + c) - e, self.slopes[0], correction, self.lost or nothing)
        end = fields(float.__add__, s, change)
        self.lost = fields(lambda y, new, d: (new - y) - d, s, end, change)
        return end


@pytest.mark.parametrize(
    ("order", "width"),
    [(11, 8), *(pytest.param(*more, marks=pytest.mark.slow) for more in ((8, 1), (8, 8), (11, 1)))],
)
def test_a_plain_loop_over_python_floats_gives_the_same_bits(order, width):
    columns = flown(by(OSCILLATOR, f"abm{order}"), width=width, seed=9, **MIXED)
    for case in range(0, 21, 4):
        s, _ = twin(AdamsSteps(order), case, 9, 0.1, MIXED)
        assert (columns["end_x_km"][case], columns["end_v_m_s"][case]) == (s.x / 1e3, s.v)
