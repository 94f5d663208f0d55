"""The report of a rare event: its probability, the confidence in it, and the inputs of the failures."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from mc_engine.studies.rare_event_folder import (
    RareEventRecord,
    accepted_percent,
    plain_cases,
    printed_interval,
    standing,
)
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
    Text,
    as_blocks,
    numbered,
)
from reports.drawing.marks import Axis, Drawing, Limit, Line, Plot, Points, intervals, nominal_ring
from reports.drawing.palette import BLUE, INK, PURPLE, VERMILION
from reports.figures.clouds import MOST, case_scatter
from reports.sections.figure_blocks import thinned_by_outcome
from reports.sections.provenance import origin_table
from reports.sections.scenario import note_paragraphs
from reports.sections.tables import dispersed_table
from reports.text.numbers import (
    SPACE,
    axis_label,
    count,
    exact,
    given_percent,
    named,
    number,
    percent,
    same_lengths,
    spelled,
    with_unit,
    words,
)
from reports.text.source_places import of_source

CLASSES = ("drawn from the dispersions, not failed", "failed")
DESIGN_POINTS = (
    ("likeliest", "likeliest failed case", INK),
    ("across", "likeliest failed case on the other side", PURPLE),
)
METHODS = {
    "subset": "subset simulation",
    "cross-entropy": "importance sampling by cross entropy",
    "plain": "plain Monte Carlo",
}
TONES = {"met": "good", "not met": "bad", "open": "open"}
GLOSSARY = Terms(
    (
        (
            "margin",
            "Distance of the metric inside its limit, in its own unit; with two limits, to the nearer one. A case "
            "outside a limit is called failed here, as is one that did not complete or has no number.",
        ),
        (
            "subset simulation",
            "In each level, the tenth of the cases with the smallest margins starts Markov chains, which give the "
            "cases of the next level. The probability is the product of the fractions. Several runs are made, and the "
            "interval comes from their scatter. Au & Beck (2001); Papaioannou and others (2015).",
        ),
        (
            "cross entropy",
            "Importance sampling: cases are drawn where failures are, from a density fitted in levels, and weighted "
            "by the density of the dispersions divided by this density. The interval is that of the last level. "
            "Papaioannou, Geyer & Straub (2019).",
        ),
        (
            "noise in flight",
            "If the model draws noise, the probability is over inputs and noise together: chains draw the noise of a "
            "case anew in half of their steps and keep it in the others.",
        ),
        (
            "sigma",
            "Distance of an input from its median, in standard deviations of a normal distribution with the same "
            "probability; for a normal input its own standard deviation.",
        ),
        (
            "likeliest failed case",
            "The design point: of all failed cases the one nearest to the medians of all dispersions together. "
            "Across: the nearest failed case on the opposite side.",
        ),
    )
)


def build_rare_event(record: RareEventRecord, name: str) -> Document:
    """The report of an estimate; `name` is its directory's name."""
    campaign, result = record.record["campaign"], record.result
    inputs = dispersed_table(record.record["inputs"], "Dispersed inputs")
    sections = (
        Section("failures", "Failures", as_blocks(_failures(record))),
        Section("levels", "Levels of the estimate", _levels(result)),
        Section("inputs", "Dispersed inputs", as_blocks([*note_paragraphs(campaign), inputs])),
        Section("provenance", "Provenance", (origin_table("estimate", name, record.record, _asked(record)),)),
        Section("reading", "Glossary", (GLOSSARY,)),
    )
    return Document(
        kind="Rare-event report",
        title=str(campaign.get("title") or name),
        subtitle=_estimate_sentence(result),
        created=str(record.record.get("created_utc", "")),
        facts=_estimate_facts(record),
        verdicts=(_verdict_card(result),),
        costs=tuple(_cost_cards(result)),
        warnings=tuple(map(spelled, result["remarks"])),
        sections=numbered(sections),
    )


def _estimate_sentence(result: dict[str, Any]) -> str:
    event = f"P({_event(result)})"
    if not result["probability"]:
        return f"No case failed: {event} < {_bound(result)}. Requirement {standing(result)}."
    return f"{event} = {number(result['probability'], 3)} ({_interval(result)}). Requirement {standing(result)}."


def _event(result: dict[str, Any]) -> str:
    """What the probability is of: the metric beyond a limit."""
    requirement, unit = result["requirement"], result["metric"]["unit"]
    name = words(requirement["metric"], unit)
    limits = [("<", requirement["at_least"]), (">", requirement["at_most"])]
    return " or ".join(f"{name} {sign} {with_unit(exact(limit), unit)}" for sign, limit in limits if limit is not None)


def _interval(result: dict[str, Any]) -> str:
    lower, upper = printed_interval(result)
    return f"{given_percent(result['confidence'])} confidence interval {number(lower, 3)} to {number(upper, 3)}"


def _bound(result: dict[str, Any]) -> str:
    """What the probability is below where no case failed."""
    end = f"upper end of the {given_percent(result['confidence'])} confidence interval"
    return f"{number(printed_interval(result)[1], 3)} ({end})"


def _estimate_facts(record: RareEventRecord) -> tuple[tuple[str, str], ...]:
    result, campaign = record.result, record.record["campaign"]
    return (
        ("Campaign", str(campaign["name"])),
        ("Model", str(record.record["model"]["title"])),
        ("Requirement", str(result["requirement"]["name"])),
        ("Method", f"{METHODS[result['method']]}, seed {campaign['seed']}"),
        ("Cases", f"{count(result['cases'])} flown, {count(result['failed'])} failed"),
        ("Run", str(record.record["created_utc"])[:16].replace("T", " ") + " UTC"),
    )


def _verdict_card(result: dict[str, Any]) -> Card:
    allowed = 1.0 - result["requirement"]["share"]
    source = f" Source: {of_source(result['requirement']['source'])}." if result["requirement"]["source"] else ""
    answer = standing(result)
    found = f"Probability of failure {number(result['probability'], 3)}, {_interval(result)}"
    if not result["probability"]:
        found = f"No case failed: probability of failure below {_bound(result)}"
    sure = given_percent(result["requirement"]["confidence"])
    detail = f"{found}; allowed: {number(allowed, 3)} with {sure} confidence.{source}"
    return Card(result["requirement"]["name"], answer, detail, TONES[answer])


def _cost_cards(result: dict[str, Any]) -> Iterator[Card]:
    interval = {
        "plain": "is Clopper and Pearson’s",
        "subset": "is a fifth wider than the scatter of the runs gives (log-normal, Student’s t)",
        "cross-entropy": "is a fifth wider than this error gives",
    }[result["method"]]
    if (error := result["relative_error"]) is not None:
        yield Card("standard error", percent(error, 1), f"of the probability; the interval {interval}.")
    plain = result["plain_cases"]
    if plain is not None and result["method"] != "plain":
        yield Card(
            label="cases",
            answer=count(result["cases"]),
            detail=f"Plain Monte Carlo needs {count(round(plain_cases(result)))} for the same standard error, "
            f"{number(plain / result['cases'], 3)} times as many.",
        )


def _failures(record: RareEventRecord) -> Iterator[FigureBlock | Table | str | None]:
    result = record.result
    yield (
        f"{count(result['failed'])} of {count(result['cases'])} cases failed"
        + (f", {count(result['no_number'])} of them without a number" if result["no_number"] else "")
        + ". All cases are in cases.parquet, with the level and the weight of each"
        + ("; the weights of those that failed add up to the probability." if result["failed"] else ".")
    )
    yield _failure_figure(record)
    yield _input_table(result) if result["inputs"] else None


def _main_inputs(result: dict[str, Any]) -> list[dict[str, Any]]:
    """The inputs, the one whose failed cases lie farthest from its median first."""
    return sorted(result["inputs"], key=lambda entry: -abs(entry["likeliest_sigma"]))


def _failure_figure(record: RareEventRecord) -> FigureBlock | None:
    """The failed cases over their two main inputs, with the cases drawn from the dispersions beneath."""
    cases, shown = record.cases, [entry for entry in _main_inputs(record.result) if entry["name"] in record.cases][:2]
    if len(shown) < 2 or not record.result["failed"] or "failed" not in cases:
        return None
    member = cases["failed"].to_numpy(dtype=np.int8)
    counted = (member == 1) | (cases["level"].to_numpy() == 0)
    rows = thinned_by_outcome(np.flatnonzero(counted), member)
    x, y = (cases[item["name"]].to_numpy(dtype=np.float64) for item in shown)
    x_axis, y_axis = (
        Axis(axis_label(named(words(item["name"], item["unit"]), item["description"]), item["unit"])) for item in shown
    )
    drawing = case_scatter(
        Points(x[rows], y[rows], "", cases=rows),
        member[rows],
        [(what, int(np.count_nonzero(counted & (member == kind)))) for kind, what in enumerate(CLASSES)],
        (x_axis, y_axis),
        len(cases),
        lengths=same_lengths(*(item["unit"] for item in shown)),
        rings=[
            nominal_ring((shown[0][key], shown[1][key]), colour, name)
            for key, name, colour in DESIGN_POINTS
            if shown[0].get(key) is not None
        ],
        fewer=MOST,  # failed cases are not few here: larger, they would look like more than they are
        form="Failed cases over two inputs",
    )
    caption = "Failed cases over the two inputs in which they lie farthest from the median."
    if record.result["method"] != "plain":
        caption += " They are denser than the dispersions draw them; their weights give their probabilities."
    return FigureBlock(caption, drawing, "wide")


def _input_table(result: dict[str, Any]) -> Table:
    across = result["inputs"][0].get("across") is not None
    columns = [
        Column("Input", "name"),
        Column("Mean [σ]", "number"),
        Column("Spread [σ]", "number"),
        Column("Likeliest", "number"),
    ]
    columns += [Column("Across", "number")] if across else []
    rows = []
    for entry in _main_inputs(result):
        label = Cell(axis_label(entry["name"], entry["unit"]), small=entry["description"])
        cells = [Cell(number(entry[key], 3), entry[key]) for key in ("mean_sigma", "spread_sigma")]
        for what in ("likeliest", "across")[: 1 + across]:
            sigma = entry[f"{what}_sigma"]
            cells.append(Cell(number(entry[what], 5), entry[what], small=f"{number(sigma, 3)}{SPACE}σ"))
        rows.append((label, *cells))
    note = "Weighted mean and spread of the failed cases; the input farthest from its median first."
    return Table("Failed cases by input", tuple(columns), tuple(rows), note)


def _levels(result: dict[str, Any]) -> tuple[Block, ...]:
    shown = [level for level in result["levels"] if level["margin"] is not None]
    limits: list[Block] = [_level_table(result)]
    if shown and result["probability"] and result["method"] != "plain":
        limits.append(
            FigureBlock("Probability over the margin to the limit, level by level.", _probability_figure(result, shown))
        )
    chains = result["method"] == "subset"
    return (Text((_level_words(chains),)), *limits) if result["method"] != "plain" else tuple(limits)


def _probability_figure(result: dict[str, Any], shown: list[dict[str, Any]]) -> Drawing:
    """The probability of each level over its margin, down to the limit."""
    margin, probability = (np.array([item[key] for item in shown]) for key in ("margin", "probability"))
    p, lower, upper = (np.array([result[key]]) for key in ("probability", "lower", "upper"))
    marks = (
        Limit(0.0, "x", INK, "limit", width=1.0, key="limit"),
        Line(margin, probability, BLUE, "levels", width=2.0, key="levels"),
        Points(margin, probability, BLUE, "levels", size=6.0),
        intervals(lower, upper, np.zeros(1), VERMILION, upright=True),
        Points(np.zeros(1), p, VERMILION, "not met", size=8.0, key="P(failure) with its interval"),
    )
    x = Axis(axis_label("margin", result["metric"]["unit"]), reach=Axis().ends([margin, np.zeros(1)])[::-1])
    words = (
        f"The probability falls over {margin.size} levels as the margin falls to zero, where it is "
        f"{number(result['probability'], 3)} ({_interval(result)})"
    )
    plot = Plot(marks, x, Axis("P(smaller margin)", log=True), height=340.0)
    return Drawing("Probability over the margin", (plot,), words=words)


def _level_words(chains: bool) -> str:
    if chains:
        return (
            "Level 0 is plain Monte Carlo. Each further level samples the cases at or below its margin with Markov "
            "chains. Accepted: fraction of the chains’ steps that were accepted."
        )
    return (
        "Each level is drawn from the density fitted to the level before. Its margin is the median of the cases that "
        "the next density is fitted to. Accepted: effective fraction of these. The estimate is from the last level."
    )


def _level_table(result: dict[str, Any]) -> Table:
    columns = (
        Column("Level", "number"),
        Column(axis_label("Margin", result["metric"]["unit"]), "number"),
        Column("Probability", "number"),
        Column("Runs", "number"),
        Column("Cases", "number"),
        Column("Accepted", "number"),
    )
    rows = [
        (
            Cell(str(k), k),
            Cell("all" if level["margin"] is None else number(level["margin"], 4), level["margin"]),
            Cell(number(level["probability"], 3), level["probability"]),
            Cell(str(level["runs"]), level["runs"]),
            Cell(count(level["cases"]), level["cases"]),
            Cell(f"{accepted_percent(level)}{SPACE}%", level["accepted"]),
        )
        for k, level in enumerate(result["levels"])
    ]
    return Table("Levels", columns, tuple(rows))


def _asked(record: RareEventRecord) -> tuple[tuple[str, Any], ...]:
    asked = record.result["asked"]
    return (
        ("configured", f"{asked['method']}, {asked['cases_per_level']} cases per level"),
        ("seed", record.record["campaign"]["seed"]),
    )
