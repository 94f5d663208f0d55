"""What a source says of many cases beside what this run's cases say: a row a quantity, two columns a statistic."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from mc_engine.studies.published import outcome
from reports.document.blocks import Cell, Column, Table
from reports.run.flown import Flown
from reports.sections.published import STATISTICS, TONES, own_statistic
from reports.text.numbers import axis_label, count, number
from reports.text.source_places import of_source

Record = Mapping[str, Any]
_TITLES = {"mean": "Mean", "standard deviation": "Standard deviation", "farthest": "Farthest from the mean"}


def statistics_tables(flown: Flown) -> Iterator[Table]:
    """One table for each table of the source whose numbers are of the same dispersions as this run's."""
    records = [
        {**record, "ours": ours}
        for record in flown.manifest.get("published", [])
        if (ours := own_statistic(flown, record)) is not None
    ]
    places: dict[str, dict[str, dict[str, Record]]] = {}
    for record in records:
        place = str(record.get("source", "")).split(",")[0]
        places.setdefault(place, {}).setdefault(record["of"], {})[record["statistic"]] = record
    for place, rows in places.items():
        yield _source_table(flown, place, rows, records)


def _source_table(
    flown: Flown, place: str, rows: Mapping[str, Mapping[str, Record]], records: Sequence[Record]
) -> Table:
    used = [name for name in STATISTICS if any(name in row for row in rows.values())]
    columns = [Column("Quantity", "name")]
    for name in used:
        columns += [Column(f"{_TITLES[name]}, published", "number"), Column("computed", "number")]
    body = []
    for of, row in rows.items():
        cells = [Cell(axis_label(of, flown.unit(of)))]
        for name in used:
            cells += _published_and_computed(row[name], records) if name in row else [Cell("–"), Cell("–")]
        body.append(tuple(cells))
    note = (
        f"Computed: {count(flown.every.completed)} cases of this run, with its own dispersions; for the farthest as "
        "many as the source has. Marked with the outcome."
    )
    return Table(f"{of_source(place)} compared with this run", tuple(columns), tuple(body), note)


def _published_and_computed(record: Record, records: Sequence[Record]) -> list[Cell]:
    """The printed number, with what was done to it, and ours with its outcome."""
    published, ours = float(record["published"]), float(record["ours"])
    status = str(record.get("status", ""))
    printed = Cell(number(published, 8), published, small=status if status == "restored" else "")
    verdict = outcome(record, records)
    share = f"{(ours / published - 1.0) * 100.0:+.1f} %, ".replace("-", "−") if published else ""
    return [printed, Cell(number(ours, 6), ours, small=f"{share}{verdict}", tone=TONES[verdict])]
