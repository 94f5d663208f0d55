"""Comparison of options: the metrics by the level of a dispersed word, on the same cases wherever the run has them."""

from collections.abc import Iterator

import numpy as np
from pandas.api.types import infer_dtype

from mc_engine.statistics import summarize
from mc_engine.statistics.paired import matching_rows, paired_difference
from reports.document.blocks import Cell, Column, FigureBlock, Table
from reports.drawing.marks import Drawing, Plot
from reports.figures.rows import SPREAD, level_panel
from reports.run.flown import Flown
from reports.sections.tables import quantile_cell, used_cell
from reports.text.numbers import capitalised, count, given_percent, interval, number, percent

MOST_LEVELS = 20
MOST_METRICS = 8
NOTHING = 1e-20  # in any unit that a metric comes in
TABLES = 4  # of the metrics that matter most


def level_blocks(flown: Flown) -> Iterator[FigureBlock | Table | str]:
    """A figure and tables for every dispersed input that is a word with several levels."""
    for fact in flown.with_role("dispersion"):
        levels = _levels(flown, fact.name)
        if len(levels) > 1:
            yield from _compared(flown, fact.name, levels)


def _levels(flown: Flown, name: str) -> list[str]:
    """The nominal level first, then the others as the model lists its choices, else as they come; none for numbers."""
    column = flown.cases[name]
    if infer_dtype(column, skipna=False) != "string":
        return []
    records = [record for record in flown.manifest.get("inputs", []) if record["name"] == name]
    order = [flown.nominal.get(name), *(word for record in records for word in record.get("choices", []))]
    flown_here = dict.fromkeys(column)
    levels = list(dict.fromkeys([*(level for level in order if level in flown_here), *flown_here]))
    return levels if len(levels) <= MOST_LEVELS else []


def _compared(flown: Flown, name: str, levels: list[str]) -> Iterator[FigureBlock | Table | str]:
    choice = flown.cases[name].to_numpy(dtype=object)
    others = {
        fact.name: flown.cases[fact.name].to_numpy() for fact in flown.with_role("dispersion") if fact.name != name
    }
    matched = matching_rows(choice, levels, others)
    metrics = [metric for metric in flown.key_metrics if _varies(flown, metric)][:MOST_METRICS]
    if not metrics:
        yield f"{flown.words(name)}: no metric differs between its levels."
        return
    rows = [np.flatnonzero(choice == level) for level in levels]
    plots = tuple(_metric_panel(flown, metric, levels, rows) for metric in metrics)
    yield FigureBlock(
        f"Metrics by {flown.words(name)}{flown.sample_words}. {_pairs_said(flown, matched)}",
        Drawing(f"Metrics by {flown.words(name)}", plots),
        "half",
    )
    for metric in metrics[:TABLES]:
        yield _level_table(flown, name, metric, levels, rows, matched)


def _varies(flown: Flown, metric: str) -> bool:
    """Whether the metric is more than the rounding of a zero."""
    summary = flown.summaries[metric]
    return summary.maximum is not None and summary.minimum is not None and summary.maximum - summary.minimum > NOTHING


def _pairs_said(flown: Flown, matched: np.ndarray) -> str:
    if not len(matched):
        drawn = "Its levels were flown on different cases"
        if flown.sampled:  # the cases that were not selected may share inputs
            drawn = "In the selected cases, its levels have different other inputs"
        return f"{drawn}: differences between them include the scatter of the cases."
    share = len(matched) * matched.shape[1]
    return (
        f"{count(len(matched))} sets of cases differ in it alone, one case a level: the same draws for all "
        f"({count(share)} of {count(flown.n_held)} cases)."
    )


def _metric_panel(flown: Flown, metric: str, levels: list[str], rows: list[np.ndarray]) -> Plot:
    values = flown.values(metric)
    quantiles, used = np.full((len(rows), len(SPREAD)), np.nan), []
    for place, group in enumerate(rows):
        numbers = values[group][np.isfinite(values[group])]
        used.append(int(numbers.size))
        if numbers.size:
            quantiles[place] = np.quantile(numbers, SPREAD)
    return level_panel(flown.label(metric), levels, quantiles, used)


def _level_table(
    flown: Flown, name: str, metric: str, levels: list[str], rows: list[np.ndarray], matched: np.ndarray
) -> Table:
    large = flown.largest_is_worst(metric)
    tail = flown.stated.probability if large else flown.stated.low  # on the side where a limit is
    columns = (
        Column(flown.words(name), "text"),
        Column("Used / tried", "number"),
        *((Column("Smallest", "number"),) if flown.chosen else ()),
        Column("Median", "number"),
        *(() if flown.chosen else (Column(given_percent(tail), "number"),)),
        Column("Largest" if large or flown.chosen else "Smallest", "number"),
        Column(f"Median difference to {levels[0]}", "number"),
        Column(f"Smaller than {levels[0]}", "number"),
    )
    values = flown.values(metric)
    body, probabilities = [], (0.5,) if flown.chosen else (0.5, tail)
    for place, (level, group) in enumerate(zip(levels, rows, strict=True)):
        summary = summarize(values[group], probabilities=probabilities, confidence=flown.stated.two_sided)
        worst = summary.maximum if large or flown.chosen else summary.minimum
        cells = [quantile_cell(flown, item, summary.spread, 4) for item in summary.quantiles]
        cells = cells or [Cell("–") for _ in probabilities]
        if flown.chosen:
            cells.insert(0, Cell(number(summary.minimum, 4, summary.spread), summary.minimum))
        end = Cell(number(worst, 4, summary.spread), worst)
        against = _difference_cells(flown, values, matched, place)
        body.append((Cell(level), used_cell(summary), *cells, end, *against))
    title = f"{flown.label(metric)} by {flown.words(name)}{flown.sample_words}"
    return Table(capitalised(title), columns, tuple(body), _pairing_note(flown, levels[0], bool(len(matched))))


def _difference_cells(flown: Flown, values: np.ndarray, matched: np.ndarray, place: int) -> tuple[Cell, Cell]:
    """The paired difference of a level to the first one, and in how many pairs it is negative."""
    if place == 0 or not len(matched):
        return Cell("–"), Cell("–")
    difference = paired_difference(values[matched[:, place]], values[matched[:, 0]], flown.stated.confidence)
    if (
        difference.median is None
        or difference.smaller_share is None
        or difference.smallest is None
        or difference.largest is None
    ):
        return Cell("–", small=f"0 of {count(difference.n_tried)} pairs"), Cell("–")
    if _pairs_are_draws(flown):
        small = interval(difference.median.lower, difference.median.upper)
        bounds = f"[{percent(difference.smaller_share[0], 1)}, {percent(difference.smaller_share[1], 1, up=True)}]"
    else:
        small, bounds = f"{number(difference.smallest, 4)} to {number(difference.largest, 4)}", ""
    share = difference.smaller / difference.n_used
    words = f"{count(difference.smaller)} of {count(difference.n_used)}"
    return Cell(number(difference.median.value, 4), difference.median.value, small), Cell(words, share, bounds)


def _pairs_are_draws(flown: Flown) -> bool:
    """Whether pairs may be taken as independent draws: a table's rows are the user's own, mostly drawn elsewhere."""
    return flown.random or flown.design == "table"


def _pairing_note(flown: Flown, first: str, paired: bool) -> str:
    if not paired:
        return "No pairs: the levels were flown on different cases."
    note = f"Differences of pairs of cases that differ in nothing else, to “{first}”. "
    if not _pairs_are_draws(flown):
        return (
            note + "Below the median: smallest to largest difference; the cases were chosen, so there is no interval."
        )
    share = given_percent(flown.stated.confidence)
    return note + (
        f"In brackets: {share} distribution-free interval of the median (sign test) and Clopper–Pearson interval of "
        "the fraction of pairs, for pairs that were drawn independently."
    )
