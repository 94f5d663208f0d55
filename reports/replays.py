"""The picture of one case: its history over the nominal one, the envelopes of the saved cases, and the limits."""

from dataclasses import replace

import numpy as np
import pandas as pd

from mc_engine.store.run_files import NOMINAL_CASE
from mc_engine.store.store import Store
from mc_engine.studies.replay_files import LARGEST
from reports.drawing import paper
from reports.drawing.marks import Drawing
from reports.drawing.pictures import render_picture
from reports.figures.histories import HistoryLine, history_figure
from reports.run.flown import Flown
from reports.run.phases import quantity_names
from reports.sections.figure_blocks import is_constant, saved_histories


def replay_picture(run: Store, case_id: int, history: pd.DataFrame) -> bytes:
    """A PNG in the style of the reports.  history : t_s and the outputs of the case."""
    return render_picture(paper.svg(replay_drawing(run, case_id, history)), "png")


def replay_drawing(run: Store, case_id: int, history: pd.DataFrame) -> Drawing:
    """The figure: a panel for each quantity that varies."""
    flown = Flown(run, "")
    columns = {name: history[name].to_numpy(dtype=np.float64) for name in quantity_names(history)}
    t = history["t_s"].to_numpy(dtype=np.float64)
    varying = [name for name, values in columns.items() if not is_constant(values)] or list(columns)
    quantities = {name: np.where(np.abs(columns[name]) < LARGEST, columns[name], np.nan) for name in varying}
    line = HistoryLine(f"case {case_id}", t, quantities, 1)
    held = set(flown.histories["case_id"]) if len(flown.histories) else set()
    nominal: dict[int, tuple[str, int | None]] = {NOMINAL_CASE: ("nominal", 0)} if NOMINAL_CASE in held else {}
    histories = saved_histories(flown, varying, nominal)
    histories = replace(histories, lines=(*histories.lines, line))
    return history_figure([histories.plot(flown, name) for name in varying])
