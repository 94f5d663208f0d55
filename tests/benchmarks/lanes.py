"""Time of one case-step of the lane kernels, one case at a time and in vectors, for two models.

    python -m tests.benchmarks.lanes

Only the kernel call is timed; compiling, or loading the compiled kernel, is printed apart.  The widths take
turns at short flights and the shortest time of each counts, so that other work on the machine disturbs little.
"""

import platform
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

import mc_engine
from mc_engine import flight
from mc_engine.campaign import load_campaign
from mc_engine.cases import case_table, full_inputs
from mc_engine.kernel import build_kernel
from mc_engine.kernel_parts import settings_class
from mc_engine.model import Model, load_model

HERE = Path(__file__).resolve().parent
ROCKET = Path(mc_engine.__file__).parent / "documentation" / "tutorial" / "sounding_rocket"
WIDTHS = (1, 8, 16)
LONG = 12  # repeats of the long flights


@dataclass(frozen=True)
class Flight:
    """Cases of one model that all fly with the same settings."""

    title: str
    model: Model
    folder: Path | None
    inputs: flight.Inputs
    n_cases: int


@dataclass
class Timing:
    """Shortest time of a case-step [ns] and time [s] to compile or load the kernel, by width."""

    ns: dict[int, float] = field(default_factory=dict)
    ready_s: dict[int, float] = field(default_factory=dict)

    def ratio(self, width: int = 8) -> float:
        """How many times longer a step takes one case at a time."""
        return self.ns[1] / self.ns[width]


def orbit(n_cases: int = 256) -> Flight:
    """Low orbits with J2 and drag, 400 steps."""
    rng = np.random.default_rng(1)
    model = load_model("orbit_model.py", HERE)
    inputs: dict[str, Any] = {parameter.name: parameter.default for parameter in model.parameters}
    inputs |= {"altitude_km": 400.0 + rng.normal(size=n_cases), "climb_m_s": 5800.0 + rng.normal(size=n_cases)}
    return Flight("two-body + J2 + drag orbit", model, HERE, inputs, n_cases)


def deorbit(n_cases: int = 256) -> Flight:
    """The de-orbit campaign with the errors of its file and continuous control: about 707 steps to entry."""
    rng = np.random.default_rng(1)
    model = load_model("campaigns.deorbit")
    inputs: dict[str, Any] = {item.name: item.default for item in (*model.parameters, *model.settings)}
    inputs |= {"ve_pct": rng.normal(size=n_cases) * 20 / 3, "oe_pct": rng.normal(size=n_cases) * 5}
    return Flight("de-orbit campaign", model, None, inputs, n_cases)


def flexible(n_cases: int = 16, **changes: Any) -> Flight:
    """The flexible satellite without thrusters, inertia within ±10 %, 300 s in steps of 10 ms."""
    rng = np.random.default_rng(1)
    model = load_model("campaigns.flexible_satellite")
    inputs: dict[str, Any] = {item.name: item.default for item in (*model.parameters, *model.settings)} | changes
    inputs |= {f"inertia_{axis}_factor": rng.uniform(0.9, 1.1, n_cases) for axis in "xyz"}
    return Flight("flexible satellite", model, None, inputs, n_cases)


def flexible_pulses(n_cases: int = 16) -> Flight:
    """The same with the thrusters of Table 8 and their modulators, in steps of 5 ms."""
    return replace(flexible(n_cases, actuator="pwpf", step_s=0.005), title="flexible satellite, pulses")


def sounding_rocket(n_cases: int = 64) -> Flight:
    """The tutorial's campaign, from the rail to the ground: noisy control in every step, three switches, a stop."""
    campaign = load_campaign(ROCKET)
    inputs = full_inputs(campaign, case_table(campaign, np.arange(n_cases)))
    return Flight("sounding rocket of the tutorial", campaign.model, ROCKET, inputs, n_cases)


def caller(cases: Flight, width: int) -> Callable[[], float]:
    """Function that flies all cases once and returns the time of a case-step [ns], that of the kernel call alone."""
    ready = flight.prepare(cases.model, cases.inputs, cases.n_cases)
    settings = np.ascontiguousarray(ready.settings[0])
    grid = flight.grid_of(cases.model.clock, settings_class(cases.model)(*settings))
    end_time, status = np.empty(cases.n_cases), np.empty(cases.n_cases)
    states = np.empty((len(cases.model.states), cases.n_cases))
    metrics = np.empty((len(cases.model.metrics), cases.n_cases))
    numbers, key, history = np.arange(float(cases.n_cases)), np.uint64(1), np.empty((0, 0))
    kernel = build_kernel(cases.model, cases.folder, width)

    def fly() -> float:
        start = time.perf_counter()
        kernel(ready.parameters, settings, key, numbers, *grid, end_time, status, states, metrics, history, 1)
        elapsed = time.perf_counter() - start
        return elapsed / np.ceil(end_time / grid[1]).sum() * 1e9

    return fly


def measure(cases: Flight, widths: Iterable[int] = WIDTHS, repeats: int = 60) -> Timing:
    """Timing of the kernels of several widths on the same cases."""
    timing = Timing()
    flights = {}
    for width in widths:
        start = time.perf_counter()
        flights[width] = caller(cases, width)
        flights[width]()
        timing.ready_s[width] = time.perf_counter() - start
    for _ in range(repeats):
        for width, fly in flights.items():
            timing.ns[width] = min(timing.ns.get(width, np.inf), fly())
    return timing


def processor() -> str:
    """The processor's name as its maker and as the compiler calls it."""
    from llvmlite import binding

    about = Path("/proc/cpuinfo")
    lines = about.read_text().splitlines() if about.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{names[0] if names else platform.processor()} ({binding.get_host_cpu_name()})"


def main() -> None:
    print(f"{processor()}, one thread")
    for flown, repeats in (
        (orbit, 60),
        (deorbit, 60),
        (flexible, LONG),
        (flexible_pulses, LONG),
        (sounding_rocket, LONG),
    ):
        cases = flown()
        timing = measure(cases, repeats=repeats)
        for width, ns in timing.ns.items():
            print(
                f"{cases.title}, width {width:2d}: {ns:6.1f} ns per case-step, "
                f"{timing.ratio(width):5.2f} times width 1 (ready in {timing.ready_s[width]:.1f} s)"
            )


if __name__ == "__main__":
    main()
