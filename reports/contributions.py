"""Contributors: the share of each metric's variance that comes from each input, and from the random draws.

From the flights beside the run where it has them ([sensitivity]), else from the table of cases, which tells less: what
it cannot assign to an input is a row of its own.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mc_engine.statistics.pick_freeze import layout_of, pick_freeze
from mc_engine.statistics.sensitivity import FEWEST_CASES, Sensitivity, sensitivity
from mc_engine.store import SENSITIVITY, Store, is_run_directory, open_store
from reports.flown import Flown

NORMAL_90 = 1.6448536269514722  # standard errors on each side of a 90 % interval
UNEXPLAINED = "unexplained"
MOST_METRICS = 12
MOST_ROWS = 20_000  # of a table, above which cases are picked evenly

Interval = tuple[float, float]


@dataclass(frozen=True)
class Contributor:
    """What one input, group of inputs, or the random draws contribute to one metric, as shares of its variance.

    first : the share that goes when it alone becomes known.  total : the share that stays when all others are known.
    None where that is not known.  Intervals hold with 90 %.
    """

    metric: str
    input: str
    first: float | None
    total: float | None
    first_interval: Interval | None
    total_interval: Interval | None

    @property
    def size(self) -> float:
        """What contributors are ranked by: the total effect, or what is known of it."""
        return max(value for value in (self.total, self.first, 0.0) if value is not None)


@dataclass(frozen=True)
class Contributions:
    """By metric, the strongest contributor first; the unexplained share last.

    flights : of the companion, 0 where all comes from the table of cases.  n_used, n_tried : by metric, the blocks or
    cases that the indices rest on.  members : the inputs in each group of the flights; empty without them.
    """

    by_metric: dict[str, tuple[Contributor, ...]]
    flights: int
    n_used: dict[str, int]
    n_tried: int
    members: dict[str, list[str]]

    def rows(self) -> Iterator[Contributor]:
        """All contributors, metric by metric."""
        for found in self.by_metric.values():
            yield from found


def contributions(flown: Flown) -> Contributions | None:
    """Contributions to the metrics that matter; None where neither a companion nor a random table tells them."""
    store, metrics = companion_of(flown), flown.key_metrics[:MOST_METRICS]
    if store is not None:
        return _of_companion(store, metrics)
    return _of_table(flown, metrics) if flown.random and flown.n_tried >= FEWEST_CASES else None


def companion_of(flown: Flown) -> Store | None:
    """The flights beside the run, if all of them are there."""
    path = getattr(flown.run, "path", None)  # a Run of tests has none
    if path is None or not is_run_directory(path / SENSITIVITY):
        return None
    store = open_store(path / SENSITIVITY)
    return None if store.missing() else store


def _of_companion(store: Store, metrics: list[str]) -> Contributions:
    record = store.manifest["sensitivity"]
    layout = layout_of(record)
    cases = store.cases(["case_id", *metrics])
    values = {name: cases[name].to_numpy(dtype=np.float64) for name in metrics}
    found = pick_freeze(layout, cases["case_id"].to_numpy(), values)
    by_metric = {}
    for k, metric in enumerate(metrics):
        rows = [
            Contributor(
                metric,
                group,
                _number(found.first[g, k]),
                _number(found.total[g, k]),
                _interval(found.first[g, k], found.first_error[g, k]),
                _interval(found.total[g, k], found.total_error[g, k]),
            )
            for g, group in enumerate(layout.groups)
            if np.isfinite(found.total[g, k])
        ]
        by_metric[metric] = tuple(sorted(rows, key=lambda one: -one.size))
    used = {metric: int(n) for metric, n in zip(metrics, found.n_used, strict=True)}
    members = {group["name"]: list(group["members"]) for group in record["groups"]}
    return Contributions(by_metric, len(cases), used, found.n_tried, members)


def _of_table(flown: Flown, metrics: list[str]) -> Contributions | None:
    inputs = {fact.name: flown.cases[fact.name].to_numpy() for fact in flown.with_role("dispersion")}
    if not inputs:
        return None
    rows = np.arange(flown.n_tried)[:: -(-flown.n_tried // MOST_ROWS)]
    found = sensitivity(
        {name: values[rows] for name, values in inputs.items()}, {name: flown.values(name)[rows] for name in metrics}
    )
    by_metric = {metric: tuple(_table_rows(found, k)) for k, metric in enumerate(metrics)}
    used = {metric: int(n) for metric, n in zip(metrics, found.n_used, strict=True)}
    return Contributions(by_metric, 0, used, found.n_tried, {})


def _table_rows(found: Sensitivity, k: int) -> Iterator[Contributor]:
    metric = found.metrics[k]
    rows = [
        Contributor(
            metric,
            name,
            _number(found.first_order[g, k]),
            _number(found.total[g, k]),
            _interval(found.first_order[g, k], found.first_order_error[g, k]),
            _interval(found.total[g, k], found.total_error[g, k]),
        )
        for g, name in enumerate(found.inputs)
        if np.isfinite(found.first_order[g, k])
    ]
    yield from sorted(rows, key=lambda one: -one.size)
    if rows and np.isfinite(found.unexplained[k]):
        left = float(found.unexplained[k])
        yield Contributor(metric, UNEXPLAINED, left, left, None, None)


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _interval(value: float, error: float) -> Interval | None:
    if not (np.isfinite(value) and np.isfinite(error)):
        return None
    return float(value - NORMAL_90 * error), float(value + NORMAL_90 * error)
