"""Runs with `--backend cuda`, from the command line to the case table, with a stand-in for the driver.

The stand-in keeps the driver's rules, and flies the very code that a card is given.  One test, marked slow, flies every
shipped campaign on the card of this machine, where there is one.
"""

import inspect
import re
import sys
from contextlib import nullcontext
from importlib.machinery import ModuleSpec
from types import ModuleType

import numpy as np
import pytest
from fake_driver import FakeDriver, install
from shipped_kernels import NAMES, shipped
from typer.testing import CliRunner

from mc_engine.campaign.loading import load_campaign
from mc_engine.command_line.commands import app
from mc_engine.errors import CampaignError, EngineError, ModelError
from mc_engine.flight.card_code import PER_CASE
from mc_engine.lanes.compiler import compile_kernel
from mc_engine.lanes.kernel_cache import Kernel
from mc_engine.runner import backends, cards, runner
from mc_engine.runner.backends import Backend
from tests.benchmarks import card_speed
from tests.mc_engine.flight.falling_ball import python_campaign

CASES, CHUNK = 96, 40
OFTEN = ("minimal", "geo_injection")  # of fixed steps and of adaptive ones; the others are slow tests
CAMPAIGNS = [name if name in OFTEN else pytest.param(name, marks=pytest.mark.slow) for name in NAMES]


@pytest.fixture(autouse=True)
def _found_anew():
    """Each test finds its own cards."""
    cards.cards.cache_clear()
    cards.opened.cache_clear()
    yield
    cards.cards.cache_clear()
    cards.opened.cache_clear()


def has_card():
    try:
        return bool(cards.cards())
    except EngineError:
        return False


def parts(store):
    """What the store has of its cases: range, bytes and statuses of each part."""
    return sorted((part.first, part.stop, part.sha256, str(part.status)) for part in store.parts)


def few_cases(name):
    """The campaign with few cases, where its design allows."""
    try:
        return shipped(name, cases=CASES)
    except CampaignError:
        return shipped(name)


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_a_run_on_cards_has_the_bytes_of_one_on_the_processor(name, tmp_path, monkeypatch):
    fake = install(monkeypatch, FakeDriver(cards=((8, 6), (12, 0))))
    campaign = few_cases(name)
    on_cards = runner.run(campaign, tmp_path / "cards", backend="cuda", chunk=CHUNK, workers=3)
    on_processor = runner.run(campaign, tmp_path / "processor", chunk=CHUNK, workers=2)
    assert parts(on_cards) == parts(on_processor)
    counts = on_cards.status_counts()
    assert sum(map(sum, fake.launches)) >= sum(counts.values()) - counts.get("refused", 0)


@pytest.mark.slow
@pytest.mark.skipif(not has_card(), reason="there is no NVIDIA card here")
@pytest.mark.parametrize("name", NAMES)
def test_a_run_on_the_card_of_this_machine_has_the_bytes_of_one_on_the_processor(name, tmp_path):
    campaign = few_cases(name)
    on_card = runner.run(campaign, tmp_path / "card", backend="cuda", chunk=CHUNK)
    on_processor = runner.run(campaign, tmp_path / "processor", chunk=CHUNK)
    assert parts(on_card) == parts(on_processor)


def test_the_command_line_flies_on_a_card(tmp_path, monkeypatch):
    fake = install(monkeypatch, FakeDriver())
    words = ["run", "minimal", "--cases", str(CASES), "--no-report", "--out"]
    for folder, options in (("card", ["--backend", "cuda"]), ("processor", [])):
        result = CliRunner().invoke(app, [*words, str(tmp_path / folder), *options])
        assert result.exit_code == 0, result.output
    tables = [sorted((tmp_path / folder / "cases").glob("*.parquet")) for folder in ("card", "processor")]
    assert fake.launches != [[]]
    assert [file.read_bytes() for file in tables[0]] == [file.read_bytes() for file in tables[1]]


def test_cases_beyond_a_cards_memory_fly_one_piece_after_another(tmp_path, monkeypatch):
    fake = install(monkeypatch, FakeDriver(memory=60_000))
    on_card = runner.run(shipped("minimal", cases=1000), tmp_path / "card", backend="cuda", chunk=1000)
    on_processor = runner.run(shipped("minimal", cases=1000), tmp_path / "processor", chunk=1000)
    assert len(fake.launches[0]) > 3
    assert parts(on_card) == parts(on_processor)


def test_tasks_go_to_the_card_with_the_fewest_flights(monkeypatch):
    install(monkeypatch, FakeDriver(cards=((9, 0), (9, 0))))
    with cards.least_busy() as one, cards.least_busy() as two, cards.least_busy():
        assert {one.facts.number, two.facts.number} == {0, 1}
        assert sorted(card.flights for card in cards.opened()) == [1, 2]
    assert [card.flights for card in cards.opened()] == [0, 0]


@pytest.mark.parametrize("fails", ["cuMemAlloc", "cuModuleLoadData", "cuLaunchKernel", "cuStreamSynchronize"])
def test_what_the_driver_refuses_ends_the_run_with_its_words(fails, tmp_path, monkeypatch):
    install(monkeypatch, FakeDriver(fails=fails))
    with pytest.raises(EngineError, match=f"the CUDA driver: {fails}: invalid argument"):
        runner.run(shipped("minimal", cases=CASES), tmp_path / "run", backend="cuda", chunk=CASES)


def _without_package(monkeypatch):
    monkeypatch.setitem(sys.modules, "cuda", ModuleType("cuda"))
    sys.modules["cuda"].__spec__, sys.modules["cuda"].__path__ = ModuleSpec("cuda", None), []
    monkeypatch.delitem(sys.modules, "cuda.bindings", raising=False)


@pytest.mark.parametrize(
    ("found", "sentence"),
    [
        (_without_package, r'the backend "cuda" needs the package cuda-bindings; `pip install cuda-bindings`'),
        (lambda patch: install(patch, FakeDriver(cards=())), "and its driver; none was found here"),
        (
            lambda patch: install(patch, FakeDriver(cards=((7, 5),))),
            "or later and its driver; found here: Stand-in 0",
        ),
    ],
    ids=["no package", "no card", "an old card"],
)
def test_without_a_card_there_is_one_sentence_and_nothing_is_written(found, sentence, tmp_path, monkeypatch):
    found(monkeypatch)
    result = CliRunner().invoke(app, ["run", "minimal", "--backend", "cuda", "--out", str(tmp_path / "run")])
    assert result.exit_code == 2
    assert sentence.replace("`", "") in re.sub(r"\s+", " ", result.output.replace("`", ""))
    assert not (tmp_path / "run").exists()


def test_auto_takes_no_card_that_was_not_measured(tmp_path, monkeypatch):
    fake = install(monkeypatch, FakeDriver())
    store = runner.run(shipped("minimal", cases=CASES), tmp_path / "run", backend="auto")
    assert fake.launches == [[]]
    assert store.status_counts()


@pytest.mark.parametrize("speeds", [(100.0, 101.0), (100.0, 99.0)])
def test_auto_takes_a_card_that_was_measured_to_be_faster(speeds, tmp_path, monkeypatch):
    monkeypatch.setattr(backends, "cache_folder", lambda: tmp_path)
    fake = install(monkeypatch, FakeDriver())
    seconds = iter([CASES / speed for speed in speeds])
    monkeypatch.setattr(backends, "shortest", lambda flight, repeats: flight() and next(seconds))
    result = CliRunner().invoke(app, ["bench", "minimal", "--card", "--cases", str(CASES)])
    assert result.output == f"minimal: all cores {speeds[0]:,.0f} cases/s, a card {speeds[1]:,.0f} cases/s\n"
    fake.launches[0].clear()
    runner.run(shipped("minimal", cases=CASES), tmp_path / "run", backend="auto")
    assert bool(fake.launches[0]) == (speeds[1] > speeds[0])


def test_the_benchmark_of_cards_names_the_results_that_differ(monkeypatch, capsys):
    install(monkeypatch, FakeDriver())
    monkeypatch.setattr(card_speed, "in_processes", lambda function, items: [function(item) for item in items])
    card_speed.tables(CASES, 1.0, ["minimal"])
    assert f"| minimal | {CASES} | 10 | none |" in capsys.readouterr().out
    fly = cards.Card.fly

    def fly_wrong(card, code, arguments):
        fly(card, code, arguments)
        arguments[PER_CASE[-1]][0, -1] += 1.0

    monkeypatch.setattr(cards.Card, "fly", fly_wrong)
    card_speed.tables(CASES, 1.0, ["minimal"])
    assert f"| minimal | {CASES} | 10 | apogee_altitude_km |" in capsys.readouterr().out


def test_a_simulator_flies_on_the_processor(tmp_path, monkeypatch):
    install(monkeypatch, FakeDriver())
    with pytest.raises(EngineError, match="a simulator flies on the processor"):
        runner.run(load_campaign(python_campaign(tmp_path / "ball")), tmp_path / "run", backend="cuda")
    assert not (tmp_path / "run").exists()


FALL = """
from mc_engine.lanes import physics
from mc_engine.model import FixedStep, Parameter, Setting, at_end, inputs, metrics, model, outputs, states

Inputs = inputs(gravity_m_s2=Parameter(9.5, "acceleration"), k=Setting(1.37, "exponent", unit=""))
State = states(v_m_s="speed")
Outputs = outputs(q_m_s="speed")
Metrics = metrics(q_m_s=at_end("q_m_s", "speed"))


@physics
def initial(p):
    return State(v=p.gravity - 9.0)


@physics
def rhs(p):
    return State(v=0.0 * p.gravity)


@physics
def observe(s, o):
    return Outputs(q=s.v * 2.5 ** o.k)


MODEL = model(
    name="fall", title="Fall", inputs=Inputs, states=State, outputs=Outputs, metrics=Metrics,
    clock=FixedStep(0.5, 2.0), initial=initial, rhs=rhs, observe=observe,
)
"""

FALLS = """
[campaign]
model = "model.py"
design = "mc"
cases = 3
seed = 1

[dispersion.gravity_m_s2]
dist = "normal"
sigma = 0.1
source = "a test"
"""


def erring(parameters, settings, data, key, cases, time, status, state, metrics, history, rows, stride):
    """A kernel that cannot fly case 7: no physics that is compiled raises, so it is written by hand."""
    if cases[0] == 7.0:
        raise ValueError
    time[0], status[0], state[0, 0], metrics[0, 0] = cases[0], 0.0, 0.0, 0.0


def test_a_flight_that_ends_with_an_error_is_told_as_on_the_processor(tmp_path, monkeypatch):
    install(monkeypatch, FakeDriver())
    kernel = Kernel(tmp_path / "kernel.py", compile_kernel(erring).library)
    for cases in (np.array([3.0, 4.0]), np.array([3.0, 7.0])):
        time, results = np.zeros(2), [np.zeros(2), np.zeros((1, 2)), np.zeros((1, 2))]
        data = np.zeros((1, 2)), np.zeros(1), np.zeros(1, dtype=np.uint64), np.uint64(1)
        with pytest.raises(ModelError, match="physics ended with an error") if 7.0 in cases else nullcontext():
            cards._fly_on_card(kernel, *data, cases, time, *results, np.zeros((0, 0)), np.zeros(0, dtype=np.int64), 1)
        assert time[0] == 3.0
        assert (time[1] == cases[1]) == (7.0 not in cases)


@pytest.mark.parametrize(
    ("term", "sentence"),
    [  # asked to write the first, LLVM would end the process; of the second it would write another number
        ("2.5 ** o.k", "physics calls pow on plain numbers, which a card has not"),
        (
            "divmod(o.k, 0.7)[1]",
            "physics takes a remainder of plain numbers, by %, // or divmod, which a card computes",
        ),
    ],
)
def test_what_a_card_cannot_compute_is_named(term, sentence, tmp_path, monkeypatch):
    install(monkeypatch, FakeDriver())
    (tmp_path / "model.py").write_text(FALL.replace("2.5 ** o.k", term))
    (tmp_path / "campaign.toml").write_text(FALLS)
    with pytest.raises(ModelError, match=sentence):
        runner.run(load_campaign(tmp_path), tmp_path / "run", backend="cuda")
    assert not (tmp_path / "run").exists()  # the same command flies the corrected model


def test_a_card_has_no_limits_for_a_case():
    with pytest.raises(EngineError, match="cannot be limited in time or memory"):
        Backend("auto", case_seconds=1.0)


def test_the_stand_in_has_the_functions_of_cuda_bindings():
    """With as many arguments as theirs: the engine's calls would fail on a card otherwise."""
    real = pytest.importorskip("cuda.bindings.driver", reason="cuda-bindings is not installed")
    names = [name for name in dir(FakeDriver) if name.startswith("cu")]
    assert len(names) > 15
    for name in names:
        stand_in = inspect.signature(getattr(FakeDriver, name)).parameters
        takes = re.search(r"\((.*)\)", getattr(real, name).__doc__.splitlines()[0])[1]
        assert len(stand_in) - 1 == len([word for word in takes.split(",") if word.strip()]), name
    for kind in vars(FakeDriver.CUdevice_attribute):
        assert int(getattr(real.CUdevice_attribute, kind)) == getattr(FakeDriver.CUdevice_attribute, kind)
