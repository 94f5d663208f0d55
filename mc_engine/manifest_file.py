"""The manifest of a run as it is read: whatever wrote the file, what comes out is what the engine works with.

What is in it when the engine writes it, `mc_engine.manifest` says.
"""

import json
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from mc_engine.parts import CASE_COLUMNS, Column
from mc_engine.receipts import MOST_CASES

FORMAT = 1  # of the directory; the manifest's "format"

CaseNumber = Annotated[int, Field(ge=0, le=MOST_CASES)]


class _Section(BaseModel):
    model_config = ConfigDict(strict=True, extra="allow")


class _Named(_Section):
    name: str


class _Campaign(_Section):
    name: str
    cases: Annotated[int, Field(ge=1, le=MOST_CASES)]
    title: str = ""
    model: str = ""
    design: str = "mc"
    seed: int | None = None
    digest: str = ""


class _Model(_Section):
    name: str = ""
    title: str = ""
    source: str = ""
    digest: str = ""
    sampling_digest: str = ""


class _Shard(_Section):
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
    unit: str = ""
    description: str = ""


class _Column(_Described):
    unit: str
    role: str
    description: str
    kind: Literal["number", "integer", "word", "switch"] = "number"


class _Requirement(_Named):
    metric: str
    share: float | None = None
    confidence: float | None = None
    at_most: float | None = None
    at_least: float | None = None


class _Manifest(_Section):
    format: Annotated[int, Field(ge=1)] = FORMAT
    campaign: _Campaign
    model: _Model = _Model()
    shard: _Shard | None = None
    columns: list[_Column]
    inputs: list[_Described] = []
    parameters: list[_Described] = []
    settings: list[_Described] = []
    quantities: list[_Described] = []
    requirements: list[_Requirement] = []
    looks: list[CaseNumber] = []
    figures: list[dict[str, Any]] = []
    published: list[dict[str, Any]] = []
    upstream: dict[str, Any] | None = None
    status_texts: dict[str, str] = {}
    provenance: dict[str, Any] = {}

    @model_validator(mode="after")
    def _names_every_column_once(self) -> "_Manifest":
        names = [column.name for column in self.columns]
        if names[: len(CASE_COLUMNS)] != [column.name for column in CASE_COLUMNS] or len({*names}) < len(names):
            raise ValueError("its columns are not those of a case table")
        return self


def parse_manifest(content: bytes) -> dict[str, Any]:
    """What the bytes of a manifest say; ValueError with a sentence if no engine can have written them."""
    try:
        record = json.loads(content)
        if isinstance(record, dict) and isinstance(record.get("format"), int) and record["format"] > FORMAT:
            raise ValueError(f"was written by a newer engine; this one reads format {FORMAT}")
        _Manifest.model_validate(record)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False, include_context=False)[0]
        place = ".".join(str(one) for one in first["loc"])
        message = first["msg"].removeprefix("Value error, ")
        raise ValueError(f"{place!a}: {message[:1].lower()}{message[1:]}") from None
    except RecursionError:
        raise ValueError("it is nested too deep") from None
    return dict(record)


def cases_in(manifest: dict[str, Any], n_cases: int) -> range:
    """The cases that a run of `n_cases` holds in its directory: all of them, or those of its shard."""
    shard = manifest.get("shard")
    return range(shard["first"], shard["stop"]) if shard else range(n_cases)


def columns_in(manifest: dict[str, Any]) -> tuple[Column, ...]:
    """Columns of the case table by a manifest that `parse_manifest` let pass."""
    known = Column.__dataclass_fields__
    return tuple(
        Column(**{key: value for key, value in record.items() if key in known}) for record in manifest["columns"]
    )
