"""The phases of the nominal case, from its saved history."""

import pandas as pd

from mc_engine.store.histories import PHASE_COLUMN
from mc_engine.store.run_files import NOMINAL_CASE
from reports.run.flown import Flown
from reports.text.numbers import number, with_unit


def quantity_names(histories: pd.DataFrame) -> list[str]:
    """The quantities of a table of histories: neither the case, nor the time, nor the phase in words."""
    numbers = [name for name in histories.columns if pd.api.types.is_numeric_dtype(histories[name])]
    return [name for name in numbers if name not in ("case_id", "t_s")]


def phase_times(flown: Flown) -> list[tuple[str, float]]:
    """Name and time of the first saved row of each phase of the nominal case, in their order; empty without phases."""
    histories = flown.histories
    if PHASE_COLUMN not in histories or pd.api.types.is_numeric_dtype(histories[PHASE_COLUMN]):
        return []
    rows = histories[histories["case_id"] == NOMINAL_CASE].sort_values("t_s", kind="stable")
    begins = rows[rows[PHASE_COLUMN] != rows[PHASE_COLUMN].shift()]
    return list(zip(begins[PHASE_COLUMN].astype(str), begins["t_s"].astype(float), strict=True))


def phases_in_words(flown: Flown) -> str:
    """Such as "phases of the nominal case: rail, ascent from 0.5 s, descent from 21 s"; empty without phases."""
    begins = phase_times(flown)
    if not begins:
        return ""
    later = [f"{name} from {with_unit(number(time, 3), flown.unit('t_s'))}" for name, time in begins[1:]]
    return f"phases of the nominal case: {', '.join([begins[0][0], *later])}"
