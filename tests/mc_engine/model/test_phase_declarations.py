"""What is said of mistakes in phases, delayed events and metrics at events, and that `check` knows all phases."""

from mistaken_campaign import campaign_with, refused

from mc_engine.flight.contract import breaches
from mc_engine.flight.contract_flight import faults

PHASES = (
    ("import Event,", "import Event, Phase, time_of, value_at,"),
    ("rhs=rhs, observe", "observe"),
    ('events={"apogee": Event(climb, "falling", "stop")}',
     'phases={"near": Phase(rhs, events={"far": Event(height, "rising", to="away")}),\n'
     '                      "away": Phase(rhs, events={"apogee": Event(climb, "falling", "stop")})}'),
    ("@physics\ndef observe", "@physics\ndef height(s):\n    return s.x * s.x + s.y * s.y - (7e6) ** 2\n\n\n"
     "@physics\ndef observe"),
)  # fmt: skip
SWITCH = ("MODEL =", "@physics\ndef switch(s, m, hit):\n    return s, m\n\n\nMODEL =")
# text of the smallest model in two phases, what stands in its place, the sentence
MISTAKES = {
    "unknown phase": (('to="away"', 'to="awya"'),
                      'the event "far" begins the phase "awya", which there is not; did you mean "away"?'),
    "phase that no event begins": (('"rising", to="away"', '"rising", "stop"'),
                                   'no event begins the phase "away"; let one of a phase before it do so'),
    "event without function": (("Event(height, ", "Event("), 'the event "far" has no function; declare it so'),
    "rhs beside phases": (("observe=observe", "rhs=rhs, observe=observe"),
                          "the model has both `rhs` and `phases`; each phase has its own: Phase(rhs=...)"),
    "events beside phases": (("observe=observe", "events={}, observe=observe"), "both `events` and `phases`"),
    "events as control": (('"near": Phase(rhs, events=', '"near": Phase(rhs, '),
                          'the phase "near" has a dictionary as its control; say what it is: Phase(rhs, events={...})'),
    "neither": (('phases={"near"', 'data=()) and dict(x={"near"'), "the model has no `rhs`"),
    "no phase": (('"near": Phase(rhs, ', '"near": dict(rhs=rhs, '), 'the phase "near" is {'),
    "stop and phase": (('"rising", to=', '"rising", "stop", to='), 'has the action "stop" and begins the phase "away"'),
    "phase of a model without": (('phases={"near"', 'rhs=rhs, events={"far": Event(height, "rising", to="away")})\n'
                                  'dict(x={"near"'), 'begins the phase "away", but the model has no phases'),
    "one name, two events": (('"away": Phase(rhs, events={', '"away": Phase(rhs, events={"far": Event(climb),'),
                             'the phase "away" has another event "far" than a phase before'),
    "delay before": (('to="away"', 'to="away", after=-1.0'), 'the event "far" acts after -1.0 s; a delay is a number'),
    "delay of nobody": (('to="away"', 'to="away", after="burn_vd"'),
                        '"burn_vd", and no parameter has this name without its unit; did you mean "burn_dv"?'),
    "value at no event": (('maximum_of("speed_m_s"', 'value_at("apogeee", "speed_m_s"'),
                          'metric "top_speed_m_s": there is no event "apogeee"; did you mean "apogee"?'),
    "value of no output": (('maximum_of("speed_m_s"', 'value_at("apogee", "sped_m_s"'),
                           'metric "top_speed_m_s": there is no output "sped_m_s"; did you mean "speed_m_s"?'),
    "time in metres": (('maximum_of("speed_m_s", ', 'time_of("apogee", '), 'is in "m/s", but it holds a value in "s"'),
    "a field that the engine keeps": (
        ("MODEL =", 'from collections import namedtuple\n\n'
                    'Memory = namedtuple("Memory", "speed_at_far", defaults=(0.0,))\nMODEL ='),
        ("observe=observe", "observe=observe, memory=Memory"),
        ('maximum_of("speed_m_s", ', 'value_at("far", "speed_m_s", '),
        'the field "speed_at_far" is there twice'),
    "nearly since": (("def observe(s)", "def observe(s, sinc)"), 'takes "sinc"; did you mean "since"?'),
    "control without memory": (("Phase(rhs, events={\"far\"", "Phase(rhs, rhs, events={\"far\""),
                               "name its class, memory=Memory"),
    "no function to switch": (('"falling", "stop")}', '"falling", "switch")}'), "no function `switch`; for"),
    "a phase of no word": (('"away": Phase', '"2nd": Phase'), "'2nd'"),
    "a reserved column": (('altitude_km="altitude"', 'phase=Field("x", unit=""), altitude_km="altitude"'),
                          ("import Event,", "import Event, Field,"), 'the output "phase" has the name of a column'),
}  # fmt: skip


def test_a_mistake_in_phases_is_named_with_its_fix(tmp_path):
    for mistake, (*edits, sentence) in MISTAKES.items():
        refused(tmp_path / mistake, [*PHASES, *edits], sentence)


IN_PHYSICS = {
    "truth of a delayed event": (('to="away"', 'to="away", after=1.0'), (" - (7e6) ** 2", " > (7e6) ** 2"),
                                 'model.py, line 38: `events` gives a truth value for "far"; it must give a number'),
    "rhs of the second phase": (("def height", "def lost(s):\n    return s.x\n\n\n@physics\ndef height"),
                                ('"away": Phase(rhs', '"away": Phase(lost'), "`rhs` gives "),
    "syntax of the second phase": (("def height", "def lost(s):\n    return [s.x]\n\n\n@physics\ndef height"),
                                   ('"away": Phase(rhs', '"away": Phase(lost'), "a list, dictionary or set is not for"),
    "switch without memory": (("observe=observe", "switch=switch, observe=observe"), (SWITCH[0], SWITCH[1].replace(
        "return s, m", "return s")), "`switch` gives State(x, y, vx, vy); it must give state and memory, (s, m)"),
}  # fmt: skip


def test_check_finds_what_is_wrong_in_any_phase(tmp_path):
    for mistake, (*edits, sentence) in IN_PHYSICS.items():
        found = breaches(campaign_with(tmp_path / mistake, *PHASES, *edits))
        assert any(sentence in one for one in found), found


NEVER = ('Phase(rhs, events={"apogee"', 'Phase(rhs, events={"never": Event(beyond, "rising", "stop"), "apogee"')
BEYOND = ("@physics\ndef observe", "@physics\ndef beyond(s):\n    return s.x - 1e9\n\n\n@physics\ndef observe")


def test_an_event_of_the_second_phase_that_never_comes_is_found_by_flying(tmp_path):
    metric = ('maximum_of("speed_m_s"', 'value_at("never", "speed_m_s"')
    found, event = faults(campaign_with(tmp_path / "metric", *PHASES, NEVER, BEYOND, metric))
    assert 'the metric "top_speed_m_s" is not a number in any of the 32 cases' in found
    assert "look at `evaluate`, or at the output or the event that it is declared by" in found
    sometimes = (metric[0], metric[1]), ('"largest speed")', '"speed there", sometimes=True)')
    (found,) = faults(campaign_with(tmp_path / "sometimes", *PHASES, NEVER, BEYOND, *sometimes))
    assert found == event
    assert found.startswith('the event "never" happens in none of 32 cases, in the phases that look for it')


def test_an_event_of_a_phase_whose_direction_never_comes_is_found(tmp_path):
    perigee = ('Event(height, "rising", to="away")}', 'Event(height, "rising", to="away"),\n'
               '                      "half_way": Event(half_way, "rising", to="away")}')  # fmt: skip
    half_way = ("@physics\ndef observe", "@physics\ndef half_way(s):\n    return s.x\n\n\n@physics\ndef observe")
    (found,) = faults(campaign_with(tmp_path, *PHASES, perigee, half_way))
    assert found.startswith('model.py, line 56: the event "half_way" crosses zero falling at 1366 s in the nominal')


def test_check_has_nothing_to_say_of_a_right_model_in_phases(tmp_path):
    campaign = campaign_with(tmp_path, *PHASES)
    assert breaches(campaign) == []
    assert faults(campaign) == []


def test_a_phase_needs_no_events(tmp_path):
    """One event function in all, and a last phase that looks for nothing."""
    last = ('"away": Phase(rhs, events={"apogee": Event(climb, "falling", "stop")})', '"away": Phase(rhs)')
    campaign = campaign_with(tmp_path, *PHASES, last)
    assert [event.name for event in campaign.model.event_list] == ["far"]
    assert not [fault for fault in faults(campaign) if "IndexError" in fault]
