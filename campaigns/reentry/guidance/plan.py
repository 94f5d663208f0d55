"""The plan: the entry, vehicle and bank that a guidance law's reference path is flown with.  NumPy, SI.

A plan knows no errors and no factors.  By default it is each case's own entry, vehicle and bank, so that cases which
differ in their errors alone have one plan; with plan = "given" it is that of the settings plan_..., one for all.
"""

from collections import namedtuple
from types import SimpleNamespace
from typing import Any

import numpy as np

from campaigns.reentry.airframe import airframe_of
from campaigns.reentry.entry_state import Entry, Planned, World, entry_of, world_of
from campaigns.reentry.inputs import CHOICES, GUIDANCE, Inputs
from campaigns.reentry.vehicles import Vehicle
from mc_engine.lanes import merged
from mc_engine.model import Parameter, Refusals
from mc_engine.physics.constants import J2_EARTH

# laws that read the same stored gains: with range, and without
_SAME_GAINS = {"law2r": "law1", "law3r": "law1", "law3": "law2"}
_LAW = np.array([float(GUIDANCE.index(_SAME_GAINS.get(law, law))) for law in GUIDANCE])
_OF_ENTRY = ("speed", "flight_path_angle", "heading", "latitude", "longitude", "altitude", "radius")
# Besides the `World`, with what its gravity is, law, atmosphere, vehicle: codes of settings;  r, latitude, speed, path,
# heading: of `Planned`;  drag: area over mass [m^2/kg];  share: of the lift in the vertical plane;  end: altitude at
# which the reference path ends
Plan = namedtuple(
    "Plan",
    "mu radius polar_radius e2 rate gravity log_density inverse_scale temperature j2 law atmosphere vehicle "
    "r latitude speed path heading drag lift_to_drag trim share end",
)


def planned_entry(
    i: SimpleNamespace, settings: SimpleNamespace, world: World, entry: Entry, refusals: Refusals
) -> Planned:
    """The entry that distances count from: each case's own without errors, or that of plan_..."""
    given = settings.plan == CHOICES.plan.given
    if not given.any():
        return entry.planned
    inputs = vars(i) | {f"entry_{name}": getattr(settings, f"plan_{name}") for name in _OF_ENTRY}
    state = vars(settings) | {"arrival": np.zeros_like(world.mu)}
    plan = entry_of(SimpleNamespace(**inputs), SimpleNamespace(**state), world, refusals).planned
    return Planned(*(np.where(given, *columns) for columns in zip(plan, entry.planned, strict=True)))


def plans_of(i: SimpleNamespace, settings: SimpleNamespace, world: World, planned: Planned, airframe: Vehicle) -> Plan:
    """The plan of each case: a `Plan` of float64[n], SI."""
    given = settings.plan == CHOICES.plan.given
    numbers = given & (settings.vehicle == CHOICES.vehicle.given)  # one of vehicles.py brings its own
    drag = airframe.reference_area * airframe.drag_coefficient / airframe.mass
    lift_to_drag = airframe.lift_coefficient / airframe.drag_coefficient
    return merged(
        Plan,
        world,
        planned,
        mu=np.where(settings.gravity == CHOICES.gravity.none, 0.0, world.mu),
        j2=np.where(settings.gravity == CHOICES.gravity.j2, J2_EARTH, 0.0),
        law=_LAW[settings.guidance.astype(int)],
        atmosphere=settings.atmosphere,
        vehicle=settings.vehicle,
        drag=np.where(numbers, 1.0 / settings.plan_ballistic_coefficient, drag),
        lift_to_drag=np.where(numbers, settings.plan_lift_to_drag, lift_to_drag),
        trim=np.where(numbers, settings.plan_trim_angle, airframe.trim_angle),
        share=np.cos(np.where(given, settings.plan_bank, i.bank)),
        end=settings.plan_stop_altitude,
    )


def plan_of(**chosen: Any) -> Plan:
    """The plan of one case as plain numbers, SI; inputs by column, in declared units, the others at their defaults."""
    i, settings, refusals = SimpleNamespace(), SimpleNamespace(), Refusals.none(1)
    for item in Inputs.declared:
        value = chosen.get(item.name, item.default)
        is_parameter = isinstance(item, Parameter)
        number = value * item.si_factor if is_parameter else item.code(value)
        setattr(i if is_parameter else settings, item.symbol, np.array([number]))
    world = world_of(i, settings)
    planned = planned_entry(i, settings, world, entry_of(i, settings, world, refusals), refusals)
    plan = plans_of(i, settings, world, planned, airframe_of(i, settings, refusals))
    return Plan(*(float(column[0]) for column in plan))
