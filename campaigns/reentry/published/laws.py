"""Our values of the reconstructed guidance laws: 1200 dispersed cases on the planar baseline, the same for each law.

3σ: 15 m/s, 0.15°, density 30 % (constant factor), C_D and L/D 10 %, mass 2 %, independent normals; ideal sensors.
"""

from functools import lru_cache

import numpy as np

from campaigns.reentry.model import MODEL
from campaigns.reentry.published.values import PLANAR
from mc_engine.flight.flight import chosen_case, chosen_cases

SIGMA = {
    "entry_speed_error_m_s": 5.0,
    "entry_flight_path_angle_error_deg": 0.05,
    "density_factor": 0.1,
    "cd_factor": 0.1 / 3,
    "ld_factor": 0.1 / 3,
    "mass_factor": 0.02 / 3,
}
CASES, SEED = 1200, 2003


def off_nominal(cases: int, seed: int) -> dict[str, np.ndarray]:
    """Normal draws of each dispersed input, factors about one and errors about zero, float64[cases]."""
    rng = np.random.default_rng(seed)
    return {name: rng.normal(1.0 if name.endswith("factor") else 0.0, sigma, cases) for name, sigma in SIGMA.items()}


@lru_cache
def _flown(law: str) -> dict[str, np.ndarray]:
    """Columns of the dispersed cases under a guidance law, "none" for the open loop."""
    return chosen_cases(MODEL, {**PLANAR, "plan": "given", **off_nominal(CASES, SEED), "guidance": law})


def range_spread_km(law: str) -> float:
    """Standard deviation [km] of the range."""
    return float(_flown(law)["downrange_km"].std())


def range_bias_km(law: str) -> float:
    """Distance [km] of the mean range from that of the nominal case."""
    nominal = chosen_case(MODEL, {**PLANAR, "plan": "given"})["downrange_km"]
    return abs(float(_flown(law)["downrange_km"].mean()) - float(nominal))


def spread_reduction_pct(law: str) -> float:
    """By how much [%] the spread of the range is smaller than in open loop."""
    return 100.0 * (1.0 - range_spread_km(law) / range_spread_km("none"))


def largest_load_g(law: str) -> float:
    """Largest load [g] of all cases."""
    return float(_flown(law)["peak_load_g"].max())
