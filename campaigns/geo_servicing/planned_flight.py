"""The flight of a phasing plan without errors, in the full dynamics, by SciPy on the same physics.

Run once for each plan that the design looks at; the campaign's flights are compiled.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from campaigns.geo_servicing.corrections import drift_of
from campaigns.geo_servicing.drift_model import perturbation_coefficients
from campaigns.geo_servicing.dynamics import MU, R0, RATE, SIDEREAL_DAY, State, field, longitudes, rhs
from mc_engine.physics.gravity import point_mass
from mc_engine.physics.sun_moon import ephemeris

_TOLERANCES = {"rtol": 1e-9, "atol": [*[1e-3] * 3, *[1e-7] * 3, 1e-6, *[1.0] * 6, 1e-3]}


@dataclass(frozen=True)
class End:
    """End of a flown plan.

    y : mean longitude deviation of the sidereal day after [rad];  v : actual drift in it [rad/rev]
    e : osculating eccentricity vector at the last cut-off, x + i y;  time : of that [rev]
    """

    y: float
    v: float
    e: complex
    time: float


@dataclass(frozen=True)
class Flight:
    """ignition [s], with mean longitude deviation [rad] and osculating drift [rad/rev] there, float64[n]; the end."""

    ignition: np.ndarray
    longitude: np.ndarray
    drift: np.ndarray
    end: End


@dataclass(frozen=True)
class _Thrust:
    """The part of the memory that the motion needs [N]."""

    outward: float
    ahead: float
    across: float


class Craft:
    """The servicing module at the start, without errors."""

    def __init__(self, o: Any, tables: np.ndarray, first: Any):
        """o : settings;  tables : all tables of the model, with room for the plan;  first : kernel parameters, SI."""
        self.o, self.p = o._replace(tables=tables), first
        self.start = np.array([getattr(first, name) for name in State._fields[:7]] + [0.0] * 7)
        _, self.y, elements = longitudes(0.0, State(*self.start), first)
        self.v = drift_of(elements.a)
        self.e = complex(elements.k, elements.h)
        self.aim = first.aim
        self.pull = self.mean_pull()

    def mean_pull(self) -> tuple[float, float]:
        """(b_s, b_r) of (3.46), of the perturbations averaged over the first sidereal day at the required longitude."""
        t = np.linspace(0.0, SIDEREAL_DAY, 24, endpoint=False)
        angle = self.aim + RATE * t
        x, y, z = R0 * np.cos(angle), R0 * np.sin(angle), 0.0 * t
        sx, sy, sz, mx, my, mz = ephemeris(self.p.sun_moon_time + t, self.o.tables, self.p.sun_moon)
        light = self.p.light / self.p.mass
        ax, ay, _ = field(t, x, y, z, (sx, sy, sz), (mx, my, mz), light, self.p, self.o)
        px, py, _ = point_mass(x, y, z, MU)
        ax, ay = ax - px, ay - py
        outward, ahead = ax * np.cos(angle) + ay * np.sin(angle), ay * np.cos(angle) - ax * np.sin(angle)
        return perturbation_coefficients(ahead.mean(), outward.mean())

    def burn_times(self, dv: np.ndarray) -> np.ndarray:
        """Lengths [s] of burns of velocity changes dv [m/s], one after the other."""
        before = self.p.mass * np.exp(-np.concatenate([[0.0], np.cumsum(np.abs(dv))[:-1]]) / self.p.exhaust)
        return before * self.p.exhaust / self.p.thrust * -np.expm1(-np.abs(dv) / self.p.exhaust)

    def velocity_changes(self, burns: np.ndarray) -> np.ndarray:
        """Velocity changes [m/s] of burns of these lengths [s], one after the other."""
        flow = self.p.thrust / self.p.exhaust
        after = self.p.mass - flow * np.cumsum(burns)
        return self.p.exhaust * np.log((after + flow * burns) / after)

    def fly(self, t: float, s: np.ndarray, length: float, push: float) -> np.ndarray:
        """State float64[14] after an arc of this length [s] under a thrust ahead [N]."""
        m = _Thrust(0.0, push, 0.0)
        flight = solve_ivp(
            lambda time, y: rhs(time, State(*y), m, self.p, self.o), (t, t + length), s, "DOP853", **_TOLERANCES
        )
        return np.asarray(flight.y[:, -1])


def fly_plan(craft: Craft, coasts: np.ndarray, dv: np.ndarray) -> Flight:
    """Coasts [s] and burns [m/s] of a plan, one after the other, and the sidereal day after."""
    t, s, seen = 0.0, craft.start, []
    for coast, change, burn in zip(coasts, dv, craft.burn_times(dv), strict=True):
        s = craft.fly(t, s, coast, 0.0)
        t += coast
        _, mean, elements = longitudes(t, State(*s), craft.p)
        seen.append((t, mean, drift_of(elements.a)))
        s = craft.fly(t, s, burn, np.copysign(craft.p.thrust, change))
        t += burn
    _, mean, elements = longitudes(t, State(*s), craft.p)
    after = craft.fly(t, s, SIDEREAL_DAY, 0.0)
    _, later, _ = longitudes(t + SIDEREAL_DAY, State(*after), craft.p)
    end = End((after[-1] - s[-1]) / SIDEREAL_DAY, later - mean, complex(elements.k, elements.h), t / SIDEREAL_DAY)
    ignition, longitude, drift = np.array(seen).T
    return Flight(ignition, longitude, drift, end)
