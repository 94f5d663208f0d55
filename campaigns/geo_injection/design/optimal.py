"""The free-time optimum, and its check: least burn time over steering, burns, coasts and place of the first ignition.

One primer vector lives through all burns and coasts.  With all durations free, the Hamiltonian of the coasts
H = q.v - p.g is zero at every switch, and the primer vector is as long at the end of a coast as at its start; so the
switching function is zero at every switch.  D. F. Lawden, Optimal Trajectories for Space Navigation (1963), chapter 5;
the source leaves this out and places its burns by rule (`staged.py`).

Canonical units: perigee radius of the parking orbit, the circular speed there, initial mass.  Axes: x to the ascending
node of the parking orbit, z normal to the final orbit.
"""

from collections import namedtuple
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy  # loads its packages when they are used

from campaigns.geo_injection.design.coast import coast
from campaigns.geo_injection.design.powered_arc import fly_burns
from mc_engine.physics.orbital_elements import state_of_elements

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
        """Exhaust speed T / m': the c of eq. (1)."""
        return self.thrust / self.flow

    def with_thrust(self, thrust: float) -> "Problem":
        """The same engine with another thrust and the same exhaust speed; canonical units, flow = thrust / exhaust."""
        return replace(self, thrust=thrust, flow=thrust / self.exhaust)


# durations, coasts, ignitions (after the first): times [burns], [burns - 1], [burns];  states: [2 burns, 12] at the
# ignitions and cut-offs
Solution = namedtuple("Solution", "problem durations coasts ignitions states")


def unknowns_of(
    problem: Problem, place: float, primer: np.ndarray, rate: np.ndarray, durations: list[float], coasts: list[float]
) -> np.ndarray:
    """What is searched for: place of the first ignition [rad from the node], primer vector and rate there (radial,
    transverse, normal; given in the axes of the problem), durations of the burns, then of the coasts; canonical units.
    """
    axes = local_axes(problem.plane_change, np.array([place]))[0]
    return np.array([place, *axes @ primer, *axes @ rate, *durations, *coasts])


def switch_states(problem: Problem, unknowns: np.ndarray) -> np.ndarray:
    """States [n, 2 burns, 12] at ignitions and cut-offs of unknowns [n, 6 + 2 burns]: eqs (19)-(21), (1) and (16)."""
    mass, states = np.ones(len(unknowns)), [first_states(problem, unknowns)]
    for k, duration in enumerate(unknowns[:, 7 : 7 + problem.burns].T):
        if k > 0:
            states.append(coast(states[-1], unknowns[:, 6 + problem.burns + k]))
        states.append(fly_burns(states[-1], mass, duration, problem.thrust, problem.flow))
        mass = mass - problem.flow * duration
    return np.stack(states, axis=1)


def local_axes(plane_change: float, place: np.ndarray) -> np.ndarray:
    """Radial, transverse and normal unit vectors [n, 3, 3] on the parking orbit at places [n, rad from the node]."""
    c, s = np.cos(place), np.sin(place)
    ci, si, zero = np.cos(plane_change), np.sin(plane_change), 0.0 * c
    axes = [[c, s * ci, s * si], [-s, c * ci, c * si], [zero, zero - si, zero + ci]]
    return np.moveaxis(np.array(axes), 2, 0)


def parking_orbit(problem: Problem, place: np.ndarray) -> np.ndarray:
    """Place and velocity [n, 6], canonical units, on the parking orbit at angles [n, rad] from its node."""
    e, perigee = problem.eccentricity, np.full_like(place, problem.perigee)
    return state_of_elements(1.0 / (1.0 - e), e, problem.plane_change, 0.0, perigee, place - perigee, 1.0).T


def first_states(problem: Problem, unknowns: np.ndarray) -> np.ndarray:
    """States [n, 12] at the first ignition, on the parking orbit."""
    axes = local_axes(problem.plane_change, unknowns[:, 0])
    p = np.einsum("nk,nki->ni", unknowns[:, 1:4], axes)
    q = np.einsum("nk,nki->ni", unknowns[:, 4:7], axes)
    return np.concatenate([parking_orbit(problem, unknowns[:, 0]), p, q], axis=1)


def coast_hamiltonian(y: np.ndarray) -> np.ndarray:
    """q.v - p.g of states [..., 12]: eq. (13) without the thrust and the 1, with its sign."""
    r, v, p, q = np.split(y, 4, axis=-1)
    return (q * v).sum(-1) + (p * r).sum(-1) / (r * r).sum(-1) ** 1.5


def residuals(problem: Problem, unknowns: np.ndarray) -> np.ndarray:
    """What is zero at the optimum, for unknowns of the same shape, [n, 6 + 2 burns].

    The final circle (eq. (17) of the source and two speeds), H = 0 at the first ignition and at every cut-off, primer
    vectors of one length at both ends of a coast, and the length 1 of the last one, which is their scale.
    """
    y = switch_states(problem, unknowns)
    r, v, ends = y[:, -1, :3], y[:, -1, 3:6], y[:, 1::2]
    size = np.sqrt((y[:, :, 6:9] ** 2).sum(-1))
    columns = [
        np.cross(r, v)[:, :2] / np.sqrt(problem.ratio),
        (r * r).sum(1) / problem.ratio**2 - 1.0,
        (r * v).sum(1) / np.sqrt(problem.ratio),
        (v * v).sum(1) * problem.ratio - 1.0,
        coast_hamiltonian(y[:, 0]),
        # the primer vector's rate falls with the radius: all ends count alike in the units of the final circle
        coast_hamiltonian(ends) * np.sqrt((ends[:, :, :3] ** 2).sum(-1)),
        size[:, 2::2] - size[:, 1:-1:2],
        size[:, -1] - 1.0,
    ]
    return np.column_stack(columns)


def searched(
    conditions: Callable[[np.ndarray], np.ndarray], guess: np.ndarray, most: int | None = None
) -> tuple[np.ndarray, float, int]:
    """(unknowns near a guess, largest residual in the unit of the conditions, iterations), for unknowns of about one.

    conditions : zero where they are met, [n, m] at n sets of unknowns [n, k]; what is not finite counts as far from it

    Levenberg-Marquardt of at most `most` evaluations, then two Newton steps; the Jacobian by central differences.
    """

    def value(x: np.ndarray) -> np.ndarray:
        left = conditions(x[None])[0]
        return np.where(np.isfinite(left), left, 1e3)

    def slope(x: np.ndarray) -> np.ndarray:
        """Jacobian, in the unit of the conditions per that of each unknown."""
        steps = _STEP * np.diag(np.maximum(1.0, np.abs(x)))
        both = conditions(np.concatenate([x + steps, x - steps]))
        return np.nan_to_num((both[: x.size] - both[x.size :]).T / (2.0 * np.diag(steps)))

    exact = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    search = scipy.optimize.least_squares(value, guess, slope, method="lm", max_nfev=most, **exact)
    x = search.x
    for _ in range(2):
        x = x - np.linalg.lstsq(slope(x), value(x), rcond=1e-9)[0]
    return x, float(np.abs(value(x)).max()), int(search.njev)


Instead = tuple[int, int]  # (condition that is left out, unknown that keeps its guess for it)
FIRST_PLACE: Instead = (5, 0)  # H at the first ignition may be what it will
FIRST_OF_THREE: Instead = (9, 7)  # the duration; the primer vectors around the coast after this burn may then differ


def solve(problem: Problem, guess: np.ndarray, instead: Instead | None = None) -> np.ndarray | None:
    """Unknowns of the optimum near a guess, canonical units, or None.

    A planar sequence keeps its primer vector in the plane, and may begin anywhere on a circular parking orbit: its
    first place is held.  One of its conditions follows from the others, which Levenberg-Marquardt does not mind.
    """
    held = np.zeros((3, guess.size))
    if problem.plane_change == 0.0:
        held[[1, 2], [3, 6]] = 1.0
        held[0, 0] = float(problem.eccentricity == 0.0)

    def conditions(x: np.ndarray) -> np.ndarray:
        """`residuals`, one replaced, and the unknowns that are held; canonical units."""
        left = residuals(problem, x)
        if instead is not None:
            left[:, instead[0]] = x[:, instead[1]] - guess[instead[1]]
        return np.concatenate([left, (x - guess) @ held.T], axis=1)

    with np.errstate(all="ignore"):
        if not np.isfinite(residuals(problem, guess[None])).all():
            return None
        x, left, _ = searched(conditions, guess, 60)
    return x if left < SOLVED and (x[7:] > 0.0).all() and _ends_eastward(problem, x) else None


def _ends_eastward(problem: Problem, x: np.ndarray) -> bool:
    """Whether the final circle is flown eastward: eq. (17) of the source holds in the opposite direction, too."""
    end = switch_states(problem, x[None])[0, -1]
    return bool(end[0] * end[4] > end[1] * end[3])


def is_optimal(solution: Solution, tolerance: float = 1e-9, n: int = 200) -> bool:
    """Whether the switching function has its right sign at n instants of each arc: else more or fewer burns would pay.

    It is S = k - T |p| / m - flow l, with a constant k, and S + q.v - p.g = 0 on burns: eq. (13) of the source with its
    mass costate l, canonical units.  On coasts m and l rest, and S is zero at the start.
    """
    problem, y, mass = solution.problem, solution.states, 1.0
    for k, duration in enumerate(solution.durations):
        if k > 0:
            size = np.linalg.norm(coast(y[2 * k - 1], np.linspace(0.0, solution.coasts[k - 1], n))[:, 6:9], axis=1)
            if (problem.thrust * (size - size[0]) / mass > tolerance).any():
                return False
        burn = fly_burns(y[2 * k], mass, np.linspace(0.0, duration, n), problem.thrust, problem.flow)
        if (coast_hamiltonian(burn) < -tolerance).any():
            return False
        mass -= problem.flow * duration
    return True
