"""Check that inputs and results repeat in every process and batch; and the nominal inputs as physics receives them.

`check` computes the same digests in two processes, at two times, with different hash seeds and time zones.  Values that
differ depend on the clock, on randomness or on the environment.
"""

import inspect
import os
import sys
from collections.abc import Iterator, Mapping
from hashlib import blake2b
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from mc_engine.campaign.loading import Campaign
from mc_engine.errors import EngineError
from mc_engine.flight.flight import fly, settings_of
from mc_engine.flight.flyer import Columns
from mc_engine.flight.kernel import grid_of
from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model.faults import fault_of
from mc_engine.model.fields import AdaptiveStep, FixedStep
from mc_engine.model.imports import PACKAGES, USER
from mc_engine.model.preparation import prepare
from mc_engine.model.record import compiled_model
from mc_engine.model.trial import FEW, Breach

_WHY = "a case must depend on its inputs and case_id alone: no clock, random numbers, hashes or environment"
_CUT = 5  # cases of the smaller part when they are flown in two
_read: dict[str, str] = {}  # by environment variable: where the model reads it


def model_digests(campaign: Campaign) -> dict[str, str]:
    """Digests of what the kernel of a campaign is made of, and of what its nominal case begins with, by name."""
    model = compiled_model(campaign.model)
    p, o = nominal_inputs(campaign)
    values = {f'"{name}" of the nominal case, from `prepare`,': value for name, value in zip(p._fields, p, strict=True)}
    values |= {f"the setting `{name}`": value for name, value in zip(o._fields, o, strict=True)}
    values |= {f"`{name}` of the clock": value for name, value in vars(model.clock).items()}
    values |= {f"`{name}`": value for name, value in vars(model).items() if isinstance(value, PhysicsFunction)}
    seen: set[Any] = set()
    return {key: digest for name, value in values.items() for key, digest in _digests_of(name, value, seen)}


def _digests_of(name: str, value: Any, seen: set[Any]) -> Iterator[tuple[str, str]]:
    """Of all numbers and texts in a value; in a function, of those that it names outside of it."""
    inside: dict[str, Any] = {}
    if isinstance(value, tuple | list):
        inside = {f"{name}[{i}]": item for i, item in enumerate(value)}
    elif isinstance(value, np.ndarray | np.generic | int | float | str):
        content = value.tobytes() if hasattr(value, "tobytes") else repr(value).encode()
        yield name, blake2b(content, digest_size=8).hexdigest()
    elif isinstance(value, PhysicsFunction | type) and value not in seen:
        seen.add(value)
        inside = _named_outside(name, value)
    for key, item in inside.items():
        yield from _digests_of(key, item, seen)


def _named_outside(name: str, value: PhysicsFunction | type) -> dict[str, Any]:
    if isinstance(value, type):
        return {f"{name}.{key}": item for key, item in vars(value).items() if not key.startswith("_")}
    function = inspect.unwrap(value.function)
    outside = inspect.getclosurevars(function)
    file = Path(function.__code__.co_filename).name
    return {f"`{key}` in {file}": item for key, item in {**outside.globals, **outside.nonlocals}.items()}


def influences(here: dict[str, str], there: dict[str, str]) -> list[str]:
    """Sentences on numbers that differ between two processes, and on what the model reads of the environment."""
    different = [name for name in here if there.get(name, "") != here[name]]
    reads = [f'{place} reads the environment variable "{key}"; make it a setting' for key, place in _read.items()]
    # what one cause changes is one mistake
    return [*reads, *(f"{name} differs between two processes; {_WHY}" for name in different[:1])]


def note_environment() -> None:
    """From now on, note what models read of the environment of this process."""
    os.environ.__class__ = _Noting


class _Noting(type(os.environ)):  # type: ignore[misc]
    def __getitem__(self, key: str) -> str:
        reader: FrameType | None = sys._getframe(1)
        while reader is not None and reader.f_globals.get("__name__") in ("os", "collections.abc"):
            reader = None if reader.f_code.co_name == "setdefault" else reader.f_back
        if reader is not None and _is_model(str(reader.f_globals.get("__name__", ""))):
            _read.setdefault(key, f"{Path(reader.f_code.co_filename).name}, line {reader.f_lineno}")
        return str(super().__getitem__(key))


def _is_model(module: str) -> bool:
    return module.startswith(USER) or module.partition(".")[0] in PACKAGES.contents


def nominal_inputs(campaign: Campaign) -> tuple[Any, Any]:
    """(p, o) of a few nominal cases as physics sees them: arrays, and the numbers that all share."""
    model = compiled_model(campaign.model)
    try:
        doing = "prepare"
        ready = prepare(model, campaign.nominal, FEW)
        doing = "tables"
        settings = settings_of(model, ready.settings[0], ready.tables)
    except EngineError:
        raise
    except SystemExit:
        raise Breach(f"`{doing}` ends the process; a model only computes") from None
    except Exception as error:
        raise Breach(f"`{doing}`: {fault_of(error, 'the model')}") from None
    if ready.refusals.mask[0]:
        raise Breach(f"the nominal case is refused: {ready.refusals.reason[0]}")
    for name, row in zip(model.kernel_parameters._fields, ready.parameters, strict=True):  # type: ignore[attr-defined]
        if not np.isfinite(row).all():
            raise Breach(f'`prepare` gives {row[0]:g} for "{name}" of the nominal case; it must be a number')
    if isinstance(model.clock, FixedStep):
        grid_of(model.clock, settings)
    return model.kernel_parameters(*ready.parameters), settings


def results(
    campaign: Campaign, inputs: Mapping[str, Any], ids: np.ndarray, clock: FixedStep | AdaptiveStep | None = None
) -> Columns:
    """Results of some cases of a campaign.  clock : see `mc_engine.flight.flight.fly`."""
    return fly(compiled_model(campaign.model), inputs, ids, campaign.seed, folder=campaign.directory, clock=clock)


def not_repeating(campaign: Campaign, inputs: Mapping[str, Any], ids: np.ndarray, flown: Columns) -> Iterator[str]:
    """One sentence if the same cases come out differently a second time, or among other cases."""
    why = "a case must depend on its inputs and case_id alone: no global state, clock or numpy.random"
    again = first_difference(flown, results(campaign, inputs, ids))
    if again is not None:
        yield f'case {ids[again[0]]} has another "{again[1]}" when the same cases fly a second time; {why}'
        return
    parts = [np.arange(ids.size)[_CUT:][::-1], np.arange(ids.size)[:_CUT]]
    for part in parts:
        if part.size:
            own = {name: value[part] if np.ndim(value) else value for name, value in inputs.items()}
            among_all = {name: values[part] for name, values in flown.items()}
            alone = first_difference(among_all, results(campaign, own, ids[part]))
            if alone is not None:
                yield (
                    f'case {ids[part[alone[0]]]} has another "{alone[1]}" when it flies among other cases; {why}, '
                    "and `prepare` must treat each case by itself"
                )
                return


def first_difference(a: Columns, b: Columns) -> tuple[int, str] | None:
    """Place and column of the first number with other bits, None if there is none."""
    for name, values in a.items():
        same = values == b[name]
        if values.dtype != object:
            same |= np.isnan(values) & np.isnan(b[name])
        if not same.all():
            return int(np.flatnonzero(~same)[0]), name
    return None
