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
from mc_engine.lanes import physics
from mc_engine.model import Field, FixedStep, Parameter, inputs, metrics, model, outputs, states

Inputs = inputs(push=Parameter(1.0, "push", unit=""))
State = states(x=Field("place", unit=""))
Outputs = outputs(x=Field("place", unit=""))
Metrics = metrics(**{f"metric_{i}": Field("a number", unit="") for i in range(40)})

@physics
def initial(p):
    return State(x=p.push)

@physics
def rhs(s):
    return State(x=-s.x)

@physics
def observe(s):
    return Outputs(x=s.x)

@physics
def evaluate(s):
    return Metrics(METRICS)

MODEL = model(
    name="wide", title="A row of forty metrics", inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
    clock=FixedStep(0.5, 1.0), initial=initial, rhs=rhs, observe=observe, evaluate=evaluate,
)
""".replace("METRICS", ", ".join(f"metric_{i}=s.x * {i + 1}.0" for i in range(40)))

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
