"""Reads a campaign from a TOML file: a model, the dispersions of its inputs, and the requirements on its results.

`load_campaign` reports every mistake of the file at once.  The module itself imports neither numba nor scipy nor
matplotlib, so that the command line starts fast.  The keys of the file are in `mc_engine.campaign.sections`.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mc_engine.campaign.case_table import cases_of_table, table_dispersions
from mc_engine.campaign.chain import chained_count, check_taken, take_inputs
from mc_engine.campaign.covariances import spread_covariances
from mc_engine.campaign.dispersions import Dispersion, build_dispersion
from mc_engine.campaign.parts import (
    Correlation,
    Requirement,
    check_correlations,
    check_metric,
    check_requirements,
    check_retention,
    check_size,
    nominal_values,
    refusal,
    system_of,
    with_step_limit,
)
from mc_engine.campaign.reading import Findings, Sections, parse_toml, read_sections
from mc_engine.campaign.search import campaign_name, campaign_text, find_campaign
from mc_engine.campaign.sections import CampaignSection, HistoriesSection
from mc_engine.campaign.sensitivity_design import SensitivityDesign, check_sensitivity
from mc_engine.campaign.tuning_section import Tuning, check_tuning
from mc_engine.errors import CampaignError, EngineError, ModelError
from mc_engine.model.fields import inputs_of
from mc_engine.model.simulator import System
from mc_engine.sampling.designs import BY_LEVELS, DESIGNS, IN_BLOCKS, RANDOM, level_count
from mc_engine.sampling.distributions import Scalar
from mc_engine.section import ReportSection
from mc_engine.status import MOST_CASES
from mc_engine.store.run_files import path_of
from mc_engine.suggestions import hint

if TYPE_CHECKING:
    from mc_engine.campaign.upstream import Upstream


@dataclass(frozen=True)
class Campaign:
    """A campaign that can be flown: a model, the dispersions of its inputs, and the requirements on its results.

    Read one with `load_campaign`.  Numbers are in the units that the model declares.

    name : str, the shipped name ("deorbit/map"), or a name made from the path of the file
    title : str, one line for the report
    note : str, a remark for the report
    text : str, the campaign file as read; its `cases` and `seed` may have been replaced by those below
    directory : Path, the folder of the file, to which the names of tables and orbit messages are relative
    model : Model or Simulator, the system that is flown
    model_reference : str, its module ("campaigns.deorbit") or its file next to the campaign file ("model.py")
    cases : int, number of cases
    design : str, how the cases are generated: "mc", "lhs", "sobol", "saltelli", "morris", "grid", "one_at_a_time",
        "table"
    seed : int, from which all random numbers are derived
    parameters : dict, name to value, the section [parameters]
    nominal : dict, name to value, all parameters and settings of the model
    dispersions : tuple of Dispersion, the inputs that differ from case to case, in file order
    correlations : tuple of Correlation, rank correlations between dispersions
    requirements : tuple of Requirement, the limits that the results must meet
    retention : HistoriesSection, the cases whose time histories are saved
    digest : str, SHA-256 of everything on which the inputs of a case or the verdicts depend.  The number of cases is
        part of it only for "lhs", because extending a run does not change its campaign.
    table_path : Path or None, the file of the design "table"
    table : dict, its columns by name; empty for any other design
    tuning : Tuning or None, the section [tuning]
    upstream : Upstream or None, the run that inputs are taken from
    first : Campaign or None, the campaign of that run, if it has yet to be flown
    looks : tuple of int, numbers of cases at which `run --until verdict` makes interim analyses; empty for other runs
    files : dict, path to SHA-256, the tables and orbit messages as they were read
    sensitivity : SensitivityDesign or None, the section [sensitivity]
    report : ReportSection, probability and confidence of the statistics in the report

    >>> campaign = load_campaign("minimal", cases=8)
    >>> campaign.title, campaign.design, campaign.cases
    ('Apogee raised by one burn', 'mc', 8)
    >>> [dispersion.name for dispersion in campaign.dispersions]
    ['magnitude_error_pct', 'pitch_error_deg']
    """

    name: str
    title: str
    note: str
    text: str
    directory: Path
    model: System
    model_reference: str
    cases: int
    design: str
    seed: int
    parameters: Mapping[str, Scalar]
    nominal: Mapping[str, Scalar]
    dispersions: tuple[Dispersion, ...]
    correlations: tuple[Correlation, ...]
    requirements: tuple[Requirement, ...]
    retention: HistoriesSection
    digest: str
    table_path: Path | None = None
    table: Mapping[str, np.ndarray] = field(default_factory=dict, compare=False, repr=False)
    tuning: Tuning | None = None
    upstream: "Upstream | None" = field(default=None, compare=False, repr=False)
    first: "Campaign | None" = field(default=None, compare=False, repr=False)
    looks: tuple[int, ...] = ()
    files: Mapping[Path, str] = field(default_factory=dict, compare=False, repr=False)
    sensitivity: SensitivityDesign | None = None
    report: ReportSection = field(default_factory=ReportSection)


def load_campaign(
    reference: str | Path,
    *,
    cases: int | None = None,
    seed: int | None = None,
    text: str | None = None,
    directory: Path | None = None,
    upstream: str | Path | None = None,
) -> Campaign:
    """The Campaign of a campaign file, checked against its model.

    reference : str or Path, a shipped name ("deorbit", "deorbit/map"), a .toml file, or a folder with a campaign.toml;
        if `text` is given, the name of the campaign
    cases : int, number of cases in place of the file's
    seed : int, seed in place of the file's
    text : str, the contents of the campaign file, if they are not to be read from a file
    directory : Path, the folder to which the names of files in `text` are relative; the working folder by default
    upstream : str or Path, the run to take inputs from, in place of the one that [inputs] names

    Returns the Campaign.

    Raises CampaignError, which lists every mistake of the file with its location.

    >>> campaign = load_campaign("minimal", cases=100, seed=7)
    >>> campaign.cases, campaign.seed
    (100, 7)
    """
    if text is None:
        path = find_campaign(reference)
        name, source, directory = campaign_name(path), path.name, path.resolve().parent
        text = campaign_text(path)
    else:
        if not isinstance(text, str):
            raise EngineError(f"text: {type(text).__name__} is no text; give the contents of the file as a str")
        name, source = str(reference), Path(str(reference)).name
        directory = path_of(directory or Path.cwd(), "directory: {} is no path")
    document = parse_toml(text, source)
    written = _table_of(document, "campaign")
    given = {key: value for key, value in (("cases", cases), ("seed", seed)) if value is not None}
    written.update({key: int(value) if isinstance(value, np.integer) else value for key, value in given.items()})
    findings, run = Findings(), None if upstream is None else path_of(upstream, "upstream: {} is no path")
    campaign = _assemble(name, text, directory, document, cases is not None, run, findings)
    if campaign is None or findings.problems:
        raise CampaignError(source, findings.problems)
    return campaign


def refuse_no_campaign(campaign: object) -> None:
    """EngineError where a function is given anything but a Campaign, such as the name of one."""
    if not isinstance(campaign, Campaign):
        what = repr(campaign) if isinstance(campaign, str | Path) else type(campaign).__name__
        raise EngineError(f"campaign: {what} is no Campaign; load_campaign makes one of a name or a file")


def _assemble(
    name: str,
    text: str,
    directory: Path,
    document: dict[str, Any],
    shortened: bool,
    run: Path | None,
    findings: Findings,
) -> Campaign | None:
    """The campaign, or None where a section or the model is missing, without which the rest cannot be checked."""
    messages = spread_covariances(document, directory, _named_design(document), findings)
    sections = read_sections(document, findings)
    model = system_of(document, sections.program, directory, findings)
    if model is None:
        return None
    inside = findings.under("campaign")
    section = sections.campaign
    model = with_step_limit(model, section, inside)
    design = section.design if section is not None else _named_design(document)
    upstream, first = take_inputs(sections, model, directory, run, design, load_campaign, findings)
    nominal = _nominal_inputs(
        model, sections, {} if upstream is None or first is not None else upstream.nominal, findings
    )
    requirements = check_requirements(sections.requirements, model, findings.under("requirement"))
    _unknown_names(document, sections, nominal, model, findings)
    check_taken(sections, upstream, design, findings)
    dispersions = _dispersions(sections, model, nominal, design, directory, findings)
    # in the file, with mistakes of their own, or without a known design
    faulty = frozenset(_table_of(document, "dispersion")) - {dispersion.name for dispersion in dispersions}
    correlations = check_correlations(sections.correlations, dispersions, faulty, model, design or "mc", findings)
    table_path: Path | None = None
    table: dict[str, np.ndarray] = {}
    if upstream is None:
        table_path, table = cases_of_table(section, model, dispersions, directory, findings)
        if design == "table":
            dispersions = table_dispersions(table, dispersions, findings)
    count = None
    if section is not None and ("inputs" not in document or upstream is not None):
        rows = 0 if upstream is None else (first.cases if first is not None else upstream.rows.n_cases)
        count = chained_count(section, rows, inside) if rows else _case_count(section, dispersions, table, inside)
    if count is not None:
        check_size(count, design or "", dispersions, correlations, inside)
    retention = check_retention(sections.retention, model, count, shortened, findings.under("retention"))
    names = [dispersion.name for dispersion in dispersions]
    tuning = check_tuning(sections.tuning, model, names, design, findings.under("tuning"))
    flown_before = None if upstream is None else upstream.name
    under_sensitivity = findings.under("sensitivity")
    sensitivity = check_sensitivity(
        sections.sensitivity, model, dispersions, faulty, correlations, design, flown_before, under_sensitivity
    )
    if section is None or count is None or findings.problems:
        return None
    beside = directory.resolve()
    tables = [beside / dispersion.spec["file"] for dispersion in dispersions if dispersion.dist == "empirical"]
    tables += [table_path] if table_path is not None else []
    read = dict.fromkeys([*tables, *(beside / name for name in messages)])
    files = {path: sha256(path.read_bytes()).hexdigest() for path in read}
    return Campaign(
        name=name,
        title=section.title or model.title,
        note=section.note,
        text=text,
        directory=directory,
        model=model,
        model_reference=model.reference,
        cases=count,
        design=section.design,
        seed=section.seed or 0,
        parameters={key: nominal[key] for key in sections.parameters},
        nominal=nominal,
        dispersions=dispersions,
        correlations=correlations,
        requirements=requirements,
        retention=retention,
        digest=_digest(document, section, dispersions, [files[path] for path in tables], upstream),
        table_path=table_path,
        table=table,
        tuning=tuning,
        upstream=upstream,
        first=first,
        files=files,
        sensitivity=sensitivity,
        report=sections.report or ReportSection(),
    )


def _table_of(document: dict[str, Any], name: str) -> dict[str, Any]:
    """The table of this name as written; empty where it is no table."""
    section = document.get(name)
    return section if isinstance(section, dict) else {}


def _named_design(document: dict[str, Any]) -> str | None:
    """The design, even where other keys of [campaign] are wrong: dispersions are checked against it."""
    design = _table_of(document, "campaign").get("design")
    return design if isinstance(design, str) and design in DESIGNS else None


def _nominal_inputs(
    model: System, sections: Sections, upstream: Mapping[str, Scalar], findings: Findings
) -> dict[str, Scalar]:
    section_findings = findings.under("parameters")
    before = len(findings.problems)
    nominal = {**nominal_values(model, sections.parameters, section_findings), **upstream}
    if len(findings.problems) == before:
        try:
            sentence = refusal(model, nominal)
        except ModelError as error:
            findings.under("campaign").add("model", str(error))
        else:
            if sentence:
                section_findings.add("", f"the nominal case cannot be flown: {sentence}")
    return nominal


def _unknown_names(
    document: dict[str, Any], sections: Sections, nominal: Mapping[str, Scalar], model: System, findings: Findings
) -> None:
    """Note unknown parameters and metrics in sections that have mistakes of their own."""
    for name in _table_of(document, "dispersion"):
        if name not in sections.dispersions and name not in nominal:
            findings.under("dispersion", name).add(
                "", f"is not a parameter of {model.name}{hint(name, inputs_of(model))}"
            )
    for name, raw in _table_of(document, "requirement").items():
        metric = raw.get("metric") if isinstance(raw, dict) else None
        if name not in sections.requirements and isinstance(metric, str):
            check_metric(metric, model, findings.under("requirement", name))


def _dispersions(
    sections: Sections,
    model: System,
    nominal: Mapping[str, Scalar],
    design: str | None,
    directory: Path,
    findings: Findings,
) -> tuple[Dispersion, ...]:
    built = []
    for name, section in sections.dispersions.items():
        section_findings = findings.under("dispersion", name)
        if name not in nominal:
            near = "" if findings.full else hint(name, inputs_of(model))
            section_findings.add("", f"is not a parameter of {model.name}{near}")
        elif design is not None:  # without a design it is unknown which keys make sense
            built.append(
                build_dispersion(name, section, model.input(name), nominal[name], design, directory, section_findings)
            )
    return tuple(built)


def _case_count(
    section: CampaignSection, dispersions: tuple[Dispersion, ...], table: Mapping[str, np.ndarray], findings: Findings
) -> int | None:
    """How many cases the design has; None where that is unknown."""
    if section.design in (*RANDOM, *IN_BLOCKS):
        for key, value in (("cases", section.cases), ("seed", section.seed)):
            if value is None:
                findings.add(key, f"is missing: {CampaignSection.model_fields[key].description}")
        return section.cases
    if findings.problems:
        return None
    if section.design in BY_LEVELS:
        count = level_count(section.design, [len(dispersion.levels) for dispersion in dispersions])
    else:
        count = len(next(iter(table.values())))
    if count > MOST_CASES:
        findings.add("design", f"{count} cases; at most {MOST_CASES} are possible")
        return None
    if section.cases not in (None, count):
        findings.add(
            "cases", f'{section.cases} is not allowed; the design "{section.design}" has {count} cases by itself'
        )
    return count


def _digest(
    document: dict[str, Any],
    section: CampaignSection,
    dispersions: tuple[Dispersion, ...],
    tables: Sequence[str],
    upstream: "Upstream | None",
) -> str:
    content = json.loads(json.dumps(document, default=str))  # TOML has dates, JSON has none
    if section.design != "lhs":
        content["campaign"].pop("cases", None)
    content.pop("report", None)  # how a run is told, not what it is
    content["campaign"]["seed"] = section.seed or 0  # a grid may do without one, and is resumed with 0
    order = [dispersion.name for dispersion in dispersions]
    digest = sha256(json.dumps([content, order], sort_keys=True).encode())
    for table in tables:
        digest.update(bytes.fromhex(table))
    if upstream is not None:
        digest.update(upstream.rows.digest.encode())
    return digest.hexdigest()
