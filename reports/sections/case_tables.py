"""Single cases: the worst, the failed, and all of them when there are only a few; each can be repeated alone."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from mc_engine.statistics.first_order import Contributor, contributors
from mc_engine.statistics.moments import number_or_none
from mc_engine.statistics.worst import Limits
from reports.document.blocks import Cell, Column, Table
from reports.run.flown import ColumnFacts, Flown
from reports.run.outcomes import inside
from reports.text.numbers import axis_label, column_texts, count, exact, limit_number, with_unit

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
    metrics = flown.key_metrics[:METRICS_SHOWN]
    columns = (
        Column("Case", "number"),
        *(Column(flown.label(name), "number") for name in [*(fact.name for fact in inputs), *metrics]),
        Column("Status", "code"),
    )
    cells = [
        [Cell(str(case), int(case), case=int(case)) for case in flown.case_ids],
        *(_input_cells(flown.cases[fact.name]) for fact in inputs),
        *(_number_cells(flown.values(name)) for name in metrics),
        [Cell(str(word)) for word in flown.cases["status"]],
    ]
    rows = tuple(zip(*cells, strict=True))
    return Table("Case by case", columns, rows, "Inputs that are the same in all cases are listed under Inputs.")


def varying_inputs(flown: Flown) -> list[ColumnFacts]:
    """The dispersed inputs that differ between the cases."""
    return [fact for fact in flown.with_role("dispersion") if flown.cases[fact.name].nunique() > 1]


def input_words(flown: Flown, row: int) -> str:
    """What sets a case apart, for the key of a figure: its first two inputs that vary."""
    return _inputs_in_words(flown, row, varying_inputs(flown)[:2])


def not_nominal(flown: Flown, row: int) -> str:
    """The first inputs of a case that differ from their nominal values."""
    inputs = [
        fact for fact in varying_inputs(flown) if flown.cases[fact.name].iloc[row] != flown.nominal.get(fact.name)
    ]
    return _inputs_in_words(flown, row, inputs[:INPUTS_SHOWN]) or "nominal inputs"


def _inputs_in_words(flown: Flown, row: int, inputs: list[ColumnFacts]) -> str:
    values = [with_unit(_input_cells(flown.cases[fact.name])[row].text, fact.unit) for fact in inputs]
    return ", ".join(f"{flown.words(fact.name)} {value}" for fact, value in zip(inputs, values, strict=True))


def worst_tables(flown: Flown) -> Iterator[Table]:
    """The worst cases of the metrics that matter, those of requirements not met first; then the first failed cases."""
    for metric in flown.worst_first[:WORST_METRICS]:
        cases = flown.worst(metric, WORST)
        if len(cases):
            yield _case_table(flown, _worst_words(flown, metric), metric, cases)
    failed = flown.n_tried - flown.every.completed
    if failed:
        title = "Failed cases" + (f": the first {FAILED_SHOWN} of {count(failed)}" if failed > FAILED_SHOWN else "")
        yield _case_table(flown, title, None, flown.every.failed(FAILED_SHOWN))


def _worst_words(flown: Flown, metric: str) -> str:
    limits = flown.limits(metric)
    if not limits.two_sided:
        return f"Cases with the {'smallest' if limits.at_least is not None else 'largest'} {flown.words(metric)}"
    ends = [with_unit(limit_number(end), flown.unit(metric)) for end in limits.ends]
    return f"Cases with the smallest margin of {flown.words(metric)} to its limits, {ends[0]} and {ends[1]}"


def _case_table(flown: Flown, caption: str, metric: str | None, cases: pd.DataFrame) -> Table:
    """Cases with their status, or a metric and its margin, the inputs that contribute most, and the command to replay.

    Without a metric the inputs are those that contribute most to being inside all limits, of those that the cases have:
    one that failed in the run upstream has none from there.
    """
    inside_of = inside(flown).astype(np.float64)
    given = {name: values for name, values in flown.inputs.items() if metric or cases[name].notna().any()}
    ranked = flown.contributors(metric) if metric else contributors(given, inside_of, flown.design == "sobol")
    ranked = ranked or [Contributor(name, np.nan) for name in flown.inputs]
    shown = [contributor.name for contributor in ranked[:INPUTS_SHOWN]]
    columns = [Column("Case", "number")]
    cells = [[Cell(count(int(case)), int(case), case=int(case)) for case in cases["case_id"]]]
    if metric is None:
        columns.append(Column("Status", "code"))
        cells.append([Cell(str(word)) for word in cases["status"]])
    else:
        values, limits = cases[metric].to_numpy(dtype=np.float64), flown.limits(metric)
        columns.append(Column(flown.label(metric), "number"))
        cells.append(_cells_beside(values, limits.ends))
        if limits != Limits():
            columns.append(Column(axis_label("Margin", flown.unit(metric)), "number"))
            cells.append(_cells_beside(limits.margins(values) * limits.reach, [0.0]))
    for name in shown:
        columns.append(Column(flown.label(name), "number"))
        cells.append(_input_cells(cases[name]))
    if not flown.manifest.get("imported"):  # such cases cannot be flown again
        columns.append(Column("Command to replay, in the run’s folder", "code"))
        cells.append([Cell(f"mc-engine replay . {case}") for case in cases["case_id"]])
    return Table(caption, tuple(columns), tuple(zip(*cells, strict=True)), _inputs_said(flown, ranked, len(shown)))


def _cells_beside(values: np.ndarray, limits: list[float]) -> list[Cell]:
    """Numbers of a column with the digits that tell them apart, also from limits that they are compared with."""
    numbers = values.tolist()
    alone, beside = column_texts(numbers), column_texts([*numbers, *limits])[: len(numbers)]
    texts = max(alone, beside, key=lambda texts: sum(map(len, texts)))
    if set(numbers) <= set(limits):
        texts = [limit_number(value) for value in numbers]
    return [Cell(text, number_or_none(value)) for text, value in zip(texts, numbers, strict=True)]


def _inputs_said(flown: Flown, ranked: list[Contributor], shown: int) -> str:
    """Which inputs the columns are of, where nothing is known of their contributions."""
    n = len(flown.with_role("dispersion"))
    return f"The first {shown} of {n} inputs." if shown < n and not np.isfinite(ranked[0].share) else ""


def _input_cells(column: pd.Series) -> list[Cell]:
    if pd.api.types.is_bool_dtype(column) or not pd.api.types.is_numeric_dtype(column):
        return [Cell(exact(value if isinstance(value, str) else bool(value))) for value in column]
    return _number_cells(column.to_numpy(dtype=np.float64))


def _number_cells(values: np.ndarray) -> list[Cell]:
    texts = column_texts(values.tolist())
    return [Cell(text, number_or_none(value)) for text, value in zip(texts, values.tolist(), strict=True)]
