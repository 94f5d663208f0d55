"""Design of the attitude autopilot, once for all cases: where it flies, and its gains over the dynamic pressure.

The tables hold the last second of the profile, the compensator of the bank loop, those of the pitch loop at equal steps
of dynamic pressure, and the profile: dynamic pressure and speed of the planned entry second by second.  NumPy, SI.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from campaigns.reentry.autopilot.lead_compensator import Compensator, Response, design_lead, short_period
from campaigns.reentry.guidance.plan import plan_of
from campaigns.reentry.guidance.reference import SPEED, fly_reference

STEPS, STEEPEST = 48, 24e3  # compensators of the pitch loop, up to this pressure [Pa]
LAST_SECOND, BANK, PITCH = 0, 1, 4  # where the tables have what
PROFILE = PITCH + 3 * STEPS


def pitch_design(o: Mapping[str, float], pressure: float) -> tuple[Response, float, Compensator]:
    """(plant, gain, lead compensator) of the pitch loop at a dynamic pressure [Pa]; o: settings by symbol.

    The plant is undamped: angle over angular acceleration.  The gain makes the loop stiffer than the air by the square
    of the bandwidth asked for, and as stiff again: a moment moves the angle half as far as without an autopilot.
    """
    stiffness = -pressure * o["area"] * o["diameter"] * o["c_m_alpha"] / o["inertia_pitch"]
    plant, gain = short_period(stiffness), o["bandwidth"] ** 2 + stiffness
    return plant, gain, design_lead(plant, gain, o["phase_margin"])


def bank_design(o: Mapping[str, float]) -> Compensator:
    """Lead compensator of the bank loop, whose plant is the double integrator 1/s^2 [s^2]."""
    return design_lead(short_period(0.0), o["bandwidth"] ** 2, o["phase_margin"])


def planned_profile() -> np.ndarray:
    """float64[n, 2]: dynamic pressure [Pa] and speed [m/s] of the planned entry at whole seconds."""
    plan = plan_of()
    path = fly_reference(plan)
    t = np.arange(0.0, path.t[-1])
    return np.array([np.interp(t, path.t, path.drag) / plan.drag, np.interp(t, path.t, path.state[SPEED])]).T


def autopilot_tables(o: Any) -> np.ndarray:
    """What the autopilot's flight reads, for its settings o, SI."""
    numbers = o._asdict()
    pressures = np.linspace(0.0, STEEPEST, STEPS) if o.scheduled > 0.5 else np.full(STEPS, o.fixed_pressure)
    leads = [bank_design(numbers), *(pitch_design(numbers, pressure)[2] for pressure in pressures)]
    profile = planned_profile()
    return np.concatenate([[len(profile) - 1], np.ravel(leads), np.ravel(profile)])
