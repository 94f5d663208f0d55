"""The figure of all cases by outcome, and the data with which an interactive page shows single cases.

A page holds all cases as far as a budget of numbers reaches, so that what is chosen in a figure is counted in full.  Of
more cases, it holds those that its figures draw, the worst ones and those that did not pass, and says how many.
"""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import pandas as pd

from mc_engine.store.run_files import NOMINAL_CASE
from mc_engine.studies.replay_files import read_replay, replayed_cases
from reports.document.blocks import Block, CaseColumn, CaseData, FigureBlock, Section
from reports.figures.histories import thinned
from reports.run.flown import ColumnFacts, Flown
from reports.run.outcomes import INSIDE, case_outcomes, outcome_names, outcome_sentence
from reports.run.phases import quantity_names
from reports.sections.figure_blocks import is_constant, is_switch, outcome_scatter, thinned_rows
from reports.text.numbers import axis_label, exact

ANCHOR = "cases"
BINS = 10
MOST_CASES = 6000  # drawn, and held where a page cannot hold all
MOST_NUMBERS = 400_000  # of the cases, 4 bytes each
ROOM = 160_000  # numbers that further metrics may fill up
MOST_METRICS = 24
WORST_RANKS = 10
SAMPLES = 120  # of a curve
MOST_SAMPLES = 120_000  # of all histories, 5 bytes each


def case_blocks(flown: Flown) -> Iterator[Block | str]:
    """The figure of the cases by outcome; a sentence where there is nothing to draw them over."""
    if not flown.n_tried:
        return
    axes = case_axes(flown)
    if axes is None:
        yield "Cases are not drawn by their outcome: fewer than two inputs or metrics differ between them."
        return
    points = f" Points: {flown.held_words}." if flown.sampled else ""
    caption = f"Cases by outcome: {outcome_sentence(flown)}.{points}"
    yield FigureBlock(caption, outcome_scatter(flown, *axes), "wide")


def case_axes(flown: Flown) -> tuple[str, str] | None:
    """The two columns along which the share of passed cases changes most, inputs before metrics; None without two.

    Where all cases end alike, those that contribute most to the first metric.
    """
    inputs = [fact.name for fact in flown.with_role("dispersion") if _differs(flown.values(fact.name))]
    metrics = [name for name in flown.key_metrics if _differs(flown.values(name))]
    lost = case_outcomes(flown) != INSIDE
    if lost.any() and not lost.all():
        inputs.sort(key=lambda name: -_outcome_variance(flown.values(name), lost))
    elif metrics:
        size = {contributor.name: contributor.share for contributor in flown.contributors(metrics[0])}
        inputs.sort(key=lambda name: -size.get(name, 0.0))
    names = [*inputs, *metrics][:2]
    return (names[0], names[1]) if len(names) == 2 else None


def _differs(values: np.ndarray) -> bool:
    finite = values[np.isfinite(values)]
    return finite.size > 0 and bool(finite.min() < finite.max())


def _outcome_variance(values: np.ndarray, lost: np.ndarray) -> float:
    """Variance of the share of lost cases over bins of equally many values: also where both ends are lost.

    Each case counts as the share lost of all that have its value: a bin may end among equal values, where the order is
    that of the design, such as of another input's levels.
    """
    finite = np.isfinite(values)
    _, place, cases = np.unique(values[finite], return_inverse=True, return_counts=True)
    share = (np.bincount(place, lost[finite]) / cases)[np.sort(place)]
    return float(np.var([part.mean() for part in np.array_split(share, BINS) if part.size]))


# ---- what the page looks up


def case_data(flown: Flown, sections: Iterable[Section]) -> CaseData | None:
    """Inputs, metrics and histories of the cases that the page holds; None without a case.

    It holds all cases where it can, with as many metrics as there is room for, those that matter first.
    """
    if not flown.n_tried:
        return None
    key = [*flown.with_role("dispersion"), *(flown.columns[name] for name in flown.key_metrics[:MOST_METRICS])]
    everything = flown.n_tried * len(key) <= MOST_NUMBERS
    further = min(max(ROOM // flown.n_tried - len(key), 0), MOST_METRICS) if everything else 0
    facts = _shown_columns(flown, len(key) + further)
    histories = case_histories(flown)
    rows = np.arange(flown.n_held) if everything else _held_rows(flown, sections, histories, max(1, len(facts)))
    return CaseData(
        n_tried=flown.n_tried,
        ids=flown.case_ids[rows],
        outcome=case_outcomes(flown)[rows],
        outcomes=outcome_names(flown),
        columns=tuple(_column(flown, fact, rows) for fact in facts) + tuple(_place_columns(flown, sections, rows)),
        axes=case_axes(flown),
        time=axis_label("time", flown.unit("t_s")),
        quantities={name: flown.label(name) for name in _quantities(flown, histories)},
        histories=histories,
    )


def _shown_columns(flown: Flown, most: int) -> list[ColumnFacts]:
    """All inputs, then the metrics, those that matter first, together at most so many."""
    inputs = [fact.name for fact in flown.with_role("dispersion")]
    metrics = [fact.name for fact in flown.with_role("metric")]
    drawn = [
        name
        for figure in flown.figures
        for name in (getattr(figure, "x", ""), getattr(figure, "y", ""))
        if name in metrics
    ]
    return [flown.columns[name] for name in list(dict.fromkeys([*inputs, *flown.key_metrics, *drawn, *metrics]))[:most]]


def _column(flown: Flown, fact: ColumnFacts, rows: np.ndarray) -> CaseColumn:
    values = flown.cases[fact.name].iloc[rows]
    label = flown.label(fact.name)
    if is_switch(flown, fact.name):
        return CaseColumn(fact.name, label, fact.role, tuple(map(exact, values.tolist())))
    if not pd.api.types.is_numeric_dtype(values):
        return CaseColumn(fact.name, label, fact.role, tuple(values.astype(str)))
    return CaseColumn(fact.name, label, fact.role, flown.values(fact.name)[rows])


def _place_columns(flown: Flown, sections: Iterable[Section], rows: np.ndarray) -> Iterator[CaseColumn]:
    """Columns that only figures have, such as the impact points on a map."""
    for section in sections:
        for block in section.blocks:
            for name, (label, cases, values) in (
                block.drawing.places if isinstance(block, FigureBlock) else {}
            ).items():
                row = pd.Index(cases).get_indexer(flown.case_ids[rows])
                yield CaseColumn(name, label, "place", np.where(row >= 0, values[row], np.nan))


def _held_rows(flown: Flown, sections: Iterable[Section], histories: Iterable[int], columns: int) -> np.ndarray:
    """Row numbers of the cases that a page holds that cannot hold all, in the order of the table."""
    most = min(MOST_CASES, max(MOST_NUMBERS // columns, 1))
    place = pd.Index(flown.case_ids)
    worst = [flown.rows(flown.worst(metric, WORST_RANKS)["case_id"]) for metric in flown.key_metrics]
    lost = thinned_rows(np.flatnonzero(case_outcomes(flown) != INSIDE), np.empty(0, np.int64), most // 2)
    drawn = [place.get_indexer(np.asarray(ids)) for ids in _drawn_cases(sections)]
    wanted = np.concatenate([place.get_indexer(np.array(list(histories), np.int64)), *worst, lost, *drawn])
    first = pd.unique(wanted[wanted >= 0].astype(np.int64))[:most]
    return np.sort(first)


def _drawn_cases(sections: Iterable[Section]) -> Iterator[np.ndarray]:
    """Numbers of the cases that the figures draw as points."""
    for section in sections:
        for block in section.blocks:
            yield from block.drawing.cases if isinstance(block, FigureBlock) else ()


# ---- histories


def case_histories(flown: Flown) -> dict[int, dict[str, tuple[Any, Any]]]:
    """Thinned curves of the saved and replayed histories, by case and quantity, as many as there is room for.

    First the nominal case, then the worst, the failed, and the others.
    """
    table = _all_histories(flown)
    if not len(table):
        return {}
    names = quantity_names(table)
    frames = {int(case): frame for case, frame in table.groupby("case_id", sort=True)}
    ordered = [case for case in dict.fromkeys([NOMINAL_CASE, *_first_of_all(flown), *frames]) if case in frames]
    most = max(1, MOST_SAMPLES // (2 * SAMPLES * max(1, len(names))))
    return {case: _curves(frames[case], names) for case in ordered[:most]}


def _first_of_all(flown: Flown) -> Iterator[int]:
    for metric in flown.key_metrics:
        yield from (int(case) for case in flown.worst(metric, WORST_RANKS)["case_id"])
    yield from _replayed(flown)
    yield from (int(case) for case in flown.case_ids[~flown.ok])


def _curves(frame: pd.DataFrame, names: list[str]) -> dict[str, tuple[Any, Any]]:
    rows = frame.sort_values("t_s", kind="stable")
    t = rows["t_s"].to_numpy(dtype=np.float64)
    return {name: thinned(t, rows[name].to_numpy(dtype=np.float64), SAMPLES) for name in names}


def _all_histories(flown: Flown) -> pd.DataFrame:
    """The run's histories and those of cases that were replayed since."""
    kept = set(flown.histories["case_id"]) if len(flown.histories) else set()
    quantities = flown.manifest.get("quantities", [])
    replays = [read_replay(flown.run.path, case, quantities) for case in _replayed(flown) if case not in kept]
    replayed = [flown.told_table(table) for table in replays]
    tables = [table for table in (flown.histories, *replayed) if len(table)]
    return pd.concat(tables, ignore_index=True) if tables else flown.histories


def _replayed(flown: Flown) -> list[int]:
    """Cases of the table that `mc-engine replay` left a history of in the run."""
    return [case for case in replayed_cases(flown.run.path) if flown.every.has(case)]


def _quantities(flown: Flown, histories: dict[int, dict[str, tuple[Any, Any]]]) -> list[str]:
    """History quantities that vary, in the order of the model's figures, those that none of them draws last."""
    every: dict[str, list[Any]] = {}
    for curves in histories.values():
        for name, (_, values) in curves.items():
            every.setdefault(name, []).append(values)
    drawn = [name for figure in flown.figures for name in getattr(figure, "quantities", ())]
    varying = {name for name, values in every.items() if not is_constant(np.concatenate(values))}
    return [name for name in dict.fromkeys([*drawn, *every]) if name in varying]
