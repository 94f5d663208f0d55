"""Vehicles: mass, reference area, coefficients, nose radius, and where each number comes from.

Coefficients are those of hypersonic continuum flow, constant but where a table over the Mach number is published.
`vehicle = "given"` flies the numbers of the campaign file instead.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Vehicle:
    """mass [kg], area [m^2], drag and lift coefficient at trim, trim angle of attack [deg], nose radius [m].

    over_mach : rows (Mach number, drag coefficient, lift coefficient), rising up to the hypersonic ones above
    """

    mass: float
    area: float
    drag_coefficient: float
    lift_coefficient: float
    trim_angle: float
    nose_radius: float
    source: str
    over_mach: tuple[tuple[float, float, float], ...] = ()


# Trimmed coefficients of the command module: C. A. Graves, J. C. Harpold, Apollo experience report: mission planning
# for Apollo entry, NASA TN D-6725 (1972), table I.
APOLLO_OVER_MACH = (
    (0.4, 0.85300, 0.24465),
    (0.7, 0.98542, 0.26325),
    (0.9, 1.10652, 0.32074),
    (1.1, 1.1697, 0.49373),
    (1.2, 1.1560, 0.47853),
    (1.35, 1.2788, 0.56282),
    (1.65, 1.2657, 0.55002),
    (2.0, 1.2721, 0.53247),
    (2.4, 1.2412, 0.50740),
    (3.0, 1.2167, 0.47883),
    (4.0, 1.2148, 0.44147),
    (10.0, 1.2246, 0.42856),
    (29.5, 1.2891, 0.38773),
)

VEHICLES = {
    "apollo": Vehicle(
        mass=5498.22,
        area=12.017,
        drag_coefficient=1.2891,
        lift_coefficient=0.38773,
        trim_angle=20.0,
        nose_radius=3.05,
        source="coefficients NASA TN D-6725 (1972), table I; mass: J. Szelc, NASA TM X-69555 (1969); nose: the 10-ft "
        "equivalent sphere; trim angle this study's",
        over_mach=APOLLO_OVER_MACH,
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
