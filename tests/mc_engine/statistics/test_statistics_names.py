"""The public names of the package."""

from mc_engine import statistics

PUBLIC = {
    "QUANTILES", "SAMPLING_DESIGNS", "Normality", "Quantile", "Summary", "SurfaceMap", "Verdict", "clopper_pearson",
    "judge", "judge_all", "lower_bound", "map_metric", "normality", "pass_probability", "quantile", "quantile_ranks",
    "summarize", "upper_bound", "was_looked_at", "worst_cases",
}  # fmt: skip


def test_the_package_offers_these_names_and_no_others():
    assert set(statistics.__all__) == PUBLIC
    assert all(hasattr(statistics, name) for name in PUBLIC)
