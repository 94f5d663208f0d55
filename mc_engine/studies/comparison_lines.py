"""A comparison of two runs in lines for a terminal."""

from collections.abc import Iterator

import numpy as np

from mc_engine.statistics.change_tests import Estimate, MetricChange, ShareChange, finite
from mc_engine.studies.comparison import Comparison
from mc_engine.studies.run_changes import changed_lines

_LEAST_P = 1e-12  # a smaller p-value means no more
_HEADINGS = ("metric", "shift", "in sigma of A", "adjusted p", "spread B/A", "adjusted p", "used A, B")


def comparison_lines(found: Comparison) -> Iterator[str]:
    """All that a reader needs to act on, the answer last."""
    for letter, name, cases, ok in zip("AB", found.names, found.cases, found.ok, strict=True):
        yield f"{letter}  {name}: {cases:,} cases, {ok:,} completed"
    yield found.pairing.reason
    for one in found.verdicts:
        inside = one.inside_words("{:,}".format)
        yield f"requirement {one.name}: {one.words}{', ' if inside else ''}{inside}"
    yield from _changes(found)
    yield from _table(found)
    yield from (f"not compared: {sentence}" for sentence in found.left_out)
    yield from (_share_line(one, found.alpha) for one in found.shares)
    yield answer(found)


def answer(found: Comparison) -> str:
    """The whole comparison in a sentence."""
    held = f"{found.n_tests} tests, at most one chance in {1.0 / found.alpha:.0f} of any false alarm"
    if not found.changed:
        return f"no significant change ({held})"
    parts = [
        _named("shift of", [one.metric for one in found.shifted]),
        _named("spread of", [one.metric for one in found.spread]),
        _named("fraction", [one.name for one in found.moved_shares]),
        _named("requirement worse:", [one.name for one in found.worse_verdicts]),
    ]
    return f"changed: {'; '.join(part for part in parts if part)} ({held})"


def _named(what: str, names: list[str]) -> str:
    return f"{what} {', '.join(names)}" if names else ""


def _changes(found: Comparison) -> Iterator[str]:
    yield f"code: {'unchanged' if not found.code else ''}".rstrip()
    yield from (f"  {line}" for line in changed_lines(found.code))
    same = not found.campaign and not found.diff
    yield f"campaign: {'unchanged' if same else ''}".rstrip()
    yield from (f"  {line}" for line in changed_lines(found.campaign))
    if found.diff and not found.campaign:
        yield from (f"  {line}" for line in found.diff)


def _table(found: Comparison) -> Iterator[str]:
    same = [one.metric for one in found.metrics if one.same]
    moved = sorted((one for one in found.metrics if not one.same and finite(one.shift)), key=lambda one: -one.effect)
    rows = [_HEADINGS, *(_row(one, found) for one in moved)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(_HEADINGS))]
    for row in rows if len(rows) > 1 else []:
        cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
        yield "  ".join(cells).rstrip()
    if same:
        yield f"the same in both runs: {', '.join(same)}"
    absent = [one.metric for one in found.metrics if not one.same and not finite(one.shift)]
    if absent:
        yield f"without a number in one of the runs: {', '.join(absent)}"


def _row(one: MetricChange, found: Comparison) -> tuple[str, ...]:
    unit = found.units[one.metric]
    return (
        f"{one.metric}{f' [{unit}]' if unit else ''}",
        _number(one.shift.value),
        _with_interval(one.shift_in_sigma),
        _p(one.shift_adjusted, found.alpha),
        _with_interval(one.ratio),
        _p(one.spread_adjusted, found.alpha),
        f"{one.n_used[0]:,}, {one.n_used[1]:,}",
    )


def _share_line(one: ShareChange, alpha: float) -> str:
    counts = " -> ".join(f"{k:,} of {n:,}" for k, n in zip(one.counted, one.tried, strict=True))
    pairs = f", {one.lost:,} lost and {one.gained:,} gained" if one.lost is not None else ""
    return f"{one.name}: {counts}{pairs}, adjusted p {_p(one.adjusted, alpha)}"


def _with_interval(one: Estimate) -> str:
    if not np.isfinite(one.value):
        return "-"
    return f"{one.value:.3g} [{one.lower:.3g}, {one.upper:.3g}]"


def _number(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else "-"


def _p(value: float, alpha: float) -> str:
    """The p-value, a star where it is significant."""
    if not np.isfinite(value):
        return "no test"
    return f"{f'{value:.2g}' if value >= _LEAST_P else '<1e-12'}{' *' if value <= alpha else ''}"
