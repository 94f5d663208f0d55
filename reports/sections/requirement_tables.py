"""The tables of requirements: what is required, what the cases show, and how much the verdicts can be wrong."""

from collections.abc import Iterator

import numpy as np

from mc_engine.statistics import Verdict
from mc_engine.statistics.worst import Limits
from reports.document.blocks import Cell, Column, FigureBlock, Table
from reports.figures.rows import margin_figure
from reports.run.flown import Flown
from reports.sections.tables import TONES, limit_text
from reports.text.numbers import SPACE, beside_limit, count, given_percent, number, percent, with_unit
from reports.text.source_places import of_source


def requirement_blocks(flown: Flown) -> Iterator[FigureBlock | Table | str | None]:
    """The verification matrix, the figure of all margins, and the risks of the verdicts."""
    if not flown.verdicts:
        yield "The campaign file sets no requirement; [requirement.NAME] with a metric and a limit adds one."
        return
    yield requirement_table(flown)
    yield margin_block(flown)
    yield risk_table(flown)


def margin_block(flown: Flown) -> FigureBlock | None:
    """Margins of all requirements on one axis; None where no case has a number."""
    names, margins, tones, left_out = [], [], [], []
    for verdict in flown.own.verdicts:
        limits = verdict.limits
        if not _has_width(limits):
            left_out.append(verdict.name)
            continue
        worst = limits.margins(flown.every.worst(verdict.metric, 1, limits)[verdict.metric].to_numpy(dtype=np.float64))
        demonstrated = None if verdict.margin is None else verdict.margin / limits.reach
        if worst.size:
            names.append(verdict.name)
            margins.append((demonstrated, float(worst[0])))
            tones.append(TONES[verdict.outcome])
    if not names:
        return None
    return FigureBlock(
        "Margins of the requirements, relative to the size of the limit, or to half the distance between two limits: "
        "midway between them is 100 %. Margins beyond 100 % are drawn at the edge."
        + " The worst case is one with a number; cases without one are outside, and not drawn."
        * any(verdict.no_number for verdict in flown.own.verdicts)
        + f" Not drawn, the limit is 0: {', '.join(left_out)}." * bool(left_out),
        margin_figure(names, np.array(margins, dtype=np.float64), tones),
    )


def _has_width(limits: Limits) -> bool:
    """Whether margins can be given relative to the limits: not to a single one of 0."""
    return any(limits)


def requirement_table(flown: Flown) -> Table:
    """The verification matrix: every requirement with what is demonstrated, its margin and verdict; all at once.

    Of a design without probabilities, which demonstrates nothing, the fraction of its cases inside the limit.
    """
    shown = (
        Column("Requirement", "text"),
        Column("Limit", "text"),
        Column("Demonstrated", "text") if flown.random else None,
        Column("Margin", "number") if flown.random else None,
        Column("Inside / tried", "number"),
        Column("Fraction inside" if flown.random else "Fraction of these cases", "number"),
        Column("Verdict", "text"),
    )
    columns = tuple(column for column in shown if column is not None)
    records = flown.manifest.get("requirements", [])
    sources = [str(record.get("source") or "") for record in records]
    rows = [_requirement_row(flown, *pair) for pair in zip(flown.verdicts, sources, strict=True)]
    note = (
        "Margin: from the demonstrated bound (tolerance limit) to the nearest limit; in brackets, relative to the "
        "size of the limit, or to half the distance between two. Of two limits, the demonstrated bounds are both as "
        "far inside, or outside, as the margin. Bounds and margins are rounded to the unfavourable side. "
        f"Fraction inside: of the cases tried, in brackets {_bounds_named(flown)}. "
        if flown.random
        else "The cases were chosen, not drawn at random: a fraction of them is no probability, demonstrated or not. "
    )
    note += "A failed case, or one whose metric is not a number, counts as outside."
    if flown.joint is not None:
        rows.append(_requirement_row(flown, flown.joint, ""))
        note += " All at once: cases inside every limit; required is 100 % less what each requirement may miss."
        note += (
            " It passes where that is demonstrated and every requirement passes, and fails where one of them fails "
            "with confidence shared (next table)."
        ) * flown.random
    elif len(rows) > 1:
        note += (
            " There is no verdict on all at once: what the requirements may miss adds up to 100 % or more, so that no "
            "probability of meeting all of them follows."
        )
    kept = [tuple(cell for cell, column in zip(row, shown, strict=True) if column is not None) for row in rows]
    return Table("Verification matrix", columns, tuple(kept), note)


def _bounds_named(flown: Flown) -> str:
    if not flown.looked:
        return "the Clopper–Pearson bounds on the probability, each holding with the confidence required"
    return (
        "bounds on the probability that hold, each with the confidence required, at every number of cases at once "
        "(Robbins’ mixture): "
        "the number of cases was not fixed in advance"
    )


def _requirement_row(flown: Flown, verdict: Verdict, source: str) -> tuple[Cell, ...]:
    unit = flown.unit(verdict.metric)
    lost = f"{count(verdict.no_number)} without a number" if verdict.no_number else ""
    bounds = f"[{percent(verdict.lower)}, {percent(verdict.upper, up=True)}]" if verdict.lower is not None else ""
    needed = f"needs {count(verdict.needed)} cases" if verdict.needed else ""
    asked = f"for {given_percent(verdict.share)} with {given_percent(verdict.confidence)} confidence"
    what = "; ".join(filter(None, (flown.words(verdict.metric), of_source(source))))
    return (
        Cell(verdict.name, small=what),
        Cell(limit_text(verdict, unit) if verdict.metric else "all limits", small=asked),
        Cell(demonstrated_text(verdict, unit)),
        _margin_cell(verdict, unit),
        Cell(f"{count(verdict.passed)} / {count(verdict.tried)}", verdict.passed, lost),
        Cell(percent(verdict.estimate), verdict.estimate, bounds),
        Cell(verdict.outcome, small=needed, tone=TONES[verdict.outcome]),
    )


def _margin_cell(verdict: Verdict, unit: str) -> Cell:
    if verdict.margin is None:
        return Cell("–")
    limits = verdict.limits
    share = f"({number(100.0 * verdict.margin / limits.reach, 3, up=False)}{SPACE}%)" if _has_width(limits) else ""
    return Cell(with_unit(number(verdict.margin, 3, up=False), unit), verdict.margin, share)


def demonstrated_text(verdict: Verdict, unit: str) -> str:
    """The demonstrated bound, or both of a requirement with two limits, in digits that show the margin.

    Rounded outward: the range that is printed holds the one that was demonstrated.
    """
    if verdict.enclosed is not None:
        low, high = verdict.enclosed
        fine = 0.01 * (high - low)  # the ends to four digits of the width
        if fine < 1e-7 * max(abs(low), abs(high)):
            return f"{beside_limit(low, fine, up=False)} to {with_unit(beside_limit(high, fine, up=True), unit)}"
        return f"{number(low, scale=fine, up=False)} to {with_unit(number(high, scale=fine, up=True), unit)}"
    if verdict.demonstrated is None:
        return "–"
    return with_unit(beside_limit(verdict.demonstrated, verdict.margin, up=verdict.at_least is None), unit)


def risk_table(flown: Flown) -> Table | None:
    """How much the verdicts can be wrong, one by one and together; None without a random sample."""
    judged = [*flown.verdicts, *([flown.joint] if flown.joint is not None else [])]
    if not flown.random or not flown.n_tried or not judged:
        return None
    columns: tuple[Column, ...] = (
        Column("Requirement", "text"),
        Column("Outside", "number"),
        Column("Allowed outside", "number"),
        Column("Consumer’s risk", "number"),
        Column("Producer’s risk", "number"),
        Column("With confidence shared", "text"),
    )
    rows = tuple(_risk_row(verdict, len(judged)) for verdict in judged)
    of = "of the one case" if flown.n_tried == 1 else f"of these {count(flown.n_tried)} cases"
    note = f"Allowed outside: the most {of} with which the requirement still passes"
    note += "; all at once, if every requirement passes. " if flown.joint is not None else ". "
    if flown.looked:
        note += (
            "The number of cases was not fixed in advance: the consumer’s risk is then below the figure given, "
            "whatever the stopping rule, and the producer’s risk has no figure. "
        )
    if len(flown.verdicts) > 1:
        note += (
            "With confidence shared: the verdict if all verdicts together are to hold with their confidence, each "
            f"taking 1/{len(judged)} of the error allowed (Bonferroni). The verification matrix needs no such sharing: "
            "all requirements are met where each is, by a test with its full confidence (Berger 1982)."
        )
    else:
        columns, rows = columns[:-1], tuple(row[:-1] for row in rows)
    return Table("Risks of the verdicts", columns, rows, note)


def _risk_row(verdict: Verdict, among: int) -> tuple[Cell, ...]:
    outside = verdict.tried - verdict.passed
    allowed = (
        Cell("too few cases", -1.0) if verdict.accepted is None else Cell(count(verdict.accepted), verdict.accepted)
    )
    if verdict.looked:
        consumer = Cell(f"below {percent(1.0 - verdict.confidence, up=True)}", 1.0 - verdict.confidence)
    else:
        consumer = Cell(percent(verdict.consumer_risk, up=True), verdict.consumer_risk)
    shared = f"with {percent(1.0 - (1.0 - verdict.confidence) / among)} each"
    return (
        Cell(verdict.name, small=verdict.metric),
        Cell(count(outside), outside),
        allowed,
        consumer,
        Cell(percent(verdict.producer_risk, up=True), verdict.producer_risk),
        Cell(verdict.shared_outcome, small=shared),
    )
