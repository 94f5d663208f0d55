"""The report of a tuning: the front, validation against published results, and convergence of the search."""

import re
from collections.abc import Iterator

import numpy as np

from mc_engine.numbers_in_text import digits_within
from mc_engine.studies.tuning_folder import (
    UNFINISHED,
    TuningRecord,
    front_words,
    infeasibility,
    requirements_not_searched,
)
from reports.document.blocks import Block, Card, Document, FigureBlock, Section, Table, Terms, Text, as_blocks, numbered
from reports.drawing.marks import Axis, Drawing, Line, Plot, stepped
from reports.drawing.palette import BLUE
from reports.figures.fronts import candidates_beyond, front_figure
from reports.sections.figure_blocks import POINTS_SHOWN, thinned_rows
from reports.sections.scenario import note_paragraphs
from reports.studies.tuned import Tuned, inside, limit_words, metric_words, quantile_words
from reports.studies.tuning_tables import (
    front_table,
    held_by_bounds,
    input_tables,
    least_table,
    measure_table,
    parameter_table,
    provenance_table,
    published_table,
)
from reports.text.numbers import SPACE, capitalised, count, counted, number, with_unit
from reports.text.source_places import of_source

GLOSSARY = Terms(
    (
        ("candidate", "One choice of the tuned parameters, flown as the nominal case or as the same dispersed cases."),
        ("feasible", "Inside all constraints, if there are any, with a number for every metric."),
        (
            "front",
            "Of all feasible candidates that were flown, those that no other one equals or beats in every objective "
            "and beats in one (Pareto front). Which of them is best is a choice between the objectives.",
        ),
        (
            "violation",
            "The sum of the distances of a candidate beyond its limits, each as a fraction of the limit.",
        ),
        (
            "quantile",
            "The order statistic of the candidate’s dispersed cases; a case that failed takes the worst rank. All "
            "candidates fly the same cases with the same noise, so they differ only by the choice of parameters.",
        ),
        (
            "fraction of the box",
            "The fraction of the common bounding box of all generations’ fronts that the present front dominates. It "
            "levels off when the search finds nothing new; it does not show that nothing better exists.",
        ),
    )
)


def build_tuning(record: TuningRecord, name: str) -> Document:
    """The report of a tuning; `name` is its directory's name."""
    tuned = Tuned(record, name)
    campaign = tuned.manifest["campaign"]
    sections = (
        Section("front", "The front", as_blocks(_front_blocks(tuned))),
        Section("published", "Validation against published results", as_blocks([published_table(tuned)])),
        Section("convergence", "Convergence of the search", _progress_blocks(tuned)),
        Section("question", "Problem", as_blocks(_question_blocks(tuned))),
        Section("inputs", "Other inputs", as_blocks(input_tables(tuned))),
        Section("provenance", "Provenance", (provenance_table(tuned),)),
        Section("reading", "Glossary", (GLOSSARY,)),
    )
    return Document(
        kind="Tuning report",
        title=str(campaign.get("title") or name),
        subtitle=_front_sentence(tuned),
        created=str(tuned.manifest.get("created_utc", "")),
        facts=_search_facts(tuned),
        verdicts=tuple(_constraint_cards(tuned)),
        costs=tuple(_objective_cards(tuned)),
        warnings=tuple(_search_warnings(tuned)),
        sections=numbered(section for section in sections if section.blocks),
    )


# ---- the headline


def _front_sentence(tuned: Tuned) -> str:
    if tuned.record.feasible:
        return f"{front_words(tuned.record, count)}."
    sentence = re.sub(r"(?<=\d),(?=\d{3})", SPACE, infeasibility(tuned.record))
    sentence = re.sub(r"-(?=\d)", "−", sentence)
    return f"{capitalised(sentence)}."


def _search_facts(tuned: Tuned) -> tuple[tuple[str, str], ...]:
    plan, campaign = tuned.plan, tuned.manifest["campaign"]
    cases = int(plan["cases"])
    return (
        ("Campaign", str(campaign.get("name", ""))),
        ("Model", str(tuned.manifest.get("model", {}).get("title", ""))),
        ("Candidates", f"{count(len(tuned.evaluations))} in {count(plan['flown'])} generations"),
        ("Each flown as", "the nominal case" if cases == 1 else f"{count(cases)} dispersed cases, the same for all"),
        ("Search", f"NSGA-II, seed {plan['seed']}"),
        ("Run", str(tuned.manifest.get("created_utc", ""))[:16].replace("T", " ") + " UTC"),
    )


def _constraint_cards(tuned: Tuned) -> Iterator[Card]:
    for constraint in tuned.plan["constraints"]:
        values = tuned.evaluations[constraint["name"]].to_numpy()
        met = int(np.count_nonzero(inside(values, constraint)))
        numbers = values[np.isfinite(values)]
        side = "largest" if constraint["at_most"] is None else "smallest"
        limit = constraint["at_least"] if side == "largest" else constraint["at_most"]
        near = float(numbers.max() if side == "largest" else numbers.min()) if numbers.size else np.nan
        found = number(near, digits_within(min(near, limit), max(near, limit), least=4))
        yield Card(
            label=constraint["name"],
            answer="reached" if met else "not reached",
            detail=f"{metric_words(tuned, constraint)} {limit_words(tuned, constraint)}: "
            f"{count(met)} of {count(len(values))} candidates; "
            f"the {side} found is {with_unit(found, tuned.units[constraint['name']])}.",
            tone="good" if met else "bad",
        )


def _objective_cards(tuned: Tuned) -> Iterator[Card]:
    for objective in tuned.plan["objectives"]:
        values = tuned.best[objective["name"]].to_numpy()
        if not values.size:
            yield Card(objective["name"], "no number", "no candidate has one", "open")
            continue
        if not tuned.record.feasible:  # what no allowed candidate reaches is no result
            continue
        ends = [with_unit(end, tuned.units[objective["name"]]) for end in tuned.ends(objective["name"])]
        small = objective["goal"] == "minimise"
        best, other = ends if small else ends[::-1]
        yield Card(
            label=f"{objective['name']}, to be {'small' if small else 'large'}",
            answer=best,
            detail=f"{metric_words(tuned, objective)}{quantile_words(objective)}; "
            f"{'up' if small else 'down'} to {other} at the other end of the front.",
        )


def _search_warnings(tuned: Tuned) -> Iterator[str]:
    if not tuned.record.feasible:
        yield (
            "There is no front: no candidate is feasible. The figure and the table of the best candidates ignore the "
            "constraints."
        )
    if not_searched := requirements_not_searched(tuned.record):
        yield f"{capitalised(not_searched)}.".replace("'", "’")
    failed = int((tuned.evaluations["failed_cases"] > 0).sum())
    if failed:
        ends = tuned.evaluations["commonest_failure"][tuned.evaluations["failed_cases"] > 0].value_counts(sort=False)
        yield (
            f"{counted(failed, 'candidate')} had cases that failed; each of these takes the worst rank. Most often, "
            f"with {counted(int(ends.max()), 'candidate')}: {ends.idxmax()}."
        )
    if tuned.plan["end"] in ("interrupted", UNFINISHED):
        how = "was interrupted" if tuned.plan["end"] == "interrupted" else "had not ended, or was killed,"
        yield f"The search {how} after {tuned.plan['flown']} of {tuned.plan['generations']} generations."


# ---- the front


def _front_blocks(tuned: Tuned) -> Iterator[FigureBlock | Table | str | None]:
    if not len(tuned.best):
        yield "No candidate has a number for every metric; nothing can be drawn."
        return
    if len(tuned.objectives) > 1:
        yield _front_figure(tuned)
    yield front_table(tuned)
    yield least_table(tuned)
    held = held_by_bounds(tuned)
    if held:
        yield f"At a bound all along the front: {', '.join(held)}. A wider range may bring more."


def _front_figure(tuned: Tuned) -> FigureBlock:
    names, every = tuned.objectives, tuned.evaluations
    finite = np.isfinite(every[names]).all(axis=1)
    others = every[finite & ~every["candidate"].isin(tuned.best["candidate"])]
    parts = [others[~others["feasible"]], others[others["feasible"]]]
    shown = [part[names].to_numpy()[thinned_rows(np.arange(len(part)), np.empty(0, int))] for part in parts]
    feasible = int(every["feasible"].sum())
    drawing = front_figure(
        [tuned.label(name) for name in names],
        [
            ("outside a constraint", len(every) - feasible, shown[0]),
            ("feasible", feasible, shown[1]),
        ],
        tuned.best[names].to_numpy(),
        [(of_source(point["name"]), [point["values"][name] for name in names]) for point in tuned.plan["published"]],
        relaxed=not tuned.record.feasible,
        first_small=tuned.plan["objectives"][0]["goal"] == "minimise",
    )
    beyond = candidates_beyond(drawing.plots[0])
    caption = "Every candidate and the front" if tuned.record.feasible else "Every candidate; none is feasible"
    lie = "lies" if beyond == 1 else "lie"
    outside = f". {counted(beyond, 'candidate')} {lie} beyond the axes" if beyond else ""
    thinner = (
        f". At most {count(POINTS_SHOWN)} of each kind are drawn" if any(len(p) > POINTS_SHOWN for p in parts) else ""
    )
    return FigureBlock(f"{caption}{outside}{thinner}.", drawing)


# ---- the search and the question


def _question_blocks(tuned: Tuned) -> Iterator[Table | str]:
    yield from note_paragraphs(tuned.manifest["campaign"])
    yield parameter_table(tuned)
    yield measure_table(tuned)


def _progress_blocks(tuned: Tuned) -> tuple[Block, ...]:
    frame, plan = tuned.record.generations, tuned.plan
    shares = frame["dominated_share"].to_numpy()
    curves = {}
    if tuned.record.feasible and np.isfinite(shares).all():
        curves["fraction of the box that the front dominates"] = shares
    if tuned.constraints:
        least = frame["least_violation"].to_numpy()
        if least[0] > 0.0:
            curves["least violation so far"] = np.where(np.isfinite(least), least, np.nan)
        if tuned.record.feasible:
            curves["feasible candidates so far"] = frame["feasible_so_far"].to_numpy(dtype=float)
    text = (
        f"NSGA-II with {count(plan['population'])} candidates a generation, crossover {plan['crossover']:g}, mutation "
        f"of each parameter {plan['mutation']:.3g}, seed {plan['seed']}; ended after {count(plan['flown'])} of "
        f"{count(plan['generations'])} generations: {plan['end']}."
    )
    if not curves:
        return (Text((text,)),)
    x = frame["evaluations"].to_numpy(dtype=float)
    key = f"after each of {count(x.size)} generations"
    panels = tuple(
        Plot(
            (Line(*stepped(x, y), BLUE, width=2.0, key=key),),
            Axis("candidates flown"),
            Axis(reach=(0.0, 1.04 * max(y[np.isfinite(y)].tolist(), default=0.0))),
            label,
            250.0,
        )
        for label, y in curves.items()
    )
    return (Text((text,)), FigureBlock("Progress of the search", Drawing("Progress of the search", panels), "half"))
