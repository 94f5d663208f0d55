"""A falling ball with drag as each kind of simulator, under the same campaign file, and a comparison of its reports."""

import shutil
import subprocess

import pytest

CAMPAIGN = """
[campaign]
{flies}
cases = {cases}
design = "mc"
seed = 3

[dispersion.mass_kg]
dist = "normal"
sigma = 0.5

[dispersion.height_m]
dist = "uniform"
half_range = 50.0

[requirement.soft]
metric = "impact_speed_m_s"
at_most = 90.0
share = 0.9
confidence = 0.9

[retention.histories]
first = 2
"""

PYTHON = """
{imports}
import numpy as np
import pandas as pd

from mc_engine import Parameter, Refuse, Simulator
from mc_engine.model import inputs, metrics, outputs


def fly(inputs, case):
{fault}
    k = inputs["drag_area_m2"] * 1.225 / 2 / inputs["mass_kg"]
    limit = np.sqrt(9.81 / k)
    time = np.arccosh(np.exp(k * inputs["height_m"])) * limit / 9.81
    metrics = {{"fall_time_s": time, "impact_speed_m_s": limit * np.tanh(9.81 * time / limit)}}
    if np.size(time) > 1:
        return metrics
    t = np.linspace(0.0, float(np.ravel(time)[0]), 50)
    return metrics, pd.DataFrame({{"t_s": t, "speed_m_s": limit * np.tanh(9.81 * t / limit)}})


SIMULATOR = Simulator(
    title="A falling ball with drag",
    parameters=inputs(
        mass_kg=Parameter(10.0, "mass", low=0.1),
        drag_area_m2=Parameter(0.02, "drag area", low=0.0),
        height_m=Parameter(500.0, "height", low=0.0),
    ),
    metrics=metrics(fall_time_s="time to the ground", impact_speed_m_s="speed at the ground"),
    outputs=outputs(speed_m_s="speed"),
    fly=fly,
    {options}
)
"""

C = r"""
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
int main(int argc, char **argv) {
  double mass, area, height;
  long id;
  FILE *file = fopen(argv[1], "r");
  if (!file || fscanf(file, "%ld %lf %lf %lf", &id, &mass, &area, &height) != 4) return 2;
  fclose(file);
  FAULT
  double k = area * 1.225 / 2 / mass, limit = sqrt(9.81 / k), time = acosh(exp(k * height)) * limit / 9.81;
  file = fopen(argv[2], "w");
  fprintf(file, "{\"time\": %.17g, \"speed\": %.17g, ", time, limit * tanh(9.81 * time / limit));
  fprintf(file, "\"used\": {\"mass_kg\": %.17g, \"drag_area_m2\": %.17g, \"height_m\": %.17g}}", MASS, area, height);
  fclose(file);
  file = fopen("history.csv", "w");
  fprintf(file, "time,speed_m_s\n0,0\n%.17g,%.17g\n", time, limit * tanh(9.81 * time / limit));
  fclose(file);
  return 0;
}
"""

PROGRAM = """
[simulator]
command = ["./fall", "case.txt", "{folder}/result.json"]
input = { "case.txt" = "case.txt.j2" }
result = "result.json"
history = "history.csv"
echo = "used"
time_limit_s = 60.0
memory_limit_mib = 300
title = "A falling ball with drag"
[simulator.parameter]
mass_kg = { default = 10.0, low = 0.1, description = "mass" }
drag_area_m2 = { default = 0.02, low = 0.0, unit = "m^2", description = "drag area" }
height_m = { default = 500.0, low = 0.0, description = "height" }
[simulator.metric]
fall_time_s = { description = "time to the ground", read = "time" }
impact_speed_m_s = { description = "speed at the ground", read = "speed" }
[simulator.output]
speed_m_s = { description = "speed" }
"""


def python_campaign(folder, cases=100, fault="", options="", imports=""):
    """A campaign of a Python function in a new folder.  fault : lines at the start of `fly`."""
    folder.mkdir()
    lines = "\n".join(f"    {line}" for line in fault.splitlines())
    (folder / "sim.py").write_text(PYTHON.format(fault=lines, options=options, imports=imports))
    (folder / "campaign.toml").write_text(CAMPAIGN.format(flies='simulator = "sim.py"', cases=cases))
    return folder / "campaign.toml"


def noting_campaign(kind, folder, cases, seconds, starts):
    """A campaign, of a "function" or a "program", whose cases take so long and write their numbers into a file."""
    if kind == "function":
        fault = (
            f"import time\ntime.sleep({seconds})\nwith open({str(starts)!r}, 'a') as file: print(case.id, file=file)"
        )
        return python_campaign(folder, cases=cases, fault=fault)
    note = f'file = fopen("{starts}", "a"); fprintf(file, "%ld\\n", id); fclose(file);'
    return program_campaign(folder, cases=cases, fault=f"usleep({round(1e6 * seconds)}); {note}")


def program_campaign(folder, cases=100, fault="", mass="mass", limit_s=60.0):
    """A campaign of a C program, compiled in a new folder.  mass : what it says that it used."""
    folder.mkdir()
    (folder / "fall.c").write_text(C.replace("FAULT", fault).replace("MASS", mass))
    compiler = shutil.which("cc") or shutil.which("gcc")
    subprocess.run([compiler, "-O1", "-o", folder / "fall", folder / "fall.c", "-lm"], check=True)
    names = " ".join(f"{{{{ {name} }}}}" for name in ("case_id", "mass_kg", "drag_area_m2", "height_m"))
    (folder / "case.txt.j2").write_text(names + "\n")
    (folder / "campaign.toml").write_text(
        CAMPAIGN.format(flies="", cases=cases) + PROGRAM.replace("60.0", f"{limit_s}")
    )
    return folder / "campaign.toml"


def assert_alike(ours, theirs, rel):
    """Two trees of a report: equal words, and numbers equal to `rel`."""
    assert type(ours) is type(theirs)
    if isinstance(ours, dict):
        assert ours.keys() == theirs.keys()
        ours, theirs = [*ours.values()], [*theirs.values()]
    if isinstance(ours, list):
        assert len(ours) == len(theirs)
        for one, other in zip(ours, theirs, strict=True):
            assert_alike(one, other, rel)
    elif isinstance(ours, float):
        assert ours == pytest.approx(theirs, rel=rel, abs=rel)
    else:
        assert ours == theirs
