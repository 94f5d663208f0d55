"""Declarations of a model: what they make, that kernels have the same bits, and what is said of mistakes in them."""

from types import SimpleNamespace

import numpy as np
import pytest
from mistaken_campaign import campaign_with, refused, with_input

from mc_engine.errors import ModelError
from mc_engine.flight.contract import breaches
from mc_engine.flight.flight import fly, fly_interpreted
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.lanes import physics
from mc_engine.model import (
    Field,
    Parameter,
    Setting,
    choices,
    declared_in,
    inputs,
    maximum_of,
    metrics,
    outputs,
    states,
)
from mc_engine.runner.manifest import manifest_of
from mc_engine.units import unit_of


def test_one_declaration_makes_the_tuple_and_the_columns():
    made = inputs(altitude_km=Parameter(300.0, "altitude", low=150.0), law=Setting("b", "law", choices=("a", "b")))
    assert made._fields == ("altitude",)  # a setting is in `o`
    assert [(item.name, item.unit, item.symbol) for item in made.declared] == [
        ("altitude_km", "km", "altitude"),
        ("law", "", "law"),
    ]
    assert states(x_m="x", vx_m_s="speed")(x=1.0, vx=2.0) == (1.0, 2.0)
    assert outputs(share=Field("a share", unit="", low=0.0)).declared[0].low == 0.0
    assert metrics(top_m_s=maximum_of("v_m_s", "top"), e=Field("e", unit=""))._fields == ("e",)


def test_what_the_files_of_a_model_declare_is_found_under_the_names_of_the_arguments_of_model():
    files = SimpleNamespace(State="s", EVENTS={}, rhs=physics(lambda s: s), control=np), SimpleNamespace(Outputs="o")
    assert declared_in(*files) == {"states": "s", "events": {}, "rhs": files[0].rhs, "outputs": "o"}
    assert declared_in(files[0], SimpleNamespace(rhs=files[0].rhs))["rhs"] is files[0].rhs  # imported by the other
    with pytest.raises(ModelError, match="two modules have a `rhs`; rename one of them"):
        declared_in(files[0], SimpleNamespace(rhs=physics(lambda s: s)))
    with pytest.raises(ModelError, match="two modules have a `State`; rename one of them"):
        declared_in(files[0], SimpleNamespace(State="another"))


@pytest.fixture
def computed(tmp_path):
    """A campaign whose metrics are declared in each way that makes the engine compute them."""
    metrics = """Metrics = metrics(top_speed_m_s=maximum_of("speed_m_s"), low_km=minimum_of("altitude_km"),
        top_time_s=time_of_maximum("speed_m_s"), end_speed_m_s=at_end("speed_m_s"), end_s=at_end("t_s"),
        apogee_altitude_km=value_at("apogee", "altitude_km"), apogee_s=time_of("apogee"),
        fast_s=last_above("speed_m_s", 7e3), named_m_s=maximum_of("speed_m_s", "greatest speed"))"""
    return campaign_with(
        tmp_path,
        ("maximum_of, metrics,", "last_above, maximum_of, metrics, minimum_of, time_of, time_of_maximum, value_at,"),
        ("Metrics = metrics(", f"{metrics}\nOld = metrics("),
    )


def test_a_computed_metric_without_a_description_is_described_in_the_words_of_its_output(computed):
    assert [item.description for item in computed.model.metrics] == [
        "largest speed", "smallest altitude", "time of the largest speed", "speed at the end", "time at the end",
        "altitude at the event apogee", "time of the event apogee", "last time of the speed above its level",
        "greatest speed",
    ]  # fmt: skip


def test_the_manifest_tells_which_metrics_are_times_and_of_which_output_others_are_an_extreme_or_the_end(computed):
    manifest = manifest_of(computed)
    assert manifest["event_times"] == ["top_time_s", "end_s", "apogee_s", "fast_s"]
    assert manifest["metric_outputs"] == {
        "top_speed_m_s": "speed_m_s", "low_km": "altitude_km", "end_speed_m_s": "speed_m_s", "named_m_s": "speed_m_s",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("name", "unit"),
    [("x_m", "m"), ("vx_m_s", "m/s"), ("ve_pct", "%"), ("delay_days", "day"), ("load_mj_m2", "MJ/m^2"), ("isp_s", "s")],
)
def test_the_ending_of_a_name_tells_the_unit(name, unit):
    assert unit_of(name) == unit


def test_a_unit_that_is_not_told_is_asked_for():
    for name, sentence in [
        ("eccentricity", '"eccentricity" ends in no unit; say Field("...", unit="") for a plain number'),
        ("altitude_kilometres", 'ends in no unit; did you mean "altitude_km"?'),
        ("share_percent", 'did you mean "share_pct"?'),
        ("speed_mps", 'did you mean "speed_m_s"?'),
        ("rate_dps", 'did you mean "rate_deg_s"?'),
        ("push_ms2", 'did you mean "push_m_s2"?'),
        ("delay_sec", 'did you mean "delay_s"?'),
        ("angle_dge", 'did you mean "angle_deg"?'),
        ("arm_n_m", 'may end in the unit N m or N/m; say which, Field("...", unit="N m")'),
        ("rate_deg_per_s", 'ends in no unit; did you mean "rate_deg_s"?'),
        ("lapse_k_per_km", '"lapse_k_per_km" ends in no unit; say Field("...", unit="") for a plain number'),
        ("gain_1_s", 'may end in the unit 1/s or s; say which, Field("...", unit="1/s")'),
    ]:
        with pytest.raises(ModelError) as error:
            states(**{name: "a number"})
        assert sentence in str(error.value)
    assert states(eccentricity=Field("a number", unit=""))
    with pytest.raises(ModelError, match='"throttle" ends in no unit; say unit="" for a plain number'):
        inputs(throttle=Parameter(1.0, "share of the thrust"))


# text of the smallest model, what stands in its place, the sentence
MISTAKES = {
    "argument": (("def rhs(s)", "def rhs(s, w)"), '`rhs` in line 26 takes "w"; a function takes what it names of t'),
    "misspelt argument": (("def rhs(s)", "def rhs(s, stat)"), 'takes "stat"; did you mean "state"?'),
    "argument twice": (("def rhs(s)", "def rhs(s, state)"), '`rhs` takes "s" and "state", which are the same'),
    "argument of another": (("def observe(s)", "def observe(s, hit)"),
                            '`observe` in line 38 takes "hit"; a function takes'),
    "metric of nobody": (('top_speed_m_s=maximum_of("speed_m_s", ', "range_km=("),
                         'nobody computes the metric "range_km"; write'),
    "name of a metric": (('"largest speed")', '"largest speed", name="top")'),
                         "a metric has the name under which `metrics` declares it; leave `name` out"),
    "output": (('maximum_of("speed_m_s"', 'maximum_of("sped_m_s"'),
               'metric "top_speed_m_s": there is no output "sped_m_s"; did you mean "speed_m_s"?'),
    "unit of a metric": (("top_speed_m_s=", "top_speed_km="), 'metric "top_speed_km" is in "km", but it holds a value'),
    "unit by chance": (('apogee_time_s=at_end("t_s"', 'time_above_5_g_s=at_end("t_s"'),
                       'is in "g/s", but it holds a value in "s"; change its name or the output, or say unit="s"'),
    "suffix": (("altitude_km=Parameter", "altitude_kmm=Parameter"), '"altitude_kmm" ends in no unit; did you mean'),
    "event without function": (("Event(climb, ", "Event("), 'the event "apogee" has no function; declare it so: '),
    "argument of an event": (("def climb(s)", "def climb(x)"), 'event "apogee" in line 33 takes "x"'),
    "no declaration": (("states=State", "states=('x', 'y')"), "`states` is ('x', 'y'); declare it, State ="),
    "states and outputs exchanged": (("states=State, outputs=Outputs", "states=Outputs, outputs=State"),
                                     "`states` is what outputs(...) made; hand over what states(...) made"),
    "a number as a meaning": (('x_m="x"', "x_m=3"), 'the state "x_m" is 3; it must be its meaning, a text, or Field('),
    "two of a name": (('x_m="x"', 'x_m="x", x_km="x"'), 'State: two names are "x" without their units'),
}  # fmt: skip


def test_a_mistake_in_a_declaration_is_named_with_its_fix(tmp_path):
    for mistake, (*edits, sentence) in MISTAKES.items():
        refused(tmp_path / mistake, edits, sentence)


def flown(folder, *edits):
    campaign = campaign_with(folder, *edits)
    return fly(campaign.model, campaign.nominal, np.arange(3), 1, folder=folder)


def test_arguments_have_any_order_and_either_name(tmp_path):
    plain = flown(tmp_path / "plain")
    others = (
        ("def rhs(s)", "def rhs(settings, state, t, parameters)"),
        ("r2 = s.x * s.x", "s = state\n    r2 = s.x * s.x"),
    )
    named = flown(tmp_path / "named", *others)
    assert all(np.array_equal(plain[name], named[name]) for name in plain)


def test_evaluate_gives_the_metrics_that_the_engine_does_not_compute(tmp_path):
    plain = flown(tmp_path / "plain")
    edits = (
        ('maximum_of("speed_m_s", "largest speed")', 'maximum_of("speed_m_s", "largest"), slow_m_s="half"'),
        ("\nMODEL =", "\n@physics\ndef evaluate(best):\n    return Metrics(slow=0.5 * best.top_speed)\n\n\nMODEL ="),
        ("observe=observe,", "observe=observe, evaluate=evaluate,"),
    )
    with_slow = flown(tmp_path / "slow", *edits)
    assert all(np.array_equal(plain[name], with_slow[name]) for name in plain)
    np.testing.assert_array_equal(with_slow["slow_m_s"], 0.5 * plain["top_speed_m_s"])
    without = edits[1][0], edits[1][1].replace("Metrics(slow=", "(")
    (found,) = breaches(campaign_with(tmp_path / "lost", edits[0], without, edits[2]))
    assert "`evaluate` gives " in found
    assert 'it must give a record with "slow"' in found


def test_choices_are_the_numbers_that_physics_has_for_the_words_of_settings(tmp_path):
    made = inputs(law=Setting("b", "law", choices=("a", "b")), air=Setting("no", "air", choices=("no", "thin", "b")),
                  drag=Setting(False, "drag"), step_s=Setting(1.0, "step"))  # fmt: skip
    assert vars(choices(made)).keys() == {"law", "air"}
    assert vars(choices(made).air) == {"no": 0.0, "thin": 1.0, "b": 2.0}
    edits = (
        *with_input('law=Setting("weak", "law", choices=("plain", "weak"))'),
        ("import Event", "import choices, Event"),
        ("State = states(", "CHOICES = choices(Inputs)\nState = states("),
        ("def rhs(s)", "def rhs(s, o)"),
        ("g = -MU", "g = -(0.99 if o.law == CHOICES.law.weak else 1.0) * MU"),
    )
    of_word, weak = flown(tmp_path / "word", *edits), flown(tmp_path / "weak", ("g = -MU", "g = -0.99 * MU"))
    assert all(np.array_equal(of_word[name], weak[name]) for name in weak)


def test_a_memory_starts_with_its_defaults_and_is_given_by_keyword(tmp_path):
    edits = (
        ("\n\n@physics\ndef initial", '\n\nMemory = namedtuple("Memory", "samples mode", defaults=(0.0, 7.0))\n\n\n'
         "@physics\ndef control(memory):\n    return Memory(samples=memory.samples + 1.0)\n\n\n@physics\ndef initial"),
        ("from mc_engine.lanes import", "from collections import namedtuple\n\nfrom mc_engine.lanes import"),
        ("def observe(s)", "def observe(s, m)"),
        ("Outputs(altitude=", "Outputs(samples=10.0 * m.samples + m.mode, altitude="),
        ('outputs(altitude_km="altitude"', 'outputs(altitude_km="altitude", samples=Field("seen", unit="")'),
        ("    top_speed_m_s=", '    samples=at_end("samples", "", unit=""),\n    top_speed_m_s='),
        ("observe=observe,", "observe=observe, memory=Memory, control=control,"),
        ("import Event", "import Event, Field"),
    )  # fmt: skip
    columns = flown(tmp_path, *edits)
    steps = np.floor(columns["end_time_s"] / 10.0)
    np.testing.assert_array_equal(columns["samples"], 10.0 * (steps + 1.0) + 7.0)


PREPARED = (
    ("\n\n@physics\ndef initial", "\n\ndef prepare(i, settings, refusals):\n    r = EQUATORIAL_RADIUS + i.altitude\n"
     '    return {**vars(i), "radius": r, "tables": []}\n\n\n@physics\ndef initial'),
    ("EQUATORIAL_RADIUS + p.altitude, p", "p.radius, p"),
    ("import Event", "import prepared, Event"),
    ("observe=observe,", "observe=observe, prepare=prepare, kernel_parameters=prepared(prepare, Inputs),"),
)  # fmt: skip


def test_physics_reads_what_prepare_gives_by_its_names(tmp_path):
    plain, own = flown(tmp_path / "plain"), flown(tmp_path / "own", *PREPARED)
    assert all(np.array_equal(plain[name], own[name]) for name in plain)
    kernel_parameters = campaign_with(tmp_path / "own", *PREPARED).model.kernel_parameters
    assert kernel_parameters._fields == ("altitude", "burn_dv", "magnitude_error", "pitch_error", "radius")


def test_a_mistake_in_prepare_is_named_when_its_names_are_read(tmp_path):
    unknown = ("`prepare`: AttributeError: 'types.SimpleNamespace' object has no attribute 'altitud'; did you mean "
               '"altitude"?; `inputs` and `settings` have attributes in SI')  # fmt: skip
    refused(tmp_path / "unknown", [*PREPARED, ("i.altitude", "i.altitud")], f": {unknown}", "    r = EQUATORIAL")
    nothing = ": `prepare` gives NoneType; it must return a dictionary of arrays"
    refused(tmp_path / "nothing", [*PREPARED, ("return {", "more = {")], nothing, "prepared(prepare")


NESTED = (
    ("\n\n@physics\ndef initial", '''

Top = namedtuple("Top", "speed time")
Memory = namedtuple("Memory", "top samples")


@physics
def start():
    return Memory(Top(0.0, time=-1.0), samples=0.0)


@physics
def control(t, s, m):
    fast = s.vx > m.top.speed
    return Memory(where(fast, Top(s.vx, t), m.top), m.samples + 1.0)


@physics
def switch(t, s, m, hit):
    return s, Memory(where(hit.turn > 0.5, Top(m.top.speed, 0.0), m.top), m.samples)


@physics
def turn(s):
    return s.x


@physics
def initial'''),
    ("from mc_engine.lanes import", "from collections import namedtuple\n\nfrom mc_engine.lanes import where,"),
    ("def observe(s)", "def observe(s, m)"),
    ("Outputs(altitude=", "Outputs(top=m.top.speed, top_time=m.top.time, samples=m.samples, altitude="),
    ('outputs(altitude_km="altitude"',
     'outputs(altitude_km="altitude", top_m_s="", top_time_s="", samples=Field("", unit="")'),
    ("    top_speed_m_s=", '    top_m_s=at_end("top_m_s", ""), top_time_s=at_end("top_time_s", ""),\n'
     '    samples=at_end("samples", "", unit=""), top_speed_m_s='),
    ("observe=observe,", "observe=observe, start=start, control=control, switch=switch,"),
    ('"falling", "stop")', '"falling", "stop"), "turn": Event(turn, "falling", "switch")'),
    ("import Event", "import Event, Field"),
)  # fmt: skip
FLAT = (
    ("Memory(Top(0.0, time=-1.0), samples=0.0)", "Memory(0.0, -1.0, 0.0)"),
    ('"top samples"', '"speed time samples"'),
    ("fast = s.vx > m.top.speed", "fast = s.vx > m.speed"),
    ("where(fast, Top(s.vx, t), m.top)", "where(fast, s.vx, m.speed), where(fast, t, m.time)"),
    ("where(hit.turn > 0.5, Top(m.top.speed, 0.0), m.top)", "m.speed, where(hit.turn > 0.5, 0.0, m.time)"),
    ("m.top.speed, top_time=m.top.time", "m.speed, top_time=m.time"),
)


@pytest.mark.parametrize(
    "clock",
    [
        "FixedStep(step=10.0, until=10_000.0)",
        pytest.param("AdaptiveStep(10_000.0, control_period=10.0)", marks=pytest.mark.slow),
    ],
)
def test_a_discrete_state_of_records_flies_as_one_of_numbers_at_every_width_and_interpreted(clock, tmp_path):
    clocked = (("FixedStep(step=10.0, until=10_000.0)", clock), ("import Event", "import AdaptiveStep, Event"))
    nested = campaign_with(tmp_path / "nested", *NESTED, *clocked)
    assert breaches(nested) == []
    plain = campaign_with(tmp_path / "flat", *NESTED, *FLAT, *clocked)
    inputs = nested.nominal | {"burn_dv_m_s": np.linspace(50.0, 400.0, 11)}
    ids = np.arange(11)
    expected = fly(plain.model, inputs, ids, 1, folder=tmp_path / "flat", width=8)
    assert len(set(expected["samples"])) > 5
    assert set(expected["top_time_s"]) == {0.0}
    for width in (1, 8):
        found = fly(nested.model, inputs, ids, 1, folder=tmp_path / "nested", width=width)
        assert all(np.array_equal(found[name], expected[name]) for name in expected)
    time, _, _, metrics = fly_interpreted(InterpretedFlight(nested.model), inputs | {"burn_dv_m_s": 50.0}, 0, 1)
    assert time[0] == expected["end_time_s"][0]
    names = [metric.name for metric in nested.model.metrics]
    assert metrics[names.index("samples")][0] == expected["samples"][0]


SHARED = (
    ("@physics\ndef climb(s)", "Crossings = namedtuple('Crossings', 'late apogee')\n\n\n@physics\ndef climb(t, s)"),
    ("    return s.x * s.vx + s.y * s.vy", "    return Crossings(late=t - 1e9, apogee=s.x * s.vx + s.y * s.vy)"),
    ('{"apogee": Event(climb, "falling", "stop")}',
     '{"apogee": Event(climb, "falling", "stop"), "late": Event(climb, "rising", "stop", rare=True)}'),
    ("from mc_engine.lanes import", "from collections import namedtuple\n\nfrom mc_engine.lanes import"),
)  # fmt: skip


def test_events_may_share_a_function_that_gives_a_number_for_each(tmp_path):
    plain, shared = flown(tmp_path / "plain"), flown(tmp_path / "shared", *SHARED)
    assert all(np.array_equal(plain[name], shared[name]) for name in plain)
    other = ("Crossings(late=t - 1e9, apogee=", "Crossings(later=t - 1e9, apogee="), ("'late apogee'", "'later apogee'")
    (found,) = breaches(campaign_with(tmp_path / "other", *SHARED, *other))
    assert "`events` gives Crossings(later, apogee); it must give a record with" in found


@pytest.mark.slow  # test_model_contract.py has `check` fly such a model
def test_events_may_share_a_function_that_gives_one_number(tmp_path):
    both = ('"falling", "stop")}', '"falling", "stop"), "rise": Event(climb, "rising", "stop", rare=True)}')
    plain, shared = flown(tmp_path / "plain"), flown(tmp_path / "both", both)
    assert all(np.array_equal(plain[name], shared[name]) for name in plain)


def test_an_input_of_another_type_is_told_where_it_is_declared(tmp_path):
    """Behind it `prepared` computes with the value, and told a TypeError of Python."""
    sentence = "Parameter \"altitude_km\" has '300' as its `default`; it must be a number"
    refused(tmp_path, [("300.0,", '"300",')], sentence, "Inputs = inputs(")
