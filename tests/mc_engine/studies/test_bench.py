"""What `bench` times is the flight of `run`, and it says how fast in words that compare."""

import re
import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.columns import END_TIME
from mc_engine.campaign.loading import load_campaign
from mc_engine.campaign.search import SHIPPED
from mc_engine.command_line.commands import app
from mc_engine.flight.flight import bound_flight, fly
from mc_engine.model import AdaptiveStep, FixedStep
from mc_engine.studies.lane_speed import MethodTiming, Timing, _first_within, _in_numbers, _Trials, compare_methods
from tests.mc_engine.lanes.models import long_coast


@pytest.fixture(scope="module")
def minimal():
    return load_campaign("minimal")


@pytest.mark.parametrize("width", [1, pytest.param(16, marks=pytest.mark.slow)])
def test_the_timed_kernel_flies_the_cases_of_a_run(minimal, width):
    ids = np.arange(21)
    inputs = full_inputs(minimal, case_table(minimal, ids))
    kernel, ends, _ = bound_flight(minimal.model, inputs, ids, minimal.seed, width=width, folder=minimal.directory)
    kernel()
    assert ends.size % width == 0
    wanted = fly(minimal.model, inputs, ids, minimal.seed, folder=minimal.directory)[END_TIME]
    np.testing.assert_array_equal(ends, np.resize(wanted, ends.size))


def test_as_many_cases_are_timed_as_asked_for_where_the_design_has_them(monkeypatch, tmp_path):
    flown = []

    def timed(flight, widths, repeats):
        flown.append(flight.n_cases)
        return Timing()

    monkeypatch.setattr("mc_engine.studies.lane_speed.measure", timed)
    text = (SHIPPED / "minimal" / "campaign.toml").read_text()
    shutil.copytree(SHIPPED / "minimal", tmp_path / "few")
    for design, said in (("mc", ""), ("lhs", "--cases 40: few has 20 cases by its design; all fly\n")):
        few = re.sub(r"cases = \d+", "cases = 20", re.sub(r"(?m)^design = .*", f'design = "{design}"', text), count=1)
        (tmp_path / "few" / "campaign.toml").write_text(few)
        done = CliRunner().invoke(app, ["bench", str(tmp_path / "few"), "--cases", "40"])
        assert (done.exit_code, done.stderr) == (0, said), done.output
    assert flown == [40, 20]


def test_bench_prints_cases_a_second_nanoseconds_a_step_and_the_ratio():
    done = CliRunner().invoke(app, ["bench", "minimal", "--repeats", "3"])
    assert done.exit_code == 0, done.output
    head, alone, one, two = done.output.splitlines()
    assert head == "minimal: 256 cases a flight, the fastest of 3, one thread"
    rates = [int(re.search(r"([\d,]+) cases/s", line)[1].replace(",", "")) for line in (alone, one, two)]
    steps = [float(re.search(r"([\d.]+) ns a step", line)[1]) for line in (alone, one, two)]
    factors = [float(re.search(r"([\d.]+) times", line)[1]) for line in (one, two)]
    assert factors == pytest.approx([rates[1] / rates[0], rates[2] / rates[0]], rel=1e-2)
    # the same flights: a case is as many steps in each build
    assert np.multiply(rates, steps) == pytest.approx(rates[0] * steps[0], rel=0.05)
    assert two.endswith(" times as fast (as `run`)")


def errors(campaign, clocks, true):
    """Of the metrics of 16 cases by each clock, against those by the clock `true`."""
    ids = np.arange(16)
    inputs = full_inputs(campaign, case_table(campaign, ids))

    def metrics(clock):
        model = replace(campaign.model, clock=clock)
        columns = fly(model, inputs, ids, campaign.seed, folder=campaign.directory)
        return np.array([columns[metric.name] for metric in model.metrics])

    exact = metrics(true)
    return [float((abs(metrics(clock) - exact).max(axis=1) / abs(exact).max(axis=1)).max()) for clock in clocks]


def test_methods_are_compared_at_the_error_of_the_models_own(minimal):
    own, *others = compare_methods(minimal, 16, 1)
    assert own.clock.method == "rk4"
    assert [one.case_s for one in others] == sorted(one.case_s for one in others)
    assert {"abm8", "abm12", "dop853", "tp86", "dp54"} <= {one.clock.method for one in others}
    # rates of states are not declared
    assert not [one for one in others if one.clock.method.startswith("gj")]
    found = errors(minimal, [one.clock for one in (own, *others)], replace(own.clock, step=own.clock.step / 50.0))
    assert found == pytest.approx([one.error for one in (own, *others)], rel=0.05)
    assert max(found) <= 1.05 * own.error


def test_methods_are_compared_where_the_models_own_chooses_its_steps(minimal):
    clock = AdaptiveStep(1e9, 1e-8, (1e-2, 1e-2, 1e-5, 1e-5))
    chooses = replace(minimal, model=replace(minimal.model, clock=clock))
    own, *others = compare_methods(chooses, 16, 1)
    assert own.clock == clock
    assert {"rk4", "abm8", "abm12", "tp86", "dp54"} <= {one.clock.method for one in others}
    assert "dop853" not in {one.clock.method for one in others}
    exact = AdaptiveStep(1e9, 1e-13, (1e-8, 1e-8, 1e-11, 1e-11))
    found = errors(chooses, [one.clock for one in (own, *others)], exact)
    assert found == pytest.approx([one.error for one in (own, *others)], rel=0.05)
    assert max(found) <= 1.05 * own.error


def test_the_metric_with_the_largest_error_is_named_and_one_that_is_rounding_is_left_out():
    trials = object.__new__(_Trials)
    units = {"speed_m_s": ("m/s", 1.0), "ground_km": ("km", 1e3), "height_m": ("m", 1.0), "crossing_s": ("s", 1.0)}
    metrics = [SimpleNamespace(name=name, unit=unit, si_factor=factor) for name, (unit, factor) in units.items()]
    states = [SimpleNamespace(name="z_km", unit="km", si_factor=1e3)]
    trials.cases = SimpleNamespace(model=SimpleNamespace(metrics=metrics, states=states))
    trials._scales = np.array([4e5])  # m
    nothing = np.full(2, np.nan)
    trials._true = {"status": ["ok"] * 2, "speed_m_s": np.array([50.0, 40.0]), "ground_km": np.array([4e-11, -3e-10]),
                    "height_m": np.array([2e-6, 1e-6]), "crossing_s": nothing}  # fmt: skip
    trials._least = trials._sizes_of_rounding()
    trials._doubt = trials._errors(trials._true)
    flown = {**trials._true, "speed_m_s": np.array([50.0, 40.1]), "ground_km": np.array([2e-11, 0.0])}
    trials._flown = lambda clock: flown
    assert trials.largest_error(None) == (pytest.approx(0.002), "speed_m_s")
    flown["height_m"] = np.array([1e-6, 1e-6])
    assert trials.largest_error(None) == (pytest.approx(0.5), "height_m")
    assert trials.error(None) == pytest.approx(0.5)
    flown["crossing_s"] = np.array([np.nan, 1.0])
    assert trials.largest_error(None) == (np.inf, "crossing_s")
    flown |= {"crossing_s": nothing, "ground_km": nothing}
    assert trials.largest_error(None) == (np.inf, "ground_km")


# all perigees of an orbit are alike: rounding chooses the lowest
TURNS = """
from mc_engine.lanes import physics, sqrt
from mc_engine.model import (FixedStep, Parameter, at_end, inputs, maximum_of, metrics, model, outputs, states,
                             time_of_minimum)

State = states(x_m="x", y_m="y", vx_m_s="vx", vy_m_s="vy")
Outputs = outputs(r_m="radius")


@physics
def initial(p):
    return State(x=1.0, y=0.0, vx=0.0, vy=p.speed)


@physics
def rhs(s):
    r2 = s.x * s.x + s.y * s.y
    g = -1.0 / (r2 * sqrt(r2))
    return State(x=s.vx, y=s.vy, vx=g * s.x, vy=g * s.y)


@physics
def observe(s):
    return Outputs(r=sqrt(s.x * s.x + s.y * s.y))


MODEL = model(
    name="turns", title="Turns", inputs=inputs(speed_m_s=Parameter(1.05, "speed")), states=State, outputs=Outputs,
    metrics=metrics(r_m=at_end("r_m"), lowest_s=time_of_minimum("r_m"), top_m=maximum_of("r_m")), initial=initial,
    rhs=rhs, observe=observe, clock=FixedStep(0.05, 40.0, method="abm9"),
)
"""
CASES = """
[campaign]
model = "model.py"
cases = 16
design = "mc"
seed = 1

[dispersion.speed_m_s]
dist = "uniform"
half_range = 0.01
"""


def test_a_time_among_several_that_are_alike_is_left_out_and_named(tmp_path, monkeypatch):
    (tmp_path / "model.py").write_text(TURNS)
    (tmp_path / "campaign.toml").write_text(CASES)
    campaign = load_campaign(tmp_path / "campaign.toml")
    own, *others = compare_methods(campaign, 16, 1)
    assert own.left_out == ("lowest_s",)
    assert own.error < 1e-8
    assert others
    assert max(one.error for one in others) <= own.error
    monkeypatch.setattr("mc_engine.studies.lane_speed.compare_methods", lambda *arguments: [own])
    done = CliRunner().invoke(app, ["bench", str(tmp_path / "campaign.toml"), "--methods"])
    assert done.output.splitlines()[1].endswith(f"(the model's own; {own.metric}; without lowest_s)")


def test_an_error_of_the_reference_itself_does_not_count_where_tolerances_do_not_limit_its_steps(tmp_path):
    """The reference finds the time of a flat top less exactly than a fixed step, whatever its tolerance."""
    turn = TURNS.replace("40.0", "5.0").replace("lowest_s=time_of_minimum", "top_s=time_of_maximum")
    (tmp_path / "model.py").write_text(turn.replace("time_of_minimum)", "time_of_maximum)"))
    (tmp_path / "campaign.toml").write_text(CASES)
    own, *others = compare_methods(load_campaign(tmp_path / "campaign.toml"), 16, 1)
    assert own.metric != "top_s"
    assert {"abm12", "tp86"} <= {one.clock.method for one in others}


def test_bench_prints_a_line_for_each_method(monkeypatch):
    timings = [
        MethodTiming(FixedStep(20.0, 86400.0), 2.5e-8, 60e-6, "speed_m_s"),
        MethodTiming(FixedStep(86400.0 / 642, 86400.0, method="gj8"), 2.9e-9, 5e-6),
        MethodTiming(AdaptiveStep(86400.0, 1.8e-8), 2.2e-8, 12e-6),
    ]
    monkeypatch.setattr("mc_engine.studies.lane_speed.compare_methods", lambda *arguments: timings)
    done = CliRunner().invoke(app, ["bench", "minimal", "--methods"])
    assert done.output.splitlines() == [
        "minimal: methods at the error of the model's own, one thread",
        "  rk4     steps of 20 s              error 2.5e-08      60.00 µs a case  (the model's own; speed_m_s)",
        "  gj8     steps of 134.6 s           error 2.9e-09       5.00 µs a case, 12.00 times as fast",
        "  dop853  tolerance 1.8e-08          error 2.2e-08      12.00 µs a case,  5.00 times as fast",
        f"the fastest: clock=FixedStep(step={86400.0 / 642}, until=86400.0, method='gj8')",
    ]
    timings[1:] = [MethodTiming(AdaptiveStep(100.0, 1.8e-8, (1e-2, 1e-5)), 2.2e-8, 12e-6)]
    last = CliRunner().invoke(app, ["bench", "minimal", "--methods"]).output.splitlines()[-1]
    assert last == "the fastest: clock=AdaptiveStep(until=100.0, rtol=1.8e-08, atol=(0.01, 1e-05))"
    timings[0] = replace(timings[0], case_s=11e-6)
    last = CliRunner().invoke(app, ["bench", "minimal", "--methods"]).output.splitlines()[-1]
    assert last == "the fastest: the model's own"


class Errors:
    """In place of flights: errors by clock."""

    def __init__(self, errors):
        self.errors = errors

    def error(self, clock):
        return self.errors[clock]


@pytest.mark.parametrize(
    ("errors", "found"),
    [([5.0, 2.0, 0.9, 0.8, 0.1], 2), ([5.0, 0.5, 3.0, 0.9, 0.8], 3), ([5.0, 4.0, 3.0, 0.7], 3), ([5.0, 4.0], None)],
)
def test_a_step_that_is_exact_by_chance_is_not_taken(errors, found):
    first = _first_within(Errors(errors), iter(range(len(errors))), 1.0)
    assert first == (None if found is None else (found, errors[found]))


def test_samples_of_the_control_stay_where_they_are():
    trials = object.__new__(_Trials)
    trials.own, trials.flight_s, trials.period = FixedStep(0.1, 30.0, 5), 30.0, 0.5
    grids = list(trials._grids())
    assert [every for _, every in grids] == [1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 17, 20]
    assert [step * every for step, every in grids] == pytest.approx([0.5] * len(grids))
    trials._scales = np.array([2.0])
    assert trials._adaptive("dop853", 1e-3) == AdaptiveStep(30.0, 1e-3, (2e-3,), 0.5, "dop853")


@pytest.mark.parametrize("clock", [FixedStep(0.1, 30.0, method="abm9"), AdaptiveStep(30.0)])
def test_fixed_steps_are_compared_for_a_model_with_phases_that_takes_fixed_steps(clock):
    trials = object.__new__(_Trials)
    trials.own, trials.flight_s, trials.period, trials._scales = clock, 30.0, np.inf, np.array([2.0])
    trials.cases = SimpleNamespace(model=long_coast.MODEL)
    methods = {next(ladder).method for ladder in trials.ladders()}
    fixed = {"rk4", "abm8", "abm10", "abm11", "abm12", "dop853"} if isinstance(clock, FixedStep) else set()
    assert methods == {"tp86", "dp54"} | fixed


def test_a_control_that_the_settings_leave_but_its_first_sample_is_flown_by_other_clocks():
    clock = replace(long_coast.MODEL.clock, control_period=lambda _: np.inf)
    numbers = _in_numbers(clock, None)
    assert replace(long_coast.MODEL, clock=numbers).clock.control_period > clock.until
