"""Time of one case-step of the lane kernels, one case at a time and in vectors, for two models.

    python -m tests.benchmarks.lanes

The measurement is that of `mc-engine bench`, on inputs that stay the same whatever becomes of the campaign files.
"""

import platform
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import mc_engine
from mc_engine.campaign.loading import load_campaign
from mc_engine.flight.kernel import registers
from mc_engine.model import load_model
from mc_engine.studies.lane_speed import Flight, campaign_flight, measure

HERE = Path(__file__).resolve().parent
ROCKET = Path(mc_engine.__file__).parent / "documentation" / "tutorial" / "sounding_rocket"
WIDTHS = (1, registers().doubles, 2 * registers().doubles)
LONG = 12  # repeats of the long flights


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
    return replace(campaign_flight(load_campaign(ROCKET), n_cases), title="sounding rocket of the tutorial")


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
        timing = measure(cases, WIDTHS, repeats)
        for width, ns in timing.ns.items():
            print(
                f"{cases.title}, width {width:2d}: {ns:6.1f} ns per case-step, "
                f"{timing.ratio(width):5.2f} times width 1 (ready in {timing.ready_s[width]:.1f} s)"
            )


if __name__ == "__main__":
    main()
