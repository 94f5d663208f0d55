"""Error against time of the engine's methods, and what they lose of energy and angular momentum in a day.

    python tests/benchmarks/work_precision.py

Prints the tables of the README.  The error is the largest distance of the end positions of 16 dispersed cases from a
reference flight in 80-bit numbers; the time is that of a case, in one thread, as many at a time as in a run,
shortest of some turns.
"""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))  # as a script, only this folder would be there

import numpy as np  # noqa: E402

from mc_engine.physics.constants import MU_EARTH  # noqa: E402
from tests.benchmarks.peer_codes import engine, problems  # noqa: E402
from tests.benchmarks.peer_codes.contest import Contest, Result, hold  # noqa: E402
from tests.benchmarks.peers import METHODS, machine  # noqa: E402

PROBLEMS = ("orbit", "transfer", "ballistic", "lifting")
DRIFTS = (("RK4", 30.0), ("RK4", 10.0), ("RK4", 1.0), ("DOP853", 1e-8), ("DOP853", 1e-11), ("DOP853", 1e-14),
          ("ABM12", 50.0), ("GJ9", 75.0), ("GJ9", 54.0), ("GJ9", 30.0))  # fmt: skip
TARGETS = (100.0, 10.0, 1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-5)  # m


def row(key: str, target: float, turns: int = 5) -> list[Result]:
    """Each method at one error."""
    problem = problems.BY_KEY[key]()
    entrants = [engine.entrant(problem, method) for method in METHODS if method in problem.models]
    return hold(Contest(problem.title, entrants, target), turns, all_cores=False)


def cell(results: list[Result], method: str) -> str:
    """Time and setting of a method; the fastest in bold."""
    one = next((r for r in results if r.form.startswith(f"{method},")), None)
    if one is None:
        return ""
    if one.time_us is None:
        return "not reached"
    value = one.setting.split(" ", 1)[1]
    text = f"{one.time_us:.2f} ({value})"
    return f"**{text}**" if one.times_engine == 1.0 else text


def energy(s: np.ndarray) -> np.ndarray:
    """Specific energy [J/kg] of states [6, n]."""
    return 0.5 * (s[3:] ** 2).sum(axis=0) - MU_EARTH / np.sqrt((s[:3] ** 2).sum(axis=0))


def angular_momentum(s: np.ndarray) -> np.ndarray:
    """Size of the specific angular momentum [m^2/s] of states [6, n]."""
    return np.sqrt((np.cross(s[:3], s[3:], axis=0) ** 2).sum(axis=0))


def drift(method: str, value: float, n: int = 16) -> tuple[float, float]:
    """Largest relative change of energy and of angular momentum over a two-body day, in 80-bit numbers."""
    problem = problems.two_body().shortened(n)
    end = engine.kernel_flight(problem, method, value, 8)().astype(np.longdouble)
    first = problem.first.astype(np.longdouble)
    return tuple(float(abs(f(end) / f(first) - 1.0).max()) for f in (energy, angular_momentum))


def main() -> None:
    print(machine())
    print("\n| problem | error | " + " | ".join(METHODS) + " |\n|---|---|" + "---|" * len(METHODS))
    for key in PROBLEMS:
        for target in TARGETS:
            results = row(key, target)
            cells = " | ".join(cell(results, method) for method in METHODS)
            print(f"| {problems.BY_KEY[key]().title} | {target:g} m | {cells} |", flush=True)
    print("\n| two-body day | energy | angular momentum |\n|---|---|---|")
    for method, value in DRIFTS:
        setting = f"tolerance {value:g}" if method == "DOP853" else f"step {value:g} s"
        print("| {}, {} | {:.1e} | {:.1e} |".format(method, setting, *drift(method, value)))


if __name__ == "__main__":
    main()
