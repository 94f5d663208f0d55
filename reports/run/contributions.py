"""Contributors: the share of each metric's variance that comes from each input, and from the random draws.

From the flights beside the run where it has them ([sensitivity]), from the blocks of a run of the design saltelli, or
from the table of cases, which tells less: what it cannot assign to an input is a row of its own.  An input that only
names a random draw has no row there: its values have no order that a trend or a surrogate model could follow, so that
its effect is part of the unexplained share.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy  # loads its packages when they are used

from mc_engine.statistics.designed_indices import designed_indices
from mc_engine.statistics.moments import number_or_none
from mc_engine.statistics.pick_freeze import layout_of, pick_freeze
from mc_engine.statistics.picked_cases import picked_rows
from mc_engine.statistics.sensitivity import FEWEST_CASES, Sensitivity, sensitivity
from mc_engine.store.opening import open_store
from mc_engine.store.run_files import SENSITIVITY, is_run_directory
from mc_engine.store.store import Store

if TYPE_CHECKING:
    from reports.run.flown import Flown

UNEXPLAINED = "unexplained"
MOST_METRICS = 8
MOST_ROWS = 20_000  # of a table, above which cases are picked evenly
MOST_VALUES = 500_000  # of all metrics in Saltelli's blocks, above which the indices of all take minutes

Interval = tuple[float, float]


@dataclass(frozen=True)
class Contributor:
    """What one input, group of inputs, or the random draws contribute to one metric, as shares of its variance.

    first : the share that goes when it alone becomes known.  total : the share that stays when all others are known.
    fall : the share by which the variance falls if it is held at its nominal value.
    None where that is not known.  Intervals hold with the report's confidence; from the table of cases those of total
    effects reach up by the unexplained share.  first and total lie in [0, 1], as the
    shares do that they estimate.
    """

    metric: str
    input: str
    first: float | None
    total: float | None
    first_interval: Interval | None
    total_interval: Interval | None
    fall: float | None = None
    fall_interval: Interval | None = None

    @property
    def bounded_first(self) -> float | None:
        """The first-order effect, but no larger than the total effect may be: what is beyond is an error of it."""
        if self.first is None or self.total_interval is None:
            return self.first
        return min(self.first, self.total_interval[1])

    @property
    def size(self) -> float:
        """What contributors are ranked by: the total effect, or what is known of it."""
        return max(value for value in (self.total, self.bounded_first, 0.0) if value is not None)

    @property
    def surely_acts(self) -> bool:
        """Whether the total effect is surely above zero, as a first-order effect can be none without it.

        Without a total effect (inputs are correlated, or cases too few), whether the first-order effect is.
        """
        return surely(self.first_interval if self.total is None else self.total_interval)


def surely(interval: Interval | None) -> bool:
    """Whether the interval of an effect excludes zero."""
    return interval is not None and interval[0] > 0.0


@dataclass(frozen=True)
class Contributions:
    """By metric, the strongest contributor first; the unexplained share last.  With flights it is every metric, those
    that matter first, of which alone pages show tables and figures.

    flights : of the companion, 0 where all comes from the table of cases.  n_used, n_tried : by metric, the blocks or
    cases that the indices rest on.  members : the inputs in each group of the flights, in any order; empty without
    them.
    trends : what the table of cases tells besides; None with flights.
    """

    by_metric: dict[str, tuple[Contributor, ...]]
    flights: int
    n_used: dict[str, int]
    n_tried: int
    members: dict[str, list[str]]
    trends: Sensitivity | None = None

    @property
    def held(self) -> bool:
        """Whether flights with a contributor at its nominal value are among them."""
        return any(row.fall is not None for row in self.rows())

    def acting(self, metric: str) -> list[str]:
        """The inputs that surely contribute to a metric, alone or in their group, the strongest first."""
        return self._acting(self.by_metric.get(metric, ()))

    def strongest(self, metric: str) -> list[str]:
        """The inputs of the strongest contributor to a metric; none where it is the random draws of the flights."""
        return self._acting(self.by_metric.get(metric, ())[:1])

    def _acting(self, rows: tuple[Contributor, ...]) -> list[str]:
        sure = [row.input for row in rows if row.surely_acts]
        return [name for contributor in sure for name in self.members.get(contributor, [contributor])]

    def rows(self) -> Iterator[Contributor]:
        """All contributors, metric by metric."""
        for indices in self.by_metric.values():
            yield from indices


def contributions(flown: "Flown") -> Contributions | None:
    """Contributions to every metric by a companion or by Saltelli's blocks, or to those that matter by a random table
    or by very many blocks; None without any."""
    store, metrics = companion_of(flown), flown.key_metrics[:MOST_METRICS]
    every = list(dict.fromkeys([*metrics, *(fact.name for fact in flown.with_role("metric"))]))
    if store is not None:
        return _of_companion(flown, store, every)
    if flown.design == "saltelli":
        return _of_blocks(flown, every if flown.n_held * len(every) <= MOST_VALUES else metrics)
    return _of_table(flown, metrics) if flown.random and flown.n_held >= FEWEST_CASES else None


def companion_of(flown: "Flown") -> Store | None:
    """The flights beside the run, if all of them are there."""
    path = flown.run.path / SENSITIVITY
    if not is_run_directory(path):
        return None
    store = open_store(path)
    return None if store.missing() else store


def _of_companion(flown: "Flown", store: Store, metrics: list[str]) -> Contributions:
    record = store.manifest["sensitivity"]
    layout = layout_of(record)
    cases = store.cases(["case_id", *metrics])
    values = {name: cases[name].to_numpy(dtype=np.float64) for name in metrics}
    indices = pick_freeze(layout, cases["case_id"].to_numpy(), values)
    shares = ((indices.first, indices.first_error), (indices.total, indices.total_error),
              (indices.fall, indices.fall_error))  # fmt: skip
    by_metric = {name: _ranked(flown, name, layout.groups, shares, k) for k, name in enumerate(metrics)}
    used = dict(zip(metrics, indices.n_used.tolist(), strict=True))
    # The group of the cases of a run upstream has what is taken from there; random draws, in repeated flights, nothing.
    taken = [*(flown.manifest.get("upstream") or {}).get("links", {})]
    members = {
        group["name"]: list(group["members"]) or (taken if group["name"] not in layout.repeated else [])
        for group in record["groups"]
    }
    return Contributions(by_metric, len(cases), used, indices.n_tried, members)


def _of_blocks(flown: "Flown", metrics: list[str]) -> Contributions:
    """The indices of Saltelli's blocks, which are the cases of the run."""
    values = {name: flown.values(name) for name in metrics}
    indices = designed_indices(flown.design, flown.case_ids, flown.inputs, values, flown.stated.confidence)
    errors = _errors(flown)
    shares = [(indices.values[name], indices.reach[name] / errors) for name in ("first_order", "total")]
    by_metric = {name: _ranked(flown, name, indices.inputs, shares, k) for k, name in enumerate(metrics)}
    used = dict(zip(metrics, indices.n_used.tolist(), strict=True))
    return Contributions(by_metric, 0, used, indices.n_tried, {})


def _of_table(flown: "Flown", metrics: list[str]) -> Contributions | None:
    inputs = {name: values for name, values in flown.inputs.items() if name not in flown.draws}
    if not inputs:
        return None
    rows = picked_rows(flown.n_held, MOST_ROWS)
    indices = sensitivity(
        {name: values[rows] for name, values in inputs.items()},
        {name: flown.values(name)[rows] for name in metrics},
        sobol=flown.design == "sobol",
    )
    shares = ((indices.first_order, indices.first_order_error), (indices.total, indices.total_error))
    by_metric = {}
    for k, metric in enumerate(metrics):
        left = number_or_none(indices.unexplained[k])
        ranked = _ranked(flown, metric, indices.inputs, shares, k, unassigned=left or 0.0)
        rest = [] if left is None or not ranked else [Contributor(metric, UNEXPLAINED, left, left, None, None)]
        by_metric[metric] = (*ranked, *rest)
    used = dict(zip(metrics, indices.n_used.tolist(), strict=True))
    return Contributions(by_metric, 0, used, indices.n_tried, {}, indices)


def _ranked(
    flown: "Flown",
    metric: str,
    names: Sequence[str],
    shares: Sequence[tuple[np.ndarray, np.ndarray]],
    k: int,
    unassigned: float = 0.0,
) -> tuple[Contributor, ...]:
    """The contributors of one metric that have an effect, the strongest first.

    shares : values and standard errors float64[n_names, n_metrics] of the first-order and total effects, and of the
        fall.  k : index of the metric.
    unassigned : share of the variance that no input explains; any total effect may be larger by it.
    """
    errors = _errors(flown)
    rows = []
    for row, name in enumerate(names):
        known = [(float(value[row, k]), errors * float(error[row, k])) for value, error in shares]
        if any(np.isfinite(value) for value, _ in known):
            (first, first_ends), (total, total_ends) = (_inside(*effect, 0.0, 1.0) for effect in known[:2])
            total_ends = total_ends and (total_ends[0], min(total_ends[1] + unassigned, 1.0))
            fall, fall_ends = _inside(*known[2], -np.inf, 1.0) if known[2:] else (None, None)
            rows.append(Contributor(metric, name, first, total, first_ends, total_ends, fall, fall_ends))
    return tuple(sorted(rows, key=lambda contributor: -contributor.size))


def _errors(flown: "Flown") -> float:
    """Standard errors on each side of an interval."""
    return float(scipy.special.ndtri(0.5 * (1.0 + flown.stated.confidence)))


def _inside(value: float, reach: float, low: float, high: float) -> tuple[float | None, Interval | None]:
    """The possible value nearest to an estimate, and what of `reach` on both sides of it is possible.

    Chance puts estimates beyond the range of what they estimate.  The interval holds the true value wherever that about
    the estimate itself does.
    """
    nearest = number_or_none(float(np.clip(value, low, high)))
    if nearest is None or not np.isfinite(reach):
        return nearest, None
    return nearest, (max(nearest - reach, low), min(nearest + reach, high))
