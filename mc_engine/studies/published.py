"""Published values of a model's source, in the file `published.toml` next to the model: the printed values, and how our
values are computed.

[source]
campaign = "de-orbit"         # the campaign in two words
work = "Divsalar, Nadafi, Kabganian 2016"
continued_in = ["published/fuel_map.toml"]    # files beside it with more records, where it would be too long

[[published]]
quantity = "semi-major axis of the desired path"
published = 6431.5            # a number, or words
unit = "km"
source = "Table 2"
tolerance = 0.05              # how far ours may lie from the printed number, by default half a unit of its last digit
status = "legible"            # how sure the print is
note = "a sentence"
reason = "a sentence"         # required where the outcome is close, not reached or improved
headline = true               # is in the short table of all campaigns

Words that bound our number say so in numbers, too: `at_most = 0.1`, `at_least = 19.1`; or name the record whose value
of ours is the upper bound: `below = "its quantity"`.  `better = "less"` (or "more")
marks another and better computation than that of the source, such as an optimum: beyond the printed number it is
improved.

Our number is never written into this file.  A record says how it is computed, in one of three ways:

column = "desired_semi_major_axis_km"         # a metric of one case
at = { ve_pct = -20.0 }       # inputs of that case; the others are the model's own

statistic = "standard deviation"              # or "mean", "farthest": of many cases
of = "q1"                     # metric
over = ["inertia_x_factor"]   # the inputs that are dispersed, all of them
at = { actuator = "ideal" }   # inputs that all cases share
campaign_file = "campaign"    # the campaign file beside this one whose cases are flown
cases = 100                   # how many cases the source has, where the number depends on it

compute = "campaigns.deorbit.published:pulse_width"    # a function of a module below the campaign's package
arguments = { number = 1 }    # its keywords

slow = true                   # takes longer than about 20 s
repeatable_to = 0.01          # relative difference of ours between machines, where rounding is amplified

The computed numbers are in the generated file `published.lock.toml` (see `published_values`).  The outcome of a record
is computed (`outcome`), never written.
"""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

from mc_engine.errors import ModelError

Record = Mapping[str, Any]
Value = float | str

_KEYS = {"quantity", "published", "unit", "source", "status", "note", "reason", "headline"}
_KEYS |= {"tolerance", "at_most", "at_least", "below", "better", "slow", "repeatable_to"}
_KEYS |= {"column", "at", "statistic", "of", "over", "cases", "campaign_file", "compute", "arguments"}
_REQUIRED = {"quantity", "published"}
_MECHANISMS = ("column", "statistic", "compute")

REACHED, CLOSE, IMPROVED, NOT_REACHED, UNKNOWN = "reached", "close", "improved", "not reached", "unknown"
OUTCOMES = (REACHED, CLOSE, IMPROVED, NOT_REACHED, UNKNOWN)
WITH_REASON = {CLOSE, IMPROVED, NOT_REACHED}
# statuses of a print that gives no number to compare with
NO_NUMBER = {"lost", "curve lost", "not printed"}
CLOSE_SHARE = 0.005  # of the printed number, or of the bound that the print states
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

    ModelError names a record that has an unknown or missing key, or does not say in one way how ours is computed.
    """
    first = _read(path)
    records = _checked(path, first)
    for name in first.get("source", {}).get("continued_in", []):
        records += _checked(path.parent / name, _read(path.parent / name))
    quantities = {record["quantity"] for record in records}
    for record in records:
        if record.get("below", record["quantity"]) not in quantities:
            raise ModelError(f"{path.name}: {record['quantity']!r} is below {record['below']!r}, which is no record")
    return tuple(records)


def _checked(path: Path, contents: Mapping[str, Any]) -> list[dict[str, Any]]:
    records: list[dict[str, Any]] = contents.get("published", [])
    for number, record in enumerate(records, start=1):
        named = f"{path.name}, record {number} ({record.get('quantity', 'without a quantity')!r})"
        wrong = sorted(record.keys() - _KEYS) + sorted(f"no {key}" for key in _REQUIRED - record.keys())
        if wrong:
            raise ModelError(f"{named}: {', '.join(wrong)}; known are {', '.join(sorted(_KEYS))}")
        ways = [way for way in _MECHANISMS if way in record]
        if len(ways) > 1 or (not ways and record.get("status") not in NO_NUMBER):
            raise ModelError(f"{named}: has {' and '.join(ways) or 'none'} of {', '.join(_MECHANISMS)}; one is wanted")
    return records


def read_source(path: Path) -> Source:
    """The source of a published.toml: campaign and work; if not stated, the name of its folder and ""."""
    said = _read(path).get("source", {})
    return Source(str(said.get("campaign", path.resolve().parent.name)), str(said.get("work", "")))


def lock_file(path: Path) -> Path:
    """The generated file next to a published.toml that stores the computed values."""
    return path.with_name("published.lock.toml")


def kept_values(path: Path) -> dict[str, Value]:
    """Our values by quantity, as they were last computed; none where they never were."""
    lock = lock_file(path)
    return dict(_read(lock).get("ours", {})) if lock.is_file() else {}


def with_ours(path: Path, values: Mapping[str, Value] | None = None) -> tuple[dict[str, Any], ...]:
    """The records of a published.toml, each with the key `ours`: of `values`, by default those of the lock file.

    ModelError names a record whose value is missing, or whose outcome needs a reason that it does not give.
    """
    ours = kept_values(path) if values is None else values
    records = tuple(
        {**record, "ours": ours[record["quantity"]]} if record["quantity"] in ours else record
        for record in read_published(path)
    )
    for record in records:
        verdict = outcome(record, records)
        if verdict in WITH_REASON and not record.get("reason"):
            raise ModelError(f"{path.parent.name}, {path.name}: {record['quantity']!r} is {verdict}; give its `reason`")
    return records


def outcome(record: Record, records: Iterable[Record] = ()) -> str:
    """How `ours` of a record compares with the print: one of OUTCOMES.

    unknown      the source gives no number to compare with (its status says so: lost, curve lost, not printed), or
                 ours of the record that it must be `below` is not among `records`
    reached      a number: ours lies within `tolerance`, or half a unit of the last digit written;
                 words: ours lies within `at_least` and `at_most`, or below another of ours, or is the same words;
                 the farthest of many cases: as far from the mean, within 1.7 standard deviations (`records` has both)
    improved     ours is another computation that the record calls `better`, and lies beyond the printed number
    close        within 0.5 % of the printed number, or of the bound in the words
    not reached  all else

    ModelError if there is no number of ours.
    """
    records = tuple(records)
    if record.get("status") in NO_NUMBER or ("below" in record and _ours_of(record["below"], records) is None):
        return UNKNOWN
    if "ours" not in record:
        raise ModelError(
            f"published.toml: {record['quantity']!r} has no computed value; `mc-engine published CAMPAIGN --compute "
            "--update-lock` computes it"
        )
    if _agrees(record, records):
        return REACHED
    if "better" in record and not isinstance(record["published"], str):
        ahead = (record["ours"] < record["published"]) == (record["better"] == "less")
        return IMPROVED if ahead else NOT_REACHED
    return CLOSE if _is_close(record) else NOT_REACHED


def _agrees(record: Record, records: Iterable[Record]) -> bool:
    ours, printed = record["ours"], record["published"]
    if isinstance(ours, str):
        return bool(ours == printed)
    if "below" in record:
        bound = _ours_of(record["below"], records)
        return bound is not None and bool(ours < bound)
    if "at_least" in record or "at_most" in record:
        return bool(record.get("at_least", -float("inf")) <= ours <= record.get("at_most", float("inf")))
    if isinstance(printed, str):
        return False
    if record.get("statistic") == "farthest":
        return _as_far_from_the_mean(record, records)
    return bool(abs(ours - printed) <= record.get("tolerance", half_a_unit(printed)))


def _ours_of(quantity: str, records: Iterable[Record]) -> float | None:
    """Our value of another record; None where `records` has none, as in a run that does not compute it."""
    return next((float(other["ours"]) for other in records if other["quantity"] == quantity and "ours" in other), None)


def _is_close(record: Record) -> bool:
    """Whether ours lies within 0.5 % of a printed number or bound."""
    ours, printed = record["ours"], record["published"]
    if isinstance(ours, str) or record.get("statistic") == "farthest":
        return False
    bounds = [record[key] for key in ("at_least", "at_most") if key in record]
    numbers = bounds if isinstance(printed, str) else [printed]
    return any(abs(ours - number) <= CLOSE_SHARE * abs(number) for number in numbers)


def half_a_unit(number: float) -> float:
    """Half a unit of the last digit of a number as it is written."""
    written = Decimal(repr(float(number)))
    exponent = 0 if written == written.to_integral_value() else int(written.as_tuple().exponent)
    return 0.5 * 10.0**exponent


def shown_digits(printed: Value) -> int:
    """Number of significant digits shown of our value: that of the printed value, but at least six."""
    return 6 if isinstance(printed, str) else max(6, len(Decimal(repr(printed)).normalize().as_tuple().digits))


def differing(records: Sequence[Record], values: Mapping[str, Value], kept: Mapping[str, Value]) -> list[str]:
    """Quantities whose value is another than the kept one in the digits that are shown, or that only one side has."""
    printed = {record["quantity"]: record for record in records}
    names = dict.fromkeys([*values, *kept])
    return [name for name in names if not _is_same(printed.get(name), values.get(name), kept.get(name))]


def _is_same(record: Record | None, value: Value | None, kept: Value | None) -> bool:
    if record is None or value is None or kept is None or isinstance(value, str) or isinstance(kept, str):
        return record is not None and value == kept
    allowed = max(0.5 * 10.0 ** (1 - shown_digits(record["published"])), record.get("repeatable_to", 0.0))
    return bool(abs(value - kept) <= allowed * abs(kept))


def _as_far_from_the_mean(record: Record, records: Iterable[Record]) -> bool:
    """Whether the case farthest from the mean is as far off as the printed one: other draws, so on either side."""
    same = {
        other["statistic"]: other
        for other in records
        if other.get("of") == record["of"] and other["over"] == record["over"]
    }
    if not {"mean", "standard deviation"} <= same.keys():
        return False
    mean, deviation = same["mean"], same["standard deviation"]["published"]
    distances = [abs(record[key] - mean[key]) for key in ("published", "ours")]
    return bool(abs(distances[0] - distances[1]) <= _BETWEEN_FARTHEST * deviation)


def _read(path: Path) -> dict[str, Any]:
    return tomllib.loads(path.read_text(encoding="utf-8"))
