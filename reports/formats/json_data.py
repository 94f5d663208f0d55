"""The report as data: `report.json`, with the contents of the pages and a documented schema.

The numbers have all their digits, in the unit of their column.  `sections` has the texts and tables of the pages as
printed; all other fields are for programs.
"""

import json
from dataclasses import asdict
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict

from mc_engine.statistics import Summary, Verdict
from mc_engine.statistics.moments import number_or_none
from reports.document.blocks import Document, FigureBlock, Table, Terms, Text
from reports.run.flown import Flown

FILE = "report.json"
WORST = 10  # cases of a requirement

Bounds = Literal["fixed number of cases", "every number of cases"]


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Counts(_Record):
    """Numbers of cases.

    cases : of the complete run.  flown : with a row in the table.  completed : with status ok.  inside_all_limits : of
    those completed.
    """

    cases: int
    flown: int
    completed: int
    inside_all_limits: int


class RequirementRecord(_Record):
    """A requirement and what the cases demonstrate.

    observed_probability : the fraction of cases inside the limits, passed / tried.  None, like all other probabilities,
        for a design without probabilities, such as a grid.
    demonstrated_probability : the lower confidence bound on the probability of being inside the limits.
    demonstrated : the tolerance limit of the metric with the required probability and confidence.  A requirement with
        two limits has `enclosed` instead: both limits, moved inward by the margin.
    margin : from the demonstrated bound to the nearest limit, negative outside.
    bounds : validity of the bounds on the probability, and so of the verdict: for a "fixed number of cases" or, if that
        was not fixed in advance, for "every number of cases" at once; None without bounds, as for a grid.
    failing : for the joint verdict, the requirements that make it fail although its own fraction does not.
    """

    name: str
    metric: str
    unit: str
    at_most: float | None
    at_least: float | None
    required_probability: float
    confidence: float
    passed: int
    tried: int
    without_number: int
    observed_probability: float | None
    demonstrated_probability: float | None
    demonstrated: float | None
    enclosed: tuple[float, float] | None
    margin: float | None
    verdict: str
    bounds: Bounds | None
    failing: list[str] = []


class QuantileRecord(_Record):
    """A quantile with its confidence interval; None for a bound for which the cases are too few."""

    probability: float
    value: float
    lower: float | None
    upper: float | None


class MetricRecord(_Record):
    """Statistics of a metric over the n_used cases, of n_tried, that have a number.

    integration_change : largest change with half of the step, or a tenth of the tolerances and at least 2000 steps,
        in the run's first cases
    """

    name: str
    unit: str
    description: str
    n_used: int
    n_tried: int
    nominal: float | None
    mean: float | None
    sigma: float | None
    minimum: float | None
    maximum: float | None
    integration_change: float | None
    quantiles: list[QuantileRecord]


class ContributorRecord(_Record):
    """Fractions of a metric's variance.  input : a parameter, a group, "random draws" or "unexplained".

    first, total : effects, in [0, 1].  Without flights for the contributors, a total effect may be larger by up to the
    "unexplained" fraction, which is part of its interval; parameters that select a random draw then have no row of
    their own, and their effect is in "unexplained".
    fall : the fraction by which the variance falls with the input at its nominal value, if that was flown; for "random
    draws", with the parameters that select a draw at theirs, while noise made in flight stays.
    """

    metric: str
    input: str
    first: float | None
    total: float | None
    first_interval: tuple[float, float] | None
    total_interval: tuple[float, float] | None
    fall: float | None = None
    fall_interval: tuple[float, float] | None = None


class WorstRecord(_Record):
    """One of the worst cases of a requirement.

    margin : to the nearest limit, in the unit of the metric, negative outside.
    """

    requirement: str
    case_id: int
    value: float
    margin: float


class TextRecord(_Record):
    """A text, table, figure or glossary of the pages, as it is printed."""

    kind: Literal["text", "table", "figure", "terms"]
    number: int | None = None
    caption: str = ""
    columns: list[str] = []
    rows: list[list[str]] = []
    text: list[str] = []


class SectionRecord(_Record):
    title: str
    blocks: list[TextRecord]


class ReportRecord(_Record):
    """The content of `report.json`.

    contributor_flights : cases flown only for the contributors; 0: contributors were computed from the table.
    probability, confidence : of all statistics except verdicts; each bound of a quantile has this confidence.
    joint : the verdict on all requirements at once, without a metric; None for fewer than two.
    """

    format: Literal[1] = 1
    title: str
    summary: str
    campaign: dict[str, str]
    warnings: list[str]
    probability: float | None = None
    confidence: float | None = None
    counts: Counts | None = None
    requirements: list[RequirementRecord] = []
    joint: RequirementRecord | None = None
    metrics: list[MetricRecord] = []
    contributors: list[ContributorRecord] = []
    contributor_flights: int = 0
    worst: list[WorstRecord] = []
    sections: list[SectionRecord]


def schema() -> dict[str, Any]:
    """The JSON schema of `report.json`."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **ReportRecord.model_json_schema()}


def render_json(document: Document) -> bytes:
    """The file, UTF-8."""
    record = ReportRecord(
        title=document.title,
        summary=document.subtitle,
        campaign=dict(document.facts),
        warnings=list(document.warnings),
        sections=[
            SectionRecord(title=section.title, blocks=[_block_record(block) for block in section.blocks])
            for section in document.sections
        ],
        **document.data,
    )
    return (json.dumps(record.model_dump(), indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()


def run_data(flown: Flown) -> dict[str, Any]:
    """The numbers of a run's report, by the fields of ReportRecord."""
    contributions, integration = flown.contributions, flown.integration
    rows = [] if contributions is None else contributions.rows()
    changes = {} if integration is None else integration.changes
    return {
        "probability": flown.stated.probability,
        "confidence": flown.stated.confidence,
        "counts": _counts_record(flown),
        "requirements": [_requirement_record(flown, verdict) for verdict in flown.verdicts],
        "joint": None if flown.joint is None else _requirement_record(flown, flown.joint),
        "metrics": [
            _metric_record(flown, name, summary, changes.get(name)) for name, summary in flown.summaries.items()
        ],
        "contributors": [ContributorRecord(**asdict(row)) for row in rows],
        "contributor_flights": 0 if contributions is None else contributions.flights,
        "worst": [record for verdict in flown.verdicts for record in _worst_records(flown, verdict)],
    }


def _counts_record(flown: Flown) -> Counts:
    inside = flown.every.inside_all
    return Counts(cases=flown.n_wanted, flown=flown.n_tried, completed=flown.every.completed, inside_all_limits=inside)


def _requirement_record(flown: Flown, verdict: Verdict) -> RequirementRecord:
    return RequirementRecord(
        name=verdict.name,
        metric=verdict.metric,
        unit=flown.unit(verdict.metric),
        at_most=verdict.at_most,
        at_least=verdict.at_least,
        required_probability=verdict.share,
        confidence=verdict.confidence,
        passed=verdict.passed,
        tried=verdict.tried,
        without_number=verdict.no_number,
        observed_probability=verdict.estimate if verdict.random else None,
        demonstrated_probability=verdict.lower,
        demonstrated=number_or_none(verdict.demonstrated),
        enclosed=verdict.enclosed,
        margin=number_or_none(verdict.margin),
        verdict=verdict.outcome,
        bounds=_bounds(verdict),
        failing=list(verdict.failing),
    )


def _bounds(verdict: Verdict) -> Bounds | None:
    if verdict.lower is None:
        return None
    return "every number of cases" if verdict.looked else "fixed number of cases"


def _metric_record(flown: Flown, name: str, summary: Summary, change: float | None) -> MetricRecord:
    facts = flown.columns[name]
    return MetricRecord(
        name=name,
        unit=facts.unit,
        description=facts.description,
        n_used=summary.n_used,
        n_tried=summary.n_tried,
        nominal=flown.nominal_value(name),
        mean=number_or_none(summary.mean),
        sigma=number_or_none(summary.sd),
        minimum=summary.minimum,
        maximum=summary.maximum,
        integration_change=change,
        quantiles=[QuantileRecord(**asdict(quantile)) for quantile in summary.quantiles],
    )


def _worst_records(flown: Flown, verdict: Verdict) -> list[WorstRecord]:
    worst = flown.every.worst(verdict.metric, WORST, verdict.limits)
    values = worst[verdict.metric].to_numpy(dtype=np.float64)
    margins = verdict.limits.margins(values) * verdict.limits.reach
    return [
        WorstRecord(requirement=verdict.name, case_id=int(case), value=float(value), margin=float(margin))
        for case, value, margin in zip(worst["case_id"], values, margins, strict=True)
    ]


def _block_record(block: Any) -> TextRecord:
    if isinstance(block, Table):
        rows = [[f"{cell.text} ({cell.small})" if cell.small else cell.text for cell in row] for row in block.rows]
        note = [block.note] if block.note else []
        titles = [column.title for column in block.columns]
        return TextRecord(
            kind="table", number=block.number, caption=block.caption, columns=titles, rows=rows, text=note
        )
    if isinstance(block, FigureBlock):
        return TextRecord(kind="figure", number=block.number, caption=block.caption, text=[block.drawing.alternative])
    if isinstance(block, Terms):
        return TextRecord(kind="terms", rows=[list(entry) for entry in block.entries])
    assert isinstance(block, Text)
    return TextRecord(kind="text", text=list(block.paragraphs))
