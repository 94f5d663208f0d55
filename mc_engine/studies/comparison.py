"""Comparison of two runs: which metrics, requirements and fractions of cases changed significantly.

If both runs flew the same inputs under the same case numbers, cases are compared in pairs, which removes the scatter of
the inputs from the difference.  Otherwise the runs are compared as two independent samples.  All tests of a comparison
(shift and spread of each metric, fraction of cases completed, fraction inside each requirement) hold together at
`alpha` (Holm): if nothing changed, the probability of one or more false alarms is at most alpha.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from mc_engine.campaign.parts import COMPLETED
from mc_engine.errors import EngineError
from mc_engine.section import ReportSection
from mc_engine.statistics.change_tests import (
    MOST_CASES,
    MetricChange,
    ShareChange,
    finite,
    holm,
    metric_change,
    share_change,
)
from mc_engine.statistics.limits import inside_all
from mc_engine.statistics.requirements import (
    FAIL,
    JOINT,
    NOT_DEMONSTRABLE,
    PASS,
    SAMPLING_DESIGNS,
    Verdict,
    judge_all,
    was_looked_at,
)
from mc_engine.status import OK, STATUS_NAME
from mc_engine.store.manifest_file import design_in, title_in
from mc_engine.store.store import Store
from mc_engine.studies.run_changes import Difference, campaign_diff, campaign_differences, code_differences

ALPHA = 0.003  # one false alarm in some 300 comparisons; 0.3 sigma is still found with 1000 cases and dozens of metrics
TOLERANCE = 1e-6  # standard deviations: smaller differences of a pair are rounding
_RANK = {PASS: 0, NOT_DEMONSTRABLE: 1, FAIL: 2}


@dataclass(frozen=True)
class Pairing:
    """Rows of the two tables that are compared, int64[n] each; `reason` says in a sentence why they are (not) pairs."""

    paired: bool
    rows: tuple[np.ndarray, np.ndarray]
    reason: str


@dataclass(frozen=True)
class VerdictChange:
    """A requirement's verdict in each run, by that run's own limits; None where a run has no such requirement.

    For paired runs both verdicts are on the pairs alone.  inside : by run, (cases inside the limits, all of these
    cases).
    notes : by run, remarks: which requirement makes the joint verdict fail or is the only one, and whether run B
        requires something else.
    """

    name: str
    before: str | None
    after: str | None
    inside: tuple[tuple[int, int] | None, tuple[int, int] | None] = (None, None)
    notes: tuple[str, str] = ("", "")

    @property
    def words(self) -> str:
        """Such as "fail → pass", or "pass in both runs"."""
        ends = [outcome or "not required" for outcome in (self.before, self.after)]
        return " → ".join(ends) if ends[0] != ends[1] else f"{ends[0]} in both runs"

    def inside_words(self, counted: Callable[[int], str]) -> str:
        """Such as "877 → 10,000 of 10,000 cases inside"; counted : how a number of cases is written."""
        a, b = self.inside
        if a is None or b is None:
            return ""
        (passed, tried), (now, of) = a, b
        before = counted(passed) if tried == of else f"{counted(passed)} of {counted(tried)}"
        because = [f"; in {run} {words}" for run, words in zip("AB", self.notes, strict=True) if words]
        return f"{before} → {counted(now)} of {counted(of)} cases inside{''.join(because)}"

    @property
    def worse(self) -> bool:
        """Whether the verdict is worse than before, in the order pass, not demonstrable, fail."""
        return self.before is not None and self.after is not None and _RANK[self.after] > _RANK[self.before]


@dataclass(frozen=True)
class Comparison:
    """The comparison of run A (before) with run B (after).

    cases, ok, wanted : by run, the numbers of its cases, of completed ones, and of those of the complete run
    confidence : of every interval, that of B's [report].
    metrics in the order of B's columns; units by metric; left_out : metrics that are not compared, and why.
    """

    names: tuple[str, str]
    titles: tuple[str, str]
    created: tuple[str, str]
    designs: tuple[str, str]
    cases: tuple[int, int]
    ok: tuple[int, int]
    wanted: tuple[int, int]
    pairing: Pairing
    alpha: float
    confidence: float
    metrics: tuple[MetricChange, ...]
    shares: tuple[ShareChange, ...]
    verdicts: tuple[VerdictChange, ...]
    units: Mapping[str, str]
    left_out: tuple[str, ...]
    code: tuple[Difference, ...]
    campaign: tuple[Difference, ...]
    diff: tuple[str, ...]

    @property
    def n_tests(self) -> int:
        """Number of tests that hold together at alpha."""
        return int(np.isfinite(_p_values(self.metrics, self.shares)).sum())

    @property
    def moved(self) -> tuple[MetricChange, ...]:
        """The metrics that differ, the largest change first."""
        different = [metric for metric in self.metrics if not metric.same and finite(metric.shift)]
        return tuple(sorted(different, key=lambda change: -change.effect))

    @property
    def same(self) -> tuple[str, ...]:
        """The metrics without any difference."""
        return tuple(metric.metric for metric in self.metrics if metric.same)

    @property
    def same_words(self) -> str:
        """What holds for the metrics of `same`."""
        lacking = any(metric.same and min(metric.n_used) < max(metric.n_tried) for metric in self.metrics)
        return "the same in both runs" + ", in the cases with a number in both" * lacking

    def selection_words(self, counted: Callable[[int], str]) -> str:
        """On metrics of which not all numbers are tested; empty without any.  counted : how a number is written."""
        paired = self.pairing.paired
        tested = [change.differing or 0 if paired else max(change.n_used) for change in self.moved]
        if max(tested, default=0) <= MOST_CASES:
            return ""
        what = f"{counted(MOST_CASES)} {'pairs that differ' if paired else 'numbers'}"
        return f"shifts of more than {what} are computed from that many, selected evenly"

    @property
    def absent(self) -> tuple[str, ...]:
        """The metrics without a number in one of the runs."""
        return tuple(metric.metric for metric in self.metrics if not metric.same and not finite(metric.shift))

    @property
    def shifted(self) -> tuple[MetricChange, ...]:
        return tuple(metric for metric in self.metrics if metric.shift_adjusted <= self.alpha)

    @property
    def spread(self) -> tuple[MetricChange, ...]:
        return tuple(metric for metric in self.metrics if metric.spread_adjusted <= self.alpha)

    @property
    def moved_shares(self) -> tuple[ShareChange, ...]:
        return tuple(share for share in self.shares if share.adjusted <= self.alpha)

    @property
    def worse_verdicts(self) -> tuple[VerdictChange, ...]:
        """Requirements with a worse verdict on the same cases; on other cases chance alone may change a verdict.

        Empty if a design gives no probabilities, because its verdicts are always "not demonstrable".
        """
        comparable = self.pairing.paired and not self.chosen
        return tuple(verdict for verdict in self.verdicts if verdict.worse) if comparable else ()

    @property
    def chosen(self) -> str:
        """A sentence on the runs whose cases are no random sample; empty if there are none."""
        runs = [
            f"run {run} (design {design})"
            for run, design in zip("AB", self.designs, strict=True)
            if design not in SAMPLING_DESIGNS
        ]
        return (
            f"the cases of {' and '.join(runs)} were chosen, not drawn at random: p-values and intervals, which are "
            "those of random samples, do not hold for them"
            if runs
            else ""
        )

    @property
    def changed(self) -> bool:
        """Whether anything changed significantly, or a requirement has a worse verdict on the same cases."""
        return bool(self.shifted or self.spread or self.moved_shares or self.worse_verdicts)


def compare_runs(
    a: Store, b: Store, names: tuple[str, str], *, alpha: float = ALPHA, tolerance: float = TOLERANCE
) -> Comparison:
    """The Comparison of run `a` (before) with run `b` (after).  names : of the runs, for example their directories.

    EngineError if they have no metric with the same name and unit.
    """
    if no_store := [run for run in (a, b) if not isinstance(run, Store)]:
        raise EngineError(f"runs are compared by their stores, and {no_store[0]!r} is none; open_store opens one")
    manifests, wanted = (a.manifest, b.manifest), (a.n_cases, b.n_cases)
    tables = a.cases(), b.cases()
    facts = tuple({fact["name"]: fact for fact in manifest["columns"]} for manifest in manifests)
    pairing = pair_cases(tables, (_of_role(facts[0], "dispersion"), _of_role(facts[1], "dispersion")))
    metrics, left_out = _shared_metrics(*facts)
    if left_out and not metrics:
        raise EngineError(f"{names[0]} and {names[1]} have no metric of the same name and unit: nothing to compare")
    ok = tuple(np.asarray(table["status"] == STATUS_NAME[OK], dtype=bool) for table in tables)
    values = [
        {name: np.where(flown, table[name].to_numpy(dtype=np.float64), np.nan) for name in metrics}
        for table, flown in zip(tables, ok, strict=True)
    ]
    first, second = pairing.rows
    confidence = ReportSection(**manifests[1].get("report", {})).confidence
    changes = [
        metric_change(name, values[0][name][first], values[1][name][second], paired=pairing.paired,
                      confidence=confidence, tolerance=tolerance)
        for name in metrics
    ]  # fmt: skip
    counted = {COMPLETED: ok, **_cases_inside(manifests[1], values, ok)}
    shares = [
        share_change(name, before[first], other[second], paired=pairing.paired, confidence=confidence)
        for name, (before, other) in counted.items()
    ]
    adjusted = iter(holm(_p_values(changes, shares)).tolist())
    return Comparison(
        names=names,
        titles=_both(manifests, title_in),
        created=_both(manifests, lambda manifest: str(manifest.get("created_utc", ""))),
        designs=_both(manifests, design_in),
        cases=_both(tables, len),
        ok=_both(ok, lambda flown: int(flown.sum())),
        wanted=wanted,
        pairing=pairing,
        alpha=alpha,
        confidence=confidence,
        metrics=tuple(
            replace(change, shift_adjusted=next(adjusted), spread_adjusted=next(adjusted)) for change in changes
        ),
        shares=tuple(replace(share, adjusted=next(adjusted)) for share in shares),
        verdicts=_verdict_changes(manifests, tables, ok, wanted, pairing),
        units={name: str(facts[1][name].get("unit", "")) for name in metrics},
        left_out=left_out,
        code=code_differences(*manifests),
        campaign=campaign_differences(*manifests),
        diff=campaign_diff(a.campaign_text, b.campaign_text),
    )


def pair_cases(tables: tuple[pd.DataFrame, pd.DataFrame], inputs: tuple[list[str], list[str]]) -> Pairing:
    """Pairs of cases with the same number and the same inputs; all cases, unpaired, where fewer than half have one."""
    everything = np.arange(len(tables[0])), np.arange(len(tables[1]))
    if set(inputs[0]) != set(inputs[1]):
        odd = ", ".join(sorted(set(inputs[0]) ^ set(inputs[1])))
        return Pairing(False, everything, f"not paired: only one of the runs disperses {odd}")
    _, first, second = np.intersect1d(
        tables[0]["case_id"].to_numpy(), tables[1]["case_id"].to_numpy(), assume_unique=True, return_indices=True
    )
    same = np.ones(first.size, dtype=bool)
    unlike = []
    for name in inputs[0]:
        equal = _equal(tables[0][name].to_numpy()[first], tables[1][name].to_numpy()[second])
        same &= equal
        unlike += [name] if not equal.all() else []
    fewest = min(len(tables[0]), len(tables[1]))
    if 2 * int(same.sum()) < fewest or not fewest:
        why = f"the same case numbers have other inputs ({', '.join(unlike)})" if unlike else "no case is in both runs"
        return Pairing(False, everything, f"not paired: {why}")
    n = int(same.sum())
    rest = len(tables[0]) + len(tables[1]) - 2 * n
    alone = (
        "1 case that only one run has, or with other inputs, is"
        if rest == 1
        else (f"{rest:,} cases that only one run has, or with other inputs, are")
    )
    remainder = f"; {alone} left out" if rest else ""
    have = "1 case has" if n == 1 else f"{n:,} cases have"
    return Pairing(True, (first[same], second[same]), f"paired: {have} the same inputs in both runs{remainder}")


def _equal(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    if a.dtype.kind == "f" and b.dtype.kind == "f":
        return (a == b) | (np.isnan(a) & np.isnan(b))
    return np.asarray(a == b, dtype=bool)


def _of_role(facts: Mapping[str, Mapping[str, Any]], role: str) -> list[str]:
    return [name for name, fact in facts.items() if fact.get("role") == role]


def _shared_metrics(
    a: Mapping[str, Mapping[str, Any]], b: Mapping[str, Mapping[str, Any]]
) -> tuple[list[str], tuple[str, ...]]:
    """Metrics of both runs, in the same unit; and a sentence for each of the others."""
    ours, theirs = _of_role(b, "metric"), _of_role(a, "metric")
    left_out = [f"{name}: only in A" for name in theirs if name not in ours]
    left_out += [f"{name}: only in B" for name in ours if name not in theirs]
    shared = [name for name in ours if name in theirs]
    units = {name: (a[name].get("unit", ""), b[name].get("unit", "")) for name in shared}
    left_out += [f"{name}: in {unit} in A, in {two} in B" for name, (unit, two) in units.items() if unit != two]
    return [name for name in shared if units[name][0] == units[name][1]], tuple(left_out)


def _cases_inside(manifest: Mapping[str, Any], values: list[dict[str, np.ndarray]], ok: Any) -> dict[str, Any]:
    """bool[n] of both runs for each requirement of B: inside its limits."""
    return {
        str(record["name"]): tuple(
            inside_all([record], columns.__getitem__, flown) for columns, flown in zip(values, ok, strict=True)
        )
        for record in manifest.get("requirements", [])
        if record["metric"] in values[0]
    }


def _verdict_changes(manifests: Any, tables: Any, ok: Any, wanted: Any, pairing: Pairing) -> tuple[VerdictChange, ...]:
    """The verdicts of both runs: on the same cases and with the same bounds where they are paired, else on all."""
    looked = [
        was_looked_at(manifest, n_cases, len(table))
        for manifest, table, n_cases in zip(manifests, tables, wanted, strict=True)
    ]
    if pairing.paired:
        looked = 2 * [any(looked)]
    judged_runs = [
        _judged(manifest, table.iloc[rows], flown[rows], sight)
        for manifest, table, flown, rows, sight in zip(manifests, tables, ok, pairing.rows, looked, strict=True)
    ]
    changes = []
    for name in dict.fromkeys(verdict for judged in judged_runs for verdict in judged):
        ends = [_verdict_on(name, judged) for judged in judged_runs]
        before, after = (None if verdict is None else verdict.outcome for verdict in ends)
        a, b = (None if verdict is None else (verdict.passed, verdict.tried) for verdict in ends)
        notes = _note(name, ends[0], None), _note(name, ends[1], ends[0])
        changes.append(VerdictChange(name, before, after, (a, b), notes))
    return tuple(changes)


def _judged(manifest: Mapping[str, Any], table: pd.DataFrame, flown: np.ndarray, looked: bool) -> dict[str, Verdict]:
    """The verdicts of a run by the names of its requirements, the joint one among them."""
    records = manifest.get("requirements", [])
    columns = {record["metric"]: table[record["metric"]].to_numpy(dtype=np.float64) for record in records}
    judged, joint = judge_all(records, columns.__getitem__, flown, design_in(manifest), looked)
    return {verdict.name: verdict for verdict in [*judged, *([joint] if joint else [])]}


def _verdict_on(name: str, judged: Mapping[str, Verdict]) -> Verdict | None:
    """A verdict of a run, None without it; the joint one of a run with a single requirement is the verdict on that."""
    if name == JOINT and len(judged) == 1:
        return next(iter(judged.values()))
    return judged.get(name)


def _note(name: str, verdict: Verdict | None, before: Verdict | None) -> str:
    """What a reader must know of a verdict that is next to the one `before`; "" for nothing."""
    if verdict is None or verdict.name != name:
        return f"{verdict.name} is the only requirement" if verdict else ""
    if before is None or not verdict.metric:
        return verdict.remark
    if before.metric != verdict.metric:
        return f"the metric is {verdict.metric}, in A {before.metric}"
    if before.limits != verdict.limits:
        return "the limit is different"
    asked, asks = (before.share, before.confidence), (verdict.share, verdict.confidence)
    return "the required probability is different" if asked != asks else ""


def _p_values(metrics: Any, shares: Any) -> list[float]:
    of_metrics = [p for metric in metrics for p in (metric.shift_p, metric.spread_p)]
    return of_metrics + [share.p_value for share in shares]


def _both(pair: Any, function: Any) -> Any:
    return tuple(function(item) for item in pair)
