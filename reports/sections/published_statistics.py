"""What a source says of many cases beside what this run's cases say: a row a quantity, two columns a statistic."""

from collections.abc import Iterator, Mapping
from typing import Any

from reports.document.blocks import Cell, Column, Table
from reports.run.flown import Flown
from reports.sections.published import STATISTICS, own_statistic
from reports.text.numbers import axis_label, count, number

_TITLES = {"mean": "Mean", "standard deviation": "Standard deviation", "farthest": "Farthest from the mean"}


def statistics_tables(flown: Flown) -> Iterator[Table]:
    """One table for each table of the source whose numbers are of the same dispersions as this run's."""
    found: dict[str, dict[str, dict[str, Mapping[str, Any]]]] = {}
    for record in flown.manifest.get("published", []):
        if own_statistic(flown, record) is not None:
            place = str(record.get("source", "")).split(",")[0]
            found.setdefault(place, {}).setdefault(record["of"], {})[record["statistic"]] = record
    for place, rows in found.items():
        yield _source_table(flown, place, rows)


def _source_table(flown: Flown, place: str, rows: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> Table:
    used = [name for name in STATISTICS if any(name in row for row in rows.values())]
    columns = [Column("Quantity", "name", 2.0)]
    for name in used:
        columns += [Column(f"{_TITLES[name]}, published", "number", 1.4), Column("computed", "number", 1.4)]
    body = []
    for of, row in rows.items():
        cells = [Cell(axis_label(of, flown.unit(of)))]
        for name in used:
            cells += _published_and_computed(flown, row[name]) if name in row else [Cell("–"), Cell("–")]
        body.append(tuple(cells))
    note = (
        f"Computed: {count(flown.every.completed)} cases of this run, with its own dispersions; for the farthest as "
        "many as the source has. Marked where the record gives a tolerance."
    )
    return Table(f"{place} compared with this run", tuple(columns), tuple(body), note)


def _published_and_computed(flown: Flown, record: Mapping[str, Any]) -> list[Cell]:
    """The printed number, with what was done to it, and ours, marked as inside its tolerance or not."""
    published, ours = float(record["published"]), own_statistic(flown, record)
    assert ours is not None  # only such records come here
    status = str(record.get("status", ""))
    printed = Cell(number(published, 8), published, small=status if status == "restored" else "")
    tone, tolerance = "", record.get("tolerance")
    if tolerance is not None:
        tone = "good" if abs(ours - published) <= float(tolerance) else "open"
    share = f"{(ours / published - 1.0) * 100.0:+.1f} %".replace("-", "−") if published else ""
    return [printed, Cell(number(ours, 6), ours, small=share, tone=tone)]
