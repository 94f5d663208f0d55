"""Published values compared with ours.

A record of the manifest's `published`:

  quantity   what it is, in words
  published  the number or the words in the source
  unit       unit of both
  source     place in the source: table, figure, page (optional)
  column     a column of the run that holds the same quantity, in the same unit (optional: no run computes the others)
  at         inputs of the case to compare with, {column: value}; without it, the nominal case (optional)
  tolerance  how far ours may lie from the printed number, from its digits (optional)
  status     how sure the print is: "legible", "restored", ... (optional)
  note       a sentence (optional)
  reason     why the model is expected to differ from the print (optional)

The outcome is that of `mc_engine.studies.published`: reached, close, improved, not reached or unknown.

A number that the source gives of many cases has three more keys.  In a run that disperses the same inputs it stands in
the table of `published_statistics`, beside the statistic of that run:

  statistic  "mean", "standard deviation" or "farthest", the value of the case that is farthest from the mean
  of         the column that it is of
  over       the dispersed inputs; `at` then holds of the inputs that are shared
  cases      how many cases the source has, where that matters to the number (optional)
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from mc_engine.statistics import Summary, summarize
from mc_engine.studies.published import CLOSE, IMPROVED, NOT_REACHED, REACHED, UNKNOWN, WITH_REASON, outcome
from reports.document.blocks import Cell, Column, Table, Text
from reports.run.flown import Flown
from reports.text.numbers import count, counted, exact, number, with_unit
from reports.text.source_places import of_source

TONES = {REACHED: "good", CLOSE: "good", IMPROVED: "good", NOT_REACHED: "open", UNKNOWN: ""}


def published_blocks(flown: Flown) -> Iterator[Table | Text | str]:
    """Published values beside those that this run computes; of the others, how many there are."""
    records = [record for record in flown.manifest.get("published", []) if own_statistic(flown, record) is None]
    computed = [(record, *our_value(flown, record)) for record in records]
    known = [{**record, "ours": ours} for record, ours, _ in computed if ours is not None]
    places = [where for _, ours, where in computed if ours is not None]
    rows = tuple(_value_row(record, where, outcome(record, known)) for record, where in zip(known, places, strict=True))
    columns = (
        Column("Quantity", "text"),
        Column("Published", "number"),
        Column("Computed", "number"),
        Column("Difference", "number"),
        Column("Outcome", "text"),
    )
    note = (
        "Computed: by the nominal case of this run, or by the case named. Difference: computed less published. "
        "Reached: within the printed digits, or within the tolerance of the value; close: within 0.5 % of the print; "
        "improved: by another computation than that of the source."
    )
    if rows:
        yield Table("Published and computed values", columns, rows, note)
    left = len(records) - len(rows)
    if left:
        told = rows or len(records) < len(flown.manifest["published"])
        what = counted(left, f"{'further ' if told else ''}published value")
        these = f"the {flown.held_words}, which alone were looked at" if flown.sampled else "the cases of this run"
        yield f"{what} of the model {'is' if left == 1 else 'are'} not computed by {these}, but by:"
        yield Text((f"mc-engine published {flown.manifest['model']['name']} --compute",), "code")


def _value_row(record: Mapping[str, Any], where: str, verdict: str) -> tuple[Cell, ...]:
    unit = str(record.get("unit", ""))
    published, ours = record.get("published", ""), record["ours"]
    remark = record.get("reason", "") if verdict in WITH_REASON else record.get("note", "")
    status = str(record.get("status", ""))
    return (
        Cell(str(record.get("quantity", "")), small=of_source(str(record.get("source", "")))),
        Cell(_text(published, unit, exact), _as_number(published), small="" if status == "legible" else status),
        Cell(_text(ours, unit, lambda value: number(value, 8)), _as_number(ours), small=where),
        _difference_cell(ours, published, unit),
        Cell(verdict, small=str(remark), tone=TONES[verdict]),
    )


def our_value(flown: Flown, record: Mapping[str, Any]) -> tuple[Any, str]:
    """Our number and where it comes from; (None, why not) if this run does not have it."""
    column = record.get("column")
    at = record.get("at") or {}
    if column:
        value = flown.nominal_value(column)
        if value is not None and _holds({**_shared_inputs(flown), **flown.nominal}, at):
            return value, "nominal case"
        row = _matching_case(flown, at) if at else None
        if row is not None and column in flown.cases.columns:
            return float(flown.values(column)[row]), f"case {count(int(flown.case_ids[row]))}"
    return None, "not flown in this run"


def own_statistic(flown: Flown, record: Mapping[str, Any]) -> float | None:
    """This run's number for a published statistic; None if the record is none, or speaks of other cases."""
    inputs = {fact.name for fact in flown.with_role("dispersion")}
    statistic, shared = record.get("statistic"), _shared_inputs(flown)
    alike = set(record.get("over", ())) == inputs and _holds(shared, record.get("at") or {})
    if statistic not in STATISTICS or not alike or not flown.random:
        return None
    cases = record.get("cases")
    summary = (
        flown.summaries[record["of"]] if cases is None else summarize(flown.every.first_values(record["of"], cases))
    )
    return STATISTICS[statistic](summary) if summary.n_used > 1 else None


def published_law(flown: Flown, name: str) -> tuple[float, float] | None:
    """(mean, standard deviation) that the source prints of a metric for cases with this run's dispersions."""
    printed = {}
    for record in flown.manifest.get("published", []):
        if record.get("of") == name and own_statistic(flown, record) is not None:
            printed[record["statistic"]] = float(record["published"])
    mean, deviation = printed.get("mean"), printed.get("standard deviation", 0.0)
    return None if mean is None or deviation <= 0.0 else (mean, deviation)


def _farthest(summary: Summary) -> float:
    ends, mean = (summary.minimum or 0.0, summary.maximum or 0.0), summary.mean or 0.0
    return max(ends, key=lambda end: abs(end - mean))


STATISTICS: dict[str, Callable[[Summary], float]] = {
    "mean": lambda summary: float(summary.mean or 0.0),
    "standard deviation": lambda summary: float(summary.sd or 0.0),
    "farthest": _farthest,
}


def _shared_inputs(flown: Flown) -> dict[str, Any]:
    """Value of every input that all cases share."""
    return {record["name"]: record.get("value") for record in flown.fixed}


def _holds(row: Mapping[str, Any], at: Mapping[str, Any]) -> bool:
    """Whether the row has all the inputs of `at`."""
    return all(name in row and _same(row[name], value) for name, value in at.items())


def _same(ours: Any, wanted: Any) -> bool:
    if isinstance(wanted, str | bool) or isinstance(ours, str | bool):
        return bool(ours == wanted)
    return bool(np.isclose(float(ours), float(wanted), rtol=1e-9, atol=1e-12))


def _matching_case(flown: Flown, at: Mapping[str, Any]) -> int | None:
    """Row of the first case with the inputs of `at`; inputs that are not dispersed must be those of the run."""
    shared = _shared_inputs(flown)
    match = np.ones(flown.n_held, dtype=bool)
    for name, value in at.items():
        if name in flown.cases.columns:
            match &= _equal(flown.cases[name], value)
        elif name not in shared or not _same(shared[name], value):
            return None
    rows = np.flatnonzero(match)
    return int(rows[0]) if rows.size else None


def _equal(column: pd.Series, value: Any) -> np.ndarray:
    if isinstance(value, str | bool):
        return np.asarray(column == value, dtype=bool)
    numbers = pd.to_numeric(column, errors="coerce").to_numpy(dtype=np.float64)
    return np.isclose(numbers, float(value), rtol=1e-9, atol=1e-12)


def _as_number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _text(value: Any, unit: str, form: Callable[[float], str]) -> str:
    """A number with its unit; words as they are."""
    plain = _as_number(value)
    if plain is None:
        return "–" if value is None else str(value)
    return with_unit(form(plain), unit)


def _difference_cell(ours: Any, published: Any, unit: str) -> Cell:
    mine, printed = _as_number(ours), _as_number(published)
    if mine is None or printed is None or not np.isfinite(mine):
        return Cell("–")
    return Cell(with_unit(number(mine - printed, 3), unit), mine - printed)
