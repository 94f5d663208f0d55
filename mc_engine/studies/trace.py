"""The trace of one case: every named intermediate result of its physics, at every step of its flight.

The case is flown by Python with the loops from which kernels are compiled, so its steps are those of the stored case.
"""

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from types import FrameType, SimpleNamespace
from typing import Any

import pandas as pd

from mc_engine.flight.flight import fly_interpreted
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.model.faults import is_the_users
from mc_engine.model.phases import BEGAN, NEVER, PHASE
from mc_engine.model.record import Model
from mc_engine.store.histories import PHASE_COLUMN

_WITHOUT_END = SimpleNamespace(shape=(1, 2**62))  # in place of the array of a history: every row has room
_AT_ROWS = ("rhs", "events", "observe", "evaluate")  # the first three are evaluated anew at the state of each row


def trace_case(
    model: Model, inputs: dict[str, Any], noise: int, seed: int, seconds: float
) -> tuple[pd.DataFrame, dict[str, float]]:
    """(trace, last state in declared units by `end_...`) of a case that can start; see `Case.trace`.

    OutOfTime after so many seconds.
    """
    flight = _TracedFlight(model, seconds)
    time, _, states, _ = fly_interpreted(flight, inputs, noise, seed, _WITHOUT_END)
    rows = pd.DataFrame(flight.rows)
    before = rows.shift()
    repeats = (rows.eq(before) | (rows.isna() & before.isna())).all(axis=1)  # a sample or an event that changes nothing
    trace = rows[~repeats].reset_index(drop=True)
    names = _state_columns(model)
    units = {names[field.name]: field.unit for field in model.states}
    units |= {"t_s": "s", **{field.name: field.unit for field in model.quantities}}
    trace.attrs["units"] = {name: units.get(name, "") for name in trace.columns}
    end = {f"end_{field.name}": row[0] / field.si_factor for field, row in zip(model.states, states, strict=True)}
    return trace, {"end_time_s": float(time[0]), **end}


def _state_columns(model: Model) -> dict[str, str]:
    """The column of each state: its name, or s.NAME where an output, or the time, has that name, too."""
    taken = {"t_s", *(output.name for output in model.quantities)}
    return {state.name: f"s.{state.name}" if state.name in taken else state.name for state in model.states}


class _TracedFlight(InterpretedFlight):
    """Writes a row, by column name, wherever the loops record one of a history."""

    def __init__(self, model: Model, seconds: float):
        self.rows: list[dict[str, Any]] = []
        self._held: dict[str, float] = {}  # of functions that are called now and then: initial, start, control, switch
        self._observed: tuple[Any, ...] = ()
        super().__init__(model, seconds)

    def call(self, name: str, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        if name == "observe":
            self._observed = arguments
        if name in _AT_ROWS:
            return super().call(name, function, arguments)
        with _named_numbers() as named:
            result = super().call(name, function, arguments)
        self._held.update(named)
        return result

    def record(self, history: Any, rows: Any, lanes: bool, t: Any, fields: Any) -> None:
        model, functions, arguments = self.model, self._functions, self._observed
        _, s, m, *_ = arguments
        with _named_numbers() as named:
            rates = functions.rhs(*arguments)
            events = functions.events(*arguments) if model.events is not None else ()
            functions.observe(*arguments)
        columns: dict[str, Any] = {"t_s": float(t)}
        names = _state_columns(model)
        columns |= {names[field.name]: v / field.si_factor for field, v in zip(model.states, s, strict=True)}
        columns |= {field.name: value / field.si_factor for field, value in zip(model.quantities, fields, strict=False)}
        if model.phases:  # whose number is the last of the fields
            columns[PHASE_COLUMN] = model.phases[int(fields[-1])]
        if model.start is not None:
            for name, value in zip(m._fields, m, strict=True):
                columns |= {} if name in (PHASE, BEGAN) else _numbers(f"m.{name}", value)
        columns |= {f"d({field.symbol})/dt": float(v) for field, v in zip(model.states, rates, strict=True)}
        columns |= {f"event.{event.name}": float(v) for event, v in zip(model.event_list, events, strict=True)}
        self.rows.append(columns | named | self._held)


@contextmanager
def _named_numbers() -> Iterator[dict[str, float]]:
    """The numbers that functions of the user assign in the block, such as "rhs.drag" or "rhs.wind[2].speed".

    By the functions that were called, one inside another, and the variable; a function that one function calls again
    is numbered.
    """
    named: dict[str, float] = {}
    path: list[tuple[str, dict[str, int]]] = []  # of each function under way: its name, and how often it called others

    def on_call(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event not in ("call", "return") or not _is_traced(code.co_filename) or code.co_name.startswith("<"):
            return
        if event == "call":
            if not path:
                path.append(("", {}))
            called = path[-1][1]
            called[code.co_name] = count = called.get(code.co_name, 0) + 1
            name = code.co_name if count == 1 or len(path) == 1 else f"{code.co_name}[{count}]"
            path.append((f"{path[-1][0]}{name}.", {}))
        elif path:
            prefix, _ = path.pop()
            for variable in code.co_varnames[code.co_argcount :] + code.co_cellvars:
                if variable in frame.f_locals and variable not in code.co_varnames[: code.co_argcount]:
                    named.update(_numbers(prefix + variable, frame.f_locals[variable]))

    before = sys.getprofile()
    sys.setprofile(on_call)
    try:
        yield named
    finally:
        enable = getattr(before, "enable", None)  # of cProfile, which is no function
        if enable:
            enable()
        else:
            sys.setprofile(before)


def _numbers(name: str, value: Any) -> Iterator[tuple[str, float]]:
    """A number by its name; of a tuple each field, such as "rhs.wind.x" or "rhs.moments[0]"."""
    if isinstance(value, tuple):
        fields = getattr(value, "_fields", None)
        for i, item in enumerate(value):
            yield from _numbers(f"{name}.{fields[i]}" if fields else f"{name}[{i}]", item)
    elif isinstance(value, float | int):
        yield name, math.nan if value == NEVER else float(value)


@lru_cache(maxsize=256)
def _is_traced(file: str) -> bool:
    return file.endswith(".py") and is_the_users(Path(file))
