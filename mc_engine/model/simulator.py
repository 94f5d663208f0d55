"""Simulators: systems that are flown by a Python function, a program or an FMU, instead of a compiled model.

A simulator declares its inputs and results as models do, and has the same attributes for them.
`mc_engine.flight.simulated` flies it, each worker in a process of its own.
"""

import math
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.model.fields import Field, Parameter, Setting, inputs_of, refuse_other_type
from mc_engine.model.figures import Figure
from mc_engine.model.record import Model, load_record
from mc_engine.model.rules import refuse_false_simulator
from mc_engine.model.sources import Sources

if TYPE_CHECKING:
    from mc_engine.model.fmu import Fmu
    from mc_engine.model.program import Program

KEPT = ("none", "failed", "all")  # of the folders of cases
_TRUTH = bool | np.bool_
_NO_NUMBERS = (str, bytes, bool, np.bool_, complex, np.complexfloating, np.datetime64, np.timedelta64)
_KINDS: dict[str, tuple[Any, str]] = {
    **dict.fromkeys(("title", "name", "source"), (str, "text")),
    **dict.fromkeys(("batch", "deterministic"), (_TRUTH, "True or False")),
    **dict.fromkeys(("time_limit_s", "memory_limit_mib"), (Real | None, "a number")),
    "slots": (Integral | None, "a whole number"),
    "tolerance": (Real, "a number"),
    **dict.fromkeys(("fly", "start"), (Callable | None, "a function")),
}
_TUPLES: dict[str, Any] = {
    "settings": tuple[Setting, ...],
    "figures": tuple[Figure, ...],
    "data": tuple[str, ...],
    "published": tuple[Mapping[str, Any], ...],
}
LONGEST_S, LARGEST_MIB = 1e8, 2**30
_LARGEST_FLOAT = int(sys.float_info.max)


class Refuse(Exception):
    """Raised by the function of a simulator for inputs that cannot be flown; the case ends as `refused`, with the text.

    >>> try:
    ...     raise Refuse("the mass is above the payload of the launcher")
    ... except Refuse as why:
    ...     print(why)
    the mass is above the payload of the launcher
    """


@dataclass(frozen=True)
class Simulator:
    """A system flown by its own code: a Python function, or a program or FMU that a campaign file describes.

    A file or module ends with `SIMULATOR = Simulator(...)`, and the campaign file names it as `simulator`.

    title : str, one line for reports
    parameters : made by `inputs`: each Parameter may differ from case to case; each Setting is shared by all cases and
        moves to the attribute `settings`
    metrics : made by `metrics`, the results of a case; `fly` must return all of them
    fly(inputs, case) : a mapping of the metrics, or (metrics, history).  `inputs` has the value of every parameter and
        setting by name, in declared units.  `case` has `id`; `seed`, a whole number of 64 bits; `rng`, a NumPy
        generator of this case; `folder`, its own and empty; `shared`, what `start` returned.  history is a DataFrame
        with t_s and the outputs.  `raise Refuse("why")` refuses the inputs.  With `batch`, inputs and metrics are
        arrays [n], `id` and `seed` too, `rng` a list of generators, and NaN in a metric fails its case alone.
        Without `fly`, the record declares what `mc-engine import` reads.
    outputs : made by `outputs`, the columns of time histories besides the time t_s
    settings : tuple of Setting, those among `parameters`
    start() : called once in each worker, before its first case; to load a library or to check out a licence
    batch : bool, `fly` takes arrays of many cases
    name : str, by default that of the file
    source : str, the publication or the version that the results are from
    time_limit_s : float, a case that takes longer ends as time-limit; no limit by default
    memory_limit_mib : float, memory that the process of a worker may use; a case beyond it ends as memory-limit
    slots : int, most cases that fly at the same time, such as the number of licences; by default one per worker
    keep : str, the cases whose folders are kept in the run directory: "none", "failed", "all"
    deterministic : bool, True: `replay` compares bits; False: numbers may differ by the fraction `tolerance`
    tolerance : float, largest relative difference
    figures : tuple of figure records, as of a `model`
    data : tuple of str, files that the simulator reads from its own folder, as of a `model`
    published : tuple of dict, published values to compare with
    program, fmu : set by the engine for the table [simulator] of a campaign file; one of them at most
    reference : str, set by `load_simulator`
    sources : Sources, set by `load_simulator`

    Raises ModelError where the record contradicts itself.

    >>> fall = Simulator(
    ...     title="A stone",
    ...     parameters=inputs(height_m=Parameter(10.0, "height of the fall", low=0.0)),
    ...     metrics=metrics(fall_time_s="time to the ground"),
    ...     fly=lambda inputs, case: {"fall_time_s": (2.0 * inputs["height_m"] / 9.81) ** 0.5},
    ... )
    >>> fall.input("height_m").default
    10.0
    """

    title: str
    parameters: tuple[Parameter, ...]
    metrics: tuple[Field, ...]
    fly: Callable[..., Any] | None = None
    outputs: tuple[Field, ...] = ()
    settings: tuple[Setting, ...] = field(default=(), kw_only=True)
    start: Callable[[], Any] | None = field(default=None, kw_only=True)
    batch: bool = field(default=False, kw_only=True)
    name: str = field(default="", kw_only=True)
    source: str = field(default="", kw_only=True)
    time_limit_s: float | None = field(default=None, kw_only=True)
    memory_limit_mib: float | None = field(default=None, kw_only=True)
    slots: int | None = field(default=None, kw_only=True)
    keep: str = field(default="failed", kw_only=True)
    deterministic: bool = field(default=True, kw_only=True)
    tolerance: float = field(default=0.0, kw_only=True)
    figures: tuple[Figure, ...] = field(default=(), kw_only=True)
    data: tuple[str, ...] = field(default=(), kw_only=True)
    published: tuple[Mapping[str, Any], ...] = field(default=(), compare=False, kw_only=True)
    program: "Program | None" = field(default=None, kw_only=True)  # of a campaign file's [simulator]
    fmu: "Fmu | None" = field(default=None, kw_only=True)
    reference: str = field(default="", compare=False, kw_only=True)
    sources: Sources | None = field(default=None, compare=False, repr=False, kw_only=True)

    def __post_init__(self) -> None:
        for name, what in (("parameters", "inputs"), ("metrics", "metrics"), ("outputs", "outputs")):
            object.__setattr__(self, name, _declared(name, what, getattr(self, name)))
        for name, kind in _TUPLES.items():
            if isinstance(getattr(self, name), list):
                object.__setattr__(self, name, tuple(getattr(self, name)))
            refuse_other_type(self, name, kind, "the simulator")
        shared = tuple(item for item in self.parameters if isinstance(item, Setting))
        object.__setattr__(self, "parameters", tuple(item for item in self.parameters if item not in shared))
        object.__setattr__(self, "settings", (*self.settings, *shared))
        for name, (kind, words) in _KINDS.items():
            value = getattr(self, name)
            if not isinstance(value, kind) or (isinstance(value, bool) and kind is not _TRUTH):
                raise ModelError(f"the simulator has {value!r} as its `{name}`; it must be {words}")
        refuse_false_simulator(self)
        if self.keep not in KEPT:
            raise ModelError(f'the simulator has "{self.keep}" as its `keep`; it must be one of {", ".join(KEPT)}')
        for name, most in (("time_limit_s", LONGEST_S), ("memory_limit_mib", LARGEST_MIB), ("slots", 100_000)):
            value = getattr(self, name)
            if value is not None and not 0 < value <= most:
                raise ModelError(f"the simulator has {value!r} as its `{name}`; it must be above 0, at most {most:g}")
        if not 0.0 <= self.tolerance < 1.0:
            raise ModelError(f"the simulator has {self.tolerance!r} as its `tolerance`; it must be from 0 to below 1")
        if self.deterministic and self.tolerance:
            raise ModelError(
                "the simulator has a `tolerance`, and `replay` compares bits; set `deterministic` to false"
            )

    @property
    def quantities(self) -> tuple[Field, ...]:
        """The outputs, under the name that they have in a Model."""
        return self.outputs

    @property
    def is_described(self) -> bool:
        """Whether the table [simulator] of a campaign file describes what flies."""
        return self.program is not None or self.fmu is not None

    @property
    def may_draw(self) -> bool:
        """Whether it receives a seed or a generator; an FMU does not."""
        return self.fmu is None

    @property
    def states(self) -> tuple[Field, ...]:
        """Empty: the engine does not know the state of a simulator."""
        return ()

    def digest(self) -> str:
        """SHA-256 of the sources, in a fixed order; of a program, of all that it is made of."""
        assert self.sources is not None  # a loaded simulator has them
        digest = sha256((self.sources.module.__doc__ or "").encode() if self.is_described else b"")
        for name, content in self.sources.named():
            digest.update(f"{name}\n{len(content)}\n".encode() + content)
        return digest.hexdigest()

    def lost_metric(self, values: Mapping[str, float]) -> str:
        """The first metric that is infinite or not a number, as a sentence; empty if there is none."""
        for metric in self.metrics:
            value = values[metric.name]
            if math.isinf(value) or (math.isnan(value) and not metric.sometimes):
                return f'"{metric.name}" is {"not a number" if math.isnan(value) else "infinite"}'
        return ""

    def input(self, name: str) -> Parameter | Setting:
        """The parameter or setting called `name`; KeyError if the simulator has none."""
        return inputs_of(self)[name]


def _declared(name: str, what: str, made: Any) -> Any:
    """The numbers that `inputs`, `metrics` or `outputs` declared; ModelError for anything else."""
    for metric in getattr(made, "computed", ()):
        raise ModelError(f'the metric "{metric}" is computed along the flight of a model; a simulator gives all of its '
                         f'metrics itself, {metric}="meaning"')  # fmt: skip
    named = isinstance(made, tuple) and all(getattr(item, "name", "") for item in made)
    if not named and not hasattr(made, "declared"):
        raise ModelError(f"`{name}` is {made!r}; declare it, {name}={what}(...)")
    return getattr(made, "declared", made)


System = Model | Simulator


def load_simulator(reference: str, beside: Path | None = None) -> Simulator:
    """Load the `SIMULATOR` of a module or a file.  This runs its code.

    reference : str, a module ("plant.simulator") or a file next to the campaign file ("sim.py")
    beside : Path, the folder of the campaign file; the working folder by default

    Raises ModelError with one sentence where the module, the file or its SIMULATOR is missing or broken.
    """
    simulator = load_record(reference, beside, "SIMULATOR", Simulator)
    if simulator.is_described:
        raise ModelError(
            f"{reference}: a program or an FMU flies by the table [simulator] of the campaign file; name it there"
        )
    object.__setattr__(simulator, "name", simulator.name or Path(reference).stem.rpartition(".")[2])
    return simulator


def numeric(given: Any) -> Any:
    """What was given, NaN where masked, infinite where no float64 holds it.

    TypeError for text, truth values, dates and complex, which NumPy would take.
    """
    kind = getattr(getattr(given, "dtype", None), "kind", "")
    items = np.ravel(given) if kind == "O" else given if isinstance(given, list | tuple) else [given]
    if kind in tuple("bSUmMc") or (kind in ("", "O") and any(isinstance(item, _NO_NUMBERS) for item in items)):
        raise TypeError
    if kind in ("", "O") and any(map(_is_beyond, items)):
        return np.reshape([math.inf if _is_beyond(item) else item for item in items], np.shape(given))
    return np.ma.filled(given.astype(np.float64), np.nan) if isinstance(given, np.ma.MaskedArray) else given


def _is_beyond(item: Any) -> bool:
    """Whether it is a whole number of Python, which has no largest, that no float64 holds."""
    return isinstance(item, int) and abs(item) > _LARGEST_FLOAT


def in_time(history: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The history as it is; ValueError with a sentence unless its times are numbers that never fall."""
    times = history["t_s"]
    if shaped := [name for name, column in history.items() if column.ndim != 1]:
        shape = history[shaped[0]].shape
        raise ValueError(
            f'the column "{shaped[0]}" of the history has the shape {shape}; it must have one number a row'
        )
    if not np.isfinite(times).all():
        raise ValueError("a time of the history is not a number")
    if (falls := np.flatnonzero(np.diff(times) < 0.0)).size:
        before, after = times[falls[0]], times[falls[0] + 1]
        raise ValueError(f"the times of the history fall from {before:.10g} s to {after:.10g} s")
    return history
