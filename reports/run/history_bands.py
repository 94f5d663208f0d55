"""What the flights of many cases have in common: envelopes of a history quantity over the time."""

from collections.abc import Sequence
from itertools import count
from math import inf

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


def supported(probability: float, n_cases: np.ndarray) -> np.ndarray:
    """bool[n]: whether a curve of an envelope is drawn where so many cases count; the extremes always are."""
    enough = (n_cases >= FEWEST_CASES) & (n_cases * min(probability, 1.0 - probability) >= 1.0)
    return enough | (probability in (0.0, 1.0))


def fair_cases(flown: Flown) -> list[int]:
    """Of the cases with a saved history those that stand for all: 0, 1, 2, ... up to the first gap; none of a design.

    A case further on may have been kept because it is one of the worst; a band over such cases would be too wide.  The
    manifest says where they begin, as a worst case may also follow without a gap; it does not for imported results.  A
    failed case without a history, such as a refused one, is no gap.
    """
    first = flown.manifest.get("histories_of_first")
    stop = inf if first is None else first
    kept = sorted(case for case in flown.histories["case_id"].unique().tolist() if 0 <= case < stop and flown.random)
    if not kept:
        return []
    known = {*kept, *flown.every.failed_ids().tolist()}
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
    instants = _Instants(chosen["case_id"].to_numpy(), chosen["t_s"].to_numpy())
    return {name: _envelope(instants, chosen[name].to_numpy(dtype=np.float64)) for name in names}


class _Instants:
    """Instants of an envelope, and where they lie between the rows of the flights, which follow one another.

    case, t : float[rows], case and time of each row, in ascending order
    """

    def __init__(self, case: np.ndarray, t: np.ndarray):
        first = np.flatnonzero(np.diff(case, prepend=-2))
        last = np.append(first[1:], case.size) - 1
        times = [t[start : end + 1] for start, end in zip(first, last, strict=True)]
        self.grid = grid = _grid(times)
        self.n_flights = first.size
        found = first[:, None] + np.array([np.searchsorted(time, grid, "right") - 1 for time in times])
        self._row = row = np.maximum(found, first[:, None])
        self._next = after = np.minimum(row + 1, last[:, None])
        length = np.where(after > row, t[after] - t[row], 1.0)
        ended = grid > t[last][:, None]
        self._part = np.where(ended, np.nan, np.maximum(grid - t[row], 0.0) / length)
        self._flight = np.repeat(np.arange(self.n_flights), last - first + 1)
        self._left = np.clip(np.searchsorted(grid, t, "right") - 1, 0, grid.size - 2)
        self._in_right_half = 2.0 * t > grid[self._left] + grid[self._left + 1]

    def values(self, y: np.ndarray) -> np.ndarray:
        """float[flights, instants], straight lines between the rows y; not-a-number after the end of a flight."""
        with np.errstate(invalid="ignore"):  # infinite differences
            between = y[self._row] + self._part * (y[self._next] - y[self._row])
        return np.where(self._part == 0.0, y[self._row], between)

    def reach_peaks(self, curves: dict[float, np.ndarray], y: np.ndarray, values: np.ndarray) -> None:
        """Let the curves of the extremes reach the peaks of flights between two instants, each at the nearer one.

        A peak is a row of a flight beyond its values at both instants; it would be cut off.
        """
        before, after = values[self._flight, self._left], values[self._flight, self._left + 1]
        nearest = self._left + (self._in_right_half & np.isfinite(after))
        for probability, extreme, peak in (
            (0.0, np.fmin, y < np.fmin(before, after)),
            (1.0, np.fmax, y > np.fmax(before, after)),
        ):
            curve = curves[probability]
            kept = peak & np.isfinite(y) & np.isfinite(curve[nearest])
            extreme.at(curve, nearest[kept], y[kept])


def _grid(times: list[np.ndarray]) -> np.ndarray:
    """Instants to look at: those of the first case if all share them, else even ones to the end of the longest."""
    first = times[0]
    if all(time.size == first.size and (time == first).all() for time in times):
        return first[np.unique(np.linspace(0, first.size - 1, min(first.size, INSTANTS)).round().astype(int))]
    return np.linspace(min(time[0] for time in times), max(time[-1] for time in times), INSTANTS)


def _envelope(instants: _Instants, y: np.ndarray) -> Envelope:
    values = instants.values(y)
    table = np.sort(np.where(np.isfinite(values), values, np.nan), axis=0)  # not-a-numbers last, as flights that ended
    flying = np.count_nonzero(np.isfinite(table), axis=0)
    curves = {}
    for probability in envelope_probabilities(instants.n_flights):
        place = probability * (flying - 1)
        low = np.floor(place).astype(int)
        high = np.minimum(low + 1, flying - 1)
        columns = np.arange(flying.size)
        below, above = table[low, columns], table[high, columns]
        quantile = below + (place - low) * (above - below)
        curves[probability] = np.where(supported(probability, flying), quantile, np.nan)
    instants.reach_peaks(curves, y, values)
    return Envelope(instants.grid, curves, instants.n_flights)
