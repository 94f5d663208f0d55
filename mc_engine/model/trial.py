"""Interpreted run of a model's physics on a few cases: its results must have the fields that the model declares.

The inputs are arrays, as in lanes, so that code that works only for a single number is found here.  A kernel relies on
the declared numbers of fields, so a model that has not passed this run is not flown.
"""

import dis
import sys
from collections import namedtuple
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.lanes.composed import Alternatives, value_of
from mc_engine.lanes.functions import TABLES
from mc_engine.lanes.number import calling
from mc_engine.lanes.philox import noise_key
from mc_engine.model.faults import MORE, fault_of_trial, origin_sentence, source_place
from mc_engine.model.phases import PHASE
from mc_engine.model.reading import is_shipped, place_of, source_faults
from mc_engine.model.record import Model, NoMemory
from mc_engine.suggestions import listed

FEW = 3  # cases on arrays
_MOST_ROUNDS = 1_000_000  # of the loops of one call, which a flight makes in every step
# what the fields of each function's result are declared by: in the record, and in the model's file
_FIELDS = {
    "initial": ("states", "states"),
    "observe": ("quantities", "outputs"),
    "events": ("event_list", "events"),
    "evaluate": ("metrics", "metrics"),
}
_OF_MEMORY = ("start", "control", "switch")  # what gives the discrete state
_MANY = 128  # values of everything that `evaluate` is handed
_DECADES = (-9.0, 15.0)  # powers of ten that they reach over: from nanometres to light years, in SI
_ENGINE = str(Path(__file__).parents[1])
_passed: set[Model] = set()


class Breach(ModelError):
    """One breach of the contract; its text is the sentence."""


@dataclass(frozen=True)
class Draws:
    """The draws of a sample, as `mc_engine.lanes.philox` has them, but no tuple: none of them is a random number."""

    key: int
    case: float
    sample: float
    __array_ufunc__ = None


class _ByZero(Exception):
    """A function divided a plain number by zero, where kernels go on with an infinity: it is left unjudged."""


def refuse_unfit(model: Model, parameters: np.ndarray, settings: Any) -> None:
    """ModelError with the first breach of a model that is about to be flown; asked once per model and process.

    parameters : float64[n_kernel_parameters, n], SI, n > 0.  settings : see `mc_engine.flight.flight.settings_of`.
    """
    if model in _passed:
        return
    breaches = [] if is_shipped(model) else source_faults(model)
    if not breaches:
        first = np.repeat(parameters[:, :1], FEW, axis=1)
        try:
            with np.errstate(all="ignore"):
                run_through(model, model.kernel_parameters(*first), settings)
        except Breach as breach:
            breaches = [str(breach)]
    if breaches:
        raise ModelError(f"{breaches[0]}{MORE}")
    _passed.add(model)


def run_through(model: Model, p: Any, o: Any, seed: int = 0, *, finite: bool = False) -> None:
    """Breach at the first function that breaks, or gives other numbers than the model declares.

    p : named tuple of arrays [FEW].  o : the settings.  finite : the start and its derivative must be finite, too.
    """
    if model.tables is not None and (o.tables.ndim != 1 or o.tables.size == 0 or np.isnan(o.tables).all()):
        # which is not what NumPy makes of None
        raise _breach(model.tables, "tables", f"an array of shape {o.tables.shape}", "float64[n], numbers in one row")
    with suppress(_ByZero):
        _run_through(model, p, o, seed, finite)


def _run_through(model: Model, p: Any, o: Any, seed: int, finite: bool) -> None:
    # as in kernels: dividing by zero gives an infinity
    o = type(o)(*(value if name == TABLES else np.float64(value) for name, value in zip(o._fields, o, strict=True)))
    t = np.zeros(FEW)
    s = _of_cases(_call(model, "initial", p, o))
    m = NoMemory(0.0) if model.start is None else _of_cases(_call(model, "start", p, o))
    if finite:
        _refuse_infinite("initial", model.initial, (p, o), s, "the state")
    for number in range(1, len(model.phases)):
        _try_phase(model, t, s, m._replace(**{PHASE: number + t}), p, o, seed, False)
    m = _try_phase(model, t, s, m, p, o, seed, finite)
    seen = _of_cases(_call(model, "observe", t, s, m, p, o))
    best = _best(model, seen)
    _call(model, "evaluate", t, s, m, p, o, best, type(best)(*(np.zeros(FEW) for _ in best)))


def _of_cases(record: Any) -> Any:
    """The record with an array in place of each number, as a flight has it: cases that begin alike differ later."""
    if hasattr(record, "_fields"):
        return type(record)(*map(_of_cases, record))
    return np.full(FEW, record, dtype=np.float64)


def _try_phase(model: Model, t: Any, s: Any, m: Any, p: Any, o: Any, seed: int, finite: bool) -> Any:
    """The discrete state after the first sample; the functions of a model, or of the phase that it is in."""
    if model.control is not None:
        sampled = _call(model, "control", t, s, m, p, o, Draws(noise_key(seed), 0.0, 0.0))
        _same_record(model.control, "control", sampled, "start", m)
        m = _of_cases(sampled)
    with suppress(_ByZero):
        derivative = _call(model, "rhs", t, s, m, p, o)
        rhs = _of_phase(model.rhs, (t, s, m, p, o))
        _same_record(rhs, "rhs", derivative, "initial", s)
        _refuse_false_rates(model, rhs, s, derivative)
        if finite:
            _refuse_infinite("rhs", rhs, (t, s, m, p, o), derivative, "the derivative")
    with suppress(_ByZero):
        _try_events(model, t, s, m, p, o)
    return m


def _refuse_false_rates(model: Model, rhs: Callable[..., Any], s: Any, derivative: Any) -> None:
    """Breach unless the derivative of a state is the state that the clock names as its rate."""
    for state, rate in getattr(model.clock, "rates", ()):
        given, wanted = np.asarray(getattr(derivative, state)), np.asarray(getattr(s, rate))
        if ((given != wanted) & (given == given)).any():
            gives = f'{np.ravel(given)[0]:g} for "{state}"'
            raise _breach(rhs, "rhs", gives, f"s.{rate}, here {np.ravel(wanted)[0]:g}: so say the `rates` of the clock")


def _of_phase(function: Any, arguments: tuple[Any, ...]) -> Any:
    """Of the functions of phases, that of the phase which all these cases are in; any other function itself."""
    if not isinstance(function, Alternatives):
        return function
    return function.parts[int(np.ravel(value_of(function.number, arguments, ()))[0])]


def _best(model: Model, seen: Any) -> Any:
    """The argument `best` of `evaluate` for outputs that stay constant.  seen : result of `observe`."""
    record = namedtuple("Best", [extremum.name for extremum in model.extrema] or ["unused"])  # type: ignore[misc]
    names = [output.name for output in model.quantities]
    return record(*[seen[names.index(extremum.quantity)] for extremum in model.extrema] or [np.zeros(FEW)])


def fixed_metrics(model: Model, p: Any, o: Any) -> dict[str, float]:
    """Metrics, by name, in SI, to which `evaluate` gives the same value for all arguments.

    p, o : as in `run_through`, which the model has passed.  Everything that a flight or an input could change is given
    many values of either sign, near those of the start and over all the orders of magnitude of SI; a function that
    breaks on them is not judged.
    """
    spread = np.random.default_rng(0)

    def many(value: Any) -> Any:
        if hasattr(value, "_fields"):
            return type(value)(*(many(item) for item in value))
        signs = spread.choice([-1.0, 1.0], (2, _MANY))
        near = signs[0] * np.exp(spread.normal(0.0, 3.0, _MANY))
        anywhere = signs[1] * 10.0 ** spread.uniform(*_DECADES, _MANY)
        return near * np.ravel(value)[0] + anywhere * spread.integers(0, 2, _MANY)

    values = []
    for shift in (0.0, 1.0, 2.0):
        own = type(o)(*(value if name == TABLES else value + shift for name, value in zip(o._fields, o, strict=True)))
        try:
            with np.errstate(all="ignore"):
                s, m = model.initial(p, o), NoMemory(0.0) if model.start is None else model.start(p, o)
                best = _best(model, model.observe(np.zeros(FEW), s, m, p, o))
                given = model.evaluate(many(1.0), many(s), many(m), many(p), own, many(best), many(best))
                values.append([np.broadcast_to(np.asarray(item, dtype=np.float64), _MANY) for item in given])
        except Exception:
            return {}  # no finding: the functions are judged by the trial itself
    rows = np.concatenate(values, axis=1)  # [n_metrics, 3 * _MANY]
    return {metric.name: row[0] for metric, row in zip(model.metrics, rows, strict=True) if (row == row[0]).all()}


def _try_events(model: Model, t: Any, s: Any, m: Any, p: Any, o: Any) -> None:
    if model.events is None:
        return
    values = _call(model, "events", t, s, m, p, o)
    if model.switch is None:
        return
    arguments = (t, s, m, p, o, type(values)(*(np.ones(FEW) for _ in values)))
    _refuse_short(model.switch, "switch", arguments)
    result = _run(model.switch, arguments)
    _refuse_other_pair(model.switch, "switch", result)
    for given, wanted, source in zip(result, (s, m), ("initial", "start"), strict=True):
        _same_record(model.switch, "switch", given, source, wanted)
        _refuse_other_than_numbers(model.switch, "switch", given)


def _refuse_other_pair(function: Callable[..., Any], name: str, given: Any) -> None:
    if not isinstance(given, tuple) or len(given) != 2 or hasattr(given, "_fields"):
        raise _breach(function, name, _shape_of(given), "state and memory, (s, m)")


def _same_record(function: Callable[..., Any], name: str, given: Any, source: str, wanted: Any) -> None:
    if getattr(given, "_fields", None) != getattr(wanted, "_fields", None):
        raise _breach(function, name, _shape_of(given), f"the named tuple of `{source}`, {_shape_of(wanted)}")
    for field, own in zip(given, wanted, strict=True) if hasattr(wanted, "_fields") else ():
        _same_record(function, name, field, source, own)  # a discrete state may hold records


def _call(model: Model, name: str, *arguments: Any) -> Any:
    """The result of one function of the model, a named tuple with a field for each that the model declares."""
    function = _of_phase(getattr(model, name), arguments)
    watched = getattr(model, name) is model.events  # also as `observe`, while events are watched
    _refuse_short(function, "events" if watched else name, arguments)
    result = _run(function, arguments)
    if not hasattr(result, "_fields"):
        raise _breach(function, name, "nothing" if result is None else _shape_of(result), "a named tuple")
    if name in _FIELDS:
        attribute, declared = _FIELDS[name]
        known = getattr(model, attribute)
        wanted = [item.symbol if name in ("initial", "observe") else item.name for item in known]
        if [*result._fields] != wanted:
            gives = f"what `{declared}` declares, in its order: {listed(wanted)}"
            raise _breach(function, name, listed(result._fields), gives)
    _refuse_other_than_numbers(function, name, result)
    return result


def _refuse_short(function: Any, name: str, arguments: tuple[Any, ...]) -> None:
    """Breach where a part of a composed function gives no record with the fields that are taken from it."""
    results: list[Any] = []
    for i, (part, chosen) in enumerate(getattr(function, "calls", ())):
        handed = tuple(value_of(pick, arguments, results) for pick in chosen)
        part = _of_phase(part, handed)
        _refuse_short(part, name, handed)
        given = _run(part, handed)
        results.append(given)
        picks = [*function.picks, *(pick for _, later in function.calls for pick in later)]
        fields = [field for source, index, field in picks if (source, index) == ("result", i) and field != ""]
        named = [field for field in fields if isinstance(field, str)]
        if name == "events" and not isinstance(given, tuple):
            continue  # a number, which several events may share
        if not set(named) <= set(getattr(given, "_fields", ())):
            gives = "nothing" if given is None else _shape_of(given)
            raise _breach(part, name, gives, f"a record with {listed(named)}")
        if fields and not named and getattr(part, "record", None) is not tuple:  # what the model itself gives
            _refuse_other_pair(part, name, given)


def _run(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """What a function gives on arrays; on numbers where it negates a mask, which lanes can and arrays cannot."""
    try:
        with _counted_rounds():
            try:
                return function(*arguments)
            except ValueError as error:
                if not _negates(error):
                    raise
                return function(*(_first_case(argument) for argument in arguments))
    except ZeroDivisionError as error:
        raise _ByZero from error
    except Breach:
        raise
    except Exception as error:
        raise Breach(fault_of_trial(error)) from None


@contextmanager
def _counted_rounds() -> Iterator[None]:
    """Breach where the loops of the model go round too often, or for ever: every line is traced."""
    left = _MOST_ROUNDS
    last: dict[FrameType, int] = {}  # the line that each frame was at last

    def on_line(frame: FrameType, event: str, _: Any) -> Any:
        nonlocal left
        if event == "line":
            left -= frame.f_lineno <= last.get(frame, 0)
            last[frame] = frame.f_lineno
        elif event == "return":
            last.pop(frame, None)
        if left < 0:
            place = source_place(frame.f_code.co_filename, frame.f_lineno)
            raise Breach(f"{place}: loops go round more than {_MOST_ROUNDS:,} times in one step; shorten them")
        return on_line

    def on_call(frame: FrameType, event: str, _: Any) -> Any:
        return None if frame.f_code.co_filename.startswith(_ENGINE) else on_line

    before = sys.gettrace()
    sys.settrace(on_call)
    try:
        yield
    finally:
        sys.settrace(before)


def _shape_of(result: Any) -> str:
    """A record as "State(x, y)", anything else by its type."""
    fields = getattr(result, "_fields", None)
    return type(result).__name__ if fields is None else f"{type(result).__name__}({', '.join(fields)})"


def _negates(error: ValueError) -> bool:
    """Whether the error came from `not` alone: not from `if`, nor from `and` or `or`."""
    place = error.__traceback__
    while place is not None and place.tb_next is not None:
        place = place.tb_next
    if place is None or "truth value of an array" not in str(error):
        return False
    steps = [step for step in dis.get_instructions(place.tb_frame.f_code) if step.offset >= place.tb_lasti]
    return next(step.opname for step in steps if step.opname != "TO_BOOL") == "UNARY_NOT"


def _first_case(value: Any) -> Any:
    """The numbers of the first case: of an array, of a named tuple of arrays, or the number itself."""
    if hasattr(value, "_fields"):
        return value if TABLES in value._fields else type(value)(*(_first_case(item) for item in value))
    return float(value[0]) if np.ndim(value) == 1 else value


def _breach(function: Callable[..., Any], name: str, gives: str, wanted: str) -> Breach:
    return Breach(f"{place_of(function)}: `{name}` gives {gives}; it must give {wanted}")


def _refuse_other_than_numbers(function: Callable[..., Any], name: str, result: Any) -> None:
    """Breach unless every field is one real number, or one for each case; a discrete state may hold records of them."""
    for field, value in zip(result._fields, result, strict=True):
        if hasattr(value, "_fields") and name in _OF_MEMORY:
            _refuse_other_than_numbers(function, name, value)
            continue
        part = _part_giving(function, field)
        try:
            array = np.asarray(value)
        except ValueError:
            array = np.asarray(None)
        if array.dtype == bool:
            wanted = "one that crosses zero" if name == "events" else "where(condition, 1.0, 0.0)"
            raise _breach(part, name, f'a truth value for "{field}"', f"a number, such as {wanted}")
        if array.dtype.kind not in "iuf" or array.shape not in ((), (FEW,)):
            what = f"{value!r}" if array.ndim == 0 and len(repr(value)) < 40 else type(value).__name__
            raise _breach(part, name, f'{what} for "{field}"', "one number")


def _part_giving(function: Any, field: str) -> Callable[..., Any]:
    """The function that gives a field of the result of another, which may be composed of several."""
    if isinstance(function, Alternatives):  # of phases: in those that do not look for an event it is a constant
        found = ((part, _part_giving(part, field)) for part in function.parts)
        return next((giving for part, giving in found if giving is not part), function)
    fields = getattr(getattr(function, "record", None), "_fields", ())
    source, index, _ = function.picks[fields.index(field)] if field in fields else ("", 0, "")
    return _part_giving(function.calls[index][0], field) if source == "result" else function


def _refuse_infinite(
    name: str, function: Callable[..., Any], arguments: tuple[Any, ...], result: Any, what: str
) -> None:
    for field, value in zip(result._fields, result, strict=True):
        if not np.isfinite(value).all():
            bad = np.ravel(value)[~np.isfinite(np.ravel(value))][0]
            lost = getattr(calling(name, function, tuple(map(_first_case, arguments))), field)
            origin = getattr(lost, "origin", None)
            first = origin_sentence(origin) if origin else f"{place_of(function)}: out of range"
            raise Breach(f'{first}; so `{name}` gives {bad:g} for {what} of "{field}" at the start of the nominal '
                         "case; keep square roots, logarithms and divisions in range")  # fmt: skip
