"""A run in the units that a person would choose: 9.3 days, not 8·10⁵ s.

One unit for every metric, state and history quantity of a run, chosen from its values and limits; inputs keep the units
in which the campaign file gives them.  Statistics and verdicts are computed in the columns' own units, and told here.
"""

from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property
from math import inf, isfinite, log10
from typing import Any

import numpy as np
import pandas as pd

from mc_engine.statistics import Summary, Verdict
from mc_engine.statistics.first_order import Contributor
from mc_engine.statistics.worst import Limits
from mc_engine.units import convert
from reports.run.flown import ColumnFacts, Flown
from reports.text.numbers import number, with_unit

COMFORTABLE = (0.01, 1e4)  # where the largest number may lie in its own unit
FINE = 1e-3  # a smaller σ is not told in a unit
IDEAL = (1.0, 1e3)  # where it lies in the unit chosen instead, if it can
# Units of one quantity, the smallest first; a column changes to another one of its own row only.
_LADDERS = (
    ("us", "ms", "s", "h", "day"),
    ("um", "mm", "m", "km"),
    ("mm/s", "m/s", "km/s"),
    ("m/day", "km/day"),
    ("m^2", "km^2"),
    ("ug", "g"),
    ("J/kg", "kJ/kg", "MJ/kg"),
    ("m^2/s^2", "km^2/s^2"),
    ("m^2/s", "km^2/s"),
    ("m^3/s^2", "km^3/s^2"),
    ("mg/s", "g/s", "kg/s"),
    ("uN", "mN", "N", "kN"),
    ("uN s", "mN s", "N s", "kN s"),
    ("uN m", "mN m", "N m", "kN m"),
    ("mN m s", "N m s"),
    ("Pa", "kPa", "MPa"),
    ("J", "kJ", "MJ"),
    ("eV", "keV", "MeV"),
    ("mW", "W", "kW"),
    ("W/m^2", "kW/m^2", "MW/m^2"),
    ("J/m^2", "kJ/m^2", "MJ/m^2"),
    ("urad", "mrad", "rad"),
    ("arcsec", "deg"),
    ("mrad/s", "rad/s"),
    ("deg/h", "deg/s"),
    ("mV", "V", "kV"),
    ("mA", "A"),
    ("nT", "uT", "mT", "T"),
    ("Hz", "kHz"),
    ("1/day", "1/h", "1/s"),
)
_LADDER = {unit: ladder for ladder in _LADDERS for unit in ladder}


def chosen_unit(unit: str, numbers: Iterable[float | None]) -> str:
    """The unit for these numbers in `unit`: `unit` itself unless the largest of them is awkward in it."""
    largest = max((abs(number) for number in numbers if number and isfinite(number)), default=0.0)
    if unit not in _LADDER or not largest or COMFORTABLE[0] <= largest < COMFORTABLE[1]:
        return unit

    def awkwardness(other: str) -> float:
        size = convert(largest, unit, other)
        if not 0.0 < size < inf:
            return inf
        return max(log10(size / IDEAL[1]), log10(IDEAL[0] / size), 0.0)

    return min(reversed(_LADDER[unit]), key=awkwardness)  # of equally good ones, the largest unit


class ShownRun(Flown):
    """A run as its report tells it.  own : the same run, each column in its own unit.

    like : a run that chooses the unit of each column that has the same own unit in both.
    """

    def __init__(self, own: Flown, like: "ShownRun | None" = None):
        self.__dict__.update(vars(own))
        self._own = own
        self._units: dict[str, str] = {}
        if like is not None:
            self._units = {name: like.unit(name) for name in own.columns if like.own.unit(name) == own.unit(name)}
        self.histories = self.told_table(own.histories)

    @property
    def own(self) -> Flown:
        return self._own

    def unit(self, name: str) -> str:
        if name not in self._units:
            unit = self._own.unit(name)
            role = self._own.columns[name].role if name in self._own.columns else ""
            kept = role == "dispersion" or self._fine(name, unit)
            self._units[name] = unit if kept else self._chosen(name, unit)
        return self._units[name]

    def _chosen(self, name: str, unit: str) -> str:
        """The unit for all numbers of a column.  A metric that is an output, too, keeps its own unless both agree:
        a miss of 3 m is not told in km because the flight begins 480 km away."""
        found = {chosen_unit(unit, sizes) for sizes in self._sizes(name)}
        return found.pop() if len(found) == 1 else unit

    def _fine(self, name: str, unit: str) -> bool:
        """Whether a larger unit would hide how far a metric spreads, and is from its limits: 1 s after 6 hours."""
        summary = self._own.summaries.get(name)
        if summary is None or not summary.spread or summary.mean is None:
            return False
        chosen = self._chosen(name, unit)
        apart = [abs(limit - summary.mean) for limit in self._own.limits(name).ends]
        return chosen != unit and convert(max([summary.spread, *apart]), unit, chosen) < FINE

    def _sizes(self, name: str) -> list[list[float | None]]:
        """What the numbers of a column come to: of a metric with its limits, and of a state or an output."""
        found: list[list[float | None]] = []
        if name in self._own.summaries:
            summary = self._own.summaries[name]
            ends = [summary.minimum, summary.maximum]
            percentiles = [quantile.value for quantile in summary.quantiles]
            found.append([*self._own.limits(name), self._own.nominal_value(name), *(percentiles or ends)])
        largest: list[float | None] = []
        for table in [self._own.histories] if found else [self._own.histories, self._own.cases]:
            if name in table.columns and pd.api.types.is_numeric_dtype(table[name]):
                values = np.abs(table[name].to_numpy(dtype=np.float64))
                largest.append(float(values[np.isfinite(values)].max(initial=0.0)))
        return [*found, largest] if largest else found

    def told(self, name: str, value: Any) -> Any:
        """A number, or an array of them, of a column's own unit in the unit chosen for it; None stays None."""
        own, unit = self._own.unit(name), self.unit(name)
        return value if value is None or own == unit else convert(value, own, unit)

    def words(self, name: str) -> str:
        return self._own.words(name)  # of the name, which ends in its own unit

    @cached_property
    def columns(self) -> dict[str, ColumnFacts]:
        return {name: replace(fact, unit=self.unit(name)) for name, fact in self._own.columns.items()}

    def range(self, name: str) -> tuple[float, float]:
        low, high = self._own.range(name)
        return float(self.told(name, low)), float(self.told(name, high))

    def values(self, name: str) -> np.ndarray:
        return np.asarray(self.told(name, self._own.values(name)))

    def nominal_value(self, name: str) -> float | None:
        value: float | None = self.told(name, self._own.nominal_value(name))
        return value

    def told_table(self, table: pd.DataFrame) -> pd.DataFrame:
        """A table of cases or histories with its columns in the units chosen."""
        known = [name for name in table.columns if self._own.unit(name) != self.unit(name)]
        return table.assign(**{name: self.told(name, table[name].to_numpy()) for name in known}) if known else table

    @cached_property
    def summaries(self) -> dict[str, Summary]:
        return {name: self._told_summary(name, summary) for name, summary in self._own.summaries.items()}

    def _told_summary(self, name: str, summary: Summary) -> Summary:
        numbers = {key: self.told(name, getattr(summary, key)) for key in ("mean", "sd", "minimum", "maximum")}
        quantiles = [
            replace(each, **{key: self.told(name, getattr(each, key)) for key in ("value", "lower", "upper")})
            for each in summary.quantiles
        ]
        return replace(summary, **numbers, quantiles=tuple(quantiles))

    @cached_property
    def _judgement(self) -> tuple[list[Verdict], Verdict | None]:
        return [self._told_verdict(verdict) for verdict in self._own.verdicts], self._own.joint

    def _told_verdict(self, verdict: Verdict) -> Verdict:
        numbers = {
            key: self.told(verdict.metric, getattr(verdict, key)) for key in ("at_most", "at_least", "demonstrated")
        }
        enclosed = verdict.enclosed and tuple(self.told(verdict.metric, end) for end in verdict.enclosed)
        return replace(verdict, **numbers, enclosed=enclosed)

    def limits(self, metric: str) -> Limits:
        return Limits(*(self.told(metric, end) for end in self._own.limits(metric)))

    def largest_is_worst(self, metric: str) -> bool:
        return self._own.largest_is_worst(metric)

    def worst(self, metric: str, most: int) -> pd.DataFrame:
        return self.told_table(self._own.worst(metric, most))

    def contributors(self, metric: str) -> list[Contributor]:
        return self._own.contributors(metric)

    @property
    def contributions(self) -> Any:
        return self._own.contributions


def spread_text(flown: Flown, metric: str, spread: float) -> str:
    """A part of a metric's σ in its own unit where that suits σ better: 55 s of a time that is told in days."""
    told, sigma = flown.unit(metric), flown.summaries[metric].spread
    unit = flown.own.unit(metric) if sigma and sigma < FINE else told
    return with_unit(number(convert(spread, told, unit) if unit != told else spread, 3), unit)
