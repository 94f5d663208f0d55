"""The tables of results: verdicts, summaries, quantiles, published values, statuses, worst cases."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from mc_engine.statistics import Summary, Verdict
from reports.document import Cell, Column, Table
from reports.flown import Flown
from reports.numbers import axis_label, count, exact, interval, number, percent, with_unit

TONES = {"pass": "good", "fail": "bad", "not demonstrable": "open"}
REASONS_SHOWN = 20


def limit_text(verdict: Verdict, unit: str) -> str:
    """The required limit in words: at most 2.5 kg."""
    at_most = None if verdict.at_most is None else with_unit(number(verdict.at_most), unit)
    at_least = None if verdict.at_least is None else with_unit(number(verdict.at_least), unit)
    if at_most and at_least:
        return f"from {at_least} to {at_most}"
    return f"at most {at_most}" if at_most else f"at least {at_least}"


def summary_table(flown: Flown) -> Table:
    """Moments and range of every metric beside its nominal value."""
    columns = (
        Column("Metric", "name", 3.0),
        Column("Used / tried", "number", 1.75),
        Column("Nominal", "number", 1.45),
        Column("Mean", "number", 1.45),
        Column("Std. dev.", "number", 1.3),
        Column("Smallest", "number", 1.45),
        Column("Largest", "number", 1.45),
        Column("Shape", "text", 1.5),
    )
    rows = []
    for name, summary in flown.summaries.items():
        nominal = flown.nominal_value(name)
        cells = [(value, number(value, scale=summary.spread)) for value in (nominal, summary.mean)]
        cells += [(summary.sd, "0" if summary.constant and summary.sd else number(summary.sd, scale=summary.spread))]
        cells += [(value, number(value, scale=summary.spread)) for value in (summary.minimum, summary.maximum)]
        used = Cell(f"{count(summary.n_used)} / {count(summary.n_tried)}", summary.n_used)
        rows.append(
            (metric_cell(flown, name), used, *(Cell(text, value) for value, text in cells), shape_cell(summary))
        )
    note = (
        "Used / tried: cases with a number, of all cases flown. Shape: skewness and excess kurtosis, both 0 for a "
        "normal distribution; “not normal” where they and the D’Agostino–Pearson test agree."
    )
    return Table("Statistics of the metrics", columns, tuple(rows), note)


def metric_cell(flown: Flown, name: str) -> Cell:
    """A column's name with its unit, its meaning below."""
    return Cell(axis_label(name, flown.unit(name)), small=flown.columns[name].description)


def shape_cell(summary: Summary) -> Cell:
    """Skewness and kurtosis in words."""
    if summary.constant:
        return Cell("constant", small="" if summary.minimum == summary.maximum else "but for rounding")
    if summary.shape is None:
        return Cell("–")
    shape = summary.shape
    figures = f"{shape.skewness:.2f}, {shape.excess_kurtosis:.2f}".replace("-", "−")
    return Cell("near normal" if shape.looks_normal else "not normal", small=figures)


def quantile_table(flown: Flown) -> Table | None:
    """The quantiles of every metric with their intervals; None if no metric has one."""
    drawn = {name: summary for name, summary in flown.summaries.items() if summary.quantiles}
    if not drawn:
        return None
    first = next(iter(drawn.values()))
    columns = (
        Column("Metric", "name", 2.6),
        *(Column(percent(item.probability, 3), "number", 2.0) for item in first.quantiles),
    )
    rows = []
    for name, summary in drawn.items():
        cells = [
            Cell(
                number(item.value, scale=summary.spread),
                item.value,
                interval(item.lower, item.upper, summary.spread) if flown.random else "",
            )
            for item in summary.quantiles
        ]
        label = Cell(axis_label(name, flown.unit(name)), small=f"{count(summary.n_used)} of {count(summary.n_tried)}")
        rows.append((label, *cells))
    each = percent(0.5 * (1.0 + first.confidence))
    note = (
        f"In brackets: distribution-free limits from order statistics, each holding with {each}{_for_fixed(flown)}; "
        if flown.random
        else ""
    )
    note += (
        "a dash: too few cases for a limit." if flown.random else "Percentiles of the flown cases, not of a population."
    )
    return Table("Percentiles of the metrics", columns, tuple(rows), note)


def _for_fixed(flown: Flown) -> str:
    """What is to be said of such limits where the number of cases was decided on the way."""
    if not flown.looked:
        return ""
    return " for a number of cases fixed in advance (with interim analyses they hold somewhat less often)"


def status_table(flown: Flown) -> Table:
    """Completion of the cases: each status with its meaning; reasons of refused and failed cases below it."""
    columns = (
        Column("Status", "code", 1.2),
        Column("Cases", "number", 1.0),
        Column("Fraction", "number", 1.0),
        Column("Meaning", "text", 6.0),
    )
    counts = flown.cases["status"].astype(str).value_counts(sort=False)
    words = sorted(counts.index, key=lambda word: (word != "ok", -counts[word], word))
    rows = [_status_row(word, int(counts[word]), flown.n_tried, flown.status_text(word)) for word in words]
    rows += [_status_row("", cases, flown.n_tried, reason) for reason, cases in _reasons(flown)]
    rows.append(_status_row("all", flown.n_tried, flown.n_tried, f"flown of {count(flown.n_wanted)} required"))
    return Table("Completion of the cases", columns, tuple(rows))


def _reasons(flown: Flown) -> list[tuple[str, int]]:
    if "reason" not in flown.cases.columns:
        return []
    counts = flown.cases["reason"].dropna().astype(str).value_counts()
    found = [(f"reason: {reason}", int(cases)) for reason, cases in counts.items() if reason]
    if len(found) > REASONS_SHOWN:
        rest = found[REASONS_SHOWN - 1 :]
        found = [*found[: REASONS_SHOWN - 1], (f"{len(rest)} other reasons", sum(cases for _, cases in rest))]
    return found


def _status_row(word: str, cases: int, tried: int, text: str) -> tuple[Cell, ...]:
    share = cases / tried if tried else None
    return Cell(word), Cell(count(cases), cases), Cell(percent(share), share), Cell(text)


def fixed_table(flown: Flown, key: str, caption: str) -> Table | None:
    """The parameters or settings that all cases share; None if there are none."""
    records = flown.manifest.get(key, [])
    columns = (Column("Name", "name", 2.2), Column("Value", "number", 1.3), Column("Meaning", "text", 4.0))
    rows = tuple(_fixed_row(record) for record in records)
    note = "* changed by the campaign file." if any(record.get("overridden") for record in records) else ""
    return Table(caption, columns, rows, note) if rows else None


def _fixed_row(record: Mapping[str, Any]) -> tuple[Cell, ...]:
    value = record.get("value", "")
    text = with_unit(exact(value), record.get("unit", "")) + (" *" if record.get("overridden") else "")
    choices = record.get("choices") or ()
    small = f"one of: {', '.join(str(choice) for choice in choices)}" if choices else ""
    sort = float(value) if isinstance(value, int | float) else None
    return Cell(str(record["name"])), Cell(text, sort), Cell(str(record.get("description", "")), small=small)


def input_table(flown: Flown) -> Table | None:
    """The dispersed inputs: nominal, distribution, source, and the range that was drawn."""
    records = flown.manifest.get("inputs", [])
    columns = (
        Column("Input", "name", 2.4),
        Column("Nominal", "number", 1.1),
        Column("Distribution", "text", 2.2),
        Column("Drawn", "number", 1.8),
        Column("Source", "text", 2.4),
    )
    rows = []
    for record in records:
        name, unit = str(record["name"]), str(record.get("unit", ""))
        values = flown.values(name)
        values = values[np.isfinite(values)]
        drawn = f"{number(float(values.min()), 4)} to {number(float(values.max()), 4)}" if values.size else "–"
        nominal = record.get("nominal", "")
        rows.append(
            (
                Cell(axis_label(name, unit), small=str(record.get("description", ""))),
                Cell(exact(nominal) if nominal != "" else "–"),
                Cell(str(record.get("distribution", ""))),
                Cell(drawn),
                Cell(str(record.get("source") or "not stated"), small=str(record.get("note") or "")),
            )
        )
    return Table("Dispersed inputs", columns, tuple(rows)) if rows else None
