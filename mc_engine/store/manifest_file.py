"""The manifest of a run as it is read: whatever wrote the file, what comes out is what the engine works with.

What is in it when the engine writes it, `mc_engine.runner.manifest` says.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import from_json

from mc_engine.durable_file import sha256_inside
from mc_engine.errors import ModelError, StoreError
from mc_engine.model.figure_rules import refuse_kinds
from mc_engine.model.figures import KINDS, from_record
from mc_engine.section import ReportSection, Share
from mc_engine.status import MOST_CASES
from mc_engine.store.journal import plain
from mc_engine.store.parts import CASE_COLUMNS, Column
from mc_engine.store.receipts import first_mistake

FORMAT = 1  # of the directory; the manifest's "format"

CaseNumber = Annotated[int, Field(ge=0, le=MOST_CASES)]
Seed = Annotated[int, Field(ge=0, le=2**63 - 1)]
Value = float | str | bool  # of an input


class Record(BaseModel):
    """A record of a file of ours: declared members have their types, and an engine of tomorrow may add others."""

    model_config = ConfigDict(strict=True, extra="allow", allow_inf_nan=False)


class _Named(Record):
    name: str


class _Campaign(_Named):
    cases: Annotated[int, Field(ge=1, le=MOST_CASES)]
    title: str = ""
    model: str = ""
    design: str = "mc"
    seed: Seed | None = None
    digest: str = ""


class _Model(Record):
    name: str = ""
    title: str = ""
    source: str = ""
    digest: str = ""
    sampling_digest: str = ""


class _Shard(Record):
    number: CaseNumber
    of: CaseNumber
    first: CaseNumber
    stop: CaseNumber

    @model_validator(mode="after")
    def _is_a_range(self) -> "_Shard":
        if not (1 <= self.number <= self.of and self.first <= self.stop):
            raise ValueError("is no shard")
        return self


class _Described(_Named):
    """An input, parameter, setting or history quantity."""

    unit: str = ""
    description: str = ""
    nominal: Value = ""
    value: Value = ""
    overridden: bool = False
    choices: list[Value] = []
    distribution: str = ""
    bounds: str = ""
    source: str = ""
    note: str = ""


class _Column(_Named):
    unit: str
    role: str
    description: str
    kind: Literal["number", "integer", "word", "switch"] = "number"


class _Requirement(_Named):
    metric: str
    share: Share
    confidence: Share
    at_most: float | None = None
    at_least: float | None = None
    source: str = ""


class _Figure(Record):
    kind: str

    @model_validator(mode="after")
    def _can_be_drawn(self) -> "_Figure":
        try:
            if self.kind in KINDS:  # of another kind, an engine of tomorrow knows what it is
                refuse_kinds(from_record(self.model_dump()), "it")
        except (ModelError, TypeError) as error:
            raise ValueError(f"is no figure: {error}") from None
        return self


class _Published(Record):
    quantity: str
    published: Value
    unit: str = ""
    source: str = ""
    status: str = ""
    note: str = ""
    reason: str = ""
    column: str | None = None
    at: dict[str, Value] | None = None
    tolerance: float | None = None
    at_least: float | None = None
    at_most: float | None = None
    better: Literal["less", "more"] | None = None
    below: str | None = None
    statistic: str | None = None
    of: str = ""
    over: list[str] = []
    cases: CaseNumber | None = None

    @model_validator(mode="after")
    def _gives_a_number_of_many_cases(self) -> "_Published":
        if self.statistic is not None and not (self.of and type(self.published) is float):
            raise ValueError("has a statistic, and so needs a number and the column that it is of")
        return self


class _Upstream(_Campaign):
    failed: CaseNumber = 0
    links: dict[str, str] = {}


class _Git(Record):
    commit: str = ""
    dirty: bool = False


class _Provenance(Record):
    packages: dict[str, str] = {}
    git: _Git | None = None


def _each_once(columns: list[_Column]) -> list[_Column]:
    names = [column.name for column in columns]
    if names[: len(CASE_COLUMNS)] != [column.name for column in CASE_COLUMNS] or len({*names}) < len(names):
        raise ValueError("its columns are not those of a case table")
    return columns


class Head(Record):
    """What the manifest of a run has in common with the records of a tuning and of a rare event."""

    format: Annotated[int, Field(ge=1)] = FORMAT
    engine: str = ""
    created_utc: str = ""
    seed_contract: int = 0
    campaign: _Campaign
    model: _Model = _Model()
    inputs: list[_Described] = []
    parameters: list[_Described] = []
    settings: list[_Described] = []
    quantities: list[_Described] = []
    requirements: list[_Requirement] = []
    report: ReportSection = ReportSection()
    looks: list[CaseNumber] = []
    figures: list[_Figure] = []
    published: list[_Published] = []
    upstream: _Upstream | None = None
    status_texts: dict[str, str] = {}
    provenance: _Provenance = _Provenance()


class _Manifest(Head):
    shard: _Shard | None = None
    columns: Annotated[list[_Column], AfterValidator(_each_once)]

    @model_validator(mode="after")
    def _requires_of_its_columns(self) -> "_Manifest":
        numbers = {column.name for column in self.columns if column.kind == "number"}
        if strange := [one.name for one in self.requirements if one.metric not in numbers]:
            raise ValueError(f"the requirement {strange[0]!a} is on no column of numbers")
        return self


class _UpstreamFacts(_Campaign):
    """What a copy of the run upstream says of itself; a case, also the nominal one, may have NaN for a metric."""

    cases: CaseNumber = 0
    columns: Annotated[list[_Column], AfterValidator(_each_once)]
    nominal: dict[str, Annotated[float, Field(allow_inf_nan=True)] | int | str | bool]
    figures: list[_Figure] = []
    inputs: list[_Described] = []
    design: str
    seed: Seed


def parse_manifest(content: bytes | str) -> dict[str, Any]:
    """What the bytes of a manifest say; ValueError with a sentence if no engine can have written them."""
    return checked_record(content, _Manifest, FORMAT)[0]


def manifest_bytes(record: Mapping[str, Any]) -> bytes:
    """The bytes of a manifest; ModelError where no engine would read it, for what the model says of itself."""
    try:
        content = json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False, default=plain).encode()
        _checked(_Manifest, from_json(content))
    except ValueError as error:
        raise ModelError(f"what the model says of itself fits into no manifest: {error}") from error
    return content


def parse_upstream(content: bytes | str) -> dict[str, Any]:
    """What a copy of the run upstream says of itself; ValueError with a sentence if no engine can have written it."""
    return _checked(_UpstreamFacts, from_json(content))[0]


_Kind = TypeVar("_Kind", bound=Record)


def checked_record(content: bytes | str, kind: type[_Kind], newest: int) -> tuple[dict[str, Any], _Kind]:
    """A JSON record as it stands and as it was understood; ValueError with a sentence if it is none of this kind."""
    record = from_json(content, allow_inf_nan=False)
    if isinstance(record, dict) and isinstance(record.get("format"), int) and record["format"] > newest:
        raise ValueError(f"was written by a newer engine; this one reads format {newest}")
    return _checked(kind, record)


def _checked(kind: type[_Kind], record: Any) -> tuple[dict[str, Any], _Kind]:
    try:
        understood = kind.model_validate(record)
    except ValidationError as error:
        raise ValueError(first_mistake(error)) from None
    return dict(record), understood


def cases_in(manifest: dict[str, Any], n_cases: int) -> range:
    """The cases that a run of `n_cases` holds in its directory: all of them, or those of its shard."""
    shard = manifest.get("shard")
    return range(shard["first"], shard["stop"]) if shard else range(n_cases)


def columns_in(manifest: Mapping[str, Any]) -> tuple[Column, ...]:
    """Columns of the case table by a manifest that `parse_manifest` let pass."""
    known = Column.__dataclass_fields__
    return tuple(
        Column(**{key: value for key, value in record.items() if key in known}) for record in manifest["columns"]
    )


def edited_files(run: Path, digests: Mapping[str, str]) -> Iterator[str]:
    """A sentence for every one of these files that is gone or edited.  digests : SHA-256 by name."""
    for name, digest in digests.items():
        try:
            if sha256_inside(run, name) != digest:
                yield f"{name}: damaged or edited, its SHA-256 is not the one in the journal"
        except StoreError as error:
            yield str(error).removeprefix(f"{run}/")
