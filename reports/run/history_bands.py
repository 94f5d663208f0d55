"""What the flights of many cases have in common: envelopes of a history quantity over the time."""

from collections.abc import Sequence
from itertools import count, pairwise

import numpy as np
import pandas as pd

from reports.figures.histories import Envelope
from reports.run.flown import Flown

FEWEST_CASES = 20  # of a band
INSTANTS = 150
OUTER = (0.00135, 0.005, 0.01, 0.025, 0.05)  # percentiles, the first of which a number of cases supports is drawn


def outer_percentile(n_cases: int) -> float:
    """The lowest percentile that so many cases support: beyond it, one of them is expected at least."""
    return next((p for p in OUTER if p * n_cases >= 1.0), OUTER[-1])


def envelope_probabilities(n_cases: int) -> tuple[float, ...]:
    """Probabilities of the curves of an envelope: the extremes, the outer percentiles, the median."""
    outer = outer_percentile(n_cases)
    return (0.0, outer, 0.5, 1.0 - outer, 1.0)


def fair_cases(flown: Flown) -> list[int]:
    """Of the cases with a saved history those that stand for all: 0, 1, 2, ... up to the first gap; none of a design.

    A case further on may have been kept because it is one of the worst; a band over such cases would be too wide.  A
    failed case without a history, such as a refused one, is no gap.
    """
    kept = sorted(case for case in flown.histories["case_id"].unique().tolist() if case >= 0 and flown.random)
    if not kept:
        return []
    known = {*kept, *flown.every.failed(kept[-1] + 1)["case_id"].tolist()}
    gap = next(case for case in count() if case not in known)
    return [case for case in kept if case < gap]


def history_envelopes(histories: pd.DataFrame, case_ids: Sequence[int], names: Sequence[str]) -> dict[str, Envelope]:
    """Envelopes of the quantities over these cases; none if the cases are too few.

    Between its own rows a flight is a straight line; after its end it counts no more.  Where so few still fly that they
    do not support the outer percentiles, these end, and the median where fewer than FEWEST_CASES do; smallest and
    largest go on to the end of the longest flight, and reach the peaks between the instants.
    """
    if len(case_ids) < FEWEST_CASES:
        return {}
    chosen = histories[histories["case_id"].isin(case_ids)].sort_values(["case_id", "t_s"], kind="stable")
    starts = np.flatnonzero(np.diff(chosen["case_id"].to_numpy(), prepend=-2))
    flights = [slice(*rows) for rows in pairwise([*starts.tolist(), len(chosen)])]
    times = _by_flight(chosen["t_s"], flights)
    grid = _instants(times)
    return {name: _envelope(grid, times, _by_flight(chosen[name], flights)) for name in names}


def _by_flight(column: pd.Series, flights: list[slice]) -> list[np.ndarray]:
    values = column.to_numpy()
    return [values[rows] for rows in flights]


def _instants(times: list[np.ndarray]) -> np.ndarray:
    """Instants to look at: those of the first case if all share them, else even ones to the end of the longest."""
    first = times[0]
    if all(time.size == first.size and (time == first).all() for time in times):
        return first[np.unique(np.linspace(0, first.size - 1, min(first.size, INSTANTS)).round().astype(int))]
    return np.linspace(min(time[0] for time in times), max(time[-1] for time in times), INSTANTS)


def _envelope(grid: np.ndarray, times: list[np.ndarray], values: list[np.ndarray]) -> Envelope:
    rows = np.array([np.interp(grid, t, y, right=np.nan) for t, y in zip(times, values, strict=True)])
    table = np.sort(np.where(np.isfinite(rows), rows, np.nan), axis=0)  # not-a-numbers last, as flights that have ended
    flying = np.count_nonzero(np.isfinite(table), axis=0)
    curves = {}
    for probability in envelope_probabilities(len(times)):
        place = probability * (flying - 1)
        low = np.floor(place).astype(int)
        high = np.minimum(low + 1, flying - 1)
        columns = np.arange(flying.size)
        below, above = table[low, columns], table[high, columns]
        enough = (flying >= FEWEST_CASES) & (flying * min(probability, 1.0 - probability) >= 1.0)
        supported = enough | (probability in (0.0, 1.0))
        curves[probability] = np.where(supported, below + (place - low) * (above - below), np.nan)
    _reach_peaks(curves, rows, grid, times, values)
    return Envelope(grid, curves, len(times))


def _reach_peaks(
    curves: dict[float, np.ndarray],
    rows: np.ndarray,
    grid: np.ndarray,
    times: list[np.ndarray],
    values: list[np.ndarray],
) -> None:
    """Let the curves of the extremes reach the peaks of flights between two instants, each at the nearer one.

    A peak is a row of a flight beyond its values at both instants, `rows`; it would be cut off.
    """
    t, y = np.concatenate(times), np.concatenate(values)
    flight = np.repeat(np.arange(len(times)), [one.size for one in times])
    left = np.clip(np.searchsorted(grid, t, "right") - 1, 0, grid.size - 2)
    before, after = rows[flight, left], rows[flight, left + 1]
    nearest = left + ((2.0 * t > grid[left] + grid[left + 1]) & np.isfinite(after))
    for probability, extreme, peak in (
        (0.0, np.fmin, y < np.fmin(before, after)),
        (1.0, np.fmax, y > np.fmax(before, after)),
    ):
        curve = curves[probability]
        kept = peak & np.isfinite(y) & np.isfinite(curve[nearest])
        extreme.at(curve, nearest[kept], y[kept])
