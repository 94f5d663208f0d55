"""Reads the sections of a campaign file; each mistake becomes one sentence with its location in the file.

A mistake in one section does not hide those in others: each table is validated separately (pydantic).
"""

import ast
import json
import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from mc_engine.campaign.sections import (
    DISTRIBUTIONS,
    CampaignFile,
    CampaignSection,
    ConstraintSection,
    CorrelationSection,
    DispersionSection,
    InputsSection,
    LevelsDispersion,
    ObjectiveSection,
    PublishedPointSection,
    RequirementSection,
    RetentionSection,
    SensitivitySection,
    TunedSection,
    TuningSection,
    Value,
)
from mc_engine.errors import MOST_SHOWN, CampaignError, Problem
from mc_engine.model.program import SimulatorSection
from mc_engine.sampling.distributions import Scalar
from mc_engine.section import ReportSection, Section
from mc_engine.suggestions import hint, listed, nearest

_VALUE: TypeAdapter[Scalar] = TypeAdapter(Value)
_TAGS = ("one", "many")  # pydantic puts the tag of a union into the place
_AnySection = TypeVar("_AnySection", bound=Section)

_FREE_NAME = re.compile(r"\w[\w-]{0,59}")  # of what the file itself names; it stands in reports and on terminals

# tomllib takes a time that grows with the square of the parts of a dotted key; a campaign file has keys of three.
_LONG_KEY = re.compile(r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){32}""")

_LARGEST_EXACT = 2**53  # whole number of which a float64 has all digits

_MESSAGES = {
    "int_type": "{shown} is not a whole number{whole}",
    "float_type": "{shown} is not a number",
    "finite_number": "{shown} is not a finite number",
    "scalar": "{shown} is neither a number, nor true or false, nor a word",
    "string_type": "{shown} is not text in quotes",
    "bool_type": "{shown} is neither true nor false",
    "list_type": "{shown} is not a list in brackets",
    "model_type": "{shown} is not a table",
    "dict_type": "{shown} is not a table",
    "greater_than": "{shown} is not allowed; it must be above {gt}",
    "greater_than_equal": "{shown} is not allowed; it must be at least {ge}",
    "less_than": "{shown} is not allowed; it must be below {lt}",
    "less_than_equal": "{shown} is not allowed; it must be at most {le}",
    "nearly_an_end": "{shown} is not allowed; it must be away from 0 and 1 by {least} at least",
    "too_short": "{actual_length} given; at least {min_length} needed",
    "too_long": "{actual_length} given; at most {max_length} allowed",
    "string_too_short": "{shown} is empty",
    "string_too_long": "{shown} is too long; at most {max_length} letters are allowed",
    "not_printable": "{shown} has letters that cannot be seen; leave them out",
    "not_one_line": "{shown} is of more than one line; write it in one",
}


@dataclass(frozen=True)
class Findings:
    """The problems found so far, and the place in the file that is being checked."""

    place: str = ""
    problems: list[Problem] = field(default_factory=list)

    def under(self, *names: str) -> "Findings":
        """The same list of problems, for a place one or more steps further in."""
        readable = [name if name.isprintable() else json.dumps(name) for name in names]
        return Findings(".".join(part for part in (self.place, *readable) if part), self.problems)

    @property
    def full(self) -> bool:
        """Whether so many problems are known that no further one is shown, and suggestions need not be searched."""
        return len(self.problems) >= MOST_SHOWN

    def add(self, key: str, message: str) -> None:
        """Note a problem with `key` of the current place, or with the place itself where `key` is empty."""
        self.problems.append(Problem(self.under(key).place, message))


@dataclass(frozen=True)
class Sections:
    """The sections of a campaign file that could be read; those with mistakes are None or left out."""

    campaign: CampaignSection | None
    parameters: dict[str, Scalar]
    dispersions: dict[str, DispersionSection]
    correlations: dict[str, CorrelationSection]  # by place: "correlation 1", "correlation 2", ...
    requirements: dict[str, RequirementSection]
    retention: RetentionSection | None
    tuning: "TuningSections | None"
    inputs: InputsSection | None
    sensitivity: SensitivitySection | None
    report: ReportSection | None
    program: SimulatorSection | None


@dataclass(frozen=True)
class TuningSections:
    """What could be read of [tuning]; `head` has its plain keys, `objective_names` every name written in the file."""

    head: TuningSection | None
    parameters: dict[str, TunedSection]
    objectives: dict[str, ObjectiveSection]
    constraints: dict[str, ConstraintSection]
    published: dict[str, PublishedPointSection]  # by place: "published 1", "published 2", ...
    objective_names: tuple[str, ...]


_TOML_FIXES = {  # by what `tomllib` says
    "Invalid value": "; a text stands in quotes, a truth value is true or false, a number begins with a sign or digit",
    "Cannot overwrite a value": "; a name stands once in its section",
}


def parse_toml(text: str, source: str) -> dict[str, Any]:
    """The text as a document; CampaignError with line and column where it is not TOML."""
    if match := _LONG_KEY.search(text):
        line = text.count("\n", 0, match.start()) + 1
        raise CampaignError(source, [Problem(f"line {line}", "a name of so many parts is none of a campaign file's")])
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        match = re.fullmatch(r"(.*) \(at (line \d+, column \d+|end of document)\)", str(error), re.DOTALL)
        message, place = match.groups() if match else (str(error), "")
        raise CampaignError(source, [Problem(place, f"this is not TOML: {_in_words_of_toml(message)}")]) from None
    except (ValueError, RecursionError) as error:
        raise CampaignError(source, [Problem("", f"this is not TOML that can be read: {error}")]) from None


def _in_words_of_toml(message: str) -> str:
    """What `tomllib` says, with the names of tables as they are written, and with the usual fix."""
    if match := re.fullmatch(r"Cannot declare (\(.*\)) twice", message, re.DOTALL):
        message = f"Cannot declare [{'.'.join(ast.literal_eval(match[1]))}] twice"
    return _lower_first(message) + _TOML_FIXES.get(message, "")


_OF_OTHERS = {"settings": "; settings are given in [parameters]"}


def read_sections(document: dict[str, Any], findings: Findings) -> Sections:
    """Read every section, noting all that is wrong inside each."""
    for name in document:
        if name not in CampaignFile.model_fields:
            near = "" if findings.full else _OF_OTHERS.get(name) or hint(name, CampaignFile.model_fields)
            findings.add(name, f"is not a section{near}")
    if "campaign" not in document:
        findings.add("campaign", "is missing: the table [campaign] with model, design, ...")
    inside = {name: findings.under(name) for name in CampaignFile.model_fields}
    _note_what_flies(document, inside["campaign"])
    return Sections(
        campaign=_optional(CampaignSection, document, inside),
        parameters=_parameters(document, inside["parameters"]),
        dispersions=_tables(_dispersion, document, "dispersion", findings),
        correlations=_tables(CorrelationSection, document, "correlation", findings, listed=True),
        requirements=_tables(RequirementSection, document, "requirement", findings, free=True),
        retention=read(RetentionSection, document.get("retention", {}), inside["retention"]),
        tuning=_tuning(document["tuning"], inside["tuning"]) if "tuning" in document else None,
        inputs=_optional(InputsSection, document, inside),
        sensitivity=_optional(SensitivitySection, document, inside),
        report=read(ReportSection, document.get("report", {}), inside["report"]),
        program=_optional(SimulatorSection, document, inside),
    )


def _note_what_flies(document: dict[str, Any], findings: Findings) -> None:
    """Note a file that names neither a model nor a simulator, or both."""
    section = document.get("campaign")
    named = [key for key in ("model", "simulator") if isinstance(section, dict) and key in section]
    if "simulator" in document:
        for key in named:
            findings.add(key, "is there beside the table [simulator]; leave one of them out")
    elif isinstance(section, dict) and len(named) != 1:
        missing = f"is missing: {CampaignSection.model_fields['model'].description}"
        findings.add("model", "is there beside simulator; leave one of them out" if named else missing)


def _optional(section: type[_AnySection], document: dict[str, Any], inside: dict[str, Findings]) -> _AnySection | None:
    name = section.__name__.removesuffix("Section").lower()
    return read(section, document[name], inside[name]) if name in document else None


def read(section: type[_AnySection], raw: Any, findings: Findings) -> _AnySection | None:
    """`raw` as a section, or None with all its mistakes noted."""
    try:
        return section.model_validate(raw)
    except ValidationError as error:
        mistakes = error.errors(include_url=False)
        for details in mistakes[:MOST_SHOWN]:
            findings.add(_place(raw, details["loc"]), _message(section, details))
        # nobody is shown the rest: it is only counted
        findings.problems.extend(Problem(findings.place, details["msg"]) for details in mistakes[MOST_SHOWN:])
        return None


def shown(value: Any) -> str:
    """A value as the campaign file writes it, shortened where it is long."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a table"
    try:
        text = json.dumps(value, ensure_ascii=False) if isinstance(value, str) else str(value)
    except ValueError:  # a whole number of thousands of digits
        return "a number of that size"
    return text if len(text) <= 60 else f"{text[:57]}..."


def name_fault(name: str) -> str:
    """Why a file cannot choose such a name, as a sentence; empty if it can."""
    return "" if _FREE_NAME.fullmatch(name) else f"{shown(name)} is no name; use letters, digits, _ and -, 60 at most"


def _tables(
    section: type[_AnySection] | Callable[[Any, Findings], _AnySection | None],
    document: dict[str, Any],
    name: str,
    findings: Findings,
    *,
    listed: bool = False,
    free: bool = False,
) -> dict[str, _AnySection]:
    """The tables [name.NAME] of a document that could be read, by name; of a list [[name]] by place, "name 1".

    section : class of each, or what reads one.  free : the file chooses the names; one that is no word is left out.
    """
    raw: Any = document.get(name, [] if listed else {})
    if type(raw) is not (list if listed else dict):
        header = f"{findings.place}.{name}" if findings.place else name
        of_list = f"a list of tables; write [[{header}]] with two brackets"
        findings.add(name, f"{shown(raw)} is not {of_list if listed else f'a table; write [{header}.NAME]'}")
        return {}
    reader = partial(read, section) if isinstance(section, type) else section
    if isinstance(raw, list):
        raw = {f"{name} {k}": entry for k, entry in enumerate(raw, start=1)}
    sections = {}
    for key, entry in raw.items():
        if free and (sentence := name_fault(key)):
            findings.add(name, sentence)
        elif (table := reader(entry, findings.under(key) if listed else findings.under(name, key))) is not None:
            sections[key] = table
    return sections


def _tuning(raw: Any, findings: Findings) -> TuningSections | None:
    """[tuning], each of its tables read separately, so that a mistake in one does not hide those in others."""
    if not isinstance(raw, dict):
        findings.add("", f"{shown(raw)} is not a table; write [tuning]")
        return None
    tables = ("parameter", "objective", "constraint", "published")
    objectives = raw.get("objective")
    return TuningSections(
        head=read(TuningSection, {key: value for key, value in raw.items() if key not in tables}, findings),
        parameters=_tables(TunedSection, raw, "parameter", findings),
        objectives=_tables(ObjectiveSection, raw, "objective", findings, free=True),
        constraints=_tables(ConstraintSection, raw, "constraint", findings, free=True),
        published=_tables(PublishedPointSection, raw, "published", findings, listed=True),
        objective_names=tuple(objectives) if isinstance(objectives, dict) else (),
    )


def _parameters(document: dict[str, Any], findings: Findings) -> dict[str, Scalar]:
    raw = document.get("parameters", {})
    if not isinstance(raw, dict):
        findings.add("", f"{shown(raw)} is not a table; write [parameters]")
        return {}
    values: dict[str, Scalar] = {}
    for name, value in raw.items():
        try:
            values[name] = _VALUE.validate_python(value)
        except ValidationError as error:
            findings.add(name, _message(None, error.errors(include_url=False)[0]))
    return values


def _dispersion(raw: Any, findings: Findings) -> DispersionSection | None:
    """The section of the distribution that `dist` names; the keys allowed depend on it."""
    dist = raw.get("dist") if isinstance(raw, dict) else None
    if dist is None:
        slip = _slip_of_dist(raw) if isinstance(raw, dict) else None
        if slip is None:
            return read(LevelsDispersion, raw, findings)
        findings.add(slip, 'is not a known key; did you mean "dist"?')
        dist = raw[slip]
        raw = {"dist": dist, **{key: value for key, value in raw.items() if key != slip}}
    if not isinstance(dist, str):
        findings.add("dist", f"{shown(dist)} is not text in quotes; known are {listed(DISTRIBUTIONS)}")
        return None
    if dist not in DISTRIBUTIONS:
        findings.add("dist", f'"{dist}" is not known{hint(dist, DISTRIBUTIONS)}')
        return None
    return read(DISTRIBUTIONS[dist], raw, findings)


def _slip_of_dist(raw: dict[str, Any]) -> str | None:
    """The misspelt key that was meant to be `dist`: without it no other key of a dispersion can be checked."""
    known = [*LevelsDispersion.model_fields, "dist"]
    others = [key for key in raw if not any(key in section.model_fields for section in DISTRIBUTIONS.values())]
    return next((key for key in others if nearest(key, known) == "dist"), None)


def _place(raw: Any, location: tuple[int | str, ...]) -> str:
    """The location as a reader finds it: names with dots, places in a list counted from 1."""
    place = ""
    for part in location:
        if isinstance(part, int):
            place += f" {part + 1}"
            raw = raw[part]
        elif part not in _TAGS or (isinstance(raw, dict) and part in raw):
            place += f".{part}" if place else part
            raw = raw.get(part) if isinstance(raw, dict) else None
    return place


def _message(section: type[Section] | None, details: ErrorDetails) -> str:
    kind, context, location = details["type"], details.get("ctx", {}), details["loc"]
    value = details["input"]
    if kind == "missing" and section is not None:
        return f"is missing: {_keys(_class_at(section, location))[str(location[-1])].description}"
    if kind == "extra_forbidden" and section is not None:
        key = str(location[-1])
        owners = [dist for dist, other in DISTRIBUTIONS.items() if key in other.model_fields]
        if section is LevelsDispersion and owners:
            return f"is a key of {listed(owners)}; dist is missing"
        return f"is not a known key{hint(key, _keys(_class_at(section, location)))}"
    if kind == "literal_error" and location[-1:] == ("design",) and value == "halton":
        return '"halton" is no longer offered; use "sobol"'
    if kind == "literal_error":
        allowed = re.findall(r"'([^']*)'", context["expected"])
        if isinstance(value, str):
            return f"{shown(value)} is not known{hint(value, allowed)}"
        return f"{shown(value)} is not one of {listed(allowed)}"
    whole = ""
    if kind == "int_type" and isinstance(value, float) and value.is_integer() and isinstance(location[-1], str):
        least, most = _range_of(section, location)
        if least <= value <= most:
            whole = f"; write {int(value)}"
        else:
            kind, context = ("less_than_equal", {"le": most}) if value > most else ("greater_than_equal", {"ge": least})
    limits = {key: f"{limit:g}" if isinstance(limit, float) else limit for key, limit in context.items()}
    template = _MESSAGES.get(kind)
    if template is None:
        return f"{shown(value)}: {_lower_first(details['msg'])}"
    return template.format(shown=shown(value), whole=whole, **limits)


def _range_of(section: type[Section] | None, location: tuple[int | str, ...]) -> tuple[int, int]:
    """(least, most) of the whole numbers that a key takes."""
    field = _keys(_class_at(section, location)).get(str(location[-1])) if section is not None else None
    limits = field.metadata if field is not None else []
    least = max((limit.ge for limit in limits if hasattr(limit, "ge")), default=-_LARGEST_EXACT)
    return least, min((limit.le for limit in limits if hasattr(limit, "le")), default=_LARGEST_EXACT)


def _keys(section: type[BaseModel]) -> dict[str, FieldInfo]:
    """The keys as the file writes them: `from` is a word of Python, and has another name inside."""
    return {field.alias or name: field for name, field in section.model_fields.items()}


def _class_at(section: type[BaseModel], location: tuple[int | str, ...]) -> type[BaseModel]:
    """The class whose key stands last in `location`."""
    for part in location[:-1]:
        if part in section.model_fields:
            section = _section_in(section.model_fields[str(part)].annotation) or section
    return section


def _section_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((nested for part in get_args(annotation) if (nested := _section_in(part))), None)


def _lower_first(message: str) -> str:
    return message[:1].lower() + message[1:]
