"""Figures of one history quantity against another, with bands over the cases that stand for all."""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from mc_engine.model.figures import ProfileFigure
from reports.document.blocks import FigureBlock
from reports.figures.histories import Envelope, profile_figure
from reports.run.flown import Flown
from reports.run.history_bands import FEWEST_CASES, envelope_probabilities, fair_cases, supported
from reports.sections.figure_blocks import COLOURED_OVER_BANDS, history_cases, history_line

LEVELS = 200
LEAST_LEG = 0.05  # of the range of y: a smaller rise or fall is no change of direction
MOST_LEGS = 3
CLOSED = 0.1  # of both ranges: a curve that ends nearer to its beginning is closed


def profile_blocks(flown: Flown) -> Iterator[FigureBlock | str]:
    """The model's profiles over the saved histories; a sentence in place of one without histories."""
    for figure in flown.figures:
        if isinstance(figure, ProfileFigure) and len(flown.histories):
            yield _profile_block(flown, figure)


def _profile_block(flown: Flown, figure: ProfileFigure) -> FigureBlock | str:
    names = [figure.x, figure.y]
    missing = [name for name in names if name not in flown.histories.columns]
    if missing:
        return f"{figure.title}: not drawn; the histories have no output {missing[0]}."
    if not np.isfinite(flown.histories[names].to_numpy(dtype=np.float64)).all(axis=1).any():
        return f"{figure.title}: not drawn; no saved case has both {flown.words(names[0])} and {flown.words(names[1])}."
    fair = fair_cases(flown)
    bands_or_reason = profile_bands(flown.histories, fair, figure.x, figure.y)
    bands = bands_or_reason if isinstance(bands_or_reason, tuple) else ()
    lines = tuple(
        history_line(flown, case, label, rank, names)
        for case, (label, rank) in history_cases(flown).items()
        if not bands or (rank is not None and rank <= COLOURED_OVER_BANDS)
    )
    labels = flown.axis(figure.x), flown.axis(figure.y)
    drawing = profile_figure((figure.x, figure.y), labels, lines, bands[:2], flown.lengths(*names))
    said = (
        _band_words(flown, figure, bands_or_reason)
        if isinstance(bands_or_reason, tuple)
        else f" {bands_or_reason.replace(figure.y, flown.words(figure.y))}."
        if flown.random
        else ""
    )
    return FigureBlock(f"{figure.title}.{said}", drawing, "wide")


def _band_words(flown: Flown, figure: ProfileFigure, bands: tuple[Envelope, ...]) -> str:
    x, y = flown.words(figure.x), flown.words(figure.y)
    ways = " and ".join("up" if band.rising else "down" for band in bands)
    again = "climbs" if not bands[0].rising else "descends"
    return (
        f" The envelopes are of {x} at equal {y} on the way {ways}, over the first {bands[0].n_cases} saved cases. "
        f"Of a flight that {again} again, the first way {'up' if bands[0].rising else 'down'} to a level counts; "
        f"a level that fewer than {FEWEST_CASES} flights reach has no band, and percentiles end "
        "where the flights are too few for them."
    )


def profile_bands(histories: pd.DataFrame, case_ids: Sequence[int], x: str, y: str) -> tuple[Envelope, ...] | str:
    """Quantiles of x where each flight first comes to a level of y; or the sentence that says why there are none.

    Flights that begin by descending have a band over the way down; those that climb first one over the way up, and one
    over the way down from their highest point if that is all that follows.  Between its own rows a flight is a
    straight line.  Closed and oscillating curves have no band: they are at a level more often than once.
    """
    if len(case_ids) < FEWEST_CASES:
        return f"Bands need {FEWEST_CASES} saved cases, numbered from 0 on"
    chosen = histories[histories["case_id"].isin(case_ids)].sort_values(["case_id", "t_s"], kind="stable")
    table = chosen[["case_id", x, y]].to_numpy(dtype=np.float64)
    table = table[np.isfinite(table).all(axis=1)]
    flights = np.split(table[:, 1:], np.flatnonzero(np.diff(table[:, 0])) + 1)
    ends = table[:, 1:].min(axis=0), table[:, 1:].max(axis=0)
    if not len(table) or ends[0][1] == ends[1][1]:
        return f"No bands: {y} is the same in all of these cases"
    legs = [_legs(flight[:, 1], LEAST_LEG * (ends[1][1] - ends[0][1])) for flight in flights]
    closed = [np.abs(flight[-1] - flight[0]) < CLOSED * (ends[1] - ends[0]) for flight in flights]
    n_legs = float(np.median([len(leg) for leg in legs]))
    if n_legs > MOST_LEGS or (n_legs > 1 and np.mean([flight.all() for flight in closed]) > 0.5):
        return f"No bands: {y} is not monotonic along these curves, which are closed or oscillate"
    rising = sum(leg[0] > 0 for leg in legs if leg) > 0.5 * len(legs)
    levels = np.linspace(ends[0][1], ends[1][1], LEVELS)
    candidates = [_first_passage_envelope(flights, levels, rising)]
    if rising and n_legs == 2:
        candidates.append(
            _first_passage_envelope([flight[int(np.argmax(flight[:, 1])) :] for flight in flights], levels, False)
        )
    bands = tuple(band for band in candidates if band is not None)
    return bands or f"No bands: no level of {y} is reached by {FEWEST_CASES} of these cases"


def _legs(y: np.ndarray, least: float) -> list[int]:
    """Directions, +1 or -1, of the stretches that rise or fall by `least` or more, in the order of time."""
    legs: list[int] = []
    low = high = float(y[0])
    for value in y.tolist():
        low, high = min(low, value), max(high, value)
        if value - low >= least and legs[-1:] != [1]:
            legs.append(1)
            high = value
        elif high - value >= least and legs[-1:] != [-1]:
            legs.append(-1)
            low = value
    return legs


def _first_passage_envelope(flights: list[np.ndarray], levels: np.ndarray, rising: bool) -> Envelope | None:
    """Quantiles of x at the levels of y on the first way up, or down, to each; None for too few flights."""
    way = -1.0 if rising else 1.0
    asked = np.sort(way * levels)
    table = np.array([first_descent(flight[:, 0], way * flight[:, 1], asked) for flight in flights])[:, :: int(way)]
    reached = np.count_nonzero(np.isfinite(table), axis=0)
    used = reached >= FEWEST_CASES
    if np.count_nonzero(used) < 2:
        return None
    curves = {
        p: np.where(supported(p, reached[used]), np.nanquantile(table[:, used], p, axis=0), np.nan)
        for p in envelope_probabilities(len(flights))
    }
    return Envelope(levels[used], curves, len(flights), rising)


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
