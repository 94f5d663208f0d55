"""The directory of a rare event's estimate: what `mc-engine rare` leaves behind.

    rare.toml   rare.json   cases.parquet   journal.jsonl

Which of them count, and with which bytes, the journal says; see `result_folder`.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from mc_engine.store.result_folder import read_result
from mc_engine.store.run_files import RARE_EVENT


@dataclass(frozen=True)
class RareEventRecord:
    """An estimate: record is what rare.json holds, cases every case flown for it, in order."""

    path: Path
    record: dict[str, Any]
    cases: pd.DataFrame

    @property
    def result(self) -> dict[str, Any]:
        return self.record["rare_event"]


def open_rare_event(path: str | Path) -> RareEventRecord:
    """The estimate in directory `path`; StoreError if there is none, or a byte of it changed."""
    record, tables = read_result(Path(path), RARE_EVENT)
    return RareEventRecord(Path(path), record, tables["cases"])
