"""The entry flown twice more by scipy, with nothing of the engine: in an inertial frame, and by Vinh's equations.

Both have their own atmosphere (pressure by layers, as the 1976 standard prints it) and their own altitude over the
ellipsoid (by iteration).
"""

from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from campaigns.reentry.guidance.reference import gravity, rates

MU, RADIUS, J2 = 3.986004418e14, 6_378_137.0, 1.08262668e-3
GRAVITY_RADIUS = 6_378_136.3  # that J2 belongs to
FLATTENING = 1.0 / 298.257223563
OMEGA = 7.292115e-5
R_AIR, G0, R_EARTH = 8314.32 / 28.9644, 9.80665, 6_356_766.0
LAYERS = ((0e3, -6.5), (11e3, 0.0), (20e3, 1.0), (32e3, 2.8), (47e3, 0.0), (51e3, -2.8), (71e3, -2.0), (np.inf, 0.0))
ALOFT = np.array([90.0, 95, 100, 105, 110, 115, 120, 130, 150, 200]) * 1e3
RHO_ALOFT = [3.416e-6, 1.393e-6, 5.604e-7, 2.325e-7, 9.708e-8, 4.289e-8, 2.222e-8, 8.152e-9, 2.076e-9, 2.541e-10]


def standard_density(h):
    """Density [kg/m^3] of the 1976 standard up to 200 km."""
    if h > 86e3:
        nodes = np.array([86e3, *ALOFT])
        return np.exp(np.interp(h, nodes, np.log([standard_density(86e3), *RHO_ALOFT])))
    z = R_EARTH * h / (R_EARTH + h)
    temperature, pressure = 288.15, 101_325.0
    for (base, lapse), (top, _) in pairwise(LAYERS):
        up = min(z, top) - base
        if lapse:
            warmer = temperature + 1e-3 * lapse * up
            pressure *= (temperature / warmer) ** (G0 / (R_AIR * 1e-3 * lapse))
            temperature = warmer
        else:
            pressure *= np.exp(-G0 * up / (R_AIR * temperature))
        if z <= top:
            return pressure / (R_AIR * temperature)
    raise AssertionError("the last layer has no top")


def textbook_density(h):
    """Density [kg/m^3] of the exponential atmosphere."""
    return 1.225 * np.exp(-h / 7200.0)


def altitude(p, z, flattening):
    """Geodetic altitude [m] of a place p [m] from the axis and z [m] from the equator, by iteration."""
    e2 = flattening * (2.0 - flattening)
    phi = np.arctan2(z, p * (1.0 - e2))
    for _ in range(8):
        n = RADIUS / np.sqrt(1.0 - e2 * np.sin(phi) ** 2)
        phi = np.arctan2(z + e2 * n * np.sin(phi), p)
    n = RADIUS / np.sqrt(1.0 - e2 * np.sin(phi) ** 2)
    return p * np.cos(phi) + z * np.sin(phi) - n * (1.0 - e2 * np.sin(phi) ** 2)


class Scenario:
    """What both twins need to know: areas over mass [m^2/kg], bank [rad], density law, planet."""

    def __init__(self, drag, lift, bank, density, turning=True, oblate=True):
        self.drag, self.lift, self.bank, self.density = drag, lift, bank, density
        self.omega = OMEGA if turning else 0.0
        self.flattening, self.j2 = (FLATTENING, J2) if oblate else (0.0, 0.0)


def inertial_rates(t, y, case):
    """Inertial place and velocity; lift turned out of the plane of the radius and the relative velocity."""
    r, v = y[:3], y[3:]
    size = np.sqrt(r @ r)
    q = 1.5 * case.j2 * MU * GRAVITY_RADIUS**2 / size**5
    k = 5.0 * r[2] ** 2 / size**2
    g = -MU / size**3 * r + q * np.array([(k - 1.0) * r[0], (k - 1.0) * r[1], (k - 3.0) * r[2]])
    w = v - case.omega * np.array([-r[1], r[0], 0.0])
    speed = np.sqrt(w @ w)
    rho = case.density(altitude(np.hypot(r[0], r[1]), r[2], case.flattening))
    right = np.cross(w, r)
    right = right / np.sqrt(right @ right)
    above = np.cross(right, w / speed)
    push = 0.5 * rho * speed**2
    lift = case.lift * (np.cos(case.bank) * above + np.sin(case.bank) * right)
    return np.concatenate([v, g + push * (lift - case.drag * w / speed)])


def vinh_rates(t, y, case):
    """Distance, longitude, latitude, speed, path angle and heading, over ground."""
    r, _, latitude, speed, path, heading = y
    h = altitude(r * np.cos(latitude), r * np.sin(latitude), case.flattening)
    push = 0.5 * case.density(h) * speed**2
    g_in, g_north = gravity(r, latitude, MU, case.j2)
    return rates(
        r, latitude, speed, path, heading, push * case.drag, push * case.lift, case.bank, g_in, g_north, case.omega
    )


def to_cartesian(y):
    """Place and velocity over ground in planet-fixed axes, of Vinh's variables."""
    r, longitude, latitude, speed, path, heading = y
    s, c, sl, cl = np.sin(latitude), np.cos(latitude), np.sin(longitude), np.cos(longitude)
    up, north = np.array([c * cl, c * sl, s]), np.array([-s * cl, -s * sl, c])
    east = np.array([-sl, cl, 0.0])
    level = speed * np.cos(path)
    return r * up, level * (np.cos(heading) * north + np.sin(heading) * east) + speed * np.sin(path) * up


def flown(function, start, duration, case):
    """State after `duration` [s]."""
    tight = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-10}
    return solve_ivp(function, (0.0, duration), start, args=(case,), **tight).y[:, -1]


def fly_inertial(start, duration, case):
    """(place, velocity over ground) in planet-fixed axes after a flight from Vinh's variables `start`."""
    r, v = to_cartesian(start)
    end = flown(inertial_rates, [*r, *(v + np.cross([0.0, 0.0, case.omega], r))], duration, case)
    turn = case.omega * duration
    back = np.array([[np.cos(turn), np.sin(turn), 0.0], [-np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])
    r, v = back @ end[:3], back @ end[3:]
    return r, v - np.cross([0.0, 0.0, case.omega], r)


def fly_vinh(start, duration, case):
    """The same by Vinh's equations."""
    return to_cartesian(flown(vinh_rates, start, duration, case))
