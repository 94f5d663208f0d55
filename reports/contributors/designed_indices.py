"""Contributors in a run designed for sensitivity: Sobol' indices of Saltelli's blocks, Morris's effects."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mc_engine.statistics.designed_indices import FEWEST_BLOCKS, DesignedIndices, designed_indices
from mc_engine.statistics.moments import MOST_VARIANCE
from reports.contributors.tornado_figure import contributor_figure
from reports.document.blocks import Cell, Column, FigureBlock, Table
from reports.run.contributions import Contributor
from reports.run.flown import Flown
from reports.run.outcomes import ALL_LIMITS, inside, inside_words
from reports.text.numbers import axis_label, count, counted, given_percent, number, used_of

MOST_METRICS = 8
MOST_INPUTS = 12  # of a metric in the table
ROUNDING = 1e-12  # of the largest index of a metric: a smaller one is the rounding of a zero
BLOCKS = {"saltelli": "blocks", "morris": "trajectories"}
_TITLES = {
    "first_order": "First-order index",
    "total": "Total index",
    "mu_star": "μ*",
    "mu": "μ",
    "sigma": "σ of the effects",
}


def designed_blocks(flown: Flown, inputs: Mapping[str, Any]) -> Iterator[FigureBlock | Table | str]:
    """Indices of the metrics that matter and, if cases failed, of passing; a sentence for metrics without any."""
    metrics = {name: flown.values(name) for name in flown.key_metrics[:MOST_METRICS]}
    names = {name: flown.words(name) for name in metrics}
    if flown.verdicts or flown.every.completed < flown.n_tried:
        names[ALL_LIMITS] = inside_words(flown)
        metrics[ALL_LIMITS] = inside(flown).astype(np.float64)
    indices = designed_indices(flown.design, flown.case_ids, inputs, metrics, flown.stated.confidence)
    main = "total" if flown.design == "saltelli" else "mu_star"
    shown = np.flatnonzero(np.isfinite(indices.values[main]).any(axis=0))
    silent = [names[name] for k, name in enumerate(indices.metrics) if k not in shown]
    if shown.size and flown.design == "saltelli":
        yield _index_figure(flown, indices, shown, names)
    if shown.size:
        yield _index_table(flown, indices, shown, names, main)
    if silent:
        few = f", or make up {given_percent(MOST_VARIANCE)} of its variance" if flown.design == "saltelli" else ""
        yield (
            f"No indices for {', '.join(silent)}: the same in all cases that have it, or fewer than {FEWEST_BLOCKS} "
            f"whole {BLOCKS[flown.design]} have a number{few}."
        )
    yield from further_metrics(flown)
    yield "Fractions of the cases of this design estimate no probabilities: its cases are not independent random draws."


def further_metrics(flown: Flown) -> Iterator[str]:
    """A sentence on the metrics that tables and figures of contributors leave out, and where their effects are."""
    key = flown.key_metrics[:MOST_METRICS]
    others = [name for name, summary in flown.summaries.items() if name not in key and not summary.constant]
    if others:
        known = flown.contributions.by_metric if flown.contributions else {}
        elsewhere = "not shown; metrics with a requirement or in a figure come first"
        where = "in report.json" if known.keys() >= set(others) else elsewhere
        yield f"The effects on {counted(len(others), 'other metric')} are {where}."


def _index_figure(flown: Flown, indices: DesignedIndices, shown: np.ndarray, names: Mapping[str, str]) -> FigureBlock:
    by_metric = [(names[indices.metrics[k]], _contributors(indices, int(k))) for k in shown]
    source = f"from {used_of(indices.n_used[shown].tolist(), indices.n_tried)} blocks of the design{flown.sample_words}"
    return contributor_figure(flown, by_metric, source)


def _contributors(indices: DesignedIndices, k: int) -> list[Contributor]:
    def known(index: str, row: int) -> tuple[float, tuple[float, float]]:
        value, reach = float(indices.values[index][row, k]), float(indices.reach[index][row, k])
        return value, (value - reach, value + reach)

    rows = []
    for row, name in enumerate(indices.inputs):
        (first, first_interval), (total, total_interval) = known("first_order", row), known("total", row)
        rows.append(Contributor(indices.metrics[k], name, first, total, first_interval, total_interval))
    return rows


def _index_table(
    flown: Flown, designed: DesignedIndices, shown: np.ndarray, names: Mapping[str, str], main: str
) -> Table:
    indices = list(designed.values)
    columns = (
        Column("Metric", "text", grouped=True),
        Column("Input", "text"),
        *(Column(_TITLES[index], "number") for index in indices),
    )
    rows = []
    for k in shown:
        name = designed.metrics[k]
        used = f"{count(int(designed.n_used[k]))} / {count(designed.n_tried)} {BLOCKS[designed.design]}"
        unit = flown.unit(name) if designed.design == "morris" else ""
        metric = Cell(axis_label(names[name], unit), small=used)
        effects = designed.values[main][:, k]
        least = ROUNDING * float(np.nanmax(effects))
        for row in np.argsort(-effects, kind="stable")[:MOST_INPUTS]:
            cells = [_cell(designed.values[index][row, k], designed.reach[index][row, k], least) for index in indices]
            rows.append((metric, Cell(flown.words(designed.inputs[row])), *cells))
    confidence = given_percent(flown.stated.confidence)
    if designed.design == "saltelli":
        note = _saltelli_note(designed, confidence)
        return Table(f"Sobol’ indices of Saltelli’s blocks{flown.sample_words}", columns, tuple(rows), note)
    return Table(
        f"Elementary effects of Morris’s trajectories{flown.sample_words}",
        columns,
        tuple(rows),
        _morris_note(confidence),
    )


def _cell(value: float, reach: float, least: float) -> Cell:
    """An index and half its interval; what is below `least` is the rounding of a zero.  A dash for NaN."""
    if not np.isfinite(value):
        return Cell("–")
    value, reach = (0.0 if abs(index) < least else float(index) for index in (value, reach))
    return Cell(number(value, 3), value, f"± {number(reach, 2)}" if np.isfinite(reach) else "")


def _saltelli_note(indices: DesignedIndices, confidence: str) -> str:
    return (
        f"± half the {confidence} interval (bootstrap over blocks; analysis by SALib). First-order index: "
        "fraction of the variance due to this input alone; total index: fraction due to it and its interactions; below "
        "0 or above 1 it is an error of the estimate, as of metrics with long tails and too few blocks. A "
        f"block is {len(indices.inputs) + 2} cases; one with a case that has no number is left out whole. Random draws "
        "in flight count into every total index."
    )


def _morris_note(confidence: str) -> str:
    return (
        f"± half the {confidence} interval (bootstrap; analysis by SALib). An effect is the metric’s change "
        "as one input steps between the middles of quarters of its distribution that lie two apart, divided by 2/3. "
        "μ*: mean size; μ: mean; σ: standard deviation, large where the effect bends or depends on other inputs. It "
        "ranks inputs; Sobol’ indices need the design saltelli. Steps between more than two words have no direction, "
        "and so no μ and σ. A trajectory with a case that has no number is left out whole. Random draws in flight "
        "enlarge every μ* and σ."
    )
