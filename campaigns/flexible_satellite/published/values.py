"""Our values of published numbers that are no metric of a case.

The records name these functions; each returns its value in the unit of the record.
"""

from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd

from campaigns.flexible_satellite.model import MODEL
from mc_engine import load_campaign, tune
from mc_engine.flight.flight import chosen_case, chosen_history

_FOLDER = Path(__file__).resolve().parents[1]
MODULATOR = ("pwpf_gain", "pwpf_time_constant_s", "pwpf_u_off", "pwpf_hysteresis", "thrust_level")
PWPF: dict[str, Any] = {"actuator": "pwpf", "step_s": 0.005}
TABLE_8: dict[str, Any] = PWPF | dict(zip(MODULATOR, (7.39, 0.713, 0.117, 0.225, 1.07), strict=True))


def thruster_torque_n_m() -> float:
    """Torque [N m] of a firing thruster of Table 8; text on the optimised thrusters."""
    return float(np.abs(chosen_history(MODEL, {**TABLE_8, "duration_s": 3.0}, rows=30_000)["torque_z_n_m"]).max())


def shortest_pulse_s() -> float:
    """Shortest pulse [s] of the modulator of Table 8 under a steady command: -T_m ln(1 - h / (K_m T)), eq. (19)."""
    gain, time_constant_s, _, hysteresis, level = (TABLE_8[name] for name in MODULATOR)
    return -time_constant_s * float(np.log1p(-hysteresis / (gain * level)))


def largest_final_rate_rad_s() -> float:
    """Largest body rate [rad/s] about an axis at the end, no actuator; text on the results without actuator."""
    row = chosen_case(MODEL, {"actuator": "ideal"})
    return max(abs(float(row[f"omega_{axis}_rad_s"])) for axis in "xyz")


def oscillation() -> str:
    """The source's words on the modes under Table 8's thrusters, if they are true of every mode from 200 s on.

    True is: 30 changes of sign and more, and a mean below 3 % of the largest value.  The attitude is reached long
    before 200 s.
    """
    history = chosen_history(MODEL, TABLE_8, rows=200_000)  # every step
    modes = [history[f"eta_{mode}"][history["t_s"] > 200.0] for mode in (1, 2, 3, 4)]
    changes = [np.count_nonzero(np.diff(np.sign(mode))) for mode in modes]
    centred = [abs(mode.mean()) < 0.03 * np.abs(mode).max() for mode in modes]
    return "oscillate about zero" if min(changes) >= 30 and all(centred) else "do not"


def optimum(stage: str, parameter: str) -> float:
    """The middle (median) of the tuned parameter on the front of a stage; a parameter that is not tuned is nominal.

    stage : the campaign file with the tuning, such as "stage_1", Tables 2 to 4
    """
    campaign = load_campaign(_FOLDER / f"{stage}.toml")
    assert campaign.tuning is not None
    if parameter not in {tuned.name for tuned in campaign.tuning.parameters}:
        return float(campaign.nominal[parameter])
    return float(_front(stage)[parameter].median())


@lru_cache
def _front(stage: str) -> pd.DataFrame:
    """The front of the tuning of a stage, searched now."""
    with TemporaryDirectory() as folder:
        return tune(load_campaign(_FOLDER / f"{stage}.toml"), Path(folder) / "tuning").front
