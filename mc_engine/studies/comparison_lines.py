"""A comparison of two runs in lines for a terminal."""

from collections.abc import Iterator
from dataclasses import astuple

import numpy as np

from mc_engine.numbers_in_text import counted, percent_digits
from mc_engine.statistics.change_tests import Estimate, MetricChange, ShareChange, hidden_by_ties
from mc_engine.studies.comparison import Comparison
from mc_engine.studies.run_changes import changed_lines

_LEAST_P = 1e-12  # a smaller p-value means no more
_TIES = "ties"
_NO_INTERVAL = "no interval"
_HEADINGS = ("metric", "shift", "in sigma of A", "adjusted p", "spread B/A", "adjusted p", "used A, B")


def comparison_lines(comparison: Comparison) -> Iterator[str]:
    """All that a reader needs to act on, the answer last."""
    runs = zip("AB", comparison.names, comparison.cases, comparison.wanted, comparison.ok, strict=True)
    for letter, name, cases, wanted, ok in runs:
        flown = f"{cases:,} of {wanted:,} cases" if cases < wanted else counted(cases, "case")
        yield f"{letter}  {name}: {flown}, {ok:,} completed"
    yield comparison.pairing.reason
    for verdict in comparison.verdicts:
        inside = verdict.inside_words("{:,}".format)
        yield f"requirement {verdict.name}: {verdict.words}{', ' if inside else ''}{inside}"
    yield from _source_changes(comparison)
    yield from _metric_table(comparison)
    yield from (f"not compared: {sentence}" for sentence in comparison.left_out)
    if len(comparison.shares) > 1:  # verdicts above are those of each run's own limits
        yield "cases completed, and inside the limits of run B in both runs:"
    yield from (_share_line(share, comparison.alpha) for share in comparison.shares)
    if comparison.chosen:
        yield f"note: {comparison.chosen}"
    yield answer(comparison)


def answer(comparison: Comparison) -> str:
    """The whole comparison in a sentence."""
    held = counted(comparison.n_tests, "test")
    if not comparison.chosen:
        held += f", at most one chance in {1.0 / comparison.alpha:.0f} of any false alarm"
    if not comparison.changed:
        return f"no significant change ({held})"
    parts = [
        _kind_and_names("shift of", [metric.metric for metric in comparison.shifted]),
        _kind_and_names("spread of", [metric.metric for metric in comparison.spread]),
        _kind_and_names("fraction", [share.name for share in comparison.moved_shares]),
        _kind_and_names("requirement worse:", [verdict.name for verdict in comparison.worse_verdicts]),
    ]
    return f"changed: {'; '.join(part for part in parts if part)} ({held})"


def _kind_and_names(kind: str, names: list[str]) -> str:
    return f"{kind} {', '.join(names)}" if names else ""


def _source_changes(comparison: Comparison) -> Iterator[str]:
    yield f"code: {'unchanged' if not comparison.code else ''}".rstrip()
    yield from (f"  {line}" for line in changed_lines(comparison.code))
    same = not comparison.campaign and not comparison.diff
    yield f"campaign: {'unchanged' if same else ''}".rstrip()
    yield from (f"  {line}" for line in changed_lines(comparison.campaign))
    if comparison.diff and not comparison.campaign:
        yield from (f"  {line}" for line in comparison.diff)


def _metric_table(comparison: Comparison) -> Iterator[str]:
    rows = [_HEADINGS, *(_metric_cells(change, comparison) for change in comparison.moved)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows if len(rows) > 1 else []:
        cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
        yield "  ".join(cells).rstrip()
    if len(rows) > 1:
        sure = percent_digits(comparison.confidence)
        yield f"in brackets: {sure} % intervals, each by itself; p-values are adjusted for all tests together"
    some = [change for change in comparison.moved if 0 < (change.differing or 0) < change.n_used[0]]
    if some:
        pairs = [f"{change.metric} ({change.differing:,} of {change.n_used[0]:,})" for change in some]
        yield f"shift of the pairs that differ, not of all: {', '.join(pairs)}"
    if selection := comparison.selection_words("{:,}".format):
        yield selection
    if any(_TIES in row for row in rows):
        yield f"{_TIES}: so many cases have equal values that the size of a significant change is hidden; see --report"
    if any(_NO_INTERVAL in cell for row in rows for cell in row):
        yield f"{_NO_INTERVAL}: the cases, or those that differ between the runs, are too few for one"
    if comparison.same:
        yield f"{comparison.same_words}: {', '.join(comparison.same)}"
    if comparison.absent:
        yield f"without a number in one of the runs: {', '.join(comparison.absent)}"


def _metric_cells(change: MetricChange, comparison: Comparison) -> tuple[str, ...]:
    unit = comparison.units[change.metric]
    tied = hidden_by_ties(change.shift_in_sigma, 0.0, change in comparison.shifted)
    return (
        f"{change.metric}{f' [{unit}]' if unit else ''}",
        _TIES if tied else f"{change.shift.value:.4g}",  # of a change that is in the table, which is a number
        _TIES if tied else _with_interval(change.shift_in_sigma),
        _p_value_text(change.shift_adjusted, comparison.alpha),
        _TIES if hidden_by_ties(change.ratio, 1.0, change in comparison.spread) else _with_interval(change.ratio),
        _p_value_text(change.spread_adjusted, comparison.alpha),
        f"{change.n_used[0]:,}, {change.n_used[1]:,}",
    )


def _share_line(share: ShareChange, alpha: float) -> str:
    counts = " -> ".join(f"{k:,} of {n:,}" for k, n in zip(share.counted, share.tried, strict=True))
    pairs = f", {share.lost:,} lost and {share.gained:,} gained" if share.lost is not None else ""
    return f"{share.name}: {counts}{pairs}, adjusted p {_p_value_text(share.adjusted, alpha)}"


def _with_interval(estimate: Estimate) -> str:
    if not np.isfinite(estimate.value):
        return "-"
    value, lower, upper = (f"{round(end, estimate.decimals) + 0.0:.{estimate.decimals}f}" for end in astuple(estimate))
    return f"{value} [{_NO_INTERVAL if estimate.unbounded else f'{lower}, {upper}'}]"


def _p_value_text(value: float, alpha: float) -> str:
    """The p-value, a star where it is significant."""
    if not np.isfinite(value):
        return "no test"
    return f"{f'{value:.2g}' if value >= _LEAST_P else '<1e-12'}{' *' if value <= alpha else ''}"
