"""The line of a model at which a number stopped being finite, as `check` and `replay` name it."""

import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mc_engine
from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.loading import load_campaign
from mc_engine.flight.chunks import NOMINAL_NOISE
from mc_engine.flight.contract import breaches
from mc_engine.flight.contract_flight import faults
from mc_engine.flight.flight import fly, fly_interpreted
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.flight.lost_numbers import first_lost
from mc_engine.runner import runner
from mc_engine.status import STATUS_NAME
from tests.mc_engine.model.mistaken_campaign import campaign_with, with_evaluate
from tests.mc_engine.store.small_run import ENVIRONMENT

ROCKET = Path(mc_engine.__file__).parent / "documentation" / "tutorial" / "sounding_rocket"
DRAG = "    drag = 0.5 * rho * m.drag_area * sqrt(ux * ux + uz * uz)\n"
BY_MACH = """    speed = sqrt(ux * ux + uz * uz)
    mach = sqrt(speed - {slowest}) / 340.0
    drag = 0.5 * rho * m.drag_area * speed * FACTOR(mach)
"""
BY_CURVE = (
    ("import STANDARD_GRAVITY\n", "import STANDARD_GRAVITY\nfrom mc_engine.physics.curves import curve\n\n"
     "FACTOR = curve(x=[0.0, 1.0, 5.0], y=[1.0, 1.6, 1.0])  # of the drag by Mach number\n"),
)  # fmt: skip
SHORT = ("until=2000.0", "until=8.0")
ADAPTIVE = ("FixedStep(step=0.05, until=8.0)", "AdaptiveStep(until=8.0, rtol=1e-8, control_period=0.5)")
ADAPTED = ("    FixedStep,\n", "    AdaptiveStep,\n")
# the functions take the time and the settings, too
SIGNATURES = (("def rhs(s, m, p)", "def rhs(t, s, m, p, o)"), ("def control(s,", "def control(t, s,"),
              ("def switch(s,", "def switch(t, s,"), ("def altitude(s)", "def altitude(t, s)"))  # fmt: skip


def rocket(folder, *edits):
    """The tutorial's campaign, with each (text, other text) of its model exchanged."""
    shutil.copytree(ROCKET, folder, ignore=shutil.ignore_patterns("__pycache__"), dirs_exist_ok=True)
    text = (ROCKET / "model.py").read_text()
    for old, new in (*SIGNATURES, *edits):
        assert old in text, old
        text = text.replace(old, new)
    (folder / "model.py").write_text(text)
    return load_campaign(folder / "campaign.toml", cases=8)


def line_of(folder, text, file="model.py"):
    source = (folder / file).read_text()
    return 1 + source[: source.index(text)].count("\n")


def test_an_infinite_state_at_the_start_is_told_without_a_time(tmp_path):
    edit = ("vx=dv * sin(p.pitch_error)", "vx=dv / sin(0.0 * p.pitch_error)")
    (sentence,) = breaches(campaign_with(tmp_path, edit))
    assert ': 100 / 0 is infinite; so `initial` gives inf for the state of "vx" at the start' in sentence


def lost(campaign):
    """The sentence on the nominal case."""
    return first_lost(campaign.model, campaign.nominal, NOMINAL_NOISE, campaign.seed, "the nominal case")


def only(sentences):
    assert len(sentences) == 1, sentences
    assert "\n" not in sentences[0]
    return sentences[0]


def test_check_names_the_line_of_a_mach_number_that_no_slow_rocket_has(tmp_path):
    campaign = rocket(tmp_path, *BY_CURVE, (DRAG, BY_MACH.format(slowest=200.0)))
    line = line_of(tmp_path, "    mach = ")
    assert only(breaches(campaign)).startswith(
        f"model.py, line {line}: `mach = sqrt(speed - 200.0) / 340.0`: the square root of -176.3"
    )


def test_check_and_replay_name_the_line_of_a_number_that_is_lost_in_flight(tmp_path):
    model = tmp_path / "rocket"
    slowest = "10.0 * t * t"
    campaign = rocket(model, *BY_CURVE, (DRAG, BY_MACH.format(slowest=slowest)), SHORT)
    assert breaches(campaign) == []
    sentence = (
        f"model.py, line {line_of(model, '    mach = ')}: `mach = sqrt(speed - {slowest}) / 340.0`: the square root"
    )
    found = only(faults(campaign))
    assert found.startswith(sentence)
    assert re.search(r"; \d of the first 8 cases end not-finite$", found)
    done = mc_engine_says(tmp_path, "run", "rocket", "--cases", "8", "--no-report", "--out", "run")
    case = int(mc_engine.open_store(tmp_path / "run").cases().query("status == 'not-finite'")["case_id"].iloc[0])
    replayed = mc_engine_says(tmp_path, "replay", "run", str(case))
    assert replayed[0].startswith(sentence)
    assert f"case {case})" in replayed[0]
    assert replayed[1] == f"case {case}: every stored number has the same bits"
    assert done[0].startswith("run ")


def mc_engine_says(folder, *words):
    done = subprocess.run(
        [sys.executable, "-m", "mc_engine", *words], cwd=folder, env=ENVIRONMENT, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.parametrize("through", ["log(low)", "pow(low, 0.5)", "atan2(1.0, low)", "low**3"])
def test_the_line_is_named_whatever_the_lost_number_goes_through_on_its_way(through, tmp_path):
    line, below = "    low = sqrt(s.x + 6.9e6)", "    g = -MU_EARTH"
    campaign = campaign_with(tmp_path, (below, f"{line}\n    late = {through}\n{below}"),
                             ("vy=g * s.y)", "vy=g * s.y + 0.0 * late)"),
                             ("import cos,", "import atan2, log, pow, cos,"))  # fmt: skip
    place = f"model.py, line {line_of(tmp_path, line)}: `{line.strip()}`: "
    assert lost(campaign).startswith(f"{place}the square root of -")


HEATING = "from mc_engine.physics.heating import sutton_graves\n"
PUSH = "    force = m.burning * thrust_of(p)\n"
HELD, SWITCHED = "    return Memory(nozzle=nozzle, burning=m", "    return s, Memory(nozzle=m.nozzle"
LOST = {
    "in a helper of another file": (
        [("from figures import", "from guidance import lag\nfrom figures import"),
         ("    turn = force", "    swivel = swivel + lag(t)\n    turn = force")],
        "    swivel = swivel + lag(t)",
        "guidance.py, line 6: `return 0.1 * log(1.0 - t)`: the logarithm of",
    ),
    "in the engine's physics": (
        [(PUSH, f"{PUSH}    force = force + 0.0 * sutton_graves(1.0 - t, 9.0, 1.0)\n"),
         ("from mc_engine.physics.constants", f"{HEATING}from mc_engine.physics.constants")],
        "    force = force + ",
        "in heating.py, line 17, the square root of -",
    ),
    "by a division": (
        [("import cos, exp", "import cos, exp, floor"),
         (PUSH, "    lever = floor(t) - 1.0\n    force = m.burning / lever\n")],
        "    force = m.burning / lever",
        "`force = m.burning / lever`: 1 / 0 is infinite (t = ",
    ),
    "in the control, and used later": (
        [(HELD, f"    nozzle = nozzle + acos(1.5 * t)\n{HELD}"),
         ("import cos, exp", "import acos, cos, exp")],
        "    nozzle = nozzle + acos(1.5 * t)",
        "the arc cosine of 1.",
    ),
    "in the function of an event": (
        [("    return s.altitude\n", "    return sqrt(3.01 - t)\n")],
        "    return sqrt(3.01",
        "the square root of -",
    ),
    "in what an event does": (
        [("until=8.0", "until=30.0"), (SWITCHED, f"    area = area + log(17.0 - t)\n{SWITCHED}"),
         ("import cos, exp,", "import cos, exp, log,")],
        "    area = area + log(17.0 - t)",
        "the logarithm of -",
    ),
}  # fmt: skip
GUIDANCE = "from mc_engine.lanes import log, physics\n\n\n@physics\ndef lag(t):\n    return 0.1 * log(1.0 - t)\n"


# with adaptive steps those that a step checks by itself: at events, and in what the control and an event give
STEPPED = ("in the control, and used later", "in the function of an event", "in what an event does")


@pytest.mark.parametrize(
    ("where", "clock"),
    [(where, "fixed") for where in LOST]
    + [pytest.param(where, "adaptive", marks=() if where in STEPPED else pytest.mark.slow) for where in LOST],
)
def test_the_place_is_the_first_one_wherever_the_number_was_lost(where, clock, tmp_path):
    edits, text, sentence = LOST[where]
    (tmp_path / "guidance.py").write_text(GUIDANCE)
    clocks = [SHORT, ADAPTIVE, ADAPTED] if clock == "adaptive" else [SHORT]
    if clock == "adaptive":
        edits = [
            (old.replace("until=8.0", "until=8.0,"), new.replace("until=30.0", "until=30.0,")) for old, new in edits
        ]
    found = lost(rocket(tmp_path, *clocks, *edits))
    assert sentence in found
    assert f"model.py, line {line_of(tmp_path, text)}" in found


def test_a_parameter_that_prepare_loses_is_named(tmp_path):
    prepare = (
        "def prepare(inputs, settings, refusals):\n    return {**vars(inputs), 'wind': inputs.wind * float('nan')}\n"
    )
    campaign = rocket(tmp_path, SHORT, ("MODEL = model(\n", f"{prepare}\n\nMODEL = model(\n    prepare=prepare,\n"))
    assert lost(campaign) == '"wind" of the kernel_parameters is nan (the nominal case)'


def test_a_metric_that_evaluate_loses_is_named_though_the_case_is_ok(tmp_path):
    campaign = campaign_with(tmp_path / "minimal", *with_evaluate("Metrics(top_speed=sqrt(-best.speed))"))
    found = runner.replay(runner.run(replace(campaign, cases=3), tmp_path / "run").path, 2).lost
    line = line_of(tmp_path / "minimal", "    return Metrics(")
    assert found.startswith(f'"top_speed_m_s": model.py, line {line}: `return Metrics(')
    assert "the square root of -" in found


def test_an_interpreted_flight_that_takes_too_long_says_how_far_it_came(tmp_path):
    campaign = rocket(tmp_path)
    found = first_lost(campaign.model, campaign.nominal, 0, 1, "case 0", seconds=0.2)
    assert "given up after 0 s, at t = " in found
    assert found.endswith("it was finite until then")


WHOLE = [
    pytest.param(name, marks=pytest.mark.slow)
    for name in ("deorbit", "reentry", "geo_injection", "flexible_satellite/pwpf")
]


ROCKETS = {"rocket": [SHORT], "adaptive rocket": [SHORT, ADAPTIVE, ADAPTED]}


@pytest.mark.parametrize("name", ["minimal", "adaptive rocket", pytest.param("rocket", marks=pytest.mark.slow), *WHOLE])
def test_an_interpreted_flight_has_the_bits_of_the_kernel(name, tmp_path):
    campaign = rocket(tmp_path, *ROCKETS[name]) if name in ROCKETS else load_campaign(name)
    inputs = full_inputs(campaign, {key: value[0] for key, value in case_table(campaign, np.array([3])).items()})
    flown = fly(campaign.model, inputs, np.array([3]), campaign.seed, folder=campaign.directory, width=1)
    flight = InterpretedFlight(campaign.model, 120.0)
    time, status, states, metrics = fly_interpreted(flight, inputs, 3, campaign.seed)
    assert flown["status"][0] == STATUS_NAME[int(status[0])]
    assert flown["end_time_s"][0] == time[0]
    for field, row in zip(campaign.model.states, states, strict=True):
        assert flown[f"end_{field.name}"][0] == row[0] / field.si_factor, field.name
    if flown["status"][0] == "ok":
        for field, row in zip(campaign.model.metrics, metrics, strict=True):
            np.testing.assert_equal(flown[field.name][0], row[0] / field.si_factor, err_msg=field.name)


def test_numbers_that_too_long_a_step_makes_infinite_are_not_blamed_on_a_line(tmp_path):
    damped = ("vx=g * s.x, vy=g * s.y)", "vx=g * s.x - s.vx, vy=g * s.y - s.vy)")  # time constant 1 s
    clock = 'FixedStep(1.0, 400.0, method="gj9", rates=(("x", "vx"), ("y", "vy")))'
    edits = ("FixedStep(step=10.0, until=10_000.0)", clock), ('events={"apogee": Event(climb, "falling", "stop")}', "")
    sentence = only(faults(campaign_with(tmp_path, damped, *edits)))  # half of the step overflows, too
    assert 'steps of 1 s are too long for "gj9": the nominal case has the end_time_s' in sentence
