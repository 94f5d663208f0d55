"""The smallest campaign, whose kernel is compiled in no time: a fall of 2 s, whose speed is its model's factor."""

import os
import subprocess
import sys
from pathlib import Path

_LEFT_OUT = ("PYTHONDONTWRITEBYTECODE", "PYTHONSAFEPATH")
ENVIRONMENT = {name: value for name, value in os.environ.items() if name not in _LEFT_OUT}
ENGINE = str(Path(__file__).resolve().parents[2])

MODEL = """from mc_engine.lanes import physics
from mc_engine.model import FixedStep, Parameter, at_end, inputs, metrics, model, outputs, states

FACTOR = 1.0
Inputs = inputs(gravity_m_s2=Parameter(9.0, "acceleration"))
State = states(v_m_s="speed")
Outputs = outputs(v_m_s="speed")
Metrics = metrics(speed_m_s=at_end("v_m_s", "speed"))


def prepare(inputs, settings, refusals):
    refusals.add(inputs.gravity > 9.5, "too heavy")
    return vars(inputs)


@physics
def initial():
    return State(v=0.0)


@physics
def rhs(t, p):
    return State(v=FACTOR * p.gravity)


@physics
def observe(s):
    return Outputs(v=s.v)


MODEL = model(
    name="fall", title="Fall", inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
    clock=FixedStep(0.5, 2.0), prepare=prepare, initial=initial, rhs=rhs, observe=observe,
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
