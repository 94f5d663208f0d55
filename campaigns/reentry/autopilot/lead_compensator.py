"""Lead compensation by frequency response: gain from the static error, phase lead from the margin asked for.

NumPy, SI; frequencies in rad/s.  `bode_figure` draws the loops of the autopilot.

K. Ogata, Modern Control Engineering, section on lead compensation by the frequency-response approach.
"""

from collections import namedtuple
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import scipy  # loads its packages when they are used

Response = Callable[[Any], Any]  # frequency [rad/s] -> complex gain
FREQUENCIES = np.geomspace(1e-3, 1e4, 4001)
LARGEST_LEAD = np.radians(75.0)  # of one stage
# phase margin [rad] at the highest crossover [rad/s], where the loop's gain falls through 1
Margins = namedtuple("Margins", "phase crossover")


class Compensator(NamedTuple):
    """gain (s + zero) / (s + pole)."""

    gain: float
    zero: float
    pole: float

    def response(self, w: Any) -> Any:
        """Complex gain at a frequency w [rad/s]: gain (j w + zero) / (j w + pole)."""
        return self.gain * (1j * w + self.zero) / (1j * w + self.pole)

    def margins(self, plant: Response) -> Margins:
        """Those of the loop with this plant: phase margin [rad], crossover [rad/s]."""
        return margins_of(lambda w: self.response(w) * plant(w))


def crossover_of(loop: Response, level: float = 1.0) -> float:
    """Highest frequency [rad/s] at which the loop's gain falls through a level."""
    high = np.abs(loop(FREQUENCIES)) > level
    if not high.any() or high[-1]:
        raise ValueError("the gain does not fall through this level between 1e-3 and 1e4 rad/s")
    last = int(np.flatnonzero(high)[-1])
    low, up = np.log(FREQUENCIES)[last : last + 2]
    found = scipy.optimize.brentq(lambda x: np.log(np.abs(loop(np.exp(x))) / level), low, up, xtol=1e-13)
    return float(np.exp(found))


def margins_of(loop: Response) -> Margins:
    """Phase margin and crossover of an open loop; the phase counts from -180 degrees, within half a turn of it."""
    w = crossover_of(loop)
    return Margins(float(np.angle(-loop(w))), w)


def design_lead(plant: Response, gain: float, margin: float) -> Compensator:
    """Lead compensator that keeps the low-frequency gain of `gain` times the plant and has a phase margin [rad].

    The crossover moves up, where the plant may lag more: the lead is changed until the margin is the one asked for.  A
    margin that one stage cannot give is as large as it can.
    """
    wanted = margin - margins_of(lambda w: gain * plant(w)).phase + np.radians(5.0)
    for _ in range(30):
        alpha = ratio_of_lead(min(max(wanted, 1e-3), LARGEST_LEAD))
        lead = stage(gain, alpha, crossover_of(lambda w: gain * plant(w), float(np.sqrt(alpha))))
        short = margin - lead.margins(plant).phase
        if abs(short) <= 1e-6:
            break
        wanted += short
    return lead


def ratio_of_lead(lead: float) -> float:
    """Ratio of zero to pole of the stage with this largest phase lead [rad]."""
    return (1.0 - np.sin(lead)) / (1.0 + np.sin(lead))


def stage(gain: float, alpha: float, w: float) -> Compensator:
    """The compensator with the ratio alpha of zero to pole, its largest lead at w [rad/s]: zero w sqrt(alpha)."""
    root = float(np.sqrt(alpha))
    return Compensator(gain / alpha, w * root, w / root)


def short_period(stiffness: float) -> Response:
    """Angle over angular acceleration [s^2] of an undamped vehicle about its trim: 1 / (s^2 + stiffness)."""
    return lambda w: 1.0 / (stiffness - np.square(w) + 0j)
