"""A user's own sections of a report, from a template: Markdown with Jinja expressions over the run.

    # Propellant budget

    Of {{ run.n_tried }} cases, {{ run.requirements.fuel.passed }} stay inside the tank; 99.865 % of them need
    {{ run.metrics.propellant_kg.quantile(0.99865).upper }} kg or less.

    {{ table("requirements") }}

    {{ figure("maps") }}

A template sees `run` and, in the order of the command, `runs` (`RunFacts`), and places any table or figure of the
report with `table(NAME)` and `figure(NAME)`, a line of its own each; NAME is the anchor of its section, -2, -3, ...
for the further ones.  Values of the run are written as text: they are never read as Markdown, nor as Jinja.  The
template runs in Jinja's sandbox: no imports, no files, no private members.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import jinja2
from jinja2.sandbox import ImmutableSandboxedEnvironment

from mc_engine.errors import EngineError
from mc_engine.statistics import summarize
from reports.document import Block, Document, FigureBlock, Table, numbered
from reports.flown import Flown
from reports.markdown import escaped
from reports.markdown_blocks import sections_of
from reports.numbers import count, number, percent

ANCHOR = "own"
_BEGIN, _END = "\ue000", "\ue001"  # private characters about the place of a table or figure
_PLACE = re.compile(f"{_BEGIN}(\\d+){_END}")
_FRAME = "<template>"
_FAULTS = (jinja2.TemplateError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError)


class TemplateError(EngineError):
    """A template cannot be read or filled in; the text names its file and line."""


# ---- what a template sees


@dataclass(frozen=True)
class QuantileFacts:
    """value of a quantile and its distribution-free limits; None what the cases are too few for."""

    value: float | None
    lower: float | None
    upper: float | None


@dataclass(frozen=True)
class MetricFacts:
    """A metric: unit, n_used of n_tried, nominal, mean, sd, minimum, maximum, and `quantile(0.99865)`."""

    unit: str
    n_used: int
    n_tried: int
    nominal: float | None
    mean: float | None
    sd: float | None
    minimum: float | None
    maximum: float | None
    _values: Any = field(repr=False)

    def quantile(self, probability: float) -> QuantileFacts:
        """The quantile and its limits, each holding with 95 %."""
        if not 0.0 < probability < 1.0:
            raise ValueError(f"quantile({probability}): a probability lies between 0 and 1")
        found = summarize(self._values, probabilities=(probability,)).at(probability)
        return QuantileFacts(found.value, found.lower, found.upper) if found else QuantileFacts(None, None, None)


@dataclass(frozen=True)
class RunFacts:
    """A run as a template sees it.

    name, title, design, seed, n_tried, n_ok, n_wanted; metrics, requirements (verdicts: outcome, passed, tried, share,
    confidence, lower, upper, at_most, at_least, ...), parameters (their values) and inputs (records: unit, nominal,
    distribution, source, description), each by name.
    """

    name: str
    title: str
    design: str
    seed: Any
    n_tried: int
    n_ok: int
    n_wanted: int
    metrics: Mapping[str, MetricFacts]
    requirements: Mapping[str, Any]
    parameters: Mapping[str, Any]
    inputs: Mapping[str, Mapping[str, Any]]


def run_facts(flown: Flown, title: str) -> RunFacts:
    """What templates may say of a run."""
    metrics = {
        name: MetricFacts(
            unit=flown.unit(name),
            n_used=found.n_used,
            n_tried=found.n_tried,
            nominal=flown.nominal_value(name),
            mean=found.mean,
            sd=found.sd,
            minimum=found.minimum,
            maximum=found.maximum,
            _values=flown.values(name),
        )
        for name, found in flown.summaries.items()
    }
    return RunFacts(
        name=flown.name,
        title=title,
        design=flown.design,
        seed=flown.campaign.get("seed"),
        n_tried=flown.n_tried,
        n_ok=int(flown.ok.sum()),
        n_wanted=flown.n_wanted,
        metrics=metrics,
        requirements={verdict.name: verdict for verdict in flown.verdicts},
        parameters={record["name"]: record.get("value") for record in flown.manifest.get("parameters", [])},
        inputs={record["name"]: record for record in flown.manifest.get("inputs", [])},
    )


# ---- filling it in


def with_own_sections(document: Document, template: Path, run: RunFacts, runs: Sequence[RunFacts]) -> Document:
    """The document with the template's sections before its own ones, numbered anew.

    Raises TemplateError, one sentence with the line, for whatever is wrong with the template.
    """
    placed = _Placed(document)
    try:
        source = template.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is not UTF-8 text"
        raise TemplateError(f"{template}: {reason}") from None
    text = _filled_in(
        template, source, {"run": run, "runs": list(runs), "table": placed.table, "figure": placed.figure}
    )
    try:
        own = sections_of(text, placed.blocks, ANCHOR)
    except ValueError as error:
        raise TemplateError(f"{template}: {error}") from None
    return numbered(replace(document, sections=(*own, *document.sections)))


def _filled_in(template: Path, source: str, names: Mapping[str, Any]) -> str:
    environment = ImmutableSandboxedEnvironment(undefined=jinja2.StrictUndefined, finalize=_written)
    environment.filters |= {"number": number, "percent": percent, "count": count}
    try:
        return environment.from_string(source).render(names)
    except _FAULTS as error:
        line = _line(error)
        place = f"{template}, line {line}" if line else str(template)
        raise TemplateError(f"{place}: {' '.join(str(error).split()) or type(error).__name__}") from None


def _line(error: Exception) -> int | None:
    """The template's line that an error rose from."""
    if isinstance(error, jinja2.TemplateSyntaxError):
        return error.lineno
    line, frame = None, error.__traceback__
    while frame is not None:
        line = frame.tb_lineno if frame.tb_frame.f_code.co_filename == _FRAME else line
        frame = frame.tb_next
    return line


def _written(value: Any) -> Any:
    """A value of the run as text that Markdown leaves alone."""
    if isinstance(value, _Place | jinja2.Undefined):
        return value
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "–"}[value]
    if isinstance(value, int):
        return count(value)
    if isinstance(value, float):
        return number(value)
    return escaped(str(value).replace(_BEGIN, "").replace(_END, ""))


class _Place(str):
    """Where a table or figure stands in the filled-in text."""


class _Placed:
    """The tables and figures of a document by name, and those that a template has placed."""

    def __init__(self, document: Document):
        kinds: tuple[type, ...] = (Table, FigureBlock)
        self.named = {kind: _named(document, kind) for kind in kinds}
        self.chosen: list[Block] = []

    def table(self, name: str) -> _Place:
        """A table of the report."""
        return self._place(Table, "table", name)

    def figure(self, name: str) -> _Place:
        """A figure of the report."""
        return self._place(FigureBlock, "figure", name)

    def _place(self, kind: type, word: str, name: str) -> _Place:
        known = self.named[kind]
        if name not in known:
            raise LookupError(f"there is no {word} “{name}”; this report has {', '.join(known) or 'none'}")
        self.chosen.append(known[name])
        return _Place(f"\n\n{_BEGIN}{len(self.chosen) - 1}{_END}\n\n")

    def blocks(self, text: str) -> list[Block] | None:
        """The blocks that a paragraph stands for; None for a paragraph of text."""
        found = _PLACE.findall(text)
        return [self.chosen[int(index)] for index in found] if found else None


def _named(document: Document, kind: type) -> dict[str, Block]:
    """Tables or figures by their section's anchor: maps, maps-2, ..."""
    named: dict[str, Block] = {}
    for section in document.sections:
        blocks = [block for block in section.blocks if isinstance(block, kind)]
        for place, block in enumerate(blocks, start=1):
            named[section.anchor if place == 1 else f"{section.anchor}-{place}"] = block
    return named
