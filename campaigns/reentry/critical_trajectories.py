"""Critical trajectories, found by flying: the two of aerobraking, and the roll that keeps a skip inside.

    python -m campaigns.reentry.critical_trajectories

prints those of the campaign files aerobraking.toml and skip.toml.  Every round flies a few dozen cases at once
between two limits and keeps the pair of neighbours between which the outcome changes.
"""

from collections import namedtuple
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from campaigns.reentry.planets import PLANETS
from mc_engine import load_campaign
from mc_engine.flight.flight import chosen_cases
from mc_engine.model import load_model

HERE = Path(__file__).parent
CASES = 32  # flown at once
Inputs = Mapping[str, Any]

# altitudes [km] of the vacuum periapsis between which one pass captures
CriticalPeriapses = namedtuple("CriticalPeriapses", "capture entry")


def boundary(inputs: Inputs, name: str, low: float, high: float, width: float, holds: Callable[..., np.ndarray]):
    """Value of the input `name` at which `holds` becomes true, going from low to high, in its unit.

    holds : columns -> bool[n], false at low and true at high; ValueError if it is not
    width : how closely the boundary is found
    """
    while high - low > width:
        values = np.linspace(low, high, CASES)
        true = holds(chosen_cases(load_model("campaigns.reentry"), {**inputs, name: values}))
        if true[0] or not true[-1]:
            raise ValueError(f"{name} from {low:g} to {high:g} has no boundary")
        first = int(np.argmax(true))
        low, high = float(values[first - 1]), float(values[first])
    return 0.5 * (low + high)


def exits(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """bool[n], which cases leave the atmosphere."""
    return columns["exits"] > 0


def is_lost(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """bool[n], which cases leave on a hyperbola, that has no apoapsis."""
    return exits(columns) & np.isnan(columns["exit_apoapsis_altitude_km"])


def interface_km(planet: str) -> float:
    """Altitude [km] at which the planet's exponential atmosphere is as thin as that of the Earth at 120 km."""
    thin = PLANETS["earth"].air[0] * np.exp(-120e3 / PLANETS["earth"].air[1])
    density, scale = PLANETS[planet].air
    return float(1e-3 * scale * np.log(density / thin))


def critical_periapses(inputs: Inputs) -> CriticalPeriapses:
    """Vacuum periapses of the first and the second critical trajectory of an arrival on a hyperbola.

    The entry altitude is that of the inputs, else where the planet's air begins, and the periapses are looked for
    from a quarter of it up to eleven twelfths.  On the first the vehicle leaves the atmosphere at escape speed: higher,
    and it is lost.  On the second it just still leaves: lower, and it comes down at once.  Drag only, no gravity but
    that of the point mass.

    Altitudes in km; the source's section on aerobraking, with its eqs (17), (18).
    """
    top = {"entry_altitude_km": interface_km(inputs.get("planet", "earth"))}
    asked = {**top, **inputs, "arrival": "hyperbola", "on_exit": "stop"}
    low_km, high_km = (share * float(asked["entry_altitude_km"]) for share in (1.0 / 4.0, 11.0 / 12.0))
    capture = boundary(asked, "vacuum_periapsis_km", low_km, high_km, 1e-5, is_lost)
    return CriticalPeriapses(capture, entry=boundary(asked, "vacuum_periapsis_km", low_km, capture, 1e-5, exits))


def critical_roll(inputs: Inputs, low_deg: float = 0.1, high_deg: float = 45.0) -> float:
    """Climb angle [deg] of the roll to lift down, above which a skip leaves through its entry altitude all the same."""
    asked = {**inputs, "rolled_bank_deg": 180.0, "on_exit": "stop"}
    return boundary(asked, "roll_flight_path_angle_deg", low_deg, high_deg, 1e-6, exits)


def main() -> None:
    """Print the critical trajectories of the campaign files [km, deg]."""
    periapses = critical_periapses(load_campaign(HERE / "aerobraking.toml").nominal)
    print(f"aerobraking: capture below {periapses.capture:.3f} km, entry below {periapses.entry:.3f} km")
    print(f"skip: roll to lift down at {critical_roll(load_campaign(HERE / 'skip.toml').nominal):.4f} deg")


if __name__ == "__main__":
    main()
