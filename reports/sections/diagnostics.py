"""How the key metrics and inputs are related to one another, and how far from normal the metrics are."""

from collections.abc import Iterator

import numpy as np

from mc_engine.statistics.input_columns import average_ranks
from mc_engine.statistics.picked_cases import picked_rows
from reports.document.blocks import FigureBlock
from reports.drawing.marks import Drawing
from reports.figures.statistics import correlation_matrix, probability_plot
from reports.run.flown import Flown
from reports.text.numbers import count, first_of, number

MOST_METRICS, MOST_INPUTS = 8, 8  # of the matrix
MOST_PANELS = 12  # of the probability plots
FEWEST_CASES = 20
CHANCE = 3.0  # standard errors of the correlation of independent columns
MOST_CASES = 50_000  # above, ranks are taken of cases picked evenly


def correlation_blocks(flown: Flown) -> Iterator[FigureBlock | str]:
    """Rank correlations of the key metrics and of the inputs that contribute most to them."""
    if not flown.random or flown.n_held < FEWEST_CASES:
        yield f"Not drawn: correlations need {FEWEST_CASES} cases that were drawn at random."
        return
    rows = picked_rows(flown.n_held, MOST_CASES)
    metrics = [name for name in flown.key_metrics if not flown.summaries[name].constant]
    table = {name: flown.values(name)[rows] for name in [*metrics[:MOST_METRICS], *_inputs(flown, metrics)]}
    table = {name: values for name, values in table.items() if _varies(values)}
    if len(table) < 2:
        yield "Not drawn: of the key metrics and their contributors, fewer than two differ between the cases."
        return
    names = list(table)
    rho, fewest = rank_correlations(np.array(list(table.values())))
    chance = CHANCE / np.sqrt(max(fewest - 1, 1))
    words = [flown.words(name) for name in names]
    pairs = sorted(zip(*np.tril_indices(len(names), -1), strict=True), key=lambda one: -np.nan_to_num(abs(rho[one])))
    strongest = "; ".join(f"{words[i]} and {words[k]} {number(rho[i, k], 2)}" for i, k in pairs[:5])
    picked = f" From {count(rows.size)} cases." if rows.size < flown.n_tried else ""
    caption = (
        f"Spearman’s rank correlations of the {first_of(MOST_METRICS, len(metrics), 'key metrics')} and of the inputs "
        f"that contribute most to them. Below {chance:.2f} in size, a correlation of {count(fewest)} cases is within "
        f"chance (3 standard errors).{picked}"
    )
    drawn = Drawing("Correlation matrix", (correlation_matrix(words, rho),), 1, f"The strongest: {strongest}")
    yield FigureBlock(caption, drawn, "matrix")


def rank_correlations(table: np.ndarray) -> tuple[np.ndarray, int]:
    """Spearman's coefficients float64[n, n] of rows with NaN where a number is missing, and the fewest cases of a pair.

    A pair is over the cases that have both numbers.
    """
    n = len(table)
    rho, fewest = np.eye(n), table.shape[1]
    finite = np.isfinite(table)
    whole = [average_ranks(row) if good.all() else None for row, good in zip(table, finite, strict=True)]
    for i, k in zip(*np.tril_indices(n, -1), strict=True):
        both = finite[i] & finite[k]
        fewest = min(fewest, int(both.sum()))
        a, b = whole[i], whole[k]
        if a is None or b is None:
            a, b = (average_ranks(table[row][both]) for row in (i, k))
        enough = a.size >= FEWEST_CASES and a.std() > 0.0 and b.std() > 0.0
        rho[i, k] = rho[k, i] = np.corrcoef(a, b)[0, 1] if enough else np.nan
    return rho, fewest


def normal_probability_blocks(flown: Flown) -> Iterator[FigureBlock | str]:
    """Normal probability plots of the key metrics, where a normal distribution is a straight line."""
    drawable = [name for name in flown.key_metrics if flown.summaries[name].n_used >= FEWEST_CASES]
    varying = [name for name in drawable if not flown.summaries[name].constant]
    names = varying[:MOST_PANELS]
    if not flown.random or not names:
        yield f"Not drawn: no key metric has {FEWEST_CASES} different numbers of cases that were drawn at random."
        return
    panels = []
    for name in names:
        values = flown.values(name)
        order = np.argsort(values, kind="stable")[: np.count_nonzero(np.isfinite(values))]
        panels.append(
            probability_plot(
                values[order],
                flown.case_ids[order],
                flown.axis(name),
                _shape(values[order]),
                flown.stated.confidence,
                flown.limits(name).ends,
                name,
            )
        )
    which = f"{first_of(len(names), len(varying), 'key metrics')}{flown.sample_words}"
    caption = (
        f"Normal probability plots of the {which}. A normal distribution "
        "lies on the dashed line; cases outside the band are beyond chance at their rank. γ₁: skewness, γ₂: excess "
        "kurtosis, both 0 of a normal distribution. Extrapolation by σ holds only where the points follow the line."
    )
    yield FigureBlock(caption, Drawing("Normal probability plots", tuple(panels), 4), "small")


def _shape(values: np.ndarray) -> str:
    """Skewness and excess kurtosis."""
    z = (values - values.mean()) / values.std()
    return f"γ₁ {number(float((z**3).mean()), 2)}, γ₂ {number(float((z**4).mean()) - 3.0, 2)}"


def _inputs(flown: Flown, metrics: list[str]) -> list[str]:
    """The inputs that contribute most to any of these metrics."""
    size: dict[str, float] = {}
    for metric in metrics[:MOST_METRICS]:
        for contributor in flown.contributors(metric):
            size[contributor.name] = max(size.get(contributor.name, 0.0), contributor.share)
    return sorted(size, key=lambda name: -size[name])[:MOST_INPUTS]


def _varies(values: np.ndarray) -> bool:
    finite = values[np.isfinite(values)]
    return finite.size >= FEWEST_CASES and bool(finite.min() < finite.max())
