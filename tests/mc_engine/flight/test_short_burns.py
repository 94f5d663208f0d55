"""A burn between two times, far shorter than the steps of the coast around it: it is not lost without a word."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mc_engine.campaign.loading import load_campaign
from mc_engine.errors import CampaignError
from mc_engine.flight.contract_flight import faults
from mc_engine.flight.flight import chosen_cases, chosen_history
from mc_engine.flight.kernel import finer
from mc_engine.model import AdaptiveStep
from mc_engine.runner import runner
from mc_engine.runner.summary import integration_line
from reports.run.flown import Flown
from reports.sections.headline import warnings

MODEL = '''"""A body on a spring pushed for two seconds: by rates that look at the time, or from event to event."""

from collections import namedtuple

from mc_engine.lanes import physics, where
from mc_engine.model import AdaptiveStep, Event, Parameter, at_end, inputs, metrics, model, outputs, states

Inputs = inputs(start_s=Parameter(500.0, "start of the push"), push_m_s2=Parameter(1.0, "push"))
State = states(x_m="x", v_m_s="v")
Memory = namedtuple("Memory", "on", defaults=(0.0,))
Outputs = outputs(x_m="place", v_m_s="speed")
Metrics = metrics(last_v_m_s=at_end("v_m_s", "speed at the end"))


@physics
def initial():
    return State(x=1000.0, v=0.0)


@physics
def rhs(t, s, m, p):
    on = ON
    return State(x=s.v, v=p.push * on - 1e-4 * s.x)


@physics
def begin(t, p):
    return t - p.start


@physics
def cease(t, p):
    return t - p.start - 2.0


@physics
def ground(s):
    return s.x


@physics
def switch(s, m, hit):
    return s, Memory(on=where(hit.begin > 0.5, 1.0, where(hit.cease > 0.5, 0.0, m.on)))


@physics
def observe(s):
    return Outputs(x=s.x, v=s.v)


MODEL = model(name="push", title="A push", inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
              memory=Memory, clock=AdaptiveStep(until=2000.0), initial=initial, rhs=rhs, observe=observe, EVENTS)
'''
CAMPAIGN = """[campaign]
title = "A push"
model = "model.py"
cases = 100
design = "mc"
seed = 3

[dispersion]
start_s = { dist = "normal", sigma = 100.0 }
push_m_s2 = { dist = "normal", sigma = 0.01 }

[requirement]
speed = { metric = "last_v_m_s", at_most = 100.0, share = 0.5, confidence = 0.9 }
"""
BY_TIME = "where((t >= p.start) & (t < p.start + 2.0), 1.0, 0.0)", ""
BY_EVENTS = (
    "m.on",
    'switch=switch, events={"begin": Event(begin, "rising", "switch"), "cease": Event(cease, "rising", "switch")}',
)


def push(folder, on, events, clock="AdaptiveStep(until=2000.0)"):
    folder.mkdir()
    text = (
        MODEL.replace("= ON", f"= {on}")
        .replace("EVENTS", events)
        .replace("clock=AdaptiveStep(until=2000.0)", f"clock={clock}")
    )
    (folder / "model.py").write_text(text)
    (folder / "campaign.toml").write_text(CAMPAIGN)
    return load_campaign(folder / "campaign.toml")


@pytest.fixture(scope="module")
def by_time(tmp_path_factory):
    return push(tmp_path_factory.mktemp("time") / "push", *BY_TIME)


@pytest.fixture(scope="module")
def by_events(tmp_path_factory):
    return push(tmp_path_factory.mktemp("events") / "push", *BY_EVENTS)


def speed(start, push):
    """At 2000 s, in closed form: of the spring alone, and of the push."""
    w = 0.01
    pushed = push / w * (np.sin(w * (2000.0 - start)) - np.sin(w * (1998.0 - start)))
    return -1000.0 * w * np.sin(w * 2000.0) + pushed


def test_short_steps_see_the_burn_that_long_ones_pass_over(by_time, by_events):
    inputs = {"start_s": np.linspace(300.0, 700.0, 40), "push_m_s2": np.linspace(0.9, 1.1, 40)}
    true = speed(*inputs.values())
    passed = chosen_cases(by_time.model, inputs)["last_v_m_s"]
    assert (abs(passed - true) > 1.0).sum() > 10
    short = replace(by_time.model, clock=AdaptiveStep(until=2000.0, longest_step=1.5))
    assert chosen_cases(short, inputs)["last_v_m_s"] == pytest.approx(true, rel=1e-7)
    assert chosen_cases(by_events.model, inputs)["last_v_m_s"] == pytest.approx(true, rel=1e-7)
    t = chosen_history(short, {}, rows=100_000)["t_s"]
    assert np.diff(t).max() <= 1.5 < np.diff(chosen_history(by_events.model, {}, rows=2)["t_s"]).max()


def test_check_tells_of_a_burn_that_steps_pass_over_and_not_of_one_by_events(by_time, by_events):
    [sentence] = faults(by_time)
    assert sentence.startswith("steps are too long: ")
    assert "of the first 32 cases end elsewhere with a tenth of the tolerances and steps of at most 1 s; " in sentence
    assert faults(by_events) == []
    short = replace(by_time.model, clock=AdaptiveStep(until=2000.0, longest_step=1.5))
    assert faults(replace(by_time, model=short)) == []


def test_a_run_and_its_report_tell_of_what_steps_have_passed_over(by_time, by_events, tmp_path):
    run = runner.run(load_campaign(by_time.directory / "campaign.toml", cases=2000), tmp_path / "run")
    [warning] = [sentence for sentence in warnings(Flown(run, "")) if "integration" in sentence]
    assert warning.startswith("With a tenth of the tolerances and at least 2,000 steps, ")
    assert integration_line(run).endswith(
        "at least 2,000 steps, last_v_m_s would change by more than a standard deviation"
    )
    sound = runner.run(load_campaign(by_events.directory / "campaign.toml", cases=2000), tmp_path / "sound")
    assert integration_line(sound) == ""


def test_a_longest_step_may_be_a_setting_and_a_finer_clock_keeps_a_shorter_one():
    settings, clock = SimpleNamespace(step=1e-3), AdaptiveStep(until=100.0, longest_step="step")
    assert finer(clock, 100.0).longest_step(settings) == 1e-3
    assert finer(replace(clock, longest_step=np.inf), 100.0).longest_step(settings) == 0.05


@pytest.mark.parametrize("longest", ["0.0", "-1.0", "'no_such_setting'"])
def test_a_longest_step_that_is_none_is_refused(tmp_path, longest):
    with pytest.raises(CampaignError, match="longest_step"):
        push(tmp_path / "push", *BY_TIME, clock=f"AdaptiveStep(until=2000.0, longest_step={longest})")


def test_check_is_silent_where_the_stopping_event_makes_a_state_zero_but_for_rounding(tmp_path):
    events = BY_EVENTS[1].replace("events={", 'events={"ground": Event(ground, "falling", "stop"), ')
    fallen = push(tmp_path / "push", BY_EVENTS[0], events)
    assert not [sentence for sentence in faults(fallen) if sentence.startswith("steps are too long")]
