"""Checks of a campaign's sections against its model: nominal values, correlations, requirements, histories."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from mc_engine.campaign.dispersions import Dispersion
from mc_engine.campaign.inputs import accepted_range, check_value, number
from mc_engine.campaign.reading import Findings
from mc_engine.campaign.search import SHIPPED
from mc_engine.campaign.sections import (
    CampaignSection,
    ConstraintSection,
    CorrelationSection,
    HistoriesSection,
    RequirementSection,
    RetentionSection,
)
from mc_engine.errors import ModelError
from mc_engine.model.faults import naming_faults
from mc_engine.model.fields import AdaptiveStep, Setting, inputs_of
from mc_engine.model.fmu import fmu_simulator
from mc_engine.model.preparation import call_prepare
from mc_engine.model.program import SimulatorSection, program_simulator
from mc_engine.model.record import Refusals, load_model
from mc_engine.model.simulator import Simulator, System, load_simulator
from mc_engine.sampling.correlation import group_matrix, is_positive_definite
from mc_engine.sampling.designs import IN_BLOCKS, RANDOM, block_problem
from mc_engine.sampling.distributions import Discrete, Scalar
from mc_engine.sampling.sobol import MAX_DIMENSIONS
from mc_engine.suggestions import hint, listed

COMPLETED = "completed"  # name of the share of completed cases, which a comparison tests along with each requirement
_LARGEST_HYPERCUBE = 10_000_000  # cases; a Latin hypercube is held in memory as a whole
_CASES_PER_CORRELATED = 10  # a Latin hypercube with fewer may not have room for the correlations asked for


@dataclass(frozen=True)
class Correlation:
    """Spearman correlation of two dispersions."""

    first: str
    second: str
    rank: float
    source: str = ""


@dataclass(frozen=True)
class Requirement:
    """`metric` must be inside the limits with probability `share`, demonstrated with `confidence`.  None: no limit."""

    name: str
    metric: str
    at_most: float | None
    at_least: float | None
    share: float
    confidence: float
    source: str = ""


def system_of(
    document: Mapping[str, Any], program: SimulatorSection | None, directory: Path, findings: Findings
) -> System | None:
    """The model or simulator, even if other keys of [campaign] are wrong: the rest of the file is checked with it."""
    section, inside = document.get("campaign"), findings.under("campaign")
    if not isinstance(section, dict):
        return None
    named = [key for key in ("model", "simulator") if key in section]
    if not named and program is not None:
        return _program(program, directory, findings)
    if len(named) != 1 or "simulator" in document:  # which `read_sections` has noted
        return None
    reference = section[named[0]]
    if not isinstance(reference, str) or not reference:
        return None
    try:
        return load_model(reference, directory) if named == ["model"] else load_simulator(reference, directory)
    except ModelError as error:
        known = [f"campaigns.{folder.parent.name}" for folder in SHIPPED.glob("*/campaign.toml")]
        known += [file.name for file in directory.glob("*.py")]
        near = "" if reference in known else hint(reference, known)
        inside.add(named[0], f"{error}{near if 'did you mean' in near else ''}")
        return None


def _program(section: SimulatorSection, directory: Path, findings: Findings) -> System | None:
    """The program or FMU of [simulator], or None with its mistakes noted."""
    problems: list[tuple[str, str]] = []
    described = program_simulator if section.fmu is None else fmu_simulator
    simulator = described(section, directory, problems)
    for key, message in problems:
        findings.under("simulator").add(key, message)
    return simulator


def nominal_values(model: System, overrides: Mapping[str, Scalar], findings: Findings) -> dict[str, Scalar]:
    """Every parameter and setting at its nominal value: what [parameters] says, else the model's default."""
    inputs = inputs_of(model)
    for name in overrides:
        if name not in inputs:
            near = "" if findings.full else hint(name, inputs)
            findings.add(name, f"is not a parameter of {model.name}{near}")
    values: dict[str, Scalar] = {}
    for item in inputs.values():
        default = item.default if isinstance(item, Setting) else float(item.default)
        if item.name in overrides:
            checked = check_value(overrides[item.name], item, findings, item.name)
            values[item.name] = default if checked is None else checked
        else:
            if not isinstance(default, bool | str) and not item.low <= default <= item.high:
                own = f"the model's own value {number(default)}"
                findings.add(item.name, f"{own} is not within {accepted_range(item)}; give one")
            values[item.name] = default
    return values


def with_step_limit(model: System, section: CampaignSection | None, findings: Findings) -> System:
    """The model with the file's own limit on integration steps."""
    if section is None or section.max_steps is None:
        return model
    if isinstance(model, Simulator):
        findings.add("max_steps", f"is for compiled models; {model.name} has a limit of its own, time_limit_s")
        return model
    if not isinstance(model.clock, AdaptiveStep):
        findings.add("max_steps", f"is for models that choose their steps; {model.name} steps on a fixed grid")
        return model
    return replace(model, clock=replace(model.clock, attempts=section.max_steps))


def refusal(model: System, values: Mapping[str, Scalar]) -> str:
    """Why the model cannot start from these values, as one sentence; empty if it can.

    Raises ModelError if `prepare` itself fails.
    """
    if isinstance(model, Simulator) or model.prepare is None:
        return ""
    inputs = {p.symbol: np.array([float(values[p.name]) * p.si_factor]) for p in model.parameters}
    settings = {s.symbol: np.array([s.code(values[s.name])]) for s in model.settings}
    refusals = Refusals.none(1)
    with naming_faults(model.reference, "the nominal case", ""):
        call_prepare(model, SimpleNamespace(**inputs), SimpleNamespace(**settings), refusals)
    return str(refusals.reason[0])


def check_correlations(
    sections: Mapping[str, CorrelationSection],
    dispersions: tuple[Dispersion, ...],
    faulty: frozenset[str],
    model: System,
    design: str,
    findings: Findings,
) -> tuple[Correlation, ...]:
    """The correlations; `sections` by place in the file, `faulty` the dispersions with mistakes of their own."""
    if sections and design not in RANDOM:
        why = "is for independent inputs" if design in IN_BLOCKS else "has no chance in it"
        findings.add("correlation", f'the design "{design}" {why}; correlations are for {listed(RANDOM)}')
        return ()
    by_name = {dispersion.name: dispersion for dispersion in dispersions}
    kept: list[Correlation] = []
    for place, section in sections.items():
        first, second = section.between
        section_findings = findings.under(place)
        before = len(findings.problems)
        for name in section.between:
            if name not in faulty:
                _check_correlated(name, by_name, model, section_findings)
        if first == second:
            section_findings.add("between", f'"{first}" is there twice')
        elif any({first, second} == {other.first, other.second} for other in kept):
            section_findings.add("between", f'"{first}" and "{second}" have a correlation already')
        if len(findings.problems) == before and not faulty.intersection(section.between):
            kept.append(Correlation(first, second, section.rank, section.source))
    matrix = group_matrix(list(by_name), rank_pairs(kept))[1]
    if kept and not is_positive_definite(matrix):
        text = ", ".join(
            f"{correlation.first} ~ {correlation.second} = {number(correlation.rank)}" for correlation in kept
        )
        findings.add(
            "correlation", f"no numbers can be correlated like this: {text} (the matrix is not positive definite)"
        )
    return tuple(kept)


def _check_correlated(name: str, by_name: Mapping[str, Dispersion], model: System, findings: Findings) -> None:
    if name not in by_name:
        findings.add("between", f'"{name}" is not dispersed{hint(name, by_name)}')
    elif any(setting.name == name for setting in model.settings):
        findings.add("between", f'"{name}" is a setting; only parameters can be correlated')
    elif by_name[name].dist == "constant":
        findings.add("between", f'"{name}" is constant; it cannot be correlated')
    elif isinstance(drawn := by_name[name].distribution, Discrete) and list(drawn.values) != sorted(drawn.values):
        # Quantiles go in the order written, so that the correlation would be that of the places.
        findings.add("between", f'the values of "{name}" must rise to be correlated; sort them, each with its weight')


def rank_pairs(correlations: Sequence[Correlation]) -> tuple[tuple[str, str, float], ...]:
    """The correlations as plain tuples."""
    return tuple((correlation.first, correlation.second, correlation.rank) for correlation in correlations)


def check_size(
    count: int,
    design: str,
    dispersions: tuple[Dispersion, ...],
    correlations: tuple[Correlation, ...],
    findings: Findings,
) -> None:
    """Note a number of cases, or of dispersions, that the design cannot have."""
    if design == "lhs":
        # A Latin hypercube of few cases has few ways to be paired.
        needed = _CASES_PER_CORRELATED * len({name for pair in correlations for name in (pair.first, pair.second)})
        if count < needed:
            findings.add("cases", f'{count} is not allowed; "lhs" with these correlations needs at least {needed}')
        if count > _LARGEST_HYPERCUBE:
            findings.add("cases", f'{count} is not allowed; "lhs" has at most {_LARGEST_HYPERCUBE}, "sobol" more')
    most = {"sobol": MAX_DIMENSIONS, "saltelli": MAX_DIMENSIONS // 2}.get(design, len(dispersions))
    if len(dispersions) > most:
        findings.add("design", f'"{design}" has at most {most} dispersions, here are {len(dispersions)}; use "mc"')
    if design in IN_BLOCKS and not dispersions:
        findings.add("design", f'"{design}" needs a dispersion to find the effect of')
    if sentence := block_problem(design, len(dispersions), count):
        findings.add("cases", sentence)


def check_requirements(
    sections: Mapping[str, RequirementSection], model: System, findings: Findings
) -> tuple[Requirement, ...]:
    """The requirements, each with a metric of the model and at least one limit."""
    kept = []
    for name, section in sections.items():
        section_findings = findings.under(name)
        if name == COMPLETED:
            section_findings.add("", "is what the share of completed cases is called; give it another name")
        check_metric(section.metric, model, section_findings)
        check_limits(section, section_findings)
        kept.append(Requirement(name, **section.model_dump(exclude={"note"})))
    return tuple(kept)


def check_limits(section: RequirementSection | ConstraintSection, findings: Findings) -> None:
    """Note a section without a limit, or with limits in the wrong order."""
    low, high = section.at_least, section.at_most
    if low is None and high is None:
        findings.add("", "has no limit; give at_most, at_least or both")
    elif low is not None and high is not None and low > high:
        findings.add("at_least", f"{number(low)} is above at_most = {number(high)}")


def check_retention(
    section: RetentionSection | None, model: System, cases: int | None, shortened: bool, findings: Findings
) -> HistoriesSection:
    """Which histories are saved; by default where the section could not be read.

    cases : number of cases, None where it is unknown.  shortened : it is not the file's; numbers beyond it are then no
    mistake.
    """
    if section is None:
        return HistoriesSection()
    histories, section_findings = section.histories, findings.under("histories")
    for k, entry in enumerate(histories.worst_of, start=1):
        several = isinstance(histories.worst, list)
        check_metric(entry.metric, model, section_findings.under(f"worst {k}" if several else "worst"))
    for case in histories.cases:
        if cases is not None and case >= cases and not shortened:
            section_findings.add("cases", f"there is no case {case}; they are 0 to {cases - 1}")
    return histories


def check_metric(metric: str, model: System, findings: Findings) -> None:
    """Note a name that is not a metric of the model."""
    names = [field.name for field in model.metrics]
    if metric not in names:
        findings.add("metric", f'"{metric}" is not a metric of {model.name}{hint(metric, names)}')
