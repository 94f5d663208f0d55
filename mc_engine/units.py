"""Units of columns and their factors to SI; the suffix that a column name carries for each unit."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import pi
from typing import TypeVar

import numpy as np

from mc_engine.errors import ModelError
from mc_engine.suggestions import nearest, synonym

Number = TypeVar("Number", float, np.ndarray)


@dataclass(frozen=True)
class Unit:
    """factor: SI value of one unit.  suffix: ending of column names in this unit.  quantity: physical quantity."""

    factor: float
    suffix: str
    quantity: str


_DAY = 86400.0
_DEGREE = pi / 180.0
_G0 = 9.80665  # m/s^2, exactly
_EV = 1.602176634e-19  # J, exactly

# SI value of one unit.  A name is told from all others without regard to upper and lower case, as column names are.
_BY_QUANTITY: dict[str, dict[str, float]] = {
    "number": {"": 1.0, "%": 0.01, "ppm": 1e-6},
    "time": {"s": 1.0, "us": 1e-6, "ms": 1e-3, "min": 60.0, "h": 3600.0, "day": _DAY},
    "rate": {"1/s": 1.0, "1/h": 1.0 / 3600.0, "1/day": 1.0 / _DAY},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "length": {"m": 1.0, "um": 1e-6, "mm": 1e-3, "cm": 1e-2, "km": 1e3},
    "area": {"m^2": 1.0, "cm^2": 1e-4, "km^2": 1e6},
    "volume": {"m^3": 1.0, "cm^3": 1e-6},
    "curvature": {"1/m": 1.0, "1/km": 1e-3},
    "speed": {
        "m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2, "km/s": 1e3, "km/h": 1.0 / 3.6, "m/day": 1.0 / _DAY,
        "km/day": 1e3 / _DAY,
    },
    "acceleration": {"m/s^2": 1.0, "mm/s^2": 1e-3, "g": _G0, "ug": 1e-6 * _G0},
    "jerk": {"m/s^3": 1.0},
    "velocity random walk": {"m/s/sqrt(s)": 1.0, "m/s/sqrt(h)": 1.0 / 60.0},
    "specific energy": {"m^2/s^2": 1.0, "km^2/s^2": 1e6, "J/kg": 1.0, "kJ/kg": 1e3, "MJ/kg": 1e6},
    "gravitational parameter": {"m^3/s^2": 1.0, "km^3/s^2": 1e9},
    "specific angular momentum": {"m^2/s": 1.0, "km^2/s": 1e6},
    "mass": {"kg": 1.0},
    "mass flow": {"kg/s": 1.0, "mg/s": 1e-6, "g/s": 1e-3},
    "linear density": {"kg/m": 1.0},
    "areal density": {"kg/m^2": 1.0},
    "density": {"kg/m^3": 1.0},
    "number density": {"1/m^3": 1.0},
    "area per mass": {"m^2/kg": 1.0},
    "first moment of mass": {"kg m": 1.0},
    "moment of inertia": {"kg m^2": 1.0},
    "force": {"N": 1.0, "uN": 1e-6, "mN": 1e-3, "kN": 1e3},
    "impulse": {"N s": 1.0, "uN s": 1e-6, "mN s": 1e-3, "kN s": 1e3},
    "torque": {"N m": 1.0, "uN m": 1e-6, "mN m": 1e-3, "kN m": 1e3},
    "angular momentum": {"N m s": 1.0, "mN m s": 1e-3},
    "stiffness": {"N/m": 1.0},
    "damping": {"N s/m": 1.0},
    "rotational stiffness": {"N m/rad": 1.0, "N m/deg": 1.0 / _DEGREE},
    "rotational damping": {"N m s/rad": 1.0},
    "pressure": {"Pa": 1.0, "hPa": 1e2, "kPa": 1e3, "MPa": 1e6, "bar": 1e5},
    "energy": {"J": 1.0, "kJ": 1e3, "MJ": 1e6, "W h": 3600.0, "eV": _EV, "keV": 1e3 * _EV, "MeV": 1e6 * _EV},
    "power": {"W": 1.0, "mW": 1e-3, "kW": 1e3},
    "thrust per power": {"N/W": 1.0, "mN/kW": 1e-6},
    "heat flux": {"W/m^2": 1.0, "kW/m^2": 1e3, "MW/m^2": 1e6, "W/cm^2": 1e4},
    "heat load": {"J/m^2": 1.0, "kJ/m^2": 1e3, "MJ/m^2": 1e6, "J/cm^2": 1e4},
    "temperature": {"K": 1.0},
    "rate of temperature": {"K/s": 1.0},
    "thermal expansion": {"1/K": 1.0},
    "heat capacity": {"J/K": 1.0},
    "specific heat": {"J/(kg K)": 1.0},
    "thermal conductance": {"W/K": 1.0},
    "thermal conductivity": {"W/(m K)": 1.0},
    "heat transfer": {"W/(m^2 K)": 1.0},
    "angle": {
        "rad": 1.0, "urad": 1e-6, "mrad": 1e-3, "deg": _DEGREE, "arcmin": _DEGREE / 60.0, "arcsec": _DEGREE / 3600.0,
        "rev": 2.0 * pi,
    },
    "angular speed": {
        "rad/s": 1.0, "mrad/s": 1e-3, "deg/s": _DEGREE, "deg/min": _DEGREE / 60.0, "deg/h": _DEGREE / 3600.0,
        "deg/day": _DEGREE / _DAY, "arcsec/s": _DEGREE / 3600.0, "rpm": 2.0 * pi / 60.0,
    },
    "angular acceleration": {"rad/s^2": 1.0, "deg/s^2": _DEGREE},
    "angle random walk": {"rad/sqrt(s)": 1.0, "deg/sqrt(s)": _DEGREE, "deg/sqrt(h)": _DEGREE / 60.0},
    "angle per revolution": {"deg/rev": _DEGREE},
    "voltage": {"V": 1.0, "mV": 1e-3, "kV": 1e3},
    "current": {"A": 1.0, "mA": 1e-3},
    "resistance": {"Ohm": 1.0},
    "charge": {"C": 1.0, "A h": 3600.0},
    "magnetic flux density": {"T": 1.0, "nT": 1e-9, "uT": 1e-6, "mT": 1e-3},
    "rate of magnetic flux density": {"T/s": 1.0, "nT/s": 1e-9},
    "magnetic dipole": {"A m^2": 1.0, "mA m^2": 1e-3},
}  # fmt: skip
_SHORT = 3  # letters of a unit
_LONGEST_ENDING = 5  # words of a unit at the end of a name, as in _n_m_s or _deg_sqrt_h
_ALSO_WRITTEN = str.maketrans(
    {"²": "2", "³": "3", "µ": "u", "μ": "u", "°": "deg", "Ω": "ohm"} | dict.fromkeys(" ^*·()_")
)
# Of quotients that no unit is: words of the numerators, by the quantity of the denominator, as in _kg_h and _g_cm3.
_NUMERATORS = {
    "time": {"um", "mm", "cm", "m", "km", "ft", "mi", "nmi", "mg", "g", "ug", "kg", "lb", "mrad", "rad", "deg",
             "arcmin", "arcsec", "rev"},
    "volume": {"mg", "g", "ug", "kg", "lb"},
}  # fmt: skip
OTHER_SUFFIXES = {"%": "_pct", "day": "_days"}  # of units that a column's name does not end in letter by letter


def _suffix(unit: str) -> str:
    """W/(m^2 K) is _w_m2_k at the end of a column's name."""
    if unit in OTHER_SUFFIXES or not unit:
        return OTHER_SUFFIXES.get(unit, "")
    return "_" + "_".join(unit.lower().replace("^", "").translate(str.maketrans("/()", "   ")).split())


UNITS = {
    name: Unit(factor, _suffix(name), quantity)
    for quantity, units in _BY_QUANTITY.items()
    for name, factor in units.items()
}


def by_quantity() -> dict[str, list[str]]:
    """The names of all units, by quantity; the first of each is the SI unit.  Plain numbers have no name."""
    return {quantity: [name for name in units if name] for quantity, units in _BY_QUANTITY.items()}


def nearest_unit(unit: str, allowed: Iterable[str]) -> str | None:
    """The allowed unit that was probably meant, such as "N m" for "Nm" and "m/s^2" for "m/s²"; or None."""
    names = [name for name in allowed if name]
    squeezed = {_squeezed(name): name for name in names}
    without_bars = {short.replace("/", ""): name for short, name in squeezed.items()}
    exact = squeezed.get(_squeezed(unit)) or without_bars.get(_squeezed(unit)) or synonym(unit, names)
    return exact or nearest(unit, [name for name in names if _may_be_misspelt(name, unit)])


def _may_be_misspelt(unit: str, typed: str) -> bool:
    """Whether `typed` may be a misspelt `unit`; another letter in a short unit, as in kph and kPa, is another unit."""
    letters, given = (_squeezed(name).replace("/", "") for name in (unit, typed))
    long = len(letters) > _SHORT and "/" not in unit
    return letters.isalpha() and (long or set(letters) == set(given) or given == f"{letters}s")


def unit_hint(unit: str) -> str:
    """End of a sentence about a unit that is not in UNITS: the nearest one, and where all are listed."""
    near = nearest_unit(unit, UNITS)
    meant = f'; did you mean "{near}"?' if near else ""
    return f"{meant}; `mc-engine units` lists all {len(UNITS)}"


def _squeezed(unit: str) -> str:
    """A unit as it is also written: without spaces and signs of powers and products, in lower case."""
    return unit.lower().translate(_ALSO_WRITTEN)


def unit_suffix(unit: str) -> str:
    """The suffix, with its underscore, of column names in `unit`; KeyError for a unit that is not in UNITS."""
    return UNITS[unit].suffix


def convert(value: Number, unit: str, to: str) -> Number:
    """`value` converted from `unit` to the unit `to`; both must be units of the same quantity."""
    # Multiply first: 250 m in km is then 0.25 and not 250 times a rounded thousandth.
    return value * UNITS[unit].factor / UNITS[to].factor


def compatible(unit: str) -> list[str]:
    """All units of the same quantity as `unit`."""
    return [name for name, other in UNITS.items() if other.quantity == UNITS[unit].quantity]


def unit_of(name: str, said: Callable[[str], str] = 'unit="{}"'.format) -> str:
    """The unit at the end of a column's name; ModelError if there is none, or if the ending fits two units.

    said : for error messages, how a user states a unit.

    >>> unit_of("burn_dv_m_s"), unit_of("heat_load_mj_m2")
    ('m/s', 'MJ/m^2')
    """
    units = units_meant(name)
    if len(units) == 1:
        return units[0]
    if units:
        raise ModelError(f'"{name}" may end in the unit {" or ".join(units)}; say which, {said(units[0])}')
    if quotient := _unknown_quotient(name):
        raise ModelError(
            f'"{name}" ends in {"/".join(quotient)}, which is no unit here: convert it, or say {said(quotient[1])} if '
            f"it is in {quotient[1]}; `mc-engine units` lists all"
        )
    alike = _alike(name)
    ending = f'; did you mean "{alike}"?' if alike else ""
    raise ModelError(
        f'"{name}" ends in no unit{ending}; say {said("")} for a plain number; `mc-engine units` lists all'
    )


def units_meant(name: str) -> list[str]:
    """The units that fit the ending of a column's name: one, several, or none."""
    known = units_at_the_end(name)
    longest = max((unit_suffix(unit) for unit in known), key=len, default="")
    units = [unit for unit in known if unit_suffix(unit) == longest]
    if longest.startswith("_1_"):  # stage_1_s is a time of stage 1, or a rate
        units += [unit for unit in known if unit_suffix(unit) == longest[2:]]
    return units


def _unknown_quotient(name: str) -> tuple[str, str] | None:
    """(numerator, unit) where a name ends in a quotient that no unit is, such as _kg_h; or None."""
    unit = max(_units_by_ending(name), key=lambda one: len(unit_suffix(one)), default="")
    before = name.removesuffix(unit_suffix(unit)).rpartition("_")[2]
    return (before, unit) if before in _NUMERATORS.get(UNITS[unit].quantity, ()) else None


def units_at_the_end(name: str) -> list[str]:
    """Every unit that a column's name may end in; none of speed_ft_s, which is no time."""
    return [] if _unknown_quotient(name) else _units_by_ending(name)


def _units_by_ending(name: str) -> list[str]:
    """The same, whatever stands before the unit, but for "per": lapse_k_per_km is no length."""
    before = {unit: name.removesuffix(unit_suffix(unit)) for unit in UNITS if unit}
    return [unit for unit, rest in before.items() if rest not in ("", name) and not rest.endswith("_per")]


def _alike(name: str) -> str:
    """The name with the unit that its last words are nearly; "" where they are like none."""
    if "_per_" in name:  # deg_per_s is written deg_s
        plain = name.replace("_per_", "_")
        return plain if any("/" in unit for unit in units_at_the_end(plain)) else ""
    words = name.split("_")
    for count in range(1, min(_LONGEST_ENDING, len(words) - 1) + 1):
        ending = "_".join(words[-count:]) or "_"
        alike = [unit for unit in UNITS if unit == "%" or unit[:1].lower() == ending[0].lower()]
        if near := nearest_unit(ending, alike):
            return "_".join(words[:-count]) + unit_suffix(near)
    return ""
