"""A falling ball with drag as a compiled model, a Python function of one case and of many, a program and an FMU."""

import json
import re

import numpy as np
import pytest

from mc_engine import load_campaign, run
from reports import write_reports
from tests.mc_engine.flight.ball_fmu import fmu_campaign
from tests.mc_engine.flight.falling_ball import CAMPAIGN, assert_alike, program_campaign, python_campaign

pytest.importorskip("fmpy", reason='the extra "fmu" is missing')
CASES = 40
METRICS = ["fall_time_s", "impact_speed_m_s"]
MODEL = """
from mc_engine.lanes import physics
from mc_engine.model import AdaptiveStep, Event, Parameter, at_end, inputs, metrics, model, outputs, states

Inputs = inputs(
    mass_kg=Parameter(10.0, "mass", low=0.1),
    drag_area_m2=Parameter(0.02, "drag area", low=0.0),
    height_m=Parameter(500.0, "height", low=0.0),
)
State = states(speed_m_s="speed", altitude_m="altitude")
Outputs = outputs(speed_m_s="speed")
Metrics = metrics(
    fall_time_s=at_end("t_s", "time to the ground"), impact_speed_m_s=at_end("speed_m_s", "speed at the ground")
)


@physics
def initial(p):
    return State(speed=0.0, altitude=p.height)


@physics
def rhs(s, p):
    return State(speed=9.81 - p.drag_area * 1.225 / 2.0 / p.mass * s.speed * s.speed, altitude=-s.speed)


@physics
def altitude(s):
    return s.altitude


@physics
def observe(s):
    return Outputs(speed=s.speed)


MODEL = model(
    name="ball", title="A falling ball with drag", inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
    clock=AdaptiveStep(until=100.0, rtol=1e-14, atol=1e-13), initial=initial, rhs=rhs, observe=observe,
    events={"ground": Event(altitude, "falling", "stop")},
)
"""


def compiled_campaign(folder, cases=100):
    """A campaign of the compiled model in a new folder."""
    folder.mkdir()
    (folder / "model.py").write_text(MODEL)
    (folder / "campaign.toml").write_text(CAMPAIGN.format(flies='model = "model.py"', cases=cases))
    return folder / "campaign.toml"


KINDS = {
    "compiled": compiled_campaign,
    "case": python_campaign,
    "batch": lambda folder, cases: python_campaign(folder, cases, options="batch=True,"),
    "program": program_campaign,
    "fmu": fmu_campaign,
}


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """The run of each kind with its report, by name."""
    folder, runs = tmp_path_factory.mktemp("kinds"), {}
    for kind, campaign in KINDS.items():
        file = campaign(folder / kind, cases=CASES)
        file.write_text(file.read_text() + "\n[sensitivity]\ncases = 32\n")
        store = run(load_campaign(file), folder / kind / "run", workers=2)
        write_reports(store.path, ("json",))
        report = json.loads((store.path / "report.json").read_text())
        for record in report["metrics"]:  # only the steps of a compiled model can be made finer
            assert (record.pop("integration_change") is None) == (kind != "compiled")
        runs[kind] = store.cases(), report
    return runs


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "case"])
def test_every_kind_gives_the_same_metrics_verdicts_indices_and_report(flown, kind):
    (ours, our_report), (theirs, their_report) = flown["case"], flown[kind]
    assert list(ours["mass_kg"]) == list(theirs["mass_kg"])  # bit for bit: recorded is flown
    assert set(theirs["status"]) == {"ok"}
    assert len(theirs) == CASES
    for metric in METRICS:
        assert np.allclose(ours[metric], theirs[metric], rtol=1e-12, atol=0.0)
    for part in ("counts", "requirements", "metrics", "worst", "warnings"):
        assert_alike(our_report[part], their_report[part], rel=1e-9)
    assert_alike(*(contributors(report) for report in (our_report, their_report)), rel=1e-9)
    same = [title for title in printed(our_report) if title != "Provenance"]
    if kind == "fmu":  # whose history goes on after the impact
        same.remove("Time histories")
    if kind == "compiled":  # whose error of integration is told
        same.remove("Convergence")
    assert len(same) > 8
    assert printed(our_report).keys() == printed(their_report).keys()
    for title in same:
        assert printed(our_report)[title] == printed(their_report)[title]


def printed(report):
    """The texts and tables of each section, without the number of flights for contributors, and the tables' own."""
    text = re.sub(r"From \d+ cases", "From cases", json.dumps(report["sections"]))
    text = re.sub(r'"number": \d+', '"number": 0', text)
    return {section["title"]: section["blocks"] for section in json.loads(text)}


def contributors(report):
    """Those that every kind has.  Only a function or a program may draw random numbers, and has these as one more."""
    drawn = [record for record in report["contributors"] if record["input"] == "random draws"]
    assert [record["total"] for record in drawn] == [0.0] * len(drawn)
    return [record for record in report["contributors"] if record not in drawn]
