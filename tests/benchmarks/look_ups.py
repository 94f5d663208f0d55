"""Curves, surfaces and the functions on vectors: nanoseconds for one value, in lanes, the least of many runs.

python tests/benchmarks/look_ups.py
"""

import sys
import time
from collections import namedtuple
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "mc_engine" / "physics"))

from read_numbers import _kernel as look_up_kernel
from records import _kernel as record_kernel

from mc_engine.lanes import physics
from mc_engine.lanes.kernel_data import gathered
from mc_engine.physics import air, earth_frames, rotations
from mc_engine.physics.curves import curve, surface
from mc_engine.physics.vectors import Vector

N = 4096  # arguments, which a core's nearest memory holds
TURN = namedtuple("Turn", "q0 q1 q2 q3 x y z")
RNG = np.random.default_rng(1)


def least(call, runs=60, calls=10):
    """Least time [ns] for one of N values."""
    call()
    spent = []
    for _ in range(runs):
        begin = time.perf_counter()
        for _ in range(calls):
            call()
        spent.append(time.perf_counter() - begin)
    return min(spent) / calls / N * 1e9


def look_up(function, ranges, width):
    """Time of a curve or surface at random arguments."""
    columns = np.array([RNG.uniform(low, high, N) for low, high in ranges])
    kernel, blocks = look_up_kernel(function, len(columns), width)
    data, out = gathered(blocks.blocks), np.empty(N)
    return least(lambda: kernel(columns, out, data))


def on_records(function, record, n_results, width):
    """Time of a function of a record of random numbers."""
    rows = RNG.normal(size=(len(record._fields), N))
    kernel, out = record_kernel(function, record, width, False), np.empty((n_results, N))
    return least(lambda: kernel(rows, out))


@physics
def turned(r):
    return rotations.transformed(rotations.Quaternion(r.q0, r.q1, r.q2, r.q3), Vector(r.x, r.y, r.z))


@physics
def standard_air(r):
    return air.us76_air(50e3 + 20e3 * r.x)


@physics
def geodetic(r):
    return earth_frames.ecef_to_geodetic(Vector(6e6 * r.x, 6e6 * r.y, 6e6 * r.z))


def main():
    """Print the table."""
    spacings = {
        "30 points, even": np.linspace(0.0, 10.0, 30),
        "30 points, random": np.sort(RNG.uniform(0.0, 10.0, 30)),
        "300 points, random": np.sort(RNG.uniform(0.0, 10.0, 300)),
        "30 points over 5 decades": np.geomspace(1e-4, 10.0, 30),
    }
    print(f"{'ns a value':40} {'8 lanes':>8} {'16 lanes':>8}")

    def show(name, measure):
        print(f"{name:40} {measure(8):8.2f} {measure(16):8.2f}", flush=True)

    for name, x in spacings.items():
        for kind in ("linear", "cubic", "nearest") if name == "30 points, even" else ("linear", "cubic"):
            f = curve(x=x, y=np.sin(x), kind=kind)
            show(f"curve, {kind}, {name}", lambda width, f=f, x=x: look_up(f, [(x[0], x[-1])], width))
    for sizes in ((12, 8), (60, 40)):
        x, y = (np.sort(RNG.uniform(0.0, 1.0, size)) for size in sizes)
        for kind in ("linear", "cubic"):
            f = surface(x=x, y=y, z=RNG.normal(size=sizes), kind=kind)
            ranges = [(x[0], x[-1]), (y[0], y[-1])]
            show(f"surface, {kind}, {sizes[0]} by {sizes[1]}", lambda width, f=f, r=ranges: look_up(f, r, width))
    show("vector by a quaternion", lambda width: on_records(turned, TURN, 3, width))
    show("us76_air", lambda width: on_records(standard_air, Vector, 4, width))
    show("ecef_to_geodetic", lambda width: on_records(geodetic, Vector, 3, width))


if __name__ == "__main__":
    main()
