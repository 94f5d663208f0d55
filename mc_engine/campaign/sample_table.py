"""The case table of `mc-engine sample`, as a file or on a terminal: the inputs of a campaign, without flying it."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from mc_engine.campaign.cases import case_table
from mc_engine.campaign.loading import Campaign
from mc_engine.campaign.tables_beside import csv_text
from mc_engine.durable_file import write_durably
from mc_engine.store.parts import CASE_COLUMNS, Column, arrow_table, parquet_bytes

SUFFIXES = (".parquet", ".csv")
_ROWS = 5  # on a terminal
_KINDS = {"O": "word", "U": "word", "b": "switch", "i": "integer", "u": "integer", "f": "number"}


def drawn_inputs(campaign: Campaign) -> dict[str, np.ndarray]:
    """case_id and the dispersed columns of all cases of the campaign."""
    case_ids = np.arange(campaign.cases, dtype=np.int64)
    return {"case_id": case_ids, **case_table(campaign, case_ids)}


def write_sample(campaign: Campaign, table: Mapping[str, np.ndarray], path: Path) -> None:
    """Write the table as `path`'s ending says, one of SUFFIXES.

    Either serves as a campaign's `table`, unless it has columns of an upstream run.
    """
    if path.suffix == ".csv":
        write_durably(path, csv_text(pd.DataFrame(table)).encode())
        return
    known = {"case_id": CASE_COLUMNS[0]}
    if campaign.upstream is not None:
        known |= {column.name: column for column in campaign.upstream.columns}
    columns = []
    for name, values in table.items():
        if name in known:
            columns.append(known[name])
        else:
            item = campaign.model.input(name)
            columns.append(Column(name, item.unit, "dispersion", item.description, _KINDS[values.dtype.kind]))
    write_durably(path, parquet_bytes(arrow_table(columns, table, campaign.cases, path)))


def sample_text(table: Mapping[str, np.ndarray]) -> str:
    """The first rows, and mean, spread and extremes of each column of numbers (the words with their counts)."""
    frame = pd.DataFrame(table)
    numbers = frame.drop(columns="case_id").select_dtypes("number")
    blocks = [frame.head(_ROWS).to_string(index=False)]
    if not numbers.empty:
        summary = pd.DataFrame(
            {"mean": numbers.mean(), "std": numbers.std(), "smallest": numbers.min(), "largest": numbers.max()}
        )
        blocks.append(summary.to_string())
    for name in frame.columns.difference(["case_id", *numbers.columns], sort=False):
        counts = frame[name].value_counts()
        blocks.append(f"{name}: " + ", ".join(f"{value} {count}" for value, count in counts.items()))
    return "\n\n".join(blocks)
