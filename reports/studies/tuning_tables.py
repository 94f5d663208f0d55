"""The tables of a tuning's report: the front, the published points, its goals, and where the numbers come from."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from mc_engine.studies.tuning_folder import least_violating
from reports.document.blocks import Cell, Column, Table
from reports.sections.provenance import origin_table
from reports.sections.tables import dispersed_table, value_table
from reports.studies.tuned import Tuned, inside, limit_words
from reports.text.numbers import axis_label, column_texts, count, exact, number, percent, with_unit
from reports.text.source_places import of_source

ROWS_SHOWN = 30  # of the front
MOST_PARAMETERS = 8  # in the table of the front
SPARE = 0.02  # of a bound: a front that comes so near is held by it


def front_table(tuned: Tuned) -> Table:
    best = tuned.best
    rows = np.unique(np.linspace(0, len(best) - 1, min(len(best), ROWS_SHOWN)).round().astype(int))
    caption = "The front" if tuned.record.feasible else "Best if the constraints are left out"
    if len(rows) < len(best):
        caption = f"{caption}: {count(len(rows))} of {count(len(best))} candidates, evenly along it"
    left_out = len(tuned.parameters) - MOST_PARAMETERS
    note = f"{left_out} more parameters are in front.parquet." if left_out > 0 else ""
    return _candidate_table(tuned, best.iloc[rows], caption, note)


def least_table(tuned: Tuned) -> Table | None:
    """The candidate nearest to the limits, where none is inside."""
    nearest = None if tuned.record.feasible else least_violating(tuned.record)
    if nearest is None:
        return None
    rows = tuned.evaluations.loc[[nearest.name]]
    return _candidate_table(tuned, rows, "The least violation found", "")


def _candidate_table(tuned: Tuned, rows: pd.DataFrame, caption: str, note: str) -> Table:
    parameters = tuned.parameters[:MOST_PARAMETERS]
    names = [*tuned.objectives, *tuned.constraints, *parameters]
    columns = (
        Column("Candidate", "number"),
        *(Column(tuned.label(name), "number") for name in names),
    )
    limits = {constraint["name"]: constraint for constraint in tuned.plan["constraints"]}
    texts = {name: column_texts(rows[name].tolist()) for name in names}
    body = []
    for place, (_, row) in enumerate(rows.iterrows()):
        cells = [Cell(count(int(row["candidate"])), int(row["candidate"]))]
        for name in names:
            value = float(row[name])
            outside = name in limits and not bool(inside(np.array(value), limits[name]))
            known = value if np.isfinite(value) else None
            cells.append(Cell(texts[name][place], known, tone="bad" if outside else ""))
        body.append(tuple(cells))
    return Table(caption, columns, tuple(body), note)


def held_by_bounds(tuned: Tuned) -> list[str]:
    held = []
    for parameter in tuned.plan["parameters"]:
        spare = SPARE * (parameter["upper"] - parameter["lower"])
        name, values = parameter["name"], tuned.best[parameter["name"]]
        for side, near in (
            ("lower", values <= parameter["lower"] + spare),
            ("upper", values >= parameter["upper"] - spare),
        ):
            if near.all():
                bound = with_unit(exact(parameter[side]), tuned.units[name])
                held.append(f"{name} at its {side} one, {bound}")
    return held


def published_table(tuned: Tuned) -> Table | None:
    """Each published point beside the candidate that does best against it."""
    if not tuned.plan["published"] or not len(tuned.best):
        return None
    columns = (
        Column("Point", "text"),
        *(Column(tuned.label(name), "number") for name in tuned.objectives),
        *(Column(f"computed, {tuned.label(name)}", "number") for name in tuned.objectives),
        Column("Computed is", "text"),
        Column("Source", "text"),
    )
    best = tuned.best[tuned.objectives].to_numpy()
    rows = []
    for record in tuned.plan["published"]:
        point = np.array([record["values"][name] for name in tuned.objectives])
        # the candidate whose worst shortfall against the point, in shares of it, is smallest
        shortfall = (tuned.signs * (best - point) / np.where(point == 0.0, 1.0, np.abs(point))).max(axis=1)
        ours = best[int(shortfall.argmin())]
        good = bool(shortfall.min() <= 0.0)
        words_ = "no worse in any objective" if good else f"{percent(float(shortfall.min()))} worse in one"
        limits = "" if tuned.record.feasible else "outside a constraint"
        cells = [Cell(number(value, 5), float(value)) for value in (*point, *ours)]
        verdict = Cell(words_, small=limits, tone="good" if good and not limits else "open")
        rows.append((Cell(of_source(record["name"])), *cells, verdict, Cell(of_source(record["source"]))))
    note = "Computed: the candidate of the front that falls least short of the point in its worst objective."
    return Table("Published points compared with the front", columns, tuple(rows), note)


def parameter_table(tuned: Tuned) -> Table:
    columns = (
        Column("Parameter", "name"),
        Column("From", "number"),
        Column("To", "number"),
        Column("On the front" if tuned.record.feasible else "Best without constraints", "number"),
        Column("Untuned", "number"),
        Column("Source of the range", "text"),
    )
    rows = []
    for parameter in tuned.plan["parameters"]:
        name = parameter["name"]
        on_front = " to ".join(tuned.ends(name)) if len(tuned.best) else "–"
        cells = [Cell(exact(parameter[key]), float(parameter[key])) for key in ("lower", "upper")]
        label = Cell(axis_label(name, tuned.units[name]), small=tuned.descriptions[name])
        nominal = Cell(exact(parameter["nominal"]), float(parameter["nominal"]))
        rows.append((label, *cells, Cell(on_front), nominal, Cell(of_source(parameter["source"] or "not stated"))))
    return Table("Tuned parameters", columns, tuple(rows))


def measure_table(tuned: Tuned) -> Table:
    columns = (
        Column("Name", "name"),
        Column("What", "text"),
        Column("Metric", "name"),
        Column("Wanted", "text"),
        Column("Source", "text"),
    )
    rows = [
        (Cell(objective["name"]), Cell("objective"), _metric_cell(tuned, objective), Cell(objective["goal"]), Cell(""))
        for objective in tuned.plan["objectives"]
    ]
    rows += [
        (
            Cell(constraint["name"]),
            Cell("constraint"),
            _metric_cell(tuned, constraint),
            Cell(limit_words(tuned, constraint)),
            Cell(of_source(constraint["source"])),
        )
        for constraint in tuned.plan["constraints"]
    ]
    return Table("Objectives and constraints", columns, tuple(rows))


def _metric_cell(tuned: Tuned, measure: Mapping[str, Any]) -> Cell:
    return Cell(axis_label(measure["metric"], tuned.units[measure["name"]]), small=tuned.descriptions[measure["name"]])


def input_tables(tuned: Tuned) -> Iterator[Table | str | None]:
    records = tuned.manifest.get("inputs", [])
    if records and int(tuned.plan["cases"]) > 1:
        yield dispersed_table(records, "Dispersed inputs of the cases that every candidate flies")
    fixed = [record for key in ("settings", "parameters") for record in tuned.manifest.get(key, [])]
    fixed = [record for record in fixed if record["name"] not in tuned.parameters]
    yield value_table(fixed, "Settings and parameters common to all candidates")


def provenance_table(tuned: Tuned) -> Table:
    seeds = ("seed of the search", tuned.plan["seed"]), ("seed of the cases", tuned.manifest["campaign"]["seed"])
    return origin_table("tuning", tuned.name, tuned.manifest, seeds)
