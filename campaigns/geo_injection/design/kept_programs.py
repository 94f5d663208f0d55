"""The programs that are kept beside the campaign, in `programs/`: those of the source's sequences.

`python -m campaigns.geo_injection.design.kept_programs` designs them again and writes them.
"""

import numpy as np

from campaigns.geo_injection.design.program import to_text
from campaigns.geo_injection.design.programs import KEPT, new_design
from campaigns.geo_injection.design.sequence import Sequence, source_orbits

PARKING_RADIUS, FINAL_RADIUS = 6_578_137.0, 42_164_137.0  # m: eq. (12) of the source
# N, kg/s, kg: the mass by eq. (12); thrust and mass flow are not printed and follow from tables 2 to 8
THRUST, MASS_FLOW, MASS = 20_000.0, 6.14, 22_170.0


def _sequence(burns: int, degrees: float, method: str = "optimal") -> Sequence:
    """A sequence of the source: tables 2 to 8, with the burns, plane change [deg] and method given."""
    change = float(np.radians(degrees))
    between = source_orbits(burns, change) if method == "staged" else ()
    return Sequence(
        method=method, burns=burns, initial_inclination=change, final_inclination=0.0,
        parking_radius=PARKING_RADIUS, final_radius=FINAL_RADIUS, thrust=THRUST, mass_flow=MASS_FLOW, mass=MASS,
        between=between,
    )  # fmt: skip


SEQUENCES = {
    "two_burns_28_5": _sequence(2, 28.5),
    "two_burns_55": _sequence(2, 55.0),
    "two_burns_planar": _sequence(2, 0.0),
    "three_burns_28_5": _sequence(3, 28.5),
    "three_burns_planar": _sequence(3, 0.0),
    "two_burns_28_5_staged": _sequence(2, 28.5, "staged"),
    "three_burns_28_5_staged": _sequence(3, 28.5, "staged"),
}


def write_all() -> None:
    """Design every sequence of the source and write its file, SI."""
    KEPT.mkdir(exist_ok=True)
    for name, sequence in SEQUENCES.items():
        (KEPT / f"{name}.toml").write_text(to_text(new_design(sequence)), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    write_all()
