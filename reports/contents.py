"""The contents of a report, in reading order: verdicts, what was flown, results; the appendices hold the evidence."""

from collections.abc import Iterator

from mc_engine.store.store import Store
from reports.contributors.sensitivity import sensitivity_blocks
from reports.document.blocks import Block, Document, Found, Section, as_blocks, numbered
from reports.document.glossary import GLOSSARY
from reports.footprint.section import FootprintContents, footprint_contents
from reports.formats.json_data import run_data
from reports.run.chosen_units import ShownRun
from reports.run.flown import Flown
from reports.sections.case_tables import case_table, worst_tables
from reports.sections.convergence import convergence_blocks, integration_table
from reports.sections.corridors import corridor_blocks
from reports.sections.diagnostics import correlation_blocks, normal_probability_blocks
from reports.sections.figure_blocks import (
    distribution_blocks,
    history_blocks,
    other_distributions,
    scatter_blocks,
)
from reports.sections.headline import cost_cards, summary_sentence, verdict_cards, warnings
from reports.sections.levels import level_blocks
from reports.sections.map_blocks import map_blocks
from reports.sections.profiles import profile_blocks
from reports.sections.provenance import campaign_facts, provenance_table
from reports.sections.published import published_blocks
from reports.sections.published_statistics import statistics_tables
from reports.sections.requirement_tables import requirement_blocks
from reports.sections.scenario import scenario_blocks
from reports.sections.single_cases import ANCHOR as CASES
from reports.sections.single_cases import case_blocks, case_data
from reports.sections.tables import fixed_table, quantile_table, range_table, status_table, summary_table


def build(run: Store, name: str) -> Document:
    """The report of a run; `name` is its directory's name, as commands in the report spell it."""
    own = Flown(run, name)
    flown = ShownRun(own)
    landing = footprint_contents(own)
    sections = numbered(_kept([*_chapters(flown, landing), *_appendices(flown)]))
    return Document(
        title=titled(flown),
        subtitle=summary_sentence(flown),
        created=str(flown.manifest.get("created_utc", "")),
        facts=campaign_facts(flown),
        verdicts=verdict_cards(flown),
        costs=cost_cards(flown),
        warnings=warnings(flown),
        sections=sections,
        files=tuple(landing.files),
        cases=case_data(flown, sections),
        data=run_data(own),
    )


def titled(flown: Flown) -> str:
    """The title of a run's report."""
    return str(flown.campaign.get("title") or flown.manifest.get("model", {}).get("title") or flown.name)


def _chapters(flown: Flown, landing: FootprintContents) -> Iterator[Section]:
    yield _section("requirements", "Verification matrix", requirement_blocks(flown))
    yield _section("scenario", "Scenario", scenario_blocks(flown))
    yield _section("distributions", "Distributions", distribution_blocks(flown))
    yield _section("drivers", "Contributors", sensitivity_blocks(flown))
    yield _section("maps", "Maps", map_blocks(flown), "part")
    yield _section("levels", "Comparison of options", level_blocks(flown), "part")
    yield _section("histories", "Time histories", [*profile_blocks(flown), *history_blocks(flown)])
    scatters = "Scatter and footprint" if landing.blocks else "Scatter plots"
    yield _section("scatter", scatters, scatter_blocks(flown))
    yield _section("footprint", "Footprint", landing.blocks, "part")
    yield _section("corridor", "Corridor", corridor_blocks(flown), "part")
    yield _section(CASES, "Cases by outcome", case_blocks(flown), "part")
    yield _section("worst", "Worst and failed cases", worst_tables(flown))


def _appendices(flown: Flown) -> Iterator[Section]:
    yield _section("metrics", "All metrics", _metrics(flown), "appendix")
    yield _section("correlations", "Correlation matrix", correlation_blocks(flown), "appendix")
    yield _section("normality", "Normal probability plots", normal_probability_blocks(flown), "appendix")
    yield _section("convergence", "Convergence", [*convergence_blocks(flown), integration_table(flown)], "appendix")
    fixed = fixed_table(flown, "Parameters and settings at the model’s own values, common to all cases", False)
    yield _section("inputs", "Inputs", (fixed,), "appendix")
    yield _section("status", "Completion of the cases", (status_table(flown),), "appendix")
    published = [*statistics_tables(flown.own), *published_blocks(flown.own)]
    yield _section("published", "Validation against published results", published, "appendix")
    yield _section("provenance", "Provenance", (provenance_table(flown),), "appendix")
    yield _section("reading", "Glossary", (GLOSSARY,), "appendix")


def _section(anchor: str, title: str, said: Found, kind: str = "chapter") -> Section:
    return Section(anchor, title, as_blocks(said), kind)


def _kept(sections: list[Section]) -> Iterator[Section]:
    """Sections with something in them; a chapter without blocks stays where one of its parts has some."""
    for place, section in enumerate(sections):
        parts = []
        for later in sections[place + 1 :]:
            if later.kind != "part":
                break
            parts.append(later)
        if section.blocks or (section.kind == "chapter" and any(part.blocks for part in parts)):
            yield section


def _metrics(flown: Flown) -> Iterator[Block | str | None]:
    if not flown.summaries:
        yield "The model declares no metric."
        return
    yield case_table(flown)
    yield range_table(flown) if flown.chosen else summary_table(flown)
    yield quantile_table(flown)
    yield from other_distributions(flown)
