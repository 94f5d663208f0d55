"""The distributions, time histories and footprints of two runs, laid over one another."""

from collections.abc import Iterator, Sequence

import numpy as np

from mc_engine.model.figures import FootprintFigure, HistoryFigure
from mc_engine.statistics.geodesy import ELLIPSOIDS, middle_plane
from mc_engine.statistics.picked_cases import picked_rows
from mc_engine.store.run_files import NOMINAL_CASE
from reports.document.blocks import FigureBlock
from reports.drawing.marks import Axis, Band, Drawing, Line, Plot, Points, between, to_scale
from reports.drawing.palette import BLUE, VERMILION
from reports.figures.histories import Envelope
from reports.footprint.landings import landed, planet_of
from reports.run.flown import Flown
from reports.run.history_bands import fair_cases, history_envelopes
from reports.text.numbers import axis_label, count, percent

MOST_PANELS = 9
MOST_POINTS = 2000  # of each run
BINS = 40
BINNED = "fraction of the cases in each bin"
HEIGHT = 260.0  # pixels of a panel
NAMES, COLOURS, SIGNS = ("run A", "run B"), (BLUE, VERMILION), ("circle", "diamond")
FORM = "Two runs over one another"
NOISE = 1e-9  # of the range over all saved cases: curves of a smaller one are rounding errors
TAILS = (0.001, 0.999)  # of both runs, ends of the axis of a distribution


def overlay_blocks(runs: tuple[Flown, Flown], metrics: Sequence[str]) -> Iterator[FigureBlock | str]:
    """Figures of what both runs have; metrics : those whose distributions are drawn, in this order."""
    panels = tuple(panel for name in metrics[:MOST_PANELS] if (panel := _distribution(runs, name)) is not None)
    if panels:
        caption = "Distributions of the metrics whose numbers differ, significant changes first."
        if max(run.n_held for run in runs) > 1.0 / TAILS[0]:
            caption += f" Beyond the axes: at most {percent(TAILS[0], 1)} of the cases of each run, at either end."
        for run, name in zip(runs, NAMES, strict=True):
            caption += f" Outlines of {name}: {run.held_words}." if run.sampled else ""
        yield FigureBlock(caption, Drawing(FORM, panels, 3), "small")
    drawn = dict(_histories(runs))
    panels = tuple(item for item in drawn.values() if item is not None)[:MOST_PANELS]
    if panels:
        caption = (
            "Time histories of both runs: of the saved cases, or the nominal ones where a run saved fewer than 20."
        )
        yield FigureBlock(caption, Drawing(FORM, panels, 3), "half")
    if noise := [name for name, panel in drawn.items() if panel is None]:
        yield f"Not drawn, rounding errors only in both nominal cases: {', '.join(noise)}."
    for figure in (drawn for drawn in runs[1].figures if isinstance(drawn, FootprintFigure)):
        footprint = _footprint((runs[0].own, runs[1].own), figure)
        if footprint is not None:
            caption = f"{figure.title}, both runs. {_thinned_words(runs)}"
            yield FigureBlock(caption, Drawing(FORM, (footprint,)), "wide")


def _distribution(runs: tuple[Flown, Flown], name: str) -> Plot | None:
    """Outlines of two histograms over common bins."""
    values = [numbers[np.isfinite(numbers)] for numbers in (run.values(name) for run in runs)]
    if min(value.size for value in values) == 0:
        return None
    low = min(np.quantile(value, TAILS[0], method="lower") for value in values)
    high = max(np.quantile(value, TAILS[1], method="higher") for value in values)
    if not low < high:
        return None
    edges = np.linspace(low, high, BINS + 1)
    marks = []
    for run, value in enumerate(values):
        height = np.histogram(value, edges)[0] / value.size
        marks.append(_line(run, np.repeat(edges, 2), np.r_[0.0, np.repeat(height, 2), 0.0], BINNED))
    return Plot(tuple(marks), Axis(runs[1].axis(name)), Axis("fraction of the cases"), height=HEIGHT)


def _histories(runs: tuple[Flown, Flown]) -> Iterator[tuple[str, Plot | None]]:
    """By quantity its panel, None where both curves are nothing beside those of the saved cases."""
    wanted = [name for figure in runs[1].figures if isinstance(figure, HistoryFigure) for name in figure.quantities]
    for name in dict.fromkeys(wanted):
        if all(len(run.histories) and name in run.histories.columns for run in runs):
            bands = [_band(flown, name) for flown in runs]
            if None in bands:  # a band beside a nominal case alone would say that this run has no spread
                bands = [None, None]
            marks = [mark for run in (0, 1) for mark in _history_marks(run, runs[run], name, bands[run])]
            if marks:
                plot = Plot(
                    tuple(marks), Axis(axis_label("time", runs[1].unit("t_s"))), Axis(runs[1].axis(name)), height=HEIGHT
                )
                low, high = Plot(tuple(marks), Axis(), Axis(margin=0.0)).ends[1]
                saved = np.concatenate([run.histories[name].to_numpy(dtype=np.float64) for run in runs])
                yield name, None if high - low < NOISE * np.ptp(saved[np.isfinite(saved)]) else plot


def _band(flown: Flown, name: str) -> Envelope | None:
    """The envelope of the first cases; None where too few are saved."""
    fair = fair_cases(flown)
    return history_envelopes(flown.histories, fair, [name]).get(name)


def _history_marks(run: int, flown: Flown, name: str, band: Envelope | None) -> Iterator[Band | Line]:
    """The band and its median, or the nominal case without one."""
    if band is not None:
        key = f"{NAMES[run]}: smallest to largest"
        yield between(band.at, band.curves[0.0], band.curves[1.0], COLOURS[run], 0.2, key=key)
        yield _line(run, band.at, band.curves[0.5], "median")
        return
    rows = flown.histories[flown.histories["case_id"] == NOMINAL_CASE].sort_values("t_s", kind="stable")
    if len(rows):
        yield _line(run, rows["t_s"].to_numpy(np.float64), rows[name].to_numpy(np.float64), "nominal")


def _line(run: int, x: np.ndarray, y: np.ndarray, what: str) -> Line:
    return Line(x, y, COLOURS[run], NAMES[run], key=f"{NAMES[run]}: {what}")


def _footprint(runs: tuple[Flown, Flown], figure: FootprintFigure) -> Plot | None:
    """Impact points in the plane about the mean impact point of run A; None on different or unknown planets."""
    places = [landed(run, figure) for run in runs]
    planet, other = (planet_of(run, figure) for run in runs)
    if min(latitude.size for latitude, _ in places) == 0 or planet not in ELLIPSOIDS or planet != other:
        return None
    plane = middle_plane(*places[0], ELLIPSOIDS[planet])
    if plane is None:
        return None
    marks = []
    for run, (latitude, longitude) in enumerate(places):
        rows = picked_rows(latitude.size, MOST_POINTS)
        points = plane.points(latitude[rows], longitude[rows]) / 1000.0
        key = f"{NAMES[run]}: impact points"
        marks.append(Points(points[:, 0], points[:, 1], COLOURS[run], NAMES[run], SIGNS[run], opacity=0.5, key=key))
    east, north = "east of the mean impact point of run A [km]", "north of it [km]"
    return to_scale(Plot(tuple(marks), Axis(east), Axis(north)), np.inf)


def _thinned_words(runs: tuple[Flown, Flown]) -> str:
    most = max(run.n_tried for run in runs)
    return f"At most {count(MOST_POINTS)} cases of each run are drawn." if most > MOST_POINTS else ""
