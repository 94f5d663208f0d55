"""The process that fills in a user's template: Jinja's sandbox, within bounds of memory and time.

A template may come from anyone.  The sandbox keeps it from files and from Python; only a separate process guarantees
that it ends and limits its memory.  The two processes exchange lines of JSON: the input is the data for the template;
the output is requests for quantiles, which the caller answers, and finally the text or the first error.
"""

import json
import sys
from contextlib import suppress
from types import SimpleNamespace
from typing import Any

import jinja2
from jinja2.sandbox import ImmutableSandboxedEnvironment

from mc_engine.text import clean
from reports.text.markdown_text import escaped
from reports.text.numbers import count, number, percent

BEGIN, END = "\ue000", "\ue001"  # private characters about the place of a table or figure
MOST_LETTERS = 1_000_000  # of the filled-in text
MEMORY = 2**29  # bytes
_FRAME = "<template>"


class _Place(str):
    """Where a table or figure stands in the filled-in text."""


class _Runs:
    """The runs as the template sees them, and the tables and figures that it has placed, in their order.

    runs : the run of the report, and after it all of the command.
    """

    def __init__(self, request: dict[str, Any]):
        self.known = request["known"]
        self.runs = [self._run(index, facts) for index, facts in enumerate(request["runs"])]
        self.placed: list[tuple[str, str]] = []

    def _run(self, index: int, facts: dict[str, Any]) -> SimpleNamespace:
        metrics = {name: SimpleNamespace(**metric) for name, metric in facts["metrics"].items()}
        for name, metric in metrics.items():
            metric.quantile = lambda probability, name=name: _quantile(index, name, probability)
        verdicts = {name: SimpleNamespace(**verdict) for name, verdict in facts["requirements"].items()}
        return SimpleNamespace(**{**facts, "metrics": metrics, "requirements": verdicts})

    def table(self, name: str) -> _Place:
        """A table of the report."""
        return self._place("table", name)

    def figure(self, name: str) -> _Place:
        """A figure of the report."""
        return self._place("figure", name)

    def _place(self, word: str, name: str) -> _Place:
        known = self.known[word]
        if name not in known:
            raise LookupError(f"there is no {word} “{name}”; this report has {', '.join(known) or 'none'}")
        self.placed.append((word, name))
        return _Place(f"\n\n{BEGIN}{len(self.placed) - 1}{END}\n\n")


def _quantile(run: int, metric: str, probability: float) -> SimpleNamespace:
    """The quantile of a metric and its limits, which the caller knows."""
    if not 0.0 < probability < 1.0:
        raise ValueError(f"quantile({probability}): a probability lies between 0 and 1")
    print(json.dumps({"quantile": [run, metric, float(probability)]}), flush=True)
    value, lower, upper = json.loads(sys.stdin.readline())
    return SimpleNamespace(value=value, lower=lower, upper=upper)


def _filled_in(request: dict[str, Any]) -> dict[str, Any]:
    environment = ImmutableSandboxedEnvironment(undefined=jinja2.StrictUndefined, finalize=_written)
    environment.filters |= {"number": number, "percent": percent, "count": count}
    try:
        runs = _Runs(request)
        names = {"run": runs.runs[0], "runs": runs.runs[1:], "table": runs.table, "figure": runs.figure}
        pieces, letters = [], 0
        for piece in environment.from_string(request["source"]).generate(names):
            pieces.append(piece)
            letters += len(piece)
            if letters > MOST_LETTERS:
                raise ValueError(f"it comes to more than {MOST_LETTERS:,} letters")
        return {"text": "".join(pieces), "placed": runs.placed}
    except MemoryError:
        return {"fault": f"it takes more than {MEMORY >> 20} MiB of memory", "line": None}
    except RecursionError as error:
        return {"fault": "it is nested too deep, or calls itself without an end", "line": _line(error)}
    except Exception as error:  # what a template can raise has no end
        return {"fault": " ".join(str(error).split())[:500] or type(error).__name__, "line": _line(error)}


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
    return escaped(clean(str(value)))  # of private characters, BEGIN and END among them, too


def _limit_memory() -> None:
    with suppress(ImportError, ValueError, OSError):  # where the system keeps no limit, time alone bounds it
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


if __name__ == "__main__":
    _limit_memory()
    print(json.dumps(_filled_in(json.loads(sys.stdin.readline()))), flush=True)
