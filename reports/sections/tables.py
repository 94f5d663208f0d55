"""The tables of results and inputs: summaries, ranges, quantiles, statuses, fixed values, dispersed inputs."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mc_engine.statistics import Quantile, Summary, Verdict
from mc_engine.units import convert
from reports.document.blocks import Cell, Column, Table
from reports.run.chosen_units import chosen_unit
from reports.run.flown import Flown
from reports.sections.case_tables import not_nominal
from reports.text.numbers import (
    axis_label,
    count,
    exact,
    fixed,
    given_percent,
    interval,
    limit_number,
    number,
    percent,
    spelled,
    with_unit,
)
from reports.text.source_places import of_source

TONES = {"pass": "good", "fail": "bad", "not demonstrable": "open"}
REASONS_SHOWN = 20
SHORT_NUMBER = 5  # letters of a fraction that stays in its own unit: 0.005 1/s
LONGEST_NUMBER = 14  # letters of a parameter’s value; a longer one is a computed number


def limit_text(verdict: Verdict, unit: str) -> str:
    """The required limit in words: at most 2.5 kg."""
    at_most = None if verdict.at_most is None else with_unit(limit_number(verdict.at_most), unit)
    at_least = None if verdict.at_least is None else with_unit(limit_number(verdict.at_least), unit)
    if at_most and at_least:
        return f"from {at_least} to {at_most}"
    return f"at most {at_most}" if at_most else f"at least {at_least}"


def summary_table(flown: Flown) -> Table:
    """Moments and range of every metric, beside its nominal value; the shape of a random sample."""
    columns = (
        Column("Metric", "text"),
        Column("Used / tried", "number"),
        Column("Nominal", "number"),
        Column("Mean", "number"),
        Column("Std. dev.", "number"),
        Column("Smallest", "number"),
        Column("Largest", "number"),
        *((Column("Shape", "text"),) if flown.random else ()),
    )
    rows = []
    for name, summary in flown.summaries.items():
        nominal = flown.nominal_value(name)
        cells = [(value, number(value, scale=summary.spread)) for value in (nominal, summary.mean)]
        cells += [(summary.sd, "0" if summary.constant and summary.sd else number(summary.sd, scale=summary.spread))]
        cells += [(value, number(value, scale=summary.spread)) for value in (summary.minimum, summary.maximum)]
        shape = [shape_cell(summary)] if flown.random else []
        rows.append(
            (metric_cell(flown, name), used_cell(summary), *(Cell(text, value) for value, text in cells), *shape)
        )
    note = "Used / tried: cases with a number, of all cases flown."
    if flown.random:
        note += (
            " Shape: skewness and excess kurtosis, both 0 for a normal distribution; “not normal” where they and the "
            "D’Agostino–Pearson test agree."
        )
    return Table("Statistics of the metrics", columns, tuple(rows), note)


def range_table(flown: Flown) -> Table:
    """Both ends of every metric over cases that were chosen, with the case and its inputs, beside its nominal value."""
    columns = (
        Column("Metric", "text"),
        Column("Used / tried", "number"),
        Column("Nominal", "number"),
        Column("Smallest", "text"),
        Column("Largest", "text"),
    )
    rows = tuple(
        (
            metric_cell(flown, name),
            used_cell(summary),
            Cell(number(flown.nominal_value(name), scale=summary.spread), flown.nominal_value(name)),
            *(_end_cell(flown, name, summary, end) for end in (summary.minimum, summary.maximum)),
        )
        for name, summary in flown.summaries.items()
    )
    note = (
        "Used / tried: cases with a number, of all cases flown. Small: the case with this value, and its inputs "
        "that are not nominal. The cases were chosen: their mean, standard deviation and percentiles would be those of "
        "the choice."
    )
    return Table("Ranges of the metrics", columns, rows, note)


def _end_cell(flown: Flown, name: str, summary: Summary, value: float | None) -> Cell:
    """The smallest or the largest value, and where it is: not known of a table that is a sample."""
    if flown.sampled or value is None:
        return Cell(number(value, scale=summary.spread), value)
    rows = np.flatnonzero(flown.values(name) == value)
    where = f"case {count(int(flown.case_ids[rows[0]]))}: {not_nominal(flown, int(rows[0]))}"
    if summary.constant:
        where = "all cases with a number"
    elif rows.size > 1:
        where = f"{count(rows.size)} cases, first {where}"
    return Cell(number(value, scale=summary.spread), value, small=where)


def metric_cell(flown: Flown, name: str) -> Cell:
    """A metric with its unit; below, its meaning, or its column's name."""
    return Cell(flown.label(name), small=flown.columns[name].description or name)


def used_cell(summary: Summary) -> Cell:
    """Cases with a number, of all cases flown."""
    return Cell(f"{count(summary.n_used)} / {count(summary.n_tried)}", summary.n_used)


def shape_cell(summary: Summary) -> Cell:
    """Skewness and kurtosis in words."""
    if summary.constant:
        return Cell("constant", small="" if summary.minimum == summary.maximum else "but for rounding")
    if summary.shape is None:
        return Cell("–")
    shape = summary.shape
    figures = f"{fixed(shape.skewness, 2)}, {fixed(shape.excess_kurtosis, 2)}"
    return Cell("near normal" if shape.looks_normal else "not normal", small=figures)


def quantile_cell(flown: Flown, quantile: Quantile, spread: float | None, digits: int = 5) -> Cell:
    """A quantile; below it, of a random sample, its interval."""
    below = interval(quantile.lower, quantile.upper, spread) if flown.random else ""
    return Cell(number(quantile.value, digits, spread), quantile.value, below)


def quantile_table(flown: Flown) -> Table | None:
    """The quantiles of every metric with their intervals; None if no metric has one."""
    drawn = {name: summary for name, summary in flown.summaries.items() if summary.quantiles and not summary.constant}
    if not drawn:
        return None
    shown = (flown.stated.outer[0], 0.5, flown.stated.outer[1])
    columns = (
        Column("Metric", "text"),
        Column("Used / tried", "number"),
        *(Column(given_percent(probability), "number") for probability in shown),
    )
    rows = []
    for name, summary in drawn.items():
        cells = [quantile_cell(flown, item, summary.spread) for item in summary.quantiles if item.probability in shown]
        rows.append((Cell(flown.label(name)), used_cell(summary), *cells))
    each = given_percent(flown.stated.confidence)
    note = (
        f"In brackets: distribution-free limits from order statistics, each holding with {each}{_for_fixed(flown)}; "
        if flown.random
        else ""
    )
    note += (
        "a dash: too few cases for a limit." if flown.random else "Percentiles of the flown cases, not of a population."
    )
    if any(summary.n_used < summary.n_tried for summary in drawn.values()):
        note += " Where fewer cases are used than tried, they are of the cases with a number alone."
    return Table("Percentiles of the metrics", columns, tuple(rows), note)


def _for_fixed(flown: Flown) -> str:
    """A restriction for bounds of a run whose number of cases was decided by interim analyses; else empty."""
    if not flown.looked:
        return ""
    return " for a number of cases fixed in advance (with interim analyses they hold somewhat less often)"


def status_table(flown: Flown) -> Table:
    """Completion of the cases: each status with its meaning; reasons of refused and failed cases below it."""
    columns = (
        Column("Status", "code"),
        Column("Cases", "number"),
        Column("Fraction", "number"),
        Column("Meaning", "text"),
    )
    counts = flown.every.statuses
    words = sorted(counts, key=lambda word: (word != "ok", -counts[word], word))
    rows = [_status_row(word, counts[word], flown.n_tried, flown.status_text(word)) for word in words]
    rows += [_status_row("", cases, flown.n_tried, reason) for reason, cases in _reasons(flown)]
    rows.append(_status_row("all", flown.n_tried, flown.n_tried, f"flown of {count(flown.n_wanted)} required"))
    return Table("Completion of the cases", columns, tuple(rows))


def _reasons(flown: Flown) -> list[tuple[str, int]]:
    reasons = [(f"reason: {reason}", cases) for reason, cases in flown.every.reasons.items()]
    if len(reasons) > REASONS_SHOWN:
        rest = reasons[REASONS_SHOWN - 1 :]
        reasons = [*reasons[: REASONS_SHOWN - 1], (f"{len(rest)} other reasons", sum(cases for _, cases in rest))]
    return reasons


def _status_row(word: str, cases: int, tried: int, text: str) -> tuple[Cell, ...]:
    share = cases / tried if tried else None
    failed = word not in ("ok", "all")  # one failed case of 100 000 is not 0 %
    return Cell(word), Cell(count(cases), cases), Cell(percent(share, up=failed), share), Cell(text)


def fixed_table(flown: Flown, caption: str, overridden: bool) -> Table | None:
    """Parameters and settings that all cases share: those that the campaign file sets, or the others; None for none."""
    return value_table([record for record in flown.fixed if bool(record.get("overridden")) == overridden], caption)


def value_table(records: Iterable[Mapping[str, Any]], caption: str) -> Table | None:
    """Parameters and settings with their values; None for none."""
    columns = (Column("Name", "name"), Column("Value", "number"), Column("Meaning", "text"))
    rows = tuple(_fixed_row(record) for record in records)
    return Table(caption, columns, rows) if rows else None


def dispersed_table(records: Iterable[Mapping[str, Any]], caption: str) -> Table:
    """Inputs with their distributions and sources."""
    columns = (Column("Input", "name"), Column("Distribution", "text"), Column("Source", "text"))
    rows = tuple(
        (
            Cell(axis_label(record["name"], record["unit"]), small=record["description"]),
            Cell(distribution_text(record)),
            Cell(of_source(record["source"] or "not stated")),
        )
        for record in records
    )
    return Table(caption, columns, rows)


def distribution_text(record: Mapping[str, Any]) -> str:
    """The distribution of an input with the bounds that it is drawn between."""
    return spelled(", ".join(filter(None, (str(record.get("distribution", "")), str(record.get("bounds", ""))))))


def _fixed_row(record: Mapping[str, Any]) -> tuple[Cell, ...]:
    value, unit = record.get("value", ""), record.get("unit", "")
    text = exact(value)
    if isinstance(value, float):
        shown, told = chosen_unit(unit, [value]), value
        converted = float(f"{convert(value, unit, shown):.12g}") if shown != unit else value
        if len(exact(converted)) < len(text) and (abs(value) >= 1.0 or len(text) > SHORT_NUMBER):
            text, unit, told = exact(converted), shown, converted
        text = text if len(text) <= LONGEST_NUMBER else number(told, 8)
    sort = float(value) if isinstance(value, int | float) else None
    return Cell(str(record["name"])), Cell(with_unit(text, unit), sort), Cell(str(record.get("description", "")))


def input_table(flown: Flown) -> Table | None:
    """The dispersed inputs: nominal, distribution, source, and the range that was drawn."""
    records = flown.manifest.get("inputs", [])
    columns = (
        Column("Input", "name"),
        Column("Nominal", "number"),
        Column("Distribution", "text"),
        Column("Drawn", "number"),
        Column("Source", "text"),
    )
    rows = []
    for record in records:
        name, unit = str(record["name"]), str(record.get("unit", ""))
        ends = flown.every.ends(name)
        spread = 0.5 * (ends[1] - ends[0]) if ends and ends[1] > ends[0] else None
        nominal = record.get("nominal", "")
        if isinstance(nominal, bool):
            drawn = ", ".join(dict.fromkeys(exact(bool(end)) for end in ends or ())) or "–"
        else:
            drawn = " to ".join(number(end, 4, spread) for end in ends) if ends else "–"
        rows.append(
            (
                Cell(axis_label(name, unit), small=str(record.get("description", ""))),
                Cell(exact(nominal) if nominal != "" else "–"),
                Cell(distribution_text(record)),
                Cell(drawn),
                Cell(of_source(str(record.get("source") or "not stated")), small=str(record.get("note") or "")),
            )
        )
    return Table("Dispersed inputs", columns, tuple(rows)) if rows else None
