"""Our values of published numbers that are no metric of a case.

S. Divsalar, R. Nadafi, M. Kabganian, Electronics Industries Quarterly 7(1), 2016.  `published.toml` names these
functions; each returns its value in the unit of the record.
"""

from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from campaigns.deorbit.model import MODEL
from mc_engine.flight.flight import chosen_case, chosen_history
from mc_engine.physics.constants import MU_EARTH

DEMONSTRATION: dict[str, Any] = {"ve_pct": -20.0, "oe_pct": 10.0}  # Table 3, solved for the errors of the burn
PULSED: dict[str, Any] = DEMONSTRATION | {"control": "pulsed"}
NOMINAL = SimpleNamespace(**{item.name: item.default for item in MODEL.parameters})


def settling_time_s(remainder_pct: float) -> float:
    """Time [s] after which the errors of a, e and ω stay below a share [%] of the first ones; conclusion of Fig. 9."""
    history = chosen_history(MODEL, DEMONSTRATION, rows=3000)
    time, remainder = history["t_s"], history["unsettled_pct"]
    last = int(np.flatnonzero(remainder > remainder_pct)[-1])
    return float(np.interp(-remainder_pct, -remainder[last : last + 2], time[last : last + 2]))


def normal_force() -> str | float:
    """The largest force along the orbit normal [N], "zero" below 1e-9 N; text on Figs 6 and 7."""
    largest = float(np.abs(chosen_history(MODEL, DEMONSTRATION, rows=3000)["force_normal_n"]).max())
    return "zero" if largest < 1e-9 else largest


def pulse_width_s(number: int) -> float:
    """Width [s] of a pulse, counted from 1; caption of Fig. 8."""
    return float(pulses()[1][number - 1])


@lru_cache
def pulses() -> tuple[np.ndarray, np.ndarray]:
    """(starts, widths) [s] of the pulses, from the force history of a flight in steps of 2 ms."""
    history = chosen_history(MODEL, PULSED | {"step_s": 0.002, "time_limit_s": 800.0}, rows=1_000_000)
    time, firing = history["t_s"], np.concatenate([[False], history["force_n"] > 0.0, [False]])
    turns = np.flatnonzero(firing[1:] != firing[:-1])
    starts, ends = time[turns[::2]], time[np.minimum(turns[1::2], len(time) - 1)]
    return starts, ends - starts


def perigee_argument_from_rounded_path_deg() -> float:
    """ω [deg] after the burn of Table 3 from the path whose elements are rounded as in Table 2."""
    return float(chosen_case(MODEL, rounded_entry() | DEMONSTRATION)["actual_perigee_argument_deg"])


def rounded_entry() -> dict[str, float]:
    """Entry state at 6491 km on the ellipse of Table 2, a 6431.5 km, e 0.0361, ω 166.8 deg: inputs of the model.

    Speed and flight-path angle of a conic: Curtis, Orbital Mechanics, 3rd ed., eqs (2.31), (2.45), (2.49).
    """
    radius, a, e, omega_deg = 6491e3, 6431.5e3, 0.0361, 166.8
    p = a * (1.0 - e * e)
    anomaly = 2.0 * np.pi - np.arccos((p / radius - 1.0) / e)
    radial = np.sqrt(MU_EARTH / p) * e * np.sin(anomaly)
    transverse = np.sqrt(MU_EARTH * p) / radius
    return {
        "target_speed_m_s": float(np.hypot(radial, transverse)),
        "target_flight_path_angle_deg": float(np.degrees(np.arctan2(-radial, transverse))),
        "target_latitude_argument_deg": float(np.degrees(anomaly) + omega_deg - 360.0),
    }


def entry_state() -> str:
    """Speed [km/s], angle below the horizon [deg], radius [km] and place [deg] at entry that the campaign assumes."""
    i = NOMINAL
    place = f"{i.target_radius_km:g} km, {i.target_latitude_argument_deg:g}°"
    return f"{i.target_speed_m_s / 1e3:g} km/s, {i.target_flight_path_angle_deg:g}°, {place}"


def modulator() -> str:
    """Gains, time constant and levels of the modulator that the campaign assumes."""
    i = NOMINAL
    gains = f"{i.modulator_input_gain:g}, {i.modulator_feedback_gain:g}, {i.modulator_time_constant_s:g} s"
    return f"{gains}, {i.modulator_on_n:g} N, {i.modulator_off_n:g} N"
