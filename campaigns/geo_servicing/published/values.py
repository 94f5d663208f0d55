"""Our values of published numbers that are no metric of a case.

The records name these functions; each returns its value in the unit of the record.
"""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from campaigns.geo_servicing.dynamics import R0
from campaigns.geo_servicing.model import MODEL, nominal_start
from campaigns.geo_servicing.phasing_plan import PUBLISHED, design
from campaigns.geo_servicing.planned_flight import Craft
from mc_engine.flight.flight import chosen_history, settings_of
from mc_engine.studies.published_values import dispersed_cases

_FOLDER = Path(__file__).resolve().parents[1]
# the source's corrections without errors, gravity 4 x 4, Moon and Sun
SCHEDULE: dict[str, Any] = {"schedule": "published", "feedback": False, "navigation": "perfect", "sunlight": False}
# tolerances of section 8.1
TOLERANCES = {"mean_longitude_deviation_deg": 0.05, "period_error_s": 5.0, "eccentricity": 4e-4}


def _per_run(metric: str) -> np.ndarray:
    """A metric of the cases of published_per_run.toml: one error a run."""
    return dispersed_cases(_FOLDER / "published_per_run.toml")[metric]


def interval_end(metric: str, sigmas: float) -> float:
    """Mean and so many standard deviations of a metric, one error a run; section 9.2."""
    values = _per_run(metric)
    return float(values.mean() + sigmas * values.std(ddof=1))


def extreme(metric: str, which: str) -> float:
    """The "min" or "max" of a metric of all cases, one error a run; axis of the histogram of section 9.2."""
    return float(getattr(_per_run(metric), which)())


def share_in_tolerance_pct() -> float:
    """Share [%] of trials inside the tolerances of section 8.1, one error a run; section 9.2."""
    inside = [np.abs(_per_run(metric)) < limit for metric, limit in TOLERANCES.items()]
    return 100.0 * float(np.all(inside, axis=0).mean())


def steady_share_pct() -> float:
    """Share [%] of trials of inspection_single.toml that keep the range between 19.1 and 82.0 m; section 9.3."""
    return 100.0 * float(dispersed_cases(_FOLDER / "inspection_single.toml")["steady"].mean())


def eccentricity_limit(nearest_m: float, farthest_m: float) -> float:
    """Largest difference of the eccentricity vectors that keeps a range: its width over 8 r0; section 3.3."""
    return (farthest_m - nearest_m) / (8.0 * R0)


def first_drift_deg_rev() -> float:
    """Drift [deg/rev] at the start of the phasing; start of the plots of section 9.1."""
    return float(chosen_history(MODEL, SCHEDULE, rows=11)["drift_rate_deg_rev"][0])


def burn_signs() -> str:
    """Signs of the source's three burns, as the campaign flies them."""
    return ", ".join("+" if sign > 0.0 else "−" for _, _, sign in PUBLISHED)


def craft_of(**chosen: Any) -> Craft:
    """The craft that plans are made for under these settings, the others nominal."""
    chosen = {"phase": "free"} | chosen  # without a plan
    codes = np.array([setting.code(chosen.get(setting.name, setting.default)) for setting in MODEL.settings])
    return Craft(*nominal_start(settings_of(MODEL, codes)))


@lru_cache
def _designed() -> dict[str, np.ndarray]:
    """The burns of our own plan and the coasts before them [s]."""
    craft = craft_of(navigation="perfect", sunlight=False)
    plan = design(craft)
    return {"coast": plan.coasts, "burn": craft.burn_times(plan.dv)}


def designed_s(part: str, number: int) -> float:
    """Length [s] of a "burn" of our own plan, counted from 1, or of the "coast" before it; compare section 9.1."""
    return float(_designed()[part][number - 1])
