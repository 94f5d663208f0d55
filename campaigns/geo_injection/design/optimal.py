"""The free-time optimum: least burn time over steering, burns, coasts and the place of the first ignition.

One primer vector lives through all burns and coasts.  With the duration of everything free, the Hamiltonian of the
coasts H = q.v - p.g is zero at the start and end of every burn, and the primer vector is as long at the end of a coast
as at its start; so the switching function is zero at every switch.  D. F. Lawden, Optimal Trajectories for Space
Navigation (1963), chapter 5; the source leaves this out and places its burns by rule (`staged.py`).

Canonical units: perigee radius of the parking orbit, the circular speed there, initial mass.  Axes: x to the ascending
node of the parking orbit, z normal to the final orbit.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy  # loads its packages when they are used

from campaigns.geo_injection.design.coast import coast

SOLVED = 1e-11  # largest residual of a solution
_STEP = 1e-6  # of the differences of the Jacobian, over unknowns of about one


@dataclass(frozen=True)
class Problem:
    """A sequence of burns.  thrust, flow : per initial mass;  ratio : of the radii;  plane_change [rad].

    eccentricity, perigee : of the parking orbit; its argument of perigee [rad], from the ascending node
    """

    burns: int
    plane_change: float
    ratio: float
    thrust: float
    flow: float
    eccentricity: float = 0.0
    perigee: float = 0.0

    @property
    def exhaust(self) -> float:
        """Exhaust speed T / m', canonical: the c of eq. (1)."""
        return self.thrust / self.flow

    def with_thrust(self, thrust: float) -> "Problem":
        """The same engine with another thrust, canonical, and the same exhaust speed."""
        return replace(self, thrust=thrust, flow=thrust / self.exhaust)


@dataclass(frozen=True)
class Solution:
    """unknowns : place of the first ignition [rad from the node], primer vector and rate there (radial, transverse,
    normal), durations of the burns, then of the coasts.  states : [2 burns, 12] at the switches."""

    problem: Problem
    unknowns: np.ndarray
    states: np.ndarray

    @property
    def durations(self) -> np.ndarray:
        """Of the burns."""
        return self.unknowns[7 : 7 + self.problem.burns]

    @property
    def coasts(self) -> np.ndarray:
        """Durations of the coasts."""
        return self.unknowns[7 + self.problem.burns :]

    @property
    def ignitions(self) -> np.ndarray:
        """Times of the ignitions after the first, canonical."""
        return np.concatenate([[0.0], np.cumsum(self.durations[:-1] + self.coasts)])


def unknowns_of(
    problem: Problem, place: float, primer: np.ndarray, rate: np.ndarray, durations: list[float], coasts: list[float]
) -> np.ndarray:
    """The unknowns, see `Solution`; primer vector and rate canonical, in the axes of the problem."""
    axes = local_axes(problem.plane_change, np.array([place]))[0]
    return np.array([place, *axes @ primer, *axes @ rate, *durations, *coasts])


def switch_states(problem: Problem, unknowns: np.ndarray) -> np.ndarray:
    """States [n, 2 burns, 12] at the ignitions and cut-offs of n sets of unknowns [n, 6 + 2 burns].

    Canonical; coasts by (19)-(21), burns by (1) and (16).
    """
    from campaigns.geo_injection.design.powered_arc import fly_burns  # imports numba

    y = first_states(problem, unknowns)
    mass = np.ones(len(unknowns))
    out = []
    for k in range(problem.burns):
        duration = unknowns[:, 7 + k]
        if k > 0:
            y = coast(y, unknowns[:, 6 + problem.burns + k])
        out.append(y)
        y = fly_burns(y, mass, duration, problem.thrust, problem.flow)
        out.append(y)
        mass = mass - problem.flow * duration
    return np.stack(out, axis=1)


def local_axes(plane_change: float, place: np.ndarray) -> np.ndarray:
    """Radial, transverse and normal unit vectors [n, 3, 3] on the parking orbit at places [n, rad from the node]."""
    c, s = np.cos(place), np.sin(place)
    ci, si, zero = np.cos(plane_change), np.sin(plane_change), 0.0 * c
    radial = np.stack([c, s * ci, s * si], axis=1)
    transverse = np.stack([-s, c * ci, c * si], axis=1)
    return np.stack([radial, transverse, np.stack([zero, zero - si, zero + ci], axis=1)], axis=1)


def parking_orbit(problem: Problem, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(places [n, 3], velocities [n, 3]) on the parking orbit at angles [n] from its node.

    Curtis, Orbital Mechanics for Engineering Students, 3rd ed., eqs (2.45), (2.48), (2.49), the perigee radius being 1.
    """
    axes = local_axes(problem.plane_change, place)
    e, anomaly = problem.eccentricity, place - problem.perigee
    along, across = 1.0 + e * np.cos(anomaly), e * np.sin(anomaly)
    root = np.sqrt(1.0 + e)  # of the parameter
    velocity = (across[:, None] * axes[:, 0] + along[:, None] * axes[:, 1]) / root
    return (1.0 + e) / along[:, None] * axes[:, 0], velocity


def first_states(problem: Problem, unknowns: np.ndarray) -> np.ndarray:
    """States [n, 12] at the first ignition, on the parking orbit."""
    axes = local_axes(problem.plane_change, unknowns[:, 0])
    p = np.einsum("nk,nki->ni", unknowns[:, 1:4], axes)
    q = np.einsum("nk,nki->ni", unknowns[:, 4:7], axes)
    return np.concatenate([*parking_orbit(problem, unknowns[:, 0]), p, q], axis=1)


def coast_hamiltonian(y: np.ndarray) -> np.ndarray:
    """q.v - p.g of states [..., 12], canonical: eq. (13) without the thrust and the 1, with its sign."""
    r, v, p, q = (y[..., 3 * k : 3 * k + 3] for k in range(4))
    r3 = (r * r).sum(-1) ** 1.5
    return (q * v).sum(-1) + (p * r).sum(-1) / r3


def residuals(problem: Problem, unknowns: np.ndarray) -> np.ndarray:
    """What is zero at the optimum, [n, 6 + 2 burns] for unknowns of the same shape.

    The final circle (five conditions, eq. (17) of the source and two speeds), H = 0 at the first ignition and at every
    cut-off, equal primer vectors at both ends of a coast, and the length 1 of the last one, which is their scale.
    """
    y = switch_states(problem, unknowns)
    end = y[:, -1]
    r, v = end[:, :3], end[:, 3:6]
    h = np.cross(r, v)
    size = np.sqrt((y[:, :, 6:9] ** 2).sum(-1))
    ends = y[:, 1::2]
    columns = [
        h[:, :2] / np.sqrt(problem.ratio),
        ((r * r).sum(1) / problem.ratio**2 - 1.0)[:, None],
        ((r * v).sum(1) / np.sqrt(problem.ratio))[:, None],
        ((v * v).sum(1) * problem.ratio - 1.0)[:, None],
        coast_hamiltonian(y[:, 0])[:, None],
        # the primer vector's rate falls with the radius: all ends count alike in the units of the final circle
        coast_hamiltonian(ends) * np.sqrt((ends[:, :, :3] ** 2).sum(-1)),
        size[:, 2::2] - size[:, 1:-1:2],
        (size[:, -1] - 1.0)[:, None],
    ]
    return np.concatenate(columns, axis=1)


Conditions = Callable[[np.ndarray], np.ndarray]  # zero where they are met: [n, m] at n sets of unknowns [n, k]


def searched(conditions: Conditions, guess: np.ndarray, most: int | None = None) -> tuple[np.ndarray, float, int]:
    """(unknowns near a guess, largest residual, iterations); the conditions are canonical, over unknowns of about one.

    Levenberg-Marquardt of at most `most` evaluations, then two Newton steps; the Jacobian by central differences over
    all unknowns at once.  What is not finite counts as far from being met.
    """

    def value(x: np.ndarray) -> np.ndarray:
        left = conditions(x[None])[0]
        return np.where(np.isfinite(left), left, 1e3)

    def slope(x: np.ndarray) -> np.ndarray:
        steps = _STEP * np.diag(np.maximum(1.0, np.abs(x)))
        both = conditions(np.concatenate([x + steps, x - steps]))
        return np.nan_to_num((both[: x.size] - both[x.size :]).T / (2.0 * np.diag(steps)))

    search = scipy.optimize.least_squares(
        value, guess, slope, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=most
    )
    x = search.x
    for _ in range(2):
        x = x - np.linalg.lstsq(slope(x), value(x), rcond=1e-9)[0]
    return x, float(np.abs(value(x)).max()), int(search.njev)


Instead = tuple[int, int]  # (condition that is left out, unknown that keeps its guess for it)
FIRST_PLACE: Instead = (5, 0)  # H at the first ignition may be what it will


def first_burn(problem: Problem) -> Instead:
    """The first burn keeps its duration; the primer vectors around the coast after it may then differ."""
    return 6 + problem.burns, 7


def solve(problem: Problem, guess: np.ndarray, instead: Instead | None = None) -> np.ndarray | None:
    """Unknowns (canonical) of the optimum near a guess, or None.

    A planar sequence keeps its primer vector in the plane, and may begin anywhere on a circular parking orbit, so that
    its first place is held at the guess; one of its conditions then follows from the others, which
    Levenberg-Marquardt does not mind.
    """
    held = np.zeros((3, guess.size))
    if problem.plane_change == 0.0:
        held[[1, 2], [3, 6]] = 1.0
        held[0, 0] = float(problem.eccentricity == 0.0)

    def conditions(x: np.ndarray) -> np.ndarray:
        left = residuals(problem, x)
        if instead is not None:
            left[:, instead[0]] = x[:, instead[1]] - guess[instead[1]]
        return np.concatenate([left, (x - guess) @ held.T], axis=1)

    with np.errstate(all="ignore"):
        if not np.isfinite(residuals(problem, guess[None])).all():
            return None
        x, left, _ = searched(conditions, guess, 60)
    return x if left < SOLVED and (x[7:] > 0.0).all() else None
