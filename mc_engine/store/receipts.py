"""The committed files of a run directory, as its journal lines give them.

A part is committed from its line on, until another line replaces or withdraws it; for the nominal case and the
histories the last line holds.  The types of all members are checked, and names of files must be those of parts.
Checksums detect damage, not forgery.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from mc_engine.durable_file import inner_names
from mc_engine.status import MOST_CASES
from mc_engine.store.journal import Entry
from mc_engine.store.parts import Part, cases_in_name, is_part_file
from mc_engine.store.run_files import NOMINAL

Range = tuple[int, int]


def _part_file(file: str) -> str:
    if not (is_part_file(file) or file == NOMINAL):
        raise ValueError("is no name of a part")
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
    file: Annotated[str, AfterValidator(_part_file)]
    first: int = Field(ge=-1, le=MOST_CASES)
    rows: int = Field(ge=0, le=2**40)
    bytes: int = Field(ge=1, le=2**50)
    sha256: Digest
    status: dict[str, Annotated[int, Field(ge=1)]]
    replaces: str | None = None


class _Withdrawal(_Event):
    file: str


class _Extension(_Event):
    cases: int = Field(ge=1, le=MOST_CASES)


class _Begin(_Event):
    model_config = ConfigDict(extra="allow")
    chunk: Chunk | None = None


_EVENTS: Mapping[str, type[_Event]] = {
    "created": _Created,
    "part": _Receipt,
    "part-replaced": _Receipt,
    "part-withdrawn": _Withdrawal,
    "nominal": _Receipt,
    "history": _Receipt,
    "extended": _Extension,
    "started": _Begin,
    "merged": _Begin,
}


def receipt_of(facts: Any) -> Part:
    """The receipt of a part from the facts of its line; ValueError with a sentence if they are not valid."""
    return _part(validated(_Receipt, facts))


_Kind = TypeVar("_Kind", bound=BaseModel)


def validated(kind: type[_Kind], record: Any) -> _Kind:
    """A record as a `kind`; ValueError with place and kind of the first mistake, without text from the record."""
    try:
        return kind.model_validate(record)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False, include_context=False)[0]
    place = ".".join(str(key) for key in first["loc"] if key != "[key]")
    message = first["msg"].removeprefix("Value error, ")
    raise ValueError(f"{place!a}: {message[:1].lower()}{message[1:]}")


def _part(record: _Receipt) -> Part:
    return Part(record.file, record.first, record.rows, record.bytes, record.sha256, dict(record.status))


class Receipts:
    """The committed files after the journal lines taken so far.

    parts : receipts of the parts of cases, by their first case, without overlap.
    nominal, histories : their receipts, or None.  extended : number of cases by the last extension, or None.
    """

    def __init__(self) -> None:
        self.parts: list[Part] = []
        self.nominal: Part | None = None
        self.histories: Part | None = None
        self.extended: int | None = None

    def cases(self, begun_with: int) -> int:
        """Number of cases of the run, which began with so many; at least those of the last part."""
        return max(self.extended or begun_with, self.parts[-1].stop if self.parts else 0)

    def take(self, entry: Entry) -> None:
        """Apply one more line; ValueError with a sentence, without any change, if the line is not valid."""
        kind = _EVENTS.get(entry.event)
        record: Any = None if kind is None else validated(kind, entry.facts)
        if (entry.event == "created") != (entry.number == 1):
            raise ValueError("a run is created in line 1, and once")
        if entry.event in ("part", "part-replaced"):
            self._count(_part(record))
        elif entry.event == "part-withdrawn":
            self.parts = [part for part in self.parts if part.file != record.file]
        elif entry.event == "nominal":
            self.nominal = _part(record)
        elif entry.event == "nominal-withdrawn":
            self.nominal = None
        elif entry.event == "history":
            self.histories = _part(record)
        elif entry.event == "extended":
            self.extended = record.cases

    def _count(self, part: Part) -> None:
        """Add a part, in place of parts with any of its cases: one is being replaced, or its withdrawal was lost."""
        if cases_in_name(part.file) != (part.first, part.stop):
            raise ValueError("its file has the name of other cases")
        self.parts[self._with_cases(part.first, part.stop)] = [part]

    def _with_cases(self, first: int, stop: int) -> slice:
        """Where the parts lie that hold any of the cases first .. stop - 1."""
        if not self.parts or self.parts[-1].stop <= first:  # the next part, as a rule
            return slice(len(self.parts), len(self.parts))
        before = bisect_right(self.parts, first, key=lambda part: part.stop)
        return slice(before, max(before, bisect_left(self.parts, stop, key=lambda part: part.first)))

    def committed(self) -> list[Range]:
        """The committed cases, as merged ranges in order."""
        merged: list[Range] = []
        for part in self.parts:
            if merged and part.first == merged[-1][1]:
                merged[-1] = (merged[-1][0], part.stop)
            else:
                merged.append((part.first, part.stop))
        return merged

    def missing(self, expected: range) -> list[Range]:
        """The ranges among the expected cases that are not committed."""
        # not all parts: this is asked as each of many parts is committed
        parts = self.parts[self._with_cases(expected.start, expected.stop)]
        return gaps(((part.first, part.stop) for part in parts), expected)

    def all_parts(self) -> list[Part]:
        """Receipts of all committed files: parts of cases, nominal case, histories."""
        return [*self.parts, *(part for part in (self.nominal, self.histories) if part is not None)]


def gaps(ranges: Iterable[Range], expected: range) -> list[Range]:
    """The ranges of expected cases that are in none of `ranges`, which may overlap."""
    between, begin = [], expected.start
    for first, stop in [*sorted(ranges), (expected.stop, expected.stop)]:
        if min(first, expected.stop) > begin:
            between.append((begin, min(first, expected.stop)))
        begin = max(begin, stop)
    return between


def receipts_of(entries: Iterable[Entry]) -> tuple[Receipts, dict[int, str]]:
    """The committed files after all valid lines, and by line number what is wrong with the others."""
    counted, wrong = Receipts(), {}
    for entry in entries:
        try:
            counted.take(entry)
        except ValueError as error:
            wrong[entry.number] = f"{entry.event!a} as no engine writes it, {error}"
    return counted, wrong
