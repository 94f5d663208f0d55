"""The motion once more, by scipy and with nothing of the engine: potential in spherical coordinates, pyerfa at every
step, pulls of Sun and Moon as plain differences, light, and finite burns."""

import erfa
import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import lpmv

from mc_engine.physics.geopotential import EGM2008, unnormalised

MU, RADIUS = 3.986004415e14, 6_378_136.3
MU_SUN, MU_MOON, AU = 1.32712440041e20, 4.902800e12, 149_597_870_700.0
SIDEREAL_DAY, EXHAUST = 86_164.0905, 1600.0 * 9.80665
RATE = 2.0 * np.pi / SIDEREAL_DAY
R0 = np.cbrt(MU / RATE**2)
JD = 2_400_000.5


def geopotential(r, degree=4):
    """Acceleration of the harmonics from degree 2 on, body-fixed, by the gradient in spherical coordinates."""
    x, y, z = r
    rho, p = np.linalg.norm(r), np.hypot(x, y)
    sine, cosine, longitude = z / rho, p / rho, np.arctan2(y, x)
    up = north = east = 0.0
    for n, m, c, s in EGM2008:
        if n > degree:
            continue
        size = unnormalised(n, m) * MU / rho**2 * (RADIUS / rho) ** n
        legendre = (-1.0) ** m * lpmv(m, n, sine)  # without the Condon-Shortley phase
        following = (-1.0) ** (m + 1) * lpmv(m + 1, n, sine) if m < n else 0.0
        wave = c * np.cos(m * longitude) + s * np.sin(m * longitude)
        up -= (n + 1) * size * legendre * wave
        north += size * (following - m * sine / cosine * legendre) * wave
        east += size * m * legendre / cosine * (s * np.cos(m * longitude) - c * np.sin(m * longitude))
    cl, sl = np.cos(longitude), np.sin(longitude)
    return (
        up * np.array([cosine * cl, cosine * sl, sine])
        + north * np.array([-sine * cl, -sine * sl, cosine])
        + east * np.array([-sl, cl, 0.0])
    )


def sun_moon(mjd_utc):
    """Places of Sun and Moon [m], mean equator and equinox of the date."""
    tt = mjd_utc + (37.0 + 32.184) / 86_400.0  # TAI - UTC since 2017
    turn = erfa.pmat06(JD, tt)
    return turn @ (-AU * erfa.epv00(JD, tt)[0]["p"]), turn @ (AU * erfa.moon98(JD, tt)["p"])


def rotation(angle):
    """Inertial to Earth-fixed axes."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def sidereal(mjd_utc):
    """Greenwich mean sidereal time [rad] by the IAU 1982 series."""
    return float(erfa.gmst82(JD, mjd_utc))


class Twin:
    """One craft; light : C_R A/m [m^2/kg]."""

    def __init__(self, epoch, degree=4, bodies=True, light=0.0):
        self.epoch, self.degree, self.bodies, self.light = epoch, degree, bodies, light
        self.angle = sidereal(epoch)

    def acceleration(self, t, r):
        out = -MU * r / np.linalg.norm(r) ** 3
        if self.degree:
            turn = rotation(self.angle + RATE * t)
            out = out + turn.T @ geopotential(turn @ r, self.degree)
        if self.bodies or self.light:
            sun, moon = sun_moon(self.epoch + t / 86_400.0)
        if self.bodies:
            for body, mu in ((sun, MU_SUN), (moon, MU_MOON)):
                d = body - r
                out = out + mu * (d / np.linalg.norm(d) ** 3 - body / np.linalg.norm(body) ** 3)
        if self.light:
            d = r - sun
            out = out + 4.56e-6 * self.light * AU**2 * self.seen(r, sun) * d / np.linalg.norm(d) ** 3
        return out

    @staticmethod
    def seen(r, sun):
        """Share of the Sun's disc that the Earth leaves, by the lens of two circles."""
        d = sun - r
        a, b = np.arcsin(6.96e8 / np.linalg.norm(d)), np.arcsin(6_378_137.0 / np.linalg.norm(r))
        c = np.arccos(-(r @ d) / np.linalg.norm(r) / np.linalg.norm(d))
        if c >= a + b:
            return 1.0
        if c <= b - a:
            return 0.0
        alpha, beta = np.arccos((c * c + a * a - b * b) / (2 * c * a)), np.arccos((c * c + b * b - a * a) / (2 * c * b))
        lens = a * a * (alpha - 0.5 * np.sin(2 * alpha)) + b * b * (beta - 0.5 * np.sin(2 * beta))
        return 1.0 - lens / (np.pi * a * a)

    def rates(self, t, y, push):
        r, v = y[:3], y[3:6]
        a, flow = self.acceleration(t, r), 0.0
        if push:
            ahead = np.cross(np.cross(r, v), r)
            a, flow = a + push / y[6] * ahead / np.linalg.norm(ahead), -abs(push) / EXHAUST
        return np.array([*v, *a, flow])

    def fly(self, t, y, length, push=0.0, rtol=1e-12):
        """State after an arc [s] under a thrust ahead [N]."""
        tight = {"method": "DOP853", "rtol": rtol, "atol": [1e-6] * 3 + [1e-10] * 3 + [1e-9]}
        return solve_ivp(self.rates, (t, t + length), y, args=(push,), **tight).y[:, -1]


def elements(y):
    """(a, e vector in the equator's plane as a complex number, mean longitude [rad]) of a nearly equatorial orbit."""
    r, v = y[:3], y[3:6]
    rho = np.linalg.norm(r)
    a = 1.0 / (2.0 / rho - v @ v / MU)
    h = np.cross(r, v)
    e = np.cross(v, h) / MU - r / rho
    node = np.array([-h[1], h[0], 0.0])
    node = node / np.linalg.norm(node)
    across = np.cross(h / np.linalg.norm(h), node)
    size = np.linalg.norm(e)
    pericentre = np.arctan2(e @ across, e @ node)
    anomaly = np.arctan2(r @ across, r @ node) - pericentre
    eccentric = 2.0 * np.arctan(np.sqrt((1 - size) / (1 + size)) * np.tan(0.5 * anomaly))
    longitude = np.arctan2(node[1], node[0]) + pericentre
    mean = longitude + eccentric - size * np.sin(eccentric)
    return a, size * np.exp(1j * longitude), mean
