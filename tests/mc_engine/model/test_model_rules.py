"""Records of a model that contradict themselves or one another: named where the model is made."""

from dataclasses import replace

import pytest
from mistaken_campaign import campaign_with, given, in_front, refused, with_evaluate, with_input

from mc_engine.campaign.loading import load_campaign
from mc_engine.errors import CampaignError, ModelError
from mc_engine.flight.contract import breaches
from mc_engine.model import Extremum

IMPORTS = "from mc_engine.lanes import"
CLOCK = "FixedStep(step=10.0, until=10_000.0)"


CONTRADICTIONS = {
    "direction": (('"falling"', '"down"'), 'event "apogee" has the direction "down"; known are "rising", "falling"'),
    "action": (('"stop"', '"record"'), 'event "apogee" has the action "record"; known are "stop", "switch"'),
    "switch without function": (('"stop"', '"switch"'), 'event "apogee" has the action "switch", but the model has no'),
    "negative step": ((CLOCK, "FixedStep(step=-10.0, until=1.0)"), "the clock's `step` is -10.0; it must be a number"),
    "no step": ((CLOCK, "FixedStep(step=0, until=1.0)"), "the clock's `step` is 0; it must be a number above 0"),
    "NaN": ((CLOCK, "FixedStep(step=float('nan'), until=1.0)"), "the clock has nan as its `step`; it must be a number"),
    "text": ((CLOCK, 'FixedStep(step="10", until=1.0)'), "the clock's `step` is \"10\", and no setting has this name"),
    "end in the past": ((CLOCK, "FixedStep(step=1.0, until=-5)"), "the clock's `until` is -5; it must be a number"),
    "sampling": ((CLOCK, "FixedStep(step=1.0, until=5.0, control_every=0)"), "`control_every` is 0; it must be"),
    "method": ((CLOCK, 'FixedStep(step=1.0, until=5.0, method="euler")'), 'the clock has the method "euler"'),
    "order of a method": ((CLOCK, 'FixedStep(step=1.0, until=5.0, method="abm7")'),
                          'the clock has the method "abm7"; FixedStep has "rk4", "abm8", "abm9"'),
    "pairs without a use": ((CLOCK, 'FixedStep(step=1.0, until=5.0, rates=(("x", "vx"),))'),
                            'the method "rk4" does not use them: leave `rates` out, or name each of the states'),
    "limits swapped": (("low=150.0, high=2000.0", "low=2000.0, high=150.0"),
                       '"altitude_km" has low=2000, which is above high=150; swap them'),
    "kind of extremum": (given('extrema={"top": at_end("speed_m_s", "")}'), "it must be maximum_of(...), minimum_of("),
    "output of an extremum": (given('extrema={"top": maximum_of("sped_m_s", "")}'),
                              'extremum "top": there is no output "sped_m_s"; did you mean "speed_m_s"?'),
    "unit and name": (("orbit\", low=150.0", "orbit\", unit=\"m\", low=150.0"),
                      '"altitude_km" has the unit "m", so that its name must end in "_m"; change the name or the unit'),
    "no dictionary of events": (('{"apogee": Event(climb, "falling", "stop")}', 'Event(climb, "falling", "stop")'),
                                '`events` is no dictionary; declare it so: events={"apogee": Event('),
    "a metric of the engine's name": (("top_speed_m_s", "case_id"), ('"largest speed"', '"fastest", unit="m/s"'),
                                      '"case_id" has the unit "m/s", so that its name must end in "_m_s"'),
    "a column of the engine's": (*with_evaluate("State(end_time=t)"), ("top_speed_m_s", "end_time_s"),
                                 'the column "end_time_s" has the name of a column that every table has'),
    "a state at the end": (("top_speed_m_s", "end_vx_m_s"),
                           'the column "end_vx_m_s" is that of the state "vx_m_s" at the end'),
    "an output of the engine's name": (('speed_m_s="speed")', 'speed_m_s="speed", t_s="time")'),
                                       'the output "t_s" has the name of a column that every table has'),
    "parameters of no record": (given("kernel_parameters=dict"), "kernel_parameters must be a named tuple, whose"),
    "control without a memory": (given("control=rhs"), "the model has `control`, but no `memory`; give memory=Memory"),
    "control without samples": (given("control=rhs, memory=namedtuple('Kept', 'n', defaults=(0.0,))"),
                                ("from mc_engine.lanes", "from collections import namedtuple\nfrom mc_engine.lanes"),
                                (CLOCK, "AdaptiveStep(until=5.0)"), ("FixedStep,", "AdaptiveStep,"),
                                "its clock no `control_period`: the only sample is at t = 0; write AdaptiveStep"),
    "memory of one case": (given("memory=Outputs(1.0, 2.0)"),
                           "`memory` is Outputs(altitude=1.0, speed=2.0); hand over its class, memory=Memory"),
    "level before output": (('maximum_of("speed_m_s", "largest speed")', 'last_above(0.5, "speed_m_s")'),
                            ("maximum_of", "last_above"), ('top_speed_m_s', 'top_speed_s'),
                            'metric "top_speed_s" is of the output 0.5; the name of an output comes first, such as '
                            '"altitude_km"'),
    "default of nobody": (*with_input('law=Setting("c", "law", choices=("a", "b"))'),
                          'setting "law" has the default \'c\'; known are "a", "b"'),
    "tolerance": ((CLOCK, "AdaptiveStep(until=5.0, rtol=1e9)"), ("FixedStep,", "AdaptiveStep,"),
                  "the clock's `rtol` is 1000000000.0; it must be a number above 0, and 1 at most"),
    "sampling between steps": ((CLOCK, "FixedStep(step=1.0, until=5.0, control_every=1.5)"), "it counts steps, in"),
    "number as a text": (('"largest speed"', "3"), '"top_speed_m_s" has 3 as its `description`; it must be a text'),
    "number as the source": (given("source=3"), "the model has 3 as its `source`; it must be a text"),
    "wrong keyword": (("metrics=Metrics", "metrix=Metrics"),
                      "unexpected keyword argument 'metrix'; did you mean \"metrics\"?; it takes name, title, inputs"),
}  # fmt: skip


def test_a_contradiction_is_named_where_the_model_is_made(tmp_path):
    for mistake, (*edits, sentence) in CONTRADICTIONS.items():
        refused(tmp_path / mistake, edits, sentence, "MODEL = model(")


def test_a_record_of_an_extremum_of_no_known_kind_is_refused():
    top = Extremum("top", "speed_m_s", "maximum")
    with pytest.raises(ModelError, match='"top" has the kind "maximum"; known are "max", "min", "last_above"'):
        replace(load_campaign("minimal").model, extrema=(top,))


def test_a_name_that_physics_does_not_know_gets_its_fix(tmp_path):
    memory = in_front("from collections import namedtuple\n\nMemory = namedtuple('Memory', 'a', defaults=(0.0,))")
    for number, (arguments, result, sentence) in enumerate([
        ("draws", "draws.normal()", "for noise hand it to normal_pair(draws, index) of mc_engine.lanes.noise"),
        ("draws", "draws[0]", "subscriptable; for noise hand it to normal_pair(draws, index) of mc_engine.lanes.noise"),
        ("draws", "3.0 * draws", "'Draws'; for noise hand it to normal_pair(draws, index) of mc_engine.lanes.noise"),
        ("s", "vx", "name 'vx' is not defined; write `s.vx`"),
        ("s", "s.x > 1.0 & s.x < 2.0", "each in parentheses: (a > b) & (c > d)"),
        ("s", "draws.key", "a function takes what it names: write `draws` among the arguments of `control`"),
        ("s", "exp(s.x)", "name 'exp' is not defined; import it from mc_engine.lanes"),
    ]):  # fmt: skip
        control = in_front(f"@physics\ndef control({arguments}):\n    return Memory(a={result})")
        edits = [control, memory, given("memory=Memory", "control=control")]
        (found,) = breaches(campaign_with(tmp_path / str(number), *edits))
        assert found.endswith(sentence)


def test_a_key_or_a_function_of_which_python_keeps_the_last_alone_is_named(tmp_path):
    event = '"apogee": Event(climb, "falling", "stop")'
    (found,) = breaches(campaign_with(tmp_path / "key", (event, f"{event}, {event}")))
    assert "the key 'apogee' of a dictionary is in line" in found
    climb = "@physics\ndef climb(s):\n    return s.x"
    (found,) = breaches(campaign_with(tmp_path / "twice", in_front(climb)))
    assert "the function `climb` is in line" in found
    kept = (
        in_front(f"OTHER = Event(climb)\n\n\n{climb}"),
        in_front(f"def other(s, of=climb):\n    return of(s)\n\n\n{climb}"),
        in_front("from typing import overload\n\n\n@overload\ndef climb(s): ...", "climb"),
    )
    for number, edit in enumerate(kept):
        assert breaches(campaign_with(tmp_path / str(number), edit)) == []


VY, ALTITUDE = 'vy_m_s="vy", class_m="more"', 'altitude_km="altitude", lambda_m="more"'
# text of the smallest model, what stands in its place, on which line, the sentence
LINES = [
    ("low=150.0", "lo=150.0", "Parameter(",
     "unexpected keyword argument 'lo'; did you mean \"low\"?; it takes default, description, low"),
    (CLOCK, "FixedStep(step=10.0)", "clock=", "missing 1 required positional argument: 'until'; it takes step, until,"),
    (CLOCK, "FixedStep(1.0, 9.0, 1, 'rk4', 5)", "clock=", "6 were given; it takes step, until,"),
    ("low=150.0", "unit=None, low=150.0", "Inputs = inputs(",
     '"altitude_km" has None as its `unit`; it must be a text'),
    ("@physics\ndef initial", "@physics()\ndef initial", "@physics()", "stands alone on the line above a function"),
    ("@physics\ndef initial", "physics(3)\ndef initial", "physics(3)", "physics marks a function, not 3"),
    ('vy_m_s="vy"', VY, VY, "State: Type names and field names cannot be a keyword: 'class'"),
    ('altitude_km="altitude"', ALTITUDE, ALTITUDE, "field names cannot be a keyword: 'lambda'"),
    (IMPORTS, "from mc_engine.lanes import arctan,", "import arctan", 'lanes has no "arctan"; did you mean "atan"?'),
    (IMPORTS, f"from mc_engine.physics.curves import curve\nTHRUST = curve(between='linear')\n{IMPORTS}", "between",
     "curve: got an unexpected keyword argument 'between'; it takes file, x, y, kind, outside, x_unit, y_unit"),
    (IMPORTS, f"from .guidance import k\n{IMPORTS}", "from .guidance", ": an import from a dot"),
    (IMPORTS, f"from mc_engine.lanes import abs\n{IMPORTS}", "import abs", ' has no "abs"; physics takes that of Py'),
]  # fmt: skip


def test_a_record_made_wrongly_and_an_import_from_a_dot_are_named_at_their_line(tmp_path):
    for number, (old, new, text, sentence) in enumerate(LINES):
        refused(tmp_path / str(number), [(old, new)], sentence, text)


def test_only_a_file_in_another_encoding_is_to_be_saved_as_utf_8(tmp_path):
    for wrong in ("raise KeyError('encoding')", "FOLDER = 'C:\\Users'"):
        with pytest.raises(CampaignError) as error:
            campaign_with(tmp_path / wrong[:5], (IMPORTS, f"{wrong}\n{IMPORTS}"))
        assert "save the file" not in str(error.value)


def test_a_module_beside_the_model_is_called_by_its_file(tmp_path):
    campaign_with(tmp_path)
    (tmp_path / "guidance.py").write_text("gain = 1.0\n")
    refused(tmp_path, [(IMPORTS, f"from guidance import gian\n{IMPORTS}")], ': guidance.py has no "gian"; did you mean')


def test_a_model_in_the_form_of_version_0_1_is_pointed_to_the_change_log(tmp_path):
    old_form = ('altitude_km="altitude"', 'altitude_km=Field("altitude_km", "km", "altitude")')
    sentence = "; CHANGELOG.md says under 0.2.0 how to convert a model of version 0.1"
    refused(tmp_path, [("import Event,", "import Event, Field,"), old_form], sentence, "Outputs = outputs(")


@pytest.mark.parametrize(
    "record",
    [
        'Parameter("mass_kg", "kg", "mass", 1.0, low=0.0)',
        'Parameter("mass_kg", "kg", "mass", 1.0, 0.0, 9.0)',
        'Setting("law", "", "law", "a", choices=("a",))',
    ],
)
def test_inputs_in_the_form_of_version_0_1_are_pointed_to_the_change_log(tmp_path, record):
    sentence = "CHANGELOG.md says under 0.2.0 how to convert a model of version 0.1"
    refused(
        tmp_path, [(IMPORTS, f"from mc_engine.model import Parameter, Setting\n\nOLD = {record}\n{IMPORTS}")], sentence
    )


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("attitude import body_matrix", "use to_matrix of mc_engine.physics.rotations"),
        ("attitude import quaternion_product", "use product of mc_engine.physics.rotations"),
        ("aerodynamics import over_mach", "use curve of mc_engine.physics.curves"),
    ],
)
def test_a_function_of_version_0_1_names_what_replaces_it(tmp_path, old, new):
    refused(tmp_path, [(IMPORTS, f"from mc_engine.physics.{old}\n{IMPORTS}")], f"; {new}; CHANGELOG.md says")
