"""Short ways to fly the de-orbit campaign: inputs and results by column name, in declared units."""

import numpy as np

from mc_engine.flight.flight import fly, fly_history
from mc_engine.model import load_model

MODEL = load_model("campaigns.deorbit")
NOMINAL = {item.name: item.default for item in (*MODEL.parameters, *MODEL.settings)}
SEED = 20160421
DEMONSTRATION = {"ve_pct": -20.0, "oe_pct": 10.0}  # Table 3 of the source, solved for the errors
PULSED = DEMONSTRATION | {"control": "pulsed"}


def fly_cases(**inputs):
    """Columns of as many cases as the longest input has values."""
    n_cases = max((np.size(value) for value in inputs.values()), default=1)
    return fly(MODEL, NOMINAL | inputs, np.arange(n_cases), SEED)


def fly_one(**inputs):
    """The row of one case: a number or a word by column name."""
    return {name: column[0] for name, column in fly_cases(**inputs).items()}


def fly_grid(ve_pct, oe_pct):
    """Columns of all pairs of these errors of the burn, `ve_pct` and `oe_pct` of each pair among them."""
    ve, oe = (axis.ravel() for axis in np.meshgrid(ve_pct, oe_pct, indexing="ij"))
    return {"ve_pct": ve, "oe_pct": oe} | fly_cases(ve_pct=ve, oe_pct=oe)


def history(rows=3000, **inputs):
    """Quantities along the flight of one case: every step, up to 3000 steps."""
    return fly_history(MODEL, NOMINAL | inputs, 0, SEED, rows=rows)[1]


def pulses(step_s, **inputs):
    """(starts, widths) [s] of the pulses, from the force history of a flight in steps of step_s."""
    seen = history(rows=1_000_000, step_s=step_s, time_limit_s=800.0, **inputs)
    firing = np.concatenate([[False], seen["force_n"] > 0.0, [False]])
    turns = np.flatnonzero(firing[1:] != firing[:-1])
    starts, ends = seen["t_s"][turns[::2]], seen["t_s"][np.minimum(turns[1::2], len(seen["t_s"]) - 1)]
    return starts, ends - starts


def table_2_entry():
    """Entry state at 6491 km on the ellipse of Table 2: a 6431.5 km, e 0.0361, omega 166.8 deg."""
    mu, r = 3.986004418e14, 6491e3
    a, e, omega = 6431.5e3, 0.0361, 166.8
    p = a * (1.0 - e * e)
    f = 2.0 * np.pi - np.arccos((p / r - 1.0) / e)
    climb, ahead = np.sqrt(mu / p) * e * np.sin(f), np.sqrt(mu * p) / r
    return {
        "target_speed_m_s": np.hypot(climb, ahead),
        "target_flight_path_angle_deg": np.degrees(np.arctan2(-climb, ahead)),
        "target_latitude_argument_deg": np.degrees(f) + omega - 360.0,
    }
