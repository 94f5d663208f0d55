"""A selection of many cases, for computations that take too long, or figures that are too crowded, with all of them.

It is not every second or fourth case, because such Sobol' points lie in one half of the range of some inputs.
"""

import numpy as np


def picked_rows(n: int, most: int, seed: int = 0) -> np.ndarray:
    """Rows, int64, ascending: all n, or `most` of them, one at random from each of `most` equal ranges.

    They are even over the case numbers, without a pattern that could coincide with that of a design, and reproducible.
    """
    kept = min(n, most)
    if kept == n:
        return np.arange(n)
    bounds = np.linspace(0, n, kept + 1).astype(np.int64)
    draw = np.random.Generator(np.random.Philox(seed)).random(kept)
    return bounds[:-1] + (draw * np.diff(bounds)).astype(np.int64)
