"""Reference flights: extrapolated midpoint steps in 80-bit numbers, all cases of an array at once.

Far slower and far more exact than anything measured against it: with 64 bits of mantissa its error is below 1e-15
of the state.  Where NumPy's `longdouble` is no longer than a double (Windows, Apple) the last digits are missing.

W. Gragg, SIAM Journal on Numerical Analysis 2 (1965) 384-403;  R. Bulirsch, J. Stoer, Numerische Mathematik 8 (1966)
1-13.
"""

from collections.abc import Callable

import numpy as np

Real = np.longdouble
Rate = Callable[[np.ndarray, np.ndarray], np.ndarray]  # (t[n], state[n_states, n]) -> derivative[n_states, n]

# steps inside one great step: Bulirsch's sequence, whose extrapolation does not amplify rounding; order 18
_PARTS = (2, 4, 6, 8, 12, 16, 24, 32, 48)


def great_step(rate: Rate, t: np.ndarray, s: np.ndarray, h: np.ndarray) -> np.ndarray:
    """State after a step of length h[n] from s[n_states, n] at t[n], by polynomial extrapolation."""
    table: list[np.ndarray] = []
    first = rate(t, s)
    for row, parts in enumerate(_PARTS):
        length = h / Real(parts)
        before, now = s, s + length * first
        for i in range(1, parts):
            before, now = now, before + 2 * length * rate(t + i * length, now)
        estimate = (before + now + length * rate(t + h, now)) / 2
        for column in range(row):
            quotient = (Real(parts) / Real(_PARTS[row - 1 - column])) ** 2
            table[column], estimate = estimate, estimate + (estimate - table[column]) / (quotient - 1)
        table.append(estimate)
    return table[-1]


def flown(rate: Rate, s: np.ndarray, duration: float, steps: int) -> np.ndarray:
    """State after `duration` [s] in so many great steps."""
    s = s.astype(Real)
    h = np.full(s.shape[1], Real(duration) / steps)
    for i in range(steps):
        s = great_step(rate, i * h, s, h)
    return s


def flown_to(
    rate: Rate, s: np.ndarray, height: Callable[[np.ndarray], np.ndarray], step: float
) -> tuple[np.ndarray, np.ndarray]:
    """(time[n], state) of the first fall of `height` through zero; great steps of `step` [s] until then."""
    s = s.astype(Real)
    t, h = np.zeros(s.shape[1], Real), np.full(s.shape[1], Real(step))
    while True:
        end = great_step(rate, t, s, h)
        above = height(end) > 0
        if not above.any():
            break
        t, s = np.where(above, t + h, t), np.where(above, end, s)
    low, high = np.zeros_like(h), h
    at_low, at_high = height(s), height(end)
    for _ in range(40):  # regula falsi with halving at a side that stays (Illinois rule)
        look = low + (high - low) * at_low / (at_low - at_high)
        end = great_step(rate, t, s, look)
        value = height(end)
        if (abs(value) <= 4 * np.finfo(Real).eps * abs(end[0])).all():
            break
        back = value <= 0
        low, at_low = np.where(back, low, look), np.where(back, at_low / 2, value)
        high, at_high = np.where(back, look, high), np.where(back, value, at_high / 2)
    return t + look, end
