"""Single cases: the worst, the failed, and all of them when there are only a few; each can be repeated alone."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from mc_engine.shell_words import shell_word
from reports.document import Cell, Column, Table
from reports.flown import ColumnFacts, Flown
from reports.numbers import axis_label, count, exact, number, with_unit

WORST = 5
WORST_METRICS = 4
FAILED_SHOWN = 10
INPUTS_SHOWN = 4
FEW_CASES = 12
METRICS_SHOWN = 5


def case_table(flown: Flown) -> Table | None:
    """Every case with its inputs and the metrics that matter, when there are no more than a dozen."""
    if not 0 < flown.n_tried <= FEW_CASES:
        return None
    inputs = varying_inputs(flown)[:INPUTS_SHOWN]
    metrics = [flown.columns[name] for name in flown.key_metrics[:METRICS_SHOWN]]
    columns = (
        Column("Case", "number", 0.8),
        *(Column(axis_label(flown.words(fact.name), fact.unit), "number", 1.3) for fact in inputs),
        *(Column(axis_label(flown.words(fact.name), fact.unit), "number", 1.5) for fact in metrics),
        Column("Status", "code", 1.2),
    )
    values = [flown.values(fact.name) for fact in metrics]
    rows = tuple(
        (
            Cell(str(case), int(case), case=int(case)),
            *(_input_cell(flown.cases[fact.name].iloc[row]) for fact in inputs),
            *(Cell(number(column[row]), _sortable(column[row])) for column in values),
            Cell(str(flown.cases["status"].iloc[row])),
        )
        for row, case in enumerate(flown.case_ids)
    )
    return Table("Case by case", columns, rows, "Inputs that are the same in all cases stand under Inputs.")


def _sortable(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def varying_inputs(flown: Flown) -> list[ColumnFacts]:
    """The dispersed inputs that differ between the cases."""
    return [fact for fact in flown.with_role("dispersion") if flown.cases[fact.name].nunique() > 1]


def input_words(flown: Flown, row: int) -> str:
    """What sets a case apart, for the key of a figure: its first two inputs that vary."""
    parts = []
    for fact in varying_inputs(flown)[:2]:
        value = with_unit(_input_cell(flown.cases[fact.name].iloc[row]).text, fact.unit)
        parts.append(f"{flown.words(fact.name)} {value}")
    return ", ".join(parts)


def worst_tables(flown: Flown) -> Iterator[Table]:
    """The worst cases of the metrics that matter, then the first failed cases; each with its replay command."""
    for metric in flown.key_metrics[:WORST_METRICS]:
        rows = flown.worst(metric, WORST)
        if rows.size and not flown.summaries[metric].constant:
            which = "largest" if flown.large_is_bad(metric) else "smallest"
            yield _case_table(flown, f"Cases with the {which} {flown.words(metric)}", metric, rows)
    failed = np.flatnonzero(~flown.ok)
    if failed.size:
        title = f"Failed cases: the first {min(FAILED_SHOWN, failed.size)} of {count(failed.size)}"
        yield _case_table(flown, title, None, failed[:FAILED_SHOWN])


def _case_table(flown: Flown, caption: str, metric: str | None, rows: np.ndarray) -> Table:
    inputs = flown.with_role("dispersion")
    shown = inputs[:INPUTS_SHOWN]
    result = (
        Column(axis_label(flown.words(metric), flown.unit(metric)), "number", 1.6)
        if metric
        else Column("Status", "code", 1.4)
    )
    columns = (
        Column("Case", "number", 0.9),
        result,
        *(Column(axis_label(fact.name, fact.unit), "number", 1.3) for fact in shown),
        Column("Repeat it alone", "code", 3.6),
    )
    values = flown.values(metric) if metric else None
    cells = []
    for row in rows:
        case = int(flown.case_ids[row])
        outcome = (
            Cell(str(flown.cases["status"].iloc[row]))
            if values is None
            else Cell(number(values[row]), float(values[row]))
        )
        drawn = (_input_cell(flown.cases[fact.name].iloc[row]) for fact in shown)
        replay = Cell(f"mc-engine replay {shell_word(flown.name)} {case}")
        cells.append((Cell(count(case), case, case=case), outcome, *drawn, replay))
    hidden = len(inputs) - len(shown)
    note = f"{hidden} more dispersed inputs stand in the case table." if hidden > 0 else ""
    return Table(caption, columns, tuple(cells), note)


def _input_cell(value: Any) -> Cell:
    if isinstance(value, str | bool | np.bool_):
        return Cell(exact(bool(value) if isinstance(value, np.bool_) else value))
    return Cell(number(float(value), 4), _sortable(float(value)))
