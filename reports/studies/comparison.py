"""The report of `mc-engine compare A B --report FILE`: the comparison of two runs as a page or as a PDF."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple
from pathlib import Path, PurePosixPath

import numpy as np

from mc_engine.durable_file import write_durably
from mc_engine.statistics.change_tests import Estimate, MetricChange, ShareChange, finite, hidden_by_ties
from mc_engine.store.store import Store
from mc_engine.studies.comparison import Comparison, VerdictChange
from mc_engine.studies.run_changes import Difference
from mc_engine.units import convert
from reports.document.blocks import (
    Block,
    Card,
    Cell,
    Column,
    Document,
    FigureBlock,
    Section,
    Table,
    Terms,
    as_blocks,
    numbered,
)
from reports.formats.html import render_html
from reports.formats.pdf import render_pdf
from reports.run.chosen_units import ShownRun, chosen_unit
from reports.run.flown import Flown
from reports.sections.headline import turns
from reports.studies.comparison_figure import change_figure
from reports.studies.comparison_overlays import overlay_blocks
from reports.text.numbers import (
    SPACE,
    axis_label,
    capitalised,
    count,
    counted,
    fixed,
    given_percent,
    number,
    p_value,
    percent,
    words,
)

ROUNDING = 1e-12  # of a mean: a smaller standard deviation is none
GLOSSARY = Terms(
    (
        (
            "significant",
            "The adjusted p-value is at most alpha. Holm’s adjustment covers all tests of this comparison together: "
            "if nothing had changed, the probability of one or more significant lines is at most alpha.",
        ),
        (
            "paired",
            "The same case, with the same inputs, in both runs: the scatter of the inputs is removed from the "
            "difference. Otherwise the runs are two independent samples.",
        ),
        (
            "shift",
            "The shift from run A to run B at which the test statistic is zero: the Hodges–Lehmann estimate, in "
            "standard deviations σ of run A; of pairs, only of those that differ. Means of both runs, of all cases "
            "used, are in columns of their own.",
        ),
        (
            "ties",
            "So many cases have equal values that the estimated size is no change although the test is significant: "
            "see the means, or the distributions.",
        ),
        ("spread", "The ratio, run B over run A, of the distances from each run’s own median, estimated likewise."),
        (
            "tests",
            "Paired: Wilcoxon’s signed ranks of the differences, Student’s t of the distances to each run’s own "
            "median (the paired form of Brown and Forsythe’s test), McNemar’s exact test of a fraction. Unpaired: "
            "normal scores, Brown and Forsythe’s test, Fisher’s exact test. Those of shifts and fractions are "
            "distribution-free; those of spread are approximate, with more false alarms where a metric has a long "
            "tail and one of two unpaired runs has far fewer cases. Size and interval of a change are of the quantity "
            "that is tested: the interval excludes no change exactly if the test, by itself, is significant.",
        ),
        (
            "intervals",
            "Each has the confidence of run B’s [report]; they are not widened for their number.",
        ),
    )
)


def write_comparison(comparison: Comparison, path: Path, runs: tuple[Store, Store] | None = None) -> Path:
    """Write the comparison to `path`, a page if it ends in .html, else a PDF; the file appears whole or not at all.

    runs : A and B, whose distributions, histories and footprints are laid over one another.
    """
    document = build_comparison(comparison, runs)
    content = render_html(document) if path.suffix == ".html" else render_pdf(document)
    write_durably(path, content)
    return path


def build_comparison(comparison: Comparison, runs: tuple[Store, Store] | None = None) -> Document:
    """The comparison as a document: requirements first, then metrics, then what was edited in code and campaign."""
    overlays: tuple[Block, ...] = ()
    angles: list[str] = []
    units = {change.metric: chosen_unit(comparison.units[change.metric], change.mean) for change in comparison.metrics}
    if runs is not None:
        own = Flown(runs[0], comparison.names[0]), Flown(runs[1], comparison.names[1])
        angles = [f"Run {letter}, {jump}" for letter, run in zip("AB", own, strict=True) for jump in turns(run, units)]
        first = ShownRun(own[0])
        units = {metric: first.unit(metric) for metric in units}
        pair = first, ShownRun(own[1], like=first)
        overlays = as_blocks(overlay_blocks(pair, [change.metric for change in _ranked(comparison)]))
    sections = (
        Section("requirements", "Requirements", as_blocks([_verdict_table(comparison), _share_table(comparison)])),
        Section("metrics", "Metrics", as_blocks(_metric_blocks(comparison, units))),
        Section("overlays", "Both runs over one another", overlays),
        Section("code", "Changes in the code", as_blocks([_difference_block("Code", comparison.code)])),
        Section("campaign", "Changes in the campaign", as_blocks(_campaign_blocks(comparison))),
        Section("reading", "Glossary", (GLOSSARY,)),
    )
    return Document(
        kind="Comparison of two runs",
        question="Changes",
        title=comparison.titles[1] if comparison.titles[0] == comparison.titles[1] else " and ".join(comparison.titles),
        subtitle=_change_sentence(comparison),
        created=comparison.created[1],
        facts=_run_facts(comparison),
        verdicts=tuple(_change_cards(comparison)),
        costs=(),
        warnings=(*_comparison_warnings(comparison), *angles),
        sections=numbered(section for section in sections if section.blocks),
    )


# ---- the headline


def _change_sentence(comparison: Comparison) -> str:
    chance = counted(comparison.n_tests, "test")
    if not comparison.chosen:
        chance += f"; at most {percent(comparison.alpha, up=True)} chance of any false alarm"
    what = (
        "Significant changes from run A to run B" if comparison.changed else "No significant change from run A to run B"
    )
    turned = [f"{verdict.name}: {verdict.words}" for verdict in comparison.verdicts if verdict.before != verdict.after]
    verdicts = f"Requirements: {'; '.join(turned)}. " if turned else ""
    return f"{verdicts}{what} ({chance})."


def _run_facts(comparison: Comparison) -> tuple[tuple[str, str], ...]:
    reason = re.sub(r"(?<=\d),(?=\d{3})", SPACE, comparison.pairing.reason)
    facts = []
    numbers = zip(comparison.cases, comparison.wanted, comparison.ok, strict=True)
    names = _short_names(comparison.names)
    for letter, name, (cases, wanted, ok), created in zip("AB", names, numbers, comparison.created, strict=True):
        of = f"{count(cases)} of {counted(wanted, 'case')}" if cases < wanted else counted(cases, "case")
        flown = f"{of}, {count(ok)} completed"
        facts.append((f"Run {letter}", f"{name}: {flown}, {created[:16].replace('T', ' ')}".rstrip(", ")))
    return (*facts, ("Cases", capitalised(reason)))


def _short_names(names: tuple[str, str]) -> tuple[str, ...]:
    """The names as given; of absolute paths the last parts, as many as tell them apart."""
    if not any(PurePosixPath(name).is_absolute() for name in names):
        return names
    parts = [(name,) if "://" in name else PurePosixPath(name).parts for name in names]
    for depth in range(1, max(map(len, parts))):
        short = tuple(str(PurePosixPath(*path[-depth:])) if path[1:] else path[0] for path in parts)
        if len(set(short)) == len(short):
            return short
    return tuple(path[-1] for path in parts)


def _change_cards(comparison: Comparison) -> Iterator[Card]:
    for verdict in comparison.verdicts:
        if verdict.before != verdict.after:
            yield Card(verdict.name, verdict.words, verdict.inside_words(count), _tone(verdict) or "open")
    same = [verdict for verdict in comparison.verdicts if verdict.before == verdict.after]
    if same:
        detail = "; ".join(
            f"{verdict.name}: {verdict.words}, {verdict.inside_words(count)}".rstrip(", ") for verdict in same
        )
        yield Card(
            "Other requirements" if len(same) < len(comparison.verdicts) else "Requirements", "same verdicts", detail
        )
    total = len(comparison.metrics) - len(comparison.absent)
    for label, moved in (("Shift", comparison.shifted), ("Spread", comparison.spread)):
        ranked = sorted(moved, key=lambda change: -change.effect)
        names = ", ".join(words(change.metric, comparison.units[change.metric]) for change in ranked[:4])
        more = f" and {len(moved) - 4} more" if len(moved) > 4 else ""
        detail = f"of {count(total)} metrics: {names}{more}" if moved else f"none of {count(total)} metrics"
        yield _change_card(label, len(moved), detail)
    shares = comparison.moved_shares
    detail = ", ".join(share.name for share in shares) or f"none of {count(len(comparison.shares))} fractions of cases"
    yield _change_card("Fractions of cases", len(shares), detail)


def _change_card(label: str, changed: int, detail: str) -> Card:
    """Of a change alone, which may be for the better: without a verdict."""
    return (
        Card(label, f"{count(changed)} changed", detail) if changed else Card(label, "none significant", detail, "good")
    )


def _comparison_warnings(comparison: Comparison) -> tuple[str, ...]:
    sentences = [f"Not compared: {sentence}." for sentence in comparison.left_out]
    if comparison.chosen:
        sentences.append(f"{capitalised(comparison.chosen)}.")
    if not comparison.pairing.paired and any(verdict.worse for verdict in comparison.verdicts):
        sentences.append("The runs flew other cases: chance alone may have changed the verdict of a requirement.")
    return tuple(sentences)


# ---- metrics


def _metric_blocks(comparison: Comparison, units: Mapping[str, str]) -> Iterator[FigureBlock | Table | str]:
    """units : in which the metrics are told."""
    if not comparison.metrics:
        yield "The runs have no metric in common."
        return
    moved = _ranked(comparison)
    drawn = [change for change in moved if finite(change.shift_in_sigma) or finite(change.ratio)]
    if drawn:
        yield change_figure(comparison, drawn)
    if moved:
        yield _metric_table(comparison, units, moved)
    if selection := comparison.selection_words(count):
        yield f"{capitalised(selection)}."
    if comparison.same:
        yield f"{capitalised(comparison.same_words)}: {_listed(comparison, comparison.same)}."
    if comparison.absent:
        yield f"Without a number in one of the runs: {_listed(comparison, comparison.absent)}."


def _listed(comparison: Comparison, metrics: Sequence[str]) -> str:
    return ", ".join(words(metric, comparison.units[metric]) for metric in metrics)


def _ranked(comparison: Comparison) -> list[MetricChange]:
    """The metrics that differ: those that changed beyond chance first, of them the largest effect first."""

    significant = {change.metric for change in (*comparison.shifted, *comparison.spread)}
    return sorted(comparison.moved, key=lambda change: change.metric not in significant)


def _metric_table(comparison: Comparison, units: Mapping[str, str], moved: list[MetricChange]) -> Table:
    columns = (
        Column("Metric", "text"),
        Column("Mean A", "number"),
        Column("Mean B", "number"),
        Column("Shift [σ]", "number"),
        Column("Adjusted p", "number"),
        Column("Spread B/A", "number"),
        Column("Adjusted p", "number"),
    )
    note = (
        "Significant changes first, each kind by its size. "
        f"Small: the {given_percent(comparison.confidence)} interval of the quantity that the test "
        "is of; cases used of cases flown. σ: standard deviation of run A. *: significant, for better or worse. "
        "–: no size, as a run has no spread, or ties hide it. No interval: too few cases, or pairs that differ."
    )
    rows = tuple(_metric_row(comparison, change, units[change.metric]) for change in moved)
    return Table("Metrics of both runs", columns, rows, note)


def _metric_row(comparison: Comparison, change: MetricChange, unit: str) -> tuple[Cell, ...]:
    own = comparison.units[change.metric]
    scales = [convert(deviation, own, unit) if unit != own else deviation for deviation in change.deviation]
    means = [convert(mean, own, unit) if unit != own else mean for mean in change.mean]
    used = " and ".join(f"{count(k)} / {count(n)}" for k, n in zip(change.n_used, change.n_tried, strict=True))
    if change.differing is not None:
        used = f"{count(change.differing)} of {count(change.n_used[0])} pairs differ"
        lost = change.n_tried[0] - change.n_used[0]
        used += f", {count(lost)} without a number" if lost else ""
    return (
        Cell(axis_label(words(change.metric, own), unit), small=used),
        *(_number_cell(value, scale) for value, scale in zip(means, scales, strict=True)),
        _size_cell(change.shift_in_sigma, 0.0, change.shift_adjusted <= comparison.alpha),
        _p_value_cell(change.shift_adjusted, comparison.alpha),
        _size_cell(change.ratio, 1.0, change.spread_adjusted <= comparison.alpha),
        _p_value_cell(change.spread_adjusted, comparison.alpha),
    )


def _number_cell(value: float, scale: float) -> Cell:
    spread = scale if scale > ROUNDING * abs(value) else None
    return Cell(number(value, scale=spread), value) if np.isfinite(value) else Cell("–")


def _size_cell(estimate: Estimate, none: float, significant: bool) -> Cell:
    """The size of a change; of one that is significant, but whose interval is no change alone, that ties hide it."""
    if hidden_by_ties(estimate, none, significant):
        return Cell("–", small="ties")
    return _estimate_cell(estimate)


def _estimate_cell(estimate: Estimate) -> Cell:
    if not finite(estimate):
        return Cell("–")
    value, lower, upper = (
        fixed(end, estimate.decimals) if np.isfinite(end) else number(end) for end in astuple(estimate)
    )
    return Cell(value, estimate.value, "no interval" if estimate.unbounded else f"[{lower}, {upper}]")


def _p_value_cell(value: float, alpha: float) -> Cell:
    if not np.isfinite(value):
        return Cell("no test")
    text = p_value(value)
    return Cell(f"{text}{SPACE}*" if value <= alpha else text, value)


# ---- shares and requirements


def _share_table(comparison: Comparison) -> Table:
    columns = (
        Column("Cases", "text"),
        Column("Run A", "number"),
        Column("Run B", "number"),
        Column("Difference [percentage points]", "number"),
        Column("Adjusted p", "number"),
    )
    note = (
        "Requirements are counted by the limits of run B in both runs; a case without a number is outside. "
        "*: significant, for better or worse."
    )
    return Table(
        "Fractions of the cases in both runs",
        columns,
        tuple(_share_row(share, comparison.alpha) for share in comparison.shares),
        note,
    )


def _share_row(change: ShareChange, alpha: float) -> tuple[Cell, ...]:
    runs = [
        Cell(percent(k / n) if n else "–", k / n if n else None, f"{count(k)} / {count(n)}")
        for k, n in zip(change.counted, change.tried, strict=True)
    ]
    in_percent = Estimate(*(100.0 * end for end in astuple(change.difference)))
    pairs = f"{count(change.lost)} lost, {count(change.gained or 0)} gained" if change.lost is not None else ""
    return (
        Cell(change.name, small=pairs),
        *runs,
        _estimate_cell(in_percent),
        _p_value_cell(change.adjusted, alpha),
    )


def _verdict_table(comparison: Comparison) -> Table | None:
    if not comparison.verdicts:
        return None
    columns = (Column("Requirement", "text"), Column("Run A", "text"), Column("Run B", "text"),
               Column("Change", "text"))  # fmt: skip
    rows = tuple(
        (
            Cell(verdict.name),
            Cell(verdict.before or "not required"),
            Cell(verdict.after or "not required", tone=_tone(verdict)),
            Cell(verdict.words, small=verdict.inside_words(count)),
        )
        for verdict in comparison.verdicts
    )
    return Table("Verdicts, each by its own run’s requirement", columns, rows)


def _tone(change: VerdictChange) -> str:
    if change.worse or change.after == "fail":
        return "bad"
    return "good" if change.after == "pass" else ""


# ---- code and campaign


def _difference_block(what: str, differences: tuple[Difference, ...]) -> Table | str:
    if not differences:
        return f"{what}: the same in both runs."
    columns = (Column("What", "text"), Column("Run A", "code"), Column("Run B", "code"))
    rows = tuple(
        (Cell(difference.what), Cell(difference.before or "–"), Cell(difference.after or "–"))
        for difference in differences
    )
    return Table(f"{what}: what is not the same", columns, rows)


def _campaign_blocks(comparison: Comparison) -> Iterator[Table | str]:
    yield _difference_block("Campaign", comparison.campaign)
    if comparison.diff:
        rows = tuple((Cell(line[:1]), Cell(line[1:])) for line in comparison.diff if not line.startswith("@@"))
        columns = (Column("", "code"), Column("Line of campaign.toml", "code"))
        note = "−: a line of run A alone; +: a line of run B alone; others are in both."
        yield Table("The two campaign files", columns, rows, note)
