"""Memory of the main process over a long run: bounded, and hardly growing with the number of cases."""

import json
import subprocess
import sys

import pytest
from trapped import ENVIRONMENT

MIB = 2**20

RUN = """
import json, sys
from pathlib import Path
import psutil
from mc_engine import load_campaign
from mc_engine.runner import runner

process, samples = psutil.Process(), []
def note(done, total, failed):
    samples.append((done, process.memory_info().rss))
cases, backend, folder = int(sys.argv[1]), sys.argv[2], Path(sys.argv[3])
campaign = load_campaign(folder / "campaign.toml", cases=cases)
runner.run(campaign, folder / "run", workers=2, chunk=5_000, backend=backend, progress=note)
print(json.dumps(samples))
"""

MODEL = """
from collections import namedtuple
from mc_engine.lanes import physics
from mc_engine.model import Field, FixedStep, Model, Parameter

NAMES = [f"metric_{i}" for i in range(40)]
State, Parameters, Quantities = (namedtuple(name, field) for name, field in (("S", "x"), ("P", "push"), ("Q", "x")))
Metrics = namedtuple("Metrics", NAMES)

@physics
def initial(p, o):
    return State(p.push)

@physics
def rhs(t, s, m, p, o):
    return State(-s.x)

@physics
def observe(t, s, m, p, o):
    return Quantities(s.x)

@physics
def evaluate(t, s, m, p, o, best, when):
    return Metrics(*METRICS)

MODEL = Model(
    name="wide", title="A row of forty metrics", source="", parameters=(Parameter("push", "", "push", 1.0),),
    settings=(), states=(Field("x", "", "place"),), quantities=(Field("x", "", "place"),),
    metrics=tuple(Field(name, "", "a number") for name in NAMES), clock=FixedStep(0.5, 1.0),
    kernel_parameters=Parameters, initial=initial, rhs=rhs, observe=observe, evaluate=evaluate,
)
""".replace("*METRICS", ", ".join(f"s.x * {i + 1}.0" for i in range(40)))

CAMPAIGN = """
[campaign]
model = "model.py"
cases = 1000
design = "mc"
seed = 3
[dispersion.push]
dist = "normal"
sigma = 1.0
"""


def resident(folder, cases, backend):
    """(cases done, bytes resident) of the main process after each part."""
    (folder / "model.py").write_text(MODEL)
    (folder / "campaign.toml").write_text(CAMPAIGN)
    command = [sys.executable, "-c", RUN, str(cases), backend, str(folder)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=ENVIRONMENT)
    return json.loads(done.stdout.splitlines()[-1])


def check(samples, settled, record_property):
    """Never a GiB; and after `settled` cases at most a MiB for every hundred thousand more."""
    later = [(done, size) for done, size in samples if done >= settled]
    begin, end = (sum(size for _, size in some) / len(some) for some in (later[:5], later[-5:]))
    growth = (end - begin) / (later[-1][0] - later[0][0]) * 1e5
    record_property("cases", samples[-1][0])
    record_property("MiB at most", max(size for _, size in samples) / MIB)
    record_property("MiB more per 1e5 cases", growth / MIB)
    assert max(size for _, size in samples) <= 1024 * MIB
    assert growth <= 1.0 * MIB


@pytest.mark.parametrize(
    ("backend", "cases", "settled"),
    [
        ("loky", 150_000, 50_000),
        pytest.param("loky", 1_000_000, 200_000, marks=pytest.mark.slow),
        pytest.param("threading", 1_000_000, 200_000, marks=pytest.mark.slow),
    ],
)
def test_the_main_process_grows_by_less_than_a_mib_over_a_hundred_thousand_cases(
    tmp_path, backend, cases, settled, record_property
):
    check(resident(tmp_path, cases, backend), settled, record_property)
