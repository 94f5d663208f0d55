"""Contributors: the inputs behind the spread of each metric, and those that separate failed from passed cases."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mc_engine.statistics.drivers import FALSE_DISCOVERIES, FEWEST, Driver, failure_drivers, success_along
from mc_engine.statistics.sensitivity import FEWEST_CASES, Sensitivity, beyond_chance, sensitivity
from reports.companion_section import companion_blocks
from reports.designed_indices import designed_blocks
from reports.document import Cell, Column, FigureBlock, Table
from reports.figures import IndexMap, SuccessDrawing, SuccessPanel
from reports.flown import Flown
from reports.numbers import count, counted, number, percent
from reports.outcomes import ALL_LIMITS, failures, inside, inside_words

CONFIDENCE = 0.95
MOST_METRICS = 8
MOST_INPUTS = 12  # in the figure
STRONGEST = 4  # inputs a metric in the table
SURELY = 2.0  # standard errors
MOST_DRIVERS = 12
MOST_PANELS = 6
MOST_CASES = 20_000  # above, the indices rest on cases picked evenly


def sensitivity_blocks(flown: Flown) -> Iterator[FigureBlock | Table | str]:
    """Indices of the metrics that matter, then the drivers of the failures; nothing without a dispersed input."""
    inputs = flown.inputs
    if not inputs or not flown.n_tried:
        return
    if flown.design in ("saltelli", "morris"):
        yield from designed_blocks(flown, inputs)
        return
    if not flown.random:
        yield (
            f"The cases of this design ({flown.design}) were chosen, not drawn at random: Sobol’ indices and "
            "contributors to failures would describe that choice. The designs mc, lhs, sobol and halton give them."
        )
        return
    failed = failures(flown)
    found = flown.contributions
    yield from (companion_blocks(flown, found) if found is not None and found.flights else _index_blocks(flown, inputs))
    if failed:
        yield from _driver_blocks(flown, inputs, failed)


# ---- indices


def _index_blocks(flown: Flown, inputs: Mapping[str, Any]) -> Iterator[FigureBlock | Table | str]:
    rows = np.arange(flown.n_tried)[:: -(-flown.n_tried // MOST_CASES)]
    metrics = {name: flown.values(name)[rows] for name in flown.key_metrics[:MOST_METRICS]}
    names = {name: flown.words(name) for name in metrics}
    if flown.verdicts or not flown.ok.all():
        names[ALL_LIMITS] = inside_words(flown)
        metrics[ALL_LIMITS] = inside(flown)[rows].astype(np.float64)
    found = sensitivity({name: values[rows] for name, values in inputs.items()}, metrics)
    shown = np.flatnonzero(np.isfinite(found.first_order).any(axis=0))
    silent = [names[name] for k, name in enumerate(found.metrics) if k not in shown]
    if shown.size:
        yield _index_figure(flown, found, shown, names, rows.size)
        yield _index_table(flown, found, shown, names)
    if silent:
        yield (
            f"No indices for {', '.join(silent)}: the same in all cases that have it, "
            f"or fewer than {FEWEST_CASES} of them."
        )


def _index_figure(
    flown: Flown, found: Sensitivity, shown: np.ndarray, names: Mapping[str, str], n_rows: int
) -> FigureBlock:
    largest = np.nan_to_num(found.first_order[:, shown], nan=-1.0).max(axis=1)
    order = np.argsort(-largest, kind="stable")[:MOST_INPUTS]
    used = found.n_used[shown]
    drawing = IndexMap(
        inputs=tuple(flown.words(found.inputs[k]) for k in order),
        metrics=tuple(names[found.metrics[k]] for k in shown),
        share=found.first_order[np.ix_(order, shown)],
        n_used=(int(used.min()), int(used.max())),
        n_tried=n_rows,
    )
    caption = "First-order Sobol’ index of each input and metric"
    left_out = len(found.inputs) - order.size
    if left_out:
        rest = float(max(np.delete(largest, order).max(), 0.0))
        caption += f"; not shown: {counted(left_out, 'input')}, at most {number(rest, 2)}"
    if n_rows < flown.n_tried:
        caption += f". From {count(n_rows)} cases picked evenly out of {count(flown.n_tried)}"
    return FigureBlock(f"{caption}.", drawing, "wide")


def _index_table(flown: Flown, found: Sensitivity, shown: np.ndarray, names: Mapping[str, str]) -> Table:
    columns = (
        Column("Metric", "text", 2.2),
        Column("Input", "text", 2.4),
        Column("First-order index", "number", 1.4),
        Column("Total index", "number", 1.4),
        Column("SRC", "number", 1.4),
        Column("PRCC", "number", 1.4),
        Column("Spearman", "number", 1.4),
    )
    rows = []
    for k in shown:
        small = f"{count(int(found.n_used[k]))} / {count(found.n_tried)}"
        if np.isfinite(found.r_squared[k]):
            small += f", R² {found.r_squared[k]:.2f}"
        for row in _strongest(found, k):
            cells = [
                _with_error(getattr(found, index)[row, k], getattr(found, f"{index}_error")[row, k])
                for index in ("first_order", "total", "src", "prcc", "spearman")
            ]
            metric = Cell(names[found.metrics[k]], small=small)
            rows.append((metric, Cell(flown.words(found.inputs[row])), *cells))
        if found.unexplained[k] >= 0.005:
            left = Cell(percent(float(found.unexplained[k]), 0), float(found.unexplained[k]))
            rest = (Cell("unexplained by the inputs"), Cell("–"), left, Cell("–"), Cell("–"), Cell("–"))
            rows.append((Cell(names[found.metrics[k]], small=small), *rest))
    return Table(
        f"Contributors to each metric, at most {STRONGEST}",
        columns,
        tuple(rows),
        _index_note(flown, found),
    )


def _strongest(found: Sensitivity, metric: int) -> np.ndarray:
    """Rows of the strongest inputs of a metric; the first one, and those that are surely more than nothing."""
    largest = np.fmax(found.first_order[:, metric], found.total[:, metric])
    order = np.argsort(-np.nan_to_num(largest, nan=-1.0), kind="stable")[:STRONGEST]
    with np.errstate(invalid="ignore"):
        sure = found.first_order[order, metric] > SURELY * found.first_order_error[order, metric]
        sure |= found.total[order, metric] > SURELY * found.total_error[order, metric]
    sure[0] = True
    return order[sure]


def _with_error(value: float, error: float) -> Cell:
    if not np.isfinite(value):
        return Cell("–")
    text = f"{value:.3f}".replace("-", "−")
    small = f"± {error:.3f}" if error >= 0.0005 else "± < 0.001"
    return Cell("0.000" if float(f"{value:.3f}") == 0.0 else text, float(value), small)


def _index_note(flown: Flown, found: Sensitivity) -> str:
    note = (
        "± one standard error, for independent draws; further inputs are within two standard errors of 0, or weaker. "
        "R²: fraction of the variance that the linear regression behind SRC explains. First-order index: fraction of "
        "the variance due to this input alone. Total index: fraction due to this input and its interactions with "
        "others. Unexplained: fraction that the surrogate model behind the total indices attributes to no input "
        "(random draws in flight, discontinuities); a total index may be larger by up to it."
    )
    if found.correlated is not None:
        first, second, rho = found.correlated
        if beyond_chance(rho, found.n_tried):
            note += (
                f" Inputs are correlated, most of all {flown.words(first)} and {flown.words(second)} "
                f"(rank correlation {number(rho, 2)}): first-order and Spearman include what an input owes to its "
                "correlation; total indices require independent inputs and are left out."
            )
    return note


# ---- drivers of the failures


def _driver_blocks(
    flown: Flown, inputs: Mapping[str, Any], failed: Mapping[str, np.ndarray]
) -> Iterator[FigureBlock | Table | str]:
    found = failure_drivers(inputs, failed)
    told = [*found.singles, *found.pairs]
    if told:
        yield _driver_table(flown, found.singles, found.pairs, failed, found.singles_tested, found.pairs_tested)
    elif found.singles_tested:
        yield (
            f"No input, and no pair of inputs, separates failed from passed cases beyond chance "
            f"({count(found.singles_tested)} tests of single inputs, {count(found.pairs_tested)} of pairs, at a "
            f"false-discovery rate of {percent(FALSE_DISCOVERIES)})."
        )
    if found.undecided:
        yield (
            f"Not tested for contributors to failures, fewer than {FEWEST} cases failed or fewer than {FEWEST} passed: "
            f"{', '.join(found.undecided)}."
        )
    if found.singles:
        yield _success_figure(flown, found.singles[:MOST_PANELS], inputs, failed)


def _driver_table(
    flown: Flown,
    singles: tuple[Driver, ...],
    pairs: tuple[Driver, ...],
    failed: Mapping[str, np.ndarray],
    singles_tested: int,
    pairs_tested: int,
) -> Table:
    columns = (
        Column("Requirement", "text", 1.7),
        Column("Contributor", "text", 2.3),
        Column("Cases fail where it is", "text", 2.1),
        Column("Separation", "number", 1.2),
        Column("Adjusted p", "number", 1.3),
        Column("Failed in that cell", "number", 1.5),
    )
    told = [*singles[:MOST_DRIVERS], *pairs[:MOST_DRIVERS]]
    rows = tuple(_driver_row(flown, one, failed) for one in told)
    left_out = len(singles) + len(pairs) - len(told)
    note = (
        f"{count(singles_tested)} tests of single inputs and {count(pairs_tested)} of pairs; false-discovery rate of "
        f"each kind at most {percent(FALSE_DISCOVERIES)} (Benjamini–Hochberg). Separation: Cliff’s delta, 1 if all "
        "failed cases are separated from all passed ones, 0 if none. A pair is listed if it separates better than "
        "each of its inputs; its cell is made of outer thirds. Inputs correlated with a contributor are listed too."
    )
    if left_out:
        note += f" {count(left_out)} weaker ones are not shown."
    return Table("What separates failed cases from passed ones", columns, rows, note)


def _driver_row(flown: Flown, driver: Driver, failed: Mapping[str, np.ndarray]) -> tuple[Cell, ...]:
    lost = int(failed[driver.requirement].sum())
    inside = "–" if not driver.inside_tried else f"{count(driver.inside_failed)} / {count(driver.inside_tried)}"
    return (
        Cell(driver.requirement, small=f"{count(lost)} / {count(flown.n_tried)} failed"),
        Cell(" with ".join(flown.words(name) for name in driver.inputs)),
        Cell(" with ".join(driver.where)),
        Cell(number(driver.effect, 2), driver.effect),
        Cell(number(driver.adjusted, 2), driver.adjusted),
        Cell(inside),
    )


def _success_figure(
    flown: Flown, drivers: tuple[Driver, ...], inputs: Mapping[str, Any], failed: Mapping[str, np.ndarray]
) -> FigureBlock:
    panels = []
    for one in drivers:
        passed = ~failed[one.requirement]
        curve = success_along(inputs[one.inputs[0]], passed, CONFIDENCE)
        if curve is not None:
            panels.append(SuccessPanel(one.requirement, flown.axis(one.inputs[0]), curve, float(passed.mean())))
    return FigureBlock(
        f"Success probability along the inputs that separate failed from passed cases, {count(flown.n_tried)} cases.",
        SuccessDrawing(tuple(panels), CONFIDENCE),
        "half",
    )
