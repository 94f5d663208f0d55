"""Reading and checking of a run's manifest: every member that the engine uses has its type and range.

`mc_engine.runner.manifest` makes the content when a run begins.
"""

import json
from collections.abc import Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator
from pydantic_core import from_json

from mc_engine.durable_file import read_inside
from mc_engine.errors import ModelError, StoreError
from mc_engine.model.figures import KINDS, from_record, refuse_kinds
from mc_engine.section import ReportSection, Share
from mc_engine.status import MOST_CASES
from mc_engine.store.journal import plain
from mc_engine.store.parts import CASE_COLUMNS, Column
from mc_engine.store.receipts import validated

FORMAT = 1  # of the directory; the manifest's "format"
NEWER = "was written by a newer engine"

CaseNumber = Annotated[int, Field(ge=0, le=MOST_CASES)]
Seed = Annotated[int, Field(ge=0, le=2**63 - 1)]
Value = float | str | bool  # of an input


class Record(BaseModel):
    """A record in a JSON file of the engine.  Unknown members are kept, since newer versions may add some."""

    model_config = ConfigDict(strict=True, extra="allow", allow_inf_nan=False)


class _Named(Record):
    name: str


class _Campaign(_Named):
    cases: Annotated[int, Field(ge=1, le=MOST_CASES)]
    title: str = ""
    note: str = ""
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
    """An input, parameter, setting or output along the flight."""

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
    random_draw: bool = False


class ColumnRecord(_Named):
    unit: str
    role: str
    description: str
    kind: Literal["number", "integer", "word", "switch"] = "number"


class _Correlation(Record):
    first: str
    second: str
    rank: float
    source: str = ""


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
            if self.kind in KINDS:  # other kinds belong to newer versions
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


class _Imported(Record):
    """Tables from which the cases were read, for runs that the engine did not fly."""

    file: str
    history: str | None = None


class _Group(_Named):
    members: list[str]


class _Sensitivity(Record):
    """Design of the flights for contributions."""

    design: str
    cases: CaseNumber
    groups: list[_Group]
    repeated: list[str]


class _Git(Record):
    commit: str = ""
    dirty: bool = False


class _Provenance(Record):
    packages: dict[str, str] = {}
    git: _Git | None = None


def _each_once(columns: list[ColumnRecord]) -> list[ColumnRecord]:
    names = [column.name for column in columns]
    if names[: len(CASE_COLUMNS)] != [column.name for column in CASE_COLUMNS] or len({*names}) < len(names):
        raise ValueError("its columns are not those of a case table")
    return columns


class Head(Record):
    """Members that the manifest of a run shares with the records of a tuning and of a rare event."""

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
    report: ReportSection = Field(default_factory=ReportSection)
    looks: list[CaseNumber] = []
    histories_of_first: CaseNumber | None = None
    figures: list[_Figure] = []
    published: list[_Published] = []
    upstream: _Upstream | None = None
    status_texts: dict[str, str] = {}
    provenance: _Provenance = _Provenance()


class _Manifest(Head):
    shard: _Shard | None = None
    imported: _Imported | None = None
    sensitivity: _Sensitivity | None = None
    correlations: list[_Correlation] = []
    ranges: dict[str, Annotated[list[float | None], Field(min_length=2, max_length=2)]] = {}
    event_times: list[str] = []
    metric_outputs: dict[str, str] = {}
    columns: Annotated[list[ColumnRecord], AfterValidator(_each_once)]

    @model_validator(mode="after")
    def _requires_of_its_columns(self) -> "_Manifest":
        numbers = {column.name for column in self.columns if column.kind == "number"}
        if unmatched := [required.name for required in self.requirements if required.metric not in numbers]:
            raise ValueError(f"the metric of the requirement {unmatched[0]!a} is no column of numbers")
        return self


class _UpstreamFacts(_Campaign):
    """Metadata of the copied upstream run.  A metric may be NaN, also that of the nominal case."""

    cases: CaseNumber = 0
    columns: Annotated[list[ColumnRecord], AfterValidator(_each_once)]
    nominal: dict[str, Annotated[float, Field(allow_inf_nan=True)] | int | str | bool]
    figures: list[_Figure] = []
    inputs: list[_Described] = []
    design: str
    seed: Seed


def parse_manifest(content: bytes | str) -> dict[str, Any]:
    """The manifest in these bytes; ValueError with a sentence if it is no valid manifest."""
    return checked_record(content, _Manifest, FORMAT)[0]


def manifest_bytes(record: Mapping[str, Any]) -> bytes:
    """The bytes of a manifest; ModelError if the model's description would make an invalid one."""
    try:
        content = json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False, default=plain).encode()
        validated(_Manifest, from_json(content))
    except ValueError as error:
        raise ModelError(f"the model's description cannot be written to a manifest: {error}") from error
    return content


def parse_upstream(content: bytes | str) -> dict[str, Any]:
    """The metadata of the copied upstream run; ValueError with a sentence if they are not valid."""
    record = from_json(content)
    validated(_UpstreamFacts, record)
    return dict(record)


_Kind = TypeVar("_Kind", bound=Record)


def checked_record(content: bytes | str, kind: type[_Kind], newest: int) -> tuple[dict[str, Any], _Kind]:
    """A JSON record as a dict and as a `kind`; ValueError with a sentence if it is not valid.

    newest : the newest format that this version reads.
    """
    record = from_json(content, allow_inf_nan=False)
    if isinstance(record, dict) and isinstance(record.get("format"), int) and record["format"] > newest:
        raise ValueError(f"{NEWER}; this one reads format {newest}: update mc-engine")
    checked = validated(kind, record)
    return dict(record), checked


def title_in(manifest: Mapping[str, Any]) -> str:
    """The title of the campaign, or else its name."""
    return str(manifest["campaign"].get("title") or manifest["campaign"].get("name", ""))


def design_in(manifest: Mapping[str, Any]) -> str:
    """The design of the campaign."""
    return str(manifest.get("campaign", {}).get("design", "mc"))


def cases_in(manifest: dict[str, Any], n_cases: int) -> range:
    """The cases that the directory of a run of `n_cases` holds: all, or those of its shard."""
    shard = manifest.get("shard")
    return range(shard["first"], shard["stop"]) if shard else range(n_cases)


def columns_in(manifest: Mapping[str, Any]) -> tuple[Column, ...]:
    """Columns of a table, from a checked record with the member "columns", such as a manifest."""
    known = Column.__dataclass_fields__
    return tuple(
        Column(**{key: value for key, value in record.items() if key in known}) for record in manifest["columns"]
    )


def seed_remark(seed: int | None, upstream: Mapping[str, Any] | None) -> str:
    """That a campaign has the seed of the one upstream, with which both draw alike; else empty.

    upstream : facts of the run upstream, with `name` and perhaps `seed`; None without one.
    """
    if upstream is None or seed is None or seed != upstream.get("seed"):
        return ""
    return (
        f"{seed} is also that of {upstream['name']}: noise in flight and dispersions of the same name are the same "
        "draws in both campaigns; choose another seed"
    )


def edited_files(run: Path, digests: Mapping[str, str]) -> Iterator[str]:
    """A sentence for each of these files that is missing or changed.  digests : SHA-256 by name."""
    for name, digest in digests.items():
        try:
            if sha256(read_inside(run, name)).hexdigest() != digest:
                yield f"{name}: damaged or edited, its SHA-256 is not the one in the journal"
        except StoreError as error:
            yield str(error).removeprefix(f"{run}/")
