"""The upstream run of a chain: the run whose results are the inputs of this campaign, case by case.

Case i of the campaign takes its inputs from case i upstream, and its row keeps all columns of that case.  A run
directory keeps a copy of the upstream rows (upstream.parquet), so that it can be resumed and replayed without the
upstream run.
"""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from hashlib import sha256
from itertools import count
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from mc_engine.campaign.columns import input_column
from mc_engine.campaign.reading import Findings
from mc_engine.campaign.sections import InputsSection
from mc_engine.durable_file import read_file
from mc_engine.errors import StoreError
from mc_engine.model.fields import inputs_of
from mc_engine.model.simulator import System
from mc_engine.sampling.distributions import Scalar
from mc_engine.shell_words import shell_word
from mc_engine.status import OK, STATUS_NAME
from mc_engine.store.manifest_file import columns_in, parse_upstream
from mc_engine.store.opening import open_store
from mc_engine.store.parts import CASE_COLUMNS, Column, arrow_schema, arrow_table, parquet_bytes, parquet_table
from mc_engine.store.run_files import JOURNAL, is_run_directory
from mc_engine.suggestions import hint
from mc_engine.units import compatible, convert

COMPANION = "upstream.parquet"
_FACTS = b"mc_engine.campaign.upstream"
_OURS = {column.name for column in CASE_COLUMNS}


@dataclass(frozen=True)
class Rows:
    """The case table of a run, with `facts` that identify the run."""

    facts: Mapping[str, Any]
    columns: tuple[Column, ...]
    table: Mapping[str, np.ndarray]
    nominal: Mapping[str, Any]

    @property
    def n_cases(self) -> int:
        """How many cases the run has."""
        return len(self.table["case_id"])

    @cached_property
    def content(self) -> bytes:
        """A Parquet file of table and facts: what a run directory keeps."""
        table = arrow_table(self.columns, self.table, self.n_cases, Path(COMPANION))
        return parquet_bytes(table.replace_schema_metadata({_FACTS: self._all_facts()}))

    @cached_property
    def digest(self) -> str:
        """SHA-256 of table and facts, not of their file, whose bytes change with the version of Arrow."""
        digest = sha256(self._all_facts().encode())
        for column in self.columns:
            values = self.table[column.name]
            is_word = column.kind == "word"
            digest.update(json.dumps(values.tolist()).encode() if is_word else np.ascontiguousarray(values).data)
        return digest.hexdigest()

    def _all_facts(self) -> str:
        columns = [asdict(column) for column in self.columns]
        return json.dumps({**self.facts, "nominal": self.nominal, "columns": columns}, sort_keys=True, default=float)


@dataclass(frozen=True)
class Upstream:
    """The inputs and columns that a campaign takes from an upstream run.

    links : input of the model to the upstream column from which it takes its values.  columns : upstream columns that
        every row of the campaign keeps, under names that its own columns do not use.  names : upstream column to its
        name here.  table : their values, and those of the linked inputs in the model's units.  nominal : the linked
        inputs of the nominal case.  failed : bool[n], upstream cases that did not complete.
    """

    rows: Rows
    links: Mapping[str, str]
    columns: tuple[Column, ...]
    names: Mapping[str, str]
    table: Mapping[str, np.ndarray]
    nominal: Mapping[str, Scalar]
    failed: np.ndarray

    @property
    def name(self) -> str:
        """Name of the campaign that was flown."""
        return str(self.rows.facts["name"])

    def name_here(self, column: str) -> str | None:
        """The name of an upstream column in this campaign; None for what is no column that the rows keep."""
        return column if self.links.get(column) == column else self.names.get(column)

    def nominal_row(self) -> dict[str, Any]:
        """The upstream columns of the nominal case: the nominal case upstream, and the linked inputs."""
        names = {self.names[column.name]: column.name for column in self.rows.columns if column.name in self.names}
        return {**{name: self.rows.nominal[column] for name, column in names.items()}, **self.nominal}

    def refusals(self, case_ids: np.ndarray) -> np.ndarray:
        """object[n] of str: why a case cannot start, because its upstream case failed; empty where it can."""
        words = self.rows.table["status"][case_ids]
        return np.where(self.failed[case_ids], f"its case of {self.name} ended as " + words.astype(object), "")


def read_rows(path: Path) -> Rows:
    """The rows of a complete run, or of the copy that a run directory keeps; StoreError if it is neither."""
    return _rows_of_copy(path) if path.name == COMPANION else _rows_of_run(path)


def _rows_of_run(path: Path) -> Rows:
    store = open_store(path)
    if store.manifest.get("shard") is not None:
        raise StoreError(f"{path}: is a shard; `mc-engine merge` makes a run of all shards")
    if store.missing():
        raise StoreError(f"{path}: is not complete; `mc-engine resume {shell_word(path)}` flies the rest")
    frame = store.cases()
    table = {name: frame[name].to_numpy() for name in frame.columns}
    campaign = store.manifest["campaign"]
    facts = {key: campaign[key] for key in ("name", "title", "model", "design", "seed", "digest")}
    facts |= {"figures": store.manifest.get("figures", []), "inputs": store.manifest.get("inputs", [])}
    nominal = {key: value.item() if hasattr(value, "item") else value for key, value in store.nominal().items()}
    return Rows(facts, store.columns, table, nominal)


def _rows_of_copy(path: Path) -> Rows:
    try:
        table = parquet_table(read_file(path))
        facts = parse_upstream((table.schema.metadata or {}).get(_FACTS, b"null"))
        columns = columns_in(facts)
        if problem := _copy_problem(table, columns, facts["nominal"]):
            raise ValueError(problem)
    except (OSError, ValueError) as error:
        raise StoreError(f"{path}: no copy of an upstream run: {error}") from error
    arrays = {name: table[name].to_numpy(zero_copy_only=False) for name in table.column_names}
    nominal = facts["nominal"]
    return Rows({key: facts[key] for key in facts.keys() - {"columns", "nominal"}}, columns, arrays, nominal)


def _copy_problem(table: pa.Table, columns: tuple[Column, ...], nominal: Mapping[str, Any]) -> str:
    """Why a copy is not as the engine writes it; empty if all columns exist, with their types and all values."""
    if not table.schema.equals(arrow_schema(columns)) or any(column.null_count for column in table.columns):
        return "its columns are not those that it names, or have missing values"
    if not np.array_equal(table["case_id"].to_numpy(), np.arange(table.num_rows)):
        return "its case_id does not count from 0"
    if not {*table["status"].unique().to_pylist()} <= {*STATUS_NAME.values()}:
        return "it has a status that there is not"
    kinds = {"number": (int, float), "integer": (int,), "word": (str,), "switch": (bool,)}
    if table.num_rows and not all(type(nominal.get(column.name)) in kinds[column.kind] for column in columns):
        return "its nominal case has not a value of the right kind for every column"
    return ""


def find_run(reference: str, directory: Path) -> Path | None:
    """The run directory that `reference` names, relative to the campaign file or to the working folder.

    The campaign file in a run directory, which may come from anyone, can name only the copy in that directory.
    """
    if (directory / JOURNAL).is_file():
        return directory / COMPANION
    try:
        return next((path for path in (directory / reference, Path(reference)) if is_run_directory(path)), None)
    except (OSError, ValueError):  # a name too long, or with a zero byte, is no path
        return None


def link(rows: Rows, section: InputsSection, model: System, own_columns: Iterable[str], findings: Findings) -> Upstream:
    """The upstream rows matched with the model's inputs; problems are noted.

    own_columns : names of the campaign's own columns, besides those of the inputs.
    """
    upstream = {column.name: column for column in rows.columns}
    links = _links(upstream, section, model, findings)
    failed = np.asarray(rows.table["status"] != STATUS_NAME[OK], dtype=bool)
    table: dict[str, np.ndarray] = {}
    nominal: dict[str, Scalar] = {}
    inputs = inputs_of(model)
    for name, column in links.items():
        item, unit = inputs[name], upstream[column].unit
        values = rows.table[column].astype(np.float64)
        table[name] = np.where(failed, np.nan, convert(values, unit, item.unit))
        nominal[name] = float(convert(float(rows.nominal[column]), unit, item.unit))
    lost = [name for name, value in nominal.items() if not isfinite(float(value))]
    if rows.n_cases and rows.nominal.get("status", STATUS_NAME[OK]) != STATUS_NAME[OK]:
        ended = f"{rows.nominal['status']} ({rows.nominal.get('reason', '')})"
        findings.add("from", f"the nominal case of that run ended as {ended}; take a run whose nominal case completed")
    elif lost:
        what = f'"{lost[0]}" takes "{links[lost[0]]}", which is no finite number in the nominal case of that run'
        findings.add("from", f"{what}; take another column or run")
    kept = [input_column(inputs[name]) for name in links]
    names: dict[str, str] = {}
    own = {*own_columns, *_OURS, *inputs}
    columns = [column for column in rows.columns if column.name != "case_id" and links.get(column.name) != column.name]
    twice = [column.name for column in columns if column.name in own]
    prefix = _free_prefix(rows.facts["name"], twice, {*upstream, *own})
    for column_ in columns:
        name = column_.name if column_.name not in own else f"{prefix}_{column_.name}"
        role = "dispersion" if column_.role == "dispersion" else "upstream"
        description = f"{rows.facts['name']}: {column_.description}"
        names[column_.name] = name
        kept.append(Column(name, column_.unit, role, description, column_.kind))
        table[name] = rows.table[column_.name]
    return Upstream(rows, links, tuple(kept), names, table, nominal, failed)


def _free_prefix(campaign: str, names: Iterable[str], used: Iterable[str]) -> str:
    """What stands before names that the campaign's own columns use; numbered where a chain has one name repeatedly."""
    word = re.sub(r"\W+", "_", campaign)
    prefixes = (f"{word}_{k}" if k > 1 else word for k in count(1))
    return next(prefix for prefix in prefixes if not {f"{prefix}_{name}" for name in names} & {*used})


def _links(upstream: Mapping[str, Column], section: InputsSection, model: System, findings: Findings) -> dict[str, str]:
    """Input -> column: those of [inputs.columns], and inputs that have the name of a result upstream."""
    section_findings = findings.under("columns")
    parameters = {item.name: item for item in model.parameters}
    results = [name for name, column in upstream.items() if column.role in ("metric", "state")]
    links = {name: name for name in results if name in parameters}
    for name, column in section.columns.items():
        if name not in parameters:
            section_findings.add(name, f"is not a parameter of {model.name}{hint(name, parameters)}")
        elif column not in upstream or upstream[column].kind != "number":
            section_findings.add(name, f'"{column}" is no column of numbers of that run{hint(column, results)}')
        elif upstream[column].unit not in compatible(parameters[name].unit):
            section_findings.add(
                name, f'"{column}" is in {upstream[column].unit}, which does not fit {parameters[name].unit}'
            )
        else:
            links[name] = column
    if not links and not section.columns:
        findings.add(
            "", f"no result of that run has the name of a parameter of {model.name}; name them in [inputs.columns]"
        )
    return links
