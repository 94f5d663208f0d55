"""Vehicles: mass, reference area, coefficients, nose radius, and where each number comes from.

Coefficients are the constant ones of hypersonic continuum flow.  `vehicle = "given"` flies the numbers of the
campaign file instead.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Vehicle:
    """mass [kg], area [m^2], drag and lift coefficient at trim, trim angle of attack [deg], nose radius [m]."""

    mass: float
    area: float
    drag_coefficient: float
    lift_coefficient: float
    trim_angle: float
    nose_radius: float
    source: str


VEHICLES = {
    "apollo": Vehicle(
        mass=5498.22,
        area=12.017,
        drag_coefficient=1.2569,
        lift_coefficient=0.40815,
        trim_angle=20.0,
        nose_radius=3.05,
        source="J. Szelc, NASA TM X-69555 (1969); nose: the 10-ft equivalent sphere; trim angle this study's",
    ),
    "soyuz": Vehicle(
        mass=2900.0,
        area=3.80,
        drag_coefficient=1.26,
        lift_coefficient=0.0,
        trim_angle=0.0,
        nose_radius=2.235,
        source="a descent module of 2.2 m diameter in its ballistic mode, spinning: this study's round numbers",
    ),
    "sample_return": Vehicle(
        mass=45.8,
        area=0.51887,
        drag_coefficient=1.4828,
        lift_coefficient=0.0,
        trim_angle=0.0,
        nose_radius=0.22,
        source="Stardust: R. A. Mitcheltree et al., AIAA 97-2304; mass about 46 kg",
    ),
    "warhead": Vehicle(
        mass=1000.0,
        area=1.0,
        drag_coefficient=1.0,
        lift_coefficient=0.0,
        trim_angle=0.0,
        nose_radius=0.1,
        source="ballistic coefficient 1000 kg/m^2 of the Allen-Eggers example; nose radius this study's",
    ),
}
