"""The vehicle of each case: the campaign's numbers or one of vehicles.py, and kernel parameters that follow from it."""

from types import SimpleNamespace

import numpy as np

from campaigns.reentry.inputs import CHOICES, Inputs
from campaigns.reentry.planets import of_planets
from campaigns.reentry.vehicles import VEHICLES, Vehicle
from mc_engine.model import Refusals
from mc_engine.physics.aerodynamics import axial_coefficient
from mc_engine.physics.heating import detra_kemp_riddell_coefficient

_ITEMS = [item for item in Inputs.declared if item.symbol in Vehicle._fields]


def airframe_of(i: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> Vehicle:
    """Each case's vehicle without factors, SI; one that is named and given other numbers besides is refused."""
    numbers = {item.symbol: getattr(i, item.symbol) for item in _ITEMS}
    for code, (name, vehicle) in enumerate(VEHICLES.items(), start=1):
        chosen = settings.vehicle == code
        for item in _ITEMS:
            refusals.add(
                chosen & (getattr(i, item.symbol) != item.default * item.si_factor),
                f'{item.name} is that of the vehicle "{name}"; for another, set vehicle = "given"',
            )
            numbers[item.symbol] = np.where(chosen, getattr(vehicle, item.symbol), numbers[item.symbol])
    return Vehicle(**numbers)


def airframe_rows(i: SimpleNamespace, settings: SimpleNamespace, airframe: Vehicle) -> dict[str, np.ndarray]:
    """Areas over mass [m^2/kg] of the forces in hypersonic flow, dispersions included; coefficient of the heating.

    Besides them the numbers of the vehicle, by symbol, and angles by cosine and sine.
    """
    drag = airframe.drag_coefficient * i.cd_factor
    lift = airframe.lift_coefficient * i.cd_factor * i.ld_factor
    trim, tilted = airframe.trim_angle, airframe.trim_angle + i.accelerometer_misalignment
    per_mass = airframe.reference_area / (airframe.mass * i.mass_factor)
    nose = airframe.nose_radius * i.nose_radius_factor
    sutton_graves = of_planets(settings.planet, "heating") / np.sqrt(nose)
    heating = np.where(
        settings.heating == CHOICES.heating.detra_kemp_riddell, detra_kemp_riddell_coefficient(nose), sutton_graves
    )
    rows = airframe._asdict() | {
        "drag": drag * per_mass,
        "lift": lift * per_mass,
        "total": np.hypot(drag, lift) * per_mass,
        "axial": axial_coefficient(drag, lift, np.cos(trim), np.sin(trim)) * per_mass,
        "sensed": axial_coefficient(drag, lift, np.cos(tilted), np.sin(tilted)) * per_mass,
        "heating": heating * i.heating_factor,
    }
    # trim: of the body axis against the flow;  tilted: of the accelerometer's;  misaligned: of this against the body's
    for name, angle in (("trim", trim), ("tilted", tilted), ("misaligned", i.accelerometer_misalignment)):
        rows |= {f"cos_{name}": np.cos(angle), f"sin_{name}": np.sin(angle)}
    return rows
