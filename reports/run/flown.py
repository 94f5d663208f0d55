"""The run as the report sees it: the table, the nominal, what every column is, and which metrics matter."""

import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from pydantic import BaseModel, FiniteFloat, ValidationError

from mc_engine.model.figures import KINDS, MapFigure, ScatterFigure, from_record
from mc_engine.section import ReportSection
from mc_engine.statistics import CHOSEN_DESIGNS, SAMPLING_DESIGNS, Summary, Verdict, summarize, was_looked_at
from mc_engine.statistics.first_order import Contributor, contributors, ranked_by_change
from mc_engine.statistics.worst import Limits, limits_on
from mc_engine.status import STATUS_MEANING
from mc_engine.store.store import Store
from reports.run.all_cases import all_cases, without_attributes
from reports.run.contributions import Contributions
from reports.run.contributions import contributions as contributions_of
from reports.text.numbers import axis_label, count, counted, named, same_lengths, words

URGENCY = ("fail", "not demonstrable", "pass")  # of verdicts, the first to be looked at first
NEGLIGIBLE = 1e-7  # of the size of a metric
ROUNDING = 1e-13  # of numbers of which another one is the difference
SQUARABLE = 1e140  # largest number, and inverse of the smallest spread, whose squares over all cases can be summed
NEGLIGIBLE_SPREAD = "standard deviation below a ten-millionth of the value"
ZERO = 1e-18  # of the largest numbers in the same unit: what is below it is a zero but for rounding
MARK = 1e12  # a larger number is mostly a mark, such as 1e30 for "never", beside which nothing was rounded
ROUNDED_ZERO = "zero but for rounding"
UNSQUARABLE = "numbers beyond 1e140 or a standard deviation below 1e-140"


def rounded_zero(size: float, largest: float) -> bool:
    """Whether numbers of this size are zero but for rounding beside the largest ones in their unit."""
    return size < ZERO * min(largest, MARK)


@dataclass(frozen=True)
class ColumnFacts:
    """name, unit, role and one-line meaning of a column."""

    name: str
    unit: str
    role: str
    description: str


class Integration(BaseModel):
    """How finer steps change the metrics, in their own units, see `runner.histories.integration_changes`."""

    by: str
    tried: int
    used: int
    changes: dict[str, FiniteFloat]


class Flown:
    """A run with its tables read once.  name : of the run directory, as the commands in the report spell it.

    `cases` is the table at hand, one row for each of `n_held` cases: all `n_tried`, unless the run is too large to be
    held.  Its columns (`values`, `inputs`, `ok`, `case_ids`) are what figures are drawn of; all that is told of all
    cases (counts, summaries, verdicts, worst and failed ones) comes from `every`.
    """

    def __init__(self, run: Store, name: str):
        self.run = run
        self.name = name
        self.manifest = run.manifest
        self.every = all_cases(run, self.stated.two_sided, () if self.chosen else self.stated.percentiles)
        self.cases = self.every.table
        self.nominal = run.nominal()
        self.histories = without_attributes(run.histories())
        self.n_wanted = int(run.n_cases)
        self._contributors: dict[str, list[Contributor]] = {}

    # ---- what the manifest says

    @cached_property
    def campaign(self) -> Mapping[str, Any]:
        return self.manifest.get("campaign", {})

    @cached_property
    def stated(self) -> ReportSection:
        """Probability and confidence of all statistics."""
        return ReportSection(**self.manifest.get("report", {}))

    @property
    def own(self) -> "Flown":
        """The run with each column in its own unit."""
        return self

    @cached_property
    def design(self) -> str:
        return str(self.campaign.get("design", "mc"))

    @property
    def random(self) -> bool:
        """Whether shares of cases estimate probabilities."""
        return self.design in SAMPLING_DESIGNS

    @property
    def chosen(self) -> bool:
        """Whether every case was chosen by levels: then there are no percentiles."""
        return self.design in CHOSEN_DESIGNS

    @cached_property
    def columns(self) -> dict[str, ColumnFacts]:
        """All columns, in the order of the table, and history quantities by name; of one name the column counts."""
        records = [*self.manifest.get("columns", []), *self.manifest.get("quantities", [])]
        facts = [
            ColumnFacts(record["name"], record.get("unit", ""), record.get("role", ""), record.get("description", ""))
            for record in records
        ]
        known: dict[str, ColumnFacts] = {}
        for fact in (*facts, ColumnFacts("t_s", "s", "time", "time")):  # a metric may have the name of the time
            known.setdefault(fact.name, fact)
        return known

    def with_role(self, role: str) -> list[ColumnFacts]:
        """Columns of one role that the table holds, in order."""
        return [fact for fact in self.columns.values() if fact.role == role and fact.name in self.cases.columns]

    def range(self, name: str) -> tuple[float, float]:
        """The physical range that the model gives a column; infinite where it gives none."""
        low, high = self.manifest.get("ranges", {}).get(name, (None, None))
        return -np.inf if low is None else float(low), np.inf if high is None else float(high)

    def told(self, name: str, value: Any) -> Any:
        """A number, or an array of them, of a column's own unit in the unit that it is told in."""
        return value

    def told_table(self, table: pd.DataFrame) -> pd.DataFrame:
        """A table of histories in the units that they are told in."""
        return table

    def unit(self, name: str) -> str:
        return self.columns[name].unit if name in self.columns else ""

    def lengths(self, name: str, other: str) -> bool:
        """Whether both columns are lengths in one unit, so that a figure of them can be to scale."""
        return same_lengths(self.unit(name), self.unit(other))

    def words(self, name: str) -> str:
        return words(name, self.unit(name))

    def listed(self, names: Iterable[str]) -> str:
        """Several columns in words, for a sentence."""
        return ", ".join(self.words(name) for name in names)

    def axis(self, name: str) -> str:
        """An axis label: the column's name in words with its unit; of an input that is a symbol, its meaning too.

        Without the meaning if a state or output has the same name: the initial position is not the position in flight.
        """
        # Of the inputs' own records: the columns of a run upstream have its name before their meaning.
        inputs, outputs = (self.manifest.get(key, []) for key in ("inputs", "quantities"))
        meanings = {str(record["name"]): str(record.get("description", "")) for record in inputs}
        meanings |= {str(record["name"]): "" for record in outputs}
        return axis_label(named(self.words(name), meanings.get(name, "")), self.unit(name))

    def label(self, name: str) -> str:
        """The column's name in words with its unit."""
        return axis_label(self.words(name), self.unit(name))

    @property
    def fixed(self) -> list[Mapping[str, Any]]:
        """The records of the parameters and settings, which all cases share."""
        return [record for key in ("parameters", "settings") for record in self.manifest.get(key, [])]

    def absence(self, *names: str) -> str:
        """Why the table of cases lacks one of the columns, as the end of a sentence; empty if it lacks none."""
        shared = {str(record["name"]): str(record.get("unit", "")) for record in self.fixed}
        for name in names:
            if name in self.cases.columns:
                continue
            if name in shared:
                return f"the run does not disperse the {words(name, shared[name])}"
            return f"the run has no column {name}"
        return ""

    @cached_property
    def figures(self) -> list[Any]:
        """The model's figures, of the kinds that this report knows."""
        return [from_record(record) for record in self.manifest.get("figures", []) if record.get("kind") in KINDS]

    # ---- the table at hand

    @property
    def n_held(self) -> int:
        """How many cases the table at hand has."""
        return len(self.cases)

    @property
    def sampled(self) -> bool:
        """Whether these are some of the cases only."""
        return self.n_held < self.n_tried

    @property
    def sample_words(self) -> str:
        """What a caption says of a sample, as its end; empty where all cases are held."""
        return f", from {count(self.n_held)} of {count(self.n_tried)} cases picked evenly" if self.sampled else ""

    @property
    def held_words(self) -> str:
        """The cases at hand in a sentence: "40 000 cases", or "2 000 cases picked evenly from 40 000"."""
        return counted(self.n_held, "case") + (f" picked evenly from {count(self.n_tried)}" if self.sampled else "")

    @property
    def ok(self) -> np.ndarray:
        """bool[n_held]: completed."""
        return self.every.ok

    @cached_property
    def case_ids(self) -> np.ndarray:
        return self.cases["case_id"].to_numpy(dtype=np.int64)

    def rows(self, case_ids: np.ndarray | pd.Series) -> np.ndarray:
        """Rows of the table at hand for these cases, in their order, without those that it does not hold."""
        place = pd.Index(self.case_ids).get_indexer(np.asarray(case_ids, dtype=np.int64))
        return place[place >= 0]

    def values(self, name: str) -> np.ndarray:
        """float64[n_held] of a column; NaN for words, for a missing column, and for metrics of failed cases."""
        return self.every.values(name)

    def nominal_value(self, name: str) -> float | None:
        """The nominal case's number in a column, None if it has none."""
        value = self.nominal.get(name)
        return float(value) if isinstance(value, int | float | np.number) and np.isfinite(float(value)) else None

    # ---- statistics of all cases

    @property
    def n_tried(self) -> int:
        return self.every.n_tried

    @property
    def summaries(self) -> dict[str, Summary]:
        """Summary per metric."""
        return self.every.summaries

    @property
    def verdicts(self) -> list[Verdict]:
        """One verdict per requirement, in the order of the campaign file."""
        return self._judgement[0]

    @property
    def joint(self) -> Verdict | None:
        """The verdict on all requirements at once; None unless there are several."""
        return self._judgement[1]

    @property
    def _judgement(self) -> tuple[list[Verdict], Verdict | None]:
        return self.every.judgement

    def worst(self, metric: str, most: int) -> pd.DataFrame:
        """The worst cases of a metric: those with the smallest margin to its limits."""
        return self.every.worst(metric, most, self.limits(metric))

    @property
    def looked(self) -> bool:
        """Whether the number of cases was decided by looking at them."""
        return was_looked_at(self.manifest, self.n_wanted, self.n_tried)

    @cached_property
    def integration(self) -> Integration | None:
        """How finer steps change the metrics, by the journal's last note on it; None where there is none."""
        for entry in reversed(self.run.notes("finished")):
            with suppress(ValidationError):
                return Integration.model_validate(entry.facts.get("integration"))
        return None

    def integration_share(self, metric: str) -> float | None:
        """The change of a metric by finer steps over its standard deviation.

        None where one of them is not known, or is but the rounding of larger metrics in its unit: the crossrange of a
        planar flight beside its range.
        """
        known = {} if self.integration is None else self.integration.changes
        change, summary = known.get(metric), self.own.summaries.get(metric)
        if change is None or summary is None or not summary.spread:
            return None
        return change / summary.spread if summary.spread > ROUNDING * self.own.largest_alike(metric) else None

    def largest_alike(self, metric: str) -> float:
        """Size of the largest number, but for marks, among the metrics in the unit of this one."""
        alike = [other for name, other in self.summaries.items() if self.unit(name) == self.unit(metric)]
        ends = [abs(end) for other in alike for end in (other.minimum, other.maximum) if end is not None]
        return max((end for end in ends if end < MARK), default=0.0)

    @cached_property
    def key_metrics(self) -> list[str]:
        """The metrics that matter: those with a requirement, then those that the model maps or plots; else all.

        Without those that are not drawn, of which distributions, contributors and convergence say nothing.
        """
        wanted = [verdict.metric for verdict in self.verdicts]
        for figure in self.figures:
            wanted += [figure.metric] if isinstance(figure, MapFigure) else []
            wanted += [figure.y, figure.x] if isinstance(figure, ScatterFigure) else []
        metrics = [fact.name for fact in self.with_role("metric")]
        known = [name for name in dict.fromkeys(wanted) if name in metrics]
        drawn = [name for name in known or metrics if not self.undrawn(name)]
        return drawn or [name for name in metrics if self.undrawn(name) != UNSQUARABLE]

    @cached_property
    def worst_first(self) -> list[str]:
        """The metrics that matter and vary: those of failed requirements, of not demonstrable ones, the others."""
        ranks: dict[str, int] = {}
        for verdict in self.verdicts:
            rank = URGENCY.index(verdict.outcome)
            ranks[verdict.metric] = min(rank, ranks.get(verdict.metric, rank))
        varying = [name for name in self.key_metrics if not self.summaries[name].constant]
        return sorted(varying, key=lambda name: ranks.get(name, len(URGENCY)))

    def limits(self, metric: str) -> Limits:
        """The tightest limits that the requirements set on a metric."""
        return limits_on(metric, self.manifest.get("requirements", []))

    def undrawn(self, name: str) -> str:
        """Why no figure shows the spread of a column, in words: it is negligible, or not to be squared; else empty.

        Negligible: no limit on it, and σ below a ten-millionth of its size, mostly the tolerance of an event or of the
        integration; or it is zero but for rounding, as the crossrange of a planar flight beside its range.
        """
        summary = self.summaries.get(name) or summarize(self.values(name), probabilities=())
        if summary.constant or summary.sd is None:
            return ""
        size = max(abs(summary.minimum or 0.0), abs(summary.maximum or 0.0))
        if size > SQUARABLE or not summary.sd >= 1.0 / SQUARABLE:
            return UNSQUARABLE
        if self.limits(name) != Limits():
            return ""
        if self._rounded_zero(name):
            return ROUNDED_ZERO
        return NEGLIGIBLE_SPREAD if summary.sd < NEGLIGIBLE * size else ""

    def _rounded_zero(self, name: str) -> bool:
        """Whether a metric is zero but for rounding, by its own unit: a report tells a range and its error in two."""
        own, summary = self.own, self.own.summaries.get(name)
        if summary is None or not own.unit(name):
            return False
        return rounded_zero(max(abs(summary.minimum or 0.0), abs(summary.maximum or 0.0)), own.largest_alike(name))

    def unsquarable(self, *names: str) -> str:
        """The columns among these that have such numbers that nothing can be computed of their squares; else empty."""
        found = [name for name in names if self.undrawn(name) == UNSQUARABLE]
        return f"{UNSQUARABLE}: {self.listed(found)}" if found else ""

    def largest_is_worst(self, metric: str) -> bool:
        """Whether the bad end of a metric is the upper one; with two limits, that with the smaller margin."""
        summary = self.summaries[metric]
        return self.limits(metric).largest_is_worst(np.array([summary.minimum, summary.maximum], dtype=np.float64))

    @property
    def inputs(self) -> dict[str, np.ndarray]:
        """The columns at hand of the dispersed inputs by name."""
        return {fact.name: self.cases[fact.name].to_numpy() for fact in self.with_role("dispersion")}

    @cached_property
    def draws(self) -> frozenset[str]:
        """The inputs that only name a random draw, as a seed does."""
        records = self.manifest.get("inputs", [])
        return frozenset(str(record["name"]) for record in records if record.get("random_draw"))

    def contributors(self, metric: str) -> list[Contributor]:
        """The dispersed inputs that vary, the one that contributes most to the metric first."""
        if metric not in self._contributors:
            found, values = self._by_total_effect(metric), self.values(metric)
            if self.design == "one_at_a_time":
                found = ranked_by_change(self.inputs, self.nominal, values)
            self._contributors[metric] = found or contributors(self.inputs, values, self.design == "sobol")
        return self._contributors[metric]

    def _by_total_effect(self, metric: str) -> list[Contributor]:
        """The same as the chapter on contributors ranks them: some act only together; empty where it has none."""
        if self.contributions is None:
            return []
        rows, members, inputs = self.contributions.by_metric.get(metric, ()), self.contributions.members, self.inputs
        alone: dict[str, int] = {}
        if any(len(group) > 1 for group in members.values()):  # which of a group matter, the table of cases tells
            ranked = contributors(inputs, self.values(metric), self.design == "sobol")
            alone = {contributor.name: place for place, contributor in enumerate(ranked)}
        groups = [(row, members.get(row.input, [row.input])) for row in rows]
        named = [(n, row.size) for row, group in groups for n in sorted(group, key=lambda n: alone.get(n, len(alone)))]
        return [Contributor(name, size) for name, size in named if name in inputs]

    @cached_property
    def contributions(self) -> Contributions | None:
        """Shares of the variance of the metrics, by input and random draws."""
        return contributions_of(self)

    def status_text(self, status: str) -> str:
        """The sentence behind a status word: the run's own, or this engine's; what is code there stands in quotes."""
        text = str({**STATUS_MEANING, **self.manifest.get("status_texts", {})}.get(status, ""))
        return re.sub("`([^`]*)`", r"“\1”", text)
