"""What the flights of many cases have in common: percentile bands of a history quantity over the time."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from reports.figures import HistoryBand

FEWEST_CASES = 20  # of a band
INSTANTS = 300
PROBABILITIES = (0.05, 0.25, 0.5, 0.75, 0.95)


def fair_cases(case_ids: Sequence[int]) -> list[int]:
    """Of the retained cases those that stand for all: 0, 1, 2, ... up to the first gap.

    A case further on may have been kept because it is one of the worst; a band over such cases would be too wide.
    """
    kept = sorted(case for case in case_ids if case >= 0)
    return [case for place, case in enumerate(kept) if case == place]


def history_bands(histories: pd.DataFrame, case_ids: Sequence[int], names: Sequence[str]) -> dict[str, HistoryBand]:
    """Bands of the quantities over these cases; none if the cases are too few.

    Between its own rows a flight is a straight line; after its end it counts no more.
    """
    if len(case_ids) < FEWEST_CASES:
        return {}
    chosen = histories[histories["case_id"].isin(case_ids)].sort_values(["case_id", "t_s"], kind="stable")
    starts = np.flatnonzero(np.diff(chosen["case_id"].to_numpy(), prepend=-2))
    times = np.split(chosen["t_s"].to_numpy(), starts[1:])
    grid = _grid(times)
    return {name: _band(grid, times, np.split(chosen[name].to_numpy(), starts[1:])) for name in names}


def _grid(times: list[np.ndarray]) -> np.ndarray:
    """Instants to look at: those of the first case if all share them, else even ones to the end of the longest."""
    first = times[0]
    if all(one.size == first.size and (one == first).all() for one in times):
        return first[np.unique(np.linspace(0, first.size - 1, min(first.size, INSTANTS)).round().astype(int))]
    return np.linspace(min(one[0] for one in times), max(one[-1] for one in times), INSTANTS)


def _band(grid: np.ndarray, times: list[np.ndarray], values: list[np.ndarray]) -> HistoryBand:
    rows = [np.interp(grid, t, y, right=np.nan) for t, y in zip(times, values, strict=True)]
    table = np.sort(np.array(rows), axis=0)  # flights that have ended last, as not-a-numbers
    flying = np.count_nonzero(np.isfinite(table), axis=0)
    used = flying >= FEWEST_CASES
    table, flying = table[:, used], flying[used]
    curves = {}
    for probability in PROBABILITIES:
        place = probability * (flying - 1)
        low = np.floor(place).astype(int)
        high = np.minimum(low + 1, flying - 1)
        columns = np.arange(flying.size)
        below, above = table[low, columns], table[high, columns]
        curves[probability] = below + (place - low) * (above - below)
    return HistoryBand(grid[used], curves, len(times))
