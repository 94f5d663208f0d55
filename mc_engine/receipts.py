"""What counts in a run directory after all that its journal tells.

A part counts from its line on, until a line replaces or withdraws it; of the nominal case and of the histories the
last line counts.  A checksum holds over anything that someone computed one for: every line is also held against what
an engine writes, so that names of files are those of parts, and numbers can be.
"""

from bisect import bisect_right
from collections.abc import Collection, Iterable, Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from mc_engine.durable_file import inner_names
from mc_engine.journal import Entry
from mc_engine.parts import Part, cases_in_name, is_history_file
from mc_engine.status import MOST_CASES

Range = tuple[int, int]


def _part_file(file: str) -> str:
    if cases_in_name(file) is None:
        raise ValueError("is no name of a part")
    return file


def _history_file(file: str) -> str:
    if not is_history_file(file):
        raise ValueError("is no name of histories")
    return file


def _inner_file(name: str) -> str:
    inner_names(name)
    return name


Digest = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
Chunk = Annotated[int, Field(ge=1, le=MOST_CASES)]


class _Event(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class _Created(_Event):
    manifest: Digest
    campaign: Digest
    companions: dict[Annotated[str, AfterValidator(_inner_file)], Digest] = {}


class _Receipt(_Event):
    file: str
    first: int = Field(ge=-1, le=MOST_CASES)
    rows: int = Field(ge=0, le=2**40)
    bytes: int = Field(ge=1, le=2**50)
    sha256: Digest
    status: dict[str, Annotated[int, Field(ge=1)]]


class _CaseReceipt(_Receipt):
    file: Annotated[str, AfterValidator(_part_file)]
    replaces: Annotated[str, AfterValidator(_part_file)] | None = None


class _NominalReceipt(_Receipt):
    file: Literal["nominal.parquet"]
    first: Literal[-1]
    rows: Literal[1]


class _HistoryReceipt(_Receipt):
    file: Annotated[str, AfterValidator(_history_file)]


class _Withdrawal(_Event):
    file: Annotated[str, AfterValidator(_part_file)]


class _Extension(_Event):
    cases: int = Field(ge=1, le=MOST_CASES)


class _Begin(_Event):
    model_config = ConfigDict(extra="allow")
    chunk: Chunk | None = None


_EVENTS: Mapping[str, type[_Event]] = {
    "created": _Created,
    "part": _CaseReceipt,
    "part-replaced": _CaseReceipt,
    "part-withdrawn": _Withdrawal,
    "nominal": _NominalReceipt,
    "history": _HistoryReceipt,
    "extended": _Extension,
    "started": _Begin,
    "merged": _Begin,
}


def receipt_of(facts: Any) -> Part:
    """The receipt of a part of cases from the facts that its line has; ValueError with a sentence if it can be none."""
    return _case_part(_checked(_CaseReceipt, facts))


def _checked(kind: type[_Event], facts: Any) -> Any:
    try:
        return kind.model_validate(facts)
    except ValidationError as error:
        raise ValueError(first_mistake(error)) from None


def first_mistake(error: ValidationError) -> str:
    """Where the first mistake of a record stands, and what it is, in a sentence without the record's own text."""
    first = error.errors(include_url=False, include_input=False, include_context=False)[0]
    place = ".".join(str(one) for one in first["loc"] if one != "[key]")
    message = first["msg"].removeprefix("Value error, ")
    return f"{place!a}: {message[:1].lower()}{message[1:]}"


def _part(record: _Receipt) -> Part:
    return Part(record.file, record.first, record.rows, record.bytes, record.sha256, dict(record.status))


def _case_part(record: _CaseReceipt) -> Part:
    if cases_in_name(record.file) != (record.first, record.first + record.rows):
        raise ValueError("its file has the name of other cases")
    if sum(record.status.values()) != record.rows:
        raise ValueError("its status words are not those of so many rows")
    return _part(record)


class Receipts:
    """What counts after the lines taken so far.

    parts : receipts of the parts of cases, by their first case; no case stands twice.
    begun_with : cases by the manifest, if that is known.  cases : those wanted, by the last line that says so.
    nominal, histories : the receipts that count, or None.
    """

    def __init__(self, begun_with: int | None = None):
        self.parts: list[Part] = []
        self.begun_with = self.cases = begun_with
        self.nominal: Part | None = None
        self.histories: Part | None = None

    def copy(self) -> "Receipts":
        """The same, to be changed apart."""
        other = Receipts(self.begun_with)
        other.parts, other.cases = [*self.parts], self.cases
        other.nominal, other.histories = self.nominal, self.histories
        return other

    def take(self, entry: Entry) -> None:
        """Let one more line count; ValueError with a sentence, and nothing changed, if no engine writes such."""
        kind = _EVENTS.get(entry.event)
        record: Any = None if kind is None else _checked(kind, entry.facts)
        if (entry.event == "created") != (entry.number == 1):
            raise ValueError("a run is created in line 1, and once")
        if entry.event in ("part", "part-replaced"):
            self._count(_case_part(record), record.replaces)
        elif entry.event == "part-withdrawn":
            self.parts = [part for part in self.parts if part.file != record.file]
        elif entry.event == "nominal":
            self.nominal = _part(record)
        elif entry.event == "nominal-withdrawn":
            self.nominal = None
        elif entry.event == "history":
            self.histories = _part(record)
        elif entry.event == "extended":
            if self.cases is not None and record.cases <= self.cases:
                raise ValueError(f"{record.cases} cases extend none of {self.cases}")
            self.cases = record.cases

    def _count(self, part: Part, replaced: str | None) -> None:
        others = self.parts if replaced is None else [one for one in self.parts if one.file != replaced]
        at = bisect_right(others, part.first, key=lambda one: one.first)
        before, after = others[max(at - 1, 0) : at], others[at : at + 1]
        for other in (*before, *after):
            if other.first < part.stop and part.first < other.stop:
                raise ValueError(f"its cases stand in {other.file} already")
        others.insert(at, part)
        self.parts = others

    def committed(self) -> list[Range]:
        """The cases that count, as merged ranges in order."""
        merged: list[Range] = []
        for part in self.parts:
            if merged and part.first == merged[-1][1]:
                merged[-1] = (merged[-1][0], part.stop)
            else:
                merged.append((part.first, part.stop))
        return merged

    def missing(self, wanted: range) -> list[Range]:
        """The ranges among the wanted cases that do not count."""
        gaps, begin = [], wanted.start
        for first, stop in self.committed():
            if min(first, wanted.stop) > begin:
                gaps.append((begin, min(first, wanted.stop)))
            begin = max(begin, stop)
        if begin < wanted.stop:
            gaps.append((begin, wanted.stop))
        return gaps

    def all_parts(self) -> list[Part]:
        """Receipts of every file that counts: parts of cases, nominal case, histories."""
        return [*self.parts, *(part for part in (self.nominal, self.histories) if part is not None)]


def receipts_of(entries: Iterable[Entry], begun_with: int | None = None) -> tuple[Receipts, dict[int, str]]:
    """What counts after all the lines that an engine can have written; and what is wrong with the others, by number.

    begun_with : cases by the manifest, where that can be read.
    """
    counted, wrong = Receipts(begun_with), {}
    for entry in entries:
        try:
            counted.take(entry)
        except ValueError as error:
            wrong[entry.number] = f"{entry.event!a} as no engine writes it, {error}"
    return counted, wrong


def without_lost(entries: Iterable[Entry], lost: Collection[int], begun_with: int | None) -> list[Entry]:
    """The lines that can be trusted, without those `lost`.

    Where they name cases beyond those that they ask for, the line of an extension is lost: it stands again, in place of
    the last lost one, up to the last of these cases.  What it asked for beyond them has to be asked for anew.
    """
    kept = [entry for entry in entries if entry.number not in lost]
    counted = receipts_of(kept, begun_with)[0]
    stop = max((part.stop for part in counted.parts), default=0)
    if lost and counted.cases is not None and stop > counted.cases:
        at = max(lost)
        before = next((entry.at for entry in reversed(kept) if entry.number < at), "")
        kept = sorted([*kept, Entry(at, before, "extended", {"cases": stop})], key=lambda entry: entry.number)
    return kept
