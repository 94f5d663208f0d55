"""One burn of least time from a point of an orbit to a set of end conditions: the source's boundary-value problem.

Canonical units: mu = 1.  The costates are kept as the primer vector p = -lambda_v and its rate q = lambda_r, so that
H = 1 + q.v - p.g - T |p| / m (eq. 13) and eqs (14), (15) say "thrust along p".
"""

from collections import namedtuple
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from campaigns.geo_injection.design.coast import IMAGINARY, coast
from campaigns.geo_injection.design.optimal import SOLVED, coast_hamiltonian, searched
from campaigns.geo_injection.design.powered_arc import fly_burns
from mc_engine.errors import ModelError

Conditions = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of place and velocity [n, 3], complex too: [n, m]
Rise = namedtuple("Rise", "burn_time radial transverse")  # the last two: velocity costates
# ignition: time after the reference point of the old orbit;  start, end: states [12];  iterations: of scipy
Burn = namedtuple("Burn", "ignition duration start end iterations")


@dataclass(frozen=True)
class Stage:
    """What a burn has to do.

    reference : place and velocity [6] on the old orbit that ignition times count from, an apsis or the node
    mass : at ignition, of the initial one;  thrust, flow : per initial mass
    reached : the end conditions, zero where they are met
    step : of the integration, canonical time
    placing : "fixed" ignites at the reference, "centred" half a burn before it, "free" where it lasts shortest
    """

    reference: np.ndarray
    mass: float
    thrust: float
    flow: float
    reached: Conditions
    placing: str = "centred"
    step: float = 0.1


def rise_guess(rise: float) -> Rise:
    """The burn of a rise (R_f - R_0) / f: eqs (18), (23) of the source.

    R_f, R_0 : radii at cut-off and ignition, f : thrust acceleration; the radial place costate is 1.  Made for a rise
    between circles within less than a quarter revolution: eq. (18) has R_0 = 1 and starts the example of table 1,
    eq. (23) takes the same for burns between ellipses.  Of an apogee burn to the geostationary circle, which needs
    speed and hardly any radius, it gives a third of the time and a thrust along the radius.
    """
    half = float(np.sqrt(rise))
    return Rise(burn_time=2.0 * half, radial=half, transverse=rise)


def circle(radius: float) -> Conditions:
    """The circle in the plane z = 0: eq. (17) for the angular momentum, and the two speeds."""

    def reached(r: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(17) and the two speeds, in the unit of the circle's angular momentum."""
        h = np.cross(r, v)
        rate, r2 = (r * v).sum(-1), (r * r).sum(-1)
        conditions = [h[..., 0], h[..., 1], h[..., 2] - np.sqrt(radius), rate, r2 / radius - radius]
        return np.stack(conditions, axis=-1) / np.sqrt(radius)

    return reached


def orbit(a: float, e: float, inclination: float, apse_on_node: bool = True) -> Conditions:
    """An ellipse with its node on the x axis: the angular momentum by eq. (17), the energy -1 / (2 a), and, unless the
    apse line is free, an eccentricity vector without a component across the x axis.
    """
    h_wanted = np.sqrt(a * (1.0 - e * e))

    def reached(r: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(17), twice the energy, and the apse line off the node."""
        h = np.cross(r, v)
        r1, v2 = np.sqrt((r * r).sum(-1)), (v * v).sum(-1)
        across, normal = h_wanted * np.sin(inclination), h_wanted * np.cos(inclination)
        rows = [h[..., 0], h[..., 1] + across, h[..., 2] - normal, v2 - 2.0 / r1 + 1.0 / a]
        if apse_on_node:
            apse = (v2 - 1.0 / r1)[..., None] * r - (r * v).sum(-1)[..., None] * v
            rows.append(apse[..., 1] * np.cos(inclination) + apse[..., 2] * np.sin(inclination))
        return np.stack(rows, axis=-1)

    return reached


def _ends(stage: Stage, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States at ignition and cut-off of unknowns [n, ...]: primer vector, rate, duration, ignition, multipliers."""
    on_orbit = coast(np.append(stage.reference, np.ones(6)), x[:, 7])  # its primer vector is not used
    start = np.concatenate([on_orbit[:, :6], x[:, :6]], axis=1)
    return start, fly_burns(start, stage.mass, x[:, 6], stage.thrust, stage.flow, stage.step)


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


def fly_shortest(stage: Stage, primer: np.ndarray, rate: np.ndarray, duration: float, ignition: float) -> Burn:
    """The burn of least time near a guess of the primer vector and its rate at ignition; ModelError if none is found.

    By eqs (9)-(17) of the source.  The guess fixes directions and a ratio; the size follows from H = 0.  Multipliers of
    the end conditions begin at the values that fit the guessed end best.
    """
    size = float(np.linalg.norm(primer))
    m = stage.reached(stage.reference[:3], stage.reference[3:]).size
    x = np.array([*primer / size, *rate / size, duration, ignition, *np.zeros(m)])
    with np.errstate(all="ignore"):
        free = _residuals(stage, x[None])[0, m : m + 6]
        basis = np.repeat(x[None], m, axis=0)
        basis[:, 8:] = np.eye(m)
        columns = free[:, None] - _residuals(stage, basis)[:, m : m + 6].T
        x[8:] = np.linalg.lstsq(columns, free, rcond=None)[0]
        x, left, iterations = searched(partial(_residuals, stage), x)
    if not left < SOLVED or x[6] <= 0.0:
        raise ModelError(f"the search for the shortest burn stopped with a residual of {left:.1e}")
    start, end = _ends(stage, x[None])
    return Burn(float(x[7]), float(x[6]), start[0], end[0], iterations)
