"""Densities for importance sampling in standard normal space: mixtures over directions and distances.

One component draws a direction about a mean direction (von Mises-Fisher) and a distance from a chi distribution, whose
degrees of freedom nu may differ from the number of inputs.  Separate directions and distances work for many inputs:
Wang & Song, Structural Safety 59 (2016), 42-52; Papaioannou, Geyer & Straub, Reliability Engineering & System Safety
191 (2019) 106564, who use a Nakagami distribution with two parameters for the distance.  Fitted to failures that
distribution is narrow, and weights at large distances have no finite variance.  A chi distribution with nu >= n_inputs,
its special case m = Omega / 2, keeps them bounded.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.special import gammaln, ive

BACKGROUND = 0.1  # share drawn in all directions alike, so that no direction is left out
MOST_COMPONENTS = 8
_STEPS = 30
_SETTLED = 1e-4  # rise of the mean logarithm of the density that is no progress
_CARRIED = 0.999  # share of the weights that a fit looks at: the many lightest cases carry the rest
_LONGEST = 0.999  # mean resultant length that a component may have, lest it shrink to a point
_ASYMPTOTIC = 50.0  # orders of the Bessel function from which its expansion serves


@dataclass(frozen=True)
class DirectionMixture:
    """A mixture: share float64[k], summing to 1; mean direction float64[k, n_inputs] of length 1; kappa, nu float64[k].

    kappa = 0 : all directions are equally probable.
    """

    share: np.ndarray
    mean: np.ndarray
    kappa: np.ndarray
    nu: np.ndarray

    def log_density(self, u: np.ndarray) -> np.ndarray:
        """float64[n], logarithm of the density at u float64[n, n_inputs]."""
        distance, direction = polar(u)
        return _added(component_logs(distance, direction, self))

    def draw(self, rng: np.random.Generator, n: int) -> np.ndarray:
        """float64[n, n_inputs]: n random points of the mixture."""
        counts = rng.multinomial(n, self.share)
        return np.concatenate([self._drawn(rng, int(count), place) for place, count in enumerate(counts) if count])

    def _drawn(self, rng: np.random.Generator, n: int, place: int) -> np.ndarray:
        if self.kappa[place] > 0.0:
            directions = stats.vonmises_fisher(self.mean[place], self.kappa[place]).rvs(n, random_state=rng)
        else:
            directions = polar(rng.standard_normal((n, self.mean.shape[1])))[1]
        return np.sqrt(rng.chisquare(self.nu[place], n))[:, None] * directions.reshape(n, -1)


def log_normal_density(u: np.ndarray) -> np.ndarray:
    """float64[n], logarithm of the standard normal density at u float64[n, n_inputs]."""
    return -0.5 * (u * u).sum(axis=1) - 0.5 * u.shape[1] * math.log(2.0 * math.pi)


def polar(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(distance from the origin, direction) of each row."""
    distance = np.maximum(np.sqrt((u * u).sum(axis=1)), 1e-300)
    return distance, u / distance[:, None]


def component_logs(distance: np.ndarray, direction: np.ndarray, mixture: DirectionMixture) -> np.ndarray:
    """float64[k, n], logarithm of each component's density per volume, times its share."""
    n_inputs = direction.shape[1]
    kappa, nu = mixture.kappa[:, None], mixture.nu[:, None]
    # chi density over r^(n_inputs - 1), which a shell's area grows with
    radial = (nu - n_inputs) * np.log(distance) - 0.5 * distance * distance
    factor = log_sphere_factor(n_inputs, kappa) - (0.5 * nu - 1.0) * math.log(2.0) - gammaln(0.5 * nu)
    return kappa * (mixture.mean @ direction.T) + radial + factor + np.log(mixture.share)[:, None]


def _added(logs: np.ndarray) -> np.ndarray:
    """float64[n], logarithm of the sum over the rows of exp(logs[k, n])."""
    largest = logs.max(axis=0)
    return np.asarray(largest + np.log(np.exp(logs - largest).sum(axis=0)))


def log_sphere_factor(n_inputs: int, kappa: np.ndarray) -> np.ndarray:
    """Logarithm of the von Mises-Fisher factor C(kappa); with kappa = 0, of one over the area of the unit sphere.

    Mardia & Jupp, Directional Statistics (2000), eq. (9.3.4).  Bessel functions of high order underflow; they come
    from Abramowitz & Stegun, eq. (9.7.7).
    """
    kappa = np.asarray(kappa, dtype=np.float64)
    order, half = 0.5 * n_inputs - 1.0, 0.5 * n_inputs
    uniform = gammaln(half) - math.log(2.0) - half * math.log(math.pi)
    x = np.where(kappa > 0.0, kappa, 1.0)
    if order < _ASYMPTOTIC:
        with np.errstate(divide="ignore"):
            log_bessel = np.log(ive(order, x)) + x
    else:
        root = np.sqrt(order * order + x * x)
        t = order / root
        log_bessel = root + order * (np.log(x) - np.log(order + root)) - 0.5 * np.log(2.0 * math.pi * root)
        log_bessel = log_bessel + np.log1p((3.0 * t - 5.0 * t**3) / (24.0 * order))
    factor = order * np.log(x) - half * math.log(2.0 * math.pi) - log_bessel
    return np.where((kappa > 0.0) & np.isfinite(factor), factor, uniform)


def fit_mixture(u: np.ndarray, weight: np.ndarray, rng: np.random.Generator) -> DirectionMixture:
    """The mixture nearest to weighted cases (in cross entropy), with as many components as they support.

    Their number minimises the Bayesian information criterion; it is increased until two in a row are no better.
    """
    order = np.argsort(weight, kind="stable")[::-1]
    carried = np.cumsum(weight[order])
    used = order[: int(np.searchsorted(carried, _CARRIED * carried[-1])) + 1]
    u, weight = u[used], weight[used] / weight[used].sum()
    distance, direction = polar(u)
    effective = 1.0 / float(weight @ weight)
    best, least, worse = None, math.inf, 0
    for k in range(1, MOST_COMPONENTS + 1):
        fitted, likelihood = _expectation_maximisation(distance, direction, weight, k, rng)
        criterion = k * (u.shape[1] + 2) * math.log(effective) - 2.0 * effective * likelihood
        worse = 0 if criterion < least else worse + 1
        if criterion < least:
            best, least = fitted, criterion
        if worse == 2 or effective < 10 * (k + 1):
            break
    assert best is not None
    return _with_background(best, float(weight @ (distance * distance)))


def _with_background(fitted: DirectionMixture, nu: float) -> DirectionMixture:
    n_inputs = fitted.mean.shape[1]
    return DirectionMixture(
        np.append((1.0 - BACKGROUND) * fitted.share, BACKGROUND),
        np.vstack([fitted.mean, np.eye(1, n_inputs)]),
        np.append(fitted.kappa, 0.0),
        np.append(fitted.nu, max(nu, n_inputs)),
    )


def _expectation_maximisation(
    distance: np.ndarray, direction: np.ndarray, weight: np.ndarray, k: int, rng: np.random.Generator
) -> tuple[DirectionMixture, float]:
    """(mixture of k components, mean logarithm of its density).  Dempster, Laird & Rubin (1977), weighted."""
    member = _first_members(direction, weight, k, rng)
    before = -math.inf
    for _ in range(_STEPS):
        fitted = _maximised(distance, direction, weight, member)
        logs = component_logs(distance, direction, fitted)
        total = _added(logs)
        likelihood = float(weight @ total)
        if likelihood - before < _SETTLED:
            break
        before = likelihood
        member = np.exp(logs - total)
    return fitted, likelihood


def _first_members(direction: np.ndarray, weight: np.ndarray, k: int, rng: np.random.Generator) -> np.ndarray:
    """float64[k, n]: each case with the nearest of k centres, drawn far from one another.

    Arthur & Vassilvitskii, k-means++ (2007).
    """
    centres = direction[[rng.choice(weight.size, p=weight)]]
    while len(centres) < k:
        far = weight * np.maximum(1.0 - (direction @ centres.T).max(axis=1), 1e-12)
        centres = np.vstack([centres, direction[rng.choice(weight.size, p=far / far.sum())]])
    return np.eye(k)[:, (direction @ centres.T).argmax(axis=1)]


def _maximised(distance: np.ndarray, direction: np.ndarray, weight: np.ndarray, member: np.ndarray) -> DirectionMixture:
    """The component parameters of greatest likelihood, given what belongs to which.

    kappa : Banerjee, Dhillon, Ghosh & Sra, J. Machine Learning Research 6 (2005), 1345-1382, eq. (4.4).
    nu : the mean of the squared distance.
    """
    n_inputs = direction.shape[1]
    mass = weight * member
    share = np.maximum(mass.sum(axis=1), 1e-12)
    resultant = mass @ direction / share[:, None]
    length = np.sqrt((resultant * resultant).sum(axis=1))
    mean = np.where(length[:, None] > 0.0, resultant / np.maximum(length, 1e-300)[:, None], np.eye(1, n_inputs))
    short = np.minimum(length, _LONGEST)
    kappa = short * (n_inputs - short * short) / (1.0 - short * short)
    nu = np.maximum(mass @ (distance * distance) / share, n_inputs)
    return DirectionMixture(share / share.sum(), mean, kappa, nu)
