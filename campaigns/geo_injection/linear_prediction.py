"""Standard deviations by linear theory, with which those of flown cases are compared.

`python -m campaigns.geo_injection.linear_prediction [CAMPAIGN]` prints both for a campaign file of this folder.
Good for metrics that are smooth in the errors, such as the semi-major axis; eccentricity, inclination and correction
are lengths, which grow whichever sign an error has.
"""

import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from campaigns.geo_injection.model import MODEL
from mc_engine.flight.flight import fly

SMOOTH = ("semi_major_axis_km", "radius_error_km", "longitude_drift_deg_day", "propellant_kg", "final_mass_kg")
LENGTHS = ("eccentricity", "inclination_deg", "correction_dv_m_s")
_SHARE = 0.1  # of a standard deviation: the step of the differences


def contributions(nominal: Mapping[str, Any], sigmas: Mapping[str, float]) -> dict[str, np.ndarray]:
    """Change of each smooth metric by one standard deviation of each dispersion, float64[n_dispersions].

    nominal : inputs by column name;  sigmas : standard deviation of each dispersed input, in its unit.
    """
    names, n = list(sigmas), len(sigmas)
    inputs = dict(nominal)
    for k, name in enumerate(names):
        step = np.zeros(2 * n)
        step[[k, n + k]] = _SHARE * sigmas[name], -_SHARE * sigmas[name]
        inputs[name] = float(nominal[name]) + step
    flown = fly(MODEL, inputs, np.arange(2 * n), 0)
    return {metric: (flown[metric][:n] - flown[metric][n:]) / (2.0 * _SHARE) for metric in SMOOTH}


def predicted_sigmas(nominal: Mapping[str, Any], sigmas: Mapping[str, float]) -> dict[str, float]:
    """Standard deviation of each smooth metric for independent dispersions: the root of the sum of squares.

    Each in the unit of its metric.
    """
    return {name: float(np.sqrt((column**2).sum())) for name, column in contributions(nominal, sigmas).items()}


def _report(name: str, n_cases: int = 4000) -> None:
    """Print linear and flown standard deviations, each in the unit of its column, for a campaign."""
    from mc_engine.campaign.cases import case_table
    from mc_engine.campaign.loading import load_campaign

    campaign = load_campaign(name)
    ids = np.arange(n_cases)
    drawn = case_table(campaign, ids)
    flown = fly(MODEL, {**campaign.nominal, **drawn}, ids, campaign.seed)
    sigmas = {dispersion.name: float(np.std(drawn[dispersion.name], ddof=1)) for dispersion in campaign.dispersions}
    table = pd.DataFrame(contributions(campaign.nominal, sigmas), index=list(sigmas))
    table.loc["sigma, linear"] = predicted_sigmas(campaign.nominal, sigmas)
    table.loc["sigma, flown"] = {metric: np.std(flown[metric], ddof=1) for metric in SMOOTH}
    lengths = {metric: np.percentile(flown[metric], [50.0, 99.0]) for metric in LENGTHS}
    print(f"{name}: {n_cases} cases; change by one standard deviation of each dispersion")
    print(table.to_string(float_format="{:.6g}".format))
    print(pd.DataFrame(lengths, index=["median", "99 %"]).T.to_string(float_format="{:.6g}".format))


if __name__ == "__main__":
    _report(sys.argv[1] if len(sys.argv) > 1 else "geo_injection")
