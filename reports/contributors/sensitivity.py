"""Contributors: the inputs behind the spread of each metric, and those that separate failed from passed cases."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mc_engine.statistics.designed_indices import IN_BLOCKS
from mc_engine.statistics.drivers import FALSE_DISCOVERIES, MOST_ROWS, Driver, Drivers, failure_drivers, success_along
from reports.contributors.companion import companion_blocks, no_contributors
from reports.contributors.designed_indices import designed_blocks
from reports.contributors.single_changes import single_change_blocks
from reports.document.blocks import Cell, Column, FigureBlock, Table
from reports.drawing.marks import Drawing
from reports.figures.statistics import success_panel
from reports.run.flown import Flown
from reports.run.outcomes import failures
from reports.text.numbers import count, counted, number, p_value, percent

MOST_DRIVERS = 12
MOST_PANELS = 6
_RANDOM_DRAWS_ALONE = (
    "The cases differ in their random draws alone, which cause all of the variance. To see contributors, list inputs "
    "under [dispersion] in the campaign file; a section [sensitivity] computes their contributions from flights of "
    "their own."
)
_NO_PAIRS = (
    "Pairs of inputs are not tested for contributors to failures: Sobol’ points are not independent, and pairs without "
    "effect would be found too often. Of the designs mc and lhs pairs are tested."
)


def sensitivity_blocks(flown: Flown) -> Iterator[FigureBlock | Table | str]:
    """Indices of the metrics that matter, then the drivers of the failures; a sentence if the inputs have none."""
    inputs = flown.inputs
    if not flown.n_tried:
        return
    if flown.design in IN_BLOCKS:
        yield from designed_blocks(flown, inputs)
        return
    if flown.design == "one_at_a_time":
        yield from single_change_blocks(flown)
        return
    if not flown.random:
        yield (
            f"The cases of this design ({flown.design}) were chosen, not drawn at random: Sobol’ indices and "
            "contributors to failures would describe that choice. The designs mc, lhs and sobol give them."
        )
        return
    failed = failures(flown)
    contributions = flown.contributions
    if contributions is not None:
        yield from companion_blocks(flown, contributions)
    elif inputs.keys() > flown.draws:
        yield from no_contributors(flown, flown.key_metrics)
    elif not all(summary.constant for summary in flown.summaries.values()):
        yield _RANDOM_DRAWS_ALONE
    if failed and inputs:
        yield from _driver_blocks(flown, inputs, failed)


# ---- drivers of the failures


def _driver_blocks(
    flown: Flown, inputs: Mapping[str, Any], failed: Mapping[str, np.ndarray]
) -> Iterator[FigureBlock | Table | str]:
    drivers = failure_drivers(inputs, failed, sobol=flown.design == "sobol")
    if drivers.singles or drivers.pairs:
        yield _driver_table(flown, drivers, failed)
    elif drivers.singles_tested:
        yield (
            f"No input{', and no pair of inputs,' * bool(drivers.pairs_tested)} separates failed from passed cases "
            f"beyond chance ({counted(drivers.singles_tested, 'test')} of single inputs, "
            f"{count(drivers.pairs_tested)} of pairs, at a false-discovery rate of {percent(FALSE_DISCOVERIES)}"
            f"{flown.sample_words})."
        )
    if drivers.undecided:
        these = f"of {flown.held_words} fewer than {drivers.fewest}"
        few = these if flown.sampled else f"fewer than {drivers.fewest} cases"
        yield (
            f"Not tested for contributors to failures, {few} failed or fewer than "
            f"{drivers.fewest} passed: {', '.join(drivers.undecided)}."
        )
    if flown.design == "sobol" and drivers.singles_tested and len(inputs) > 1:
        yield _NO_PAIRS
    if drivers.singles:
        yield _success_figure(flown, drivers.singles[:MOST_PANELS], inputs, failed)


def _driver_table(flown: Flown, drivers: Drivers, failed: Mapping[str, np.ndarray]) -> Table:
    columns = (
        Column("Requirement", "text", grouped=True),
        Column("Contributor", "text"),
        Column("Cases fail where it is", "text"),
        Column("Separation", "number"),
        Column("Adjusted p", "number"),
        Column("Failed in that cell", "number"),
    )
    told = [*drivers.singles[:MOST_DRIVERS], *drivers.pairs[:MOST_DRIVERS]]
    rows = tuple(_driver_row(flown, driver, failed) for driver in told)
    left_out = len(drivers.singles) + len(drivers.pairs) - len(told)
    note = (
        f"{counted(drivers.singles_tested, 'test')} of single inputs and {count(drivers.pairs_tested)} of pairs; "
        f"false-discovery rate of each kind at most {percent(FALSE_DISCOVERIES)} (Benjamini–Hochberg). "
        "Separation: Cliff’s delta, 1 if all failed cases are separated from all passed ones, 0 if none. A pair is "
        "listed if its inputs act together: failures depend on both beyond what each explains alone. Its separation is "
        "that of its cell, the thirds of both inputs where most cases fail. Inputs correlated with a contributor are "
        "listed too."
    )
    if flown.n_held > MOST_ROWS:
        note += f" At most {count(MOST_ROWS // 2)} cases that fail and as many that pass are tested of a requirement."
    if lacking := [
        name for name, values in flown.inputs.items() if values.dtype.kind == "f" and np.isnan(values).any()
    ]:
        note += f" In some cases {flown.listed(lacking)} have no number: each is tested in the others, and in no pair."
    if left_out:
        note += f" {count(left_out)} weaker ones are not shown."
    return Table(f"What separates failed cases from passed ones{flown.sample_words}", columns, rows, note)


def _driver_row(flown: Flown, driver: Driver, failed: Mapping[str, np.ndarray]) -> tuple[Cell, ...]:
    lost = int(failed[driver.requirement].sum())
    inside = "–" if not driver.inside_tried else f"{count(driver.inside_failed)} / {count(driver.inside_tried)}"
    return (
        Cell(driver.requirement, small=f"{count(lost)} / {count(flown.n_held)} failed"),
        Cell(" with ".join(flown.words(name) for name in driver.inputs)),
        Cell(" with ".join(driver.where)),
        Cell(number(driver.effect, 2), driver.effect),
        Cell(p_value(driver.adjusted), driver.adjusted),
        Cell(inside),
    )


def _success_figure(
    flown: Flown, drivers: tuple[Driver, ...], inputs: Mapping[str, Any], failed: Mapping[str, np.ndarray]
) -> FigureBlock:
    panels = []
    for driver in drivers:
        passed = ~failed[driver.requirement]
        curve = success_along(inputs[driver.inputs[0]], passed, flown.stated.confidence)
        if curve is not None:
            label, overall = flown.axis(driver.inputs[0]), float(passed.mean())
            panels.append(success_panel(driver.requirement, label, curve, overall, flown.stated.confidence))
    return FigureBlock(
        f"Success probability along the inputs that separate failed from passed cases, {flown.held_words}.",
        Drawing("Success probability in bins of single inputs", tuple(panels)),
        "half",
    )
