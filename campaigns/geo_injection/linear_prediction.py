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
from mc_engine import case_table, load_campaign
from mc_engine.flight.flight import fly

SMOOTH = ["semi_major_axis_km", "radius_error_km", "longitude_drift_deg_day", "propellant_kg", "final_mass_kg"]
LENGTHS = ["eccentricity", "inclination_deg", "correction_dv_m_s"]
_SHARE = 0.1  # of a standard deviation: the step of the differences


def contributions(nominal: Mapping[str, Any], sigmas: Mapping[str, float]) -> pd.DataFrame:
    """Change of each smooth metric by one standard deviation of each dispersion; a row for each, in the metrics' units.

    nominal : inputs by column name;  sigmas : standard deviation of each dispersed input, in its unit.
    The root of the sum of squares is the metric's standard deviation, if the dispersions are independent.
    """
    n = len(sigmas)
    inputs = dict(nominal)
    for k, (name, sigma) in enumerate(sigmas.items()):
        inputs[name] = float(nominal[name]) + _SHARE * sigma * np.array([*np.eye(n)[k], *-np.eye(n)[k]])
    flown = fly(MODEL, inputs, np.arange(2 * n), 0)
    changes = {metric: (flown[metric][:n] - flown[metric][n:]) / (2.0 * _SHARE) for metric in SMOOTH}
    return pd.DataFrame(changes, index=list(sigmas))


def _report(name: str, n_cases: int = 4000) -> None:
    """Print linear and flown standard deviations, each in the unit of its column, for a campaign."""
    campaign, ids = load_campaign(name), np.arange(n_cases)
    drawn = case_table(campaign, ids)
    flown = pd.DataFrame(fly(MODEL, {**campaign.nominal, **drawn}, ids, campaign.seed))
    sigmas = {one.name: np.std(drawn[one.name], ddof=1) for one in campaign.dispersions}
    table = contributions(campaign.nominal, sigmas)
    table.loc["sigma, linear"], table.loc["sigma, flown"] = np.sqrt((table**2).sum()), flown[SMOOTH].std()
    lengths = flown[LENGTHS].quantile([0.5, 0.99]).set_axis(["median", "99 %"])
    print(f"{name}: {n_cases} cases; change by one standard deviation of each dispersion")
    print(table.to_string(float_format="{:.6g}".format))
    print(lengths.T.to_string(float_format="{:.6g}".format))


if __name__ == "__main__":
    _report(sys.argv[1] if len(sys.argv) > 1 else "geo_injection")
