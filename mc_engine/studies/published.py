"""Published values of a model's source, kept as a table beside the model: `published.toml`.

[source]
campaign = "de-orbit"         # the campaign in two words
work = "Divsalar, Nadafi, Kabganian 2016"
continued_in = ["published/fuel_map.toml"]    # files beside it with more records, where it would be too long

[[published]]
quantity = "semi-major axis of the desired path"
published = 6431.5            # a number, or words
unit = "km"
source = "Table 2"
column = "desired_semi_major_axis_km"    # and/or ours = 6431.4934
at = { ve_pct = -20.0 }       # inputs of the case to compare with
tolerance = 0.05              # how far ours may lie from the printed number
status = "legible"            # how sure the print is
note = "a sentence"
headline = true               # stands in the short table of all campaigns

Words that bound our number say so in numbers, too: `at_most = 0.1`, `at_least = 19.1`.

A number of many cases says which, and reports hold it against the same number of a run with these dispersions:

statistic = "standard deviation"         # or "mean", "farthest"
of = "q1"                     # column
over = ["inertia_x_factor"]   # the inputs that are dispersed, all of them
cases = 100                   # how many cases the source has, where the number depends on it

What became of a record is computed (`outcome`), never written.
"""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

from mc_engine.errors import ModelError

_KEYS = {"quantity", "published", "unit", "source", "column", "ours", "at", "tolerance", "status", "note"}
_KEYS |= {"statistic", "of", "over", "cases", "headline", "at_most", "at_least"}
_NEEDED = {"quantity", "published"}

REACHED, NOT_REACHED, UNKNOWN = "reached", "not reached", "unknown"
OUTCOMES = (REACHED, NOT_REACHED, UNKNOWN)
# statuses of a print that gives no number to compare with
NO_NUMBER = {"lost", "curve lost", "not printed"}
# The farthest of 100 normal deviates from their mean lies 2.75 standard deviations off, give or take 0.40; two of them
# agree within three standard errors of their difference, 3 sqrt(2) 0.40.
_BETWEEN_FARTHEST = 1.7


@dataclass(frozen=True)
class Source:
    """What a published.toml is about: the campaign in two words, and the work."""

    campaign: str
    work: str


def read_published(path: Path) -> tuple[dict[str, Any], ...]:
    """The records of a published.toml and of the files beside it that its `continued_in` names, in this order.

    ModelError names a record with an unknown or missing key.
    """
    first = _read(path)
    records = _checked(path, first)
    for name in first.get("source", {}).get("continued_in", []):
        records += _checked(path.parent / name, _read(path.parent / name))
    return tuple(records)


def _checked(path: Path, contents: Mapping[str, Any]) -> list[dict[str, Any]]:
    records: list[dict[str, Any]] = contents.get("published", [])
    for number, record in enumerate(records, start=1):
        wrong = sorted(record.keys() - _KEYS) + sorted(f"no {key}" for key in _NEEDED - record.keys())
        if wrong:
            raise ModelError(f"{path.name}, record {number}: {', '.join(wrong)}; known are {', '.join(sorted(_KEYS))}")
    return records


def read_source(path: Path) -> Source:
    """The work that a published.toml is about; its folder's name and nothing, where the file does not say."""
    said = _read(path).get("source", {})
    return Source(str(said.get("campaign", path.resolve().parent.name)), str(said.get("work", "")))


def outcome(record: Mapping[str, Any], records: Iterable[Mapping[str, Any]] = ()) -> str:
    """What became of a published value: "reached", "not reached" or "unknown".

    unknown      the source gives no number to compare with (its status says so: lost, curve lost, not printed)
    reached      a number: ours lies within `tolerance`, or half a unit of the last digit written;
                 words: ours lies within `at_least` and `at_most`, or is the same words;
                 the farthest of many cases: as far from the mean, within 1.7 standard deviations (`records` has both)
    not reached  all else; ModelError if there is no number of ours
    """
    if record.get("status") in NO_NUMBER:
        return UNKNOWN
    if "ours" not in record:
        raise ModelError(f"published.toml: {record['quantity']!r} has no `ours`; compute it with the campaign")
    return REACHED if _agrees(record, records) else NOT_REACHED


def _agrees(record: Mapping[str, Any], records: Iterable[Mapping[str, Any]]) -> bool:
    ours, printed = record["ours"], record["published"]
    if "at_least" in record or "at_most" in record:
        return bool(record.get("at_least", -float("inf")) <= ours <= record.get("at_most", float("inf")))
    if isinstance(printed, str):
        return bool(ours == printed)
    if record.get("statistic") == "farthest":
        return _as_far_from_the_mean(record, records)
    return bool(abs(ours - printed) <= record.get("tolerance", half_a_unit(printed)))


def half_a_unit(number: float) -> float:
    """Half a unit of the last digit of a number as it is written."""
    written = Decimal(repr(number))
    exponent = 0 if written == written.to_integral_value() else int(written.as_tuple().exponent)
    return 0.5 * 10.0**exponent


def _as_far_from_the_mean(record: Mapping[str, Any], records: Iterable[Mapping[str, Any]]) -> bool:
    """Whether the case farthest from the mean is as far off as the printed one: other draws, so on either side."""
    same = {one["statistic"]: one for one in records if one.get("of") == record["of"] and one["over"] == record["over"]}
    mean, deviation = same["mean"], same["standard deviation"]["published"]
    distances = [abs(record[key] - mean[key]) for key in ("published", "ours")]
    return bool(abs(distances[0] - distances[1]) <= _BETWEEN_FARTHEST * deviation)


def _read(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text(encoding="utf-8"))
