"""The programs that are kept beside the campaign, in `programs/`: those of the source's sequences.

`python -m campaigns.geo_injection.design.kept_programs` designs them again and writes them.
"""

from functools import partial

import numpy as np

from campaigns.geo_injection.design.program import to_text
from campaigns.geo_injection.design.programs import KEPT, new_design
from campaigns.geo_injection.design.sequence import Sequence, source_orbits

# m, kg: eq. (12) of the source;  N, kg/s: not printed, they follow from tables 2 to 8
_SOURCE = partial(
    Sequence, final_inclination=0.0, parking_radius=6_578_137.0, final_radius=42_164_137.0, thrust=20_000.0,
    mass_flow=6.14, mass=22_170.0,
)  # fmt: skip


def _sequence(burns: int, degrees: float, method: str = "optimal") -> Sequence:
    """A sequence of the source: tables 2 to 8, with the burns, plane change [deg] and method given."""
    change = float(np.radians(degrees))
    between = source_orbits(burns, change) if method == "staged" else ()
    return _SOURCE(method=method, burns=burns, initial_inclination=change, between=between)


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
