"""Limits that belong on a history quantity: those of a metric that is its largest, its smallest or its last value.

An upper limit on the largest value holds along the whole flight; on the smallest value, as the miss of an approach, it
holds at the end or must be reached once.  A lower limit likewise.

A metric is that where the model declares it so, or where its name ends with the quantity's, as peak_load_g with load_g.
The units must be the same, and every saved case that completed must bear it out: that sample is the metric within 1 %
of its range, since the steps of the flight lie closer than the samples.
"""

from collections.abc import Iterator

import numpy as np

from mc_engine.statistics import Verdict
from mc_engine.store.run_files import NOMINAL_CASE
from reports.drawing.marks import Limit
from reports.figures.histories import required_limit
from reports.run.flown import Flown
from reports.text.numbers import limit_number, with_unit

FEWEST = 3  # saved cases that bear it out
APART = 0.01  # of the range of a history


def history_limits(flown: Flown, quantities: list[str]) -> dict[str, tuple[Limit, ...]]:
    """Limits by quantity of those requirements that bear on it."""
    limits: dict[str, tuple[Limit, ...]] = {}
    for verdict in flown.own.verdicts:
        for name in quantities:
            saved = _saved(flown.own, verdict.metric, name) if verdict.metric else []
            if lines := tuple(_limit_lines(flown, verdict, name, saved)):
                limits[name] = (*limits.get(name, ()), *lines)
    return limits


def _limit_lines(
    flown: Flown, verdict: Verdict, quantity: str, saved: list[tuple[float, np.ndarray]]
) -> Iterator[Limit]:
    for sign, own, side in (("≤", verdict.at_most, 1.0), ("≥", verdict.at_least, -1.0)):
        if saved and own is not None:
            at = flown.told(quantity, own)
            words = f"{flown.words(verdict.metric)} {sign} {with_unit(limit_number(at), flown.unit(quantity))}"
            if all(_is_near(value, side * (side * y).max(), y) for value, y in saved):
                yield required_limit(at, words)
            elif other := _other_end(saved, side):
                yield required_limit(at, words, other)


def _other_end(saved: list[tuple[float, np.ndarray]], side: float) -> str:
    """What a limit asks for of a metric at the other end of the quantity; nothing where flights begin at that end."""
    if all(_is_near(value, y[-1], y) for value, y in saved):
        return "limit at the end of the flight"
    reached = all(_is_near(value, side * (side * y).min(), y) for value, y in saved)
    return "limit to reach once" if reached and not any(_is_near(value, y[0], y) for value, y in saved) else ""


def _saved(flown: Flown, metric: str, quantity: str) -> list[tuple[float, np.ndarray]]:
    """The metric and the history of every saved case that has both, if the metric may be an extreme of the quantity."""
    declared = flown.manifest.get("metric_outputs", {}).get(metric, quantity if metric.endswith(quantity) else "")
    if declared != quantity or flown.unit(metric) != flown.unit(quantity):
        return []
    saved = list(_histories_of(flown, metric, quantity))
    return saved if len(saved) >= FEWEST else []


def _histories_of(flown: Flown, metric: str, quantity: str) -> Iterator[tuple[float, np.ndarray]]:
    values = dict(zip(flown.case_ids.tolist(), flown.values(metric).tolist(), strict=True))
    nominal = flown.nominal_value(metric)
    values |= {} if nominal is None else {NOMINAL_CASE: nominal}
    table = flown.histories[["case_id", "t_s", quantity]].sort_values(["case_id", "t_s"], kind="stable")
    cases, first = np.unique(table["case_id"].to_numpy(), return_index=True)
    histories = np.split(table[quantity].to_numpy(dtype=np.float64), first[1:])
    for case, y in zip(cases.tolist(), histories, strict=False):  # of no case there is one history without rows
        value = values.get(case, np.nan)
        if np.isfinite(value) and np.isfinite(y).sum() > 1:
            yield value, y[np.isfinite(y)]


def _is_near(value: float, sample: float, y: np.ndarray) -> bool:
    return bool(abs(value - sample) <= APART * np.ptp(y))
