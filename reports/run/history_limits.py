"""Limits that belong on a history quantity: those of a metric that is the largest or smallest value of the quantity.

A metric is that where its name ends with the quantity's, as peak_load_g with load_g, the units are the same, and in
every saved case that completed the history bears it out: its extreme sample is the metric within 1 % of its range,
since the steps of the flight lie closer than the samples.
"""

from collections.abc import Iterator

import numpy as np

from mc_engine.statistics import Verdict
from reports.run.flown import Flown
from reports.text.numbers import number, with_unit

NOMINAL = -1
FEWEST = 3  # saved cases that bear it out
APART = 0.01  # of the range of a history


def history_limits(flown: Flown, quantities: list[str]) -> dict[str, tuple[tuple[float, str], ...]]:
    """Limits by quantity, with their words, of those requirements that bear on its extremes."""
    limits: dict[str, tuple[tuple[float, str], ...]] = {}
    for verdict in flown.own.verdicts:
        for name in quantities:
            if verdict.metric and _is_extreme(flown.own, verdict.metric, name):
                limits[name] = (*limits.get(name, ()), *_limit_lines(flown, verdict, name))
    return limits


def _limit_lines(flown: Flown, verdict: Verdict, quantity: str) -> Iterator[tuple[float, str]]:
    for sign, own in (("≤", verdict.at_most), ("≥", verdict.at_least)):
        if own is not None:
            at = flown.told(quantity, own)
            limit = with_unit(number(at), flown.unit(quantity))
            yield at, f"required limit: {flown.words(verdict.metric)} {sign} {limit}"


def _is_extreme(flown: Flown, metric: str, quantity: str) -> bool:
    if not metric.endswith(quantity) or flown.unit(metric) != flown.unit(quantity):
        return False
    saved = list(_saved(flown, metric, quantity))
    borne_out = (all(_bears_out(sign * y, sign * value) for value, y in saved) for sign in (1.0, -1.0))
    return len(saved) >= FEWEST and any(borne_out)


def _saved(flown: Flown, metric: str, quantity: str) -> Iterator[tuple[float, np.ndarray]]:
    """The metric and the history of every saved case that has both."""
    values = dict(zip(flown.case_ids.tolist(), flown.values(metric).tolist(), strict=True))
    nominal = flown.nominal_value(metric)
    values |= {} if nominal is None else {NOMINAL: nominal}
    table = flown.histories[["case_id", "t_s", quantity]].sort_values(["case_id", "t_s"], kind="stable")
    for case, rows in table.groupby("case_id"):
        value, y = values.get(int(case), np.nan), rows[quantity].to_numpy(dtype=np.float64)
        if np.isfinite(value) and np.isfinite(y).sum() > 1:
            yield value, y[np.isfinite(y)]


def _bears_out(y: np.ndarray, value: float) -> bool:
    """Whether `value` is the largest of what y samples."""
    return bool(abs(value - y.max()) <= APART * np.ptp(y))
