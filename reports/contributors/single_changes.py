"""Effect of each input alone, in a run of design one_at_a_time: changes from the case with all inputs nominal."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mc_engine.statistics.first_order import cases_by_input
from reports.contributors.designed_indices import MOST_INPUTS, MOST_METRICS, further_metrics
from reports.document.blocks import Cell, Column, FigureBlock, Table
from reports.drawing.marks import Drawing, Plot
from reports.figures.rows import single_change_panel
from reports.run.flown import ROUNDING, Flown
from reports.text.numbers import axis_label, count, exact, number, with_unit

_NOTE = (
    "Each change is that of one case, in which this input alone is not nominal, from the case in which all are; it is "
    "0 where no level moves the metric that way. Changes may be added up only where inputs do not act together; where "
    "the model draws noise, they include its scatter."
)


@dataclass(frozen=True)
class SingleChanges:
    """One input: its levels in words, and by how much each moves a metric, float64[n_levels], NaN without a number."""

    name: str
    levels: tuple[str, ...]
    change: np.ndarray

    @property
    def known(self) -> np.ndarray:
        """bool[n_levels]: where the metric has a number."""
        return np.isfinite(self.change)

    @property
    def moves(self) -> bool:
        """Whether a level is known to move the metric."""
        return bool(self.change[self.known].any())

    @property
    def size(self) -> float:
        return max(abs(self.change[self.known]).tolist(), default=0.0)

    def furthest(self, sign: float) -> tuple[float, str]:
        """The largest change upwards (sign 1) or downwards (-1), and its level; 0 where none moves the metric so."""
        place = int(np.argmax(np.where(self.known, sign * self.change, -np.inf)))
        change = float(self.change[place])
        return (change, self.levels[place]) if sign * change > 0.0 else (0.0, "")


def single_change_blocks(flown: Flown) -> Iterator[FigureBlock | Table | str]:
    """A figure and a table of the metrics that matter; a sentence for those of which nothing is known."""
    cases = _cases_by_input(flown)
    found = {metric: _changes(flown, metric, cases) for metric in flown.key_metrics[:MOST_METRICS]}
    told = {metric: rows for metric, rows in found.items() if any(row.moves for row in rows)}
    if told:
        panels = tuple(_panel(flown, metric, changes) for metric, changes in told.items())
        caption = "Change of each metric by one input alone, from the case with all inputs nominal."
        yield FigureBlock(caption, Drawing("Changes by one input alone", panels), "half")
        yield _table(flown, told)
    same = [metric for metric, rows in found.items() if metric not in told and any(row.known.any() for row in rows)]
    if same:
        yield (
            f"No input alone changes {flown.listed(same)} by more than rounding, {number(ROUNDING)} of the largest "
            "metric in the same unit, in the cases that have it."
        )
    unknown = [metric for metric in found if metric not in (*told, *same)]
    if unknown:
        yield (
            f"Changes of {flown.listed(unknown)} are not known: there is no number where all inputs are nominal, or "
            "none where one is not."
        )
    yield from further_metrics(flown)


@dataclass(frozen=True)
class _Cases:
    """Rows of the table in which one input alone is not nominal, and its levels there in words."""

    rows: np.ndarray
    levels: tuple[str, ...]


def _cases_by_input(flown: Flown) -> dict[str, _Cases]:
    """The cases by the one input that is not nominal; those with all inputs nominal under ""."""
    found = {}
    for name, rows in cases_by_input(flown.inputs, flown.nominal).items():
        levels = flown.inputs[name][rows].tolist() if name else []
        found[name] = _Cases(rows, tuple(_in_words(level, flown.unit(name)) for level in levels))
    return found


def _changes(flown: Flown, metric: str, cases: dict[str, _Cases]) -> list[SingleChanges]:
    """What each input does to a metric, the largest change first; NaN without a number to change from."""
    values = flown.values(metric)
    nominal = values[cases[""].rows[:1]] if "" in cases else np.full(1, np.nan)
    nothing = ROUNDING * flown.largest_alike(metric)
    rows = []
    for name, found in cases.items():
        if name:
            change = values[found.rows] - nominal
            rows.append(SingleChanges(name, found.levels, np.where(np.abs(change) < nothing, 0.0, change)))
    return sorted(rows, key=lambda row: -row.size)


def _in_words(level: float | bool | str, unit: str) -> str:
    return exact(level) if isinstance(level, bool | str) else with_unit(number(level), unit)


def _panel(flown: Flown, metric: str, changes: list[SingleChanges]) -> Plot:
    shown = changes[:MOST_INPUTS]
    label = axis_label(f"change of {flown.words(metric)}", flown.unit(metric))
    return single_change_panel(
        label, [flown.words(row.name) for row in shown], [(row.levels, row.change) for row in shown]
    )


def _end_cell(change: float, level: str) -> Cell:
    return Cell(number(change, 4), change, f"at {level}" * bool(level))


def _table(flown: Flown, told: dict[str, list[SingleChanges]]) -> Table:
    columns = (
        Column("Metric", "text", grouped=True),
        Column("Input", "text"),
        Column("Largest fall", "number"),
        Column("Largest rise", "number"),
        Column("Used / tried", "number"),
    )
    rows, left_out = [], 0
    for metric, changes in told.items():
        title = Cell(flown.label(metric))
        left_out += len(changes[MOST_INPUTS:])
        for row in changes[:MOST_INPUTS]:
            used = f"{count(int(row.known.sum()))}/{count(row.known.size)}"
            ends = [_end_cell(*row.furthest(sign)) if row.known.any() else Cell("–") for sign in (-1.0, 1.0)]
            rows.append((title, Cell(flown.words(row.name)), *ends, Cell(used)))
    note = _NOTE + f" {count(left_out)} smaller ones are not shown." * bool(left_out)
    return Table("Changes of the metrics by one input alone", columns, tuple(rows), note)
