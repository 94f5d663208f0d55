"""The contents of a report, in reading order: first the verdicts, last what is needed to reproduce the numbers."""

from collections.abc import Iterable, Iterator

from reports.case_tables import case_table, worst_tables
from reports.convergence import convergence_blocks
from reports.corridors import corridor_blocks
from reports.data import run_data
from reports.document import Block, Document, Section, Table, Text, numbered
from reports.drawings import distribution_blocks, history_blocks, map_blocks, scatter_blocks
from reports.flown import Flown, Run
from reports.footprints import FootprintContents, footprint_contents
from reports.glossary import GLOSSARY
from reports.headline import cost_cards, summary_sentence, verdict_cards, warnings
from reports.levels import level_blocks
from reports.profiles import profile_blocks
from reports.provenance import campaign_facts, provenance_table
from reports.published import published_table
from reports.published_statistics import statistics_tables
from reports.requirement_tables import requirement_table, risk_table
from reports.sensitivity import sensitivity_blocks
from reports.single_cases import ANCHOR as CASES
from reports.single_cases import case_blocks, case_data
from reports.tables import (
    fixed_table,
    input_table,
    quantile_table,
    status_table,
    summary_table,
)


def build(run: Run, name: str) -> Document:
    """The report of a run; `name` is its directory's name, as commands in the report spell it."""
    flown = Flown(run, name)
    landing = footprint_contents(flown)
    sections = tuple(section for section in _sections(flown, landing) if section.blocks)
    return numbered(
        Document(
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
            data=run_data(flown),
        )
    )


def titled(flown: Flown) -> str:
    """The title of a run's report."""
    return str(flown.campaign.get("title") or flown.manifest.get("model", {}).get("title") or flown.name)


def _sections(flown: Flown, landing: FootprintContents) -> Iterator[Section]:
    yield Section("requirements", "Requirements", _requirements(flown))
    yield Section("corridor", "Corridor", blocks(corridor_blocks(flown)))
    yield Section("footprint", "Footprint", blocks(landing.blocks))
    yield Section("levels", "Comparison of options", blocks(level_blocks(flown)))
    yield Section("drivers", "Contributors", blocks(sensitivity_blocks(flown)))
    yield Section("maps", "Maps", blocks(map_blocks(flown)))
    yield Section("distributions", "Distributions", blocks(distribution_blocks(flown)))
    yield Section("metrics", "All metrics", _metrics(flown))
    yield Section("convergence", "Convergence", blocks(convergence_blocks(flown)))
    yield Section("histories", "Time histories", blocks([*profile_blocks(flown), *history_blocks(flown)]))
    yield Section("scatter", "Scatter plots", blocks(scatter_blocks(flown)))
    yield Section(CASES, "Cases by outcome", blocks(case_blocks(flown)))
    yield Section("worst", "Worst and failed cases", blocks(worst_tables(flown)))
    yield Section("status", "Completion of the cases", (status_table(flown),))
    yield Section(
        "published", "Validation against published results", blocks([*statistics_tables(flown), published_table(flown)])
    )
    yield Section("inputs", "Inputs", blocks(_inputs(flown)))
    yield Section("provenance", "Provenance", (provenance_table(flown),))
    yield Section("reading", "Glossary", (GLOSSARY,))


def blocks(found: Iterable[Block | str | None]) -> tuple[Block, ...]:
    """Blocks without the absent ones; a sentence becomes a paragraph."""
    return tuple(Text((item,)) if isinstance(item, str) else item for item in found if item is not None)


def _requirements(flown: Flown) -> tuple[Block, ...]:
    if flown.verdicts:
        return blocks([requirement_table(flown), risk_table(flown)])
    return (Text(("The campaign file sets no requirement; [requirement.NAME] with a metric and a limit adds one.",)),)


def _metrics(flown: Flown) -> tuple[Block, ...]:
    if not flown.summaries:
        return (Text(("The model declares no metric.",)),)
    return blocks([case_table(flown), summary_table(flown), quantile_table(flown)])


def _inputs(flown: Flown) -> Iterator[Table | str | None]:
    yield input_table(flown) or "No input is dispersed: all cases are the nominal one."
    yield fixed_table(flown, "parameters", "Parameters common to all cases")
    yield fixed_table(flown, "settings", "Settings of the run")
