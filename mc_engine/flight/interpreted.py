"""The engine's integration loops, run by Python on one case: to find what made a number not finite, to trace, to debug.

Kernels are compiled from the same loops.  Their intrinsics exist only in compiled code, so this module has an
interpreted version of each, with the same name.
"""

import functools
import math
import operator
import time
from collections.abc import Callable, Sequence
from importlib import import_module
from types import FunctionType
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher

from mc_engine.flight.kernel_parts import PHYSICS, functions_of, second_order_of, settings_class, tracking_of
from mc_engine.lanes.composed import Alternatives, ComposedFunction, has_powers
from mc_engine.lanes.fixed_step import Method
from mc_engine.lanes.functions import TABLES, fma
from mc_engine.lanes.number import Number, Origin, calling, number
from mc_engine.model.fields import AdaptiveStep, uses_rates
from mc_engine.model.record import Model


class OutOfTime(Exception):
    """The flight took longer than it may; `t` [s] is how far it came."""

    def __init__(self, t: float):
        self.t = t


class InterpretedFlight:
    """The loops of a model's clock, on one case.  Subclasses override `call`, `record` or `any_of` to look on.

    seconds : how long the flight may take.  t : of the latest call of a function [s].
    origin : of the latest number that made a state, or an error of one, not finite.  metrics : what `evaluate` gave.
    """

    composed, alternatives = ComposedFunction, Alternatives

    def __init__(self, model: Model, seconds: float = math.inf):
        self.origin: Origin | None = None
        self.metrics: tuple[Any, ...] = ()
        self._end = time.monotonic() + seconds
        self.t = 0.0
        self._period = 0.0  # of the samples of adaptive steps [s]; on a grid the loops call `control` at samples alone
        self._names: dict[str, dict[str, Any]] = {}
        self._has_powers = has_powers(getattr(model, name) for name in PHYSICS)
        self._unwatched = functions = functions_of(model, self)
        self._functions = functions._replace(**{name: self._called(name, getattr(functions, name)) for name in PHYSICS})
        self.model, self._settings = model, settings_class(model)
        self._picks = second_order_of(model, self) if uses_rates(model.clock) else ()

    def kernel(
        self, parameters: np.ndarray, settings: np.ndarray, data: Any, key: Any, cases: np.ndarray, *rest: Any
    ) -> None:
        """Fly the first case; arguments and results are those of the model's kernel."""
        model, adaptive = self.model, isinstance(self.model.clock, AdaptiveStep)
        fly = self._interpreted("adaptive_flight" if adaptive else "fixed_step")["fly"]
        actions = [event.action for event in model.event_list]
        inputs = (parameters, settings, key, cases)
        common, must_stop = (model.kernel_parameters, self._settings, 1), "stop" in actions
        if adaptive:
            pair, (clock, atol, *out, history, rows, pace) = rest[:4], rest[4:]
            self._period = float(clock[2])
            order = (np.zeros(1, dtype=np.int64), *inputs, [Number(value) for value in clock], atol, must_stop)
            fly(self._functions, pair, *common, *order, out, history, rows, pace)
            return
        n_steps, h, every, *tables, time, status, state, metrics, history, rows, stride = rest
        stepping = self._interpreted("gauss_jackson" if self._picks else "multistep" if tables else "fixed_step")
        own, tracking = (*tables, *self._picks), self._interpreted(tracking_of(model))
        functions = {name: stepping[name] for name in Method._fields[:-2]}
        method = Method(**functions, track=tracking["track"], tables=own)
        grid, kinds, results = (n_steps, h, every), (bool(actions), must_stop), (time, status, state, metrics)
        fly(self._functions, method, *common, *inputs, grid, kinds, results, history, rows, stride)

    def _called(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def called(*arguments: Any) -> Any:
            if name not in ("initial", "start"):
                self.t = float(arguments[0])
            if self._is_idle(name, arguments):
                return arguments[1:3] if name == "switch" else arguments[2]
            return self.call(name, function, arguments)

        return called

    def _is_idle(self, name: str, arguments: tuple[Any, ...]) -> bool:
        """Whether the loops call a function for the sake of other lanes: of a case alone they leave out the result.

        So it is with `switch` where no event acts or one ends the case, and with `control` at an event between samples.
        """
        if name == "control":
            return bool(arguments[0] < arguments[-1].sample * self._period)
        if name != "switch":
            return False
        # without events the loops have one all the same, see `_no_events`: not strict
        acting = [event.action for event, hit in zip(self.model.event_list, arguments[-1], strict=False) if hit > 0.5]
        return "switch" not in acting or "stop" in acting

    def call(self, name: str, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        """The result of one function of the model.  name : what the engine calls it, such as "rhs"."""
        return calling(name, function, arguments, floats_first=not self._has_powers)

    def record(self, history: np.ndarray, rows: np.ndarray, lanes: bool, t: Any, fields: Any) -> None:
        """Write one more row of the history.  fields : what `observe` has just given."""
        history[:, rows[0]] = (t, *fields)
        rows += 1

    def _interpreted(self, module: str) -> dict[str, Any]:
        """The names of a module of loops, its compiled functions and intrinsics as Python runs them."""
        if module not in self._names:
            names = self._names[module] = dict(vars(import_module(f"mc_engine.lanes.{module}")))
            for name, value in list(names.items()):
                if isinstance(value, Dispatcher):
                    home = value.py_func.__module__.rpartition(".")[2]
                    names[name] = FunctionType(value.py_func.__code__, self._interpreted(home))
                elif name in _INTRINSICS:
                    names[name] = _INTRINSICS[name]
            names |= {"total": self.total, "total_in_pairs": self.total, "map_fields": self.map_fields}
            names |= {"record": self.record, "unset": self.unset}
        return self._names[module]

    def total(self, fields: Sequence[Number]) -> Number:
        """Sum of the fields; the flight's `origin` is theirs, where it is not finite."""
        if time.monotonic() > self._end:
            raise OutOfTime(self.t)
        value: Any = functools.reduce(operator.add, fields)
        if not math.isfinite(value):
            self.origin = value.origin
        return value

    def map_fields(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """function(a_i, b_i, ...) for every field i; the flight's `origin` is that of an event which is lost."""
        first = next(argument for argument in arguments if isinstance(argument, tuple))
        columns = (item if isinstance(item, tuple) else [item] * len(first) for item in arguments)
        rows = list(zip(*columns, strict=True))
        results = [function(*row) for row in rows]
        if getattr(function, "__name__", "") == "is_lost":
            self.origin = next((row[1].origin for row, lost in zip(rows, results, strict=True) if lost), self.origin)
        return _record(type(first), results)

    def unset(self, function: Callable[..., Any], f: Any, *arguments: Any) -> Any:
        """A result of function(f, *arguments), of which the loops use the fields alone: no call of the flight."""
        return function(self._unwatched, *arguments)

    def counted(self, what: str, count: int) -> Callable[[Any], Any]:
        def hand_on(fields: Any) -> Any:
            self.metrics = fields if what == "evaluate" else ()
            return fields

        return hand_on

    def picker(self, cls: Any, picks: Sequence[tuple[int, float, float]], count: Any = None) -> Callable[[Any], Any]:
        def pick(fields: Any) -> Any:
            values = [(-fields[i] if sign < 0 else fields[i], offset) for i, sign, offset in picks]
            return _record(cls, [value - offset if offset else value for value, offset in values])

        return pick

    def directions(self, signs: Sequence[float]) -> Callable[[Any], Any]:
        return lambda fields: _record(type(fields), [Number(sign) for sign in signs])

    def any_of(self, indices: Sequence[int]) -> Callable[[Any], Any]:
        return lambda masks: any(masks[i] for i in indices)


def _record(cls: Any, values: Sequence[Any]) -> Any:
    return cls(*values) if hasattr(cls, "_fields") else tuple(values)


def _spread(value: Any, like: Any) -> Any:
    if not isinstance(value, tuple):
        return number(value)
    return _record(type(value), [_spread(field, like) for field in value])


def _load_scalars(cls: Any, array: np.ndarray) -> Any:
    n = len(cls._fields) - (cls._fields[-1] == TABLES)
    return cls(*array[:n].tolist(), *([array[n + 2 :]] if n < len(cls._fields) else []))


def _store(array: np.ndarray, column: int, value: Any, lane: int = 0) -> None:
    array[..., column] = value


def _stage_sum(memory: list[Any], like: Any, first: int, last: int, columns: np.ndarray, weights: np.ndarray) -> Any:
    sums = [Number(0.0)] * len(like)
    for stage, weight in zip(columns[first:last], weights[first:last], strict=True):
        sums = [fma(Number(weight), value, summed) for value, summed in zip(memory[stage], sums, strict=True)]
    return _record(type(like), sums)


def _stage_sums(memory: list[Any], like: Any, first: int, last: int, columns: np.ndarray, weights: np.ndarray) -> Any:
    return tuple(_stage_sum(memory, like, first, last, columns, row) for row in weights)


def _unequal(one: Any, other: Any) -> bool:
    """See `mc_engine.lanes.lane_access.unequal`; records may hold records."""
    if isinstance(one, tuple):
        return any(map(_unequal, one, other))
    return bool(one != other) and not (one != one and other != other)


_INTRINSICS: dict[str, Callable[..., Any]] = {
    "spread": _spread,
    "least": functools.partial(functools.reduce, lambda x, y: x if x < y else y),
    "any_field": any,
    "select": lambda mask, chosen, other: chosen if mask else other,
    "add_scaled": lambda y, h, k: _record(type(y), [fma(number(h), slope, to) for slope, to in zip(k, y, strict=True)]),
    "joined": lambda *tuples: sum(map(tuple, tuples), ()),
    "first_fields": lambda fields, like: _record(type(like), fields[: len(like)]),
    "load": lambda array, first, width: Number(array[first]),
    "load_fields": lambda cls, array, first, width: cls(*_given(cls._fields, array[:, first].tolist())),
    "load_scalars": _load_scalars,
    "scalars_like": lambda like, array: _record(type(like), [Number(item) for item in array]),
    "store": _store,
    "store_fields": _store,
    "store_lane": lambda array, column, value, lane: _store(array, column, value),
    "unequal": lambda one, other, like: _unequal(one, other),
    "differ": lambda one, other, like: one != other,
    "lane_holds": lambda mask, lane: mask,
    "with_lane": lambda value, lane, item: number(item),
    "align_stack": lambda: None,
    "stage_memory": lambda like, count: [None] * count,
    "put_stage": lambda memory, stage, derivative: memory.__setitem__(stage, derivative),
    "take_stage": lambda memory, stage, like: memory[stage],
    "stage_sum": _stage_sum,
    "stage_sums": _stage_sums,
}


def _given(names: Sequence[str], values: Sequence[float]) -> list[float]:
    """The parameters of a case; one that is no number has an origin of its own, as nothing in the flight made it."""
    return [number(value, Origin(f'"{name}" of the kernel_parameters is {value:g}')) if math.isnan(value) else value
            for name, value in zip(names, values, strict=True)]  # fmt: skip
