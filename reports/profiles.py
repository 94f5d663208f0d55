"""Figures of one history quantity against another, with bands over the cases that stand for all."""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from mc_engine.figures import ProfileFigure
from reports.document import FigureBlock
from reports.drawings import COLOURED_OVER_BANDS, history_cases, history_line
from reports.figures import ProfileBand, ProfileDrawing
from reports.flown import Flown
from reports.history_bands import FEWEST_CASES, PROBABILITIES, fair_cases

LEVELS = 200


def profile_blocks(flown: Flown) -> Iterator[FigureBlock | str]:
    """The model's profiles over the retained cases; a sentence in place of one without histories."""
    for figure in flown.figures:
        if isinstance(figure, ProfileFigure) and len(flown.histories):
            yield _profile_block(flown, figure)


def _profile_block(flown: Flown, figure: ProfileFigure) -> FigureBlock | str:
    names = [figure.x, figure.y]
    missing = [name for name in names if name not in flown.histories.columns]
    if missing:
        return f"{figure.title}: not drawn; the histories have no quantity {missing[0]}."
    if not np.isfinite(flown.histories[names].to_numpy(dtype=np.float64)).all(axis=1).any():
        return f"{figure.title}: not drawn; no retained case has both {figure.x} and {figure.y}."
    fair = fair_cases(np.unique(flown.histories["case_id"]).tolist()) if flown.random else []
    band = profile_band(flown.histories, fair, figure.x, figure.y)
    lines = tuple(
        history_line(flown, case, label, rank, names)
        for case, (label, rank) in history_cases(flown).items()
        if band is None or (rank is not None and rank <= COLOURED_OVER_BANDS)
    )
    drawing = ProfileDrawing(lines, figure.x, figure.y, flown.axis(figure.x), flown.axis(figure.y), band)
    return FigureBlock(f"{figure.title}.{_band_words(flown, figure, band)}", drawing, "wide")


def _band_words(flown: Flown, figure: ProfileFigure, band: ProfileBand | None) -> str:
    if band is None:
        return f" Bands need {FEWEST_CASES} retained cases 0, 1, 2, …" if flown.random else ""
    x, y = flown.words(figure.x), flown.words(figure.y)
    return (
        f" The bands are of {x} at equal {y}, over the first {band.n_cases} cases. Of a flight that climbs again, the "
        f"first way down to a level counts; a level that fewer than {FEWEST_CASES} flights reach has no band."
    )


def profile_band(histories: pd.DataFrame, case_ids: Sequence[int], x: str, y: str) -> ProfileBand | None:
    """Quantiles of x where each flight first comes down to a level of y; None for too few cases or one level.

    Between its own rows a flight is a straight line.  Climbs are left out: a level has one x per flight.
    """
    if len(case_ids) < FEWEST_CASES:
        return None
    chosen = histories[histories["case_id"].isin(case_ids)].sort_values(["case_id", "t_s"], kind="stable")
    flights = [flight[[x, y]].to_numpy(dtype=np.float64) for _, flight in chosen.groupby("case_id")]
    values = chosen[y].to_numpy(dtype=np.float64)
    values = values[np.isfinite(values)]
    if not values.size or values.min() == values.max():
        return None
    levels = np.linspace(values.min(), values.max(), LEVELS)
    table = np.array([first_descent(flight[:, 0], flight[:, 1], levels) for flight in flights])
    used = np.count_nonzero(np.isfinite(table), axis=0) >= FEWEST_CASES
    if np.count_nonzero(used) < 2:
        return None
    curves = {p: np.nanquantile(table[:, used], p, axis=0) for p in PROBABILITIES}
    return ProfileBand(levels[used], curves, len(flights))


def first_descent(x: np.ndarray, y: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """x where y first falls to each level (ascending float64[n]); NaN for a level that it starts below or never meets.

    x, y : float64[n_rows] in the order of time.
    """
    finite = np.isfinite(x) & np.isfinite(y)
    x, y = x[finite], y[finite]
    if y.size < 2:
        return np.full(levels.size, np.nan)
    lowest = np.minimum.accumulate(y)
    after = np.searchsorted(-lowest, -levels, side="left")  # first row at or below the level
    met = (after > 0) & (after < y.size)
    row = np.where(met, after, 1)
    # The row before is above the level: it was not yet met there, and lowest is y itself on the way down through it.
    part = (y[row - 1] - levels) / np.where(met, y[row - 1] - y[row], 1.0)
    return np.where(met, x[row - 1] + part * (x[row] - x[row - 1]), np.where(levels == y[0], x[0], np.nan))
