"""The figures of a run: picks the data, bounds how much of it is drawn, and says what was left out."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
import pandas as pd

from mc_engine.model.figures import ScatterFigure
from mc_engine.statistics.picked_cases import picked_rows
from mc_engine.statistics.summary import nearly_equal
from mc_engine.store.run_files import NOMINAL_CASE
from reports.document.blocks import FigureBlock
from reports.drawing.marks import Axis, Drawing, Limit, Line, Plot, Points, names_axis, nominal_ring
from reports.drawing.palette import VERMILION
from reports.figures.clouds import case_scatter
from reports.figures.distributions import histogram, histograms
from reports.figures.histories import Envelope, HistoryLine, history_figure, history_plot, phase_limits
from reports.run.cloud_regions import cloud_regions
from reports.run.default_figures import history_figures, scatter_figures
from reports.run.flown import NEGLIGIBLE_SPREAD, ROUNDED_ZERO, UNSQUARABLE, Flown, rounded_zero
from reports.run.history_bands import FEWEST_CASES, OUTER, fair_cases, history_envelopes, outer_percentile
from reports.run.history_limits import history_limits
from reports.run.outcomes import case_outcomes, outcome_names
from reports.run.phases import phase_times, phases_in_words, quantity_names
from reports.sections.case_tables import FEW_CASES, input_words
from reports.sections.published import published_law
from reports.text.numbers import axis_label, count, counted, exact, percent

POINTS_SHOWN = 2000
FEWEST_SHOWN = 50  # of an outcome, as far as there are so many
MOST_PANELS = 16  # of a figure
LOW_PANEL = 160.0  # height of the histograms of other metrics
COLOURED_CASES = 8
COLOURED_OVER_BANDS = 2  # more would hide the band
WORST_RANKS = 10
HISTORIES_SHOWN = 40
FEWEST_VALUES = 10  # of a histogram


def thinned_rows(rows: np.ndarray, always: np.ndarray, most: int = POINTS_SHOWN) -> np.ndarray:
    """At most about `most` of the ascending row numbers: evenly through the table, those of `always` among them."""
    if rows.size <= most:
        return rows
    even = rows[picked_rows(rows.size, most)]
    place = np.minimum(np.searchsorted(rows, always), rows.size - 1)
    return np.union1d(even, always[rows[place] == always])


def thinned_by_outcome(rows: np.ndarray, outcome: np.ndarray) -> np.ndarray:
    """About POINTS_SHOWN of the ascending row numbers at most: the same share of every outcome, evenly spread.

    An outcome of up to FEWEST_SHOWN cases is drawn whole.
    """
    share = min(1.0, POINTS_SHOWN / max(rows.size, 1))
    groups = [rows[outcome[rows] == kind] for kind in np.unique(outcome[rows])]
    kept = [max(round(share * group.size), min(FEWEST_SHOWN, group.size)) for group in groups]
    chosen = [group[picked_rows(group.size, n)] for group, n in zip(groups, kept, strict=True)]
    return np.sort(np.concatenate(chosen)) if chosen else rows


def nominal_rings(flown: Flown, x: str, y: str) -> tuple[Points, ...]:
    """A ring around the nominal case, if it has both numbers."""
    place = flown.nominal_value(x), flown.nominal_value(y)
    return () if place[0] is None or place[1] is None else (nominal_ring((place[0], place[1]), VERMILION),)


def scatter_blocks(flown: Flown) -> Iterator[FigureBlock | str]:
    """The model's scatter figures; a sentence in place of an empty one, none where the run upstream is another."""
    for figure in scatter_figures(flown):
        if not (figure.upstream and flown.absence(figure.x, figure.y)):
            yield _scatter_block(flown, figure)


def _scatter_block(flown: Flown, figure: ScatterFigure) -> FigureBlock | str:
    x, y = flown.values(figure.x), flown.values(figure.y)
    used = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if not used.size:
        reason = (
            flown.absence(figure.x, figure.y) or f"no case has both {flown.words(figure.x)} and {flown.words(figure.y)}"
        )
        return f"{figure.title}: not drawn; {reason}."
    if reasons := [(why, name) for name in (figure.x, figure.y) if (why := flown.undrawn(name))]:
        told = "; ".join(f"{why}: {flown.listed([name])}" for why, name in reasons)
        return f"{figure.title}: not drawn, {told}."
    regions = cloud_regions(flown, (figure.x, figure.y), x[used], y[used])
    drawing = outcome_scatter(flown, figure.x, figure.y, regions)
    impossible = bool(regions) and not any(region.name == "ellipse" for region in regions)
    left_out = ". No normal ellipse is shown: it would leave the physical range of these metrics" if impossible else ""
    return FigureBlock(f"{figure.title}{flown.sample_words}{left_out}.", drawing, "wide")


def outcome_scatter(flown: Flown, x_name: str, y_name: str, regions: Sequence[Line] = ()) -> Drawing:
    """The cases over two columns by their outcome, thinned; those at the ends of both columns among them."""
    x, y, outcome = flown.values(x_name), flown.values(y_name), case_outcomes(flown)
    used = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    ends = [int(used[pick(values[used])]) for values in (x, y) for pick in (np.argmin, np.argmax)] if used.size else []
    rows = np.union1d(thinned_by_outcome(used, outcome), ends).astype(np.int64)
    counts = np.bincount(outcome[used], minlength=3).tolist()
    return case_scatter(
        Points(x[rows], y[rows], "", cases=flown.case_ids[rows], columns=(x_name, y_name)),
        outcome[rows],
        tuple(zip(outcome_names(flown), counts, strict=True)),
        (_column_axis(flown, x_name), _column_axis(flown, y_name)),
        flown.n_held,
        lengths=flown.lengths(x_name, y_name),
        rings=nominal_rings(flown, x_name, y_name),
        outlines=regions,
    )


def is_switch(flown: Flown, name: str) -> bool:
    """Whether the levels of a column are no and yes."""
    return pd.api.types.is_bool_dtype(flown.cases[name])


def _column_axis(flown: Flown, name: str) -> Axis:
    """An axis of numbers, or of the two levels of a switch."""
    label = flown.axis(name)
    return names_axis([exact(level) for level in (False, True)], label) if is_switch(flown, name) else Axis(label)


def distribution_blocks(flown: Flown) -> Iterator[FigureBlock | str]:
    """Histograms of the metrics that matter, with limits and percentiles; those not drawn, in sentences.

    Of cases that were chosen, as those of a grid, a sentence alone.
    """
    if flown.chosen and flown.n_tried:
        yield (
            f"The cases of this design ({flown.design}) were chosen, not drawn at random, so their metrics have no "
            "distribution; their ranges are in appendix All metrics."
        )
        return
    key, others = _drawable(flown)
    title = "Distributions of the key metrics" if others else "Distributions of the metrics"
    yield from _distribution_figures(flown, key, title)
    found = flown.summaries.items()
    reasons = {
        f"fewer than {FEWEST_VALUES} cases have a number": [
            name for name, item in found if 0 < item.n_used < FEWEST_VALUES and not item.constant
        ],
        "the same in all cases that have it": [name for name, item in found if item.constant],
        **{
            why: [name for name, item in found if item.n_used >= FEWEST_VALUES and flown.undrawn(name) == why]
            for why in (NEGLIGIBLE_SPREAD, ROUNDED_ZERO, UNSQUARABLE)
        },
        "no case has a number": [name for name, item in found if item.n_used == 0],
    }
    yield from (f"Not drawn, {reason}: {flown.listed(names)}." for reason, names in reasons.items() if names)


def other_distributions(flown: Flown) -> Iterator[FigureBlock]:
    """Histograms of all other metrics; none of cases that were chosen."""
    if flown.chosen:
        return
    yield from _distribution_figures(flown, _drawable(flown)[1], "Distributions of the other metrics", LOW_PANEL)


def _drawable(flown: Flown) -> tuple[list[str], list[str]]:
    """Metrics with a distribution: those that matter, and the others."""
    enough = [name for name, item in flown.summaries.items() if item.n_used >= FEWEST_VALUES and not item.constant]
    names = [name for name in enough if not flown.undrawn(name)]
    return [name for name in flown.key_metrics if name in names], [
        name for name in names if name not in flown.key_metrics
    ]


def _distribution_figures(flown: Flown, names: list[str], title: str, height: float = 240.0) -> Iterator[FigureBlock]:
    pages = -(-len(names) // MOST_PANELS)
    for page in range(pages):
        group = names[len(names) * page // pages : len(names) * (page + 1) // pages]
        plots = [_distribution_plot(flown, name, height) for name in group]
        part = f" ({page + 1} of {pages})" if pages > 1 else ""
        used = f"{counted(flown.n_tried, 'case')}, fewer where a panel says so."
        bars = f" Bars: {flown.held_words}." if flown.sampled else ""
        yield FigureBlock(f"{title}{part}, {used}{bars}", histograms(plots), "small")


def _distribution_plot(flown: Flown, name: str, height: float) -> Plot:
    values, summary = flown.values(name), flown.summaries[name]
    limits = {limit for verdict in flown.verdicts if verdict.metric == name for limit in verdict.limits.ends}
    used = "" if summary.n_used == summary.n_tried else f"{count(summary.n_used)} of {count(summary.n_tried)} cases"
    return histogram(
        values[np.isfinite(values)],
        flown.axis(name),
        summary,
        flown.stated.outer if flown.random else (),
        title=used,
        nominal=flown.nominal_value(name),
        limits=sorted(limits),
        normal=_printed_normal(flown, name),
        column=name,
        with_intervals=flown.random,
        height=height,
    )


def _printed_normal(flown: Flown, name: str) -> tuple[float, float] | None:
    """Mean and standard deviation that the source prints, in the unit chosen for the metric."""
    law = published_law(flown.own, name)
    return None if law is None else (flown.told(name, law[0]), flown.told(name, law[1]))


def history_blocks(flown: Flown) -> Iterator[FigureBlock | str]:
    """The model's history figures over all saved histories; a sentence in place of one without histories."""
    wanted = history_figures(flown)
    if not wanted:
        return
    if not len(flown.histories):
        yield "No time histories were saved in this run; [retention] in the campaign file selects cases."
        return
    saved = quantity_names(flown.histories)
    asked = list(dict.fromkeys(name for figure in wanted for name in figure.quantities))
    missing = [name for name in asked if name not in saved]
    silent = [name for name in asked if name in saved and not np.isfinite(flown.histories[name].to_numpy()).any()]
    known = [name for name in asked if name in saved and name not in silent]
    constant = [name for name in known if is_constant(flown.histories[name].to_numpy())]
    rounded = [name for name in _rounded_zeros(flown, known) if name not in constant]
    drawn = [name for name in known if name not in (*constant, *rounded)]
    histories = saved_histories(flown, drawn)
    yield from _envelope_words(flown, histories.envelopes)
    for figure in wanted:
        plots = [histories.plot(flown, name) for name in figure.quantities if name in drawn]
        if plots:
            yield FigureBlock(figure.title, history_figure(plots), "half")
    if constant:
        yield f"Not drawn, the same in all saved cases at all times: {flown.listed(constant)}."
    if rounded:
        yield f"Not drawn, {ROUNDED_ZERO} in all saved cases: {flown.listed(rounded)}."
    if silent:
        yield f"Not drawn, no saved case has a number: {flown.listed(silent)}."
    if missing:
        yield f"Not drawn, the histories have no such output: {', '.join(missing)}."


def _rounded_zeros(flown: Flown, names: list[str]) -> list[str]:
    """Those of these quantities that are nothing beside the largest one in their own unit."""
    own, sizes = flown.own, {}
    for name in names:
        values = own.histories[name].to_numpy(dtype=np.float64)
        sizes[name] = float(np.abs(values[np.isfinite(values)]).max())
    largest: dict[str, float] = {}
    for name, size in sizes.items():
        largest[own.unit(name)] = max(size, largest.get(own.unit(name), 0.0))
    return [name for name in names if own.unit(name) and rounded_zero(sizes[name], largest[own.unit(name)])]


@dataclass(frozen=True)
class SavedHistories:
    """What is drawn of the saved cases: their lines, envelopes by quantity, and limits by quantity with their words."""

    lines: tuple[HistoryLine, ...]
    envelopes: dict[str, Envelope]
    limits: dict[str, tuple[Limit, ...]]

    def plot(self, flown: Flown, name: str) -> Plot:
        """The panel of one quantity."""
        label, time = flown.axis(name), axis_label("time", flown.unit("t_s"))
        phases = phase_limits(phase_times(flown), phases_in_words(flown))
        return history_plot(name, label, time, self.lines, self.envelopes.get(name), self.limits.get(name, ()), phases)


def saved_histories(
    flown: Flown, names: list[str], cases: dict[int, tuple[str, int | None]] | None = None
) -> SavedHistories:
    """Of these quantities; cases : name and rank of the lines, by default those worth a line."""
    if not len(flown.histories):
        return SavedHistories((), {}, {})
    fair = fair_cases(flown)
    envelopes = history_envelopes(flown.histories, fair, names)
    if cases is None:
        cases = {
            case: (label, rank)
            for case, (label, rank) in history_cases(flown).items()
            if not envelopes or (rank is not None and rank <= COLOURED_OVER_BANDS)
        }
    lines = tuple(history_line(flown, case, label, rank, names) for case, (label, rank) in cases.items())
    return SavedHistories(lines, envelopes, history_limits(flown, names))


def _envelope_words(flown: Flown, envelopes: dict[str, Envelope]) -> Iterator[str]:
    """What the envelopes and limits of all history figures are."""
    sizes = {envelope.n_cases for envelope in envelopes.values()}
    if sizes:
        n = sizes.pop()
        lost = fair_cases(flown)[-1] + 1 - n
        without = f" ({counted(lost, 'failed case')} among them left no history)" if lost else ""
        outer = outer_percentile(n)
        why = (
            f", the outermost that {count(n)} cases support; {percent(OUTER[0], 3)} needs {count(ceil(1.0 / OUTER[0]))}"
        )
        yield (
            f"Envelopes: smallest to largest, {percent(outer, 3)} to {percent(1.0 - outer, 3)}"
            f"{why if outer > OUTER[0] else ''}, and median of the first {count(n)} saved cases{without}, "
            f"at every time of those that still fly: of fewer than {FEWEST_CASES}, smallest to largest alone. "
            "These cases were saved whatever their result."
        )
    elif flown.random:
        yield (
            f"Envelopes need {FEWEST_CASES} saved cases from case 0 on: “first = {FEWEST_CASES}” under "
            "[retention.histories]."
        )


def is_constant(values: np.ndarray) -> bool:
    numbers = values[np.isfinite(values)]
    return not numbers.size or nearly_equal(numbers.min(), numbers.max())


def history_cases(flown: Flown) -> dict[int, tuple[str, int | None]]:
    """Name and rank of the cases with histories: nominal 0, then by how bad they are in the metrics that matter."""
    kept = [int(case) for case in np.unique(flown.histories["case_id"].to_numpy())]
    reasons = _worst_reasons(flown)
    ordered = sorted((case for case in kept if case in reasons), key=lambda case: reasons[case][0])
    coloured = {case: rank for rank, case in enumerate(ordered[:COLOURED_CASES], start=1)}
    named: dict[int, tuple[str, int | None]] = {}
    for case in kept:
        if case == NOMINAL_CASE:
            named[case] = ("nominal", 0)
        elif case in coloured:
            named[case] = (f"case {case}: {reasons[case][1]}".removesuffix(": "), coloured[case])
        elif len(named) < HISTORIES_SHOWN:
            named[case] = (f"case {case}", None)
    return named


def _worst_reasons(flown: Flown) -> dict[int, tuple[int, str]]:
    """Per case among the worst: sort key and what it is worst in; for a handful of cases, what sets them apart."""
    if flown.n_tried <= FEW_CASES:
        return {int(case): (row, input_words(flown, row)) for row, case in enumerate(flown.case_ids)}
    reasons: dict[int, tuple[int, str]] = {}
    for order, metric in enumerate(flown.worst_first):
        one_sided = "largest" if flown.largest_is_worst(metric) else "smallest"
        which = "worst" if flown.limits(metric).two_sided else one_sided
        for place, case in enumerate(flown.worst(metric, WORST_RANKS)["case_id"], start=1):
            text = f"{which} {flown.words(metric)}" + (f", no. {place}" if place > 1 else "")
            reasons.setdefault(int(case), (place + WORST_RANKS * order, text))
    return reasons


def history_line(flown: Flown, case: int, label: str, rank: int | None, names: list[str]) -> HistoryLine:
    rows = flown.histories[flown.histories["case_id"] == case].sort_values("t_s", kind="stable")
    quantities = {name: rows[name].to_numpy(dtype=np.float64) for name in names}
    return HistoryLine(label, rows["t_s"].to_numpy(dtype=np.float64), quantities, rank)
