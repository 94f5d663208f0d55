"""Some of many cases, where all of them would take too long, or would not be told apart in a figure.

Never every second or fourth one: those of Sobol' points lie in one half of the range of some inputs.
"""

import numpy as np


def picked_rows(n: int, most: int, seed: int = 0) -> np.ndarray:
    """Rows, int64, ascending: all of n, or `most` of them, of equal stretches one each that is drawn at random.

    Even over the case numbers, and without a pattern that could meet that of a design; the same rows each time.
    """
    kept = min(n, most)
    if kept == n:
        return np.arange(n)
    bounds = np.linspace(0, n, kept + 1).astype(np.int64)
    draw = np.random.Generator(np.random.Philox(seed)).random(kept)
    return bounds[:-1] + (draw * np.diff(bounds)).astype(np.int64)
