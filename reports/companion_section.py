"""Contributors from the flights beside the run: total and first-order effects of inputs, groups and random draws."""

from collections.abc import Iterator

import numpy as np

from reports.contributions import Contributions
from reports.document import Cell, Column, FigureBlock, Table
from reports.figures import IndexMap
from reports.flown import Flown
from reports.numbers import count

MOST_INPUTS = 14  # in the figure
STRONGEST = 5  # of a metric in the table
SMALL = 0.01  # a total effect below it is not worth a row


def companion_blocks(flown: Flown, found: Contributions) -> Iterator[FigureBlock | Table | str]:
    """A figure of all total effects and a table of the strongest contributors of each metric."""
    shown = [metric for metric, rows in found.by_metric.items() if rows]
    silent = [flown.words(metric) for metric in found.by_metric if metric not in shown]
    if shown:
        yield _figure(flown, found, shown)
        yield _table(flown, found, shown)
    if silent:
        yield f"No contributors for {', '.join(silent)}: the same in all cases, or a number in too few of them."


def _name(flown: Flown, one: str) -> str:
    return flown.words(one) if one in flown.columns else one


def _figure(flown: Flown, found: Contributions, shown: list[str]) -> FigureBlock:
    total = {metric: {one.input: one.total for one in found.by_metric[metric]} for metric in shown}
    largest: dict[str, float] = {}
    for one in found.rows():
        largest[one.input] = max(largest.get(one.input, 0.0), one.total or 0.0)
    names = sorted(largest, key=lambda name: -largest[name])[:MOST_INPUTS]
    share = np.array([[total[metric].get(name) for metric in shown] for name in names], dtype=np.float64)
    used = [found.n_used[metric] for metric in shown]
    drawing = IndexMap(
        inputs=tuple(_name(flown, name) for name in names),
        metrics=tuple(flown.words(metric) for metric in shown),
        share=share,
        n_used=(min(used), max(used)),
        n_tried=found.n_tried,
        index="total effect",
        none="no effect, alone or with other inputs",
        all="no variance without it",
        counted="blocks",
    )
    left_out = len(largest) - len(names)
    more = f" {count(left_out)} weaker ones are not shown." if left_out else ""
    return FigureBlock(f"Total effect of each input, and of the random draws, on each metric.{more}", drawing, "wide")


def _table(flown: Flown, found: Contributions, shown: list[str]) -> Table:
    columns = (
        Column("Metric", "text", 2.4),
        Column("Contributor", "text", 2.6),
        Column("First-order effect", "number", 1.6),
        Column("Total effect", "number", 1.6),
    )
    rows = []
    for metric in shown:
        used = f"{count(found.n_used[metric])} / {count(found.n_tried)} blocks"
        strongest = [one for one in found.by_metric[metric] if one.size >= SMALL][:STRONGEST]
        for one in strongest or found.by_metric[metric][:1]:
            cells = _cell(one.first, one.first_interval), _cell(one.total, one.total_interval)
            rows.append((Cell(flown.words(metric), small=used), Cell(_name(flown, one.input)), *cells))
    note = (
        f"From {count(found.flights)} cases flown for this purpose beside the run; they are in none of its statistics. "
        "First-order effect: the fraction of the metric’s variance that is removed when the contributor is known. "
        "Total effect: the fraction that remains when everything else is known. Random draws: noise made in flight, "
        "and inputs that only name a draw. In brackets: 90 % confidence interval. Pick-freeze estimates (Janon 2014, "
        "Jansen 1999)."
    )
    return Table(f"Contributors to each metric, at most {STRONGEST}", columns, tuple(rows), note)


def _cell(value: float | None, interval: tuple[float, float] | None) -> Cell:
    if value is None:
        return Cell("–")
    text = f"{value:.2f}".replace("-0.00", "0.00").replace("-", "−")
    small = "" if interval is None else f"[{interval[0]:.2f}, {interval[1]:.2f}]".replace("-", "−")
    return Cell(text, value, small)
