"""The engine beside what a user would pick instead: same physics, same error, one run.

    python tests/benchmarks/peers.py            # the table of the README, and peers.parquet
    python tests/benchmarks/peers.py --short    # one error, few turns: whether everybody flies to the same place
    python tests/benchmarks/peers.py --only orbit

Needs the extra `bench`; a peer that is not installed is named as such.  The error is the largest distance of the end
positions from a reference flight in 80-bit numbers.  Only flights are timed: neither compiling nor preparing inputs.
"""

import argparse
import importlib
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))  # as a script, only this folder would be there

import pyarrow as pa  # noqa: E402
import pyarrow.parquet as pq  # noqa: E402

from mc_engine.flight.kernel import registers  # noqa: E402
from tests.benchmarks.lanes import processor  # noqa: E402
from tests.benchmarks.peer_codes import engine, handwritten, problems, scipy_peer  # noqa: E402
from tests.benchmarks.peer_codes.contest import Contest, Result, hold  # noqa: E402
from tests.benchmarks.peer_codes.entrant import Entrant  # noqa: E402
from tests.benchmarks.peer_codes.problems import Problem  # noqa: E402

TABLE = Path(__file__).with_suffix(".parquet")
CODES = {"heyoka": "taylor", "nyx": "nyx", "Basilisk": "basilisk"}  # peer -> file in peer_codes
TARGETS = (1.0, 1e-3, 1e-5)  # m
METHODS = ("RK4", "ABM10", "ABM12", "GJ8", "GJ9", "GJ10", "DOP853", "TP86", "DP54")


def peer(name: str):
    """The module of a peer; None if its package is not installed."""
    try:
        return importlib.import_module(f"tests.benchmarks.peer_codes.{CODES[name]}")
    except ImportError:
        return None


def _absent(*names: str) -> tuple[str, ...]:
    return tuple(name for name in names if peer(name) is None)


def _fixed_step(problem: Problem, step: float) -> Contest:
    """RK4 with one step: the engine in two registers, one, and one case at a time, and the lanes written by hand."""
    widths = 2 * registers().doubles, registers().doubles, 1
    entrants = [engine.entrant(problem, "RK4", width, (step,)) for width in widths]
    entrants += handwritten.entrants(problem, step)
    if problem.rate is None:
        entrants.append(scipy_peer.entrant(problem))
    missing = () if handwritten.compilers() else ("C++ by hand",)
    return Contest(f"{problem.title}, RK4, {step:g} s", entrants, None, missing)


def _equal_error(problem: Problem, target: float) -> Contest:
    """Every method of the engine, one case at a time too, heyoka and scipy, at equal error."""
    entrants = [engine.entrant(problem, method) for method in METHODS if method in problem.models]
    entrants.append(engine.entrant(problem, "DOP853", 1))
    if taylor := peer("heyoka"):
        entrants += taylor.entrants(problem)
    entrants.append(scipy_peer.entrant(problem))
    return Contest(problem.title, entrants, target, _absent("heyoka"))


def _basilisk() -> Contest:
    problem, step = problems.oblate(), 10.0
    entrants = [engine.entrant(problem, "RK4", ladder=(step,))]
    if code := peer("Basilisk"):
        entrants += code.entrants(problem, step)
    return Contest(f"{problem.title}, RK4, {step:g} s", entrants, None, _absent("Basilisk"))


def _nyx(target: float | None) -> Contest:
    """With the same step, or at equal error."""
    problem, step = problems.two_body(), 10.0
    methods, code = ("RK4",) if target is None else ("RK4", "ABM12", "GJ8", "GJ9", "GJ10", "DOP853"), peer("nyx")
    entrants: list[Entrant] = []
    for method in methods:
        entrants.append(engine.entrant(problem, method, 0, (step,) if target is None else ()))
    if code and target is None:
        entrants.append(code.entrant(problem, "RK4", (step,)))
    elif code:
        entrants += [code.entrant(problem, "DP78"), code.entrant(problem, "RK89")]
    taylor = peer("heyoka") if target else None
    if taylor:
        entrants += taylor.entrants(problem)
    title = problem.title if target else f"{problem.title}, RK4, {step:g} s"
    return Contest(title, entrants, target, _absent("nyx", "heyoka") if target else _absent("nyx"))


def contests(short: bool) -> list[Contest]:
    """All of them, or one of each kind."""
    held = [_fixed_step(problems.orbit(), 10.0), _fixed_step(problems.satellite(), 0.01)]
    flights = ["orbit", "transfer", "ballistic", "lifting"]
    held += [_equal_error(problems.BY_KEY[key](), target) for key in flights for target in TARGETS[short : 3 - short]]
    return [*held, _basilisk(), _nyx(None), _nyx(1e-3), *([] if short else [_nyx(1e-5)])]


def _number(value: float | None, form: str = ".2f") -> str:
    return "" if value is None else format(value, form)


def _times(result: Result) -> str:
    if result.times_engine is None:
        return result.note
    return format(result.times_engine, ".2f" if result.times_engine < 100 else ".0f")


def lines(results: list[Result]) -> list[str]:
    """The table in Markdown."""
    head = "| problem | at | code | form | setting | error | µs a case | all cores | times the engine |"
    text = [head, "|---|---|---|---|---|---|---|---|---|"]
    for r in results:
        error = "" if r.error is None else f"{r.error:.1e} {r.unit}".removesuffix(" 1")
        cells = [r.problem, r.at, r.peer, r.form, r.setting, error]
        text.append(f"| {' | '.join([*cells, _number(r.time_us), _number(r.all_cores_us), _times(r)])} |")
    return text


def write(results: list[Result], path: Path) -> None:
    """The table as Parquet, the machine in its metadata."""
    table = pa.Table.from_pylist([vars(r) for r in results])
    pq.write_table(table.replace_schema_metadata({"machine": machine()}), path)


def machine() -> str:
    """Processor and number of cores."""
    return f"{processor()}, {os.cpu_count()} cores"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--short", action="store_true", help="one error, few turns, no file")
    parser.add_argument("--only", metavar="WORD", help="problems with this word in their title, one thread, no file")
    parser.add_argument("--turns", type=int, default=40, help="of each entrant in each contest")
    arguments = parser.parse_args()
    part = arguments.short or arguments.only
    print(machine(), flush=True)
    results: list[Result] = []
    for contest in contests(arguments.short):
        if arguments.only and arguments.only not in contest.title:
            continue
        held = hold(contest, 2 if arguments.short else arguments.turns, all_cores=not part)
        print("\n".join(lines(held)[2 if results else 0 :]), flush=True)
        results += held
    if not part:
        write(results, TABLE)


if __name__ == "__main__":
    main()
