"""The report of a rare event: how probable it is, how far that can be trusted, and what the failures look like."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from mc_engine.rare_event_folder import RareEventRecord
from reports.contents import blocks
from reports.document import Block, Card, Cell, Column, Document, FigureBlock, Section, Table, Terms, Text, numbered
from reports.figures.tails import Tail
from reports.numbers import SPACE, axis_label, count, exact, number, percent, with_unit
from reports.provenance import git_text

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


def _failures(record: RareEventRecord) -> Iterator[Table | str | None]:
    result = record.result
    yield (
        f"{count(result['failed'])} of {count(result['cases'])} cases failed"
        + (f", {count(result['no_number'])} of them without a number" if result["no_number"] else "")
        + ". All are in cases.parquet, with the level and the weight of each; the weights of those that "
        "failed add up to the probability."
    )
    yield _input_table(result) if result["inputs"] else None


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
    for one in sorted(result["inputs"], key=lambda one: -abs(one["likeliest_sigma"])):
        label = Cell(axis_label(one["name"], one["unit"]), small=one["description"])
        cells = [Cell(number(one[key], 3), one[key]) for key in ("mean_sigma", "spread_sigma")]
        for what in ("likeliest", "across")[: 1 + across]:
            sigma = one[f"{what}_sigma"]
            cells.append(Cell(number(one[what], 5), one[what], small=f"{number(sigma, 3)}{SPACE}σ"))
        rows.append((label, *cells))
    note = "Farthest from its middle first. Mean and spread are over the failed cases by weight."
    return Table("Failed cases by input", tuple(columns), tuple(rows), note)


def _levels(result: dict[str, Any]) -> tuple[Block, ...]:
    unit, shown = result["metric"]["unit"], [one for one in result["levels"] if one["margin"] is not None]
    found: list[Block] = [_level_table(result)]
    if shown and result["probability"] and result["method"] != "plain":
        drawing = Tail(
            axis_label("margin", unit),
            np.array([one["margin"] for one in shown]),
            np.array([one["probability"] for one in shown]),
            (result["probability"], result["lower"], result["upper"]),
        )
        found.append(FigureBlock("Probability over the margin to the limit, level by level", drawing))
    chains = result["method"] == "subset"
    return (Text((_level_words(chains),)), *found) if result["method"] != "plain" else tuple(found)


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
