"""Answers about all cases of a run, in the columns' own units: counts, statistics, verdicts, worst and failed cases.

`HeldCases` has the whole table at hand, `StreamedCases` a sample of it.  Of a run that is too large to be held the
parts are read one after the other, two to four times (`mc_engine.statistics.streaming`): all answers are those of all
cases, to the same bits as from the whole table.  The sample, which figures are drawn of, is one case drawn at random
from each of equal stretches of the table, by the seed of the campaign: even over the case numbers, and without a
pattern that could meet that of a design.  Of a design in blocks it is whole blocks, as single cases of a block say
nothing of the inputs.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc

from mc_engine.runner.summary import metric_parts, streamed
from mc_engine.statistics import Summary, Verdict, judge_all, summarize, was_looked_at, worst_cases
from mc_engine.statistics.designed_indices import IN_BLOCKS, picked_block_rows
from mc_engine.statistics.limits import LimitCounts
from mc_engine.statistics.picked_cases import picked_rows
from mc_engine.statistics.worst import Limits, WorstSoFar, limits_on
from mc_engine.status import OK, STATUS_NAME
from mc_engine.store.manifest_file import design_in
from mc_engine.store.store import Part, Store

MOST_CELLS = 1 << 24  # of a table that is held
MOST_SAMPLED = 200_000
MOST_SINGLE = 10  # worst cases of a metric


def all_cases(run: Store, confidence: float, probabilities: tuple[float, ...]) -> "HeldCases":
    """The cases of a run, held or streamed.  probabilities, confidence : of the summaries' quantiles."""
    if sum(part.rows for part in run.parts) * len(run.columns) > MOST_CELLS:
        return StreamedCases(run, confidence, probabilities)
    return HeldCases(run, run.cases(), confidence, probabilities)


def without_attributes(table: pd.DataFrame) -> pd.DataFrame:
    """The table without its `attrs`, which pandas would copy with every column that is looked at."""
    table.attrs = {}
    return table


class HeldCases:
    """table : a row for each of the cases at hand: here, all of them."""

    def __init__(self, run: Store, table: pd.DataFrame, confidence: float, probabilities: tuple[float, ...]):
        self.manifest, self.table = run.manifest, without_attributes(table)
        self.n_wanted = int(run.n_cases)
        self.confidence, self.probabilities = confidence, probabilities
        self.requirements: list[dict[str, Any]] = run.manifest.get("requirements", [])
        self._roles = {str(column["name"]): str(column.get("role", "")) for column in run.manifest.get("columns", [])}

    # ---- the table at hand

    @cached_property
    def ok(self) -> np.ndarray:
        """bool[n_held]: completed."""
        return np.asarray(self.table["status"] == STATUS_NAME[OK], dtype=bool)

    def values(self, name: str) -> np.ndarray:
        """float64[n_held] of a column; NaN for words, for a missing column, and for metrics of failed cases."""
        # Words may look like numbers, such as the choices "1" and "off" of a setting.
        if name not in self.table.columns or not pd.api.types.is_numeric_dtype(self.table[name]):
            return np.full(len(self.table), np.nan)
        values = self.table[name].to_numpy(dtype=np.float64)
        return values if self._roles.get(name) == "dispersion" else np.where(self.ok, values, np.nan)

    # ---- all cases

    @property
    def n_tried(self) -> int:
        """How many cases were flown."""
        return len(self.table)

    @property
    def completed(self) -> int:
        """How many cases were completed."""
        return self.statuses.get(STATUS_NAME[OK], 0)

    @cached_property
    def statuses(self) -> dict[str, int]:
        """Cases by status word."""
        return _counted(self.table["status"])

    @cached_property
    def reasons(self) -> dict[str, int]:
        """Refused and failed cases by the reason given, the most frequent first."""
        return _counted(self.table["reason"]) if "reason" in self.table.columns else {}

    @cached_property
    def limit_counts(self) -> LimitCounts:
        """How many cases are outside which limits."""
        counts = LimitCounts(self.requirements)
        counts.add(self.values, self.ok)
        return counts

    @property
    def inside_all(self) -> int:
        """How many cases were completed and are inside all limits."""
        return self.n_tried - self.limit_counts.outside() if self.requirements else self.completed

    @cached_property
    def judgement(self) -> tuple[list[Verdict], Verdict | None]:
        """A verdict per requirement, and the one on all at once."""
        looked = was_looked_at(self.manifest, self.n_wanted, self.n_tried)
        chained = bool(self.manifest.get("upstream"))
        return judge_all(self.requirements, self.values, self.ok, design_in(self.manifest), looked, chained)

    @cached_property
    def summaries(self) -> dict[str, Summary]:
        """Summary per metric."""
        names = [name for name, role in self._roles.items() if role == "metric" and name in self.table.columns]
        return {name: self._summary(name, self.probabilities) for name in names}

    def summary(self, metric: str, probability: float) -> Summary:
        """The summary of a metric with another quantile."""
        return self._summary(metric, (probability,))

    def _summary(self, metric: str, probabilities: tuple[float, ...]) -> Summary:
        return summarize(self.values(metric), probabilities=probabilities, confidence=self.confidence)

    def ends(self, name: str) -> tuple[float, float] | None:
        """The smallest and largest number of an input; None without one."""
        values = self.values(name)
        values = values[np.isfinite(values)]
        return (float(values.min()), float(values.max())) if values.size else None

    def worst(self, metric: str, most: int, limits: Limits) -> pd.DataFrame:
        """The worst cases of a metric: those with the smallest margin to its limits, or to those of one requirement."""
        return self.table.iloc[worst_cases(self.values(metric), self.ok, most, limits=limits)]

    def failed(self, most: int) -> pd.DataFrame:
        """The first cases that were not completed."""
        return self.table.iloc[np.flatnonzero(~self.ok)[:most]]

    def failed_ids(self) -> np.ndarray:
        """Numbers of the cases that were not completed, int64, ascending."""
        return self.table["case_id"].to_numpy(dtype=np.int64)[~self.ok]

    def first_values(self, metric: str, most: int) -> np.ndarray:
        """float64[<= most] of the first cases."""
        return self.values(metric)[:most]

    def has(self, case: int) -> bool:
        """Whether there is such a case."""
        return bool((self.table["case_id"] == case).any())


def _counted(words: pd.Series) -> dict[str, int]:
    counts = words.dropna().astype(str).value_counts()
    return {str(word): int(cases) for word, cases in counts.items() if word}


class StreamedCases(HeldCases):
    """The same from the parts of a run; `table` is the sample."""

    def __init__(self, run: Store, confidence: float, probabilities: tuple[float, ...]):
        metrics = [column.name for column in run.columns if column.role == "metric"]
        requirements = run.manifest.get("requirements", [])
        self._run, self._first = run, _FirstPass(run, metrics, requirements)
        self._found = streamed(run, metrics, requirements, self._first.passes, probabilities, confidence)
        self._rows: dict[int, dict[str, Any]] = {}
        super().__init__(run, self._first.sample(), confidence, probabilities)

    @property
    def n_tried(self) -> int:
        return self._first.n_tried

    @property
    def statuses(self) -> dict[str, int]:
        return self._run.status_counts()

    @property
    def reasons(self) -> dict[str, int]:
        return dict(self._first.reasons.most_common())

    @property
    def limit_counts(self) -> LimitCounts:
        return self._found.counts

    @property
    def judgement(self) -> tuple[list[Verdict], Verdict | None]:
        return self._found.verdicts, self._found.joint

    @property
    def summaries(self) -> dict[str, Summary]:
        return self._found.summaries

    def _summary(self, metric: str, probabilities: tuple[float, ...]) -> Summary:
        summed = streamed(self._run, [metric], probabilities=probabilities, confidence=self.confidence)
        return summed.summaries[metric]

    def ends(self, name: str) -> tuple[float, float] | None:
        return self._first.ends.get(name)

    def worst(self, metric: str, most: int, limits: Limits) -> pd.DataFrame:
        return self._cases(self._first.worst[metric, limits].case_ids[:most].tolist())

    def failed(self, most: int) -> pd.DataFrame:
        return self._cases(self.failed_ids()[:most].tolist())

    def failed_ids(self) -> np.ndarray:
        return np.concatenate(self._first.failed)

    def _cases(self, case_ids: list[int]) -> pd.DataFrame:
        for case in case_ids:
            if case not in self._rows:
                self._rows[case] = self._run.row(case)
        return pd.DataFrame([self._rows[case] for case in case_ids], columns=self.table.columns)

    def first_values(self, metric: str, most: int) -> np.ndarray:
        summed: list[np.ndarray] = []
        for _, values in metric_parts(self._run, [metric]):
            summed.append(values[metric])
            if sum(part.size for part in summed) >= most:
                break
        return np.concatenate(summed)[:most]

    def has(self, case: int) -> bool:
        return any(first <= case < stop for first, stop in self._run.committed())


class _FirstPass:
    """What the first pass finds beside what is streamed: the sample, worst and failed cases, ends of the inputs."""

    def __init__(self, run: Store, metrics: Sequence[str], requirements: Sequence[Mapping[str, Any]]):
        self.run, self.over = run, False
        self.n_tried = sum(part.rows for part in run.parts)
        self.reasons: Counter[str] = Counter()
        self.failed = [np.empty(0, np.int64)]
        self.ends: dict[str, tuple[float, float]] = {}
        asked = {(name, limits_on(name, requirements)) for name in metrics}
        asked |= {
            (str(requirement["metric"]), limits_on(str(requirement["metric"]), [requirement]))
            for requirement in requirements
        }
        self.worst = {pair: WorstSoFar(MOST_SINGLE, pair[1]) for pair in asked}
        self._inputs = [column.name for column in run.columns if column.role == "dispersion" and column.kind != "word"]
        self._rows = self._sampled_rows()
        self._sampled: list[pa.Table] = []

    def _sampled_rows(self) -> np.ndarray:
        """Row numbers of the sample, int64, ascending."""
        most = max(min(MOST_SAMPLED, MOST_CELLS // len(self.run.columns), self.n_tried), 1)
        campaign = self.run.manifest["campaign"]
        design, seed = str(campaign.get("design")), int(campaign.get("seed") or 0)
        if design not in IN_BLOCKS:
            return picked_rows(self.n_tried, most, seed)
        case_ids = np.concatenate([np.arange(part.first, part.stop) for part in self.run.parts])
        inputs = sum(column.role == "dispersion" for column in self.run.columns)
        return picked_block_rows(design, case_ids, inputs, most, seed)

    def passes(self, metrics: Sequence[str]) -> Iterator[dict[str, np.ndarray]]:
        """The parts for `stream`; what the first pass finds is noted on its way."""
        if self.over:
            yield from (values for _, values in metric_parts(self.run, metrics))
            return
        parts, row = self.run.parts, 0
        others = [column.name for column in self.run.columns if column.name != "status"]
        for part, (table, values) in zip(parts, metric_parts(self.run, metrics, others), strict=True):
            self._note(part, table, values, row)
            row += part.rows
            yield values
        self.over = True

    def _note(self, part: Part, table: pa.Table, values: Mapping[str, np.ndarray], row: int) -> None:
        for (name, _), worst in self.worst.items():
            worst.add(values[name], part.first)
        for name in self._inputs:
            numbers = table[name].to_numpy().astype(np.float64, copy=False)
            numbers = numbers[np.isfinite(numbers)]
            if numbers.size:
                low, high = self.ends.get(name, (np.inf, -np.inf))
                self.ends[name] = (min(low, float(numbers.min())), max(high, float(numbers.max())))
        if "status" in table.column_names:  # else all were completed
            failed = table.filter(pc.not_equal(table["status"], STATUS_NAME[OK]))
            self.failed.append(failed["case_id"].to_numpy())
            for summed in pc.value_counts(failed["reason"]).to_pylist():
                if summed["values"]:
                    self.reasons[summed["values"]] += summed["counts"]
        first, stop = np.searchsorted(self._rows, [row, row + part.rows])
        sample = table.take(self._rows[first:stop] - row)
        if "status" not in table.column_names:
            sample = sample.append_column("status", pa.array([STATUS_NAME[OK]] * sample.num_rows, pa.string()))
        self._sampled.append(sample)

    def sample(self) -> pd.DataFrame:
        """The cases that figures are drawn of."""
        names = [column.name for column in self.run.columns]
        return pa.concat_tables([part.select(names) for part in self._sampled]).to_pandas()
