"""The records that a model is made of: its named numbers, events, extrema and clocks."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from mc_engine.dates import modified_julian_date
from mc_engine.errors import ModelError
from mc_engine.units import UNITS, unit_suffix

OF_NAME = "that of the name"  # in place of a unit, until the declaration has given the name
EXTREMA = ("max", "min", "last_above")  # flown by flight.kernel_parts; worded by declarations.Metric.meaning
DIRECTIONS = {"rising": 1.0, "falling": -1.0, "either": 0.0}  # of events, and their signs


class Named:
    """A number with a name: the common part of `Field`, `Parameter` and `Setting`.

    name : str, the column, which ends in its unit: "altitude_km".  The declaration sets it.
    unit : str, one of `mc_engine.units.UNITS`; empty for a plain number.  By default the ending of the name.
    description : str, one line
    sometimes : bool, a metric has a number, or differs between cases, only with some settings; `mc-engine check` then
        does not report that it has none or is constant

    >>> altitude = Field("altitude of the orbit", name="altitude_km", unit="km")
    >>> altitude.symbol, altitude.si_factor
    ('altitude', 1000.0)
    """

    name: str
    unit: str
    description: str
    sometimes: bool

    @property
    def symbol(self) -> str:
        """Name inside SI code: the column name without its unit suffix."""
        suffix = unit_suffix(self.unit)
        return self.name.removesuffix(suffix) if suffix else self.name

    @property
    def si_factor(self) -> float:
        """Factor from the declared unit to SI."""
        return UNITS[self.unit].factor


@dataclass(frozen=True)
class Field(Named):
    """A result of a model: a state, an output along the flight, or a metric that `evaluate` returns.

    In a declaration, a text in place of a Field is its description:
    outputs(altitude_km="altitude", eccentricity=Field("eccentricity", unit="", low=0.0)).

    description : str, one line.  Axes of figures show the name as words, `sun_angle_deg` as "sun angle [deg]"; if the
        name is a symbol, such as `ve_pct`, they add the description up to its first comma or semicolon.
    low : float, smallest physical value, such as 0.0 for an eccentricity; reports draw no normal ellipse beyond it
    high : float, largest physical value
    sometimes, name, unit : see `Named`

    >>> apogee = Field("altitude of the apogee", low=0.0, name="apogee_altitude_km", unit="km")
    >>> apogee.symbol, apogee.si_factor
    ('apogee_altitude', 1000.0)
    """

    description: str
    low: float = field(default=-np.inf, kw_only=True)
    high: float = field(default=np.inf, kw_only=True)
    sometimes: bool = field(default=False, kw_only=True)
    name: str = field(default="", kw_only=True)
    unit: str = field(default=OF_NAME, kw_only=True)


@dataclass(frozen=True)
class Parameter(Named):
    """An input of a model that may differ from case to case: inputs(burn_dv_m_s=Parameter(100.0, "size of the burn")).

    Physics sees it in SI without the unit: `burn_dv`.

    default : float, nominal value in `unit`
    description : str, one line
    low : float, smallest value that is accepted, in `unit`
    high : float, largest value that is accepted, in `unit`
    random_draw : bool, the value only selects a random draw, as a seed does; sensitivity counts it as a random draw
    sometimes, name, unit : see `Named`

    >>> altitude = Parameter(300.0, "altitude of the orbit", low=150.0, high=2000.0, name="altitude_km", unit="km")
    >>> altitude.default * altitude.si_factor
    300000.0
    """

    default: float
    description: str
    low: float = -np.inf
    high: float = np.inf
    random_draw: bool = field(default=False, kw_only=True)
    sometimes: bool = field(default=False, kw_only=True)
    name: str = field(default="", kw_only=True)
    unit: str = field(default=OF_NAME, kw_only=True)


@dataclass(frozen=True)
class Setting(Named):
    """An input of a model that all cases of a batch share: one of several words, a switch, a date, or a number.

    default : str, bool or float, the nominal value
    description : str, one line
    choices : tuple of str, the words that are allowed; physics sees a number in place of a word, see `choices`
    low : float, smallest number that is accepted, in `unit`; for a date, the modified Julian date
    high : float, largest number that is accepted
    whole : bool, only whole numbers are accepted, as for a count
    date : bool, the value is a date as text, "2019-01-01T12:00:00"; physics sees the modified Julian date in UTC
    dispersed_by : str, name of the parameter, if there is one, by which a case deviates from the setting
    sometimes, name, unit : see `Named`; a choice, a switch and a date have no unit

    >>> gravity = Setting("j2", "gravity model", choices=("point", "j2"), name="gravity", unit="")
    >>> gravity.code("j2")
    1.0
    """

    default: str | bool | float
    description: str
    choices: tuple[str, ...] = ()
    low: float = -np.inf
    high: float = np.inf
    whole: bool = False
    date: bool = False
    dispersed_by: str = ""
    sometimes: bool = field(default=False, kw_only=True)
    name: str = field(default="", kw_only=True)
    unit: str = field(default=OF_NAME, kw_only=True)

    def code(self, value: str | bool | float) -> float:
        """The number that stands for `value` inside a kernel."""
        if self.choices:
            return float(self.choices.index(str(value)))
        if self.date and isinstance(value, str):
            return modified_julian_date(value)
        return float(value) * (1.0 if isinstance(self.default, bool) else self.si_factor)


def inputs_of(system: Any) -> dict[str, Parameter | Setting]:
    """All parameters and settings of a model or simulator, by name."""
    return {item.name: item for item in (*system.parameters, *system.settings)}


@dataclass(frozen=True)
class Extremum:
    """The largest or smallest value of one output along the flight, and its time.

    `evaluate` finds both under `name`: the value in `best`, the time [s] in `when`.

    name : str, the symbol in `best` and `when`
    quantity : str, the name of an output of the model
    kind : str, "max", "min", or "last_above": the last time at which the output was above `level`; only the time in
        `when` is meaningful then
    level : float, in SI; for "last_above"
    smooth : bool, True: the extremum may lie between steps, on a curve through them; False: only at steps and events

    >>> Extremum("peak", "altitude_km").kind
    'max'
    """

    name: str
    quantity: str
    kind: str = "max"
    level: float = 0.0
    smooth: bool = True


@dataclass(frozen=True)
class Event:
    """A zero crossing of a function along the flight: events={"apogee": Event(climb_rate, "falling", "stop")}.

    In a model with a stopping event, a case that reaches the integrator's `until` first ends with status no-stop and
    counts as failed.  If a case may also end regularly at a time limit, declare an event t - limit before `until`.

    function : physics that takes any of t, s, m, p, o by name; returns the number whose zero crossing is the event.
        Crossings that follow each other within one step are missed; of an adaptive step two are found.
        A function that is past zero at the start, or jumps over zero at a sample or by `switch`, does not cross it:
        for a hysteresis, `start` must give the discrete state that belongs to the initial value.
    direction : str, "rising", "falling" or "either"
    action : str, "stop" ends the case, "switch" calls the model's `switch`; by default "stop", and "switch" with `to`
    to : str, the phase that begins, see `Phase`; `switch` may change state and discrete state there, too
    after : float, delay [s] from the crossing to the action, or str, the name without unit of the parameter that holds
        the delay; a value below 0 counts as 0.  The action is carried out whatever happens in between.  A further
        crossing during the delay has no effect.
    rare : bool, the event may not happen in ordinary cases, or only with some settings; `mc-engine check` then does
        not report that it did not happen
    name : str, set by the model

    >>> apogee = Event(lambda s: s.vz, name="apogee")
    >>> apogee.direction, apogee.action
    ('falling', 'stop')
    """

    function: Callable[..., Any]
    direction: str = "falling"
    action: str = ""
    rare: bool = False
    to: str = field(default="", kw_only=True)
    after: float | str = field(default=0.0, kw_only=True)
    name: str = field(default="", kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "action", self.action or ("switch" if self.to else "stop"))


@dataclass(frozen=True)
class FixedStep:
    """An integrator on a time grid that all cases share: the classical Runge-Kutta method, or a multistep method.

    step : float, length of a step [s], or str, the symbol of a setting that holds it
    until : float or str, end of the flight [s], at most 1e9 steps.  If it lies inside a step, the flight ends with that
        step, and `mc-engine check` reports it.  In a model with a stopping event, see `Event`.
    control_every : int or str, steps from one call of `control` to the next
    method : str, "rk4" (order 4), or for long smooth arcs "abm8" to "abm12", Adams-Bashforth-Moulton of order 8 to 12,
        or "gj6" to "gj10", Gauss-Jackson with differences of order 6 to 10, for models in which each state either is
        the rate of another state or has a rate among the states.  A step is stable if step times the fastest angular
        frequency [rad/s] is below 0.37, 0.26, 0.18, 0.12, 0.075 for the five orders of ABM; below 0.33, 0.24, 0.17,
        0.12, 0.09 for GJ, and only with weak damping and in frames that turn slowly, see
        `mc_engine.lanes.gauss_jackson`.  Both methods start by DOP853, and restart so after each event and each control
        sample that changes the discrete state.
        `mc-engine check` also flies the nominal case with half the step, and reports a step that is far too long.
    rates : tuple of pairs (state, its rate) by their names without units, for GJ: the derivative of the first state of
        a pair is the second

    >>> FixedStep(step=10.0, until=6000.0).control_every
    1
    """

    step: float | str
    until: float | str
    control_every: int | str = 1
    method: str = "rk4"
    rates: tuple[tuple[str, str], ...] = field(default=(), kw_only=True)


@dataclass(frozen=True)
class AdaptiveStep:
    """An embedded Runge-Kutta pair with step-size control; every case has its own steps.

    until : float, time limit [s], or str, the symbol of a setting that holds it; in a model with a stopping event, see
        `Event`
    rtol : float or str, error allowed in a step, as a fraction of the state's own size
    atol : float, or tuple with one for each state, error allowed in a step, in SI, in addition to rtol's.  It alone
        counts where a state passes through zero: far too small a value, as 1e-9 m in an orbit, makes steps short there.
    control_period : float, str or function of the settings, time [s] between calls of `control`, which happen at whole
        multiples from t = 0, and only in phases with a control; steps end there.  Required by a model with `control`
    method : str, "dop853" (order 8), "tp86" (order 8, with an estimate of order 6; one of its stages lies 0.7 % of a
        step beyond the step's end) or "dp54" (order 5)
    attempts : int, a case that needs more steps, accepted and rejected ones together, ends as step-limit; at most 1e9
    first_step : float, length [s] of the first attempt; with 0 the engine chooses it
    longest_step : float or str, limit of the length of a step [s].  A step may not see what acts for a shorter time
        than it takes, such as a burn between two times in `rhs`.  Let an event of the time begin and end a burn, or
        limit the steps to its length; `mc-engine check` and the report of a run tell of what steps have passed over.

    >>> AdaptiveStep(until=86_400.0, rtol=1e-10).method
    'dop853'
    """

    until: float | str
    rtol: float | str = 1e-9
    atol: float | tuple[float, ...] = 1e-9
    control_period: float | str | Callable[[Any], float] = np.inf
    method: str = "dop853"
    attempts: int = 100_000
    first_step: float = 0.0
    longest_step: float | str = np.inf


def uses_rates(clock: FixedStep | AdaptiveStep) -> bool:
    """Whether the method of a clock integrates second-order equations, for which it needs its `rates`."""
    return clock.method.startswith("gj")


# ---- types of the values in a record, against those that its class declares

_WORDS: dict[Any, str] = {str: "a text", bool: "True or False", NoneType: "None", Mapping: "a dictionary"}
_WORDS |= dict.fromkeys((float, int), "a number")


_declared_types = cache(get_type_hints)  # of each field of a dataclass, by name


def refuse_other_types(record: Any, what: str) -> None:
    """ModelError if a field of `record`, a dataclass, is of another type than its class declares.

    what : the beginning of the sentence, such as 'event "apogee"'.
    """
    for name, kind in _declared_types(record.__class__).items():
        refuse_other_type(record, name, kind, what)


def refuse_other_type(record: Any, name: str, kind: Any, what: str) -> None:
    """ModelError if the field `name` of `record` is of another type than `kind`."""
    value = getattr(record, name)
    if not _is_of(value, kind):
        raise ModelError(f"{what} has {value!r} as its `{name}`; it must be {_words(kind)}")


def _is_of(value: Any, kind: Any) -> bool:
    """Whether a value is of a declared type; numbers are neither truth values nor NaN."""
    parts = get_args(kind)
    if get_origin(kind) in (Union, UnionType):
        return any(_is_of(value, part) for part in parts)
    if get_origin(kind) is tuple:
        parts = parts[:1] * len(value) if isinstance(value, tuple) and parts[-1] is Ellipsis else parts
        return isinstance(value, tuple) and len(value) == len(parts) and all(map(_is_of, value, parts))
    if get_origin(kind) is Callable:
        return callable(value)
    if kind in (float, int):
        return isinstance(value, int | float | np.number) and not isinstance(value, bool) and bool(value == value)
    return kind is Any or isinstance(value, get_origin(kind) or kind)


def _words(kind: Any) -> str:
    parts = get_args(kind)
    if get_origin(kind) in (Union, UnionType):
        return " or ".join(dict.fromkeys(map(_words, parts)))
    if get_origin(kind) is tuple and parts[-1] is Ellipsis:
        return f"a tuple, each item {_words(parts[0])}; one alone needs its comma, (...,)"
    if get_origin(kind) is tuple:
        return f"a tuple of {' and '.join(map(_words, parts))}"
    if get_origin(kind) is Callable:
        return "a function"
    return _WORDS.get(get_origin(kind) or kind, str(getattr(kind, "__name__", kind)))
