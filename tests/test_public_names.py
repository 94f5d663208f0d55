"""Every public name explains its arguments, what it returns and what it raises, and shows an example that runs."""

import doctest
import inspect
import re
import shutil
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest

import mc_engine
from mc_engine import model, statistics
from mc_engine.physics.curves import curve, surface
from mc_engine.runner.shards import Shard
from mc_engine.studies.comparison import compare_runs
from reports import write_reports

TUNING = """
[campaign]
model = "model.py"
cases = 10
design = "mc"
seed = 5

[tuning]
[tuning.parameter]
altitude_km = { lower = 200.0, upper = 600.0 }
burn_dv_m_s = { lower = 50.0, upper = 200.0 }

[tuning.objective]
apogee = { metric = "apogee_altitude_km", goal = "maximise" }
speed = { metric = "top_speed_m_s" }
"""
ENGINE = {name: getattr(mc_engine, name) for name in mc_engine.__all__}
PACKAGES = {name: getattr(package, name) for package in (model, statistics) for name in package.__all__}
EXPLAINED = {**ENGINE, **{name: value for name, value in PACKAGES.items() if callable(value)}}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A folder with what the examples begin with: a run of eight cases, and a small tuning with its result."""
    folder = tmp_path_factory.mktemp("examples")
    shutil.copy(Path(mc_engine.load_campaign("minimal").directory) / "model.py", folder)
    (folder / "apogee.toml").write_text(TUNING)
    mc_engine.run(mc_engine.load_campaign("minimal", cases=8), folder / "runs" / "small", workers=1)
    mc_engine.tune(mc_engine.load_campaign(folder / "apogee.toml"), folder / "runs" / "tuned", generations=1, workers=1)
    return folder


@pytest.mark.parametrize("name", EXPLAINED)
def test_the_example_of_a_public_name_runs(name, runs, tmp_path, monkeypatch):
    shutil.copytree(runs, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    examples = doctest.DocTestParser().get_doctest(_text(name), {**ENGINE, **PACKAGES, "np": np}, name, None, None)
    assert examples.examples
    said = []
    assert doctest.DocTestRunner().run(examples, out=said.append).failed == 0, "".join(said)


@pytest.mark.parametrize("name", EXPLAINED)
def test_a_public_name_explains_its_arguments_and_what_comes_of_them(name):
    text = _text(name)
    assert [one for one in _arguments(EXPLAINED[name]) if not _is_explained(one, text)] == []
    if inspect.isfunction(EXPLAINED[name]):
        assert [word for word in ("Returns", "Raises") if not re.search(rf"^{word} ", text, re.MULTILINE)] == []


def _text(name):
    return inspect.getdoc(EXPLAINED[name]) or ""


def _arguments(value):
    if is_dataclass(value):
        return [field.name for field in fields(value) if field.init]
    if inspect.isclass(value) and "__init__" not in vars(value):
        return list(getattr(value, "_fields", ()))
    return [one for one in inspect.signature(value).parameters if one not in ("self", "args", "kwargs")]


def _is_explained(argument, text):
    """A line "argument : ...", or "argument(p, o) : ..." of a function, or "first, argument : ..."."""
    return re.search(rf"^(\w+, )*{argument}(\(.*\))?(, \w+)* : \S", text, re.MULTILINE) is not None


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda e, run: e.open_run(e.open_store(run)), "opened by its path or URL, and Store is neither; its path is "),
        (lambda e, run: e.open_store(None), "opened by its path or URL, and NoneType is neither$"),
        (lambda e, run: e.resume(e.open_run(run)), "and Run is neither; its path is "),
        (lambda e, run: e.open_tuning(e.open_store(run)), "opened by its path, and Store is none; its path is runs/s"),
        (lambda e, run: e.open_store(run).row("3"), "case '3' is not there; cases are whole numbers, from 0 on"),
        (lambda e, run: e.run(e.load_campaign("minimal"), 3), "out: int is no path"),
        (lambda e, run: e.load_campaign("minimal", text=b""), "text: bytes is no text; give the contents of the file"),
        (lambda e, run: e.load_campaign("minimal", upstream=3), "upstream: int is no path"),
        (lambda e, run: e.resume(e.open_store(run), repair=True), "repaired by its path, and Store is none; its path"),
        (lambda e, run: write_reports(e.open_store(run)), "made by the path of a run, and Store is none; its path"),
        (lambda e, run: e.run("minimal"), "campaign: 'minimal' is no Campaign; load_campaign makes one"),
        (lambda e, run: e.tune("minimal"), "campaign: 'minimal' is no Campaign"),
        (lambda e, run: e.case_table("minimal", [0]), "campaign: 'minimal' is no Campaign"),
        (lambda e, run: e.case_table(e.load_campaign("minimal"), [0.5]), "a whole number from 0 to 1999, and 0.5 is"),
        (lambda e, run: e.case_table(e.load_campaign("minimal"), [1, None]), "from 0 to 1999, and None is none"),
        (lambda e, run: e.case_table(e.load_campaign("minimal"), np.empty((0, 2), int)), r"1999, and \[\] is none"),
        (
            lambda e, run: e.case_table(e.load_campaign("minimal"), [[1], [1, 2]]),
            r"1999, and \[\[1\], \[1, 2\]\] is none",
        ),
        (lambda e, run: e.replay(run, 3.5), "a whole number from 0 to 7, and 3.5 is none"),
        (lambda e, run: e.replay(run, [3]), r"a whole number from 0 to 7, and \[3\] is none"),
        (lambda e, run: e.Simulator("title", ("mass_kg",), ()), r"`parameters` is \('mass_kg',\); declare it, param"),
        (lambda e, run: e.Simulator("t", (e.Parameter(1.0, "mass"),), ()), "declare it, parameters=inputs"),
        (lambda e, run: e.run(e.load_campaign("minimal"), shard="1/2"), r"'1/2' is no Shard; Shard.parse\(\"1/2\"\)"),
        (lambda e, run: e.run(e.load_campaign("minimal"), backend=None), "backend: None is not allowed; it is a Back"),
        (lambda e, run: e.run(e.load_campaign("minimal"), workers=True), "workers: True is not allowed; it must be"),
        (lambda e, run: e.open_store(run).cases(3), "3 is no list of names of columns"),
        (lambda e, run: e.open_store(run).cases("case_id"), "'case_id' is no list of names of columns"),
        (lambda e, run: compare_runs(run, run, ("a", "b")), "compared by their stores, and 'runs/small' is none"),
        (lambda e, run: Shard.parse("a/b"), '"a/b" is no shard; the third of twenty is 3/20'),
        (lambda e, run: curve(""), '"" is a folder; name a CSV or Parquet file'),
        (lambda e, run: surface(x=[0, 1], y=[0, 1], z=np.eye(2), units=["m"]), "units is a dict of a unit for each na"),
        (lambda e, run: e.extend(run, 2e3), r"cases: 2000\.0 is not allowed; it must be a whole number from 1 on"),
    ],
)
def test_an_argument_of_another_type_is_rejected_in_one_sentence_and_nothing_is_written(runs, monkeypatch, wrong, said):
    monkeypatch.chdir(runs)
    before = {path: path.stat().st_mtime_ns for path in runs.rglob("*")}
    with pytest.raises(mc_engine.EngineError, match=said):
        wrong(mc_engine, "runs/small")
    assert {path: path.stat().st_mtime_ns for path in runs.rglob("*")} == before


def test_paths_and_numbers_may_be_those_of_text_and_numpy(runs, monkeypatch, tmp_path):
    monkeypatch.chdir(runs)
    assert mc_engine.load_campaign("minimal", cases=np.int64(5), seed=np.int64(6)).seed == 6
    assert mc_engine.Store("runs/small").n_cases >= 8
    counts = {"workers": np.int64(1), "chunk": np.int64(2)}
    store = mc_engine.run(mc_engine.load_campaign("minimal", cases=4), tmp_path / "run", **counts)
    assert mc_engine.extend(store.path, np.int64(6), **counts).missing() == []
    assert mc_engine.extend(store.path, 7, workers=1, chunk=10**30).missing() == []
    with pytest.raises(mc_engine.CampaignError, match=r"--from needs a section \[inputs\]"):
        mc_engine.load_campaign("minimal", upstream="runs/small")
