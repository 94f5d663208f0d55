"""End states of a run exported as CSV, or as ephemerides with one point for each case (CCSDS OEM, KVN).

CCSDS 502.0-B-3, Orbit Data Messages (2023), section 5.
"""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pandas as pd

from mc_engine.campaign.columns import END_TIME
from mc_engine.campaign.tables_beside import csv_text
from mc_engine.dates import date_text, modified_julian_date
from mc_engine.durable_file import write_durably
from mc_engine.errors import StoreError
from mc_engine.status import OK, STATUS_NAME
from mc_engine.store.store import Store
from mc_engine.units import UNITS, convert

_OEM_UNITS = ("km", "km", "km", "km/s", "km/s", "km/s")
_DAY_S = 86_400.0


def end_columns(store: Store) -> list[str]:
    """The columns of an export by default: case_id, status, time and state at the end; metrics without states."""
    states, metrics = ([column.name for column in store.columns if column.role == role] for role in ("state", "metric"))
    return ["case_id", "status", *(states or metrics)]


def write_csv(store: Store, columns: Sequence[str], out: Path) -> int:
    """Write one row per case, including failed cases, whose status is a column by default.  Returns the number of rows.

    Numbers are written with all their digits: reading them back gives the same bits.
    """
    table = store.cases(list(columns))
    write_durably(out, csv_text(table).encode())
    return len(table)


def write_oem(store: Store, columns: Sequence[str], out: Path, epoch: str, frame: str, centre: str) -> tuple[int, int]:
    """Write a segment for each completed case, with its last state at epoch + end time.  Returns (written, cases).

    columns : the six of x, y, z and their rates, of lengths and speeds in any unit.  epoch : start of the flights, UTC;
    a day counts 86 400 s.  frame, centre : of the states; the run does not know them, so they are not checked.
    StoreError where columns or epoch do not fit.
    """
    try:
        start = modified_julian_date(epoch)
    except (ValueError, OverflowError):
        raise StoreError(f'epoch "{epoch}" is no date such as 2026-01-31T12:00:00') from None
    table = store.cases(["case_id", "status", END_TIME, *columns])
    flown = table[table["status"] == STATUS_NAME[OK]]
    states = np.column_stack([_in_unit(store, flown, name, to) for name, to in zip(columns, _OEM_UNITS, strict=True)])
    campaign = str(store.manifest["campaign"]["name"])
    name = "".join(letter if letter.isalnum() else "_" for letter in campaign).upper()
    lines = [
        "CCSDS_OEM_VERS = 3.0",
        f"CREATION_DATE = {datetime.now(UTC).strftime('%Y-%m-%dT%H:%M:%S')}",
        "ORIGINATOR = MC_ENGINE",
    ]
    for case, seconds, state in zip(flown["case_id"], flown[END_TIME], states, strict=True):
        lines.extend(_segment(f"{name}_{case}", date_text(start + seconds / _DAY_S), state, frame, centre))
    write_durably(out, ("\n".join(lines) + "\n").encode())
    return len(flown), len(table)


def _segment(name: str, epoch: str, state: np.ndarray, frame: str, centre: str) -> Iterator[str]:
    yield from ("", "META_START", f"OBJECT_NAME = {name}", f"OBJECT_ID = {name}", f"CENTER_NAME = {centre}")
    yield from (f"REF_FRAME = {frame}", "TIME_SYSTEM = UTC", f"START_TIME = {epoch}", f"STOP_TIME = {epoch}")
    yield from ("META_STOP", " ".join([epoch, *(repr(float(value)) for value in state)]))


def _in_unit(store: Store, table: pd.DataFrame, name: str, to: str) -> np.ndarray:
    unit = store.units[name]
    if unit not in UNITS or UNITS[unit].quantity != UNITS[to].quantity:
        raise StoreError(
            f"{store.path}: {name} is in {unit or 'plain numbers'}, an OEM needs {UNITS[to].quantity} there; give the "
            "columns of x, y, z and their rates"
        )
    return np.asarray(convert(table[name].to_numpy(dtype=np.float64), unit, to))
