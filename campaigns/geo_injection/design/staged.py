"""The source's procedure: burn by burn between given orbits, each of least time and centred on an apsis of the old one.

A burn is a boundary-value problem, `fly_shortest`.  With the primer vector p = -lambda_v and its rate q = lambda_r,
H = 1 + q.v - p.g - T |p| / m (eq. 13) and eqs (14), (15) say "thrust along p".

The burns of `staged` make one continuous flight, which the source's do not (see `published/values.py`).  All but
the last leave the perigee on the node; the first begins where it lasts shortest if the parking orbit is a circle, which
has no apsis, the others are centred in time on the apsis that they reach.  Canonical units, axes as in `optimal.py`.
"""

from collections import namedtuple
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from campaigns.geo_injection.design.coast import IMAGINARY, coast
from campaigns.geo_injection.design.optimal import SOLVED, Problem, coast_hamiltonian, parking_orbit, searched
from campaigns.geo_injection.design.powered_arc import STEP, fly_burns
from mc_engine.errors import ModelError
from mc_engine.physics.orbital_elements import state_of_elements

Conditions = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of place and velocity [n, 3], complex too: [n, m]
Rise = namedtuple("Rise", "burn_time radial transverse")  # the last two: velocity costates
# ignition: time after the reference point of the old orbit, in a flight after the first;  start, end: states [12]
# iterations: of scipy
Burn = namedtuple("Burn", "ignition duration start end iterations")


@dataclass(frozen=True)
class Orbit:
    """Semi-major axis, eccentricity, inclination [rad] against the final orbit; the node is on the x axis."""

    a: float
    e: float
    inclination: float

    def apsis(self, anomaly: float) -> np.ndarray:
        """Place and velocity [6] at perigee (0, on the ascending node) or apogee (pi, on the descending one)."""
        return state_of_elements(self.a, self.e, self.inclination, 0.0, 0.0, anomaly, 1.0)

    def reached(self, r: np.ndarray, v: np.ndarray, apse_on_node: bool = True) -> np.ndarray:
        """End conditions: (17), twice the energy, and the apse line off the node, unless it is free."""
        h, size = np.cross(r, v), np.sqrt(self.a * (1.0 - self.e * self.e))
        r1, v2 = np.sqrt((r * r).sum(-1)), (v * v).sum(-1)
        across, normal = size * np.sin(self.inclination), size * np.cos(self.inclination)
        rows = [h[..., 0], h[..., 1] + across, h[..., 2] - normal, v2 - 2.0 / r1 + 1.0 / self.a]
        if apse_on_node:
            apse = (v2 - 1.0 / r1)[..., None] * r - (r * v).sum(-1)[..., None] * v
            rows.append(apse[..., 1] * np.cos(self.inclination) + apse[..., 2] * np.sin(self.inclination))
        return np.stack(rows, axis=-1)


def circle_reached(radius: float, r: np.ndarray, v: np.ndarray) -> np.ndarray:
    """End conditions of a circle in the plane z = 0: (17) and the two speeds, in the unit of its angular momentum."""
    h = np.cross(r, v)
    rate, r2 = (r * v).sum(-1), (r * r).sum(-1)
    conditions = [h[..., 0], h[..., 1], h[..., 2] - np.sqrt(radius), rate, r2 / radius - radius]
    return np.stack(conditions, axis=-1) / np.sqrt(radius)


@dataclass(frozen=True)
class Stage:
    """What a burn has to do.

    reference : place and velocity [6] on the old orbit that ignition times count from, an apsis or the node
    mass : at ignition, of the initial one;  thrust, flow : per initial mass
    reached : the end conditions, zero where they are met
    placing : "fixed" ignites at the reference, "centred" half a burn before it, "free" where it lasts shortest
    step : of the integration, canonical time
    """

    reference: np.ndarray
    mass: float
    thrust: float
    flow: float
    reached: Conditions
    placing: str = "centred"
    step: float = STEP


def staged(problem: Problem, between: tuple[Orbit, ...]) -> list[Burn]:
    """The burns over the given orbits, canonical units, ignitions after the first; ModelError if one is not found."""
    circle_first = problem.eccentricity == 0.0
    if not circle_first and abs(np.sin(0.5 * problem.perigee)) > 1e-9:
        raise ModelError(
            "the staged procedure has all perigees on the ascending node: an elliptic parking orbit needs "
            'parking_argument_of_perigee_deg = 0, or method = "optimal"'
        )
    burns: list[Burn] = []
    mass, reference, lead = 1.0, parking_orbit(problem, np.zeros(1))[0], 0.0
    for k, new in enumerate(between):
        placing = "free" if k == 0 and circle_first else "centred"
        stage = Stage(reference, mass, problem.thrust, problem.flow, new.reached, placing)
        burn = shortest(stage, float(np.linalg.norm(new.apsis(0.0)[3:])), new.inclination)
        burns.append(burn._replace(ignition=lead + burn.ignition if burns else 0.0))
        mass -= problem.flow * burn.duration
        wait, reference = _next_apsis(burn.end, apogee=k == len(between) - 1)
        lead = burns[-1].ignition + burn.duration + wait
    stage = Stage(reference, mass, problem.thrust, problem.flow, partial(circle_reached, problem.ratio))
    try:
        last = shortest(stage, -np.sqrt(1.0 / problem.ratio), 0.0)
    except ModelError:  # not found from an impulse at the apsis
        if np.linalg.norm(reference[:3]) >= problem.ratio:  # no rise: eq. (23) has no real root
            raise
        last = rising(stage, problem.ratio)
    return [*burns, last._replace(ignition=lead + last.ignition)]


def _next_apsis(state: np.ndarray, apogee: bool) -> tuple[float, np.ndarray]:
    """(time to the next apogee or perigee, place and velocity there), as eqs (24)-(26) of the source."""
    r, v = state[:3], state[3:6]
    r1 = np.sqrt(r @ r)
    a = 1.0 / (2.0 / r1 - v @ v)
    e_sine = r @ v / np.sqrt(a)
    mean = np.arctan2(e_sine, 1.0 - r1 / a) - e_sine
    wait = float(((np.pi if apogee else 2.0 * np.pi) - mean) % (2.0 * np.pi) * a**1.5)
    return wait, coast(state, np.array([wait]))[0, :6]


def shortest(stage: Stage, wanted: float, inclination: float) -> Burn:
    """The burn, guessed as an impulse at the reference that gives the wanted speed, canonical, at an inclination [rad].

    The rocket equation, (1) of the source integrated, times it; the impulse is centred in a burn that is not "fixed".
    """
    r, v = stage.reference[:3], stage.reference[3:]
    change = wanted * np.array([0.0, np.cos(inclination), np.sin(inclination)]) - v
    size = float(np.linalg.norm(change))
    duration = stage.mass * -np.expm1(-size * stage.flow / stage.thrust) / stage.flow
    primer = change / size
    rate = np.cross(np.cross(r, v) / (r @ r), primer)  # the thrust turns with the local horizon
    ignition = 0.0 if stage.placing == "fixed" else -0.5 * duration
    return fly_shortest(stage, primer - 0.5 * duration * rate, rate, duration, ignition)


def rise_guess(rise: float) -> Rise:
    """The burn of a rise (R_f - R_0) / f: eqs (18), (23) of the source.

    R_f, R_0 : radii at cut-off and ignition, f : thrust acceleration; the radial place costate is 1.  Made for a rise
    between circles within less than a quarter revolution: eq. (18) has R_0 = 1, eq. (23) takes it for burns between
    ellipses.  Of an apogee burn, which needs speed and hardly any radius, it gives a third of the time and a thrust
    along the radius.
    """
    half = float(np.sqrt(rise))
    return Rise(burn_time=2.0 * half, radial=half, transverse=rise)


def rising(stage: Stage, radius: float) -> Burn:
    """The burn to a radius, guessed by eq. (23) in the radial and transverse directions of the apsis."""
    r, v = stage.reference[:3], stage.reference[3:]
    r0 = float(np.linalg.norm(r))
    up, along = r / r0, v / np.linalg.norm(v)
    duration, radial, transverse = rise_guess((radius - r0) * stage.mass / stage.thrust)
    return fly_shortest(stage, radial * up + transverse * along, -up - radial * along, duration, -0.5 * duration)


def fly_shortest(stage: Stage, primer: np.ndarray, rate: np.ndarray, duration: float, ignition: float) -> Burn:
    """The burn of least time near a guess of the primer vector and its rate at ignition; ModelError if none is found.

    By eqs (9)-(17) of the source.  The size of the costates follows from H = 0; the multipliers of the end conditions
    begin at the values that fit the guessed end best.
    """
    size = float(np.linalg.norm(primer))
    m = stage.reached(stage.reference[:3], stage.reference[3:]).size
    x = np.array([*primer / size, *rate / size, duration, ignition, *np.zeros(m)])
    with np.errstate(all="ignore"):
        free = _residuals(stage, x[None])[0, m : m + 6]
        basis = np.repeat(x[None], m, axis=0)
        basis[:, 8:] = np.eye(m)
        columns = free[:, None] - _residuals(stage, basis)[:, m : m + 6].T
        if not np.isfinite(columns).all():
            raise ModelError(
                "the search for the shortest burn cannot begin, as it would last too long; give more thrust_n"
            )
        x[8:] = np.linalg.lstsq(columns, free, rcond=None)[0]
        x, left, iterations = searched(partial(_residuals, stage), x)
    if not left < SOLVED or x[6] <= 0.0:
        raise ModelError(f"the search for the shortest burn stopped with a residual of {left:.1e}")
    start, end = _ends(stage, x[None])
    return Burn(float(x[7]), float(x[6]), start[0], end[0], iterations)


def _residuals(stage: Stage, x: np.ndarray) -> np.ndarray:
    """End conditions, transversality, H = 0 at the end, and the rule that places the ignition: eqs (9)-(17)."""
    start, end = _ends(stage, x)
    r, v = end[:, :3], end[:, 3:6]
    steps = 1j * IMAGINARY * np.eye(6)
    gradients = [stage.reached(r + step[:3], v + step[3:]).imag / IMAGINARY for step in steps]
    costate = np.concatenate([end[:, 9:12], -end[:, 6:9]], axis=1)
    across = costate - np.einsum("knm,nm->nk", np.array(gradients), x[:, 8:])
    unit = stage.thrust / stage.mass  # the costates are those of eq. (13), times this
    push = stage.mass / (stage.mass - stage.flow * x[:, 6]) * np.linalg.norm(end[:, 6:9], axis=1)
    rules = {"fixed": x[:, 7], "centred": x[:, 7] + 0.5 * x[:, 6], "free": coast_hamiltonian(start)}
    last = np.stack([1.0 + coast_hamiltonian(end) / unit - push, rules[stage.placing]], axis=1)
    return np.concatenate([stage.reached(r, v), across, last], axis=1)


def _ends(stage: Stage, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States at ignition and cut-off of unknowns [n, ...]: primer vector, rate, duration, ignition, multipliers."""
    on_orbit = coast(np.append(stage.reference, np.ones(6)), x[:, 7])  # its primer vector is not used
    start = np.concatenate([on_orbit[:, :6], x[:, :6]], axis=1)
    return start, fly_burns(start, stage.mass, x[:, 6], stage.thrust, stage.flow, stage.step)
