"""Statistics of the case table of a run: summaries, verdicts on requirements, maps.  Arrays in, plain records out."""

from mc_engine.statistics.binomial import clopper_pearson, lower_bound, pass_probability, upper_bound
from mc_engine.statistics.maps import SurfaceMap, map_metric
from mc_engine.statistics.normality import Normality, normality
from mc_engine.statistics.order_statistics import QUANTILES, Quantile, quantile, quantile_ranks
from mc_engine.statistics.requirements import (
    CHOSEN_DESIGNS,
    SAMPLING_DESIGNS,
    Verdict,
    judge,
    judge_all,
    was_looked_at,
)
from mc_engine.statistics.summary import Summary, summarize
from mc_engine.statistics.worst import worst_cases

__all__ = [
    "CHOSEN_DESIGNS",
    "QUANTILES",
    "SAMPLING_DESIGNS",
    "Normality",
    "Quantile",
    "Summary",
    "SurfaceMap",
    "Verdict",
    "clopper_pearson",
    "judge",
    "judge_all",
    "lower_bound",
    "map_metric",
    "normality",
    "pass_probability",
    "quantile",
    "quantile_ranks",
    "summarize",
    "upper_bound",
    "was_looked_at",
    "worst_cases",
]
