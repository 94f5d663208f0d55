"""What `replay` leaves beside a run: the history of one case as Parquet, and a picture of it."""

from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from mc_engine.durable_file import make_folder, write_durably
from mc_engine.history_tables import history_bytes, history_columns
from mc_engine.store import Store

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LARGEST = 1e100  # of any unit; what a flight that is lost holds beyond it, no axis can have ticks for


def write_replay(store: Store, case_id: int, history: pd.DataFrame) -> list[Path]:
    """Write `RUN/replay/case-<id>.parquet` and `.png`; the two paths."""
    folder = store.path / "replay"
    make_folder(folder)
    table, picture = folder / f"case-{case_id}.parquet", folder / f"case-{case_id}.png"
    quantities = store.manifest.get("quantities", [])
    write_durably(table, history_bytes(history, quantities, table))
    image = BytesIO()
    history_figure(history, quantities, f"case {case_id}").savefig(image, format="png", dpi=150)
    write_durably(picture, image.getvalue())
    return [table, picture]


def history_figure(history: pd.DataFrame, quantities: Sequence[Mapping[str, str]], title: str) -> "Figure":
    """Every quantity of one history against time, a panel each.

    history : case_id, t_s and the quantities.  Units come from the records of the model's quantities.
    """
    from matplotlib.figure import Figure

    columns = [column for column in history_columns(list(history), quantities) if column.name not in ("case_id", "t_s")]
    rows = max(1, (len(columns) + 1) // 2)
    figure = Figure(figsize=(10.0, 1.0 + 1.8 * rows), layout="constrained")
    axes = figure.subplots(rows, 2, sharex=True, squeeze=False)
    for axis, column in zip(axes.flat, columns, strict=False):
        drawn = history[column.name].where(history[column.name].abs() < _LARGEST)
        axis.plot(history["t_s"], drawn, linewidth=0.9)
        axis.set_ylabel(f"{column.name} [{column.unit}]" if column.unit else column.name, fontsize="small")
        axis.grid(alpha=0.3)
    for axis in axes.flat[len(columns) :]:
        axis.set_axis_off()
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    figure.suptitle(title)
    return figure
