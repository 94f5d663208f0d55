"""Curves in a model: flown, replayed, in its digest, and changed without another compilation of its machine code."""

import re

import numpy as np
import pytest

import mc_engine
from mc_engine.errors import ModelError
from mc_engine.flight.contract import breaches
from mc_engine.flight.flight import fly, fly_interpreted
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.model import load_model
from mc_engine.model.faults import origin_sentence

MODEL = """
from mc_engine.lanes import physics
from mc_engine.model import FixedStep, Parameter, inputs, metrics, model, outputs, states
from mc_engine.physics.curves import curve, surface

Inputs = inputs(mass_kg=Parameter(2.0, "mass"))
State = states(x_m="place", v_m_s="speed")
Outputs = outputs(x_m="place")
Metrics = metrics(drag_n="drag at the end")

THRUST = curve("thrust.csv", x="time_s", y="thrust_n", kind="{kind}", outside="{outside}")
DRAG = surface("drag.csv", "speed_m_s", "mass_kg", "drag_n")


@physics
def force(t, v, mass):
    return THRUST(t) - DRAG(v, mass)


@physics
def initial():
    return State(x=0.0, v=0.0)


@physics
def rhs(t, s, p):
    return State(x=s.v, v=force(t, s.v, p.mass) / p.mass)


@physics
def observe(s):
    return Outputs(x=s.x)


@physics
def evaluate(s, p):
    return Metrics(drag=DRAG(s.v, p.mass))


MODEL = model(
    name="sled", title="A sled with an engine", inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
    clock=FixedStep(step=0.25, until=4.0), initial=initial, rhs=rhs, observe=observe, evaluate=evaluate,
)
"""
THRUST = "time_s,thrust_n\n0,2\n1,2\n2,6\n5,6\n"
DRAG = "speed_m_s,mass_kg,drag_n\n" + "\n".join(f"{v},{m},{0.1 * v}" for v in (0, 20) for m in (1, 5))


def sled(folder, thrust=THRUST, kind="linear", outside="held", text=MODEL):
    folder.mkdir(exist_ok=True)
    (folder / "model.py").write_text(text.format(kind=kind, outside=outside))
    (folder / "thrust.csv").write_text(thrust)
    (folder / "drag.csv").write_text(DRAG)
    return load_model("model.py", folder)


def flown(model, masses=(1.0, 2.0, 3.0), width=8):
    return fly(model, {"mass_kg": np.array(masses)}, np.arange(len(masses)), 1, width=width)


def by_hand(mass, thrust, step=0.25):
    """Speed after 4 s by the classic Runge-Kutta steps of the kernel."""
    v, t = 0.0, 0.0
    for _ in range(16):
        k1 = (thrust(t) - 0.1 * v) / mass
        k2 = (thrust(t + step / 2) - 0.1 * (v + step / 2 * k1)) / mass
        k3 = (thrust(t + step / 2) - 0.1 * (v + step / 2 * k2)) / mass
        k4 = (thrust(t + step) - 0.1 * (v + step * k3)) / mass
        v, t = v + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4), t + step
    return v


def first_thrust(t):
    return np.interp(t, [0.0, 1.0, 2.0, 5.0], [2.0, 2.0, 6.0, 6.0])


def test_a_flight_has_the_curve_at_every_width_and_interpreted(tmp_path):
    model = sled(tmp_path)
    columns = flown(model)
    wanted = [by_hand(mass, first_thrust) for mass in (1.0, 2.0, 3.0)]
    assert columns["end_v_m_s"] == pytest.approx(wanted, rel=1e-14)
    assert columns["drag_n"] == pytest.approx(0.1 * columns["end_v_m_s"], rel=1e-14)
    assert flown(model, width=1)["end_v_m_s"].tolist() == columns["end_v_m_s"].tolist()
    _, _, states, _ = fly_interpreted(InterpretedFlight(model, 60.0), {"mass_kg": 2.0}, 0, 1)
    assert states[1, 0] == columns["end_v_m_s"][1]


def test_two_models_of_the_same_text_fly_their_own_numbers_in_turn(tmp_path):
    weak = sled(tmp_path / "weak", "time_s,thrust_n\n0,1\n5,1\n")
    strong = sled(tmp_path / "strong", "time_s,thrust_n\n0,1\n1,4\n5,9\n")
    for _ in range(2):
        assert flown(weak)["end_v_m_s"][0] == pytest.approx(by_hand(1.0, lambda t: 1.0), rel=1e-14)
        wanted = by_hand(1.0, lambda t: np.interp(t, [0.0, 1.0, 5.0], [1.0, 4.0, 9.0]))
        assert flown(strong)["end_v_m_s"][0] == pytest.approx(wanted, rel=1e-14)


def test_the_files_count_as_the_models_data_and_a_changed_one_is_another_model(tmp_path):
    model = sled(tmp_path)
    assert {"model.py", "thrust.csv", "drag.csv"} == {name for name, _ in model.sources.named()}
    other = sled(tmp_path, THRUST.replace("6", "7"))
    assert dict(other.sources.named())["thrust.csv"] != dict(model.sources.named())["thrust.csv"]
    assert flown(other)["end_v_m_s"][0] > flown(model)["end_v_m_s"][0]


def test_a_curve_with_another_number_of_arguments_is_named_with_those_that_it_takes(tmp_path):
    for number, (called, words) in enumerate({
        "THRUST(t, v) - DRAG(v, mass)": "the curve thrust.csv is a function of one number, x; it was given 2",
        "THRUST(t) - DRAG(v)": "the surface drag.csv is a function of two numbers, x and y; it was given 1",
    }.items()):  # fmt: skip
        model = sled(tmp_path / str(number), text=MODEL.replace("THRUST(t) - DRAG(v, mass)", called))
        with pytest.raises(ModelError, match=rf"^model\.py, line 17: `return {re.escape(called)}`: {words};"):
            flown(model)


def test_a_case_ends_where_its_curve_does(tmp_path):
    model = sled(tmp_path, "time_s,thrust_n\n0,2\n3.1,2\n", outside="ends")
    columns = flown(model)
    assert columns["status"].tolist() == ["not-finite"] * 3
    assert (columns["end_time_s"] <= 3.1).all()
    flight = InterpretedFlight(model, 60.0)
    fly_interpreted(flight, {"mass_kg": 2.0}, 0, 1)
    assert flight.origin.operation == "the curve thrust.csv, left at its end,"
    assert 3.1 < flight.origin.arguments[0] < 3.6
    at = flight.origin.arguments[0]
    said = origin_sentence(flight.origin)
    assert re.match(
        rf"model\.py, line \d+: `.*THRUST.*`: the curve thrust\.csv, left at its end, at {at!r} is not", said
    )
    assert "curves.py" not in said


def test_a_file_that_only_a_variable_names_is_refused(tmp_path):
    sled(tmp_path)
    text = (tmp_path / "model.py").read_text()
    changed = text.replace('curve("thrust.csv"', "curve(FILE").replace("THRUST = ", 'FILE = "thrust.csv"\nTHRUST = ')
    (tmp_path / "model.py").write_text(changed)
    with pytest.raises(ModelError, match=r'write "thrust.csv" into the call'):
        load_model("model.py", tmp_path)


def test_a_missing_file_is_said_with_the_line(tmp_path):
    sled(tmp_path)
    (tmp_path / "thrust.csv").unlink()
    with pytest.raises(ModelError, match=r'model.py, line 11: there is no file "thrust.csv"'):
        load_model("model.py", tmp_path)


CAMPAIGN = """[campaign]
model = "model.py"
cases = 16
design = "mc"
seed = 1

[dispersion.mass_kg]
dist = "uniform"
lower = 1.0
upper = 3.0
source = "weighed"
"""


def test_a_run_keeps_the_files_of_its_curves_and_the_model_passes_the_check(tmp_path):
    sled(tmp_path / "sled")
    (tmp_path / "sled" / "campaign.toml").write_text(CAMPAIGN)
    campaign = mc_engine.load_campaign(tmp_path / "sled" / "campaign.toml")
    assert breaches(campaign) == []
    store = mc_engine.run(campaign, tmp_path / "run", workers=2)
    cases = store.cases()
    assert (cases["status"] == "ok").all()
    kept = {path.name: path for path in (tmp_path / "run").rglob("*.csv")}
    assert kept["thrust.csv"].read_text() == THRUST
    assert kept["drag.csv"].read_text() == DRAG
    model = load_model("model.py", kept["thrust.csv"].parent)
    assert flown(model, cases["mass_kg"], 8)["drag_n"].tolist() == cases["drag_n"].tolist()
