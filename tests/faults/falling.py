"""The smallest campaign, whose kernel is compiled in no time: a fall of 2 s, whose speed is its model's factor."""

import os
import subprocess
import sys
from pathlib import Path

_LEFT_OUT = ("PYTHONDONTWRITEBYTECODE", "PYTHONSAFEPATH")
ENVIRONMENT = {name: value for name, value in os.environ.items() if name not in _LEFT_OUT}
ENGINE = str(Path(__file__).resolve().parents[2])

MODEL = """from collections import namedtuple

from mc_engine.lanes import physics
from mc_engine.model import Field, FixedStep, Model, Parameter

FACTOR = 1.0
State = namedtuple("State", "v")


def prepare(inputs, settings, refusals):
    refusals.add(inputs.gravity > 9.5, "too heavy")
    return vars(inputs)


@physics
def initial(p, o):
    return State(0.0)


@physics
def rhs(t, s, m, p, o):
    return State(FACTOR * p.gravity)


@physics
def observe(t, s, m, p, o):
    return State(s.v)


@physics
def evaluate(t, s, m, p, o, best, when):
    return State(s.v)


MODEL = Model(
    name="fall", title="Fall", source="", settings=(), kernel_parameters=namedtuple("Parameters", "gravity"),
    parameters=(Parameter("gravity_m_s2", "m/s^2", "acceleration", 9.0),),
    states=(Field("v_m_s", "m/s", "speed"),), quantities=(Field("v_m_s", "m/s", "speed"),),
    metrics=(Field("speed_m_s", "m/s", "speed"),), clock=FixedStep(0.5, 2.0), prepare=prepare,
    initial=initial, rhs=rhs, observe=observe, evaluate=evaluate,
)
"""
CAMPAIGN = """[campaign]
model = "model.py"
cases = 16
design = "mc"
seed = 1
[dispersion.gravity_m_s2]
dist = "uniform"
lower = 8.0
upper = 10.0
source = "measured"
"""


def falling(folder, model=MODEL, **files):
    """The campaign in `folder`; files : texts of the modules beside the model."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = {"campaign.toml": CAMPAIGN, "model.py": model, **{f"{name}.py": text for name, text in files.items()}}
    for name, text in texts.items():
        (folder / name).write_text(text)
    return folder


def engine(*words, cwd, **environment):
    """The command line in a process that reads and writes bytecode, as Python does by itself; its end and its words."""
    command = [sys.executable, "-m", "mc_engine", *map(str, words)]
    path = os.pathsep.join([environment.pop("PYTHONPATH", ""), ENGINE]).strip(os.pathsep)
    known = {**ENVIRONMENT, **environment, "PYTHONPATH": path}
    return subprocess.run(command, cwd=cwd, env=known, capture_output=True, text=True, check=False, timeout=300)


def table(run):
    """The bytes of all parts of a run."""
    return b"".join(path.read_bytes() for path in sorted((run / "cases").glob("*.parquet")))
