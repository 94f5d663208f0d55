"""The section of the contributors: total and first-order effects of inputs, groups and random draws.

From the flights beside the run, or from the table of cases, which also tells trends and leaves a share unexplained.
"""

from collections.abc import Iterator

import numpy as np

from mc_engine.statistics.sensitivity import FEWEST_CASES, Sensitivity, beyond_chance
from reports.contributors.tornado_figure import STRONGEST, contributor_figure, name_of, strongest, surely
from reports.document.blocks import Cell, Column, FigureBlock, Table
from reports.run.contributions import UNEXPLAINED, Contributions, Contributor
from reports.run.flown import Flown
from reports.text.numbers import count, number, percent, with_unit

_TRENDS = {"src": "SRC", "prcc": "PRCC", "spearman": "Spearman"}


def companion_blocks(flown: Flown, found: Contributions) -> Iterator[FigureBlock | Table | str]:
    """The figure of the effects, and a table of the strongest contributors of each metric with their 1σ budget."""
    shown = [metric for metric, rows in found.by_metric.items() if rows]
    if shown:
        yield _figure(flown, found, shown)
        yield _table(flown, found, shown)
    yield from no_contributors(flown, [metric for metric in found.by_metric if metric not in shown])


def no_contributors(flown: Flown, silent: list[str]) -> Iterator[str]:
    """A sentence on metrics whose contributors are not known."""
    if silent:
        names = ", ".join(flown.words(metric) for metric in silent)
        yield f"No contributors for {names}: the same in all cases that have it, or fewer than {FEWEST_CASES} of them."


def _figure(flown: Flown, found: Contributions, shown: list[str]) -> FigureBlock:
    used = [found.n_used[metric] for metric in shown]
    few, most = min(used), max(used)
    blocks = f"{count(most)}" if few == most else f"{count(few)} to {count(most)}"
    of = f"{blocks} of {count(found.n_tried)}"
    source = f"from {of} blocks" if found.trends is None else f"from a surrogate model of {of} cases"
    return contributor_figure(flown, [(flown.words(one), found.by_metric[one]) for one in shown], source)


def _table(flown: Flown, found: Contributions, shown: list[str]) -> Table:
    columns = (
        Column("Metric", "text", 2.4, grouped=True),
        Column("Contributor", "text", 2.6),
        Column("First-order effect", "number", 2.0),
        Column("Total effect", "number", 2.0),
        Column("1σ contribution", "number", 1.4),
        *(Column(title, "number", 1.2) for title in (_TRENDS.values() if found.trends else ())),
    )
    rows = []
    for k, metric in enumerate(found.by_metric):
        cell = Cell(flown.words(metric), small="; ".join(_about(flown, found, metric, k)))
        for one in strongest(found.by_metric[metric]):
            cells = [_cell(one.first, one.first_interval), _cell(one.total, one.total_interval)]
            cells.append(_sigma_cell(flown, metric, one))
            cells += _trends(found.trends, one.input, k) if found.trends else []
            rows.append((cell, Cell(name_of(flown, one.input)), *cells))
    return Table(f"Contributors to each metric, at most {STRONGEST}", columns, tuple(rows), _note(flown, found))


def _about(flown: Flown, found: Contributions, metric: str, k: int) -> Iterator[str]:
    """What the effects rest on where that is not all, σ of the metric, and the root sum square of the contributions."""
    if found.n_used[metric] != found.n_tried or found.trends is not None:
        yield f"{count(found.n_used[metric])} / {count(found.n_tried)} {'cases' if found.trends else 'blocks'}"
    if found.trends and np.isfinite(found.trends.r_squared[k]):
        yield f"R² {found.trends.r_squared[k]:.2f}"
    sigma = flown.summaries[metric].sd
    if sigma:
        explained = float(np.hypot.reduce([sigma_contribution(one, sigma) or 0.0 for one in found.by_metric[metric]]))
        rest = float(np.sqrt(max(sigma**2 - explained**2, 0.0)))
        told = [with_unit(number(value, 3), flown.unit(metric)) for value in (sigma, explained, rest)]
        yield f"σ {told[0]}; root sum square {told[1]}, rest {told[2]}"


def sigma_contribution(one: Contributor, sigma: float) -> float | None:
    """The part of a metric's σ that an input causes by itself; None where noise could have done so."""
    if one.input == UNEXPLAINED or one.first is None or not surely(one.first_interval):
        return None
    return float(np.sqrt(max(one.first, 0.0))) * sigma


def _sigma_cell(flown: Flown, metric: str, one: Contributor) -> Cell:
    value = sigma_contribution(one, flown.summaries[metric].sd or 0.0)
    return Cell("–") if not value else Cell(with_unit(number(value, 3), flown.unit(metric)), value)


def _trends(found: Sensitivity, name: str, k: int) -> list[Cell]:
    if name not in found.inputs:
        return [Cell("–") for _ in _TRENDS]
    return [_cell(_finite(getattr(found, trend)[found.inputs.index(name), k]), None) for trend in _TRENDS]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _note(flown: Flown, found: Contributions) -> str:
    each = f"In brackets: {percent(flown.stated.confidence)} confidence interval."
    if found.trends is None:
        return (
            f"From {count(found.flights)} cases in {count(found.n_tried)} blocks, flown for this purpose and in no "
            f"other statistic. {each} Pick-freeze estimates (Janon 2014, Jansen 1999)."
        )
    note = (
        "Estimated from the table of cases. Unexplained: fraction that the surrogate model behind the total effects "
        "attributes to no input (random draws in flight, discontinuities); a total effect may be larger by up to it. "
        f"{each} SRC, PRCC and Spearman: trends with their direction. R²: fraction of the variance that the linear "
        "regression behind SRC explains."
    )
    if found.trends.correlated is not None:
        first, second, rho = found.trends.correlated
        if beyond_chance(rho, found.n_tried):
            note += (
                f" Inputs are correlated, most of all {flown.words(first)} and {flown.words(second)} "
                f"(rank correlation {number(rho, 2)}): first-order and Spearman include what an input owes to its "
                "correlation; total effects require independent inputs and are left out."
            )
    return note


def _cell(value: float | None, interval: tuple[float, float] | None) -> Cell:
    if value is None:
        return Cell("–")
    text = f"{value:.2f}".replace("-0.00", "0.00").replace("-", "−")
    bounds = "" if interval is None else f" [{interval[0]:.2f}, {interval[1]:.2f}]".replace("-", "−")
    return Cell(text + bounds, value)
