"""Tables of saved time histories: case_id, t_s, and the model's quantities with their units."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from mc_engine.errors import StoreError
from mc_engine.shell_words import shell_word
from mc_engine.store import parts
from mc_engine.store.parts import CASE_COLUMNS, Column, Part

if TYPE_CHECKING:
    import pandas as pd


def history_columns(names: Sequence[str], quantities: Sequence[Mapping[str, str]]) -> tuple[Column, ...]:
    """Columns of a history table with these names: case_id and t_s first, units from the model's quantities."""
    known = {quantity["name"]: quantity for quantity in quantities}
    columns = [CASE_COLUMNS[0], Column("t_s", "s", "time", "time since the start of the case")]
    for name in names:
        if name not in ("case_id", "t_s"):
            quantity = known.get(name, {})
            columns.append(Column(name, quantity.get("unit", ""), "quantity", quantity.get("description", "")))
    return tuple(columns)


def history_table(
    table: "pd.DataFrame | Mapping[str, Any]", quantities: Sequence[Mapping[str, str]], place: Path
) -> pa.Table:
    """The Arrow table of histories with their units; `place` is for messages."""
    arrays = {name: np.asarray(table[name]) for name in table}
    columns = history_columns(list(arrays), quantities)
    return parts.arrow_table(columns, arrays, len(arrays.get("t_s", ())), place)


def read_histories(run: Path, part: Part, quantities: Sequence[Mapping[str, str]]) -> pa.Table:
    """The saved time histories of a run; StoreError that names the file if it changed or holds no histories."""
    table = parts.read_part(run, part)
    problem = history_problem(table, quantities)
    if problem:
        raise StoreError(f"{run / part.file}: {problem}; `mc-engine verify {shell_word(run)}` names all damage")
    return table


def history_problem(table: pa.Table, quantities: Sequence[Mapping[str, str]]) -> str:
    """What is wrong with the columns of a table of histories; empty if they are case_id, t_s and quantities."""
    names, known = table.column_names, {"case_id", "t_s", *(quantity["name"] for quantity in quantities)}
    unknown = {*names} - known if quantities else {}
    expected = parts.arrow_schema(history_columns(names, quantities))
    if unknown or not {"case_id", "t_s"} <= {*names} or not table.schema.equals(expected, check_metadata=True):
        return "its columns are not those of histories"
    return ""
