"""Whether a metric may be treated as normal: skewness, excess kurtosis and an omnibus test.

With thousands of cases the test finds deviations that do not matter; look at skewness and kurtosis first.  Needs 20
values.
"""

from dataclasses import dataclass
from math import copysign, exp, log, sqrt

import numpy as np

FEWEST = 20


@dataclass(frozen=True)
class Normality:
    """Skewness and kurtosis of a metric, and a test whether both agree with a normal distribution.

    skewness : float, 0 for a normal distribution
    excess_kurtosis : float, 0 for a normal distribution
    p_value : float, of the K^2 test of D'Agostino and Pearson

    >>> Normality(skewness=0.02, excess_kurtosis=-0.05, p_value=0.6).looks_normal
    True
    """

    skewness: float
    excess_kurtosis: float
    p_value: float

    @property
    def looks_normal(self) -> bool:
        """Whether the test does not reject a normal distribution, or skewness and kurtosis are near those of one."""
        return self.p_value >= 0.01 or (abs(self.skewness) < 0.05 and abs(self.excess_kurtosis) < 0.1)


def normality(values: np.ndarray) -> Normality | None:
    """Skewness, kurtosis and omnibus test of normality.

    values : float64[n], finite

    Returns a Normality, or None for n < 20 or (nearly) constant values.

    Raises nothing.

    D'Agostino, Belanger & D'Agostino, Amer. Statist. 44 (1990), 316-321.

    >>> round(normality(np.arange(100.0)).excess_kurtosis, 2)
    -1.2
    """
    n = values.size
    if n < FEWEST:
        return None
    with np.errstate(over="ignore", invalid="ignore"):
        centred = values - values.mean()
        spread = float(np.abs(centred).max())
    if not np.isfinite(spread) or spread <= 1e-13 * float(np.abs(values).max()):
        return None
    centred = centred / spread
    return normality_of(n, *(float(np.mean(centred**power)) for power in (2, 3, 4)))


def normality_of(n: int, m2: float, m3: float, m4: float) -> Normality | None:
    """The `normality` from the second to fourth central moment of n values, in any unit; m2 > 0.  None for n < 20."""
    if n < FEWEST:
        return None
    skewness, kurtosis = m3 / m2**1.5, m4 / m2**2
    k2 = _skewness_z(skewness, n) ** 2 + _kurtosis_z(kurtosis, n) ** 2
    return Normality(skewness, kurtosis - 3.0, exp(-0.5 * k2))


def _skewness_z(skewness: float, n: int) -> float:
    """Standard normal deviate of a sample skewness; eqs. (13)-(15) of the paper."""
    y = skewness * sqrt((n + 1.0) * (n + 3.0) / (6.0 * (n - 2.0)))
    beta = 3.0 * (n * n + 27.0 * n - 70.0) * (n + 1.0) * (n + 3.0)
    beta /= (n - 2.0) * (n + 5.0) * (n + 7.0) * (n + 9.0)
    w2 = sqrt(2.0 * (beta - 1.0)) - 1.0
    ratio = y / sqrt(2.0 / (w2 - 1.0))
    return log(ratio + sqrt(ratio * ratio + 1.0)) / sqrt(0.5 * log(w2))


def _kurtosis_z(kurtosis: float, n: int) -> float:
    """Standard normal deviate of a sample kurtosis (3 for a normal); Anscombe & Glynn, Biometrika 70 (1983), 227."""
    mean = 3.0 * (n - 1.0) / (n + 1.0)
    variance = 24.0 * n * (n - 2.0) * (n - 3.0) / ((n + 1.0) ** 2 * (n + 3.0) * (n + 5.0))
    x = (kurtosis - mean) / sqrt(variance)
    skew = 6.0 * (n * n - 5.0 * n + 2.0) / ((n + 7.0) * (n + 9.0))
    skew *= sqrt(6.0 * (n + 3.0) * (n + 5.0) / (n * (n - 2.0) * (n - 3.0)))
    a = 6.0 + 8.0 / skew * (2.0 / skew + sqrt(1.0 + 4.0 / skew**2))
    cube = (1.0 - 2.0 / a) / (1.0 + x * sqrt(2.0 / (a - 4.0)))
    root = copysign(abs(cube) ** (1.0 / 3.0), cube)
    return (1.0 - 2.0 / (9.0 * a) - root) / sqrt(2.0 / (9.0 * a))
