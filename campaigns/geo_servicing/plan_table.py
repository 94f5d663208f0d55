"""Layout of a phasing plan in the tables of the model: the number of corrections, then a row for each.

The rows of the gravity harmonics follow.
"""

import numpy as np

from mc_engine.lanes import look_up, physics

BURNS = 5  # corrections that a plan may have
# of a row: ignition [s], velocity change [m/s]; mean longitude deviation [rad] and drift [rad/rev] that the plan has
# at ignition; gains by which the correction [rad/rev] answers deviations from them
ROW = 6
IGNITION, DV, LONGITUDE, DRIFT, GAIN_Y, GAIN_V = (float(i) for i in range(ROW))
LENGTH = 1.0 + ROW * BURNS


@physics
def corrections(tables):
    """Number of corrections of the plan."""
    return look_up(tables, 0.0)


@physics
def planned(tables, burn, column):
    """A column of the row of one correction, counted from 0; an index past the last row reads the last row."""
    return look_up(tables, 1.0 + ROW * burn + column)


def no_plan() -> np.ndarray:
    """The table of a flight without corrections."""
    return np.zeros(int(LENGTH))


def plan_rows(ignition, dv, longitude, drift, gains) -> np.ndarray:
    """The table of a plan; all arguments float64[n], gains float64[n, 2]."""
    out = no_plan()
    n = len(dv)
    out[0] = n
    out[1 : 1 + ROW * n] = np.column_stack([ignition, dv, longitude, drift, gains]).ravel()
    return out
