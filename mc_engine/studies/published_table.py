"""Published values beside ours as Markdown: one table for a campaign, a short one for all of them."""

import re
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any

from mc_engine.campaign.search import SHIPPED
from mc_engine.errors import EngineError
from mc_engine.studies.published import NOT_REACHED, OUTCOMES, REACHED, outcome, read_published, read_source

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


def campaign_table(path: Path) -> str:
    """Every record of one campaign: quantity, place in the source, both numbers, outcome."""
    records = read_published(path)
    source = read_source(path)
    head = f"{source.campaign}: {source.work}".removesuffix(": ")
    lines = [f"{head}. {_counted(records)}.", "", *_head("Quantity", "Source", "Published", "Ours", "Outcome")]
    for one in records:
        lines.append(_row(one["quantity"], one.get("source", ""), *_numbers(one), _verdict(one, records)))
    return "\n".join(lines)


def headline_table(paths: Sequence[Path]) -> str:
    """How many records of each campaign are reached, and the records that are headlines."""
    counts, rows = (
        _head("Campaign", "Source", "Values", *OUTCOMES),
        _head("Campaign", "", "Published", "Ours", "Outcome"),
    )
    for path in paths:
        records, source = read_published(path), read_source(path)
        link = f"[{source.campaign}](campaigns/{path.parent.name}/README.md)"
        found = [outcome(one, records) for one in records]
        counts.append(_row(link, source.work, str(len(records)), *(str(found.count(one)) for one in OUTCOMES)))
        rows += _headlines(source.campaign, records)
    return "\n".join([*counts, "", *rows])


def _headlines(campaign: str, records: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for one in records:
        if one.get("headline"):
            yield _row(campaign, one["quantity"], *_numbers(one), _verdict(one, records))
            campaign = ""


def written_into(path: Path, table: str) -> str:
    """The text of a Markdown file with the table between its marks; EngineError if they are not there once."""
    text = path.read_text(encoding="utf-8")
    pattern = re.compile(f"{re.escape(_BEGIN)}\n.*?{re.escape(_END)}", re.DOTALL)
    if len(pattern.findall(text)) != 1:
        raise EngineError(f"{path}: the table goes between a line {_BEGIN} and a line {_END}; put them there, once")
    return pattern.sub(lambda _: f"{_BEGIN}\n{table}\n{_END}", text)


def _counted(records: Sequence[Mapping[str, Any]]) -> str:
    found = [outcome(one, records) for one in records]
    return f"{len(found)} values: " + ", ".join(f"{found.count(one)} {one}" for one in OUTCOMES)


def _verdict(record: Mapping[str, Any], records: Sequence[Mapping[str, Any]]) -> str:
    """The outcome; why not, where it is not reached; how the print was read, where it is."""
    found, status, note = outcome(record, records), record.get("status", ""), record.get("note", "")
    if found == REACHED:
        return found if status == "legible" else f"{found} ({status})"
    shown = f"**{found}**" if found == NOT_REACHED else found
    return f"{shown}: {note or status}"


def _numbers(record: Mapping[str, Any]) -> tuple[str, str]:
    """The printed number or words, and ours to as many digits, six at least."""
    unit, published = record.get("unit", ""), record["published"]
    digits = 6 if isinstance(published, str) else max(6, len(Decimal(repr(published)).normalize().as_tuple().digits))
    return _with_unit(published, unit, 17), _with_unit(record.get("ours", "–"), unit, digits)


def _with_unit(value: str | float, unit: str, digits: int) -> str:
    """A number with its unit, 1.5e-7 rather than 1.5e-07; words as they are, with the unit if they end in a digit."""
    if isinstance(value, str):
        return f"{value} {unit}".rstrip() if value[-1].isdigit() else value
    number = re.sub(r"e([+-])0*", r"e\1", repr(value) if digits >= 17 else f"{value:.{digits}g}")
    number = number.removesuffix(".0").replace("e+", "e")
    return f"{number} {unit}".rstrip().replace("-", "−", 1 if value < 0 else 0)


def _head(*titles: str) -> list[str]:
    return [_row(*titles), "|---" * len(titles) + "|"]


def _row(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
