"""Mistakes of a newcomer in the smallest model: `check` and `run` say the same sentence, and nothing of it is flown."""

import subprocess
import sys

import numpy as np
import pytest
from mistaken_campaign import campaign_with, line_of, write_campaign
from small_run import ENVIRONMENT

from mc_engine import flight
from mc_engine.errors import CampaignError, ModelError
from mc_engine.model_contract import breaches
from mc_engine.model_faults import MORE
from mc_engine.runner import run

ACCELERATION = "    g = -MU_EARTH / (r2 * sqrt(r2))\n"
DERIVATIVE = "    return State(s.vx, s.vy, g * s.x, g * s.y)"
EVENT = "    return Events(s.x * s.vx + s.y * s.vy)"
METRICS = "    return Metrics("
IMPORTS = "from mc_engine.lanes import"
RHS = "@physics\ndef rhs"
CLOCK = "FixedStep(step=10.0, until=10_000.0)"


def then(line):
    """An edit: one more line in `rhs`."""
    return (ACCELERATION, f"{ACCELERATION}    {line}\n")


def first(line):
    return (IMPORTS, f"{line}\n{IMPORTS}")


# name: (edits, text on the line that is named, sentence)
MISTAKES = {
    "one metric more": (
        [('top_speed")', 'top_speed more")'), ("t, best.speed)", "t, best.speed, t)")],
        "@physics\ndef evaluate",
        '`evaluate` gives 4 numbers, the model declares 3 in `metrics`; "more" is too many',
    ),
    "one metric fewer": (
        [(' top_speed")', '")'), ("t, best.speed)", "t)")],
        "@physics\ndef evaluate",
        '`evaluate` gives 2 numbers, the model declares 3 in `metrics`; "top_speed" is missing',
    ),
    "events that are not declared": (
        [('"apogee")', '"apogee b c d")'), (EVENT, EVENT.replace(")", ", t, t, t)"))],
        "@physics\ndef events",
        '`events` gives 4 numbers, the model declares 1 in `event_list`; "b", "c", "d" is too many',
    ),
    "no event list": (
        [('    event_list=(Event("apogee", "falling", "stop"),),\n', "")],
        "@physics\ndef events",
        "`events` gives 1 numbers, the model declares 0 in `event_list`",
    ),
    "an event of another name": (
        [('Event("apogee"', 'Event("apogeee"')],
        "@physics\ndef events",
        '`events` gives "apogee", event_list names "apogeee"; use the same names',
    ),
    "quantities that are not declared": (
        [('"altitude speed"', '"altitude speed more"'), ("s.vx * s.vx + s.vy * s.vy))", "s.vx * s.vx), t)")],
        "@physics\ndef observe",
        "`observe` gives 3 numbers, the model declares 2 in `quantities`",
    ),
    "states in another order": (
        [('"x y vx vy"', '"x y vy vx"')],
        "@physics\ndef initial",
        '`initial` gives "x", "y", "vy", "vx"; `states` declares them in the order "x", "y", "vx", "vy"',
    ),
    "too few derivatives": (
        [(DERIVATIVE, "    return State(s.vx, s.vy, g * s.x)")],
        "    return State(s.vx, s.vy, g * s.x)",
        "State is made without 'vy'; give every field",
    ),
    "a plain tuple": (
        [(DERIVATIVE, "    return s.vx, s.vy, g * s.x, g * s.y")],
        RHS,
        "`rhs` gives tuple; it must return a named tuple",
    ),
    "no return": ([(DERIVATIVE, DERIVATIVE.replace("return ", ""))], RHS, "`rhs` gives nothing; it must return"),
    "a text in the state": (
        [(DERIVATIVE, DERIVATIVE.replace("g * s.y", "'a'"))],
        RHS,
        "`rhs` gives 'a' for \"vy\"; it must be one number",
    ),
    "a list": ([then("a = [s.x, s.y]")], "    a = [", "a list, dictionary or set is made in every step of `rhs`"),
    "a truth value as an event": (
        [(EVENT, EVENT.replace(")", " < 0.0)"))],
        "@physics\ndef events",
        '`events` gives a truth value for "apogee"; give a number that crosses zero',
    ),
    "and": ([then("g = g if r2 > 1e10 and s.x > 0.0 else 2.0 * g")], "    g = g if", "use where(condition, a, b)"),
    "if on the time": ([then("g = g if t > 1.0 else 0.0")], "    g = g if", "use where(condition, a, b)"),
    "a comparison in two parts": ([then("g = g * (0.0 < s.x < 5.0)")], "    g = g * (", "use where(condition, a, b)"),
    "max": ([then("g = g + 0.0 * max(s.x, 0.0)")], "    g = g + ", "use maximum(a, b) of mc_engine.lanes"),
    "int": ([then("g = g + 0.0 * int(s.x)")], "    g = g + ", "or int() or float(), on a number that differs"),
    "range of a number of each case": (
        [then("for _ in range(r2):\n        g = g + 0.0")],
        "    for _ in",
        "a loop over a number that differs from case to case; loop over a fixed number",
    ),
    "while": (
        [then("while r2 > 1.0:\n        r2 = 0.5 * r2")],
        "    while r2",
        "`while` in `rhs` may never end for some case; write for k in range(most)",
    ),
    "a loop without end": ([then("while True:\n        pass")], "    while True", "`while` in `rhs` may never end"),
    "print": ([then("print(g)")], "    print(g)", "`print` in `rhs` runs in every step of every case; let `observe`"),
    "print in a helper": (
        [(RHS, f"@physics\ndef told(x):\n    print(x)\n    return x\n\n\n{RHS}"), then("g = told(g)")],
        "    print(x)",
        "`print` in `told` runs in every step of every case",
    ),
    "a file": ([then("f = open('x')")], "    f = open", "`open` is not for physics, and `rhs` calls it"),
    "a helper that is not marked": (
        [(RHS, f"def square(x):\n    return x * x\n\n\n{RHS}"), ("r2 = s.x * s.x + ", "r2 = square(s.x) + ")],
        "def square",
        "`square` is not marked, and `rhs` calls it; write @physics on the line above",
    ),
    "an array in a helper": (
        [
            first("import numpy as np"),
            (RHS, f"@physics\ndef room(x):\n    a = np.zeros(2)\n    return x\n\n\n{RHS}"),
            then("g = room(g)"),
        ],
        "    a = np.zeros(2)",
        "`np.zeros` makes an array or list in every step of `room`",
    ),
    "numpy": (
        [first("import numpy as np"), then("g = g + 0.0 * np.sin(s.x)")],
        "    g = g + ",
        "`np.sin` in `rhs` is for arrays; physics uses the functions of mc_engine.lanes",
    ),
    "a list outside": (
        [(RHS, f"COUNT = [0]\n\n\n{RHS}"), then("COUNT[0] = COUNT[0] + 1")],
        "    COUNT[0] = ",
        "`COUNT` in `rhs` is a list outside of it; physics reads numbers and tuples",
    ),
    "global": (
        [(RHS, f"COUNT = 0\n\n\n{RHS}"), then("global COUNT\n    COUNT += 1")],
        "    global COUNT",
        "`global COUNT` in `rhs`: a case must depend on its inputs and case_id alone",
    ),
    "the clock of the machine": (
        [first("import time"), then("g = g + 1e-12 * time.time()")],
        "    g = g + ",
        "`time.time` in `rhs`: a case must depend on its inputs and case_id alone",
    ),
    "chance": (
        [first("from random import random"), then("g = g + 1e-12 * random()")],
        "    g = g + ",
        "`random` in `rhs`: a case must depend on its inputs and case_id alone; noise comes from the `draws`",
    ),
    "chance of numpy": (
        [first("import numpy as np"), then("g = g + 1e-12 * np.random.normal()")],
        "    g = g + ",
        "`np.random.normal` in `rhs`: a case must depend on its inputs and case_id alone",
    ),
    "a function that calls itself": (
        [then("q = rhs(t, s, m, p, o)")],
        RHS,
        "`rhs` calls itself; physics has no recursion, unroll it",
    ),
    "two functions that call one another": (
        [
            (RHS, f"@physics\ndef pulled(x):\n    return initial(x, x).x\n\n\n{RHS}"),
            ("    r, dv = ", "    pulled(p)\n    r, dv = "),
        ],
        "@physics\ndef initial",
        "`initial` calls itself",
    ),
    "a name that is not imported": (
        [("cos, physics, sin, sqrt", "cos, physics, sin")],
        "    return State(r, 0.0",
        '"sqrt" is not defined; import it from mc_engine.lanes',
    ),
    "a metric in one branch": (
        [(METRICS, f"    for k in range(0):\n        top = best.speed\n{METRICS}"), ("t, best.speed)", "t, top)")],
        "    return Metrics(",
        '"top" is set in one branch only; set it always, with where(condition, a, b)',
    ),
    "an extremum of another name": ([("best.speed", "best.sped")], METRICS, 'there is no "sped" in Best(speed)'),
    "a setting's word": (
        [
            ("    settings=(),", '    settings=(Setting("law", "", "law of the burn", "b", choices=("a", "b")),),'),
            ("Model, Parameter", "Model, Parameter, Setting"),
            then('g = 2.0 * g if o.law == "b" else g'),
        ],
        "    g = 2.0 * g if",
        "`o.law == 'b'` in `rhs` compares with a text; in physics a setting is a number; 'b' is 1.0, its place in",
    ),
    "chance of an object": (
        [first("import numpy as np"), (RHS, f"RNG = np.random.default_rng()\n\n\n{RHS}"), then("g = g * RNG.normal()")],
        "    g = g * RNG",
        "`RNG.normal` in `rhs`: a case must depend on its inputs and case_id alone; noise comes from the `draws`",
    ),
    "an import inside": (
        [then("from math import pi")],
        "    from math import pi",
        "`from math import pi` in `rhs`; move the import to the top of the file",
    ),
    "an array that is written": (
        [first("import numpy as np"), (RHS, f"K = np.zeros(3)\n\n\n{RHS}"), then("K[0] = 1.0")],
        "    K[0] = 1.0",
        "`K[0]` is written in `rhs`, where arrays and tuples are only read; what changes is kept in the state",
    ),
    "a record made from another": (
        [(DERIVATIVE, "    return s._replace(x=s.vx, y=s.vy, vx=g * s.x, vy=g * s.y)")],
        "    return s._replace",
        "`s._replace` in `rhs`: compiled physics makes a named tuple anew; write State(...) with every field",
    ),
    "a loop for days": (
        [then("for _ in range(10 ** 12):\n        g = g + 0.0")],
        "    for _ in",
        "`range(10 ** 12)` in `rhs` goes round more than 1,000,000 times a step",
    ),
    "a count for days": (
        [then("k = 0\n    while k < 10 ** 12:\n        k += 1")],
        "    while k",
        "`while` in `rhs` may never end for some case",
    ),
    "tables in two columns": (
        [
            first("import numpy as np"),
            ("MODEL = Model(", "def tables(o):\n    return np.zeros((3, 2))\n\n\nMODEL = Model("),
            ("    initial=initial", "    tables=tables,\n    initial=initial"),
            ("sin, sqrt", "look_up, sin, sqrt"),
            then("g = g + look_up(o.tables, 1.0)"),
        ],
        "def tables",
        "`tables` gives an array of shape (3, 2); it must give float64[n], numbers in one row",
    ),
    "a setting of nobody": ([then("g = g + 0.0 * o.foo")], "    g = g + ", 'there is no "foo" in Settings(unused)'),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_run_refuses_before_it_flies_what_check_names(mistake, tmp_path):
    edits, spot, sentence = MISTAKES[mistake]
    campaign = campaign_with(tmp_path / "model", *edits)
    found = breaches(campaign)
    assert len(found) == 1, found
    assert found[0].startswith(f"model.py, line {line_of(tmp_path / 'model', spot)}: ")
    assert sentence in found[0]
    assert "\n" not in found[0]
    with pytest.raises(ModelError) as refused:
        run(campaign, tmp_path / "run")
    assert str(refused.value) == found[0] + MORE
    assert not (tmp_path / "run").exists()
    inputs = {one.name: one.default for one in (*campaign.model.parameters, *campaign.model.settings)}
    with pytest.raises(ModelError) as refused:  # whoever flies the model without a campaign is told so, too
        flight.fly(campaign.model, inputs, np.arange(3), 1, folder=campaign.directory)
    assert str(refused.value) == found[0] + MORE


CONTRADICTIONS = {
    "direction": (('"falling"', '"down"'), 'event "apogee" has the direction "down"; known are "rising", "falling"'),
    "action": (('"stop"', '"record"'), 'event "apogee" has the action "record"; known are "stop", "switch"'),
    "switch without function": (('"stop"', '"switch"'), 'event "apogee" has the action "switch", but the model has no'),
    "negative step": ((CLOCK, "FixedStep(step=-10.0, until=1.0)"), "the clock's `step` is -10.0; it must be a number"),
    "no step": ((CLOCK, "FixedStep(step=0, until=1.0)"), "the clock's `step` is 0; it must be a number above 0"),
    "NaN": ((CLOCK, "FixedStep(step=float('nan'), until=1.0)"), "the clock's `step` is nan; it must be a number above"),
    "text": ((CLOCK, 'FixedStep(step="10", until=1.0)'), "the clock's `step` is \"10\", and no setting has this name"),
    "end in the past": ((CLOCK, "FixedStep(step=1.0, until=-5)"), "the clock's `until` is -5; it must be a number"),
    "sampling": ((CLOCK, "FixedStep(step=1.0, until=5.0, control_every=0)"), "`control_every` is 0; it must be"),
    "method": ((CLOCK, 'FixedStep(step=1.0, until=5.0, method="euler")'), 'the clock has the method "euler"'),
    "kind of extremum": (('"speed", "speed_m_s")', '"speed", "speed_m_s", "maximum")'), 'has the kind "maximum"'),
    "unit and name": (('"altitude_km", "km", "altitude of the c', '"altitude_km", "m", "altitude of the c'),
                      '"altitude_km" has the unit "m", so that its name must end in "_m"; change the name or the unit'),
    "missing comma": (('(Event("apogee", "falling", "stop"),)', 'Event("apogee", "falling", "stop")'),
                      "`event_list` must be a tuple of Event; one alone needs its comma, (Event(...),)"),
    "a metric of the engine's name": (('Field("apogee_time_s", "s"', 'Field("case_id", ""'),
                                      'the column "case_id" has the name of a column that every table has'),
    "a quantity of the engine's name": (('Field("speed_m_s", "m/s"', 'Field("t_s", "s"'), 'the quantity "t_s" has the'),
    "control without a memory": (("    initial=initial", "    control=rhs,\n    initial=initial"),
                                 "the model has `control`, but no function `start`; write start(p, o)"),
    "default of nobody": (("Model, Parameter", "Model, Parameter, Setting"),
                          ("    settings=(),", '    settings=(Setting("law", "", "law", "c", choices=("a", "b")),),'),
                          'setting "law" has the default \'c\'; known are "a", "b"'),
    "a text as a default": (("300.0, low", '"300", low'), "\"altitude_km\" has '300' where a number is wanted"),
    "sampling between steps": ((CLOCK, "FixedStep(step=1.0, until=5.0, control_every=1.5)"), "it counts steps, in"),
    "no unit": (('"km", "altitude of the c', 'None, "altitude of the c'), '"altitude_km" has None as its unit; it'),
    "number as a text": (('"largest speed"', "3"), '"top_speed_m_s" has 3 as its description; it must be a text'),
    "number as the source": (('source=""', "source=3"), "the model's `source` is 3; it must be a text"),
    "wrong keyword": (("metrics=(", "metrix=("), 'Model has no `metrix`; did you mean "metrics"?'),
}  # fmt: skip


@pytest.mark.parametrize("mistake", CONTRADICTIONS)
def test_a_contradiction_is_named_where_the_model_is_made(mistake, tmp_path):
    *edits, sentence = CONTRADICTIONS[mistake]
    with pytest.raises(CampaignError) as error:
        campaign_with(tmp_path, *edits)
    (problem,) = error.value.problems
    assert problem.message.startswith(f"model.py, line {line_of(tmp_path, 'MODEL = Model(')}: ")
    assert sentence in problem.message


@pytest.mark.parametrize(
    ("old", "new", "spot", "sentence"),
    [
        ("low=150.0", "lo=150.0", "Parameter(", 'Parameter has no `lo`; did you mean "low"?'),
        (CLOCK, "FixedStep(step=10.0)", "clock=", "FixedStep needs `until`"),
        (
            CLOCK,
            "FixedStep(1.0, 9.0, 1, 'rk4', 5)",
            "clock=",
            "FixedStep has too many arguments; it takes step, until,",
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
    assert f'model.py, line {line_of(tmp_path, new)}: the name "{word}" is a word of Python' in str(error.value)


ADAPTIVE = [(CLOCK, "AdaptiveStep(until=10_000.0)"), ("FixedStep", "AdaptiveStep")]
UNEQUAL = ["one metric more", "one metric fewer", "events that are not declared", "quantities that are not declared"]


@pytest.mark.parametrize("clock", [[], ADAPTIVE], ids=["fixed", "adaptive"])
@pytest.mark.parametrize("mistake", UNEQUAL)
def test_no_kernel_is_built_for_other_counts_than_the_model_declares(mistake, clock, tmp_path, monkeypatch):
    monkeypatch.setattr(flight, "refuse_unfit", lambda *model: None)
    model = campaign_with(tmp_path, *MISTAKES[mistake][0], *clock).model
    inputs = {one.name: one.default for one in model.parameters}
    with pytest.raises(ModelError, match=r"the physics gives \d+ numbers where the model declares \d"):
        flight.fly(model, inputs, np.arange(3), 1, folder=tmp_path)


@pytest.mark.parametrize("verb", ["check", "run"])
def test_the_command_line_says_it_in_one_line(verb, tmp_path):
    write_campaign(tmp_path / "model", *MISTAKES["one metric more"][0])
    options = ["--out", str(tmp_path / "run")] if verb == "run" else []
    command = [sys.executable, "-m", "mc_engine", verb, str(tmp_path / "model"), *options]
    done = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT, check=False)
    assert done.returncode == 2
    assert MISTAKES["one metric more"][2] in done.stderr.splitlines()[-1]
    assert not (tmp_path / "run").exists()
