"""The air of one day: random density and winds over altitude, frozen for a case.

Each case has its own profile, a function of altitude alone: a vehicle that comes back to an altitude, as in a skip,
meets the same air again.  The profile is drawn before the flight at nodes two kilometres apart and is interpolated
smoothly between them, so that the density keeps a slope.  The lowest node of each case lies at a random depth below
the ground, up to one spacing: extremes of the air lie at nodes, and nodes at the same altitudes in all cases would
show in every distribution of an altitude as a comb.  A profile is named by one number, `weather_draw`: the same number
is the same air, whatever the vehicle, the law or the other errors, and 0 is air without a random part.

Magnitudes are engineering defaults of the class of the Global Reference Atmosphere Models (F. W. Leslie, C. G. Justus,
NASA/TM-2011-216467) and of J. W. Campbell, NASA TM X-3529 (1977).
"""

from collections import namedtuple

import numpy as np
import scipy  # loads its packages when they are used

from mc_engine.lanes import floor, look_up, maximum, minimum, physics

SPACING, NODES, FIELDS = 2e3, 66, 3  # m; up to 128 km; density, wind to the east and to the north
DEPTH = NODES * FIELDS  # index of the depth of the lowest node, in spacings, behind the nodes of a case
LENGTH = DEPTH + 1
# altitude [km] against 1-sigma of the logarithm of the density, of each wind component [m/s], and the mean wind to
# the east [m/s]
_PROFILE = np.array((
    (0.0, 0.01, 5.0, 3.0),
    (11.0, 0.015, 18.0, 22.0),
    (25.0, 0.02, 12.0, 8.0),
    (60.0, 0.05, 35.0, 35.0),
    (80.0, 0.085, 45.0, 20.0),
    (100.0, 0.10, 45.0, 0.0),
))  # fmt: skip
# half of each variance is of the small scale, half of the large one: correlation lengths of first-order Gauss-Markov
# processes [m]
SMALL_SCALE, LARGE_SCALE = 7.5e3, 20e3
BLOCK = 256  # cases drawn at once: their deviates stay in the processor's cache

# value and slope [1/m] of the logarithm of the density over the standard; winds [m/s] and their slopes [1/s]
Weather = namedtuple("Weather", "density density_slope east east_slope north north_slope")


def node_altitudes(depth: np.ndarray) -> np.ndarray:
    """float64[NODES, n] [m] for the depths of the lowest nodes, float64[n] in [0, 1) spacings."""
    return SPACING * (np.arange(NODES)[:, None] - depth)


def standard_profile(column: int, altitudes: np.ndarray) -> np.ndarray:
    """One column of the magnitudes at altitudes [m]; constant above 100 km and below the ground."""
    return np.interp(altitudes, 1e3 * _PROFILE[:, 0], _PROFILE[:, column])


def normal_deviates(draw: np.ndarray, count: int) -> np.ndarray:
    """float64[count, n]: independent standard normal deviates that belong to each number `draw` in [0, 1).

    SplitMix64 counts on from the number: G. L. Steele, D. Lea, C. H. Flood, OOPSLA (2014) 453-472.
    """
    key = (draw * 2.0**53).astype(np.uint64)
    z = (key << np.uint64(11)) + np.arange(1, count + 1, dtype=np.uint64)[:, None] * np.uint64(0x9E3779B97F4A7C15)
    other = np.empty_like(z)  # all in two arrays: more would not stay in the cache
    for shift, multiplier in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        z ^= np.right_shift(z, np.uint64(shift), out=other)
        z *= np.uint64(multiplier)
    z ^= np.right_shift(z, np.uint64(31), out=other)
    z >>= np.uint64(12)
    share = np.add(z, 0.5, out=other.view(np.float64))
    share *= 2.0**-52
    return scipy.special.ndtri(share, out=share)


def gauss_markov(deviates: np.ndarray, length: float) -> np.ndarray:
    """float64[NODES, n] without unit, of variance 1 and correlation exp(-distance / length), from as many deviates."""
    a = np.exp(-SPACING / length)
    out = np.sqrt(1.0 - a * a) * deviates
    out[0] = deviates[0]
    for k in range(1, NODES):
        out[k] += a * out[k - 1]
    return out


def weather_nodes(draw: np.ndarray, density_size, wind_size, mean_size) -> np.ndarray:
    """float64[n, LENGTH]: the profiles of n cases, node after node, its fields side by side, SI, then the depth.

    draw : in [0, 1), 0 for no random part;  density_size, wind_size, mean_size : multiples of the magnitudes above
    """
    sizes = np.where(draw > 0.0, np.sqrt(0.5), 0.0) * np.array([density_size, wind_size, wind_size])
    out = np.empty((draw.size, LENGTH))
    for first in range(0, draw.size, BLOCK):
        block = slice(first, first + BLOCK)
        deviates = normal_deviates(draw[block], 2 * DEPTH + 1)
        depth = np.where(draw[block] > 0.0, scipy.special.ndtr(deviates[-1]), 0.0)
        altitudes, each = node_altitudes(depth), deviates[:-1].reshape(FIELDS, 2, NODES, -1)
        density, wind, mean = (standard_profile(column, altitudes) for column in (1, 2, 3))
        nodes = out[block, :DEPTH].reshape(-1, NODES, FIELDS)  # a view
        for field, profile in enumerate((density, wind, wind)):
            # the sum of the two scales, half of the variance each
            both = gauss_markov(each[field, 0], SMALL_SCALE) + gauss_markov(each[field, 1], LARGE_SCALE)
            nodes[:, :, field] = (sizes[field, block] * both * profile).T
        nodes[:, :, 1] += (np.asarray(mean_size)[block] * mean).T
        out[block, DEPTH] = depth
    return out


@physics
def _between(tables, at, x):
    """(value, slope [1/m]) between two nodes by Hermite's cubic, level in both, in the table's unit."""
    a, b = look_up(tables, at), look_up(tables, at + FIELDS)
    return a + (b - a) * (x * x * (3.0 - 2.0 * x)), (b - a) * (6.0 * x * (1.0 - x)) * (1.0 / SPACING)


@physics
def weather_at(h, first, tables):
    """The `Weather` at altitude h [m] of the case whose nodes begin at place `first` of the tables.

    Below and above its nodes the air is that of the first and the last of them.
    """
    place = minimum(maximum(h * (1.0 / SPACING) + look_up(tables, first + DEPTH), 0.0), NODES - 1.000001)
    node = floor(place)
    x, at = place - node, first + FIELDS * node
    return Weather(*_between(tables, at, x), *_between(tables, at + 1.0, x), *_between(tables, at + 2.0, x))
