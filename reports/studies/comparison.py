"""What `mc-engine compare A B --report FILE` writes: the comparison of two runs as a page or as a PDF."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mc_engine.durable_file import write_durably
from mc_engine.statistics.change_tests import UNKNOWN, Estimate, MetricChange, ShareChange, finite
from mc_engine.studies.comparison import Comparison, VerdictChange
from mc_engine.studies.run_changes import Difference
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
from reports.drawing.marks import Drawing
from reports.figures.rows import change_panel
from reports.formats.html import render_html
from reports.formats.pdf import render_pdf
from reports.run.flown import Flown, Run
from reports.studies.comparison_overlays import overlay_blocks
from reports.text.numbers import count, number, percent, with_unit, words

MOST_ROWS = 40  # of the figure
LEAST_P = 1e-12  # a smaller p-value means no more
WIDEST, FEW_SIGMA = 20.0, 5.0  # the axis of shifts: so many medians, or so many σ at least
GLOSSARY = Terms(
    (
        (
            "significant",
            "Its adjusted p-value is at most alpha. Holm’s adjustment covers all tests of this comparison together: if "
            "nothing had changed, the chance of even one significant line is at most alpha.",
        ),
        (
            "paired",
            "The same case, with the same inputs, in both runs: what the inputs do is taken out of the difference. "
            "Otherwise the runs are two independent samples.",
        ),
        (
            "shift",
            "The shift from run A to run B that the test does not distinguish from none: the Hodges–Lehmann "
            "estimate, in standard deviations σ of run A. Means of both runs are in columns of their own.",
        ),
        ("spread", "The ratio, run B over run A, of the distances from each run’s own median, estimated likewise."),
        (
            "tests",
            "Paired: Wilcoxon’s signed ranks of the differences, and of the distances to each run’s own median; "
            "McNemar’s exact test of a fraction. Unpaired: normal scores, Brown and Forsythe’s test, Fisher’s exact "
            "test. They are distribution-free. Each size and interval of a metric is of the quantity that its test is "
            "of: the interval excludes no change exactly where the test, by itself, finds one.",
        ),
        (
            "intervals",
            "They hold with the confidence of run B’s [report], one by one; they are not widened for their number.",
        ),
    )
)


def write_comparison(found: Comparison, path: Path, runs: tuple[Run, Run] | None = None) -> Path:
    """Write the comparison to `path`, a page if it ends in .html, else a PDF; the file appears whole or not at all.

    runs : A and B, whose distributions, histories and footprints are laid over one another.
    """
    document = build_comparison(found, runs)
    content = render_html(document) if path.suffix == ".html" else render_pdf(document)
    write_durably(path, content)
    return path


def build_comparison(found: Comparison, runs: tuple[Run, Run] | None = None) -> Document:
    """The comparison as a document: requirements first, then metrics, then what was edited in code and campaign."""
    overlays: tuple[Block, ...] = ()
    if runs is not None:
        pair = Flown(runs[0], found.names[0]), Flown(runs[1], found.names[1])
        overlays = as_blocks(overlay_blocks(pair, [one.metric for one in _ranked(found)]))
    sections = (
        Section("requirements", "Requirements", as_blocks([_verdict_table(found), _share_table(found)])),
        Section("metrics", "Metrics", as_blocks(_metric_blocks(found))),
        Section("overlays", "Both runs over one another", overlays),
        Section("code", "Changes in the code", as_blocks([_difference_block("Code", found.code)])),
        Section("campaign", "Changes in the campaign", as_blocks(_campaign_blocks(found))),
        Section("reading", "Glossary", (GLOSSARY,)),
    )
    return numbered(
        Document(
            kind="Comparison of two runs",
            question="Changes",
            title=found.titles[1] if found.titles[0] == found.titles[1] else " and ".join(found.titles),
            subtitle=_sentence(found),
            created=found.created[1],
            facts=_facts(found),
            verdicts=tuple(_cards(found)),
            costs=(),
            warnings=_warnings(found),
            sections=tuple(section for section in sections if section.blocks),
        )
    )


# ---- the headline


def _sentence(found: Comparison) -> str:
    chance = f"{count(found.n_tests)} tests; at most {percent(found.alpha)} chance of any false alarm"
    what = "Significant changes from run A to run B" if found.changed else "No significant change from run A to run B"
    turned = [f"{one.name}: {one.words}" for one in found.verdicts if one.before != one.after]
    verdicts = f"Requirements: {'; '.join(turned)}. " if turned else ""
    return f"{verdicts}{what} ({chance})."


def _facts(found: Comparison) -> tuple[tuple[str, str], ...]:
    reason = found.pairing.reason
    facts = []
    for letter, name, cases, ok, created in zip("AB", found.names, found.cases, found.ok, found.created, strict=True):
        flown = f"{count(cases)} cases, {count(ok)} completed"
        facts.append((f"Run {letter}", f"{name}: {flown}, {created[:16].replace('T', ' ')}".rstrip(", ")))
    return (*facts, ("Cases", f"{reason[:1].upper()}{reason[1:]}"))


def _cards(found: Comparison) -> Iterator[Card]:
    for verdict in found.verdicts:
        if verdict.before != verdict.after:
            yield Card(verdict.name, verdict.words, verdict.inside_words(count), _tone(verdict) or "open")
    same = [one for one in found.verdicts if one.before == one.after]
    if same:
        detail = "; ".join(f"{one.name}: {one.words}, {one.inside_words(count)}".rstrip(", ") for one in same)
        yield Card("Other requirements" if len(same) < len(found.verdicts) else "Requirements", "same verdicts", detail)
    total = len(found.metrics)
    for label, moved, what in (("Shift", found.shifted, "mean"), ("Spread", found.spread, "spread")):
        ranked = sorted(moved, key=lambda one: -one.effect)
        names = ", ".join(words(one.metric, found.units[one.metric]) for one in ranked[:4])
        more = f" and {len(moved) - 4} more" if len(moved) > 4 else ""
        detail = (
            f"of {count(total)} metrics: {names}{more}" if moved else f"the {what} of none of {count(total)} metrics"
        )
        yield Card(label, f"{count(len(moved))} changed" if moved else "no change", detail, "bad" if moved else "good")
    shares = found.moved_shares
    detail = ", ".join(one.name for one in shares) or f"none of {count(len(found.shares))} fractions of cases"
    yield Card(
        "Fractions of cases", f"{len(shares)} changed" if shares else "no change", detail, "bad" if shares else "good"
    )


def _warnings(found: Comparison) -> tuple[str, ...]:
    sentences = [f"Not compared: {sentence}." for sentence in found.left_out]
    if not found.pairing.paired and any(one.worse for one in found.verdicts):
        sentences.append("The runs flew other cases: chance alone may have changed the verdict of a requirement.")
    return tuple(sentences)


# ---- metrics


def _metric_blocks(found: Comparison) -> Iterator[FigureBlock | Table | str]:
    if not found.metrics:
        yield "The runs have no metric in common."
        return
    moved = _ranked(found)
    drawn = [one for one in moved if finite(one.shift_in_sigma) or finite(one.ratio)]
    if drawn:
        yield _figure(found, drawn)
    if moved:
        yield _metric_table(found, moved)
    same = [one.metric for one in found.metrics if one.same]
    if same:
        yield f"The same in both runs: {', '.join(same)}."
    absent = [one.metric for one in found.metrics if not one.same and not finite(one.shift)]
    if absent:
        yield f"Without a number in one of the runs: {', '.join(absent)}."


def _ranked(found: Comparison) -> list[MetricChange]:
    """The metrics that differ, the largest effect first."""
    return sorted((one for one in found.metrics if not one.same and finite(one.shift)), key=lambda one: -one.effect)


def _figure(found: Comparison, moved: list[MetricChange]) -> FigureBlock:
    shown = moved[:MOST_ROWS]
    reach = _reach([abs(one.shift_in_sigma.value) for one in shown])
    far = [one for one in shown if abs(one.shift_in_sigma.value) > reach]
    names = tuple(words(one.metric, found.units[one.metric]) for one in shown)
    caption = "How far each metric moved and how much its spread changed from run A to run B"
    if len(shown) < len(moved):
        caption += f"; the {len(shown)} of {len(moved)} metrics with the largest changes"
    if far:
        values = (
            f"{words(one.metric, found.units[one.metric])} {number(one.shift_in_sigma.value, 3)} σ" for one in far
        )
        caption += f". Shifts beyond the axis, not drawn: {', '.join(values)}"
    shifts = [UNKNOWN if one in far else one.shift_in_sigma for one in shown]
    shifted, spread = (np.array([getattr(one, p) <= found.alpha for one in shown], dtype=bool)
                       for p in ("shift_adjusted", "spread_adjusted"))  # fmt: skip
    ratios, interval = [one.ratio for one in shown], percent(found.confidence)
    plots = (
        change_panel("Shift [σ of run A]", names, _ends(shifts), shifted, 0.0, interval),
        change_panel("Spread, run B over run A", names, _ends(ratios), spread, 1.0, interval),
    )
    return FigureBlock(f"{caption}.", Drawing("Changes from run A to run B", plots), "half")


def _reach(shifts: list[float]) -> float:
    """The largest shift that the axis holds: of those that are far beyond most others, none would be read off."""
    known = np.sort([one for one in shifts if np.isfinite(one)])
    return max(WIDEST * float(np.quantile(known, 0.5, method="lower")), FEW_SIGMA) if known.size else FEW_SIGMA


def _ends(estimates: list[Estimate]) -> np.ndarray:
    """float64[n, 3]: values and both ends of their intervals."""
    return np.array([(one.value, one.lower, one.upper) for one in estimates], dtype=np.float64).reshape(-1, 3)


def _metric_table(found: Comparison, moved: list[MetricChange]) -> Table:
    columns = (
        Column("Metric", "text", 2.6),
        Column("Mean A", "number", 1.4),
        Column("Mean B", "number", 1.4),
        Column("Shift [σ]", "number", 1.6),
        Column("Adjusted p", "number", 1.3),
        Column("Spread B/A", "number", 1.6),
        Column("Adjusted p", "number", 1.3),
    )
    note = (
        f"The largest change first. Small: the {percent(found.confidence)} interval of the quantity that the test is "
        "of; cases used of cases flown. σ: standard deviation of run A."
    )
    return Table("Metrics of both runs", columns, tuple(_metric_row(found, one) for one in moved), note)


def _metric_row(found: Comparison, one: MetricChange) -> tuple[Cell, ...]:
    unit = found.units[one.metric]
    used = " and ".join(f"{count(k)} / {count(n)}" for k, n in zip(one.n_used, one.n_tried, strict=True))
    if one.differing is not None:
        used = f"{count(one.differing)} of {count(one.n_used[0])} pairs differ"
        lost = one.n_tried[0] - one.n_used[0]
        used += f", {count(lost)} without a number" if lost else ""
    return (
        Cell(with_unit(words(one.metric, unit), f"[{unit}]" if unit else ""), small=used),
        *(_number(value, one.deviation[0]) for value in one.mean),
        _estimate(one.shift_in_sigma),
        _p(one.shift_adjusted, found.alpha),
        _estimate(one.ratio),
        _p(one.spread_adjusted, found.alpha),
    )


def _number(value: float, scale: float) -> Cell:
    return Cell(number(value, scale=scale), value) if np.isfinite(value) else Cell("–")


def _estimate(one: Estimate) -> Cell:
    if not finite(one):
        return Cell("–")
    ends = f"[{number(one.lower, 3)}, {number(one.upper, 3)}]"
    return Cell(number(one.value, 3), one.value, ends)


def _p(value: float, alpha: float) -> Cell:
    if not np.isfinite(value):
        return Cell("no test")
    text = number(value, 2) if value >= LEAST_P else f"< {number(LEAST_P, 2)}"
    return Cell(text, value, tone="bad" if value <= alpha else "")


# ---- shares and requirements


def _share_table(found: Comparison) -> Table:
    columns = (
        Column("Cases", "text", 2.0),
        Column("Run A", "number", 1.5),
        Column("Run B", "number", 1.5),
        Column("Difference", "number", 2.2),
        Column("Adjusted p", "number", 1.2),
    )
    note = "Requirements are counted by the limits of run B in both runs; a case without a number is outside."
    return Table(
        "Fractions of the cases in both runs",
        columns,
        tuple(_share_row(one, found.alpha) for one in found.shares),
        note,
    )


def _share_row(one: ShareChange, alpha: float) -> tuple[Cell, ...]:
    runs = [
        Cell(percent(k / n) if n else "–", k / n if n else None, f"{count(k)} / {count(n)}")
        for k, n in zip(one.counted, one.tried, strict=True)
    ]
    pairs = f"{count(one.lost)} lost, {count(one.gained or 0)} gained" if one.lost is not None else ""
    return Cell(one.name, small=pairs), *runs, _estimate(one.difference), _p(one.adjusted, alpha)


def _verdict_table(found: Comparison) -> Table | None:
    if not found.verdicts:
        return None
    columns = (Column("Requirement", "text", 2.0), Column("Run A", "text", 1.6), Column("Run B", "text", 1.6),
               Column("Change", "text", 3.4))  # fmt: skip
    rows = tuple(
        (
            Cell(one.name),
            Cell(one.before or "not required"),
            Cell(one.after or "not required", tone=_tone(one)),
            Cell(one.words, small=one.inside_words(count)),
        )
        for one in found.verdicts
    )
    return Table("Verdicts, each by its own run’s requirement", columns, rows)


def _tone(one: VerdictChange) -> str:
    if one.worse:
        return "bad"
    return "good" if one.after == "pass" else ""


# ---- code and campaign


def _difference_block(what: str, differences: tuple[Difference, ...]) -> Table | str:
    if not differences:
        return f"{what}: the same in both runs."
    columns = (Column("What", "text", 1.6), Column("Run A", "code", 2.4), Column("Run B", "code", 2.4))
    rows = tuple((Cell(one.what), Cell(one.before or "–"), Cell(one.after or "–")) for one in differences)
    return Table(f"{what}: what is not the same", columns, rows)


def _campaign_blocks(found: Comparison) -> Iterator[Table | str]:
    yield _difference_block("Campaign", found.campaign)
    if found.diff:
        rows = tuple((Cell(line[:1]), Cell(line[1:])) for line in found.diff if not line.startswith("@@"))
        columns = (Column("", "code", 0.3), Column("Line of campaign.toml", "code", 6.0))
        note = "−: a line of run A alone; +: a line of run B alone; others are in both."
        yield Table("The two campaign files", columns, rows, note)
