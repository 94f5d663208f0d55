"""Histories as tables: case_id, time, and the quantities of the model with their units."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from mc_engine import parts
from mc_engine.parts import CASE_COLUMNS, Column

if TYPE_CHECKING:
    import pandas as pd


def history_columns(names: Sequence[str], quantities: Sequence[Mapping[str, str]]) -> tuple[Column, ...]:
    """Columns of a history table with these names: case_id and t_s first, units from the model's quantities."""
    known = {quantity["name"]: quantity for quantity in quantities}
    columns = [CASE_COLUMNS[0], Column("t_s", "s", "time", "time since the start of the case")]
    for name in names:
        if name not in ("case_id", "t_s"):
            quantity = known.get(name, {"unit": "", "description": ""})
            columns.append(Column(name, quantity["unit"], "quantity", quantity["description"]))
    return tuple(columns)


def history_table(
    table: "pd.DataFrame | Mapping[str, Any]", quantities: Sequence[Mapping[str, str]], place: Path
) -> pa.Table:
    """The Arrow table of histories with their units; `place` is for messages."""
    arrays = {name: np.asarray(table[name]) for name in table}
    columns = history_columns(list(arrays), quantities)
    return parts.arrow_table(columns, arrays, len(arrays.get("t_s", ())), place)


def history_bytes(
    table: "pd.DataFrame | Mapping[str, Any]", quantities: Sequence[Mapping[str, str]], place: Path
) -> bytes:
    """A Parquet file of histories that are kept outside the run's own; `place` is for messages."""
    return parts.parquet_bytes(history_table(table, quantities, place))
