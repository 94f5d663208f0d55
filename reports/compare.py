"""What `mc-engine compare A B --report FILE` writes: the comparison of two runs as a page or as a PDF."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mc_engine.comparison import CONFIDENCE, Comparison, VerdictChange
from mc_engine.durable_file import write_durably
from mc_engine.run_changes import Difference
from mc_engine.statistics.change_tests import Estimate, MetricChange, ShareChange, finite
from reports.contents import blocks
from reports.document import Card, Cell, Column, Document, FigureBlock, Section, Table, Terms, numbered
from reports.figures.changes import ChangeDrawing, ChangePanel
from reports.html import render_html
from reports.numbers import count, number, percent, with_unit, words
from reports.pdf import render_pdf

MOST_ROWS = 40  # of the figure
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
        ("shift", "Mean of run B less that of run A, also in standard deviations σ of run A."),
        ("spread", "Standard deviation of run B over that of run A."),
        (
            "tests",
            "Paired: Wilcoxon’s signed ranks of the differences, and of the distances to each run’s own median; "
            "McNemar’s exact test of a share. Unpaired: normal scores, Brown and Forsythe’s test, Fisher’s exact "
            "test. They hold for any shape of distribution; the sizes beside them are of means and standard "
            "deviations, so that with long tails the two may speak of different things.",
        ),
        ("intervals", f"They hold with {percent(CONFIDENCE)} each, one by one; they are not widened for their number."),
    )
)


def write_comparison(found: Comparison, path: Path) -> Path:
    """Write the comparison to `path`, a page if it ends in .html, else a PDF; the file appears whole or not at all."""
    document = build_comparison(found)
    content = render_html(document) if path.suffix == ".html" else render_pdf(document)
    write_durably(path, content)
    return path


def build_comparison(found: Comparison) -> Document:
    """The comparison as a document: what changed in the results, then what was changed in code and campaign."""
    sections = (
        Section("metrics", "Metrics", blocks(_metric_blocks(found))),
        Section("shares", "Shares and requirements", blocks([_share_table(found), _verdict_table(found)])),
        Section("code", "What changed in the code", blocks([_difference_block("Code", found.code)])),
        Section("campaign", "What changed in the campaign", blocks(_campaign_blocks(found))),
        Section("reading", "How to read this report", (GLOSSARY,)),
    )
    return numbered(
        Document(
            kind="Comparison of two runs",
            question="What changed?",
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
    what = "Something changed from run A to run B" if found.changed else "No significant change from run A to run B"
    return f"{what} ({chance})."


def _facts(found: Comparison) -> tuple[tuple[str, str], ...]:
    reason = found.pairing.reason
    facts = []
    for letter, name, cases, ok, created in zip("AB", found.names, found.cases, found.ok, found.created, strict=True):
        flown = f"{count(cases)} cases, {count(ok)} to their end"
        facts.append((f"Run {letter}", f"{name}: {flown}, {created[:16].replace('T', ' ')}".rstrip(", ")))
    return (*facts, ("Cases", f"{reason[:1].upper()}{reason[1:]}"))


def _cards(found: Comparison) -> Iterator[Card]:
    total = len(found.metrics)
    for label, moved, what in (("Shift", found.shifted, "mean"), ("Spread", found.spread, "spread")):
        names = ", ".join(words(one.metric, found.units[one.metric]) for one in moved[:4])
        more = f" and {len(moved) - 4} more" if len(moved) > 4 else ""
        detail = (
            f"of {count(total)} metrics: {names}{more}" if moved else f"the {what} of none of {count(total)} metrics"
        )
        yield Card(label, f"{count(len(moved))} changed" if moved else "no change", detail, "bad" if moved else "good")
    shares = found.moved_shares
    detail = ", ".join(one.name for one in shares) or f"none of {count(len(found.shares))} shares of cases"
    yield Card("Shares", f"{len(shares)} changed" if shares else "no change", detail, "bad" if shares else "good")
    worse = [one.name for one in found.verdicts if one.worse]
    if found.verdicts:
        tone = ("bad" if found.pairing.paired else "open") if worse else "good"
        detail = ", ".join(worse) or f"none of {count(len(found.verdicts))}"
        yield Card("Requirements", f"{len(worse)} worse" if worse else "none worse", detail, tone)


def _warnings(found: Comparison) -> tuple[str, ...]:
    sentences = [f"Not compared: {sentence}." for sentence in found.left_out]
    if not found.pairing.paired and any(one.worse for one in found.verdicts):
        sentences.append("The runs flew other cases: chance alone may have turned the verdict of a requirement.")
    return tuple(sentences)


# ---- metrics


def _metric_blocks(found: Comparison) -> Iterator[FigureBlock | Table | str]:
    if not found.metrics:
        yield "The runs share no metric."
        return
    moved = [one for one in found.metrics if not one.same]
    drawn = [one for one in moved if finite(one.shift_in_sigma) or finite(one.ratio)]
    if drawn:
        yield _figure(found, drawn)
    if moved:
        yield _metric_table(found, moved)
    same = [one.metric for one in found.metrics if one.same]
    if same:
        yield f"The same in both runs: {', '.join(same)}."


def _figure(found: Comparison, moved: list[MetricChange]) -> FigureBlock:
    evidence = [min(p for p in (one.shift_adjusted, one.spread_adjusted, np.inf) if p == p) for one in moved]
    shown = [moved[k] for k in sorted(np.argsort(evidence, kind="stable")[:MOST_ROWS])]
    panels = (
        _panel("Shift [σ of run A]", [one.shift_in_sigma for one in shown],
               [one.shift_adjusted <= found.alpha for one in shown], 0.0),
        _panel("Spread, run B over run A", [one.ratio for one in shown],
               [one.spread_adjusted <= found.alpha for one in shown], 1.0),
    )  # fmt: skip
    names = tuple(words(one.metric, found.units[one.metric]) for one in shown)
    caption = "How far each metric moved and how much its spread changed from run A to run B"
    if len(shown) < len(moved):
        caption += f"; the {len(shown)} of {len(moved)} metrics with the strongest evidence"
    return FigureBlock(f"{caption}.", ChangeDrawing(names, panels, percent(CONFIDENCE)), "half")


def _panel(title: str, estimates: list[Estimate], significant: list[bool], none: float) -> ChangePanel:
    value, lower, upper = (
        np.array([getattr(one, end) for one in estimates], dtype=np.float64) for end in ("value", "lower", "upper")
    )
    return ChangePanel(title, value, lower, upper, np.array(significant, dtype=bool), none)


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
    note = f"Small: the {percent(CONFIDENCE)} interval; used of tried cases. σ: standard deviation of run A."
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
    return Cell(number(value, 2), value, tone="bad" if value <= alpha else "")


# ---- shares and requirements


def _share_table(found: Comparison) -> Table:
    columns = (
        Column("Cases", "text", 2.0),
        Column("Run A", "number", 1.5),
        Column("Run B", "number", 1.5),
        Column("Difference of shares", "number", 2.2),
        Column("Adjusted p", "number", 1.2),
    )
    note = "Requirements are counted by the limits of run B in both runs; a case without a number is outside."
    return Table(
        "Shares of the cases in both runs", columns, tuple(_share_row(one, found.alpha) for one in found.shares), note
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
    columns = (Column("Requirement", "text", 2.0), Column("Verdict of run A", "text", 2.0),
               Column("Verdict of run B", "text", 2.0))  # fmt: skip
    rows = tuple(
        (Cell(one.name), Cell(one.before or "not there"), Cell(one.after or "not there", tone=_tone(one)))
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
        note = "−: a line of run A alone; +: a line of run B alone; others stand in both."
        yield Table("The two campaign files", columns, rows, note)
