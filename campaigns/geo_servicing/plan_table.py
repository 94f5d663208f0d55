"""Layout of a phasing plan in the model's tables: number of corrections, a row for each; the harmonics follow."""

from collections import namedtuple

import numpy as np

from mc_engine.lanes import look_up, look_up_record, physics

BURNS = 5  # corrections that a plan may have
# ignition [s], velocity change [m/s]; mean longitude deviation [rad] and drift [rad/rev] that the plan has at ignition;
# gains by which the correction [rad/rev] answers deviations from them
Row = namedtuple("Row", "ignition dv longitude drift gain_y gain_v")
_WIDTH = len(Row._fields)
LENGTH = 1 + _WIDTH * BURNS


@physics
def corrections(tables):
    """Number of corrections of the plan."""
    return look_up(tables, 0.0)


@physics
def planned(tables, burn):
    """The row of one correction, counted from 0."""
    return look_up_record(tables, 1.0 + _WIDTH * burn, Row)


def plan_rows(rows: Row) -> np.ndarray:
    """The table of a plan, of all its corrections in one Row of float64[n]."""
    written = np.append(len(rows.dv), np.column_stack(rows).ravel())
    return np.pad(written, (0, LENGTH - len(written)))


def end_of(plan: np.ndarray, mass_per_thrust: float) -> float:
    """End of the last burn [s], a little late: for the mass at the start; mass_per_thrust : [kg/N]."""
    last = 1 + _WIDTH * (int(plan[0]) - 1)
    return float(plan[last] + mass_per_thrust * abs(plan[last + 1]))
