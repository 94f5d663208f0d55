"""The report of a rare event: how probable it is, how far that can be trusted, and what the failures look like."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from mc_engine.rare_event_folder import RareEventRecord
from reports.contents import blocks
from reports.document import Block, Card, Cell, Column, Document, FigureBlock, Section, Table, Terms, Text, numbered
from reports.figures.marks import Axis, Limit, Line, Mark, Panels, Plot, Points, nominal_ring
from reports.figures.palette import BLUE, INK, PAPER, SKY, VERMILION
from reports.numbers import SPACE, axis_label, count, exact, named, number, percent, with_unit, words
from reports.provenance import git_text

MOST_POINTS = 2000  # of a kind
METHODS = {
    "subset": "subset simulation",
    "cross-entropy": "importance sampling by cross entropy",
    "plain": "plain cases, counted",
}
GLOSSARY = Terms(
    (
        (
            "margin",
            "How far the metric is inside its limit, in its own unit; the nearer one of two limits. A case that did "
            "not complete, or has no number, has failed.",
        ),
        (
            "subset simulation",
            "Cases are led to the failures in levels. The tenth that is nearest to the limit starts chains of cases "
            "that may step anywhere but back; the probability is the product of the fractions. Several runs are made "
            "in parallel, and the interval comes from their scatter. Au & Beck (2001); Papaioannou and others (2015).",
        ),
        (
            "cross entropy",
            "Cases are drawn where failures are, from a density found in levels, and each counts for as much as the "
            "dispersions give it. The interval is that of the last, fresh cases. Papaioannou, Geyer & Straub (2019).",
        ),
        (
            "noise in the flight",
            "Where the model draws noise, the probability is over inputs and noise together, as with plain cases: "
            "chains draw the noise of a flight anew in half of their steps and keep it in the others.",
        ),
        (
            "sigma",
            "An input’s distance from its median, as the normal deviation that is as improbable; for a normal input "
            "its standard deviation.",
        ),
        (
            "likeliest failed case",
            "Of all failed cases the one nearest to the middle of all dispersions together: the design point. Across: "
            "the nearest one on the other side.",
        ),
        (
            "plain cases",
            "How many independent draws from the dispersions would have the same standard error.",
        ),
    )
)


def build_rare_event(record: RareEventRecord, name: str) -> Document:
    """The report of an estimate; `name` is its directory's name."""
    campaign, result = record.record["campaign"], record.result
    sections = (
        Section("failures", "Failures", blocks(_failures(record))),
        Section("levels", "How it was reached", _levels(result)),
        Section("inputs", "Dispersed inputs", (_inputs(record.record["inputs"]),)),
        Section("provenance", "Provenance", (_provenance(record, name),)),
        Section("reading", "Glossary", (GLOSSARY,)),
    )
    return numbered(
        Document(
            kind="Rare-event report",
            title=str(campaign.get("title") or name),
            subtitle=_sentence(result),
            created=str(record.record.get("created_utc", "")),
            facts=_facts(record),
            verdicts=(_verdict(result),),
            costs=tuple(_costs(result)),
            warnings=tuple(result["remarks"]),
            sections=sections,
        )
    )


def _sentence(result: dict[str, Any]) -> str:
    limits = _limits(result)
    if not result["probability"]:
        return f"No case failed: the limit {limits} is not met with a probability below {number(result['upper'], 4)}."
    return f"The limit {limits} is not met with a probability of {number(result['probability'], 4)}."


def _limits(result: dict[str, Any]) -> str:
    one, unit = result["requirement"], result["metric"]["unit"]
    found = [("at least", one["at_least"]), ("at most", one["at_most"])]
    texts = [f"{word} {with_unit(exact(limit), unit)}" for word, limit in found if limit is not None]
    return f"{one['metric']} {' and '.join(texts)}"


def _facts(record: RareEventRecord) -> tuple[tuple[str, str], ...]:
    result, campaign = record.result, record.record["campaign"]
    return (
        ("Campaign", str(campaign["name"])),
        ("Model", str(record.record["model"]["title"])),
        ("Requirement", str(result["requirement"]["name"])),
        ("Method", f"{METHODS[result['method']]}, seed {campaign['seed']}"),
        ("Cases", f"{count(result['cases'])} flown, {count(result['failed'])} failed"),
        ("Run", str(record.record["created_utc"])[:16].replace("T", " ") + " UTC"),
    )


def _verdict(result: dict[str, Any]) -> Card:
    allowed = 1.0 - result["requirement"]["share"]
    source = f" Source: {result['requirement']['source']}." if result["requirement"]["source"] else ""
    interval = f"{percent(result['confidence'])} interval {number(result['lower'], 4)} to {number(result['upper'], 4)}"
    if result["upper"] <= allowed:
        answer, tone = "met", "good"
    elif result["lower"] > allowed:
        answer, tone = "not met", "bad"
    else:
        answer, tone = "open", "open"
    return Card(
        label=result["requirement"]["name"],
        answer=answer,
        detail=f"Probability of failure {number(result['probability'], 4)}, {interval}; allowed: "
        f"{number(allowed, 4)}.{source}",
        tone=tone,
    )


def _costs(result: dict[str, Any]) -> Iterator[Card]:
    error = result["relative_error"]
    yield Card(
        label="standard error",
        answer="none" if error is None else percent(error, 1),
        detail="of the probability; the interval reaches a fifth further than this error asks for."
        if result["method"] != "plain"
        else "of the probability; the interval is the exact one of a count.",
    )
    plain = result["plain_cases"]
    if plain is not None and result["method"] != "plain":
        yield Card(
            label="cases",
            answer=count(result["cases"]),
            detail=f"{number(plain, 3)} independent cases would give the same standard error: "
            f"{number(plain / result['cases'], 3)} times as many.",
        )


def _failures(record: RareEventRecord) -> Iterator[FigureBlock | Table | str | None]:
    result = record.result
    yield (
        f"{count(result['failed'])} of {count(result['cases'])} cases failed"
        + (f", {count(result['no_number'])} of them without a number" if result["no_number"] else "")
        + ". All are in cases.parquet, with the level and the weight of each; the weights of those that "
        "failed add up to the probability."
    )
    yield _failure_figure(record)
    yield _input_table(result) if result["inputs"] else None


def _main_inputs(result: dict[str, Any]) -> list[dict[str, Any]]:
    """The inputs, the one whose failed cases lie farthest from its middle first."""
    return sorted(result["inputs"], key=lambda one: -abs(one["likeliest_sigma"]))


def _failure_figure(record: RareEventRecord) -> FigureBlock | None:
    """The failed cases over their two main inputs, with the cases drawn from the dispersions beneath."""
    cases, shown = record.cases, [one for one in _main_inputs(record.result) if one["name"] in record.cases][:2]
    if len(shown) < 2 or not record.result["failed"] or "failed" not in cases:
        return None
    failed = cases["failed"].to_numpy(dtype=bool)
    drawn = ~failed & (cases["level"].to_numpy() == 0)
    x, y = (cases[one["name"]].to_numpy(dtype=np.float64) for one in shown)
    marks: list[Mark] = []
    for rows, colour, sign, what in (
        (np.flatnonzero(drawn), SKY, "circle", "cases drawn from the dispersions, not failed"),
        (np.flatnonzero(failed), VERMILION, "diamond", "failed cases"),
    ):
        some = rows[np.unique(np.linspace(0, rows.size - 1, min(rows.size, MOST_POINTS)).astype(np.int64))]
        thinned = f", {count(some.size)} shown" if some.size < rows.size else ""
        key = f"{count(rows.size)} {what}{thinned}" if rows.size else ""
        marks.append(Points(x[some], y[some], colour, what, sign, 4.0, 0.6, cases=some, key=key))
    for what, colour in (("likeliest", INK), ("across", BLUE)):
        if shown[0].get(what) is not None:
            name = "likeliest failed case" if what == "likeliest" else "the likeliest across"
            marks.append(nominal_ring((shown[0][what], shown[1][what]), colour, name, PAPER))
    axes = (Axis(axis_label(named(words(one["name"], one["unit"]), one["description"]), one["unit"])) for one in shown)
    x_axis, y_axis = axes
    caption = (
        "Failed cases over the two inputs in which they lie farthest from the middle. Where the method explored, cases "
        "are denser than the dispersions would draw them; their weights tell how probable they are."
    )
    plot = Plot(tuple(marks), x_axis, y_axis, height=420.0)
    return FigureBlock(caption, Panels((plot,), form="Failed cases over two inputs"), "wide")


def _input_table(result: dict[str, Any]) -> Table:
    across = result["inputs"][0].get("across") is not None
    columns = [
        Column("Input", "name", 2.6),
        Column("Mean [σ]", "number", 1.0),
        Column("Spread [σ]", "number", 1.0),
        Column("Likeliest", "number", 1.5),
    ]
    columns += [Column("Across", "number", 1.5)] if across else []
    rows = []
    for one in _main_inputs(result):
        label = Cell(axis_label(one["name"], one["unit"]), small=one["description"])
        cells = [Cell(number(one[key], 3), one[key]) for key in ("mean_sigma", "spread_sigma")]
        for what in ("likeliest", "across")[: 1 + across]:
            sigma = one[f"{what}_sigma"]
            cells.append(Cell(number(one[what], 5), one[what], small=f"{number(sigma, 3)}{SPACE}σ"))
        rows.append((label, *cells))
    note = "Farthest from its middle first. Mean and spread are over the failed cases by weight."
    return Table("Failed cases by input", tuple(columns), tuple(rows), note)


def _levels(result: dict[str, Any]) -> tuple[Block, ...]:
    shown = [one for one in result["levels"] if one["margin"] is not None]
    found: list[Block] = [_level_table(result)]
    if shown and result["probability"] and result["method"] != "plain":
        found.append(FigureBlock("Probability over the margin to the limit, level by level", _tail(result, shown)))
    chains = result["method"] == "subset"
    return (Text((_level_words(chains),)), *found) if result["method"] != "plain" else tuple(found)


def _tail(result: dict[str, Any], shown: list[dict[str, Any]]) -> Panels:
    """The probability of each level over its margin, down to the limit."""
    margin, probability = (np.array([one[key] for one in shown]) for key in ("margin", "probability"))
    p, lower, upper = (np.array([result[key]]) for key in ("probability", "lower", "upper"))
    marks = (
        Limit(0.0, "x", INK, "limit", width=1.0),
        Line(margin, probability, BLUE, "levels", width=2.0, key="levels"),
        Points(margin, probability, BLUE, "levels", size=6.0),
        Points(np.zeros(1), p, VERMILION, "not met", size=8.0, y_ends=(lower, upper), key="not met, with its interval"),
    )
    x = Axis(axis_label("margin", result["metric"]["unit"]), reach=Axis().ends([margin, np.zeros(1)])[::-1])
    words = (
        f"The probability falls over {margin.size} levels as the margin falls to zero, where it is "
        f"{number(p[0], 4)}, interval {number(lower[0], 4)} to {number(upper[0], 4)}."
    )
    return Panels((Plot(marks, x, Axis("probability of being nearer", log=True), height=340.0),), words)


def _level_words(chains: bool) -> str:
    if chains:
        return (
            "Level 0 holds plain cases. Each further level explores what lies at or below its margin with chains; "
            "accepted is the fraction of their steps that did not lead back."
        )
    return (
        "Each level is drawn from the density fitted to the level before. Its margin is the median of the cases that "
        "the next density is fitted to; accepted is the effective fraction of these. The last level is the fresh cases "
        "that the estimate rests on."
    )


def _level_table(result: dict[str, Any]) -> Table:
    columns = (
        Column("Level", "number", 0.7),
        Column(axis_label("Margin", result["metric"]["unit"]), "number", 1.4),
        Column("Probability", "number", 1.3),
        Column("Runs", "number", 0.7),
        Column("Cases", "number", 1.0),
        Column("Accepted", "number", 1.0),
    )
    rows = [
        (
            Cell(str(k), k),
            Cell("all" if one["margin"] is None else number(one["margin"], 4), one["margin"]),
            Cell(number(one["probability"], 4), one["probability"]),
            Cell(str(one["runs"]), one["runs"]),
            Cell(count(one["cases"]), one["cases"]),
            Cell(percent(one["accepted"], 0), one["accepted"]),
        )
        for k, one in enumerate(result["levels"])
    ]
    return Table("Levels", columns, tuple(rows))


def _inputs(records: list[dict[str, Any]]) -> Table:
    columns = (Column("Input", "name", 2.4), Column("Distribution", "text", 2.6), Column("Source", "text", 3.0))
    rows = tuple(
        (
            Cell(axis_label(one["name"], one["unit"]), small=one["description"]),
            Cell(", ".join(text for text in (one["distribution"], one["bounds"]) if text)),
            Cell(one["source"] or "not stated"),
        )
        for one in records
    )
    return Table("Dispersed inputs", columns, rows)


def _provenance(record: RareEventRecord, name: str) -> Table:
    manifest, asked = record.record, record.result["asked"]
    campaign, model, made = manifest["campaign"], manifest["model"], manifest.get("provenance", {})
    packages = made.get("packages", {})
    facts = [
        ("directory", name),
        ("started (UTC)", manifest.get("created_utc", "")),
        ("engine", manifest.get("engine", "")),
        ("configured", f"{asked['method']}, {asked['cases_per_level']} cases per level"),
        ("campaign", campaign["name"]),
        ("campaign digest", campaign["digest"]),
        ("model", campaign["model"]),
        ("model source digest", model["digest"]),
        ("published source", model["source"]),
        ("seed", campaign["seed"]),
        ("seed contract", manifest.get("seed_contract", "")),
        ("git", git_text(made.get("git"))),
        *((key, made.get(key, "")) for key in ("python", "platform", "cpu", "numba", "llvm")),
        ("packages", ", ".join(f"{package} {version}" for package, version in sorted(packages.items()))),
    ]
    rows = tuple((Cell(what), Cell(str(text))) for what, text in facts if str(text))
    return Table("Provenance of the estimate", (Column("What", "text", 1.6), Column("Value", "code", 4.0)), rows)
