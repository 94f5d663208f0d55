"""The table [simulator] of a campaign file, and the simulator made from a table that names a program.

`mc_engine.model.fmu` does this for an FMU.  The command is started without a shell, in the folder of its case.  The
executable, the files next to the campaign file that the command names, the templates and `files` are the source of the
simulator.
"""

import os
import re
import shutil
import string
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, NamedTuple

from pydantic import Field as Key

from mc_engine.errors import ModelError
from mc_engine.model.fields import Field, Parameter
from mc_engine.model.files import FileFault, resolve_beside
from mc_engine.model.rules import refuse_name
from mc_engine.model.simulator import LARGEST_MIB, LONGEST_S, Simulator
from mc_engine.model.sources import Sources
from mc_engine.section import Section
from mc_engine.suggestions import hint
from mc_engine.units import unit_suffix, units_at_the_end

PLACES = ("folder", "case_id", "seed")  # that a command may name in braces
JSON_INPUT = "json"
Problems = list[tuple[str, str]]
# keys that the record of a simulator has, too
_OF_THE_RECORD = {"time_limit_s", "memory_limit_mib", "slots", "keep", "deterministic", "tolerance"}


class NumberSection(Section):
    """[simulator.output]: a column of the time history."""

    unit: str | None = Key(default=None, description="default: the unit at the end of the name")
    description: str = ""
    low: float | None = Key(default=None, description="smallest possible value; a smaller input is refused")
    high: float | None = Key(default=None, description="largest possible value; a larger input is refused")
    variable: str | None = Key(
        default=None, min_length=1, description="variable of the FMU; default: the name of the column"
    )


class ParameterSection(NumberSection):
    """[simulator.parameter]: an input."""

    default: float = Key(description="the nominal value")


class MetricSection(NumberSection):
    """[simulator.metric]: a result, read by key, path or pattern, or taken from a variable of an FMU."""

    read: str | None = Key(
        default=None, min_length=1, description="key or dotted path in the result; default: the name of the metric"
    )
    pattern: str | None = Key(
        default=None, min_length=1, description="regular expression with one group, searched in stdout"
    )
    take: Literal["final", "max", "min", "time_of_max", "crossing"] | None = Key(
        default=None, description="value taken of an FMU variable's history; default: final"
    )
    level: float | None = Key(
        default=None, description="for a crossing: the level; the metric is the first time at this level"
    )
    sometimes: bool = Key(default=False, description="the metric may be missing or NaN")


class SimulatorSection(Section):
    """[simulator]: a program, or an FMU, that flies one case at a time."""

    command: list[str] = Key(
        default_factory=list,
        description="the executable and its arguments, started without a shell; none for `mc-engine import`",
    )
    fmu: str | None = Key(default=None, min_length=1, description="an FMU of FMI 2 or 3, in place of command")
    stop_time_s: float | None = Key(default=None, gt=0.0, le=LONGEST_S, description="end of the flight of an FMU")
    step_s: float | None = Key(
        default=None, gt=0.0, description="communication step of an FMU, and interval of its history"
    )
    interface: Literal["co-simulation", "model-exchange"] | None = Key(
        default=None, description="for an FMU with both interfaces; default: co-simulation"
    )
    solver_tolerance: float | None = Key(
        default=None, gt=0.0, lt=1.0, description="relative tolerance of the solver; default: that of the FMU, or 1e-8"
    )
    title: str = ""
    input: dict[str, str] = Key(
        default_factory=lambda: {"case.json": JSON_INPUT}, description="input files of the program = their templates"
    )
    result: str | None = Key(default=None, min_length=1, description="result file of the program, .json or .csv")
    history: str | None = Key(
        default=None, min_length=1, description="history file of the program, a CSV whose first column is the time t_s"
    )
    echo: str | None = Key(
        default=None,
        min_length=1,
        description="path in the result at which the program returns the inputs that it used",
    )
    files: list[str] = Key(default_factory=list, description="further files beside this one that the program needs")
    time_limit_s: float | None = Key(default=None, gt=0.0, le=LONGEST_S, description="a longer case ends as time-limit")
    memory_limit_mib: float | None = Key(
        default=None, gt=0.0, le=LARGEST_MIB, description="a larger case ends as memory-limit"
    )
    slots: int | None = Key(
        default=None,
        ge=1,
        le=100_000,
        description="most cases that fly at the same time, such as the number of licences",
    )
    keep: Literal["none", "failed", "all"] = Key(
        default="failed", description="cases whose folders are kept in the run directory"
    )
    deterministic: bool = Key(
        default=True, description="true: replay compares bits; false: numbers may differ by tolerance"
    )
    tolerance: float = Key(
        default=0.0, ge=0.0, lt=1.0, description="largest relative difference of numbers in a replay"
    )
    parameter: dict[str, ParameterSection] = Key(default_factory=dict, description="the inputs, a table for each")
    metric: dict[str, MetricSection] = Key(min_length=1, description="the results, a table for each")
    output: dict[str, NumberSection] = Key(
        default_factory=dict, description="columns of the time history, a table for each"
    )


@dataclass(frozen=True)
class Program:
    """How a program is started, and where its results are.

    command : words with places in braces.  files : contents by name, laid out in the folder `home` of each worker.
    inputs : file name to "json" or the text of a template.  reads : metric to (path, pattern), one of them None.
    """

    command: tuple[str, ...]
    files: Mapping[str, bytes]
    inputs: Mapping[str, str]
    result: str | None
    history: str | None
    echo: str | None
    reads: Mapping[str, tuple[str | None, str | None]]


def program_simulator(section: SimulatorSection, directory: Path, problems: Problems) -> Simulator | None:
    """The simulator that a campaign file describes, or None with the mistakes added to `problems` by key."""
    contents: dict[Path, bytes] = {}
    refuse_keys(section, FMU_KEYS, "of an FMU; give `fmu`, its file, or leave it out", problems)
    refuse_names(section, problems)
    command, outside = _command(section, directory, contents, problems)
    inputs = _inputs(section, directory, contents, problems)
    for name in section.files:
        add_file(name, "files", directory, contents, problems)
    reads = {name: _reading(name, metric, section, problems) for name, metric in section.metric.items()}
    inside = {"result": section.result, "history": section.history, **{f"input.{name}": name for name in section.input}}
    for key, named in inside.items():
        file = named or ""
        if os.path.isabs(file) or os.path.normpath(file).startswith("..") or "\0" in file:
            problems.append((key, f'"{file}" lies outside the folder of the case; name a file in it'))
        if place := next((word for word in PLACES if f"{{{word}}}" in file), ""):
            why = "is only replaced in `command`; each case has its own folder, so name the same file for all"
            problems.append((key, f'the {{{place}}} of "{file}" {why}'))
    if section.result is not None and not section.result.endswith((".json", ".csv")):
        problems.append(("result", f'"{section.result}" ends in neither .json nor .csv'))
    if section.echo is not None and not (section.result or "").endswith(".json"):
        problems.append(("echo", 'is a path in a JSON result; give `result`, such as "result.json"'))
    if section.output and section.history is None and command:  # without a program, `import --history` brings them
        problems.append(("output", "there is no `history` to read these columns from"))
    if problems:
        return None
    files = {path.relative_to(directory.resolve()).as_posix(): content for path, content in contents.items()}
    program = Program(command, files, inputs, section.result, section.history, section.echo, reads)
    name = Path(section.command[0]).stem if command else directory.name
    reference = section.command[0] if command else "[simulator]"
    return described_simulator(
        section, reference, name, Origin(directory, contents, outside), problems, program=program if command else None
    )


class Origin(NamedTuple):
    """The origin of a described simulator: files by path, and what else is part of its source."""

    directory: Path
    contents: Mapping[Path, bytes]
    outside: str = ""


def described_simulator(
    section: SimulatorSection, reference: str, name: str, origin: Origin, problems: Problems, **flies: Any
) -> Simulator | None:
    """The record of a table [simulator].  flies : the program or the FMU."""
    module = ModuleType("described")
    module.__doc__ = origin.outside  # counts in the digest, as what lies beside the campaign file does
    home = origin.directory.resolve()
    try:
        return Simulator(
            title=section.title or f"The {'FMU' if 'fmu' in flies else 'program'} {name}",
            name=name,
            parameters=tuple(
                Parameter(entry.default, entry.description or name, **_named(name, entry))
                for name, entry in section.parameter.items()
            ),
            metrics=tuple(_field(name, entry, entry.sometimes) for name, entry in section.metric.items()),
            outputs=tuple(_field(name, entry) for name, entry in section.output.items()),
            reference=reference,
            sources=Sources(module, home, home, origin.contents, {}),
            **section.model_dump(include=_OF_THE_RECORD),
            **flies,
        )
    except ModelError as error:
        problems.append(("", str(error)))
        return None


FMU_KEYS = ("fmu", "stop_time_s", "step_s", "interface", "solver_tolerance", "variable", "take", "level")
PROGRAM_KEYS = ("command", "input", "result", "history", "echo", "files", "read", "pattern")


def refuse_keys(section: SimulatorSection, keys: Sequence[str], why: str, problems: Problems) -> None:
    """Note the keys of the table that are for another kind of simulator."""
    tables = {"": section, **{f"parameter.{name}.": entry for name, entry in section.parameter.items()}}
    tables |= {f"metric.{name}.": entry for name, entry in section.metric.items()}
    tables |= {f"output.{name}.": entry for name, entry in section.output.items()}
    for place, table in tables.items():
        problems.extend((f"{place}{key}", f"is {why}") for key in keys if key in table.model_fields_set)


def refuse_names(section: SimulatorSection, problems: Problems) -> None:
    """Note the numbers of the table whose unit or name cannot be."""
    for kind in ("parameter", "metric", "output"):
        for name, entry in getattr(section, kind).items():
            try:
                refuse_name(_field(name, entry))
            except ModelError as error:
                problems.append((f"{kind}.{name}", str(error)))


def _command(
    section: SimulatorSection, directory: Path, contents: dict[Path, bytes], problems: Problems
) -> tuple[tuple[str, ...], str]:
    """(words of the command, SHA-256 of an executable that is not next to the campaign file).

    In the result, a word that names a file next to the campaign file begins with {home}.
    """
    words, outside = [], ""
    for place, word in enumerate(section.command, start=1):
        try:
            named = {name for _, name, _, _ in string.Formatter().parse(word) if name is not None}
        except ValueError as error:
            problems.append(("command", f"word {place}: {error}; a brace itself is written twice"))
            continue
        for name in sorted(named - {*PLACES}):
            problems.append(("command", f"word {place}: {{{name}}} is not known{hint(name, PLACES)}"))
        beside = not named and (directory / word).is_file() and not os.path.isabs(word)
        if beside and (place > 1 or "/" in word):
            add_file(word, "command", directory, contents, problems)
            word = "{home}/" + os.path.normpath(word)
        elif place == 1:
            word, outside = _executable(word, problems)
        words.append(word)
    return tuple(words), outside


def _executable(word: str, problems: Problems) -> tuple[str, str]:
    """(path of a program that is installed, SHA-256 of it)."""
    found = shutil.which(word)
    if found is not None and os.path.isabs(found):
        with open(found, "rb") as file:
            return found.replace("{", "{{").replace("}", "}}"), sha256(file.read()).hexdigest()
    if "/" in word:
        problems.append(("command", f'there is no program "{word}" that can be executed; a path begins in the folder '
                         "of the campaign file"))  # fmt: skip
    else:
        problems.append(("command", f'there is no program "{word}" on the PATH; one beside the campaign file is named '
                         f'"./{word}"'))  # fmt: skip
    return word, ""


def add_file(name: str, key: str, directory: Path, contents: dict[Path, bytes], problems: Problems) -> None:
    """Read a file next to the campaign file."""
    try:
        path = resolve_beside(directory, name)
        contents[path] = path.read_bytes()
    except FileFault as fault:
        problems.append((key, str(fault)))
    except OSError as error:
        problems.append((key, f'"{name}" cannot be read: {error.strerror}'))


def _inputs(
    section: SimulatorSection, directory: Path, contents: dict[Path, bytes], problems: Problems
) -> dict[str, str]:
    """The files that each case is given: "json", or the text of a Jinja template."""
    from jinja2 import TemplateSyntaxError, meta  # which a campaign without templates does not wait for

    inputs = {}
    known = [*section.parameter, "case_id", "seed"]
    for name, kind in section.input.items():
        if kind == JSON_INPUT:
            inputs[name] = kind
            continue
        before, key = len(problems), f"input.{name}"
        add_file(kind, key, directory, contents, problems)
        if len(problems) > before:
            continue
        try:
            text = contents[resolve_beside(directory, kind)].decode()
            tree = template_environment().parse(text)
            names = meta.TrackingCodeGenerator(tree.environment)
            names.optimizer = None  # it would compute the constants of the template
            names.visit(tree)  # which finds filters that are not there, too
        except UnicodeDecodeError:
            problems.append((key, f'"{kind}" is not text in UTF-8'))
            continue
        except TemplateSyntaxError as error:
            problems.append((key, f"{kind}, line {error.lineno}: {error.message}"))
            continue
        for missing in sorted(names.undeclared_identifiers - {*known}):
            problems.append((key, f'{kind}: "{missing}" is no input{hint(missing, known)}'))
        inputs[name] = text
    return inputs


def template_environment() -> Any:
    """For templates of input files: sandboxed, and nothing in them is computed before a case is written."""
    from jinja2 import StrictUndefined, pass_context
    from jinja2.sandbox import SandboxedEnvironment

    @pass_context  # then jinja computes no constants while it reads a template: they may take any memory
    def unchanged(context: Any, value: Any) -> Any:
        return value

    return SandboxedEnvironment(
        undefined=StrictUndefined, keep_trailing_newline=True, optimized=False, finalize=unchanged
    )


def _reading(
    name: str, metric: MetricSection, section: SimulatorSection, problems: Problems
) -> tuple[str | None, str | None]:
    """(path in the result, pattern) of a metric."""
    key = f"metric.{name}"
    if metric.pattern is None:
        if section.result is None and section.command:
            problems.append((key, "is never read; give it a `pattern` over stdout, or give `result`, a file"))
        return metric.read or name, None
    if metric.read is not None:
        problems.append((key, "has `read` and `pattern`; leave one of them out"))
    try:
        if re.compile(metric.pattern).groups != 1:
            problems.append((f"{key}.pattern", f'"{metric.pattern}" must have one group, in parentheses'))
    except re.error as error:
        problems.append((f"{key}.pattern", f'"{metric.pattern}" is no regular expression: {error}'))
    return None, metric.pattern


def _field(name: str, section: NumberSection, sometimes: bool = False) -> Field:
    return Field(section.description or name, sometimes=sometimes, **_named(name, section))


def _named(name: str, section: NumberSection) -> dict[str, Any]:
    """Range, name and unit of a number: the unit that it declares, or that its name ends in, if it ends in one."""
    unit, ranged = section.unit, {key: getattr(section, key) for key in ("low", "high")}
    if unit is None:
        unit = max(units_at_the_end(name), key=lambda unit: len(unit_suffix(unit)), default="")
    return {"name": name, "unit": unit} | {key: value for key, value in ranged.items() if value is not None}
