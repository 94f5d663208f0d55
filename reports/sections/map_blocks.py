"""The maps of a run: a metric over two inputs, or why there is none."""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from mc_engine.model.figures import MapFigure
from mc_engine.statistics import SurfaceMap
from mc_engine.statistics.maps import FEWEST, LEAST_EXPLAINED, explained_share, map_metrics
from mc_engine.statistics.summary import nearly_equal
from reports.document.blocks import FigureBlock
from reports.figures.maps import metric_map
from reports.run.flown import Flown
from reports.sections.figure_blocks import WORST_RANKS, nominal_rings, thinned_rows
from reports.text.numbers import count, number, percent, with_unit

STRONGEST_INPUTS = 4  # among whose pairs the one is looked for that explains most
Surfaces = dict[tuple[str, str, str], SurfaceMap | None]  # by the two inputs and the metric


def map_blocks(flown: Flown) -> Iterator[FigureBlock | str]:
    """The model's maps; a sentence in place of one that cannot be drawn, one for all over inputs not dispersed."""
    elsewhere = []
    figures = [drawn for drawn in flown.figures if isinstance(drawn, MapFigure)]
    surfaces = _surfaces(flown, figures)
    for figure in figures:
        absent = flown.absence(figure.x, figure.y)
        if not absent:
            yield _map_block(flown, figure, surfaces)
        elif not figure.upstream:
            elsewhere.append(f"{figure.title} ({absent})")
    if elsewhere:
        yield f"Not drawn: {'; '.join(elsewhere)}."


def _surfaces(flown: Flown, figures: Sequence[MapFigure]) -> Surfaces:
    """The surfaces of the maps that can be drawn; those over the same inputs are made together."""
    metrics: dict[tuple[str, str], list[str]] = {}
    for figure in figures:
        if not flown.absence(figure.x, figure.y) and not _no_map(flown, figure):
            metrics.setdefault((figure.x, figure.y), []).append(figure.metric)
    surfaces: Surfaces = {}
    for (x, y), names in metrics.items():
        mapped = map_metrics(flown.values(x), flown.values(y), [_apart(flown, x, y, name) for name in names])
        surfaces.update({(x, y, name): surface for name, surface in zip(names, mapped, strict=True)})
    return surfaces


def _apart(flown: Flown, x: str, y: str, metric: str) -> np.ndarray:
    """float64[n_held], the metric of the cases that a surface over x and y is fitted to; NaN of all others.

    Most cases of a Saltelli block have the x and y of another one and nearly all of its other inputs: taken for
    independent cases, they would lend each other certainty, and cross-validation would follow their noise.  The first
    of them with a number stands for all.
    """
    values = flown.values(metric)
    if flown.design != "saltelli":
        return values
    used = np.flatnonzero(np.isfinite(values))
    places = np.column_stack([flown.values(x)[used], flown.values(y)[used]])
    first = used[np.unique(places, axis=0, return_index=True)[1]]
    return np.where(np.isin(np.arange(values.size), first), values, np.nan)


def _map_block(flown: Flown, figure: MapFigure, surfaces: Surfaces) -> FigureBlock | str:
    if reason := _no_map(flown, figure):
        return f"{figure.title}: not drawn; {reason}."
    x, y, z = (flown.values(name) for name in (figure.x, figure.y, figure.metric))
    used = np.flatnonzero(np.isfinite(x) & np.isfinite(y) & np.isfinite(z))
    surface = surfaces[figure.x, figure.y, figure.metric]
    if surface is not None and surface.explained < LEAST_EXPLAINED:
        return f"{figure.title}: not drawn; {_too_little_explained(flown, figure, surface.explained)}."
    if surface is None or not np.isfinite(surface.value).any():
        over = f"{flown.words(figure.x)} and {flown.words(figure.y)}"
        few = f"the run has too few cases over {over} for a map"
        unsure = (
            f"nowhere is its surface over {over} sure enough: other inputs scatter it, the {count(used.size)} cases "
            "are too few, or they lie on a line or on three levels of an input"
        )
        return f"{figure.title}: not drawn; {few if used.size < FEWEST else unsure}."
    rows = thinned_rows(used, flown.rows(flown.worst(figure.metric, WORST_RANKS)["case_id"]))
    labels = flown.axis(figure.x), flown.axis(figure.y), flown.axis(figure.metric)
    drawing = metric_map(
        surface,
        np.column_stack([x[rows], y[rows]]),
        z[rows],
        flown.case_ids[rows],
        labels,
        flown.unit(figure.metric),
        n_points=int(used.size),
        rings=nominal_rings(flown, figure.x, figure.y),
        columns=(figure.x, figure.y, figure.metric),
    )
    return FigureBlock(f"{figure.title}.", drawing, "wide")


def _too_little_explained(flown: Flown, figure: MapFigure, share: float) -> str:
    """How little the two inputs explain, and which two explain most."""
    x, y = flown.words(figure.x), flown.words(figure.y)
    said = f"{x} and {y} together explain {percent(max(share, 0.0), 0)} of the variance of {flown.words(figure.metric)}"
    names = [
        contributor.name
        for contributor in flown.contributors(figure.metric)
        if np.isfinite(flown.values(contributor.name)).any()
    ]
    pairs = {
        (a, b): explained_share(flown.values(a), flown.values(b), _apart(flown, a, b, figure.metric))
        for a, b in combinations(names[:STRONGEST_INPUTS], 2)
        if {a, b} != {figure.x, figure.y}
    }
    best = max(pairs, key=lambda pair: np.nan_to_num(pairs[pair], nan=-1.0), default=None)
    if best is None or not pairs[best] > share:
        return f"{said}, and no two inputs more"
    a, b = (flown.words(name) for name in best)
    return f"{said}; the two inputs that explain most are {a} and {b}, {percent(max(pairs[best], 0.0), 0)}"


def _no_map(flown: Flown, figure: MapFigure) -> str:
    """Why there is nothing to map in the cases that have all three numbers; empty if there is."""
    if reason := flown.absence(figure.metric) or flown.unsquarable(figure.x, figure.y, figure.metric):
        return reason
    x, y, z = (flown.values(name) for name in (figure.x, figure.y, figure.metric))
    used = np.isfinite(x) & np.isfinite(y) & np.isfinite(z)
    x, y, z = x[used], y[used], z[used]
    if not z.size:
        return f"no case has a number for all of {flown.listed((figure.metric, figure.x, figure.y))}"
    if z.size > 1 and nearly_equal(z.min(), z.max()):
        return f"{flown.words(figure.metric)} is {with_unit(number(z[0]), flown.unit(figure.metric))} in all cases"
    flat = [name for name, values in ((figure.x, x), (figure.y, y)) if nearly_equal(values.min(), values.max())]
    return f"{flown.words(flat[0])} is the same in all cases" if z.size > 1 and flat else ""
