"""Vehicles: mass, reference area, coefficients, nose radius, and where each number comes from.

Coefficients are those of hypersonic continuum flow, constant but where curves over the Mach number are published.
`vehicle = "given"` flies the numbers of the campaign file instead.
"""

from typing import NamedTuple

import numpy as np

from mc_engine.lanes import physics
from mc_engine.physics.curves import curve


class Vehicle(NamedTuple):
    """One vehicle, or float64[n] of each case's, by the symbols of the inputs, SI; coefficients are those at trim."""

    mass: float
    reference_area: float
    drag_coefficient: float
    lift_coefficient: float = 0.0
    trim_angle: float = 0.0
    nose_radius: float = 0.0


# Command module.  Trimmed coefficients: C. A. Graves, J. C. Harpold, Apollo experience report: mission planning for
# Apollo entry, NASA TN D-6725 (1972), table I; mass: J. Szelc, NASA TM X-69555 (1969); nose: the 10-ft equivalent
# sphere; trim angle this study's.
_APOLLO = Vehicle(5498.22, 12.017, 1.2891, 0.38773, trim_angle=float(np.radians(20.0)), nose_radius=3.05)
_DRAG_PER_HYPERSONIC, _LIFT_PER_HYPERSONIC = 1.0 / _APOLLO.drag_coefficient, 1.0 / _APOLLO.lift_coefficient
APOLLO_DRAG = curve("apollo_over_mach.csv", x="mach", y="drag_coefficient", y_unit="")
APOLLO_LIFT = curve("apollo_over_mach.csv", x="mach", y="lift_coefficient", y_unit="")

VEHICLES = {
    "apollo": _APOLLO,
    # a descent module of 2.2 m diameter in its ballistic mode, spinning: this study's round numbers
    "soyuz": Vehicle(2900.0, 3.80, 1.26, nose_radius=2.235),
    # Stardust: R. A. Mitcheltree et al., AIAA 97-2304; mass about 46 kg
    "sample_return": Vehicle(45.8, 0.51887, 1.4828, nose_radius=0.22),
    # ballistic coefficient 1000 kg/m^2 of the Allen-Eggers example; nose radius this study's
    "warhead": Vehicle(1000.0, 1.0, 1.0, nose_radius=0.1),
}


@physics
def apollo_shares(mach):
    """(drag, lift) coefficient of the command module at a Mach number, in shares of the hypersonic ones; table I."""
    return APOLLO_DRAG(mach) * _DRAG_PER_HYPERSONIC, APOLLO_LIFT(mach) * _LIFT_PER_HYPERSONIC
