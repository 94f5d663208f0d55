"""Mistakes of a newcomer in the smallest model: one sentence with the place and the fix, before anything is flown."""

import re

import numpy as np
import pytest
from mistaken_campaign import campaign_with, given, in_front, line_of, with_evaluate, with_input, write_campaign

from mc_engine.errors import ModelError
from mc_engine.flight import flight
from mc_engine.flight.contract import breaches
from mc_engine.flight.contract_flight import faults
from mc_engine.lanes import any_lane, where
from mc_engine.model.faults import MORE
from mc_engine.runner.runner import run
from tests.mc_engine.told import told

ACCELERATION = "    g = -MU_EARTH * rsqrt(r2) ** 3\n"
DERIVATIVE = "    return State(x=s.vx, y=s.vy, vx=g * s.x, vy=g * s.y)"
EVENT = "    return s.x * s.vx + s.y * s.vy"
END = "speed=sqrt(s.vx * s.vx + s.vy * s.vy))"  # of `observe`
SIGNATURE = ("def rhs(s)", "def rhs(t, s, m, p, o)")
IMPORTS = "from mc_engine.lanes import"
RHS = "@physics\ndef rhs"
CLOCK = "FixedStep(step=10.0, until=10_000.0)"
LANES = ("cos, physics, rsqrt, sin, sqrt", "any_lane, cos, physics, rsqrt, sin, sqrt, where")
HERE = "  # here"  # ends the line that the sentence must name; the first one of `rhs` without


def with_lines(lines, before="", setting=""):
    """Edits: more lines in `rhs`; imports, or definitions, before it; a setting with the choices a and b."""
    imports = "".join(f"{line}\n" for line in before.splitlines() if re.match(r"(from|import) ", line))
    rest = "".join(f"{line}\n" for line in before.splitlines() if f"{line}\n" not in imports)
    edits = [LANES, SIGNATURE, (IMPORTS, f"{imports}{IMPORTS}"), (RHS, f"{rest}\n\n{RHS}"),
             (ACCELERATION, ACCELERATION + "".join(f"    {line}\n" for line in lines.splitlines()))]  # fmt: skip
    return [*edits, *(with_input(f'{setting}=Setting("b", "law", choices=("a", "b"))') if setting else [])]


def refused(folder, edits):
    """The only sentence on a model with these edits; it shows nothing of arrays, and no folder."""
    found = breaches(campaign_with(folder, *edits))
    assert len(found) == 1, found
    assert not any(word in found[0] for word in ("ndarray", str(folder), "\n"))
    return found[0]


def place(folder, lines):
    """How the sentence on a line begins that ends with HERE, or is the first of these lines."""
    source = (folder / "model.py").read_text()
    if HERE in source:
        text = next(line for line in source.splitlines() if line.endswith(HERE)).strip()
    else:
        text = lines.splitlines()[0]
    return re.escape(f"model.py, line {line_of(folder, text)}: `{' '.join(text.split())[:40]}") + ".*`: "


EACH_CASE = "differs from case to case; use where(condition, a, b), minimum, maximum, rint or look_up"
ALLOWED = "write it with + - * / and comparisons, where(condition, a, b), named tuples, `for k in range(n)`"
CHANGES = "what changes is kept in the state or in the memory"
UNMARKED = "is not marked; write @physics on the line above it"
FIELDS = [f"f{number}" for number in range(16)]
MANY = f"from collections import namedtuple\nMany = namedtuple('Many', {FIELDS})"
ARRAY, TABLE = "import numpy as np\nK = np.ones(2)", "T = (1.0, 2.0)"
# (lines in `rhs`, words of the sentence, what stands before `rhs`)
LINES = [
    # syntax
    *((f"a = {kept}", "keep numbers in tuples and named tuples") for kept in ("[s.x, s.y]", "{1.0: s.x}")),
    ("a = [c for c in (s.x, s.y)]", "write its terms out, or loop with `for`"),
    ("r2 = sum(c * c for c in (s.x, s.y))", "write its terms out, or loop with `for`"),
    ("yield g", "write def and `return`"),
    ("a = kept(g)", "write def", f"@physics{HERE}\nasync def kept(x):\n    return x"),
    ("a = kept(g)", "behind a `*`", f"@physics{HERE}\ndef kept(x, *, gain=1.0):\n    return x * gain"),
    ("with LOCK:\n    g = g * 1.0", "leave it out", "from threading import Lock\nLOCK = Lock()"),
    ("with open('x'):\n    g = g * 1.0", "leave it out"),
    ("from math import pi", "move it to the top of the file"),
    ("global COUNT\nCOUNT += 1", CHANGES, "COUNT = 0"),
    ("g = s.x @ s.y", "write the products and their sum out"),
    ("g = where(~(s.x > 0.0), g, 0.0)", "write `not mask`"),
    ("del r2", ALLOWED),
    ("a = f'{g}'", ALLOWED),
    ("x, *v = s", "assigns to its own names, each by itself"),
    ("s.x += 1.0", "State(...) with every field"),
    ("K[0] = 1.0", CHANGES, ARRAY),
    ("COUNT[0] = COUNT[0] + 1", CHANGES, "COUNT = [0]"),
    (f"try:\n    g = g * 1.0\nexcept ZeroDivisionError:{HERE}\n    g = 0.0", "keep them in range with where("),
    ("g = (g + 0j).real", "keep two parts as two numbers"),
    ("while r2 > 1.0:\n    g = g * 1.0", "write for k in range(most)"),
    ("while True:\n    pass", "write for k in range(most)"),
    ("g = where((s.x > 0.0) is False, g, g)", "a condition stands alone or behind `not`"),
    # what is called or read
    ("print(g)", "let `observe` give"),
    ("g = told(g)", "let `observe` give", f"@physics\ndef told(x):\n    print(x){HERE}\n    return x"),
    ("f = open('x')", "`open` is not for physics"),
    ("g = square(g)", f"`square` {UNMARKED}", "def square(x):\n    return x * x"),
    ("g = told(square, g)", f"`square` {UNMARKED}",
     "def square(x):\n    return x * x\n@physics\ndef told(f, x):\n    return f(x)"),
    ("g = Earth.pull(g)", f"`pull` {UNMARKED}", "class Earth:\n    @staticmethod\n    def pull(x):\n        return x"),
    ("g = room(g)", "`zeros` is not for physics",
     f"import numpy as np\n@physics\ndef room(x):\n    a = np.zeros(2){HERE}\n    return x"),
    ("g = g + 0.0 * np.sin(s.x)", "functions of mc_engine.lanes", ARRAY),
    ("g = g + 1e-12 * time.time()", "`time` is not for physics, which has no clocks", "import time"),
    ("g = g + 1e-12 * random()", "noise comes from the `draws` of `control`", "from random import random"),
    ("g = g + 1e-12 * np.random.normal()", "noise comes from the `draws` of `control`", ARRAY),
    ("g = g * RNG.normal()", "noise comes from the `draws`", "import numpy as np\nRNG = np.random.default_rng()"),
    ("a = rhs(t, s, m, p, o)", "`rhs` calls itself; physics has no recursion", f"# none{HERE}"),
    ("g = s.x.sum()", "functions are those of mc_engine.lanes"),
    ("return s._replace(x=s.vx)", "State(...) with every field or replace(s, x=...) of mc_engine.lanes"),
    ("g = g * Earth.mu[0]", "a list outside of physics changes", "class Earth:\n    mu = [1.0]"),
    ("g = Foo(g).x", "make it a namedtuple", "class Foo:\n    def __init__(self, x):\n        self.x = x"),
    ("g = g * EARTH.mu", "`Planet` is not for physics",
     "from dataclasses import dataclass\n@dataclass\nclass Planet:\n    mu: float\nEARTH = Planet(1.0)"),
    ('g = 2.0 * g if o.law == "b" else g',
     "a setting is a number, not a text; CHOICES = choices(Inputs) has it as CHOICES.law.word"),
    ('g = 2.0 * g if o.law in ("a", "b") else g', "a setting is a number, not a text"),
    # numbers that differ from case to case
    (f"a = Many(f0=g if o.law > 0.5 else t, {', '.join(f'{name}=g' for name in FIELDS[1:])})",
     "`g if o.law > 0.5 else t` decides within a call of too many arguments; give it a name on a line above", MANY),
    (f"a = Many(f0=g * float(0.0 < t < 5.0), {', '.join(f'{name}=g' for name in FIELDS[1:])})",
     "`0.0 < t < 5.0` decides within a call of too many arguments", MANY),
    ("g = g if r2 > 1e10 and s.x > 0.0 else 2.0 * g", EACH_CASE),
    ("g = g if t > 1.0 else 0.0", EACH_CASE),
    ("if r2 > 1.0:\n    g = 2.0 * g", EACH_CASE),
    ("g = g * (0.0 < s.x < 5.0)", EACH_CASE),
    ("g = g + 0.0 * max(s.x, 0.0)", EACH_CASE),
    ("g = g + 0.0 * min(\n    s.x,\n    s.y,\n)", EACH_CASE),
    ("g = g + 0.0 * int(s.x)", EACH_CASE),
    ("g = round(g)", EACH_CASE),
    ("g = g * math.sqrt(r2)", EACH_CASE, "import math"),
    ("g = g * math.cbrt(r2)", "`cbrt` of Python's math takes a single number; mc_engine.lanes has no", "import math"),
    ("g = g * math.sqrt(2.0) if s.x > 0.0 else g", "`: Python cannot decide", "import math"),
    ("g = g * tan(s.x)", "`tan` of Python's math takes a single number", "from math import tan"),
    ("for _ in range(r2):\n    g = g + 0.0", "loops of a fixed number"),
    ("while r2 > 1.0:\n    r2 = 0.5 * r2", EACH_CASE),
    ("assert s.x > 0.0", EACH_CASE),
    ("g = g if s.x in (0.0, 1.0) else 0.0", EACH_CASE),
    ("g = g * K[s.x]", "look_up", ARRAY),
    ("g = g * K[s.x > 0.0]", "look_up", ARRAY),
    ("g = T[s.x > 0.0]", "look_up", TABLE),
    # what running it shows
    ("for _ in range(10 ** 12):\n    g = g + 0.0", "loops go round more than 1,000,000 times in one step"),
    ("for _ in range(7000):\n    for _ in range(7000):  # here\n        g = g + 0.0", "more than 1,000,000 times"),
    (f"k = 0\nwhile k < 10 ** 12:{HERE}\n    k += 1", "more than 1,000,000 times in one step"),
    (f"k = 0\nwhile k < 5:{HERE}\n    k -= 1", "more than 1,000,000 times in one step"),
    ("g = where(s.x, g, 2.0 * g)", "compare the number, such as x > 0.5"),
    ("g = g * 1.0 if any_lane(s.x) else g", "compare the number, such as x > 0.5"),
    ("far = where(s.x > 0.0, s.y > 0.0, s.y < 0.0)", "write (mask & x) | ((not mask) & y)"),
    ("far = where(s.x > 0.0, (s.x, s.y), (s.y, s.x))", "between named tuples of one class"),
    ("far = (s.x > 0.0) & s.y", "join conditions, each in parentheses: (a > b) & (c > d)"),
    ("far = (s.x > 0.0) - (s.y > 0.0)", "instead; a condition stands where a number must; join conditions with & | ^"),
    ("a = 2.0 * s", ALLOWED),
    ("g = g.norm()", "a number has no attribute 'norm'; write it with"),
    ("g = g * s.vz", "object has no attribute 'vz'; known are \"x\", \"y\", \"vx\", \"vy\"$"),
    ("g = g * p.burn_dv_m_s", "a column's name is without its unit in physics, \"burn_dv\"$"),
    ("g = s.x(2.0)", "a number is not callable; write it with"),
    ("g = g + 0.0 * o.foo", "has no attribute 'foo'"),
    ("g = g * tan(s.x)", "name 'tan' is not defined; import it from mc_engine.lanes"),
    ("n, _ = normal_pair(t, 0)", ALLOWED, "from mc_engine.lanes.noise import normal_pair"),
    (f"for k in range(0):\n    top = g\ng = g + top{HERE}", "cannot access local variable 'top'"),
    (DERIVATIVE.strip().replace(", vy=g * s.y", ""), "State(...) leaves out 'vy'; give every field"),
]  # fmt: skip


def test_a_line_that_is_not_for_physics_is_named_with_its_fix(tmp_path):
    for number, (lines, words, *before) in enumerate(LINES):
        folder = tmp_path / str(number)
        sentence = refused(folder, with_lines(lines, *before, setting="law" if "o.law" in lines else ""))
        expected = r"model\.py, line \d+: `@physics`: " if "calls itself" in words else place(folder, lines)
        assert re.match(expected, sentence), (lines, sentence)
        assert words in f"{sentence}$", (lines, sentence)


def test_a_decision_by_the_state_is_told_also_where_all_cases_start_alike(tmp_path):
    start = "    return State(x=r, y=0.0, vx=dv * sin(p.pitch_error), vy=sqrt(MU_EARTH / r) + dv * cos(p.pitch_error))"
    alike = (start, "    return State(x=7e6, y=0.0, vx=0.0, vy=7.5e3)")
    for number, (lines, words, *before) in enumerate(line for line in LINES if line[1] == EACH_CASE):
        sentence = refused(tmp_path / str(number), [alike, *with_lines(lines, *before)])
        assert re.match(place(tmp_path / str(number), lines) + f".*{re.escape(words)}", sentence), (lines, sentence)
    assert number > 10


def test_two_functions_that_call_one_another_are_recursion(tmp_path):
    pulled = (RHS, f"@physics\ndef pulled(x):\n    return initial(x).x\n\n\n{RHS}")
    sentence = refused(tmp_path, [pulled, ("    r, dv = ", "    pulled(p)\n    r, dv = ")])
    assert sentence.startswith(f"model.py, line {line_of(tmp_path, '@physics')}: ")
    assert "`initial` calls itself" in sentence


# (edits, text on the line that is named, sentence)
OTHER = 'Other = namedtuple("Other", "{}")'
TUPLES = (IMPORTS, f"from collections import namedtuple\n\n{IMPORTS}")
RECORDS = {
    "one metric more": (
        with_evaluate("Metrics(top_speed=best.speed, more=t)"),
        "    return Metrics(",
        'Metrics(...) has no field "more"; known is "top_speed"',
    ),
    "one metric fewer": (
        with_evaluate("Metrics()"),
        "    return Metrics(",
        "Metrics(...) leaves out 'top_speed'; give every field that has no default",
    ),
    "metrics of another record": (
        [TUPLES, in_front(OTHER.format("speed"), "initial"), *with_evaluate("Other(speed=best.speed)")],
        "@physics\ndef evaluate",
        '`evaluate` gives Other(speed); it must give a record with "top_speed"',
    ),
    "an event that is not declared": (
        [in_front("@physics\ndef switch(s, m, hit):\n    return State(x=s.x * hit.moon, y=s.y, vx=s.vx, vy=s.vy), m"),
         given("switch=switch")],
        "    return State(x=s.x * hit.moon",
        "'Events' object has no attribute 'moon'",
    ),
    "an output that is not declared": (
        [(END, END.replace("))", "), more=s.x)"))],
        "    return Outputs(",
        'Outputs(...) has no field "more"; known are "altitude", "speed"',
    ),
    "an output more": (
        [TUPLES, in_front(OTHER.format("altitude speed more")), ("Outputs(altitude", "Other(altitude"),
         (END, END.replace("))", "), more=s.x)"))],
        "@physics\ndef observe",
        '`observe` gives "altitude", "speed", "more"; it must give what `outputs` declares, in its order: "altitude"',
    ),
    "an output fewer": (
        [TUPLES, in_front(OTHER.format("altitude")), ("Outputs(altitude", "Other(altitude"), (f", {END}", ")")],
        "@physics\ndef observe",
        '`observe` gives "altitude"; it must give what `outputs` declares, in its order: "altitude", "speed"',
    ),
    "states in another order": (
        [TUPLES, in_front(OTHER.format("x y vy vx"), "initial"), ("return State(x=r", "return Other(x=r")],
        "@physics\ndef initial",
        '"y", "vy", "vx"; it must give what `states` declares, in its order: "x", "y", "vx", "vy"',
    ),
    "outputs in another order": (
        [TUPLES, in_front(OTHER.format("speed altitude")), ("Outputs(altitude", "Other(altitude")],
        "@physics\ndef observe",
        '`observe` gives "speed", "altitude"; it must give what `outputs` declares, in its order: "altitude", "speed"',
    ),
    "a state more": (
        [TUPLES, in_front(OTHER.format("x y vx vy mass"), "initial"), ("State(x=r", "Other(mass=1.0, x=r")],
        "@physics\ndef initial",
        '"vy", "mass"; it must give what `states` declares, in its order: "x", "y", "vx", "vy"',
    ),
    "missing state": (
        [(', vy_m_s="vy"', "")],
        "    return State(x=r",
        'State(...) has no field "vy"; did you mean "y"?',
    ),
    "a plain tuple": (
        [(DERIVATIVE, "    return s.vx, s.vy, g * s.x, g * s.y")],
        RHS,
        "`rhs` gives tuple; it must give a named tuple",
    ),
    "another record": (
        [SIGNATURE, (DERIVATIVE, "    return p")],
        RHS,
        "gives Inputs(altitude, burn_dv, magnitude_error, pitch_error); it must give the named tuple of `initial`",
    ),
    "no return": ([(DERIVATIVE, DERIVATIVE.replace("return ", ""))], RHS, "`rhs` gives nothing; it must give a named"),
    "a text in the state": (
        [(DERIVATIVE, DERIVATIVE.replace("g * s.y", "'a'"))],
        RHS,
        "`rhs` gives 'a' for \"vy\"; it must give one number",
    ),
    "a truth value as an event": (
        [(EVENT, f"{EVENT} < 0.0")],
        "@physics\ndef climb",
        '`events` gives a truth value for "apogee"; it must give a number, such as one that crosses zero',
    ),
    "tables in two columns": (
        [
            (IMPORTS, f"import numpy as np\n\n{IMPORTS}"),
            in_front("def tables(o):\n    return np.zeros((3, 2))"),
            given("tables=tables"),
        ],
        "def tables",
        "`tables` gives an array of shape (3, 2); it must give float64[n], numbers in one row",
    ),
    "a truth value as one of two events": (
        [in_front("@physics\ndef high(s):\n    return s.y > 0.0"), ('"stop")}', '"stop"), "high": Event(high)}')],
        "@physics\ndef high",
        '`events` gives a truth value for "high"; it must give a number, such as one that crosses zero',
    ),
    "an extremum of another name": (
        with_evaluate("Metrics(top_speed=best.sped)"),
        "    return Metrics(",
        "'Best' object has no attribute 'sped'",
    ),
    "missing parameter": (
        [TUPLES, given('kernel_parameters=namedtuple("Parameters", "altitude burn_dv magnitude_error")')],
        "    return State(x=r",
        "'Parameters' object has no attribute 'pitch_error'",
    ),
    "parameter of nobody": (
        [TUPLES, given('kernel_parameters=namedtuple("P", "altitude burn_dv magnitude_error pitch_errors")')],
        None,
        'kernel_parameters has the field "pitch_errors", but no parameter has this name without its unit',
    ),
    "wrong arity": (
        [in_front("def tables(p, o):\n    return [1.0]"), given("tables=tables")],
        "def tables", "`tables` takes (p, o); the engine gives it (o)",
    ),
    "no decorator": ([(RHS, "def rhs")], "def rhs", "`rhs` is not marked; write @physics"),
    "event without decorator": ([("@physics\ndef climb", "def climb")], "def climb", "`climb` is not marked; write @"),
    "a lambda": ([given("start=lambda p: 0.0")], "start=lambda", "a lambda is not marked; write physics(lambda ...)"),
    "a metric that is declared": (
        [in_front("@physics\ndef evaluate(t, s):\n    return Metrics(top_speed=t)"), given("evaluate=evaluate")],
        "    return Metrics(",
        'has no field "top_speed"; the engine computes it as it is declared: leave it out here',
    ),
    "async def": ([(RHS, "@physics\nasync def rhs")], "@physics\nasync def rhs", "write def and `return`"),
    "NaN derivative": (
        [(ACCELERATION, "    g = -MU_EARTH / (r2 * sqrt(-r2))\n")],
        "    g = -MU_EARTH",
        '(t = 0 s); so `rhs` gives nan for the derivative of "vx" at the start of the nominal case',
    ),
}  # fmt: skip


def test_a_function_that_gives_other_numbers_than_the_model_declares_is_named(tmp_path):
    for mistake, (edits, text, words) in RECORDS.items():
        sentence = refused(tmp_path / mistake, edits)
        start = f"model.py, line {line_of(tmp_path / mistake, text)}: " if text else ""
        assert sentence.startswith(start), (mistake, sentence)
        assert words in sentence, (mistake, sentence)


RUN = ["one metric more", "states in another order", "a plain tuple", "metrics of another record"]


@pytest.mark.parametrize("edits", [*(RECORDS[name][0] for name in RUN), with_lines("print(g)"), with_lines("g = +s")])
def test_run_refuses_before_it_flies_what_check_names(edits, tmp_path):
    campaign = campaign_with(tmp_path / "model", *edits)
    (found,) = breaches(campaign)
    with pytest.raises(ModelError) as error:
        run(campaign, tmp_path / "run")
    assert str(error.value) == found + MORE
    assert not (tmp_path / "run").exists()
    inputs = {field.name: field.default for field in (*campaign.model.parameters, *campaign.model.settings)}
    with pytest.raises(ModelError) as error:  # whoever flies the model without a campaign is told so, too
        flight.fly(campaign.model, inputs, np.arange(3), 1, folder=campaign.directory)
    assert str(error.value) == found + MORE


# Lines that Python runs and no kernel can, with what stands before `rhs`.
COMPILED = [
    ("g = g * (K * 2.0)[0]", ARRAY),
    *((f"far = (s.x > 0.0) {sign} (s.y > 0.0)",) for sign in ("==", "*")),
    ("a = s + s",),
    ("g = g * sqrt(x=1.0 + r2)",),
    ("g = g * (1.0 + s.x // 1e9)",),
    ("g = g + 0.0 * r2 ** 0.5",),
    (f"try:\n    g = g * 1.0\nexcept Exception as error:{HERE}\n    g = 0.0",),  # the compiler shows a folder
]


def test_what_only_the_compiler_finds_is_one_sentence_with_the_line_too(tmp_path):
    for number, (lines, *before) in enumerate(COMPILED):
        folder = tmp_path / str(number)
        campaign = campaign_with(folder, *with_lines(lines, *before))
        assert breaches(campaign) == []
        (sentence,) = faults(campaign)
        assert re.match(place(folder, lines) + r"kernels cannot run this \(.+\); ", sentence), (lines, sentence)
        assert (ALLOWED in sentence, "a condition stands where" in sentence) == (True, "far" in lines), sentence
        assert not re.search(rf"{re.escape(str(tmp_path))}|site-packages|0x[0-9a-f]{{6}}|\n", sentence), sentence
    told = rf"cannot be flown: {place(folder, lines)}kernels cannot run this .*calls of .*floor, pow.*{re.escape(MORE)}"
    with pytest.raises(ModelError, match=told):
        run(campaign, tmp_path / "run")


ADAPTIVE = [(CLOCK, "AdaptiveStep(until=10_000.0)"), ("FixedStep", "AdaptiveStep")]


@pytest.mark.parametrize("mistake", ["an output more", "an output fewer", "a state more"])
@pytest.mark.parametrize("clock", [[], ADAPTIVE], ids=["fixed", "adaptive"])
def test_no_kernel_is_built_for_other_counts_than_the_model_declares(mistake, clock, tmp_path, monkeypatch):
    monkeypatch.setattr(flight, "refuse_unfit", lambda *model: None)
    model = campaign_with(tmp_path, *RECORDS[mistake][0], *clock).model
    inputs = {one.name: one.default for one in model.parameters}
    with pytest.raises(ModelError, match=r"the physics gives \d+ numbers where the model declares \d"):
        flight.fly(model, inputs, np.arange(3), 1, folder=tmp_path)


@pytest.mark.parametrize("verb", ["check", "run"])
def test_the_command_line_says_it_in_one_line(verb, tmp_path):
    write_campaign(tmp_path / "model", *RECORDS["one metric more"][0])
    options = ["--out", tmp_path / "run"] if verb == "run" else []
    status, _, complaint = told(verb, tmp_path / "model", *options)
    assert status == 2
    assert RECORDS["one metric more"][2] in complaint.splitlines()[-1]
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("arguments", [(1.0, 2.0, 3.0), (True, False, 3.0), (True, 2.0, True)])
def test_where_chooses_by_a_condition_between_numbers(arguments):
    assert where(True, 2.0, 3.0) == 2.0
    with pytest.raises(ModelError, match="`where`"):
        where(*arguments)
    with pytest.raises(ModelError, match="`any_lane`"):
        any_lane(1.0)
