"""First states of a flight from orbital elements, for whole chunks of cases.  NumPy, SI, radians."""

from types import SimpleNamespace

import numpy as np

from campaigns.geo_servicing.dynamics import MU, State
from mc_engine.model import Refusals
from mc_engine.physics.frames import TURN
from mc_engine.physics.orbital_elements import state_of_elements


def phasing_start(i: SimpleNamespace, o: SimpleNamespace, sidereal, refusals: Refusals) -> np.ndarray:
    """The servicing module above its longitude, osculating elements; sidereal : angle [rad] at the start."""
    period = o.initial_period + i.initial_period_error
    e = o.initial_eccentricity + i.initial_eccentricity_error
    # a negative error of a small eccentricity is one to the other side of the orbit
    anomaly = o.initial_true_anomaly + i.initial_true_anomaly_error + np.where(e < 0.0, np.pi, 0.0)
    e = np.abs(e)
    inclination = o.initial_inclination + i.initial_inclination_error
    refusals.add(~((period > 0.0) & (e < 0.9)), "the first orbit is none: its period or its eccentricity is impossible")
    a = np.cbrt(MU * (period / TURN) ** 2)
    ahead = sidereal + o.initial_longitude + i.initial_longitude_error - o.initial_node
    latitude = np.arctan2(np.sin(ahead) / np.cos(inclination), np.cos(ahead))  # argument of, above the longitude
    return state_of_elements(a, e, inclination, o.initial_node, latitude - anomaly, anomaly, MU)


def craft_start(i: SimpleNamespace, name: str) -> np.ndarray:
    """State float64[6, n] of the craft whose parameters begin with `name`."""
    own = SimpleNamespace(**{key.removeprefix(f"{name}_"): value for key, value in vars(i).items()})
    return state_of_elements(
        own.pericentre_radius / (1.0 - own.eccentricity),
        own.eccentricity,
        own.inclination,
        own.node,
        own.argument_of_pericentre,
        own.argument_of_latitude - own.argument_of_pericentre,
        MU,
    )


def first_states(i: SimpleNamespace, o: SimpleNamespace, sidereal, refusals: Refusals, two) -> dict[str, np.ndarray]:
    """Rows of the first places and velocities; two : bool[n], the inspection, in which the second craft flies."""
    module = np.where(two, craft_start(i, "module"), phasing_start(i, o, sidereal, refusals))
    target = np.where(two, craft_start(i, "target"), 0.0)
    return dict(zip(State._fields[:6], module, strict=True)) | dict(zip(State._fields[7:13], target, strict=True))
