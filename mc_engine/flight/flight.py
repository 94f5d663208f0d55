"""Flight of cases: prepares them, runs the kernel, and converts the results to declared units."""

from collections.abc import Callable, Iterator
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from mc_engine.campaign.columns import END_PHASE, END_TIME
from mc_engine.errors import ModelError
from mc_engine.flight.flyer import Columns, Inputs, phase_words, status_words
from mc_engine.flight.kernel import Builder, adaptive_arguments, build_kernel, fixed_arguments, grid_of, usual_width
from mc_engine.flight.kernel_parts import blocks_of, settings_class
from mc_engine.lanes.kernel_data import gathered
from mc_engine.lanes.philox import noise_key
from mc_engine.model.designs import designing
from mc_engine.model.fields import AdaptiveStep, Field, FixedStep, inputs_of
from mc_engine.model.preparation import Prepared, prepare
from mc_engine.model.record import Model, Refusals
from mc_engine.model.trial import refuse_unfit
from mc_engine.status import OK, REFUSED

_NO_TABLES, _NO_HISTORY = np.empty(0), np.empty((0, 0))
_NO_RECORDING = _NO_HISTORY, np.empty(0, dtype=np.int64), np.ones(1)
_MOST_RECORDED = 200_000  # rows of a flight, of which its history keeps some
_USUAL_ROOM = 2_000  # rows of adaptive steps that are recorded without counting them first
_MOST_NUMBERS = 2**24  # of the rows of cases that fly together: 128 MiB
_OVERSAMPLED = 4  # times as many rows as are kept, where steps are so long that they are divided


def fly(
    model: Model,
    inputs: Inputs,
    case_ids: np.ndarray,
    seed: int,
    *,
    folder: Path | None = None,
    width: int | None = None,
    clock: FixedStep | AdaptiveStep | None = None,
    build: Builder | None = None,
) -> Columns:
    """Results of some cases as columns: status, reason, `end_...` states and metrics in declared units.

    case_ids : int64[n], which address the noise.  Cases with different settings may be mixed.
    width : cases at a time, 1, 4, 8 or 16; by default the fastest for the model.
    clock : an integrator of the same class, in place of the model's; the kernel is the same.  build : see `Builder`.
    """
    width, clock = width or usual_width(model), clock or model.clock
    ready = prepare(model, inputs, len(case_ids))

    def fly_group(chosen: np.ndarray) -> tuple[np.ndarray, ...]:
        n = chosen.size
        # blocks on a fixed grid are filled up; adaptive lanes take the cases in turn, and want one each to begin with
        padded = max(n, width) if isinstance(clock, AdaptiveStep) else -(-n // width) * width
        out = _outputs(model, padded)
        index: np.ndarray | slice = slice(None)  # all cases, in their order
        if n < max(padded, len(case_ids)):
            index = np.concatenate([chosen, np.full(padded - n, chosen[-1])])
        _bound_kernel(model, clock, folder, width, ready, index, case_ids, seed, out, build=build)()
        return tuple(numbers[..., :n] for numbers in out)

    groups = _groups_by_settings(ready)
    if [group.size for group in groups] == [len(case_ids)]:
        return _columns(model, ready.refusals, fly_group(groups[0]))
    out = _unflown(model, ready.refusals)
    for chosen in groups:
        for numbers, results in zip(out, fly_group(chosen), strict=True):
            numbers[..., chosen] = results
    return _columns(model, ready.refusals, out)


def _unflown(model: Model, refusals: Refusals) -> tuple[np.ndarray, ...]:
    """Time, status, states and metrics as kernels give them, of cases that are refused or have yet to fly."""
    time, _, states, metrics = (np.full_like(numbers, np.nan) for numbers in _outputs(model, len(refusals.reason)))
    return time, np.where(refusals.mask, REFUSED, OK).astype(np.float64), states, metrics


def _columns(model: Model, refusals: Refusals, out: tuple[np.ndarray, ...]) -> Columns:
    """Results as columns.  out : time, status, states and metrics as kernels give them; NaN for refused cases."""
    for numbers in out:
        numbers[np.isnan(numbers)] = np.nan  # processors and cards give it different signs
    time, status, states, metrics = out
    columns = {"status": status_words(status), "reason": refusals.reason, END_TIME: time}
    if model.phases:
        columns[END_PHASE] = last_phase = phase_words(model, metrics[-1])
        if (failed := (status != OK) & (last_phase != "")).any():
            columns["reason"] = refusals.reason.copy()
            columns["reason"][failed] = [f'in the phase "{word}"' for word in last_phase[failed]]
    metrics = metrics[: len(model.metrics)]
    metrics[:, status != OK] = np.nan
    columns |= {f"end_{field.name}": _declared(field, row) for field, row in zip(model.states, states, strict=True)}
    return columns | {field.name: _declared(field, row) for field, row in zip(model.metrics, metrics, strict=True)}


def _declared(field: Field, numbers: np.ndarray) -> np.ndarray:
    """Numbers in SI in the unit of their field."""
    return numbers if field.si_factor == 1.0 else numbers / field.si_factor


def _groups_by_settings(ready: Prepared) -> list[np.ndarray]:
    """Indices of the cases that can fly, one array per combination of settings."""
    able = np.flatnonzero(~ready.refusals.mask)
    if not able.size or (ready.settings == ready.settings[able[0]]).all():
        return [able] if able.size else []
    _, group = np.unique(ready.settings[able], axis=0, return_inverse=True)
    group = group.ravel()
    return [able[group == i] for i in range(int(group.max()) + 1)]


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
    with designing():
        tables = model.tables(chosen(*codes, np.empty(0)))
    return chosen(*codes, np.ascontiguousarray(tables, dtype=np.float64))


def _kernel_settings(model: Model, codes: np.ndarray, chosen: Any) -> np.ndarray:
    """The same as one array, as kernels take it: codes, then NaN, the last index of the tables, and the tables."""
    if model.tables is None:
        return codes
    return np.concatenate([codes, [np.nan, chosen.tables.size - 1.0], chosen.tables])


def _outputs(model: Model, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Memory for time, status, states and metrics of n cases; the last phase, if there are any, follows the metrics."""
    n_results = len(model.metrics) + bool(model.phases)
    return np.empty(n), np.empty(n), np.empty((len(model.states), n)), np.empty((n_results, n))


def _bound_kernel(
    model: Model,
    clock: FixedStep | AdaptiveStep,
    folder: Path | None,
    width: int,
    ready: Prepared,
    index: np.ndarray | slice,
    case_ids: np.ndarray,
    seed: int,
    out: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    recording: tuple[Any, np.ndarray, Any] = _NO_RECORDING,
    kernel: Callable[..., Any] | None = None,
    build: Builder | None = None,
) -> Callable[[], Any]:
    """The kernel with all its arguments.

    index : the cases that fly, of those that are ready; all of the same settings
    recording : history and its rows, see `mc_engine.lanes.history`; pace of each case or of all, in steps from row to
        row or, if the steps are adaptive, in rows of a step
    kernel : in place of the model's own
    """
    history, rows, pace = recording
    parameters, settings = ready.parameters[:, index], np.ascontiguousarray(ready.settings[index][0])
    chosen = settings_of(model, settings, ready.tables)
    if kernel is None:
        refuse_unfit(model, parameters, chosen)
        kernel = (build or build_kernel)(model, folder, width)
    cases = np.ascontiguousarray(case_ids[index], dtype=np.float64)
    numbers, data = _kernel_settings(model, settings, chosen), gathered(blocks_of(model))
    shared = np.ascontiguousarray(parameters), numbers, data, np.uint64(noise_key(seed)), cases
    if isinstance(clock, AdaptiveStep):
        paces = np.array(np.broadcast_to(pace, width), dtype=np.float64)
        return partial(kernel, *shared, *adaptive_arguments(model, clock, chosen), *out, history, rows, paces)
    return partial(kernel, *shared, *fixed_arguments(clock, chosen), *out, history, rows, int(pace[0]))


def bound_flight(
    model: Model, inputs: Inputs, case_ids: np.ndarray, seed: int, *, folder: Path | None = None, width: int
) -> tuple[Callable[[], Any], np.ndarray, np.ndarray]:
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
    kernel = _bound_kernel(model, model.clock, folder, width, ready, chosen, case_ids, seed, out)
    return kernel, out[0], ready.settings[chosen[0]]


def fly_interpreted(
    flight: Any, inputs: Inputs, case_id: int, seed: int, history: Any = _NO_HISTORY
) -> tuple[np.ndarray, ...]:
    """(time, status, states, metrics) of one case in SI, flown by Python, a thousand times as slowly as by a kernel.

    The case must be able to start.  flight : an `InterpretedFlight`, or what has a `model` and a `kernel` as it does;
    OutOfTime after the seconds that it may take.  history : as the kernel takes it, a row for every step.
    """
    model, ids, out = flight.model, np.array([case_id]), _outputs(flight.model, 1)
    ready, recording = prepare(model, inputs, 1), (history, np.zeros(1, dtype=np.int64), np.ones(1))
    _bound_kernel(model, model.clock, None, 1, ready, slice(None), ids, seed, out, recording, flight.kernel)()
    return out


def fly_history(model: Model, inputs: Inputs, case_id: int, seed: int, **options: Any) -> tuple[Columns, Columns]:
    """(columns, history) of one case, with the options of `fly_histories`."""
    return next(fly_histories(model, inputs, np.array([case_id]), seed, **options))


def fly_histories(
    model: Model,
    inputs: Inputs,
    case_ids: np.ndarray,
    seed: int,
    *,
    folder: Path | None = None,
    width: int | None = None,
    rows: int = 1500,
) -> Iterator[tuple[Columns, Columns]]:
    """(columns, history) of each case, in their order.  When one is asked for, as many as there are lanes fly together.

    Their bits do not depend on the width or on the cases that fly together.

    rows : of the history, see `mc_engine.store.histories.rows_to_keep`; fewer where a fixed grid has fewer steps
    history : t_s and the model's outputs in declared units; empty if the case was refused.  If a time has two rows,
        the first is before an event or a control sample, the second after it.
    """
    from mc_engine.store.histories import PHASE_COLUMN  # what `check` flies has no history

    width = width or usual_width(model)
    ready = prepare(model, inputs, len(case_ids))
    names = ["t_s", *(quantity.name for quantity in model.quantities), *([PHASE_COLUMN] if model.phases else [])]
    groups = [np.split(group, range(width, group.size, width)) for group in _groups_by_settings(ready)]
    batch_of = {int(place): batch for batches in groups for batch in batches for place in batch}
    recorder = _Recorder(model, ready, case_ids, seed, folder, width, rows)
    flown: dict[int, tuple[Columns, np.ndarray]] = {}
    for place in range(len(case_ids)):
        if place not in batch_of:
            refusals = Refusals(ready.refusals.reason[[place]])
            yield _columns(model, refusals, _unflown(model, refusals)), {name: np.empty(0) for name in names}
            continue
        if place not in flown:
            flown.update(zip(batch_of[place].tolist(), recorder.flown(batch_of[place]), strict=True))
        columns, table = flown.pop(place)
        history = dict(zip(names, table, strict=True))
        if model.phases:
            history[PHASE_COLUMN] = phase_words(model, table[-1])
        yield columns, history


class _Recorder:
    """Flies cases with the same settings together, each in its own lane, and keeps some rows of each.

    All steps of a flight are recorded if memory allows.  If adaptive steps are so long that there are fewer rows than
    wanted, they are divided into parts, which are recorded too.  The same memory serves one batch after another; a
    batch with more rows than fit is flown in pieces.
    """

    def __init__(
        self,
        model: Model,
        ready: Prepared,
        case_ids: np.ndarray,
        seed: int,
        folder: Path | None,
        width: int,
        rows: int,
    ):
        self._model, self._ready, self._case_ids, self._seed, self._folder = model, ready, case_ids, seed, folder
        self._width, self._rows, self._most = width, rows, max(_MOST_RECORDED, _OVERSAMPLED * rows)
        self._factors = np.array([quantity.si_factor for quantity in model.quantities])
        self._n_fields = 1 + self._factors.size + bool(model.phases)
        self._history = np.empty((0, 0))

    def flown(self, chosen: np.ndarray) -> Iterator[tuple[Columns, np.ndarray]]:
        """(columns, history) of each case.  history : float64[1 + n_quantities, n_kept], in declared units.

        chosen : indices of cases that can start, of one settings, as many as there are lanes or fewer.
        """
        out, counts = self._recorded(chosen)
        together = self._together(counts)
        if chosen.size > together:
            for first in range(0, chosen.size, together):
                yield from self.flown(chosen[first : first + together])
            return
        refusals = Refusals(self._ready.refusals.reason[chosen])
        columns = _columns(self._model, refusals, tuple(numbers[..., : chosen.size] for numbers in out))
        for lane, n_rows in enumerate(counts):
            yield {name: values[lane : lane + 1] for name, values in columns.items()}, self._kept(lane, n_rows)

    def _kept(self, lane: int, n_rows: int) -> np.ndarray:
        from mc_engine.store.histories import rows_to_keep

        lines = slice(lane * self._n_fields, (lane + 1) * self._n_fields)
        kept = self._history[lines].take(rows_to_keep(self._history, self._rows, lines, n_rows), axis=1)
        kept[1 : 1 + self._factors.size] /= self._factors[:, np.newaxis]
        return kept

    def _recorded(self, chosen: np.ndarray) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
        """((time, status, states, metrics) in SI, number of rows of each case), the rows recorded where they fit."""
        clock, pace, room = self._model.clock, np.ones(self._width), _USUAL_ROOM
        if isinstance(clock, FixedStep):
            n_steps = grid_of(clock, settings_of(self._model, self._ready.settings[chosen[0]]))[0]
            pace *= -(-2 * n_steps // self._most)  # in steps
            room = min(2 * n_steps + 1, self._most)
        out, counts = self._fly_once(chosen, pace, room)
        if isinstance(clock, AdaptiveStep):
            finer = np.maximum(1.0, -(-_OVERSAMPLED * self._rows // counts))
            wanted = np.where(counts > self._most, self._most / counts, finer)
            if (wanted != 1.0).any():
                pace[: chosen.size] = wanted
                if chosen.size > self._together(counts * wanted):
                    return out, counts * wanted
                out, counts = self._fly_once(chosen, pace, (counts * wanted).max())
        if counts.max() > self._history.shape[1] and chosen.size <= self._together(counts):
            out, counts = self._fly_once(chosen, pace, counts.max())
        return out, counts

    def _together(self, counts: np.ndarray) -> int:
        """Number of cases, at least one, for which there is memory, with these numbers of rows."""
        return max(1, int(_MOST_NUMBERS // (self._n_fields * counts.max())))

    def _fly_once(self, chosen: np.ndarray, pace: np.ndarray, room: float) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
        """(results, number of rows of each case).  room : wanted for rows of each; one case gets it in any case."""
        n_lines = chosen.size * self._n_fields
        if chosen.size > 1:
            room = min(room, _MOST_NUMBERS // n_lines)
        if n_lines > self._history.shape[0] or room > self._history.shape[1]:
            self._history = np.empty((n_lines, int(room)))
        model, width, out = self._model, self._width, _outputs(self._model, self._width)
        rows = np.zeros(chosen.size, dtype=np.int64)  # lanes beyond these record nothing
        cases = self._ready, np.resize(chosen, width), self._case_ids, self._seed
        _bound_kernel(model, model.clock, self._folder, width, *cases, out, (self._history, rows, pace))()
        return out, rows


# ---- chosen inputs, all others at the model's own values: for studies that no campaign file describes


def chosen_cases(model: Model, inputs: Inputs, *, seed: int = 0) -> Columns:
    """Columns of as many cases as the longest input has values, in declared units.

    ValueError names the inputs that the model does not have.
    """
    n_cases = max((np.size(value) for value in inputs.values()), default=1)
    return fly(model, _complete(model, inputs), np.arange(n_cases), seed)


def chosen_case(model: Model, inputs: Inputs, *, seed: int = 0) -> dict[str, Any]:
    """The row of one case: a number or a word by column name."""
    return {name: column[0] for name, column in chosen_cases(model, inputs, seed=seed).items()}


def chosen_history(model: Model, inputs: Inputs, *, rows: int = 2001, seed: int = 0) -> Columns:
    """`t_s` and the model's outputs along the flight of one case; rows as in `fly_history`."""
    return fly_history(model, _complete(model, inputs), 0, seed, rows=rows)[1]


def _complete(model: Model, inputs: Inputs) -> dict[str, Any]:
    nominal = {name: item.default for name, item in inputs_of(model).items()}
    if unknown := sorted(inputs.keys() - nominal.keys()):
        raise ValueError(f"{', '.join(unknown)}: no input of the model")
    return {**nominal, **inputs}
