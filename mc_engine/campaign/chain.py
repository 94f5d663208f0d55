"""Campaigns that take inputs from another run: the section [inputs].

It is checked against that run, or against the campaign that has to be flown first.
"""

import os
from collections.abc import Callable
from contextvars import ContextVar, copy_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mc_engine.campaign.reading import Findings, Sections
from mc_engine.campaign.sections import CampaignSection
from mc_engine.errors import CampaignError, Problem, StoreError
from mc_engine.model.simulator import System
from mc_engine.sampling.designs import BY_LEVELS, IN_BLOCKS, RANDOM
from mc_engine.store.urls import without_secrets

if TYPE_CHECKING:
    from mc_engine.campaign.loading import Campaign
    from mc_engine.campaign.upstream import Rows, Upstream

_LONGEST_CHAIN = 5  # campaigns, each flown for the next
_waiting: ContextVar[int] = ContextVar("_waiting", default=0)  # campaigns of the chain that is being read


class _Endless(CampaignError):
    """A chain of campaigns that is circular or exceeds `_LONGEST_CHAIN`; reported once, by its first campaign."""


def take_inputs(
    sections: Sections,
    model: System,
    directory: Path,
    run: Path | None,
    design: str | None,
    load: "Callable[..., Campaign]",
    findings: Findings,
) -> "tuple[Upstream | None, Campaign | None]":
    """The upstream run, and the campaign that has to be flown for it if there is no such run yet.

    run : used instead of the one that [inputs] names.  load : reads that campaign, as `load_campaign` does.
    """
    if sections.inputs is None:
        _check_unasked(run, findings)
        return None, None
    from mc_engine.campaign.columns import result_columns
    from mc_engine.campaign.upstream import find_run, link, read_rows

    section_findings = findings.under("inputs")
    own_columns = [column.name for column in result_columns(model)]
    source = sections.inputs.source
    first = None
    try:
        run = run or find_run(source, directory)
        if run is not None:
            rows = read_rows(run)
        else:
            cases = sections.campaign.cases if sections.campaign is not None else None
            beside = directory / source
            if _waiting.get() == _LONGEST_CHAIN:
                message = f"the campaigns take their inputs from one another, round and round ({source}, ...)"
                raise _Endless(source, [Problem("from", message)])
            below = copy_context()
            below.run(_waiting.set, _waiting.get() + 1)
            first = below.run(
                load, beside if os.path.exists(beside) else source, cases=cases
            )  # not Path.exists: a name may be too long
            rows = _rows_to_come(first)
    except StoreError as error:
        section_findings.add("from", str(error))
        return None, None
    except _Endless as error:
        if _waiting.get():
            raise
        section_findings.add("from", error.problems[0].message)
        return None, None
    except CampaignError as error:
        named = without_secrets(source)
        section_findings.add(
            "from", f'"{named}" is neither a run nor a campaign that can be flown: {error.problems[0]}'
        )
        return None, None
    random = rows.facts["design"] in RANDOM
    if design is not None and (design in (*BY_LEVELS, *IN_BLOCKS) or (design != "table" and not random)):
        section_findings.add(
            "from", f'its design "{rows.facts["design"]}" does not go with "{design}"; write design = "table"'
        )
    return link(rows, sections.inputs, model, own_columns, section_findings), first


def _check_unasked(run: Path | None, findings: Findings) -> None:
    """Note a run to take inputs from if the file has no [inputs]; not for the file's copy inside a run directory."""
    from mc_engine.campaign.upstream import COMPANION

    written = any(problem.place.split(".")[0] == "inputs" for problem in findings.problems)
    if run is not None and run.name != COMPANION and not written:
        findings.add("inputs", "is missing; --from needs a section [inputs], which says what is taken from that run")


def _rows_to_come(first: "Campaign") -> "Rows":
    """The columns, without rows, of a run that has yet to be flown."""
    from mc_engine.campaign.columns import case_columns
    from mc_engine.campaign.upstream import Rows
    from mc_engine.store.parts import CASE_COLUMNS

    upstream_columns = () if first.upstream is None else first.upstream.columns
    columns = (*CASE_COLUMNS, *case_columns(first.model, first.dispersions, upstream_columns))
    facts: dict[str, Any] = {
        "name": first.name,
        "title": first.title,
        "model": first.model_reference,
        "design": first.design,
    }
    facts |= {"seed": first.seed, "digest": first.digest, "figures": [], "inputs": []}
    nothing = {column.name: np.empty(0, dtype=object if column.kind == "word" else float) for column in columns}
    return Rows(facts, columns, nothing, {column.name: 0.0 for column in columns})


def check_taken(sections: Sections, upstream: "Upstream | None", design: str | None, findings: Findings) -> None:
    """Note inputs that this file sets although they come from the upstream run."""
    if upstream is None:
        return
    if design == "table":
        for name in sections.dispersions:
            message = 'the design "table" takes all cases from the run upstream; write design = "mc" to disperse more'
            findings.under("dispersion").add(name, message)
    for name in upstream.links:
        for place, names in (("parameters", sections.parameters), ("dispersion", sections.dispersions)):
            if name in names:
                findings.under(place).add(name, f"comes from the run of {upstream.name}; leave it out here")


def chained_count(section: CampaignSection, rows: int, findings: Findings) -> int:
    """Number of cases: all of the upstream run, or the first ones as `cases` says."""
    if section.design in RANDOM and section.seed is None:
        findings.add("seed", f"is missing: {CampaignSection.model_fields['seed'].description}")
    if section.table is not None:
        findings.add("table", "cannot be there together with [inputs]")
    if section.cases is not None and section.cases > rows:
        findings.add("cases", f"{section.cases} is not allowed; the run upstream has {rows} cases")
    return section.cases or rows
