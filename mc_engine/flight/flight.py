"""Flight of cases: converts inputs to SI, calls the model's `prepare`, runs the kernel, converts the results back."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from mc_engine.campaign.columns import END_PHASE, END_TIME
from mc_engine.errors import ModelError
from mc_engine.flight.kernel import build_kernel, usual_width
from mc_engine.flight.kernel_parts import blocks_of, settings_class
from mc_engine.interruption import in_another_thread
from mc_engine.lanes.functions import TABLES
from mc_engine.lanes.kernel_data import gathered
from mc_engine.lanes.philox import noise_key
from mc_engine.lanes.runge_kutta_pairs import PAIRS
from mc_engine.model.fields import AdaptiveStep, FixedStep
from mc_engine.model.preparation import call_prepare
from mc_engine.model.reading import place_of
from mc_engine.model.record import Model, Refusals
from mc_engine.model.trial import refuse_unfit
from mc_engine.status import OK, REFUSED, STATUS_NAME
from mc_engine.store.histories import PHASE_COLUMN, rows_to_keep
from mc_engine.suggestions import hint

if TYPE_CHECKING:
    from mc_engine.flight.interpreted import InterpretedFlight

Inputs = Mapping[str, Any]
_NO_TABLES = np.empty(0)
_MOST_RECORDED = 200_000  # rows of a flight, of which its history keeps some
_OVERSAMPLED = 4  # times as many rows as are kept, where steps are so long that they are divided
_MOST_STEPS = 10**9  # of a flight, as AdaptiveStep's attempts: a year of 0.03 s, a minute of one core
_STATUS_WORDS = np.array([STATUS_NAME[code] for code in range(len(STATUS_NAME))], dtype=object)


@dataclass
class Prepared:
    """Cases ready for the kernel: SI parameter rows, setting codes, and which cases were refused and why."""

    parameters: np.ndarray  # float64[n_kernel_parameters, n]
    settings: np.ndarray  # float64[n, n_settings]
    refusals: Refusals
    tables: np.ndarray  # float64[...], what `prepare` adds to the model's tables, one case's numbers after another's


def prepare(model: Model, inputs: Inputs, n_cases: int) -> Prepared:
    """SI parameters for the kernel.

    inputs : every parameter and setting of the model by column name, in declared units; a value counts for
        all cases, an array [n_cases] gives one each.
    """
    si = SimpleNamespace()
    refusals = Refusals.none(n_cases)
    for parameter in model.parameters:
        column = np.broadcast_to(np.asarray(inputs[parameter.name], dtype=np.float64), n_cases)
        refusals.add(np.isnan(column), f"{parameter.name} is not a number")
        refusals.add(np.isinf(column), f"{parameter.name} is infinite")
        outside = ~((column >= parameter.low) & (column <= parameter.high))
        refusals.add(outside, f"{parameter.name} is outside {parameter.low:g} to {parameter.high:g} {parameter.unit}")
        setattr(si, parameter.symbol, column * parameter.si_factor)
    settings = np.column_stack(
        [_setting_codes(setting, inputs[setting.name], n_cases) for setting in model.settings] or [np.zeros(n_cases)]
    )
    columns: Mapping[str, np.ndarray] = vars(si)
    if model.prepare is not None:
        words = SimpleNamespace(**{setting.symbol: settings[:, i] for i, setting in enumerate(model.settings)})
        columns = call_prepare(model, si, words, refusals)
    if not isinstance(columns, Mapping):
        raise ModelError(f"{_design(model)} gives {type(columns).__name__}; it must return a dictionary of arrays by "
                         "the fields of kernel_parameters")  # fmt: skip
    names = model.kernel_parameters._fields  # type: ignore[attr-defined]
    rows = [_parameter_row(model, columns, name, n_cases) for name in names]
    tables = np.asarray(columns.get(TABLES, np.empty(0)), dtype=np.float64).ravel()
    return Prepared(np.array(rows).reshape(len(names), n_cases), settings, refusals, tables)


def _parameter_row(model: Model, columns: Mapping[str, Any], name: str, n_cases: int) -> np.ndarray:
    """One kernel parameter of all cases; ModelError if the design does not give it."""
    if name not in columns:
        source = (
            f"{_design(model)} does not give it" if model.prepare else "no parameter has this name without its unit"
        )
        raise ModelError(f'kernel_parameters has the field "{name}", but {source}{hint(name, columns)}')
    try:
        column = np.asarray(columns[name])
    except ValueError:  # of rows that differ in length
        column = np.asarray(None)
    # one number counts for all cases; an array of one would do so by mistake
    if column.dtype.kind in "biuf" and column.shape in ((), (n_cases,)):
        return np.broadcast_to(column.astype(np.float64, copy=False), n_cases)
    raise ModelError(f'{_design(model)} gives "{name}" as {_described(columns[name], column)}; it must be a number for '
                     f"each of {n_cases} cases")  # fmt: skip


def _described(value: Any, column: np.ndarray) -> str:
    """What is wrong with a column."""
    if column.dtype.kind == "c":
        return "complex numbers"
    if column.ndim == 0:
        return type(value).__name__
    return f"shape {column.shape}" if column.dtype.kind in "biuf" else f"an array of {column.dtype.name}"


def _design(model: Model) -> str:
    return f"{place_of(model.prepare)}: `prepare`" if model.prepare else "the model"


def _setting_codes(setting: Any, values: Any, n_cases: int) -> np.ndarray:
    if np.ndim(values) == 0:
        return np.full(n_cases, setting.code(values))
    return np.array([setting.code(value) for value in values], dtype=np.float64)


def fly(
    model: Model,
    inputs: Inputs,
    case_ids: np.ndarray,
    seed: int,
    *,
    folder: Path | None = None,
    width: int | None = None,
    clock: FixedStep | AdaptiveStep | None = None,
) -> dict[str, np.ndarray]:
    """Results of some cases as columns: status, reason, `end_...` states and metrics in declared units.

    case_ids : int64[n], the addresses of the noise.  Cases of different settings may be mixed.
    width : cases at a time, 1, 8 or 16; by default what is fastest for the model.
    clock : another one of the kind of the model's own; the kernel is the same.
    """
    n, width = len(case_ids), width or usual_width(model)
    ready = prepare(model, inputs, n)
    status = np.where(ready.refusals.mask, REFUSED, OK).astype(np.float64)
    time = np.full(n, np.nan)
    states = np.full((len(model.states), n), np.nan)
    metrics = np.full((_n_results(model), n), np.nan)
    for chosen in _groups_by_settings(ready):
        flight = _fly_group(model, clock or model.clock, ready, chosen, case_ids, seed, folder, width)
        time[chosen], status[chosen], states[:, chosen], metrics[:, chosen] = flight
    last_phase = phase_words(model, metrics[-1])
    metrics = metrics[: len(model.metrics)]
    metrics[:, status != OK] = np.nan
    reason = ready.refusals.reason.astype(object)
    failed = (status != OK) & (last_phase != "")
    reason[failed] = [f'in the phase "{word}"' for word in last_phase[failed]]
    columns: dict[str, np.ndarray] = {
        "status": _STATUS_WORDS[status.astype(int)],
        "reason": reason,
        END_TIME: time,
    }
    if model.phases:
        columns[END_PHASE] = last_phase
    columns |= {f"end_{field.name}": row / field.si_factor for field, row in zip(model.states, states, strict=True)}
    return columns | {field.name: row / field.si_factor for field, row in zip(model.metrics, metrics, strict=True)}


def phase_words(model: Model, numbers: np.ndarray) -> np.ndarray:
    """object[n] of str, the names of the phases with these numbers; empty for NaN and in a model without phases."""
    words = np.array([*model.phases, ""], dtype=object)
    known = np.isfinite(numbers) & bool(model.phases)
    return words[np.where(known, np.nan_to_num(numbers), -1).astype(int)]


def _n_results(model: Model) -> int:
    """Numbers that a kernel gives for each case: the metrics, and the last phase of a model with phases."""
    return len(model.metrics) + bool(model.phases)


def _groups_by_settings(ready: Prepared) -> list[np.ndarray]:
    """Indices of the cases that can fly, one array per combination of settings."""
    able = np.flatnonzero(~ready.refusals.mask)
    if not able.size or (ready.settings == ready.settings[able[0]]).all():
        return [able] if able.size else []
    _, group = np.unique(ready.settings[able], axis=0, return_inverse=True)
    group = group.ravel()
    return [able[group == i] for i in range(int(group.max()) + 1)]


def _clock_number(item: float | str | Callable[[Any], float], settings: Any) -> float:
    if callable(item):
        return float(item(settings))
    return float(getattr(settings, item) if isinstance(item, str) else item)


def settings_of(model: Model, codes: np.ndarray, tables: np.ndarray = _NO_TABLES) -> Any:
    """The settings of one kernel call by symbol, codes and SI numbers, with the model's tables if it has any.

    tables : of the cases, behind those of the model.
    """
    shared = _settings_of(model, tuple(float(code) for code in codes))
    own = tables.size and model.tables is not None
    return shared._replace(tables=np.concatenate([shared.tables, tables])) if own else shared


@lru_cache(maxsize=64)
def _settings_of(model: Model, codes: tuple[float, ...]) -> Any:
    chosen = settings_class(model)
    if model.tables is None:
        return chosen(*codes)
    return chosen(*codes, np.ascontiguousarray(model.tables(chosen(*codes, np.empty(0))), dtype=np.float64))


def _kernel_settings(model: Model, codes: np.ndarray, chosen: Any) -> np.ndarray:
    """The same as one array, as kernels take it: codes, then NaN, the last place of the tables, and the tables."""
    if model.tables is None:
        return codes
    return np.concatenate([codes, [np.nan, chosen.tables.size - 1.0], chosen.tables])


def grid_of(clock: FixedStep, settings: Any) -> tuple[int, float, int]:
    """(n_steps, step [s], control_every) of one flight; the last step is the one that reaches `until`."""
    step, until, every = (_clock_number(item, settings) for item in (clock.step, clock.until, clock.control_every))
    if not (step > 0.0 and 0.0 < until <= _MOST_STEPS * step and every >= 1.0):
        raise ModelError(f"the clock has steps of {step:g} s until {until:g} s, control every {every:g} steps; all "
                         f"must be above 0, with no more than {_MOST_STEPS:,} steps")  # fmt: skip
    # a hair under the quotient, so that 300 s in steps of 0.01 s are 30 000 steps, not 30 001
    n_steps = max(1, int(np.ceil(until / step - 1e-9)))
    return n_steps, step, int(every)


def fixed_arguments(clock: FixedStep, settings: Any) -> tuple[Any, ...]:
    """Grid, and tables of a multistep method, as the kernels on a fixed grid take them."""
    if clock.method == "rk4":
        return grid_of(clock, settings)
    from mc_engine.lanes.multistep import multistep_tables

    return *grid_of(clock, settings), *multistep_tables(clock.method)


def adaptive_arguments(model: Model, clock: AdaptiveStep, settings: Any) -> tuple[np.ndarray, ...]:
    """Tables of the pair, clock and absolute tolerances, as the adaptive kernels take them."""
    pair = PAIRS[clock.method]
    numbers = [_clock_number(item, settings) for item in (clock.until, clock.rtol, clock.control_period)]
    if not all(number > 0.0 for number in numbers):
        raise ModelError("the clock has until = {:g} s, rtol = {:g}, control_period = {:g} s; all must be above 0"
                         .format(*numbers))  # fmt: skip
    numbers += [float(clock.attempts), clock.first_step, float(pair.order)]
    return *pair.tables(), np.array(numbers), np.array(np.broadcast_to(clock.atol, len(model.states)), dtype=np.float64)


def _fly_group(
    model: Model,
    clock: FixedStep | AdaptiveStep,
    ready: Prepared,
    chosen: np.ndarray,
    case_ids: np.ndarray,
    seed: int,
    folder: Path | None,
    width: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    n = chosen.size
    # blocks on a fixed grid are filled up; adaptive lanes take the cases in turn, and want one each to begin with
    padded = max(n, width) if isinstance(clock, AdaptiveStep) else -(-n // width) * width
    index = np.concatenate([chosen, np.full(padded - n, chosen[-1])])
    out = _outputs(model, padded)
    settings = np.ascontiguousarray(ready.settings[chosen[0]])
    cases = ready.parameters[:, index], settings, ready.tables
    in_another_thread(_bound_kernel(model, clock, folder, width, cases, seed, case_ids[index], out, _NO_HISTORY, 1.0))
    time, status, states, metrics = out
    return time[:n], status[:n], states[:, :n], metrics[:, :n]


_NO_HISTORY = np.empty((0, 0))


def _outputs(model: Model, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    return np.empty(n), np.empty(n), np.empty((len(model.states), n)), np.empty((_n_results(model), n))


def _bound_kernel(
    model: Model,
    clock: FixedStep | AdaptiveStep,
    folder: Path | None,
    width: int,
    inputs: tuple[np.ndarray, np.ndarray, np.ndarray],
    seed: int,
    case_ids: np.ndarray,
    out: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    history: np.ndarray,
    pace: float,
    kernel: Callable[..., int] | None = None,
) -> Callable[[], int]:
    """The kernel with all its arguments.

    inputs : parameters [n_kernel_parameters, n], setting codes, tables of the cases
    pace : of the history, in steps from row to row or, if the steps are adaptive, in rows of a step
    kernel : in place of the model's own
    """
    parameters, settings, tables = inputs
    chosen = settings_of(model, settings, tables)
    if kernel is None:
        refuse_unfit(model, parameters, chosen)
        kernel = build_kernel(model, folder, width)
    cases = np.ascontiguousarray(case_ids, dtype=np.float64)
    kernel_settings = _kernel_settings(model, settings, chosen)
    data = gathered(blocks_of(model))
    shared = np.ascontiguousarray(parameters), kernel_settings, data, np.uint64(noise_key(seed)), cases
    if isinstance(clock, AdaptiveStep):
        return partial(kernel, *shared, *adaptive_arguments(model, clock, chosen), *out, history, float(pace))
    return partial(kernel, *shared, *fixed_arguments(clock, chosen), *out, history, int(pace))


def bound_flight(
    model: Model, inputs: Inputs, case_ids: np.ndarray, seed: int, *, folder: Path | None = None, width: int
) -> tuple[Callable[[], int], np.ndarray, np.ndarray]:
    """(function that flies by the kernel alone, its end times [s], its setting codes): what a speed is measured on.

    Of the cases that can start, those flown have the settings of the first, and are a whole number of `width`.
    Raises ModelError with the reason if no case can start.
    """
    ready = prepare(model, inputs, len(case_ids))
    groups = _groups_by_settings(ready)
    if not groups:
        raise ModelError(f"no case can start: {ready.refusals.reason[0]}")
    chosen = np.resize(groups[0], -(-groups[0].size // width) * width)
    out = _outputs(model, chosen.size)
    settings = np.ascontiguousarray(ready.settings[chosen[0]])
    cases = ready.parameters[:, chosen], settings, ready.tables
    ids = case_ids[chosen]
    return _bound_kernel(model, model.clock, folder, width, cases, seed, ids, out, _NO_HISTORY, 1.0), out[0], settings


def fly_interpreted(
    flight: "InterpretedFlight", inputs: Inputs, case_id: int, seed: int, history: Any = _NO_HISTORY
) -> tuple[np.ndarray, ...]:
    """(time, status, states, metrics) of one case in SI, flown by Python.

    It takes some thousand times as long as a kernel; OutOfTime after the seconds that the flight may take.  The case
    must be able to start.  history : as the kernel takes it, a row for every step.
    """
    ready = prepare(flight.model, inputs, 1)
    settings, out = np.ascontiguousarray(ready.settings[0]), _outputs(flight.model, 1)
    cases = ready.parameters, settings, ready.tables
    clock, ids = flight.model.clock, np.array([case_id])
    _bound_kernel(flight.model, clock, None, 1, cases, seed, ids, out, history, 1.0, flight.kernel)()
    return out


def fly_history(
    model: Model,
    inputs: Inputs,
    case_id: int,
    seed: int,
    *,
    folder: Path | None = None,
    width: int | None = None,
    rows: int = 1500,
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """(columns, history) of one case alone: the same bits as among others, whatever the width of the build.

    rows : of the history, see `mc_engine.store.histories.rows_to_keep`; fewer where a fixed grid has fewer steps
    history : t_s and the model's outputs in declared units; empty if the case was refused.  Of a time with two rows
        the first is before an event or a sample of the control, the second after it.
    """
    width = width or usual_width(model)
    ready = prepare(model, inputs, 1)
    columns = fly(model, inputs, np.array([case_id]), seed, folder=folder, width=width)
    names = ["t_s", *(quantity.name for quantity in model.quantities), *([PHASE_COLUMN] if model.phases else [])]
    if ready.refusals.mask[0]:
        return columns, {name: np.empty(0) for name in names}
    settings = np.ascontiguousarray(ready.settings[0])
    ids, parameters = np.full(width, case_id), np.repeat(ready.parameters, width, axis=1)
    cases = parameters, settings, ready.tables

    def recorded(room: int, pace: float) -> tuple[int, np.ndarray]:
        """(rows that the flight has, as many of them as there is room for)."""
        history, out = np.empty((room, len(names))), _outputs(model, width)
        bound = _bound_kernel(model, model.clock, folder, width, cases, seed, ids, out, history, pace)
        return in_another_thread(bound), history

    pace = _history_pace(model, settings, rows, lambda: recorded(1, 1.0)[0])
    _, table = recorded(recorded(1, pace)[0], pace)
    table[:, 1 : 1 + len(model.quantities)] /= [quantity.si_factor for quantity in model.quantities]
    kept = table[rows_to_keep(table, rows)]
    history = {name: kept[:, i] for i, name in enumerate(names)}
    if model.phases:
        history[PHASE_COLUMN] = phase_words(model, kept[:, -1])
    return columns, history


def _history_pace(model: Model, settings: np.ndarray, rows: int, at_steps: Callable[[], int]) -> float:
    """Pace at which a history is recorded, of which `rows` rows are kept: all steps of the flight if memory allows.

    at_steps : tells how many rows an adaptive flight has at its own steps.  Steps so long that there are fewer than
    wanted are divided.  On a fixed grid the pace is in steps.
    """
    most = max(_MOST_RECORDED, _OVERSAMPLED * rows)
    if isinstance(model.clock, FixedStep):
        n_steps = grid_of(model.clock, settings_of(model, settings))[0]
        return float(-(-2 * n_steps // most))
    n = at_steps()
    return most / n if n > most else float(max(1, -(-_OVERSAMPLED * rows // n)))
