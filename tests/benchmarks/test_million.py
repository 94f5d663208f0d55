"""A short form of the million low orbits: the orbits are right, memory is bounded, the figures are printed."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mc_engine import load_campaign
from mc_engine.flight.chunks import chunk_size, fly_cases
from tests.benchmarks.leo.model import AXES
from tests.benchmarks.million import CAMPAIGN, line, measured

CASES = 70_000


def test_a_million_cases_come_in_parts_of_tens_of_thousands():
    assert all(10_000 <= chunk_size(1_000_000, workers) <= 99_999 for workers in (1, 2, 8))


def test_memory_is_bounded_and_every_part_of_the_time_is_told():
    result = measured(CASES, 2)
    print(line(CASES, 2, result))
    assert result["largest_part"] == chunk_size(CASES, 2)
    assert result["peak_mib"] < 1024.0
    assert min(result[part] for part in ("sampling", "kernel", "conversion", "writing")) > 0.0


def gravity(t, s):
    """Point mass and J2, written another way: the gradient of the potential by its polynomial."""
    r = np.linalg.norm(s[:3])
    mu, j, u = 3.986004418e14, 1.08262668e-3 * 6378137.0**2 / r**2, (s[2] / r) ** 2
    pull = np.array([1.0 + 1.5 * j * (1.0 - 5.0 * u)] * 2 + [1.0 + 1.5 * j * (3.0 - 5.0 * u)])
    return np.concatenate([s[3:], -mu / r**3 * pull * s[:3]])


def test_the_orbits_are_those_of_another_integrator():
    cases = fly_cases(load_campaign(CAMPAIGN), np.arange(64))
    speed = (3.986004418e14 / 7000e3) ** 0.5
    first = np.array([7000e3, 0.0, 0.0, 0.0, 0.5 * speed, 0.75**0.5 * speed])
    for case in (0, 17, 63):
        start = first + [cases[f"d{axis}"][case] for axis in AXES]
        twin = solve_ivp(gravity, (0.0, 5400.0), start, "DOP853", rtol=1e-12, atol=1e-9).y[:, -1]
        flown = np.array([cases[f"end_{axis}"][case] for axis in AXES])
        assert flown[:3] == pytest.approx(twin[:3], abs=0.02)
        assert flown[3:] == pytest.approx(twin[3:], abs=2e-5)
