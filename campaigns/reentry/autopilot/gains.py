"""Design of the attitude autopilot, once for all cases: where it flies, and its gains over the dynamic pressure.

The tables hold the dynamic pressure and the speed of the planned entry second by second, the lead compensators of the
pitch loop at equal steps of dynamic pressure, and the one of the bank loop.  NumPy, SI.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from campaigns.reentry.autopilot.lead_compensator import Lead, Response, design_lead, short_period
from campaigns.reentry.guidance.plan import default_plan
from campaigns.reentry.guidance.reference import Planner, fly_reference

SECONDS, STEPS, STEEPEST = 900, 48, 24e3  # rows of the profile; rows of the schedule, up to this pressure [Pa]
# header: last second of the profile; gain, zero and pole of the bank loop
LAST_SECOND, BANK_GAIN, BANK_ZERO, BANK_POLE = range(4)
PROFILE = 4
SCHEDULE = PROFILE + 2 * SECONDS
LENGTH = SCHEDULE + 3 * STEPS


def pitch_design(o: Mapping[str, float], pressure: float) -> tuple[Response, float, Lead]:
    """(plant, gain, lead compensator) of the pitch loop at a dynamic pressure [Pa]; o: settings by symbol.

    The plant is undamped: angle over angular acceleration.  The gain makes the loop stiffer than the air by the square
    of the bandwidth asked for, and as stiff again: a moment moves the angle half as far as without an autopilot.
    """
    stiffness = -pressure * o["area"] * o["diameter"] * o["c_m_alpha"] / o["inertia_pitch"]
    plant, gain = short_period(stiffness), o["bandwidth"] ** 2 + stiffness
    return plant, gain, design_lead(plant, gain, o["phase_margin"])


def bank_design(o: Mapping[str, float]) -> Lead:
    """Lead compensator of the bank loop, whose plant is the double integrator 1/s^2 [s^2]."""
    return design_lead(short_period(0.0), o["bandwidth"] ** 2, o["phase_margin"])


def planned_profile() -> np.ndarray:
    """float64[n, 2]: dynamic pressure [Pa] and speed [m/s] of the planned entry at whole seconds."""
    planner = Planner(default_plan())
    path = fly_reference(planner)
    t = np.arange(0.0, path.t[-1])
    return np.array([np.interp(t, path.t, path.drag) / planner.plan.drag, np.interp(t, path.t, path.speed)]).T


def autopilot_tables(o: Any) -> np.ndarray:
    """What the autopilot's flight reads, for its settings o, SI."""
    numbers = o._asdict()
    out = np.zeros(LENGTH)
    profile = planned_profile()[:SECONDS]
    out[LAST_SECOND] = len(profile) - 1
    bank = bank_design(numbers)
    out[[BANK_GAIN, BANK_ZERO, BANK_POLE]] = bank.gain, bank.zero, bank.pole
    padded = np.vstack([profile, np.repeat(profile[-1:], SECONDS - len(profile), axis=0)])
    out[PROFILE:SCHEDULE] = padded.ravel()
    for k, pressure in enumerate(np.linspace(0.0, STEEPEST, STEPS)):
        lead = pitch_design(numbers, pressure if o.scheduled > 0.5 else o.fixed_pressure)[2]
        out[SCHEDULE + 3 * k : SCHEDULE + 3 * k + 3] = lead.gain, lead.zero, lead.pole
    return out
