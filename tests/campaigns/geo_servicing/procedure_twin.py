"""The digest's inspection procedure once more, many runs at a time: point-mass orbits in one plane, impulses, NumPy.

Places and velocities are complex numbers in the plane of both orbits.  Every look, for a decision and for a burn, is a
fix of its own.
"""

import numpy as np
from servicing_twin import MU, R0, RATE, SIDEREAL_DAY

TURN = 2.0 * np.pi
SHORTEST = max(6.0 * 3600.0 / SIDEREAL_DAY, 0.75)  # rev
PLACES = 48  # of a coast, at which the range is looked at


def started(pericentre, e, anomaly, n):
    """n times the state at an anomaly; the pericentre lies on the real axis."""
    parameter, direction = pericentre * (1.0 + e), np.exp(1j * anomaly)
    place = parameter / (1.0 + e * np.cos(anomaly)) * direction
    return np.full(n, place), np.full(n, np.sqrt(MU / parameter) * 1j * (direction + e))


def elements(r, v):
    """(semi-major axis, eccentricity vector, mean longitude)."""
    spin = (r.conjugate() * v).imag
    vector = -1j * v * spin / MU - r / abs(r)
    e, pericentre = abs(vector), np.angle(vector)
    anomaly = np.angle(r) - pericentre
    eccentric = 2.0 * np.arctan2(np.sqrt(1.0 - e) * np.sin(0.5 * anomaly), np.sqrt(1.0 + e) * np.cos(0.5 * anomaly))
    return 1.0 / (2.0 / abs(r) - abs(v) ** 2 / MU), vector, pericentre + eccentric - e * np.sin(eccentric)


def coasted(state, t):
    """State t [s] later, by Kepler's equation."""
    a, vector, mean = elements(*state)
    e, pericentre = abs(vector), np.angle(vector)
    mean = mean + np.sqrt(MU / a**3) * t - pericentre
    eccentric = mean + e * np.sin(mean)
    for _ in range(4):
        eccentric -= (eccentric - e * np.sin(eccentric) - mean) / (1.0 - e * np.cos(eccentric))
    anomaly = 2.0 * np.arctan2(np.sqrt(1.0 + e) * np.sin(0.5 * eccentric), np.sqrt(1.0 - e) * np.cos(0.5 * eccentric))
    direction, parameter = np.exp(1j * (anomaly + pericentre)), a * (1.0 - e * e)
    return parameter / (1.0 + e * np.cos(anomaly)) * direction, np.sqrt(MU / parameter) * 1j * (direction + vector)


def seen(module, target, place, velocity, noise):
    """(mean distance ahead [m], drift [m/rev], phase on the relative ellipse) as a fix with these errors tells them."""
    r, v = module
    outward = r / abs(r)
    r, v = r + place * outward * (noise[0] + 1j * noise[1]), v + velocity * outward * (noise[2] + 1j * noise[3])
    (a, e, mean), (a_t, e_t, mean_t) = elements(r, v), elements(*target)
    ahead = np.angle(np.exp(1j * (mean - mean_t)))
    return R0 * ahead, -1.5 * TURN * R0 * (a - a_t) / a_t, np.angle(r) - np.angle(e - e_t)


def settled_ranges(n, chi1, place=0.0, velocity=0.0, thrust=0.0, pointing=0.0, seed=1):
    """(least, largest) range [m] from day 15 to day 30 of n runs; the nominal place is 39.5 m behind."""
    rng = np.random.default_rng(seed)
    module = started(42_150_260.12, 3.25e-4, np.radians(54.99), n)
    target = started(42_150_933.11, 3.15e-4, np.radians(55.0), n)
    t, least, largest = np.zeros(n), np.full(n, np.inf), np.zeros(n)

    def law(y, v):
        return -(y + (1.0 + chi1) * v) / ((1.0 + 0.005**2) * (1.0 + chi1))

    def look():
        y, v, phase = seen(module, target, place, velocity, rng.normal(size=(4, n)))
        return y + 39.5, v, phase

    while (t < 30.0 * 86_400.0).any():
        y, v, phase = look()
        wait = np.full(n, np.inf)
        for wanted, sign in ((0.0, 1.0), (np.pi, -1.0)):
            share = ((wanted - phase) / TURN) % 1.0
            share = share + np.ceil(np.maximum(SHORTEST - share, 0.0))
            wait = np.where((law(y + v * share, v) * sign > 0.0) & (share < wait), share, wait)
        found = np.isfinite(wait)
        length = SIDEREAL_DAY * np.where(found, wait, 1.0)
        for part in np.arange(1, PLACES + 1) / PLACES:
            distance = abs(coasted(module, part * length)[0] - coasted(target, part * length)[0])
            when = t + part * length
            counts = (when >= 15.0 * 86_400.0) & (when <= 30.0 * 86_400.0)
            least = np.where(counts & (distance < least), distance, least)
            largest = np.maximum(largest, counts * distance)
        module, target, t = coasted(module, length), coasted(target, length), t + length
        y, v, _ = look()
        change = np.where(found, -law(y, v) * RATE / (3.0 * TURN), 0.0) * (1.0 + thrust * rng.normal(size=n))
        ahead = 1j * module[0] / abs(module[0]) * np.exp(1j * pointing * rng.normal(size=n))
        module = module[0], module[1] + change * ahead
    return least, largest
