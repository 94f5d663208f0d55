"""Runs and cases for an interactive session or a notebook: verdicts, statistics, case table, time histories.

    run = open_run("runs/deorbit")
    run.verdicts                  the verdict on every requirement
    run.cases                     the case table, a pandas DataFrame
    run.case(17).history()        its time history, from the store or flown again

Nothing is written here; `mc_engine.store.store` has the methods that write.
"""

from base64 import b64encode
from dataclasses import dataclass
from functools import cached_property
from html import escape
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from mc_engine.errors import ModelError, StoreError
from mc_engine.model.simulator import Simulator
from mc_engine.runner.summary import case_line, judgement, summaries, verdict_line
from mc_engine.shell_words import shell_word
from mc_engine.status import REFUSED, STATUS_NAME
from mc_engine.store.manifest_file import title_in
from mc_engine.store.opening import open_store
from mc_engine.store.run_files import NOMINAL_CASE
from mc_engine.store.store import Store
from mc_engine.studies.replay_files import history_figure
from mc_engine.suggestions import hint
from mc_engine.text import clean

if TYPE_CHECKING:
    from mc_engine.runner.runner import Replay
    from mc_engine.statistics import Summary, Verdict

_DIGITS = 6


def open_run(path: str | Path) -> "Run":
    """Open a run to look at its results, interactively or in a notebook.

    path : str or Path, the run directory, or the URL of a published run

    Returns a Run.

    Raises StoreError if there is no run, or it is damaged.

    >>> run = open_run("runs/small")
    >>> run.statuses
    {'ok': 8}
    """
    return Run(open_store(path))


class _Metrics(dict[str, "Summary"]):
    """Summaries by metric; the error for an unknown name suggests the nearest one."""

    def __init__(self, path: Path, by_name: "dict[str, Summary]"):
        super().__init__(by_name)
        self._path = path

    def __missing__(self, name: str) -> "Summary":
        raise StoreError(f'{self._path}: there is no metric "{name}"{hint(str(name), self)}')


@dataclass(frozen=True)
class Run:
    """The results of a run, read when they are first used; open the run again to see cases flown since.

    A notebook shows it as tables of verdicts and metrics.

    store : Store, the run directory

    >>> run = open_run("runs/small")
    >>> run.metrics["apogee_altitude_km"].n_used
    8
    >>> run.verdicts[0].outcome
    'not demonstrable'
    >>> run.case(3).metrics["apogee_altitude_km"].round(1)
    np.float64(656.9)
    """

    store: Store

    @property
    def path(self) -> Path:
        """The run directory."""
        return self.store.path

    @property
    def title(self) -> str:
        """The campaign's title, or else its name."""
        return title_in(self.store.manifest)

    @cached_property
    def cases(self) -> pd.DataFrame:
        """The case table, a row per case, by case_id; `attrs["units"]` and `["descriptions"]` describe the columns."""
        return self.store.cases()

    @property
    def statuses(self) -> dict[str, int]:
        """Number of cases by status."""
        return self.store.status_counts()

    @cached_property
    def verdicts(self) -> "list[Verdict]":
        """The verdicts on all requirements from the present cases, and the joint verdict if there are several."""
        judged, joint = judgement(self.store)
        return judged if joint is None else [*judged, joint]

    @cached_property
    def metrics(self) -> "dict[str, Summary]":
        """Moments and quantiles of every metric, with n_used of n_tried; StoreError for a name that is no metric."""
        return _Metrics(self.store.path, summaries(self.store))

    @property
    def nominal(self) -> "Case":
        """The nominal case; StoreError if it has not been flown."""
        return self.case(NOMINAL_CASE)

    def case(self, case_id: int) -> "Case":
        """One case by its number; -1 is the nominal case.  StoreError if there is none, or it is no number."""
        if not isinstance(case_id, int | np.integer) or isinstance(case_id, bool):
            raise StoreError(f"{self.path}: case {case_id!r} is not there; cases are whole numbers, from 0 to "
                             f"{self.store.n_cases - 1}, and {NOMINAL_CASE} is the nominal one")  # fmt: skip
        row = self.store.nominal() if case_id == NOMINAL_CASE else self.store.row(case_id)
        if not row:
            resume = f"`mc-engine resume {shell_word(self.path)}`"
            raise StoreError(f"{self.path}: the nominal case is not there; {resume} flies it")
        return Case(self.store, case_id, row)

    def __repr__(self) -> str:
        lines = [f"Run {self.path}: {self.title}", f"  {case_line(self.store)}"]
        return clean(
            "\n".join([*lines, *(f"  {verdict_line(verdict, self.store.units)}" for verdict in self.verdicts)])
        )

    def _repr_html_(self) -> str:
        units = self.store.units
        verdicts = [
            [verdict.name, verdict.outcome, verdict_line(verdict, units).split(f"{verdict.outcome}, ", 1)[-1]]
            for verdict in self.verdicts
        ]
        metrics = [
            [
                name,
                units[name],
                f"{summary.n_used:,} of {summary.n_tried:,}",
                summary.mean,
                summary.sd,
                summary.minimum,
                summary.maximum,
            ]
            for name, summary in self.metrics.items()
        ]
        return "".join(
            [
                f"<h4>{_html(self.title)}</h4><p>{_html(case_line(self.store))}</p>",
                _html_table(["requirement", "verdict", "on which cases"], verdicts),
                _html_table(["metric", "unit", "cases with a number", "mean", "sd", "smallest", "largest"], metrics),
            ]
        )


@dataclass(frozen=True)
class Case:
    """One case of a run: its inputs, its results and its flight.

    A notebook shows it as a table, with a plot of the time history if that was saved.

    store : Store, the run directory
    case_id : int, its number; -1 for the nominal case
    row : dict, its row of the case table, by column name

    >>> case = open_run("runs/small").case(3)
    >>> case.status
    'ok'
    >>> case.inputs.round(3).to_dict()
    {'magnitude_error_pct': -0.106, 'pitch_error_deg': 0.647}
    >>> case.trace()[["t_s", "altitude_km", "rhs.g"]].iloc[1].round(9).to_dict()  # every number that physics names
    {'t_s': 10.0, 'altitude_km': 300.022901603, 'rhs.g': -1.338e-06}
    """

    store: Store
    case_id: int
    row: dict[str, Any]

    @property
    def name(self) -> str:
        """Such as "case 17", or "nominal case"."""
        return "nominal case" if self.case_id == NOMINAL_CASE else f"case {self.case_id}"

    @property
    def status(self) -> str:
        """How the case ended, a word of `mc_engine.status`."""
        return str(self.row["status"])

    @property
    def reason(self) -> str:
        """Why the case failed, if the flight tells; else empty."""
        return str(self.row["reason"])

    @property
    def inputs(self) -> pd.Series:
        """The dispersed inputs of the case, in the units of their columns."""
        return self._with_role("dispersion")

    @property
    def metrics(self) -> pd.Series:
        """The metrics of the case, in the units of their columns; NaN if it failed."""
        return self._with_role("metric")

    @property
    def end_state(self) -> pd.Series:
        """The last state of the case, with its time."""
        return self._with_role("state")

    def _with_role(self, role: str) -> pd.Series:
        names = [column.name for column in self.store.columns if column.role == role]
        return pd.Series({name: self.row[name] for name in names}, name=self.name, dtype=object).infer_objects()

    def history(self) -> pd.DataFrame:
        """The time history of the case: case_id, t_s and the outputs.  Read if the run saved it, else flown again.

        StoreError if the repeated flight does not give the stored numbers bit for bit.
        """
        kept = self._kept_history()
        if len(kept):
            return kept
        again = self.replay()
        if not again.equal:
            raise StoreError(f"{self.store.path}: {again.differences[0]}; the run was changed, or flown elsewhere")
        return again.history

    def _kept_history(self) -> pd.DataFrame:
        table = self.store.histories()
        return table[table["case_id"] == self.case_id].reset_index(drop=True)

    def trace(self, seconds: float = 600.0) -> pd.DataFrame:
        """All intermediate results of the model in the flight of the case, by name, at every step: a DataFrame.

        The case is flown by Python, which takes some milliseconds per step; given up after `seconds`.

        Returns a DataFrame with a row for the start, the end of each step, each event, and both sides of each call of
        `control` and `switch`. Its columns:

        t_s, states and outputs : in declared units, under their own names; `attrs["units"]` says which.  A state with
            the name of an output, or of t_s, is s.NAME
        m.NAME : the discrete state, in SI, as all columns below
        d(NAME)/dt : the derivative of a state, from `rhs`
        event.NAME : the functions of the events
        FUNCTION.VARIABLE : a variable assigned in a function of the model, as `rhs.drag`; `rhs.wind.speed` in `wind`
            called by `rhs`, `rhs.wind[2].speed` in the second call, `rhs.force.x` for a field of a record.  For
            `initial`, `start`, `control` and `switch`, the values of the last call.

        Raises StoreError for a case that never started, or whose end differs from the stored one in any bit; ModelError
        for a simulator, which has no physics.
        """
        from mc_engine.flight.interpreted import OutOfTime  # which loads the compiler
        from mc_engine.runner.flown_campaign import campaign_of
        from mc_engine.runner.histories import inputs_of
        from mc_engine.studies.trace import trace_case

        campaign = campaign_of(self.store)
        if isinstance(campaign.model, Simulator):
            raise ModelError(f"{self.store.path}: was flown by a simulator, which has no physics to trace")
        if self.status == STATUS_NAME[REFUSED]:
            raise StoreError(f"{self.store.path}: {self.name} never started: {self.reason}")
        inputs, noise = inputs_of(campaign, None if self.case_id == NOMINAL_CASE else self.case_id)
        try:
            trace, end = trace_case(campaign.model, inputs, noise, campaign.seed, seconds)
        except OutOfTime as late:
            raise StoreError(f"{self.store.path}: the trace of {self.name} was given up after {seconds:g} s, at t = "
                             f"{late.t:.6g} s; trace(seconds=...) waits longer") from None  # fmt: skip
        for name, value in end.items():
            stored = self.row[name]
            if stored != value and not (np.isnan(value) and np.isnan(stored)):
                raise StoreError(f"{self.store.path}: {self.name} ended with {name} = {stored!r}, its trace with "
                                 f"{value!r}; the run was changed, or flown elsewhere")  # fmt: skip
        return trace

    def replay(self) -> "Replay":
        """The Replay of the case: it is flown again, and every stored number compared bit for bit.

        StoreError for the nominal case, which is not a case of the design.
        """
        from mc_engine.runner.runner import replay  # which loads the compiler

        if self.case_id == NOMINAL_CASE:
            raise StoreError(f"{self.store.path}: the nominal case cannot be replayed; cases from 0 on can")
        return replay(self.store.path, self.case_id)

    def __repr__(self) -> str:
        numbers = ", ".join(f"{name}={_text(value)}" for name, value in {**self.inputs, **self.metrics}.items())
        return clean(f"{self.name} of {self.store.path}: {self.status}; {numbers}")

    def _repr_html_(self) -> str:
        units = self.store.units
        rows = [[role, name, value, units[name]] for role, columns in (("input", self.inputs), ("metric", self.metrics))
                for name, value in columns.items()]  # fmt: skip
        why = f" ({_html(self.reason)})" if self.reason else ""
        head = f"<h4>{_html(self.name)}: {_html(self.status)}{why}</h4>"
        return head + _html_table(["", "column", "value", "unit"], rows) + self._picture()

    def _picture(self) -> str:
        """A small plot of the saved time history; without one, nothing is flown."""
        history = self._kept_history()
        if not len(history):
            return "<p>Its history was not kept; <code>.history()</code> flies it again.</p>"
        image = BytesIO()
        figure = history_figure(history, self.store.manifest.get("quantities", []), self.name)
        figure.savefig(image, format="png", dpi=60)
        data = b64encode(image.getvalue()).decode()
        return f'<img alt="history of {_html(self.name)}" src="data:image/png;base64,{data}">'


def _html(text: str) -> str:
    return escape(clean(text))


def _html_table(heads: list[str], rows: list[list[Any]]) -> str:
    if not rows:
        return ""
    head = "".join(f"<th>{_html(head)}</th>" for head in heads)
    body = "".join("<tr>" + "".join(f"<td>{_html(_text(cell))}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _text(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, float | np.floating):
        return f"{value:.{_DIGITS}g}"
    return str(value)
