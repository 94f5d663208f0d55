"""Records of a model that contradict themselves or one another: named where the model is made."""

import pytest
from mistaken_campaign import campaign_with, line_of

from mc_engine.errors import CampaignError

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
    "kind of extremum": (('"speed", "speed_m_s")', '"speed", "speed_m_s", "maximum")'), 'has the kind "maximum"'),
    "unit and name": (('"altitude_km", "km", "altitude of the c', '"altitude_km", "m", "altitude of the c'),
                      '"altitude_km" has the unit "m", so that its name must end in "_m"; change the name or the unit'),
    "missing comma": (('(Event("apogee", "falling", "stop"),)', 'Event("apogee", "falling", "stop")'),
                      "as its `event_list`; it must be a tuple, each item Event; one alone needs its comma, (...,)"),
    "a metric of the engine's name": (('Field("apogee_time_s", "s"', 'Field("case_id", ""'),
                                      'the column "case_id" has the name of a column that every table has'),
    "a quantity of the engine's name": (('Field("speed_m_s", "m/s"', 'Field("t_s", "s"'), 'the quantity "t_s" has the'),
    "control without a memory": (("    initial=initial", "    control=rhs,\n    initial=initial"),
                                 "the model has `control`, but no function `start`; write start(p, o)"),
    "default of nobody": (("Model, Parameter", "Model, Parameter, Setting"),
                          ("    settings=(),", '    settings=(Setting("law", "", "law", "c", choices=("a", "b")),),'),
                          'setting "law" has the default \'c\'; known are "a", "b"'),
    "a text as a default": (("300.0, low", '"300", low'), "\"altitude_km\" has '300' as its `default`; it must"),
    "sampling between steps": ((CLOCK, "FixedStep(step=1.0, until=5.0, control_every=1.5)"), "it counts steps, in"),
    "no unit": (('"km", "altitude of the c', 'None, "altitude of the c'), '"altitude_km" has None as its `unit`; it'),
    "number as a text": (('"largest speed"', "3"), '"top_speed_m_s" has 3 as its `description`; it must be a text'),
    "number as the source": (('source=""', "source=3"), "the model has 3 as its `source`; it must be a text"),
    "wrong keyword": (("metrics=(", "metrix=("),
                      "unexpected keyword argument 'metrix'; did you mean \"metrics\"?; it takes name, "),
}  # fmt: skip


def test_a_contradiction_is_named_where_the_model_is_made(tmp_path):
    for mistake, (*edits, sentence) in CONTRADICTIONS.items():
        with pytest.raises(CampaignError) as error:
            campaign_with(tmp_path / mistake, *edits)
        (problem,) = error.value.problems
        assert problem.message.startswith(f"model.py, line {line_of(tmp_path / mistake, 'MODEL = Model(')}: "), mistake
        assert sentence in problem.message


@pytest.mark.parametrize(
    ("old", "new", "spot", "sentence"),
    [
        (
            "low=150.0",
            "lo=150.0",
            "Parameter(",
            "unexpected keyword argument 'lo'; did you mean \"low\"?; it takes default, description, low",
        ),
        (
            CLOCK,
            "FixedStep(step=10.0)",
            "clock=",
            "missing 1 required positional argument: 'until'; it takes step, until,",
        ),
        (
            CLOCK,
            "FixedStep(1.0, 9.0, 1, 'rk4', 5)",
            "clock=",
            "6 were given; it takes step, until,",
        ),
        ("@physics\ndef initial", "@physics()\ndef initial", "@physics()", "stands alone on the line above a function"),
        ("@physics\ndef initial", "physics(3)\ndef initial", "physics(3)", "physics marks a function, not 3"),
    ],
)
def test_a_record_made_wrongly_is_named_at_its_line(old, new, spot, sentence, tmp_path):
    with pytest.raises(CampaignError) as error:
        campaign_with(tmp_path, (old, new))
    (problem,) = error.value.problems
    assert problem.message.startswith(f"model.py, line {line_of(tmp_path, spot)}: ")
    assert sentence in problem.message


@pytest.mark.parametrize(("old", "word"), [('"x y vx vy"', "class"), ('"altitude speed"', "lambda")])
def test_a_field_that_is_a_word_of_python_is_named_at_its_line(old, word, tmp_path):
    new = f'{old[:-1]} {word}"'
    with pytest.raises(CampaignError) as error:
        campaign_with(tmp_path, (old, new))
    assert f"model.py, line {line_of(tmp_path, new)}: ValueError: " in str(error.value)
    assert f"field names cannot be a keyword: '{word}'" in str(error.value)


def test_an_import_from_a_dot_is_named_at_its_line(tmp_path):
    with pytest.raises(CampaignError) as error:
        campaign_with(tmp_path, (IMPORTS, f"from .guidance import k\n{IMPORTS}"))
    (problem,) = error.value.problems
    assert problem.message.startswith(f"model.py, line {line_of(tmp_path, 'from .guidance')}: an import from a dot")
