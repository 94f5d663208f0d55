"""Coasts in closed form: Kepler's motion of a place and velocity, and of the primer vector with them.  mu = 1.

On a coast the primer vector obeys the equation of a neighbouring orbit, so it is the derivative of Kepler's motion in
the direction of its start.  That derivative is taken by a step along the imaginary axis, which cancels nothing and is
exact to rounding: J. R. R. A. Martins et al., ACM Transactions on Mathematical Software 29 (2003) 245-262.
"""

import numpy as np

IMAGINARY = 1e-40  # step along the imaginary axis: its square vanishes beside one


def kepler(r: np.ndarray, v: np.ndarray, dt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(place, velocity) a time dt after r, v [n, 3] on an ellipse; complex numbers carry a derivative.

    The source's eqs (20), (21), with the difference x of the eccentric anomalies as unknown, so that circles need no
    perigee: sqrt(1/a^3) dt = x - (1 - r/a) sin x + (r.v / sqrt a)(1 - cos x).  Battin, An Introduction to the
    Mathematics and Methods of Astrodynamics (1999), section 4.4.  Not a number on a parabola or hyperbola.
    """
    r0 = np.sqrt((r * r).sum(-1))
    a = 1.0 / (2.0 / r0 - (v * v).sum(-1))
    root = np.sqrt(np.where(a.real > 0.0, a, np.nan))
    cosine, sine = 1.0 - r0 / a, (r * v).sum(-1) / root  # e cos E, e sin E at the start
    m = dt / (a * root)
    x = _anomaly_difference(m.real, cosine.real, sine.real) + 0.0 * m
    for _ in range(2):  # the first of them gives the derivative, the second the last digit
        f = x - cosine * np.sin(x) + sine * (1.0 - np.cos(x)) - m
        x = x - f / (1.0 - cosine * np.cos(x) + sine * np.sin(x))
    c, s = np.cos(x), np.sin(x)
    f = 1.0 - a / r0 * (1.0 - c)
    g = dt - a * root * (x - s)
    place = f[..., None] * r + g[..., None] * v
    r1 = np.sqrt((place * place).sum(-1))
    f_rate = -root * s / (r0 * r1)
    g_rate = 1.0 - a / r1 * (1.0 - c)
    return place, f_rate[..., None] * r + g_rate[..., None] * v


def _anomaly_difference(m: np.ndarray, cosine: np.ndarray, sine: np.ndarray) -> np.ndarray:
    """Real x of x - cosine sin x + sine (1 - cos x) = m: Newton's steps inside a bracket, which closes; eq. (21).

    Each row stops by itself, so that no case depends on the ones beside it.
    """
    e = np.hypot(cosine, sine)
    low, high = m - 2.0 * e, m + 2.0 * e
    x = m + 0.0 * e
    moving = np.full(x.shape, True)
    for _ in range(60):
        f = x - cosine * np.sin(x) + sine * (1.0 - np.cos(x)) - m
        low, high = np.where(f < 0.0, x, low), np.where(f < 0.0, high, x)
        better = x - f / (1.0 - cosine * np.cos(x) + sine * np.sin(x))
        inside = (better >= low) & (better <= high)
        x, before = np.where(moving, np.where(inside, better, 0.5 * (low + high)), x), x
        moving &= np.abs(x - before) > 1e-15 * (1.0 + np.abs(x))
        if not moving.any():
            break
    return x


def coast(y: np.ndarray, dt: np.ndarray) -> np.ndarray:
    """States [n, 12] (place, velocity, primer vector, its rate), canonical, dt after y, [n, 12] or [12]: (19)-(21)."""
    start = y[..., :6] + 1j * IMAGINARY * y[..., 6:]
    end = np.concatenate(kepler(start[..., :3], start[..., 3:], dt), axis=-1)
    return np.concatenate([end.real, end.imag / IMAGINARY], axis=-1)
