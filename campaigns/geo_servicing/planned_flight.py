"""The flight of a phasing plan without errors, in the full dynamics, by SciPy on the same physics.

Run once for each plan that the design looks at; the campaign's flights are compiled.
"""

from collections import namedtuple
from typing import Any

import numpy as np
import scipy  # loads its packages when they are used

from campaigns.geo_servicing import dynamics
from campaigns.geo_servicing.corrections import Burn, Memory, drift_of
from campaigns.geo_servicing.drift_model import perturbation_coefficients
from campaigns.geo_servicing.dynamics import MU, R0, RATE, SIDEREAL_DAY, State
from mc_engine.physics.frames import half_turn
from mc_engine.physics.gravity import point_mass
from mc_engine.physics.sun_moon import ephemeris
from mc_engine.physics.vectors import Vector, subtracted

Plan = namedtuple("Plan", "coasts dv")  # before the corrections [s], and their velocity changes [m/s], float64[n]
# end of a flown plan, or a difference of two: mean longitude deviation of the sidereal day after [rad], actual drift in
# it [rad/rev], osculating eccentricity vector x + i y at the last cut-off, and the time of that [rev]
End = namedtuple("End", "y v e time")


class Craft:
    """The servicing module at the start, without errors.

    o : settings, with all tables of the model and room for the plan;  first : kernel parameters, SI
    """

    def __init__(self, o: Any, first: Any):
        self.o, self.p, self.aim = o, first, first.aim
        self.start = np.array(dynamics.initial(first))
        self.y, self.v, self.e = self.seen(0.0, self.start)
        self.pull = self.mean_pull()

    def seen(self, t: float, s: np.ndarray) -> tuple[float, float, complex]:
        """(mean longitude deviation [rad], osculating drift [rad/rev], eccentricity vector) of a state float64[14]."""
        _, mean, elements = dynamics.longitudes(t, State(*s), self.p)
        return mean, drift_of(elements.a), complex(elements.k, elements.h)

    def mean_pull(self) -> tuple[float, float]:
        """(b_s, b_r) of (3.46), of the perturbations averaged over the first sidereal day at the required longitude."""
        t = np.linspace(0.0, SIDEREAL_DAY, 24, endpoint=False)
        angle = self.aim + RATE * t
        r = Vector(R0 * np.cos(angle), R0 * np.sin(angle), 0.0 * t)
        sx, sy, sz, mx, my, mz = ephemeris(self.p.sun_moon_time + t, self.o.tables, self.p.sun_moon)
        light = self.p.light / self.p.mass_left
        a = dynamics.field(t, r, Vector(sx, sy, sz), Vector(mx, my, mz), light, self.p, self.o)
        ax, ay, _ = subtracted(a, Vector(*point_mass(*r, MU)))
        outward, ahead = ax * np.cos(angle) + ay * np.sin(angle), ay * np.cos(angle) - ax * np.sin(angle)
        return perturbation_coefficients(ahead.mean(), outward.mean())

    def burn_times(self, dv: np.ndarray) -> np.ndarray:
        """Lengths [s] of burns of velocity changes dv [m/s], one after the other."""
        before = self.p.mass_left * np.exp(-np.concatenate([[0.0], np.cumsum(np.abs(dv))[:-1]]) / self.p.exhaust)
        return before * self.p.exhaust / self.o.thrust * -np.expm1(-np.abs(dv) / self.p.exhaust)

    def velocity_changes(self, burns: np.ndarray) -> np.ndarray:
        """Velocity changes [m/s] of burns of these lengths [s], one after the other."""
        flow = self.o.thrust / self.p.exhaust
        after = self.p.mass_left - flow * np.cumsum(burns)
        return self.p.exhaust * np.log((after + flow * burns) / after)

    def fly(self, t: float, s: np.ndarray, length: float, push: float, reference: float = 0.0) -> np.ndarray:
        """State float64[14] after an arc of this length [s] under a thrust ahead [N]; reference : see `Memory`."""
        m = Memory(burn=Burn(dv=0.0, outward=0.0, ahead=push, across=0.0), reference=reference)

        def rates(time, y):
            return dynamics.rhs(time, State(*y), m, self.p, self.o)

        tolerances = {"rtol": 1e-9, "atol": dynamics.tolerances(1e-3, 1e-7)}
        return np.asarray(scipy.integrate.solve_ivp(rates, (t, t + length), s, "DOP853", **tolerances).y[:, -1])

    def fly_plan(self, plan: Plan) -> tuple[np.ndarray, End]:
        """(time [s], mean longitude deviation [rad] and osculating drift [rad/rev] at the ignitions, [3, n]; end)."""
        t, s, ignitions = 0.0, self.start, []
        for coast, change, burn in zip(plan.coasts, plan.dv, self.burn_times(plan.dv), strict=True):
            s = self.fly(t, s, coast, 0.0)
            t += coast
            ignitions.append((t, *self.seen(t, s)[:2]))
            s = self.fly(t, s, burn, np.copysign(self.o.thrust, change))
            t += burn
        mean, _, e = self.seen(t, s)
        reference = dynamics.true_deviation(t, State(*s), self.aim)
        after = self.fly(t, s, SIDEREAL_DAY, 0.0, reference)
        later, _, _ = self.seen(t + SIDEREAL_DAY, after)
        day_mean, drift = reference + (after[-1] - s[-1]) / SIDEREAL_DAY, later - mean
        return np.array(ignitions).T, End(half_turn(day_mean), half_turn(drift), e, t / SIDEREAL_DAY)
