"""The section of the contributors: total and first-order effects of inputs, groups and random draws.

From the flights beside the run, or from the table of cases, which also tells trends and leaves a share unexplained.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from mc_engine.statistics.sensitivity import FEWEST_CASES, Sensitivity, beyond_chance
from reports.contributions import UNEXPLAINED, Contributions, Contributor
from reports.contributor_figures import SMALL, contributor_figure, name_of
from reports.document import Cell, Column, FigureBlock, Table
from reports.flown import Flown
from reports.numbers import count, number, percent

STRONGEST = 5  # of a metric in the table
LEFT = 0.005  # an unexplained share below it is not told
_TRENDS = {"src": "SRC", "prcc": "PRCC", "spearman": "Spearman"}


def companion_blocks(flown: Flown, found: Contributions) -> Iterator[FigureBlock | Table | str]:
    """The figure of the effects and budgets, and a table of the strongest contributors of each metric."""
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
    by_metric = [(metric, flown.words(metric), found.by_metric[metric]) for metric in shown]
    if found.trends is None:
        source, rest = f"from {blocks} of {count(found.n_tried)} blocks flown for this purpose", "rest: interactions"
    else:
        source = f"from a surrogate model of {blocks} of {count(found.n_tried)} cases of the table"
        rest = "rest: interactions, random draws, unexplained"
    return contributor_figure(flown, by_metric, source, rest)


def _table(flown: Flown, found: Contributions, shown: list[str]) -> Table:
    columns = (
        Column("Metric", "text", 2.4),
        Column("Contributor", "text", 2.6),
        Column("First-order effect", "number", 2.0),
        Column("Total effect", "number", 2.0),
        *(Column(title, "number", 1.2) for title in (_TRENDS.values() if found.trends else ())),
    )
    counted = "cases" if found.trends else "blocks"
    rows = []
    for k, metric in enumerate(found.by_metric):
        whole = found.n_used[metric] == found.n_tried and found.trends is None
        small = "" if whole else f"{count(found.n_used[metric])} / {count(found.n_tried)} {counted}"
        if found.trends and np.isfinite(found.trends.r_squared[k]):
            small += f", R² {found.trends.r_squared[k]:.2f}"
        for one in _strongest(found.by_metric[metric]):
            name = f"{UNEXPLAINED} by the inputs" if one.input == UNEXPLAINED else name_of(flown, one.input)
            cells = [_cell(one.first, one.first_interval), _cell(one.total, one.total_interval)]
            cells += _trends(found.trends, one.input, k) if found.trends else []
            rows.append((Cell(flown.words(metric), small=small), Cell(name), *cells))
    return Table(f"Contributors to each metric, at most {STRONGEST}", columns, tuple(rows), _note(flown, found))


def _strongest(found: Sequence[Contributor]) -> list[Contributor]:
    """The first one, others whose effect is surely more than nothing, and what is unexplained."""
    named = [one for one in found if one.input != UNEXPLAINED]
    sure = [one for one in named[1:STRONGEST] if one.size >= SMALL and _surely(one)]
    return [*named[:1], *sure, *(one for one in found if one.input == UNEXPLAINED and one.size >= LEFT)]


def _surely(one: Contributor) -> bool:
    return any(interval is not None and interval[0] > 0.0 for interval in (one.first_interval, one.total_interval))


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
            f"From {count(found.flights)} cases in {count(found.n_tried)} blocks, flown for this purpose beside the "
            "run; they are in none of its statistics. First-order effect: the fraction of the metric’s variance that "
            "is removed when the contributor is known. Total effect: the fraction that remains when everything else is "
            f"known. Random draws: noise made in flight, and inputs that only name a draw. {each} Pick-freeze "
            "estimates (Janon 2014, Jansen 1999)."
        )
    note = (
        f"Estimated from the table of cases. First-order effect: fraction of the variance due to this input alone. "
        "Total effect: fraction due to this input and its interactions with others. Unexplained: fraction that the "
        "surrogate model behind the total effects attributes to no input (random draws in flight, discontinuities); a "
        f"total effect may be larger by up to it. {each} SRC, PRCC and Spearman: trends with their direction. "
        "R²: fraction of the variance that the linear regression behind SRC explains."
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
