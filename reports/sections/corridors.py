"""The corridor: which cases violate which limits, where in the plane of two columns, and how probable that is."""

from collections.abc import Iterator
from itertools import compress

import numpy as np

from mc_engine.model.figures import CorridorFigure
from mc_engine.statistics import SurfaceMap, Verdict
from mc_engine.statistics.maps import map_metrics
from reports.document.blocks import FigureBlock, Table
from reports.drawing.marks import Axis, Line, Points
from reports.figures.clouds import LIMIT_SETS, case_scatter, outline
from reports.run.flown import Flown
from reports.run.outcomes import NOT_COMPLETED, inside, inside_words
from reports.sections.figure_blocks import nominal_rings, thinned_rows
from reports.sections.tables import limit_text
from reports.text.numbers import count

FEWEST_BEYOND = 12  # cases on either side of a limit that is drawn
TOLD_RIGHT = 0.75  # share of the cases beyond a limit that its line must put there
MOST_CLASSES = len(LIMIT_SETS)  # with a colour, "inside" among them


def corridor_blocks(flown: Flown) -> Iterator[FigureBlock | Table | str]:
    """The model's corridors; nothing where the campaign sets no requirement on their metrics."""
    for figure in flown.figures:
        if isinstance(figure, CorridorFigure) and not (figure.upstream and flown.absence(figure.x, figure.y)):
            verdicts = [verdict for verdict in flown.verdicts if verdict.metric in figure.metrics]
            if verdicts:
                violated = np.array([~inside(flown, [verdict]) for verdict in verdicts])
                yield _corridor(flown, figure, verdicts, violated)


def _corridor(flown: Flown, figure: CorridorFigure, verdicts: list[Verdict], violated: np.ndarray) -> FigureBlock | str:
    x, y = flown.values(figure.x), flown.values(figure.y)
    placed = np.isfinite(x) & np.isfinite(y)
    used = np.flatnonzero(placed)
    if not used.size:
        lacking = f"none of {count(flown.n_held)} cases has both {flown.words(figure.x)} and {flown.words(figure.y)}"
        return f"{figure.title}: not drawn; {flown.absence(figure.x, figure.y) or lacking}."
    if reason := flown.unsquarable(figure.x, figure.y):
        return f"{figure.title}: not drawn; {reason}."
    names = [verdict.name for verdict in verdicts]
    words, member = _classes(names, violated, ~flown.ok, inside_words(flown, verdicts))
    # every violation stays in the picture, as far as there is room
    beyond = np.flatnonzero(placed & violated.any(axis=0))
    rows = thinned_rows(used, thinned_rows(beyond, np.empty(0, np.int64)))
    limits = tuple(_limit_lines(flown, figure, verdicts))
    if not limits and not violated.any():
        these = flown.held_words if flown.sampled else "cases"
        return f"{figure.title}: not drawn; all {these} are {inside_words(flown, verdicts)}."
    drawing = case_scatter(
        Points(x[rows], y[rows], "", cases=flown.case_ids[rows], columns=(figure.x, figure.y)),
        member[rows],
        [(word, int(np.count_nonzero(member[used] == k))) for k, word in enumerate(words)],
        (Axis(flown.axis(figure.x)), Axis(flown.axis(figure.y))),
        flown.n_held,
        lengths=flown.lengths(figure.x, figure.y),
        styles=LIMIT_SETS,
        rings=nominal_rings(flown, figure.x, figure.y),
        outlines=limits,
        form="Cases by the limits that they violate",
    )
    missing = flown.n_held - used.size
    lost = f" {count(missing)} of {count(flown.n_held)} cases have no values to draw." if missing else ""
    said = "" if limits else " No limit is drawn: none of them is decided by the two columns alone."
    return FigureBlock(f"{figure.title}{flown.sample_words}.{said}{lost}", drawing, "wide")


def _classes(
    names: list[str], violated: np.ndarray, failed: np.ndarray, inside_all: str
) -> tuple[list[str], np.ndarray]:
    """Words of the classes, and the class of each case: inside, then the sets of limits violated, most frequent first.

    violated : bool[n_requirements, n_held].  What is too rare for a colour of its own shares one.
    failed : bool[n_held].  These come last: they have no numbers that could be beyond a limit.
    """
    code = np.where(failed, 0, (violated * (1 << np.arange(len(names)))[:, None]).sum(axis=0))
    sets, cases = np.unique(code[code > 0], return_counts=True)
    ordered = sets[np.lexsort((sets, -cases))].tolist()
    most = MOST_CLASSES - 1 - int(failed.any())
    own = ordered if len(ordered) <= most else ordered[: most - 1]
    words = [inside_all]
    member = np.zeros(code.size, dtype=np.int64)
    for k, limits in enumerate(own, start=1):
        words.append(f"beyond {' and '.join(compress(names, [limits >> bit & 1 for bit in range(len(names))]))}")
        member[code == limits] = k
    if len(own) < len(ordered):
        words.append("beyond other sets of limits")
        member[(code > 0) & (member == 0)] = len(words) - 1
    if failed.any():
        words.append(NOT_COMPLETED)
        member[failed] = len(words) - 1
    return words, member


def _limit_lines(flown: Flown, figure: CorridorFigure, verdicts: list[Verdict]) -> Iterator[Line]:
    """Where the surface of a metric over the two columns is at its limit, if the two columns decide it.

    Each of two limits has cases beyond it on its own side.  Of a count, such as that of exits, the surface between two
    cases means nothing.
    """
    x, y = flown.values(figure.x), flown.values(figure.y)
    metrics = {name: flown.values(name) for name in dict.fromkeys(verdict.metric for verdict in verdicts)}
    metrics = {name: values for name, values in metrics.items() if _continuous(values)}
    surfaces = dict(zip(metrics, map_metrics(x, y, [*metrics.values()]), strict=True))
    nth = 0
    for verdict in verdicts:
        surface = surfaces.get(verdict.metric)
        values = flown.values(verdict.metric)
        sides = ((np.greater, verdict.at_most), (np.less, verdict.at_least))
        limits = [(limit, beyond) for beyond, limit in sides if limit is not None]
        if surface is None or not any(_decides(surface, x, y, values, beyond(values, at)) for at, beyond in limits):
            continue
        import contourpy

        generator = contourpy.contour_generator(surface.x, surface.y, np.ma.masked_invalid(surface.value))
        curves = [np.asarray(curve) for limit, _ in limits for curve in generator.lines(limit)]
        if curves:  # one mark for two limits: the legend has one entry for their common words
            text = f"{flown.words(verdict.metric)} {limit_text(verdict, flown.unit(verdict.metric))}"
            yield outline("limit", f"{text}, in the mean over the other inputs", curves, nth)
            nth += 1


def _continuous(values: np.ndarray) -> bool:
    numbers = values[np.isfinite(values)]
    return bool((numbers != np.round(numbers)).any())


def _decides(surface: SurfaceMap, x: np.ndarray, y: np.ndarray, values: np.ndarray, beyond: np.ndarray) -> bool:
    """Whether the surface tells most cases beyond the limit, and most inside it, from the others.

    Told apart by the surface's own order: beyond are as many cases, those with the most extreme surface, as really are.
    """
    row, column = (_nearest(axis, place) for axis, place in ((surface.y, y), (surface.x, x)))
    told = np.where(np.isfinite(x) & np.isfinite(y), surface.value[row, column], np.nan)
    used = np.isfinite(told) & np.isfinite(values)
    told, outside = told[used], beyond[used]
    n_outside = int(outside.sum())
    if min(n_outside, outside.size - n_outside) < FEWEST_BEYOND:
        return False
    downwards = values[used][outside].mean() < values[used][~outside].mean()
    most = np.argsort(told if downwards else -told, kind="stable")[:n_outside]
    return bool(outside[most].mean() >= TOLD_RIGHT)


def _nearest(axis: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Index of the node of an ascending axis nearest to each place; any for a place that is not a number."""
    middles = 0.5 * (axis[1:] + axis[:-1])
    return np.searchsorted(middles, np.nan_to_num(places))
