"""From the inputs of some cases to their results: units, design, kernel, units again."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from mc_engine.kernel import WIDTH, build_kernel, settings_class
from mc_engine.lanes.noise import noise_key
from mc_engine.model import FixedStep, Model, Refusals
from mc_engine.status import OK, REFUSED, STATUS_NAME

Inputs = Mapping[str, Any]
END_TIME = "end_time_s"
_STATUS_WORDS = np.array([STATUS_NAME[code] for code in range(len(STATUS_NAME))], dtype=object)


@dataclass
class Prepared:
    """Cases ready for the kernel: SI parameter rows, setting codes, and which cases were refused and why."""

    parameters: np.ndarray  # float64[n_kernel_parameters, n]
    settings: np.ndarray  # float64[n, n_settings]
    refusals: Refusals


def prepare(model: Model, inputs: Inputs, n_cases: int) -> Prepared:
    """SI parameters for the kernel.

    inputs : every parameter and setting of the model by column name, in declared units; a value counts for
        all cases, an array [n_cases] gives one each.
    """
    si = SimpleNamespace()
    refusals = Refusals.none(n_cases)
    for parameter in model.parameters:
        column = np.broadcast_to(np.asarray(inputs[parameter.name], dtype=np.float64), n_cases)
        outside = ~((column >= parameter.low) & (column <= parameter.high))
        refusals.add(outside, f"{parameter.name} is outside {parameter.low:g} to {parameter.high:g} {parameter.unit}")
        setattr(si, parameter.symbol, column * parameter.si_factor)
    settings = np.column_stack(
        [_codes(setting, inputs[setting.name], n_cases) for setting in model.settings] or [np.zeros(n_cases)]
    )
    columns: Mapping[str, np.ndarray] = vars(si)
    if model.prepare is not None:
        words = SimpleNamespace(**{setting.symbol: settings[:, i] for i, setting in enumerate(model.settings)})
        with np.errstate(all="ignore"):  # refused cases may divide by zero on their way
            columns = model.prepare(si, words, refusals)
    names = model.kernel_parameters._fields  # type: ignore[attr-defined]
    rows = [np.broadcast_to(np.asarray(columns[name], dtype=np.float64), n_cases) for name in names]
    return Prepared(np.array(rows).reshape(len(names), n_cases), settings, refusals)


def _codes(setting: Any, values: Any, n_cases: int) -> np.ndarray:
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
    width: int = WIDTH,
) -> dict[str, np.ndarray]:
    """Results of some cases as columns: status, reason, `end_...` states and metrics in declared units.

    case_ids : int64[n], the addresses of the noise.  Cases of different settings may be mixed.
    """
    n = len(case_ids)
    ready = prepare(model, inputs, n)
    status = np.where(ready.refusals.mask, REFUSED, OK).astype(np.float64)
    time = np.full(n, np.nan)
    states = np.full((len(model.states), n), np.nan)
    metrics = np.full((len(model.metrics), n), np.nan)
    for chosen in _groups(ready):
        flight = _fly_group(model, ready, chosen, case_ids, seed, folder, width)
        time[chosen], status[chosen], states[:, chosen], metrics[:, chosen] = flight
    metrics[:, status != OK] = np.nan
    columns: dict[str, np.ndarray] = {
        "status": _STATUS_WORDS[status.astype(int)],
        "reason": ready.refusals.reason.astype(object),
        END_TIME: time,
    }
    columns |= {f"end_{field.name}": row / field.si_factor for field, row in zip(model.states, states, strict=True)}
    return columns | {field.name: row / field.si_factor for field, row in zip(model.metrics, metrics, strict=True)}


def _groups(ready: Prepared) -> list[np.ndarray]:
    """Indices of the cases that can fly, one array per combination of settings."""
    able = np.flatnonzero(~ready.refusals.mask)
    if not able.size or (ready.settings == ready.settings[able[0]]).all():
        return [able] if able.size else []
    _, group = np.unique(ready.settings[able], axis=0, return_inverse=True)
    group = group.ravel()
    return [able[group == i] for i in range(int(group.max()) + 1)]


def grid_of(clock: FixedStep, settings: Any) -> tuple[int, float, int]:
    """(n_steps, step [s], control_every) of one flight; the last step is the one that reaches `until`."""

    def value(item: float | int | str) -> float:
        return float(getattr(settings, item) if isinstance(item, str) else item)

    step = value(clock.step)
    # a hair under the quotient, so that 300 s in steps of 0.01 s are 30 000 steps, not 30 001
    return max(1, int(np.ceil(value(clock.until) / step - 1e-9))), step, int(value(clock.control_every))


def _fly_group(
    model: Model, ready: Prepared, chosen: np.ndarray, case_ids: np.ndarray, seed: int, folder: Path | None, width: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    n = chosen.size
    padded = -(-n // width) * width
    index = np.concatenate([chosen, np.full(padded - n, chosen[-1])])
    out = _outputs(model, padded)
    settings = np.ascontiguousarray(ready.settings[chosen[0]])
    _call(model, folder, width, ready.parameters[:, index], settings, seed, case_ids[index], out, _NO_HISTORY, 1)
    time, status, states, metrics = out
    return time[:n], status[:n], states[:, :n], metrics[:, :n]


_NO_HISTORY = np.empty((0, 0))


def _outputs(model: Model, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    return np.empty(n), np.empty(n), np.empty((len(model.states), n)), np.empty((len(model.metrics), n))


def _call(
    model: Model,
    folder: Path | None,
    width: int,
    parameters: np.ndarray,
    settings: np.ndarray,
    seed: int,
    case_ids: np.ndarray,
    out: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    history: np.ndarray,
    stride: int,
) -> int:
    kernel = build_kernel(model, folder, width)
    grid = grid_of(model.clock, settings_class(model)(*settings))
    cases = np.ascontiguousarray(case_ids, dtype=np.float64)
    key = np.uint64(noise_key(seed))
    return kernel(np.ascontiguousarray(parameters), settings, key, cases, *grid, *out, history, stride)


def fly_history(
    model: Model,
    inputs: Inputs,
    case_id: int,
    seed: int,
    *,
    folder: Path | None = None,
    width: int = WIDTH,
    rows: int = 1500,
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """(columns, history) of one case alone: the same bits as among others, whatever the width of the build.

    rows : about how many instants a flight to the time limit has, the start and the end among them.
    history : t_s and the model's quantities in declared units; empty if the case was refused.
    """
    ready = prepare(model, inputs, 1)
    columns = fly(model, inputs, np.array([case_id]), seed, folder=folder, width=width)
    names = ["t_s", *(quantity.name for quantity in model.quantities)]
    if ready.refusals.mask[0]:
        return columns, {name: np.empty(0) for name in names}
    n_steps = grid_of(model.clock, settings_class(model)(*ready.settings[0]))[0]
    stride = max(1, n_steps // rows)
    history = np.empty((n_steps // stride + 4, len(names)))
    ids, parameters = np.full(width, case_id), np.repeat(ready.parameters, width, axis=1)
    settings = np.ascontiguousarray(ready.settings[0])
    n = _call(model, folder, width, parameters, settings, seed, ids, _outputs(model, width), history, stride)
    factors = [1.0, *(quantity.si_factor for quantity in model.quantities)]
    return columns, {name: history[:n, i] / factors[i] for i, name in enumerate(names)}
