"""The files of `mc-engine replay` in a run directory: the time history of one case as Parquet, and a plot of it."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from mc_engine.durable_file import names_in
from mc_engine.errors import StoreError
from mc_engine.shell_words import shell_word
from mc_engine.store.derived_files import REPLAYS, derived_files
from mc_engine.store.histories import history_columns, history_problem, history_table
from mc_engine.store.parts import parquet_bytes, parquet_table
from mc_engine.store.store import Store
from mc_engine.text import clean

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LARGEST = 1e100  # of any unit; what a flight that is lost holds beyond it, no axis can have ticks for


def write_replay(store: Store, case_id: int, history: pd.DataFrame, picture: bytes) -> list[Path]:
    """Write `RUN/replay/case-<id>.parquet` and `.png`, of which `picture` is the content; the two paths."""
    table, image = _history_file(case_id), f"{REPLAYS}/case-{case_id}.png"
    rows = history_table(history, store.manifest.get("quantities", []), store.path / table)
    content = parquet_bytes(rows, history=True)
    derived_files(store.path).write({table: content, image: picture})
    return [store.path / table, store.path / image]


def _history_file(case_id: int) -> str:
    return f"{REPLAYS}/case-{case_id}.parquet"


def replayed_cases(run: Path) -> list[int]:
    """The cases of which a replay lies in the run, in order."""
    names = names_in(run, REPLAYS) if (run / REPLAYS).exists() else []
    matches = [re.fullmatch(r"case-([0-9]{1,10})\.parquet", name) for name in names]
    return sorted(int(match[1]) for match in matches if match)


def read_replay(run: Path, case_id: int, quantities: Sequence[Mapping[str, str]]) -> pd.DataFrame:
    """The history of a case that was replayed; StoreError if a byte of it changed."""
    name = _history_file(case_id)
    try:
        table = parquet_table(derived_files(run).read([name])[name])
        problem = history_problem(table, quantities)
    except (StoreError, ValueError) as error:
        problem = str(error).removeprefix(f"{run / name}: ")
    if problem:
        again = f"`mc-engine replay {shell_word(run)} {case_id}` makes it anew"
        raise StoreError(f"{run / name}: {problem}; {again}")
    return table.to_pandas(use_threads=False)


def history_figure(history: pd.DataFrame, quantities: Sequence[Mapping[str, str]], title: str) -> "Figure":
    """Every output of one history against time, a panel each.

    history : case_id, t_s and the outputs.  Units come from the records of the model's outputs.
    """
    from matplotlib.figure import Figure

    known = history_columns(list(history), quantities)
    columns = [column for column in known if column.kind == "number" and column.name != "t_s"]
    rows = max(1, (len(columns) + 1) // 2)
    figure = Figure(figsize=(10.0, 1.0 + 1.8 * rows), layout="constrained")
    axes = figure.subplots(rows, 2, sharex=True, squeeze=False)
    for axis, column in zip(axes.flat, columns, strict=False):
        drawn = history[column.name].where(history[column.name].abs() < LARGEST)
        axis.plot(history["t_s"], drawn, linewidth=0.9)
        label = clean(f"{column.name} [{column.unit}]" if column.unit else column.name)
        axis.set_ylabel(label, fontsize="small", parse_math=False)
        axis.grid(alpha=0.3)
    for axis in axes.flat[len(columns) :]:
        axis.set_axis_off()
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    figure.suptitle(title)
    return figure
