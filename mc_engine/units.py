"""Units of columns and their factors to SI; the suffix that a column name carries for each unit."""

from dataclasses import dataclass
from math import pi
from typing import TypeVar

import numpy as np

Number = TypeVar("Number", float, np.ndarray)


@dataclass(frozen=True)
class Unit:
    """factor: SI value of one unit.  suffix: what a column name in this unit ends in.  quantity: what it measures."""

    factor: float
    suffix: str
    quantity: str


_DAY = 86400.0

UNITS = {
    "": Unit(1.0, "", "number"),
    "%": Unit(0.01, "_pct", "number"),
    "s": Unit(1.0, "_s", "time"),
    "min": Unit(60.0, "_min", "time"),
    "h": Unit(3600.0, "_h", "time"),
    "day": Unit(_DAY, "_days", "time"),
    "m": Unit(1.0, "_m", "length"),
    "km": Unit(1e3, "_km", "length"),
    "m^2": Unit(1.0, "_m2", "area"),
    "m/s": Unit(1.0, "_m_s", "speed"),
    "km/s": Unit(1e3, "_km_s", "speed"),
    "m/s^2": Unit(1.0, "_m_s2", "acceleration"),
    "g": Unit(9.80665, "_g", "acceleration"),
    "kg": Unit(1.0, "_kg", "mass"),
    "kg/s": Unit(1.0, "_kg_s", "mass flow"),
    "kg/m^2": Unit(1.0, "_kg_m2", "areal density"),
    "kg/m^3": Unit(1.0, "_kg_m3", "density"),
    "kg m^2": Unit(1.0, "_kg_m2", "moment of inertia"),
    "N": Unit(1.0, "_n", "force"),
    "kN": Unit(1e3, "_kn", "force"),
    "N s": Unit(1.0, "_n_s", "impulse"),
    "N m": Unit(1.0, "_n_m", "torque"),
    "N m s": Unit(1.0, "_n_m_s", "angular momentum"),
    "Pa": Unit(1.0, "_pa", "pressure"),
    "W/m^2": Unit(1.0, "_w_m2", "heat flux"),
    "J/m^2": Unit(1.0, "_j_m2", "heat load"),
    "K": Unit(1.0, "_k", "temperature"),
    "rad": Unit(1.0, "_rad", "angle"),
    "deg": Unit(pi / 180.0, "_deg", "angle"),
    "rad/s": Unit(1.0, "_rad_s", "angular speed"),
    "deg/s": Unit(pi / 180.0, "_deg_s", "angular speed"),
    "deg/day": Unit(pi / 180.0 / _DAY, "_deg_day", "angular speed"),
    "deg/rev": Unit(pi / 180.0, "_deg_rev", "angle per revolution"),
    "1/s": Unit(1.0, "_1_s", "rate"),
}


def unit_suffix(unit: str) -> str:
    """The suffix, with its underscore, of column names in `unit`; KeyError for a unit not in UNITS."""
    return UNITS[unit].suffix


def convert(value: Number, unit: str, to: str) -> Number:
    """`value` in `unit` as a number in the unit `to`; both must measure the same quantity."""
    # Multiply first: 250 m in km is then 0.25 and not 250 times a rounded thousandth.
    return value * UNITS[unit].factor / UNITS[to].factor


def compatible(unit: str) -> list[str]:
    """All units of the quantity that `unit` measures."""
    return [name for name, other in UNITS.items() if other.quantity == UNITS[unit].quantity]
