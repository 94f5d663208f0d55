"""Critical trajectories, found by flying: the two of aerobraking, and the roll that keeps a skip inside.

`python -m campaigns.reentry.critical_trajectories` prints those of the campaign files aerobraking.toml and skip.toml.
"""

from collections import namedtuple
from collections.abc import Mapping
from typing import Any

import numpy as np

from campaigns.reentry.planets import PLANETS
from mc_engine import load_campaign
from mc_engine.flight.flight import chosen_cases
from mc_engine.model import load_model

Inputs = Mapping[str, Any]
# altitudes [km] of the vacuum periapsis between which one pass captures
CriticalPeriapses = namedtuple("CriticalPeriapses", "capture entry")


def boundary(inputs: Inputs, name: str, low: float, high: float, width: float, lost: bool = False) -> float:
    """Value of the input `name`, going from low to high, from which on cases leave the atmosphere, in its unit.

    Every round flies 32 cases and keeps the neighbours between which the outcome changes, until they are `width` apart.
    lost : they leave on a hyperbola.  ValueError if a case does so at low, or does not at high
    """
    while high - low > width:
        values = np.linspace(low, high, 32)
        flown = chosen_cases(load_model("campaigns.reentry"), {**inputs, name: values})
        leaves = flown["exits"] > 0
        if lost:
            leaves &= np.isnan(flown["exit_apoapsis_altitude_km"])  # a hyperbola has none
        if leaves[0] or not leaves[-1]:
            raise ValueError(f"{name} from {low:g} to {high:g} has no boundary")
        first = int(np.argmax(leaves))
        low, high = float(values[first - 1]), float(values[first])
    return 0.5 * (low + high)


def interface_km(planet: str) -> float:
    """Altitude [km] at which the planet's exponential atmosphere is as thin as that of the Earth at 120 km."""
    thin = PLANETS["earth"].air[0] * np.exp(-120e3 / PLANETS["earth"].air[1])
    density, scale = PLANETS[planet].air
    return float(1e-3 * scale * np.log(density / thin))


def critical_periapses(inputs: Inputs) -> CriticalPeriapses:
    """Vacuum periapses of the first and the second critical trajectory of an arrival on a hyperbola.

    On the first the vehicle leaves the atmosphere at escape speed: higher, and it is lost.  On the second it just still
    leaves: lower, and it comes down at once.  Looked for from a quarter of the entry altitude up to eleven twelfths;
    that is where the planet's air begins, unless the inputs say another.  Drag only, no gravity but that of the point
    mass.

    Altitudes in km; the source's section on aerobraking, with its eqs (17), (18).
    """
    top = {"entry_altitude_km": interface_km(inputs.get("planet", "earth"))}
    asked = {**top, **inputs, "arrival": "hyperbola", "on_exit": "stop"}
    low_km, high_km = (share * float(asked["entry_altitude_km"]) for share in (1.0 / 4.0, 11.0 / 12.0))
    capture = boundary(asked, "vacuum_periapsis_km", low_km, high_km, 1e-5, lost=True)
    return CriticalPeriapses(capture, boundary(asked, "vacuum_periapsis_km", low_km, capture, 1e-5))


def critical_roll(inputs: Inputs, low_deg: float = 0.1, high_deg: float = 45.0) -> float:
    """Climb angle [deg] of the roll to lift down, above which a skip leaves through its entry altitude all the same."""
    asked = {**inputs, "rolled_bank_deg": 180.0, "on_exit": "stop"}
    return boundary(asked, "roll_flight_path_angle_deg", low_deg, high_deg, 1e-6)


if __name__ == "__main__":
    periapses = critical_periapses(load_campaign("reentry/aerobraking").nominal)
    print(f"aerobraking: capture below {periapses.capture:.3f} km, entry below {periapses.entry:.3f} km")
    print(f"skip: roll to lift down at {critical_roll(load_campaign('reentry/skip').nominal):.4f} deg")
