"""The record of a model that the engine reads: its inputs and results, its physics, its events and its integrator.

`mc_engine.model.model` makes it from the declarations of a model file.  It names every input (parameters, settings) and
result (states, outputs along the flight, metrics), with unit and one-line meaning, and refers to the physics: plain
functions on named tuples of numbers, marked with `mc_engine.lanes.physics`.

Inside physics everything is in SI and radians, and names have no unit suffix: `inclination_deg` is `inclination`, in
radians.  Outside, every column has the unit that its field declares.
"""

import ast
import re
import sys
from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.lanes.composed import blocks_in
from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model.faults import place_in_model, wrong_import, wrong_record
from mc_engine.model.fields import (
    AdaptiveStep,
    Event,
    Extremum,
    Field,
    FixedStep,
    Parameter,
    Setting,
    inputs_of,
)
from mc_engine.model.figures import Figure
from mc_engine.model.files import FileFault, resolve_beside
from mc_engine.model.imports import find_unimported
from mc_engine.model.rules import refuse_contradictions
from mc_engine.model.sources import Sources, sources_of_file, sources_of_module
from mc_engine.model.syntax_tree import parse

_Kind = TypeVar("_Kind", bound=Any)
NoMemory = namedtuple("NoMemory", "unused")  # of a model without `start`


@dataclass(frozen=True)
class Model:
    """A system that can be flown: its inputs and outputs with their units, its physics, its events and its integrator.

    `model(...)` makes it, see there.  The engine calls its functions with the arguments that are given here, in this
    order: the time t [s], the state s, the discrete state m, the kernel parameters p and the settings o, each a named
    tuple of numbers in SI and radians.

    name, title, source, clock, figures, data, published : as passed to `model`
    parameters : tuple of Parameter, inputs that may differ from case to case
    settings : tuple of Setting, inputs that all cases of a batch share
    states : tuple of Field, in the order of the state's named tuple
    quantities : tuple of Field, the outputs, which histories hold besides the time
    metrics : tuple of Field, the results of a case
    kernel_parameters : class of p
    initial(p, o) : the first state
    rhs(t, s, m, p, o) : the derivative of the state
    observe(t, s, m, p, o) : named tuple of the outputs
    evaluate(t, s, m, p, o, best, when) : named tuple of the metrics; best and when hold value and time of each Extremum
    prepare(inputs, settings, refusals) : dict of kernel parameters, see `model`
    start(p, o) : the first discrete state
    control(t, s, m, p, o, draws) : the next discrete state, at each sample, the first at t = 0
    samples(t, s, m, p, o) : 1.0 in a phase with a control, 0.0 in one without; None if all have one, or none has
    events(t, s, m, p, o) : named tuple with one component for each Event
    switch(t, s, m, p, o, hit) : (state, discrete state) after an event with the action "switch"; the field of hit is
        1.0 for an event that happened
    note(t, s, m, p, o, hit) : the discrete state after an event, also one that ends the case; made by the engine
    event_list : tuple of Event, in the order of the components of `events`
    phases : tuple of str, the names of the phases, by the number that the discrete state holds
    extrema : tuple of Extremum
    event_times : tuple of str, the metrics declared as the time of an event, of an extreme or of the end
    metric_outputs : tuple of (metric, output), the metrics declared as the largest, smallest or last value of an output
    tables(o) : float64[n], see `model`
    watching : bool, set by the engine while it watches events
    reference : str, set by `load_model`
    sources : Sources, set by `load_model`

    Raises ModelError for a record that contradicts itself.

    >>> model = load_campaign("minimal").model
    >>> [metric.name for metric in model.metrics]
    ['apogee_altitude_km', 'apogee_time_s', 'top_speed_m_s']
    >>> model.input("altitude_km").default
    300.0
    """

    name: str
    title: str
    source: str
    parameters: tuple[Parameter, ...]
    settings: tuple[Setting, ...]
    states: tuple[Field, ...]
    quantities: tuple[Field, ...]
    metrics: tuple[Field, ...]
    clock: FixedStep | AdaptiveStep
    kernel_parameters: type
    initial: Callable[..., Any]
    rhs: Callable[..., Any]
    observe: Callable[..., Any]
    evaluate: Callable[..., Any]
    prepare: Callable[..., Any] | None = None
    start: Callable[..., Any] | None = None
    control: Callable[..., Any] | None = None
    samples: Callable[..., Any] | None = None
    events: Callable[..., Any] | None = None
    switch: Callable[..., Any] | None = None
    note: Callable[..., Any] | None = None
    event_list: tuple[Event, ...] = ()
    phases: tuple[str, ...] = ()
    extrema: tuple[Extremum, ...] = ()
    event_times: tuple[str, ...] = ()
    metric_outputs: tuple[tuple[str, str], ...] = ()
    tables: Callable[..., np.ndarray] | None = None
    figures: tuple[Figure, ...] = ()
    data: tuple[str, ...] = ()
    watching: bool = False  # see mc_engine.flight.kernel_parts.watching_events
    published: tuple[Mapping[str, Any], ...] = field(default=(), compare=False)
    reference: str = field(default="", compare=False)
    sources: Sources | None = field(default=None, compare=False, repr=False)  # of one that `load_model` gave

    def __post_init__(self) -> None:
        refuse_contradictions(self)

    def __hash__(self) -> int:
        """A hash of the fields that tell most models apart; a hash of all fields takes as long as flying a case."""
        return hash((self.name, self.title, self.watching))

    def input(self, name: str) -> Parameter | Setting:
        """The parameter or setting called `name`; KeyError if the model has none."""
        return inputs_of(self)[name]


_CAN_START = np.array("", dtype=object)


@dataclass
class Refusals:
    """The cases that a model cannot fly, each with the reason in one sentence: the third argument of `prepare`.

    reason : object[n_cases] of str, read-only; empty for a case that can be flown

    >>> refusals = Refusals.none(3)
    >>> refusals.add(np.array([False, True, False]), "the perigee is below the surface")
    >>> refusals.mask.tolist()
    [False, True, False]
    """

    reason: np.ndarray

    @classmethod
    def none(cls, n_cases: int) -> "Refusals":
        """The record for n_cases of which none is refused."""
        return cls(np.broadcast_to(_CAN_START, n_cases))

    def add(self, mask: np.ndarray, sentence: str) -> None:
        """Refuse the cases in `mask` (bool[n_cases]) unless they were refused before."""
        refused = mask & np.ones(self.reason.shape, dtype=bool)  # also refuses a mask that is none
        if refused.any():
            self.reason = np.where(refused & ~self.mask, sentence, self.reason)

    @property
    def mask(self) -> np.ndarray:
        """bool[n_cases], true where the case is refused."""
        # as a rule one word seen n times: to compare the words of all cases would hold back all other threads
        if self.reason.strides == (0,):
            return np.repeat(self.reason[:1] != "", self.reason.size)
        return self.reason != ""


def load_model(reference: str, beside: Path | None = None) -> Model:
    """The `MODEL` of a module or of a file, as a campaign file names it.  Loading it runs the model's code.

    reference : str, a module ("campaigns.deorbit") or a file next to the campaign file ("model.py")
    beside : Path, the folder of the campaign file; the working folder by default

    Returns the Model.

    Raises ModelError with one sentence where the module, the file or its MODEL is missing or broken.

    >>> load_model("model.py").title
    'Apogee raised by one burn'
    """
    return load_record(reference, beside, "MODEL", Model)


def load_record(reference: str, beside: Path | None, name: str, kind: type[_Kind]) -> _Kind:
    """The `name`, MODEL or SIMULATOR, of a module or file; ModelError where it is missing or broken."""
    sources = _from_file(reference, beside) if reference.endswith(".py") else _from_module(reference, name)
    record: Any = getattr(sources.module, name, None)
    if not isinstance(record, kind):
        raise ModelError(_without(reference, name))
    try:
        curves = blocks_in(value for value in vars(record).values() if isinstance(value, PhysicsFunction))
        sources = sources.with_data(record.data, [block.file for block in curves if block.file])
    except ModelError as error:
        raise ModelError(f'"{reference}": {error}') from None
    object.__setattr__(record, "reference", reference)
    object.__setattr__(record, "sources", sources)
    return record


def _without(reference: str, name: str) -> str:
    return f'"{reference}" has no {name}; end it with {name} = {"model" if name == "MODEL" else "Simulator"}(...)'


def compiled_model(system: Any) -> Model:
    """What a campaign flies, which is a compiled model; ModelError for a simulator, which has no kernel."""
    if isinstance(system, Model):
        return system
    raise ModelError(f'"{system.reference}" is a simulator; this is for compiled models')


def sources_of(model: Model, folder: Path | None = None) -> Sources:
    """What a model was made of.  folder : of a `.py` model that was not loaded by `load_model`."""
    return model.sources or sources_of(load_model(model.reference, folder))


def _from_file(reference: str, beside: Path | None) -> Sources:
    try:
        path = resolve_beside(beside or Path.cwd(), reference)
    except FileFault as fault:
        raise ModelError(str(fault)) from None
    try:
        return sources_of_file(path)
    except (Exception, SystemExit) as error:
        raise ModelError(_fault(path.name, error)) from error


def _from_module(reference: str, name: str) -> Sources:
    """An installed module, if it is there and its source defines `name`: a campaign file names no other code."""
    if not re.fullmatch(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*", reference):
        raise ModelError(f'"{reference}" is neither a module such as "campaigns.deorbit" nor a .py file')
    if reference.split(".")[0] in sys.stdlib_module_names:
        raise ModelError(f'"{reference}" is a module of Python itself; a file beside the campaign ends in .py')
    spec = find_unimported(reference)
    if spec is None:
        raise ModelError(f'there is no module "{reference}"; a file beside the campaign ends in .py')
    if not _defines(spec, name):
        raise ModelError(_without(reference, name))
    try:
        return sources_of_module(reference, Path(spec.origin or "").parent)
    except ModuleNotFoundError as error:
        raise ModelError(f'"{reference}" needs the package "{error.name}", which is not installed') from None
    except (Exception, SystemExit) as error:
        raise ModelError(_fault(reference, error)) from error


def _defines(spec: ModuleSpec, name: str) -> bool:
    """Whether the source of a module gives `name` a value; true where it cannot be read, for the import to
    say why."""
    if not spec.has_location or spec.origin is None or not spec.origin.endswith(".py"):
        return False
    try:
        tree = parse(Path(spec.origin).read_bytes())
    except (OSError, SyntaxError, ValueError):
        return True
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    names |= {node.asname or node.name for node in ast.walk(tree) if isinstance(node, ast.alias)}
    return name in names


def _fault(reference: str, error: BaseException) -> str:
    """The error of a model's own code in a sentence with its place."""
    place = place_in_model(error) or f'"{reference}"'
    if isinstance(error, SyntaxError):
        place = f"{Path(error.filename or reference).name}, line {error.lineno or 1}"
    if isinstance(error, SystemExit):
        return f"{place}: ends the program; it may only define MODEL or SIMULATOR"
    if isinstance(error, ModelError):
        return f"{place}: {error}"
    if isinstance(error, FileNotFoundError):
        name = Path(error.filename or str(error).removesuffix(" not found.")).name
        return f'{place}: there is no file "{name}"; a model\'s data lie next to it, named in data=("{name}",)'
    if words := wrong_record(error) or wrong_import(error):
        return f"{place}: {words}"
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    if isinstance(error, SyntaxError | UnicodeError) and re.search("encoding|'utf-8' codec", text):
        text += "; save the file as UTF-8"
    return f"{place}: {type(error).__name__}: {text}"
