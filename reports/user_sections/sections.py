"""A user's own sections of a report, from a template: Markdown with Jinja expressions over the run.

    # Propellant budget

    Of {{ run.n_tried }} cases, {{ run.requirements.fuel.passed }} stay inside the tank; 99.865 % of them need
    {{ run.metrics.propellant_kg.quantile(0.99865).upper }} kg or less.

    {{ table("requirements") }}

    {{ figure("maps") }}

A template can use `run` and, in the order of the command, `runs` (`RunFacts`).  It inserts tables and figures of the
report by `table(NAME)` and `figure(NAME)`, each on its own line; NAME is the anchor of the section, with -2, -3, ...
for further ones.  Values of the run are written as text, which is never read as Markdown or Jinja.  The template runs
in Jinja's sandbox, in a limited process: no imports, no files, no private members, 20 s, 512 MiB.
"""

import json
import os
import re
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from mc_engine.errors import EngineError
from mc_engine.statistics import Summary
from mc_engine.store.journal import plain
from reports.document.blocks import Block, Document, FigureBlock, Table, numbered
from reports.run.flown import Flown
from reports.user_sections import template_process
from reports.user_sections.template_process import BEGIN, END

ANCHOR = "own"
LONGEST_S = 20.0  # that a template may take
_PLACE = re.compile(f"{BEGIN}(\\d+){END}")
_KINDS: dict[str, type] = {"table": Table, "figure": FigureBlock}


class TemplateError(EngineError):
    """A template cannot be read or filled in; the text names its file and line."""


# ---- what a template sees


@dataclass(frozen=True)
class RunFacts:
    """The data of a run for a template.

    data : by name, as plain data: name, title, design, seed, n_tried, n_ok, n_wanted; metrics (unit, n_used of n_tried,
        nominal, mean, sd, minimum, maximum), requirements (verdicts: outcome, passed, tried, share, confidence, lower,
        upper, at_most, at_least, ...), parameters (their values) and inputs (records: unit, nominal, distribution,
        source, description), each by name.
    summary : of a metric, by its name and the probability of a quantile.  A template's `quantile(0.99865)` has its
        value and its distribution-free limits, `lower` and `upper`; None what the cases are too few for.
    """

    data: Mapping[str, Any]
    summary: Callable[[str, float], Summary]


def run_facts(flown: Flown, title: str) -> RunFacts:
    """The data of a run that templates can use."""
    metrics = {
        name: {
            "unit": flown.unit(name),
            "n_used": summary.n_used,
            "n_tried": summary.n_tried,
            "nominal": flown.nominal_value(name),
            "mean": summary.mean,
            "sd": summary.sd,
            "minimum": summary.minimum,
            "maximum": summary.maximum,
        }
        for name, summary in flown.summaries.items()
    }
    data = {
        "name": flown.name,
        "title": title,
        "design": flown.design,
        "seed": flown.campaign.get("seed"),
        "n_tried": flown.n_tried,
        "n_ok": flown.every.completed,
        "n_wanted": flown.n_wanted,
        "metrics": metrics,
        "requirements": {verdict.name: asdict(verdict) for verdict in flown.verdicts},
        "parameters": {record["name"]: record.get("value") for record in flown.manifest.get("parameters", [])},
        "inputs": {record["name"]: record for record in flown.manifest.get("inputs", [])},
    }
    return RunFacts(data, flown.every.summary)


# ---- filling it in


def with_own_sections(document: Document, template: Path, run: RunFacts, runs: Sequence[RunFacts]) -> Document:
    """The document with the template's sections before its own ones, numbered anew.

    Raises TemplateError, one sentence with the line, for whatever is wrong with the template.
    """
    from reports.user_sections.markdown_blocks import sections_of

    named = {word: _named(document, kind) for word, kind in _KINDS.items()}
    try:
        source = template.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "is not UTF-8 text"
        raise TemplateError(f"{template}: {reason}") from None
    filled = _filled_in(template, source, run, runs, {word: list(blocks) for word, blocks in named.items()})
    chosen = [named[word][name] for word, name in filled["placed"]]

    def placed(text: str) -> list[Block] | None:
        indices = _PLACE.findall(text)
        return [chosen[int(index)] for index in indices] if indices else None

    try:
        own = sections_of(filled["text"], placed, ANCHOR)
    except ValueError as error:
        raise TemplateError(f"{template}: {error}") from None
    return replace(document, sections=numbered((*own, *document.sections)))


def _filled_in(
    template: Path, source: str, run: RunFacts, runs: Sequence[RunFacts], known: Mapping[str, list[str]]
) -> dict[str, Any]:
    """The text that the template comes to, from a process that has bounds; see `template_process`."""
    facts = [run, *runs]
    request = {"source": source, "runs": [one.data for one in facts], "known": known}
    # Nothing is imported from the folder of the process, or of the program: -P, and the paths of this one.
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    command = [sys.executable, "-P", "-W", "ignore", template_process.__file__]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                          encoding="utf-8", env=environment) as process:  # fmt: skip
        assert process.stdin is not None
        assert process.stdout is not None
        timer = threading.Timer(LONGEST_S, process.kill)
        timer.start()
        try:
            answer: dict[str, Any] = {"quantile": None}
            words = json.dumps(request, default=plain)
            while "quantile" in answer:
                process.stdin.write(f"{words}\n")
                process.stdin.flush()
                answer = json.loads(process.stdout.readline())
                if "quantile" in answer:
                    index, metric, probability = answer["quantile"]
                    found = facts[index].summary(metric, probability).at(probability)
                    words = json.dumps([found.value, found.lower, found.upper] if found else [None] * 3)
        except (OSError, ValueError):  # its end came before that of the template
            answer = {"fault": f"takes more than {LONGEST_S:.0f} s, or than its memory", "line": None}
        finally:
            timer.cancel()
            process.kill()
    if "fault" in answer:
        place = f"{template}, line {answer['line']}" if answer["line"] else str(template)
        raise TemplateError(f"{place}: {answer['fault']}")
    return answer


def _named(document: Document, kind: type) -> dict[str, Block]:
    """Tables or figures by their section's anchor: maps, maps-2, ..."""
    named: dict[str, Block] = {}
    for section in document.sections:
        blocks = [block for block in section.blocks if isinstance(block, kind)]
        for place, block in enumerate(blocks, start=1):
            named[section.anchor if place == 1 else f"{section.anchor}-{place}"] = block
    return named
