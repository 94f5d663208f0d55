"""Published values compared with ours, as Markdown: one table for each campaign, and a short one for all of them."""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from mc_engine.campaign.search import SHIPPED
from mc_engine.errors import EngineError
from mc_engine.studies.published import (
    NOT_REACHED,
    OUTCOMES,
    REACHED,
    WITH_REASON,
    Record,
    Value,
    outcome,
    read_source,
    shown_digits,
    with_ours,
)

_BEGIN, _END = "<!-- published -->", "<!-- end -->"


def published_files() -> list[Path]:
    """The published.toml of every shipped campaign that has one, by name."""
    return sorted(SHIPPED.glob("*/published.toml"))


def published_file(name: str) -> Path:
    """The published.toml of a shipped campaign, or of a folder; EngineError says which there are."""
    for path in (SHIPPED / name / "published.toml", Path(name) / "published.toml"):
        if path.is_file():
            return path
    known = ", ".join(path.parent.name for path in published_files())
    raise EngineError(f"{name}: no published.toml there; campaigns that have one: {known}")


def campaign_table(path: Path, values: Mapping[str, Value] | None = None) -> str:
    """Every record of one campaign: quantity, place in the source, both numbers, outcome.

    values : ours by quantity, by default those of the lock file.  Records of another and better computation than the
    source's are in a table of their own.
    """
    records = with_ours(path, values)
    source = read_source(path)
    head = f"{source.campaign}: {source.work}".removesuffix(": ")
    lines = [f"{head}. {_counted(records)}.", "", *_head("Quantity", "Source", "Published", "Ours", "Outcome")]
    for record in records:
        if "better" not in record:
            lines.append(
                _table_row(record["quantity"], record.get("source", ""), *_numbers(record), _verdict(record, records))
            )
    return "\n".join([*lines, *_improvements(records)])


def _improvements(records: Sequence[Record]) -> Iterator[str]:
    """The table of values that a better computation than the source's improves, and by how much."""
    ours = [record for record in records if "better" in record]
    if not ours:
        return
    yield from ("", "Improved by another computation than that of the source:", "")
    yield from _head("Quantity", "Source", "Published", "Ours", "Improved by", "Outcome")
    for record in ours:
        share = 100.0 * abs(record["ours"] / record["published"] - 1.0)
        by = f"{share:.2g} %" if outcome(record, records) != NOT_REACHED else "–"
        place = record.get("source", "")
        yield _table_row(record["quantity"], place, *_numbers(record), by, _verdict(record, records))


def headline_table(paths: Sequence[Path]) -> str:
    """How many records of each campaign have which outcome, and the records that are headlines."""
    counts, rows = (
        _head("Campaign", "Source", "Values", *OUTCOMES),
        _head("Campaign", "", "Published", "Ours", "Outcome"),
    )
    for path in paths:
        records, source = with_ours(path), read_source(path)
        link = f"[{source.campaign}](campaigns/{path.parent.name}/README.md)"
        outcomes = [outcome(record, records) for record in records]
        numbers = (str(outcomes.count(verdict)) for verdict in OUTCOMES)
        counts.append(_table_row(link, source.work, str(len(records)), *numbers))
        rows += _headlines(source.campaign, records)
    return "\n".join([*counts, "", *rows])


def _headlines(campaign: str, records: Sequence[Record]) -> Iterator[str]:
    for record in records:
        if record.get("headline"):
            yield _table_row(campaign, record["quantity"], *_numbers(record), _verdict(record, records))
            campaign = ""


def written_into(path: Path, table: str) -> str:
    """The text of a Markdown file with the table between its marks; EngineError if they are not there once."""
    text = path.read_text(encoding="utf-8")
    pattern = re.compile(f"{re.escape(_BEGIN)}\n.*?{re.escape(_END)}", re.DOTALL)
    if len(pattern.findall(text)) != 1:
        raise EngineError(f"{path}: the table goes between a line {_BEGIN} and a line {_END}; put them there, once")
    return pattern.sub(lambda _: f"{_BEGIN}\n{table}\n{_END}", text)


def _counted(records: Sequence[Record]) -> str:
    outcomes = [outcome(record, records) for record in records]
    numbers = ", ".join(f"{outcomes.count(verdict)} {verdict}" for verdict in OUTCOMES)
    return f"{len(outcomes)} values: {numbers}"


def _verdict(record: Record, records: Sequence[Record]) -> str:
    """The outcome; why, where it is not reached; how the print was read, where it is."""
    verdict, status = outcome(record, records), record.get("status", "")
    if verdict == REACHED:
        return verdict if status == "legible" else f"{verdict} ({status})"
    shown = f"**{verdict}**" if verdict == NOT_REACHED else verdict
    return f"{shown}: {record['reason'] if verdict in WITH_REASON else record.get('note') or status}"


def _numbers(record: Record) -> tuple[str, str]:
    """The printed number or words, and ours to as many digits, six at least."""
    unit, published = record.get("unit", ""), record["published"]
    ours = record.get("ours", "–")
    return _with_unit(published, unit, 17), _with_unit(ours, unit, shown_digits(published))


def _with_unit(value: str | float, unit: str, digits: int) -> str:
    """A number with its unit, 1.5e-7 rather than 1.5e-07; words as they are, with the unit if they end in a digit."""
    if isinstance(value, str):
        return f"{value} {unit}".rstrip() if value[-1].isdigit() else value
    number = re.sub(r"e([+-])0*", r"e\1", repr(value) if digits >= 17 else f"{value:.{digits}g}")
    number = number.removesuffix(".0").replace("e+", "e")
    return f"{number} {unit}".rstrip().replace("-", "−", 1 if value < 0 else 0)


def _head(*titles: str) -> list[str]:
    return [_table_row(*titles), "|---" * len(titles) + "|"]


def _table_row(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
