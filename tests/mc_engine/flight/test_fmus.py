"""FMUs under a campaign file: FMI 2 and 3, co-simulation and model exchange, against the ball that Python flies."""

import zipfile

import numpy as np
import pytest

from mc_engine import CampaignError, EngineError, load_campaign, replay, run
from mc_engine.flight.fmu_flight import taken
from tests.mc_engine.flight import ball_fmu
from tests.mc_engine.flight.ball_fmu import fmu_campaign
from tests.mc_engine.flight.falling_ball import python_campaign

fmpy = pytest.importorskip("fmpy", reason='the extra "fmu" is missing')
METRICS = ["fall_time_s", "impact_speed_m_s"]
FEW = 8  # cases; each with a fault costs a process
TAKEN = """
top_speed_m_s = { variable = "speed", take = "max", description = "largest speed" }
at_top_s = { variable = "speed", take = "time_of_max", unit = "s", description = "time of it" }
lowest_m = { variable = "altitude", take = "min", description = "lowest altitude" }
ground_s = { variable = "altitude", take = "crossing", level = 0.0, unit = "s", description = "passes the ground" }
never_s = { variable = "altitude", take = "crossing", level = 1e6, unit = "s", sometimes = true }
"""


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    folder = tmp_path_factory.mktemp("python")
    return run(load_campaign(python_campaign(folder / "ball", cases=FEW)), folder / "run", workers=1).cases()


@pytest.mark.parametrize(
    ("fmi", "interface"),
    [
        (2, "model-exchange"),
        (3, "co-simulation"),
        pytest.param(2, "co-simulation", marks=pytest.mark.slow),
        pytest.param(3, "model-exchange", marks=pytest.mark.slow),
    ],
)
def test_every_kind_of_fmu_flies_the_ball(tmp_path, ball, fmi, interface):
    options = f'interface = "{interface}"\nsolver_tolerance = 1e-9'
    file = fmu_campaign(tmp_path / "ball", cases=FEW, fmi=fmi, options=options, metrics=TAKEN)
    store = run(load_campaign(file), tmp_path / "run", workers=1)
    table = store.cases()
    assert set(table["status"]) == {"ok"}
    assert np.allclose(table[METRICS], ball[METRICS], rtol=1e-14, atol=0.0)
    assert list(table["mass_kg"]) == list(ball["mass_kg"])
    limit = np.sqrt(9.81 / (0.02 * 1.225 / 2 / table["mass_kg"]))
    assert table["top_speed_m_s"].to_numpy() == pytest.approx(limit * np.tanh(9.81 * 20.0 / limit), rel=1e-6)
    assert set(table["at_top_s"]) == {20.0}  # it still accelerates
    # linear between rows of 0.05 s: an error of g dt^2 / 8 in altitude, at the speed of impact
    assert table["ground_s"].to_numpy() == pytest.approx(table["fall_time_s"].to_numpy(), abs=9.81 * 0.05**2 / 8 / 50)
    assert (table["lowest_m"] < 0.0).all()
    assert table["never_s"].isna().all()
    again = replay(store.path, 3)
    assert again.equal, again.differences
    assert again.history["t_s"].iloc[-1] == pytest.approx(20.0)
    assert again.history["speed_m_s"].iloc[-1] == pytest.approx(table["top_speed_m_s"][3], rel=1e-12)


def test_a_case_of_an_fmu_does_not_depend_on_those_before(tmp_path):
    campaign = load_campaign(fmu_campaign(tmp_path / "ball", cases=FEW, options='interface = "model-exchange"'))
    one = run(campaign, tmp_path / "one", workers=1, chunk=FEW).cases()
    assert one.equals(run(campaign, tmp_path / "two", workers=2, chunk=3).cases())


def test_an_fmu_that_cannot_be_reset_is_begun_anew(tmp_path, ball):
    table = run(load_campaign(fmu_campaign(tmp_path / "ball", cases=FEW, reset="return 3")), tmp_path / "run").cases()
    assert np.allclose(table[METRICS], ball[METRICS], rtol=1e-14, atol=0.0)


def test_whole_numbers_and_truth_values_of_an_fmu_are_as_recorded(tmp_path):
    file = fmu_campaign(tmp_path / "ball", cases=FEW, metrics='landed = {}\nflown = { variable = "number" }')
    numbers = "[simulator.parameter]\nnumber = { default = 1 }"
    text = file.read_text().replace("[simulator.parameter]", numbers) + "landed = {}\n"
    file.write_text(f'{text}[dispersion.number]\ndist = "discrete"\nvalues = [2, 2.5]\n')
    store = run(load_campaign(file), tmp_path / "run", workers=1)
    table = store.cases()
    whole = (table["number"] == 2.0).to_numpy()
    assert 0 < whole.sum() < FEW
    assert list(table["flown"][whole]) == [2.0] * whole.sum()
    assert set(table["landed"][whole]) == {1.0}
    assert set(store.histories()["landed"]) == {0.0, 1.0}
    assert set(table["status"][~whole]) == {"refused"}
    assert table["reason"][~whole].str.startswith('number is 2.5, and "number" is a whole number').all()


@pytest.mark.parametrize(
    ("fault", "status", "reason"),
    [
        ("if (b->v[1] > 10.3) *(volatile int *)0 = 1;", "crashed", "SIGSEGV"),
        ("if (b->v[1] > 10.3) return 3;", "crashed", "FMICallException"),
        # these two end as in a Python function, of which tests/faults/test_simulator_faults.py flies them
        pytest.param("if (b->v[1] > 10.3) for (;;) ;", "time-limit", "took longer than 3 s", marks=pytest.mark.slow),
        pytest.param(
            "if (b->v[1] > 10.3) b->v[8] = 0.0 / 0.0;",
            "not-finite",
            '"fall_time_s" is not a number',
            marks=pytest.mark.slow,
        ),
    ],
    ids=["segfault", "error", "endless", "NaN"],
)
def test_a_fault_of_an_fmu_costs_its_case(tmp_path, ball, fault, status, reason):
    file = fmu_campaign(
        tmp_path / "ball", cases=FEW, fault=fault, options=f"time_limit_s = {3.0 if status == 'time-limit' else 60.0}"
    )
    table = run(load_campaign(file), tmp_path / "run", workers=2).cases()
    heavy = (table["mass_kg"] > 10.3).to_numpy()
    assert 0 < heavy.sum() < FEW
    assert set(table["status"][heavy]) == {status}
    assert all(reason in one for one in table["reason"][heavy])
    assert np.allclose(table[METRICS][~heavy], ball[METRICS][~heavy], rtol=1e-14, atol=0.0)


MISTAKES = {
    "no file": ('fmu = "ball.fmu"', 'fmu = "bal.fmu"', 'simulator.fmu: there is no file "bal.fmu"'),
    "no fmu": ('fmu = "ball.fmu"', 'fmu = "campaign.toml"', '"campaign.toml" is no FMU that can be read'),
    "variable": ('variable = "mass"', 'variable = "mas"', 'has no variable "mas"; did you mean "mass"?'),
    "computed": ('variable = "mass"', 'variable = "speed"', '"speed" is computed by the FMU, and cannot be set'),
    "level": ("[simulator.output]", 'x_s = { variable = "altitude", take = "crossing" }\n[simulator.output]',
              "metric.x_s: is a crossing; give the `level`"),
    "key": ("step_s = 0.05", 'step_s = 0.05\nresult = "a.json"', "simulator.result: is of a program"),
    "step": ("step_s = 0.05", "step_s = 50.0", "simulator.step_s: 50 must be at most 20"),
    "end": ("stop_time_s = 20.0", "", "simulator.stop_time_s: is missing, and the FMU proposes none"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_in_the_table_of_an_fmu_are_sentences(tmp_path, mistake):
    old, new, sentence = MISTAKES[mistake]
    file = fmu_campaign(tmp_path / "ball")
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))
    with pytest.raises(CampaignError) as error:
        load_campaign(file)
    assert sentence in str(error.value)


def test_steps_of_one_length_must_meet_the_end_of_the_flight(tmp_path, monkeypatch):
    description = ball_fmu._fmi3().replace('canHandleVariableCommunicationStepSize="true"', "")
    monkeypatch.setattr(ball_fmu, "_fmi3", lambda: description)  # which takes no shorter step at the end
    file = fmu_campaign(tmp_path / "ball", fmi=3)
    file.write_text(file.read_text().replace("step_s = 0.05", "step_s = 0.3"))
    with pytest.raises(CampaignError, match=r"and 0\.3 s do not divide 20 s; 0\.298507462687 s would fit"):
        load_campaign(file)


@pytest.mark.parametrize("fmi", [2, 3])
def test_an_fmu_of_another_platform_is_refused_before_anything_flies(tmp_path, fmi):
    file = fmu_campaign(tmp_path / "ball", fmi=fmi, platform="win64")
    with pytest.raises(CampaignError, match=r'simulator\.fmu: "ball\.fmu" is built for win64, and this machine is'):
        load_campaign(file)


def test_a_wrong_path_in_an_fmu_is_told_in_words_that_are_the_same_in_every_process(tmp_path):
    file = fmu_campaign(tmp_path / "ball")
    with zipfile.ZipFile(file.with_name("ball.fmu"), "a") as archive:
        archive.writestr("/etc/table.csv", "1")
    with pytest.raises(EngineError, match=r"Illegal path /etc/table\.csv found in the archive\."):
        run(load_campaign(file), tmp_path / "run", workers=1)


def test_what_is_taken_of_a_history():
    time, values = np.array([0.0, 1.0, 2.0, 3.0]), np.array([4.0, 2.0, -2.0, 3.0])
    known = {"final": 3.0, "max": 4.0, "min": -2.0, "time_of_max": 0.0, "crossing": 1.5}
    assert {what: taken(time, values, what, 0.0) for what in known} == known
    assert taken(time, values, "crossing", 2.0) == 1.0  # reached
    assert taken(time, values, "crossing", 4.0) == pytest.approx(np.nan, nan_ok=True)  # left, and not reached again
    assert taken(time, values, "crossing", 3.0) == 0.5


@pytest.mark.parametrize("what", ["max", "min", "time_of_max", "crossing"])
@pytest.mark.parametrize("lost", [0, 2, 3])
def test_nothing_is_taken_of_a_history_with_a_value_that_is_no_number(what, lost):
    time, values = np.array([0.0, 1.0, 2.0, 3.0]), np.array([4.0, 5.0, 2.0, 1.0])
    values[lost] = np.nan
    assert np.isnan(taken(time, values, what, 0.5))
