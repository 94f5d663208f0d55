"""The records that a model is made of: its named numbers, events, extrema and clocks."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mc_engine.dates import modified_julian_date
from mc_engine.units import UNITS, unit_suffix

Number = float | np.ndarray
DIRECTIONS = {"rising": 1.0, "falling": -1.0, "either": 0.0}  # of events, and their signs


@dataclass(frozen=True)
class Named:
    """A named number: column name ending in its unit, the unit, a one-line meaning."""

    name: str
    unit: str
    description: str
    sometimes: bool = field(default=False, kw_only=True)

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
    """A named number: column name ending in its unit, the unit, a one-line meaning.

    Axes of figures say the name in words: `sun_angle_deg` is "sun angle [deg]"; of an input that is a symbol, such as
    `ve_pct`, the meaning up to a comma or semicolon too.
    sometimes : a metric that exists, or differs, only with some settings; `check` does not miss it.
    low, high : the physical range, such as low=0.0 of an eccentricity; reports show no normal ellipse that leaves it.
    """

    low: float = field(default=-np.inf, kw_only=True)
    high: float = field(default=np.inf, kw_only=True)


@dataclass(frozen=True)
class Parameter(Named):
    """An input that may differ from case to case.  Values outside [low, high] are refused.

    random_draw : its value only names a random draw, as a seed does; its contribution is that of the random draws.
    """

    default: float
    low: float = -np.inf
    high: float = np.inf
    random_draw: bool = field(default=False, kw_only=True)


@dataclass(frozen=True)
class Setting(Named):
    """An input shared by all cases of one kernel call: a choice of words, a switch, a date, or a number.

    In kernels a choice is the index of the word in `choices`, a switch is 0.0 or 1.0, a date is a modified Julian date
    in UTC, a number is SI.
    whole : only whole numbers are accepted, as for a count.
    date : the value is a date as text, "2019-01-01T12:00:00"; low and high are modified Julian dates.
    dispersed_by : the parameter by which a case deviates from the setting, if there is one.
    """

    default: str | bool | float
    choices: tuple[str, ...] = ()
    low: float = -np.inf
    high: float = np.inf
    whole: bool = False
    date: bool = False
    dispersed_by: str = ""

    def code(self, value: str | bool | float) -> float:
        """The number that stands for `value` inside a kernel."""
        if self.choices:
            return float(self.choices.index(str(value)))
        if self.date and isinstance(value, str):
            return modified_julian_date(value)
        return float(value) * (1.0 if isinstance(self.default, bool) else self.si_factor)


@dataclass(frozen=True)
class Extremum:
    """A running extremum of one quantity: the symbols under which `evaluate` finds value and time.

    kind : "max", "min", or "last_above": the last time at which the quantity stood above `level` (SI); then only
        the time is of use.
    smooth : between the steps the extremum is a parabola's; a quantity with corners is taken at the steps.
    """

    name: str
    quantity: str
    kind: str = "max"
    level: float = 0.0
    smooth: bool = True


@dataclass(frozen=True)
class Event:
    """A zero of one component of `events`.

    direction : "rising", "falling" or "either".  action : "stop" ends the case, "switch" calls the model's `switch`.
    rare : it may never happen in ordinary cases, or only with some settings; `check` does not miss it.
    In a model with a stopping event, a case that reaches the clock's `until` has not come to its end: its status is
    no-stop, which counts as failed.  Where the time is a good end too, let it be an event, t - limit, before `until`.
    """

    name: str
    direction: str = "falling"
    action: str = "stop"
    rare: bool = False


@dataclass(frozen=True)
class FixedStep:
    """Classical Runge-Kutta of fourth order on a common grid; control is sampled every `control_every` steps.

    step, until : SI numbers, or the symbols of settings that hold them; 1e9 steps at most.  `until` ends the flight;
        in a model with a stopping event, see Event.
    """

    step: float | str
    until: float | str
    control_every: int | str = 1
    method: str = "rk4"


@dataclass(frozen=True)
class AdaptiveStep:
    """An embedded Runge-Kutta pair whose step every case chooses by itself, to the tolerances.

    until : time limit [s], or the symbol of a setting that holds it; in a model with a stopping event, see Event
    rtol : error of a step in the state's own size, or the symbol of a setting
    atol : the same in SI, one number for all states or one for each
    control_period : time [s] from one sample of `control` to the next, the symbol of a setting, or a function of the
        settings; steps end there
    method : "dop853" (order 8), or "dp54" (order 5)
    attempts : a case that needs more steps, good or rejected, ends as step-limit; 1e9 at most
    first_step : length [s] of the first attempt; 0 chooses it
    """

    until: float | str
    rtol: float | str = 1e-9
    atol: float | tuple[float, ...] = 1e-9
    control_period: float | str | Callable[[Any], float] = np.inf
    method: str = "dop853"
    attempts: int = 100_000
    first_step: float = 0.0
