"""Gravity of a body of arbitrary shape: spherical harmonics to any degree and order, in body-fixed axes.

The coefficients of the Earth are those of EGM2008 to degree 8: at the geostationary radius degrees 5 to 8 together
are up to 3e-10 m/s^2, and degree 8 alone is below 1e-12 m/s^2.  In compiled flights degree and order are settings.
The coefficients are in the model's tables, so one kernel serves all degrees and orders.
"""

from math import factorial

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.lanes import look_up, physics, sqrt

# N. K. Pavlis, S. A. Holmes, S. C. Kenyon, J. K. Factor, Journal of Geophysical Research 117 (2012) B04406: EGM2008,
# tide-free, with its gravitational parameter [m^3/s^2] and radius [m].
MU_EGM2008, RADIUS_EGM2008 = 3.986004415e14, 6_378_136.3
LARGEST_DEGREE = 8
# degree, order, fully normalised C and S
EGM2008 = (
    (2, 0, -4.84165143790815e-4, 0.0),
    (2, 1, -2.06615509074176e-10, 1.38441389137979e-9),
    (2, 2, 2.43938357328313e-6, -1.40027370385934e-6),
    (3, 0, 9.57161207093473e-7, 0.0),
    (3, 1, 2.03046201047864e-6, 2.48200415856872e-7),
    (3, 2, 9.04787894809528e-7, -6.19005475177618e-7),
    (3, 3, 7.21321757121568e-7, 1.41434926192941e-6),
    (4, 0, 5.39965866638991e-7, 0.0),
    (4, 1, -5.36157389388867e-7, -4.73567346518086e-7),
    (4, 2, 3.50501623962649e-7, 6.62480026275829e-7),
    (4, 3, 9.90856766672321e-7, -2.00956723567452e-7),
    (4, 4, -1.88519633023033e-7, 3.08803882149194e-7),
    (5, 0, 6.86702913736681e-8, 0.0),
    (5, 1, -6.29211923042529e-8, -9.43698073395769e-8),
    (5, 2, 6.52078043176164e-7, -3.23353192540522e-7),
    (5, 3, -4.51847152328843e-7, -2.14955408306046e-7),
    (5, 4, -2.95328761175629e-7, 4.98070550102351e-8),
    (5, 5, 1.74811795496002e-7, -6.69379935180165e-7),
    (6, 0, -1.49953927978527e-7, 0.0),
    (6, 1, -7.59210081892527e-8, 2.65122593213647e-8),
    (6, 2, 4.86488924604690e-8, -3.73789324523752e-7),
    (6, 3, 5.72451611175653e-8, 8.95201130010730e-9),
    (6, 4, -8.60237937191611e-8, -4.71425573429095e-7),
    (6, 5, -2.67166423703038e-7, -5.36493151500206e-7),
    (6, 6, 9.47068749756882e-9, -2.37382353351005e-7),
    (7, 0, 9.05120844521618e-8, 0.0),
    (7, 1, 2.80887555776673e-7, 9.51259362869275e-8),
    (7, 2, 3.30407993702235e-7, 9.29969290624092e-8),
    (7, 3, 2.50458409225729e-7, -2.17118287729610e-7),
    (7, 4, -2.74993935591631e-7, -1.24058403514343e-7),
    (7, 5, 1.64773255934658e-9, 1.79281782751438e-8),
    (7, 6, -3.58798423464889e-7, 1.51798257443669e-7),
    (7, 7, 1.50746472872675e-9, 2.41068767286303e-8),
    (8, 0, 4.94756003005199e-8, 0.0),
    (8, 1, 2.31607991248329e-8, 5.88974540927606e-8),
    (8, 2, 8.00143604736599e-8, 6.52805043667369e-8),
    (8, 3, -1.93745381715290e-8, -8.59639339125694e-8),
    (8, 4, -2.44360480007096e-7, 6.98072508472777e-8),
    (8, 5, -2.57011477267991e-8, 8.92034891745881e-8),
    (8, 6, -6.59648680031408e-8, 3.08946730783065e-7),
    (8, 7, 6.72569751771483e-8, 7.48686063738231e-8),
    (8, 8, -1.24022771917136e-7, 1.20551889384997e-7),
)
COLUMNS = 8  # of a row of the table, see `harmonics_table`


def unnormalised(n: int, m: int) -> float:
    """Factor from a fully normalised coefficient to the plain one.  Montenbruck, Gill, Satellite Orbits, eq. (3.13)."""
    return float(np.sqrt((1.0 if m == 0 else 2.0) * (2 * n + 1) * factorial(n - m) / factorial(n + m)))


def harmonics_table(degree: int, order: int) -> np.ndarray:
    """The table that `harmonics` reads: float64[n_rows, COLUMNS], column after column of the functions V and W.

    The row of degree i and order j has the four factors of V and W in the acceleration along x and y, the two factors
    along z, and both factors of the recursion.  Terms of orders above `order` are left out.  Raises ModelError for a
    degree above `LARGEST_DEGREE`.
    """
    if degree > LARGEST_DEGREE:
        raise ModelError(f"harmonics of degree {degree}: the coefficients at hand end at degree {LARGEST_DEGREE}")
    c, s = np.zeros((degree + 3, degree + 3)), np.zeros((degree + 3, degree + 3))
    for n, m, normal_c, normal_s in EGM2008:
        if n <= degree and m <= order:
            c[n, m], s[n, m] = unnormalised(n, m) * normal_c, unnormalised(n, m) * normal_s
    return np.array([_harmonics_row(c, s, i, j) for j in range(order + 2) for i in range(j, degree + 2)])


def harmonics_rows(degree: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Number of rows of `harmonics_table`."""
    return (order + 2) * (degree + 2) - (order + 1) * (order + 2) / 2


def _harmonics_row(c: np.ndarray, s: np.ndarray, i: int, j: int) -> list[float]:
    """Montenbruck, Gill, Satellite Orbits, eqs (3.30) and (3.33), collected by V and W of degree i and order j."""
    n = i - 1
    above = below = (0.0, 0.0)  # coefficients one order above and below, with their weights
    along = (0.0, 0.0)
    if n >= 2:
        if j >= 1:
            weight = 1.0 if j == 1 else 0.5
            below = (weight * c[n, j - 1], weight * s[n, j - 1])
        if j <= n:
            along = (-(n - j + 1) * c[n, j], -(n - j + 1) * s[n, j])
        if j + 1 <= n:
            weight = 0.5 * (n - j + 1) * (n - j)
            above = (weight * c[n, j + 1], weight * s[n, j + 1])
    up, across = (2 * i + 1) / (i + 1 - j), (i + j) / (i + 1 - j)  # to the degree i + 1
    return [
        above[0] - below[0], above[1] - below[1], above[1] + below[1], -above[0] - below[0], *along, up, across
    ]  # fmt: skip


@physics
def harmonics(x, y, z, mu, radius, degree, order, tables, first):
    """Acceleration [m/s^2] at (x, y, z) [m] of the harmonics from degree 2 on, to be added to `point_mass`.

    Body-fixed axes.  degree, order : whole numbers as floats, 2 or more and 0 or more; tables, first : the tables, and
    the index at which the rows of `harmonics_table(degree, order)` begin.  Cunningham's recursion, column by column, so
    that no array is needed: Montenbruck, Gill, Satellite Orbits, eqs (3.29)-(3.33).
    """
    r2 = x * x + y * y + z * z
    inverse2 = 1.0 / r2
    sx, sy, sz = x * radius * inverse2, y * radius * inverse2, z * radius * inverse2
    s2 = radius * radius * inverse2
    ax = ay = az = 0.0
    v_sector, w_sector = radius * sqrt(r2) * inverse2, 0.0
    at, last = int(first), int(degree) + 2  # integers: the processor reckons with them beside the lanes
    for j in range(int(order) + 2):
        v, w, v_before, w_before = v_sector, w_sector, 0.0, 0.0
        for _ in range(j, last):
            ax = ax + (look_up(tables, at) * v + look_up(tables, at + 1) * w)
            ay = ay + (look_up(tables, at + 2) * v + look_up(tables, at + 3) * w)
            az = az + (look_up(tables, at + 4) * v + look_up(tables, at + 5) * w)
            up, across = look_up(tables, at + 6) * sz, look_up(tables, at + 7) * s2
            v, v_before = up * v - across * v_before, v
            w, w_before = up * w - across * w_before, w
            at = at + COLUMNS
        k = 2.0 * j + 1.0
        v_sector, w_sector = k * (sx * v_sector - sy * w_sector), k * (sx * w_sector + sy * v_sector)
    scale = mu / (radius * radius)
    return scale * ax, scale * ay, scale * az
