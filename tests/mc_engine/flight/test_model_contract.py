"""Deliberate mistakes in the smallest model: each gets one sentence with its place, none a compiler's page."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mc_engine.campaign.loading import load_campaign
from mc_engine.errors import CampaignError
from mc_engine.flight import missing_events, repeatability
from mc_engine.flight.contract import breaches
from mc_engine.flight.contract_flight import _none_completing, faults
from mc_engine.flight.flight import fly
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.flight.kernel_parts import watching_events
from mc_engine.flight.missing_events import _nominal_times
from mc_engine.model import Event
from tests.mc_engine.model.mistaken_campaign import campaign_with, given, in_front, line_of
from tests.mc_engine.store.small_run import ENVIRONMENT
from tests.shipped_campaigns import samples


def only(sentences):
    assert len(sentences) == 1, sentences
    assert "\n" not in sentences[0]
    return sentences[0]


def test_an_unknown_unit_is_named_with_the_nearest(tmp_path):
    with pytest.raises(CampaignError) as error:
        campaign_with(tmp_path, ("low=150.0", 'low=150.0, unit="kilometres"'))
    line = line_of(tmp_path, "Inputs = inputs(")
    assert f'model.py, line {line}: "altitude_km" has the unit "kilometres"; did you mean "km"?' in str(error.value)


NOISE = (
    "def prepare(inputs, settings, refusals):\n    return {**vars(inputs), 'burn_dv': BURN}\n\n\n@physics\ndef initial"
)
LATE = "delayed event that acts too late"
FLOWN = {
    "dispersion that moves nothing": (
        [("cos(p.pitch_error)", "1.0"), ("sin(p.pitch_error)", "0.0")],
        'dispersion "pitch_error_deg" moves no metric',
    ),
    "event never crossing": (
        [("return s.x * s.vx", "return 1e12 + s.x * s.vx")],
        'no stopping event crosses zero before the time limit, of "apogee"',
    ),
    LATE: (
        [('Event(climb, "falling", "stop")', 'Event(climb, "falling", "stop", after=1e9)')],
        'no stopping event acts before the time limit, of "apogee"; look at its function, its direction, its delay '
        "`after` and the clock's `until`",
    ),
    "non-deterministic": (
        [
            ("from mc_engine.lanes", "import numpy as np\n\nfrom mc_engine.lanes"),
            ("@physics\ndef initial", NOISE.replace("BURN", "inputs.burn_dv + np.random.rand(inputs.burn_dv.size)")),
            given("prepare=prepare"),
        ],
        "when the same cases fly a second time; a case must depend on its inputs and case_id alone",
    ),
    "depends on the company": (
        [
            ("@physics\ndef initial", NOISE.replace("BURN", "inputs.burn_dv - inputs.magnitude_error.mean()")),
            given("prepare=prepare"),
        ],
        "when it flies among other cases",
    ),
}
TOP_SPEED = 'top_speed_m_s=maximum_of("speed_m_s", "largest speed")'


def test_events_may_share_a_function_that_gives_one_number(tmp_path):
    campaign = campaign_with(tmp_path, ('"stop")}', '"stop"), "again": Event(climb, "falling", "stop")}'))
    assert breaches(campaign) == []
    assert faults(campaign) == []


@pytest.mark.parametrize(
    "mistake", [pytest.param(name, marks=pytest.mark.slow if name == LATE else ()) for name in FLOWN]
)
def test_a_mistake_that_shows_in_flight_is_one_sentence(mistake, tmp_path):
    edits, sentence = FLOWN[mistake]
    campaign = campaign_with(tmp_path, *edits)
    assert breaches(campaign) == []
    assert sentence in only(faults(campaign))


def test_metrics_that_are_never_set_infinite_or_constant_are_named_one_by_one(tmp_path):
    campaign = campaign_with(
        tmp_path,
        (TOP_SPEED, f'{TOP_SPEED}, lost_m_s="lost", endless_m_s="endless", idle_m_s="idle"'),
        in_front(
            "@physics\ndef evaluate(best):\n"
            "    return Metrics(lost=best.top_speed / 0.0 * 0.0, endless=best.top_speed / 0.0, idle=7.5)"
        ),
        given("evaluate=evaluate"),
    )
    assert breaches(campaign) == []
    lost, endless, line, idle = faults(campaign)
    division = "return Metrics(lost=best.top_speed / 0.0 * 0.0, endless=best.top_speed / 0.0, idle=7.5)"
    assert line.startswith(f'"lost_m_s": model.py, line {line_of(tmp_path, division)}: `')
    assert line.endswith(": 7825.76 / 0 is infinite (t = 2825.28 s, the nominal case)")
    assert lost.startswith('the metric "lost_m_s" is not a number in any of the 32 cases')
    assert endless.startswith('the metric "endless_m_s" is infinite in all of the 32 cases that flew')
    assert idle.startswith('the metric "idle_m_s" is 7.5 whatever happens; let `evaluate` work it out')


@pytest.mark.parametrize(("unit", "options", "found"), [("mm", "", 1), ("mm", ", sometimes=True", 0), ("km", "", 0)])
def test_a_level_that_no_output_exceeds_is_told_where_it_may_be_in_the_small_unit_of_the_output(
    unit, options, found, tmp_path
):
    renamed = f'altitude_{unit}="altitude"'
    campaign = campaign_with(
        tmp_path,
        (TOP_SPEED, f'{TOP_SPEED}, high_s=last_above("altitude_{unit}", 1e9, "last time above"{options})'),
        ("inputs, maximum_of", "inputs, last_above, maximum_of"),
        ('altitude_km="altitude"', renamed),
        ('apogee_altitude_km=at_end("altitude_km"', f'apogee_altitude_km=at_end("altitude_{unit}"'),
    )
    told = faults(campaign)
    assert len(told) == found
    sentence = (
        'the metric "high_s" is 0 in all of the 32 cases that flew: none has "altitude_mm" above the level of 1e+12'
    )
    assert all(one.startswith(f"{sentence} mm; `level` is in SI") for one in told)


CLOCK = "FixedStep(step=10.0, until=10_000.0)"
STOP = 'events={"apogee": Event(climb, "falling", "stop")}'


@pytest.mark.parametrize(
    ("level", "events", "limit", "found"),
    [("7e3", STOP, 3000.0, 1), ("7e3", STOP, 500.0, 0), ("7.6e3", STOP, 2900.0, 0), ("9e3", "events={}", 1e4, 1)],
)
def test_a_limit_on_a_settling_time_that_flights_without_one_meet_is_told(level, events, limit, found, tmp_path):
    campaign = campaign_with(
        tmp_path,
        (TOP_SPEED, f'{TOP_SPEED}, calm_s=last_above("speed_m_s", {level}, "last time above", sometimes=True)'),
        ("inputs, maximum_of", "inputs, last_above, maximum_of"),
        (STOP, events),
    )
    requirements = (replace(campaign.requirements[0], name="calm", metric="calm_s", at_least=None, at_most=limit),)
    told = faults(replace(campaign, requirements=requirements))
    assert ["is met by a flight that is above the level of" in one for one in told] == [True] * found


@pytest.mark.parametrize(
    ("step", "until", "ends", "fit"),
    [
        (
            30.0,
            20_000.0,
            "20010 s, after 667 steps",
            "an `until` of 19980 s or 20010 s, or steps of 29.9850074962519 s",
        ),
        (700.0, 300.0, "700 s, after 1 steps", "an `until` of 700 s, or steps of 300 s"),
    ],
)
def test_an_end_inside_a_step_is_named_and_what_is_suggested_fits(tmp_path, step, until, ends, fit):
    def checked(step, until):
        return faults(campaign_with(tmp_path, (CLOCK, f"FixedStep({step}, {until})"), (STOP, "")))

    sentence = only(checked(step, until))
    assert f"`until` is {until:g} s, and flights end at {ends} of {step:g} s; take {fit}" in sentence
    *others, shorter = re.findall(r"[\d.]+", fit)
    assert [checked(step, other) for other in others] == [[]] * len(others)
    assert checked(shorter, until) == []


@pytest.mark.parametrize(("method", "limit_s"), [("gj9", 105.0), pytest.param("abm12", 70.0, marks=pytest.mark.slow)])
def test_steps_beyond_the_limit_of_stability_are_found_though_every_case_is_ok(tmp_path, method, limit_s):
    def checked(step):
        rates = ', rates=(("x", "vx"), ("y", "vy"))' if method == "gj9" else ""
        clock = f'FixedStep({step}, {step * 800}, method="{method}"{rates})'
        campaign = campaign_with(tmp_path, (CLOCK, clock), (STOP, ""))
        flown = fly(campaign.model, campaign.nominal, np.array([0]), 1, folder=tmp_path)
        assert flown["status"][0] == "ok"
        return faults(campaign)

    assert checked(0.9 * limit_s) == []
    for beyond in (1.3, 5.0):  # where half of the step is stable, and where it is not
        sentence = only(checked(beyond * limit_s))
        assert f'steps of {beyond * limit_s:g} s are too long for "{method}"' in sentence
        assert "with half of the step" in sentence


def test_a_switching_event_that_never_fires_is_missed_unless_it_is_declared_rare(tmp_path):
    edits = [
        in_front("@physics\ndef moon(s):\n    return s.x - 3.8e8"),
        in_front("@physics\ndef switch(s, m):\n    return s, m"),
        given("switch=switch"),
    ]
    stop = '"apogee": Event(climb, "falling", "stop")'
    rare = [*edits, (stop, f'{stop}, "moon": Event(moon, "rising", "switch", rare=True)')]
    assert faults(campaign_with(tmp_path / "rare", *rare)) == []
    missed = only(
        faults(campaign_with(tmp_path / "missed", *edits, (stop, f'{stop}, "moon": Event(moon, "rising", "switch")')))
    )
    assert 'the event "moon" crosses zero in none of 32 cases, its function stays below it' in missed


def switching_half_way(folder, place="s.x", direction="falling"):
    """A campaign with an event that happens, if its direction is right: `place` falls through zero."""
    edits = [
        in_front(f"@physics\ndef half_way(s):\n    return {place}"),
        in_front("@physics\ndef switch(s, m):\n    return s, m"),
        given("switch=switch"),
    ]
    stop = '"apogee": Event(climb, "falling", "stop")'
    return campaign_with(folder, *edits, (stop, f'{stop}, "half_way": Event(half_way, "{direction}", "switch")'))


OTHER_WAY = (
    'model.py, line {}: the event "{}" crosses zero falling at {} s in the nominal case, but its direction is "rising"'
)
MEND = 'give it the direction "falling" or "either", or its function the other sign'


def test_an_event_whose_direction_never_comes_is_named_with_its_line_the_time_and_the_fix(tmp_path):
    sentence = only(faults(switching_half_way(tmp_path, direction="rising")))
    crossing = OTHER_WAY.format(line_of(tmp_path, "MODEL = model(") + 2, "half_way", 1366)
    assert sentence.startswith(f"{crossing}, in which it happens in none of 32 cases; {MEND}, or declare it with rare")
    assert faults(switching_half_way(tmp_path / "either", direction="either")) == []


def test_a_stopping_event_that_a_sample_carries_over_zero_is_named_with_the_time(tmp_path):
    edits = [
        ("from mc_engine.lanes import", "from collections import namedtuple\n\nfrom mc_engine.lanes import where,"),
        in_front('Memory = namedtuple("Memory", "target", defaults=(1e12,))', "climb"),
        in_front("@physics\ndef control(t):\n    return Memory(target=where(t < 500.0, 1e12, -1e12))", "climb"),
        ("def climb(s)", "def climb(s, m)"),
        (CLIMB, "return m.target"),
        given("memory=Memory", "control=control"),
        ("10_000.0", "900.0"),
    ]
    sentence = only(faults(campaign_with(tmp_path, *edits)))
    place = f"model.py, line {line_of(tmp_path, 'MODEL = model(') + 2}"
    assert f'limit: {place}: the event "apogee" does not happen where a sample of the control, `switch`' in sentence
    assert "carries it over zero, at 500 s in the nominal case; let its function depend on the state" in sentence


def test_the_end_of_a_phase_that_looks_for_an_event_carries_it_over_nothing():
    """Behind it the function of an event of either direction is 1."""
    looks = {"the nominal case": {"t_s": np.array([0.0, 3.0, 3.0, 9.0]), "high": np.array([-2.0, -1.0, 1.0, 1.0])}}
    event = replace(Event(None, "either"), name="high")
    assert missing_events._carried(SimpleNamespace(phases={"powered": None}), event, looks) == ""


def test_where_no_case_can_start_the_sentence_has_the_reason_of_one_that_cannot():
    reasons = np.array(['in the phase "coast"', "too low", "too low"], dtype=object)
    flown = {"status": np.array(["no-stop", "refused", "refused"]), "reason": reasons}
    assert only([*_none_completing(None, flown, flown)]).endswith("2 are refused (too low)")


def test_where_no_case_completes_the_sentence_says_when_the_first_ends(tmp_path):
    clock = "AdaptiveStep(until=10_000.0, attempts=20)"
    edits = [("import Event, FixedStep", "import AdaptiveStep, Event"), (CLOCK, clock)]
    sentence = only(faults(campaign_with(tmp_path, *edits)))
    assert re.search(r"32 are step-limit \(the cap .* reached; the first of them ends at t = \d+\.?\d* s\)$", sentence)


def test_a_nominal_case_that_does_not_complete_among_cases_that_do_is_told(tmp_path):
    edits = [
        ("def climb(s)", "def climb(s, p)"),
        (CLIMB, f"return {CLIMB.removeprefix('return ')} + where(p.pitch_error == 0.0, 1e20, 0.0)"),
        ("import cos, physics, rsqrt, sin, sqrt", "import cos, physics, rsqrt, sin, sqrt, where"),
    ]
    sentence = only(faults(campaign_with(tmp_path, *edits)))
    assert sentence.startswith("the nominal case does not complete: it is no-stop (")


CLIMB = "return s.x * s.vx + s.y * s.vy"


@pytest.mark.parametrize("after", ["", pytest.param(", after=3.0", marks=pytest.mark.slow)])
def test_a_stopping_event_of_the_wrong_direction_is_named_where_all_cases_reach_the_time_limit(tmp_path, after):
    edits = [(CLIMB, "return s.x"), ('"falling", "stop")', f'"rising", "stop"{after})'), ("10_000.0", "3000.0")]
    sentence = only(faults(campaign_with(tmp_path, *edits)))
    crossing = OTHER_WAY.format(line_of(tmp_path, "MODEL = model(") + 2, "apogee", 1366)
    assert f"32 are no-stop (no stopping event happens before the time limit: {crossing}; {MEND})" in sentence


def test_an_event_at_whose_zero_a_flight_ends_has_happened(tmp_path):
    """The flight stops where s.x falls through zero: the other function is above zero there, by a micrometre."""
    edits = [(CLIMB, "return s.x"), in_front("@physics\ndef switch(s, m):\n    return s, m"), given("switch=switch")]
    stop = '"apogee": Event(climb, "falling", "stop")'
    edits += [in_front("@physics\ndef at_end(s):\n    return s.x + 1e-6")]
    edits += [(stop, f'{stop}, "at_end": Event(at_end, "falling", "switch")')]
    assert faults(campaign_with(tmp_path, *edits)) == []


def test_a_right_model_is_checked_with_the_kernel_of_its_run_alone(tmp_path, monkeypatch):
    campaign = switching_half_way(tmp_path)
    flown = []

    def noted(model, *arguments, **options):
        flown.append(model)
        return fly(model, *arguments, **options)

    for module in (missing_events, repeatability):
        monkeypatch.setattr(module, "fly", noted)
    assert faults(campaign) == []
    assert flown
    assert not any(model.watching for model in flown)


def test_python_flies_the_nominal_case_of_a_model_and_its_inputs_once(tmp_path, monkeypatch):
    campaign = switching_half_way(tmp_path / "first")
    monkeypatch.setenv("MC_ENGINE_CACHE", str(tmp_path / "cache"))
    by_python, kernel = [], InterpretedFlight.kernel

    def noted(flight, *arguments):
        by_python.append(flight)
        kernel(flight, *arguments)

    monkeypatch.setattr(InterpretedFlight, "kernel", noted)
    times = [_nominal_times(campaign, watching_events(campaign.model)) for _ in range(2)]
    assert len(by_python) == 1
    assert times[0] == times[1]
    assert 0.0 < times[0]["time_of_half_way"] < times[0]["time_of_apogee"]
    higher = replace(campaign, nominal={**campaign.nominal, "altitude_km": 500.0})
    assert _nominal_times(higher, watching_events(higher.model)) != times[0]
    beyond = switching_half_way(tmp_path / "beyond", "s.x - 1.0")
    assert _nominal_times(beyond, watching_events(beyond.model))["time_of_half_way"] < times[0]["time_of_half_way"]
    assert len(by_python) == 3


PREPARE = "def prepare(inputs, settings, refusals):\n    {}\n    return vars(inputs)\n\n\n@physics\ndef initial"


def with_prepare(body):
    return ("@physics\ndef initial", PREPARE.format(body)), given("prepare=prepare")


def test_a_design_that_breaks_is_a_problem_of_the_campaign_with_its_line(tmp_path):
    with pytest.raises(CampaignError, match=r"campaign\.model: .*") as error:
        campaign_with(tmp_path, *with_prepare("1 / 0"))
    assert f"model.py, line {line_of(tmp_path, '1 / 0')}: ZeroDivisionError: division by zero" in str(error.value)


def check(folder, *options, **environment):
    return subprocess.run(
        [sys.executable, "-m", "mc_engine", "check", str(folder), *options],
        capture_output=True, text=True, env={**ENVIRONMENT, **environment}, check=False,
    )  # fmt: skip


def test_a_model_that_kills_its_process_is_a_sentence_unless_only_the_file_is_read(tmp_path):
    kill = "import os\n    if inputs.burn_dv.size > 3:\n        os._exit(9)"
    campaign_with(tmp_path, *with_prepare(kill))
    done = check(tmp_path)
    assert done.returncode == 2
    assert "killed its process: exit status 9" in done.stderr
    assert check(tmp_path, "--no-model").returncode == 0


# of whose cases 32 meet no event, which takes a kernel of its own; test_counts_agree.py flies its grid
WATCHED = "reentry/aerobraking"


@pytest.mark.parametrize(
    "name",
    [pytest.param(*each.values, marks=pytest.mark.slow) if WATCHED in each.values else each for each in samples()],
)
def test_shipped_campaigns_keep_the_contract(name):
    campaign = load_campaign(name)
    assert breaches(campaign) == []
    assert faults(campaign) == []


def test_the_process_of_its_own_prints_the_sentences_last():
    done = subprocess.run(
        [sys.executable, "-m", "mc_engine.flight.contract_flight", "minimal"],
        capture_output=True, text=True, env=ENVIRONMENT, check=True,
    )  # fmt: skip
    assert json.loads(done.stdout.splitlines()[-1]) == []


@pytest.mark.parametrize(("digests", "printed"), [("", False), ('{"`mu`": "another"}', True)])
def test_the_process_that_waits_flies_nothing_before_it_gets_the_digests_of_the_other_one(digests, printed):
    done = subprocess.run(
        [sys.executable, "-m", "mc_engine.flight.contract_flight", "minimal", "--wait"],
        input=digests, capture_output=True, text=True, env=ENVIRONMENT, check=True,
    )  # fmt: skip
    sentences = [json.loads(line) for line in done.stdout.splitlines()]
    if printed:
        assert "`mu` differs between two processes" in sentences[0][0]
    else:
        assert sentences == []
