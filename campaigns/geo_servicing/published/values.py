"""Our values of published numbers that are no metric of a case.

Hoang Vu Tan, 2021.  The records name these functions; each returns its value in the unit of the record.
"""

from collections import namedtuple
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

import numpy as np

from campaigns.geo_servicing.dynamics import R0
from campaigns.geo_servicing.model import MODEL, nominal_start
from campaigns.geo_servicing.phasing_plan import PUBLISHED, design
from campaigns.geo_servicing.planned_flight import Craft
from mc_engine.flight.flight import chosen_history
from mc_engine.studies.published_values import dispersed_cases

_FOLDER = Path(__file__).resolve().parents[1]
# the source's corrections without errors, gravity 4 x 4, Moon and Sun
SCHEDULE: dict[str, Any] = {"schedule": "published", "feedback": False, "navigation": "perfect", "sunlight": False}
# tolerances of section 8.1 on longitude, period and eccentricity
LONGITUDE_DEG, PERIOD_S, ECCENTRICITY = 0.05, 5.0, 4e-4


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
    inside = np.abs(_per_run("mean_longitude_deviation_deg")) < LONGITUDE_DEG
    inside &= np.abs(_per_run("period_error_s")) < PERIOD_S
    inside &= _per_run("eccentricity") < ECCENTRICITY
    return 100.0 * float(inside.mean())


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
    codes = [setting.code(chosen.get(setting.name, setting.default)) for setting in MODEL.settings]
    names = [*(setting.symbol for setting in MODEL.settings), "tables"]
    settings = cast("Any", namedtuple("Settings", names))
    return Craft(*nominal_start(settings(*codes, np.empty(0))))


@lru_cache
def _designed() -> dict[str, np.ndarray]:
    """The burns of our own plan and the coasts before them [s], float64[3] each."""
    craft = craft_of(navigation="perfect", sunlight=False)
    plan = design(craft)
    return {"coast": plan.coasts, "burn": craft.burn_times(plan.dv)}


def designed_s(part: str, number: int) -> float:
    """Length [s] of a "burn" of our own plan, counted from 1, or of the "coast" before it; compare section 9.1."""
    return float(_designed()[part][number - 1])
