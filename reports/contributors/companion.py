"""The section of the contributors: total and first-order effects of inputs, groups and random draws.

From the additional flights, or from the table of cases, which also gives trends and leaves a fraction unexplained.
"""

from collections.abc import Iterator

import numpy as np

from mc_engine.statistics.input_columns import beyond_chance
from mc_engine.statistics.moments import MOST_VARIANCE, number_or_none
from mc_engine.statistics.sensitivity import FEWEST_CASES, FEWEST_OF_TOTALS, FEWEST_VARYING, Sensitivity
from reports.contributors.tornado_figure import STRONGEST, contributor_figure, name_of, strongest
from reports.document.blocks import Cell, Column, FigureBlock, Table
from reports.run.chosen_units import spread_text
from reports.run.contributions import MOST_METRICS, UNEXPLAINED, Contributions, Contributor, surely
from reports.run.flown import Flown
from reports.text.numbers import count, counted, fixed, given_percent, number, used_of

_TRENDS = {"src": "SRC", "prcc": "PRCC", "spearman": "Spearman"}


def companion_blocks(flown: Flown, contributions: Contributions) -> Iterator[FigureBlock | Table | str]:
    """The figure of the effects, and a table of the strongest contributors of each metric with their 1σ budget."""
    key = flown.key_metrics[:MOST_METRICS]
    shown = [metric for metric in key if contributions.by_metric[metric]]
    if shown:
        yield _effect_figure(flown, contributions, shown)
        yield _effect_table(flown, contributions, shown)
    silent = [metric for metric in key if metric not in shown]
    yield from no_contributors(flown, silent, "blocks" if contributions.trends is None else "cases")
    others = sum(metric not in key and bool(rows) for metric, rows in contributions.by_metric.items())
    if others:
        yield f"The effects on {counted(others, 'other metric')} are in report.json."
    if left := len(set(flown.key_metrics) - contributions.by_metric.keys()):  # of the table of cases alone
        yield f"The effects on {counted(left, 'other key metric')} are not estimated."


def no_contributors(flown: Flown, silent: list[str], used: str = "cases") -> Iterator[str]:
    """A sentence on metrics whose contributors are not known; used : what indices rest on, cases or blocks of them."""
    if silent:
        few = f"fewer than {FEWEST_CASES} {used} have a number"
        few += f", or make up {given_percent(MOST_VARIANCE)} of its variance" if used == "blocks" else ""
        yield f"No contributors for {flown.listed(silent)}: the same in all cases that have it, or {few}."


def _effect_figure(flown: Flown, contributions: Contributions, shown: list[str]) -> FigureBlock:
    of = used_of([contributions.n_used[metric] for metric in shown], contributions.n_tried)
    of_blocks = f"{of} blocks of cases flown for this purpose"
    fitted = any(row.total is not None for metric in shown for row in contributions.by_metric[metric])
    of_cases = f"from {'a surrogate model of ' * fitted}{of} cases{_selected(flown, contributions)}"
    source = f"from {of_blocks}" if contributions.trends is None else of_cases
    return contributor_figure(flown, [(flown.words(item), contributions.by_metric[item]) for item in shown], source)


def _selected(flown: Flown, contributions: Contributions) -> str:
    """What follows "cases" where effects are estimated from some of them."""
    return f", selected evenly from the {count(flown.n_tried)}" if contributions.n_tried < flown.n_tried else ""


def _effect_table(flown: Flown, contributions: Contributions, shown: list[str]) -> Table:
    held = contributions.held
    columns = (
        Column("Metric", "text", grouped=True),
        Column("Contributor", "text"),
        Column("First-order effect", "number"),
        Column("Total effect", "number"),
        *((Column("Variance reduction at nominal", "number"),) if held else ()),
        Column("1σ contribution", "number"),
        *(Column(title, "number") for title in (_TRENDS.values() if contributions.trends else ())),
    )
    rows = []
    for metric in shown:
        k = [*contributions.by_metric].index(metric)
        cell = Cell(flown.words(metric), small="; ".join(_about(flown, contributions, metric, k)))
        for contributor in strongest(contributions.by_metric[metric]):
            cells = [
                _cell(contributor.first, contributor.first_interval),
                _cell(contributor.total, contributor.total_interval),
                *([_cell(contributor.fall, contributor.fall_interval)] if held else []),
            ]
            cells.append(_sigma_cell(flown, metric, contributor))
            cells += _trends(contributions.trends, contributor.input, k) if contributions.trends else []
            rows.append((cell, Cell(name_of(flown, contributor.input)), *cells))
    return Table(
        f"Contributors to each metric, at most {STRONGEST}", columns, tuple(rows), _note(flown, contributions, shown)
    )


def _about(flown: Flown, contributions: Contributions, metric: str, k: int) -> Iterator[str]:
    """Cases used where not all are, σ of the metric, and the root sum square of the 1σ contributions."""
    if contributions.n_used[metric] != contributions.n_tried or contributions.trends is not None:
        used, tried = count(contributions.n_used[metric]), count(contributions.n_tried)
        yield f"{used} / {tried} {'cases' if contributions.trends else 'blocks'}"
    if contributions.trends and np.isfinite(contributions.trends.r_squared[k]):
        yield f"R² {contributions.trends.r_squared[k]:.2f}"
    sigma = flown.summaries[metric].sd
    if sigma:
        if _correlated(contributions) is not None:
            yield f"σ {spread_text(flown, metric, sigma)}"
            return
        explained = float(
            np.hypot.reduce(
                [sigma_contribution(contributor, sigma) or 0.0 for contributor in contributions.by_metric[metric]]
            )
        )
        rest = float(np.sqrt(max(sigma - explained, 0.0)) * np.sqrt(sigma + explained))  # squares may overflow
        told = [spread_text(flown, metric, value) for value in (sigma, explained, rest)]
        within = explained <= sigma or told[0] == told[1]
        beyond = f"rest {told[2]}" if within else "above σ by chance in the estimates"
        yield f"σ {told[0]}; root sum square {told[1]}, {beyond}"


def sigma_contribution(contributor: Contributor, sigma: float) -> float | None:
    """The part of a metric's σ that an input causes by itself; None where noise could have done so."""
    sure = surely(contributor.first_interval) and contributor.surely_acts
    if contributor.input == UNEXPLAINED or contributor.bounded_first is None or not sure:
        return None
    return float(np.sqrt(max(contributor.bounded_first, 0.0))) * sigma


def _sigma_cell(flown: Flown, metric: str, contributor: Contributor) -> Cell:
    value = sigma_contribution(contributor, flown.summaries[metric].sd or 0.0)
    return Cell("–") if not value else Cell(spread_text(flown, metric, value), value)


def _trends(sensitivity: Sensitivity, name: str, k: int) -> list[Cell]:
    if name not in sensitivity.inputs:
        return [Cell("–") for _ in _TRENDS]
    return [
        _cell(number_or_none(getattr(sensitivity, trend)[sensitivity.inputs.index(name), k]), None) for trend in _TRENDS
    ]


def _note(flown: Flown, contributions: Contributions, shown: list[str]) -> str:
    each = f"In brackets: {given_percent(flown.stated.confidence)} confidence interval."
    rows = [row for metric in shown for row in strongest(contributions.by_metric[metric])]
    if any(_beyond_total(row) for row in rows):
        each += (
            " Both effects are estimated separately: a first-order effect larger than its total effect, which no true "
            "one is, is an error of the estimates; a 1σ contribution is of no more than the upper end of the total one."
        )
    if contributions.trends is None:
        reduction = (
            " This reduction is flown for parameters that name a random draw; noise made in flight stays as drawn."
        )
        return (
            f"From {count(contributions.flights)} cases in {count(contributions.n_tried)} blocks, flown for this "
            "purpose and in no other statistic; a block is some independent cases, and copies of the first that each "
            "take one contributor from another. "
            f"{each} Pick-freeze estimates (Janon 2014, Jansen 1999). A total effect is the variance that remains, on "
            "average, when all other inputs are known; where inputs interact, the variance falls by another amount if "
            "the input is held at its nominal value. First-order and total effects and their intervals are within 0 "
            "to 1."
        ) + (reduction if contributions.held else "")
    unexplained = (
        "Unexplained: fraction that the surrogate model behind the total effects attributes to no input (random "
        "draws, discontinuities); a total effect may be larger by up to it, which the upper end of its interval "
        "includes. With a section [sensitivity] in the campaign file, flights of their own compute what the random "
        "draws contribute. "
    ) * any(row.input == UNEXPLAINED for row in rows)
    selected = f"{count(contributions.n_tried)} cases{chosen}" if (chosen := _selected(flown, contributions)) else ""
    note = (
        f"Estimated from {selected or 'the table of cases'}. {unexplained}{each} First-order effects "
        "are those of bins of an input: one that is due to a jump or a long tail of the metric within a bin is "
        "found too small, beyond its interval. SRC, PRCC and Spearman: trends with their direction. "
        "R²: fraction of the variance that the linear regression behind SRC explains."
    )
    correlated = _correlated(contributions)
    if correlated is not None:
        first, second, rho = correlated
        note += (
            f" Inputs are correlated, most of all {flown.words(first)} and {flown.words(second)} "
            f"(rank correlation {number(rho, 2)}): first-order effects, 1σ contributions and Spearman include what an "
            "input owes to its correlation, so that they overlap and do not add up to σ; total effects require "
            "independent inputs and are left out."
        )
    elif any(row.total is None for row in rows):
        note += (
            f" Total effects need {FEWEST_OF_TOTALS} cases with a number, and {FEWEST_VARYING} that make up "
            f"{given_percent(MOST_VARIANCE)} of the variance, or a section [sensitivity] of the campaign."
        )
    return note


def _correlated(contributions: Contributions) -> tuple[str, str, float] | None:
    """The two inputs with the strongest correlation of those beyond chance, and their rank correlation."""
    pair = None if contributions.trends is None else contributions.trends.correlated
    return pair if pair is not None and beyond_chance(pair[2], contributions.n_tried) else None


def _beyond_total(contributor: Contributor) -> bool:
    """Whether the first-order effect is printed larger than the total effect."""
    if contributor.first is None or contributor.total is None:
        return False
    return round(contributor.first, 2) > round(contributor.total, 2)


def _cell(value: float | None, interval: tuple[float, float] | None) -> Cell:
    if value is None:
        return Cell("–")
    bounds = "" if interval is None else f" [{fixed(interval[0], 2)}, {fixed(interval[1], 2)}]"
    return Cell(fixed(value, 2) + bounds, value)
