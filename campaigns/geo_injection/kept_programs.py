"""The programs that are kept beside the campaign, in `programs/`: those of the source's sequences.

`python -m campaigns.geo_injection.kept_programs` designs them again and writes them.
"""

import numpy as np

from campaigns.geo_injection.design import KEPT, new_design
from campaigns.geo_injection.program import to_text
from campaigns.geo_injection.sequence import Sequence
from mc_engine.durable_file import make_folder, write_durably

_ORBITS = 6_578_137.0, 42_164_137.0  # parking and final radius [m]
_ENGINE = 20_000.0, 6.14, 22_170.0  # thrust [N], mass flow [kg/s], mass [kg]
# tables 2, 3 and 7: semi-major axis [km], eccentricity, plane change so far [deg]
_TWO, _THREE = ((24_588.0, 0.7142, 2.5),), ((8733.1, 0.2456, 1.5), (24_438.0, 0.7247, 3.5))


def _sequence(burns: int, degrees: float, orbits: tuple[tuple[float, float, float], ...] = ()) -> Sequence:
    between = tuple((1e3 * a, e, float(np.radians(change))) for a, e, change in orbits)
    method = "staged" if orbits else "optimal"
    return Sequence(method, burns, float(np.radians(degrees)), 0.0, *_ORBITS, *_ENGINE, between)


SEQUENCES = {
    "two_burns_28_5": _sequence(2, 28.5),
    "two_burns_55": _sequence(2, 55.0),
    "two_burns_planar": _sequence(2, 0.0),
    "three_burns_28_5": _sequence(3, 28.5),
    "three_burns_planar": _sequence(3, 0.0),
    "two_burns_28_5_staged": _sequence(2, 28.5, _TWO),
    "three_burns_28_5_staged": _sequence(3, 28.5, _THREE),
}


def write_all() -> None:
    """Design every sequence and write its file."""
    make_folder(KEPT)
    for name, sequence in SEQUENCES.items():
        write_durably(KEPT / f"{name}.toml", to_text(new_design(sequence)).encode())


if __name__ == "__main__":
    write_all()
