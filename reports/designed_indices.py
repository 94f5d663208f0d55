"""What drives the metrics of a run that was designed to tell: Sobol' indices of Saltelli's blocks, Morris's effects."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mc_engine.statistics.designed_indices import CONFIDENCE, FEWEST_BLOCKS, DesignedIndices, designed_indices
from reports.document import Cell, Column, FigureBlock, Table
from reports.figures import IndexMap
from reports.flown import Flown
from reports.numbers import axis_label, count, number, percent

MOST_METRICS = 8
MOST_INPUTS = 12  # in the figure, and a metric in the table
INSIDE = "inside all limits"
BLOCKS = {"saltelli": "blocks", "morris": "trajectories"}
_TITLES = {
    "first_order": "First-order index",
    "total": "Total index",
    "mu_star": "μ*",
    "mu": "μ",
    "sigma": "σ of the effects",
}


def designed_blocks(
    flown: Flown, inputs: Mapping[str, Any], failed: Mapping[str, np.ndarray]
) -> Iterator[FigureBlock | Table | str]:
    """Indices of the metrics that matter and, if cases failed, of passing; a sentence for metrics without any."""
    metrics = {name: flown.values(name) for name in flown.key_metrics[:MOST_METRICS]}
    names = {name: flown.words(name) for name in metrics}
    if failed:
        names[INSIDE] = INSIDE
        metrics[INSIDE] = (~np.any(list(failed.values()), axis=0)).astype(np.float64)
    found = designed_indices(flown.design, flown.case_ids, inputs, metrics)
    main = "total" if flown.design == "saltelli" else "mu_star"
    shown = np.flatnonzero(np.isfinite(found.values[main]).any(axis=0))
    silent = [names[name] for k, name in enumerate(found.metrics) if k not in shown]
    if shown.size and flown.design == "saltelli":
        yield _figure(flown, found, shown, names)
    if shown.size:
        yield _table(flown, found, shown, names, main)
    if silent:
        yield (
            f"No indices for {', '.join(silent)}: the same in all cases that have it, or fewer than {FEWEST_BLOCKS} "
            f"whole {BLOCKS[flown.design]} with a number."
        )
    yield "Shares of cases of this design estimate no probabilities: its cases belong together and are no random draws."


def _figure(flown: Flown, found: DesignedIndices, shown: np.ndarray, names: Mapping[str, str]) -> FigureBlock:
    total = found.values["total"][:, shown]
    order = np.argsort(-np.nan_to_num(total, nan=-1.0).max(axis=1), kind="stable")[:MOST_INPUTS]
    drawing = IndexMap(
        inputs=tuple(flown.words(found.inputs[k]) for k in order),
        metrics=tuple(names[found.metrics[k]] for k in shown),
        share=total[order],
        n_used=(int(found.n_used[shown].min()), int(found.n_used[shown].max())),
        n_tried=found.n_tried,
        index="total index",
        none="the input does nothing, alone or with others",
        all="nothing happens without it",
        counted="blocks",
    )
    return FigureBlock("Share of each metric’s variance that stays when all other inputs are known.", drawing, "wide")


def _table(flown: Flown, found: DesignedIndices, shown: np.ndarray, names: Mapping[str, str], main: str) -> Table:
    indices = list(found.values)
    columns = (
        Column("Metric", "text", 2.2),
        Column("Input", "text", 2.4),
        *(Column(_TITLES[index], "number", 1.6) for index in indices),
    )
    rows = []
    for k in shown:
        name = found.metrics[k]
        used = f"{count(int(found.n_used[k]))} / {count(found.n_tried)} {BLOCKS[found.design]}"
        unit = flown.unit(name) if found.design == "morris" else ""
        metric = Cell(axis_label(names[name], unit), small=used)
        for row in np.argsort(-found.values[main][:, k], kind="stable")[:MOST_INPUTS]:
            cells = [_cell(found.values[index][row, k], found.reach[index][row, k]) for index in indices]
            rows.append((metric, Cell(flown.words(found.inputs[row])), *cells))
    if found.design == "saltelli":
        return Table("Sobol’ indices of Saltelli’s blocks", columns, tuple(rows), _saltelli_note(found))
    return Table("Elementary effects of Morris’s trajectories", columns, tuple(rows), _morris_note())


def _cell(value: float, reach: float) -> Cell:
    text = number(value, 3)
    return Cell(text, float(value), f"± {number(reach, 2)}" if np.isfinite(reach) else "")


def _saltelli_note(found: DesignedIndices) -> str:
    return (
        f"± half the {percent(CONFIDENCE)} interval (bootstrap over blocks; analysis by SALib). First-order: the share "
        "of the variance that goes when this input alone becomes known; total: the share that stays when all others "
        f"are. A block is {len(found.inputs) + 2} cases; one with a case that has no number is left out whole. Noise "
        "in flight counts into every total index."
    )


def _morris_note() -> str:
    return (
        f"± half the {percent(CONFIDENCE)} interval (bootstrap; analysis by SALib). An effect is the metric’s change "
        "as one input steps between the middles of quarters of its distribution that lie two apart, divided by 2/3. "
        "μ*: mean size; μ: mean; σ: standard deviation, large where the effect bends or depends on other inputs. It "
        "ranks inputs; shares of variance need design saltelli. A trajectory with a case that has no number is left "
        "out whole."
    )
