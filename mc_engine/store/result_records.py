"""Reading and checking of the records `tuning.json` and `rare.json`, for `status` and the reports.

The shapes below are those of the files; each becomes a pydantic model.  A pair (type, value) is a key with a default.
"""

from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from mc_engine.store.manifest_file import ColumnRecord, Head, Record, checked_record
from mc_engine.store.run_files import RARE_EVENT, TUNING

FORMAT = 2  # of the directories; 1 had no journal

Shape = dict[str, Any]

Count = Annotated[int, Field(ge=0, le=2**63)]
Some = Annotated[int, Field(ge=1, le=2**63)]
NotNegative = Annotated[float, Field(ge=0.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Limit = float | None


class _Column(ColumnRecord):
    """Of a table of results; unlike that of a run it may leave its words out."""

    unit: str = ""
    description: str = ""


_NAMED: Shape = {"name": str, "unit": (str, ""), "description": (str, "")}
_TABLE = {"rows": Count, "columns": list[_Column]}
_LIMITS: Shape = {"metric": str, "at_most": Limit, "at_least": Limit, "source": (str, "")}
_SEARCH: Shape = {
    **dict.fromkeys(("population", "generations", "flown", "cases"), Some),
    "seed": Count,
    "end": str,
    "crossover": NotNegative,
    "mutation": NotNegative,
    "parameters": [{**_NAMED, "lower": float, "upper": float, "nominal": float, "source": (str, "")}],
    "objectives": [{**_NAMED, "metric": str, "goal": Literal["minimise", "maximise"], "quantile": Share | None}],
    "constraints": [{**_NAMED, **_LIMITS, "quantile": Share | None}],
    "published": [{**_NAMED, "values": dict[str, float], "source": (str, "")}],
}
_SIGMAS: Shape = dict.fromkeys(("mean_sigma", "spread_sigma", "likeliest_sigma", "likeliest"), float)
_ESTIMATE: Shape = {
    "asked": {"method": str, "cases_per_level": Some},
    "requirement": {**_NAMED, **_LIMITS, "share": Share, "confidence": Share},
    "metric": _NAMED,
    "method": Literal["subset", "cross-entropy", "plain"],
    **dict.fromkeys(("probability", "lower", "upper"), Annotated[float, Field(ge=0.0, le=10.0)]),  # of an estimate
    "confidence": Share,
    **dict.fromkeys(("relative_error", "plain_cases"), NotNegative | None),
    "cases": Some,
    **dict.fromkeys(("failed", "no_number"), Count),
    "levels": [{"margin": Limit, "probability": NotNegative, "runs": Count, "cases": Count, "accepted": NotNegative}],
    "inputs": [{**_NAMED, **_SIGMAS, "across_sigma": (Limit, None), "across": (Limit, None)}],
    "remarks": list[str],
}


def _kind(shape: Any) -> Any:
    """The type that a shape describes."""
    if isinstance(shape, list):
        return list[_kind(shape[0])]  # type: ignore[misc]
    return _model(shape) if isinstance(shape, dict) else shape


def _model(shape: Shape, base: type[Record] = Record) -> Any:
    given = {key: value if isinstance(value, tuple) else (value, ...) for key, value in shape.items()}
    fields: Shape = {key: (_kind(kind), value) for key, (kind, value) in given.items()}
    return create_model("Record", __base__=base, **fields)


TABLES = {TUNING: ("evaluations", "generations", "front"), RARE_EVENT: ("cases",)}
_SHAPES: dict[str, Shape] = {TUNING: {"tuning": _SEARCH}, RARE_EVENT: {"rare_event": _ESTIMATE}}


def parse_result(content: bytes, kind: str) -> dict[str, Any]:
    """The record in these bytes, with defaults filled in; ValueError with a sentence if it is not valid."""
    tables = {"tables": dict.fromkeys(TABLES[kind], _TABLE)}
    shape = {"format": Literal[2], **_SHAPES[kind], **tables}
    record = checked_record(content, _model(shape, Head), FORMAT)[1].model_dump()
    if kind == TUNING:
        _refuse_other_columns(record)
    elif len({item[key] is None for item in record["rare_event"]["inputs"] for key in ("across", "across_sigma")}) > 1:
        raise ValueError("across and across_sigma must be given for all inputs or for none")
    return record


def _refuse_other_columns(record: dict[str, Any]) -> None:
    search = record["tuning"]
    own = {"candidate", "violation", "feasible", "failed_cases", "commonest_failure"}
    names = own | {item["name"] for key in ("parameters", "objectives", "constraints") for item in search[key]}
    for table in ("evaluations", "front"):
        if missing := names - {column["name"] for column in record["tables"][table]["columns"]}:
            raise ValueError(f"its table of the {table} has no column {min(missing)!a}")
    if not search["parameters"] or not search["objectives"]:
        raise ValueError("it has no parameters or no objectives")
    if any({*point["values"]} != {item["name"] for item in search["objectives"]} for point in search["published"]):
        raise ValueError("a published point has other objectives")
