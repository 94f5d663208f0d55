"""The vehicle of each case: the campaign's numbers or one of vehicles.py, and kernel parameters that follow from it."""

from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from campaigns.reentry.inputs import PARAMETERS
from campaigns.reentry.planets import of_planets
from campaigns.reentry.vehicles import VEHICLES, Vehicle
from mc_engine.model import Refusals
from mc_engine.physics.aerodynamics import axial_coefficient, mach_table
from mc_engine.physics.heating import detra_kemp_riddell_coefficient

DETRA_KEMP_RIDDELL = 1.0
_SYMBOLS = ("mass", "reference_area", "drag_coefficient", "lift_coefficient", "trim_angle", "nose_radius")


def _shares_over_mach(vehicle: Vehicle) -> np.ndarray:
    """The vehicle's table over the Mach number, in shares of its hypersonic coefficients (no unit), or empty."""
    drag, lift = vehicle.drag_coefficient, vehicle.lift_coefficient
    rows = [(mach, of_drag / drag, of_lift / lift) for mach, of_drag, of_lift in vehicle.over_mach]
    return mach_table(rows) if rows else np.empty(0)


_TABLES = [np.empty(0), *(_shares_over_mach(vehicle) for vehicle in VEHICLES.values())]
COEFFICIENTS = np.concatenate(_TABLES)  # the tables of all vehicles, as flights find them in o.tables
# index at which that of each code of the setting `vehicle` begins, -1 for constant coefficients
_FIRST_INDICES = np.array(
    [sum(before.size for before in _TABLES[:k]) if table.size else -1.0 for k, table in enumerate(_TABLES)],
    dtype=float,
)


class Airframe(NamedTuple):
    """The vehicle of each case as planned, without factors; float64[n], SI and radians."""

    mass: np.ndarray
    area: np.ndarray
    drag_coefficient: np.ndarray
    lift_coefficient: np.ndarray
    trim: np.ndarray
    nose_radius: np.ndarray


def _numbers_of(vehicle: Vehicle) -> tuple[float, ...]:
    """Those of one vehicle, in the order of `Airframe`."""
    trim = float(np.radians(vehicle.trim_angle))
    drag, lift = vehicle.drag_coefficient, vehicle.lift_coefficient
    return vehicle.mass, vehicle.area, drag, lift, trim, vehicle.nose_radius


def airframe_of(i: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> Airframe:
    """Numbers of each case's vehicle, SI; one that is named and given other numbers besides is refused."""
    numbers = [getattr(i, symbol) for symbol in _SYMBOLS]
    items = {parameter.symbol: parameter for parameter in PARAMETERS}
    for k, (name, vehicle) in enumerate(VEHICLES.items(), start=1):
        chosen = settings.vehicle == k
        for symbol in _SYMBOLS:
            item = items[symbol]
            refusals.add(
                chosen & (getattr(i, symbol) != item.default * item.si_factor),
                f'{item.name} is that of the vehicle "{name}"; for another, set vehicle = "given"',
            )
        own = _numbers_of(vehicle)
        numbers = [np.where(chosen, value, number) for value, number in zip(own, numbers, strict=True)]
    return Airframe(*numbers)


def airframe_rows(i: SimpleNamespace, settings: SimpleNamespace, airframe: Airframe) -> dict[str, np.ndarray]:
    """Areas over mass [m^2/kg] of the forces in hypersonic flow, dispersions included; coefficient of the heating."""
    drag = airframe.drag_coefficient * i.cd_factor
    lift = airframe.lift_coefficient * i.cd_factor * i.ld_factor
    trim, tilted = airframe.trim, airframe.trim + i.accelerometer_misalignment
    per_mass = airframe.area / (airframe.mass * i.mass_factor)
    nose = airframe.nose_radius * i.nose_radius_factor
    sutton_graves = of_planets(settings.planet, "heating") / np.sqrt(nose)
    heating = np.where(settings.heating == DETRA_KEMP_RIDDELL, detra_kemp_riddell_coefficient(nose), sutton_graves)
    return {
        "drag": drag * per_mass,
        "lift": lift * per_mass,
        "total": np.hypot(drag, lift) * per_mass,
        "axial": axial_coefficient(drag, lift, np.cos(trim), np.sin(trim)) * per_mass,
        "sensed": axial_coefficient(drag, lift, np.cos(tilted), np.sin(tilted)) * per_mass,
        "coefficients": _FIRST_INDICES[settings.vehicle.astype(int)],
        "cos_trim": np.cos(trim),
        "sin_trim": np.sin(trim),
        "cos_tilted": np.cos(tilted),
        "sin_tilted": np.sin(tilted),
        "cos_misaligned": np.cos(i.accelerometer_misalignment),
        "sin_misaligned": np.sin(i.accelerometer_misalignment),
        "heating": heating * i.heating_factor,
    }
