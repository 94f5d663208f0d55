"""A model that contradicts itself is refused when it is made, in one sentence."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from mc_engine import Simulator
from mc_engine.errors import ModelError
from mc_engine.model import Event, Field, Parameter, inputs, load_model, metrics
from mc_engine.model.simulator import load_simulator
from tests.mc_engine.store.small_run import ENVIRONMENT

WAVE_FOLDER = Path(__file__).resolve().parents[1] / "lanes" / "models"
WAVE = load_model("wave.py", WAVE_FOLDER)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"fly": 3}, "has 3 as its `fly`; it must be a function"),
        ({"deterministic": "no"}, "has 'no' as its `deterministic`; it must be True or False"),
        ({"slots": 2.5}, "has 2.5 as its `slots`; it must be a whole number"),
        ({"time_limit_s": "3"}, "has '3' as its `time_limit_s`; it must be a number"),
        ({"published": 3}, "has 3 as its `published`; it must be a tuple"),
        (
            {"published": ("table 2",)},
            "has ('table 2',) as its `published`; it must be a tuple, each item a dictionary",
        ),
        (
            {"data": "aero.csv"},
            "has 'aero.csv' as its `data`; it must be a tuple, each item a text; one alone needs its",
        ),
        ({"data": 3}, "has 3 as its `data`; it must be a tuple, each item a text"),
        ({"data": [3]}, "has (3,) as its `data`; it must be a tuple, each item a text"),
        ({"figures": "map.png"}, "has 'map.png' as its `figures`; it must be a tuple, each item MapFigure or"),
        ({"settings": ("law",)}, "has ('law',) as its `settings`; it must be a tuple, each item Setting"),
        ({"fly": lambda inputs: {}}, "the engine calls fly(inputs, case), and `fly` takes other arguments"),
        ({"fly": lambda: {}, "batch": True}, "the engine calls fly(inputs, cases), and `fly` takes other arguments"),
        ({"start": lambda shared: 1}, "the engine calls start(), and `start` takes other arguments"),
    ],
)
def test_a_simulator_whose_record_holds_something_else_is_refused(given, sentence):
    with pytest.raises(ModelError, match=re.escape(sentence)):
        Simulator(title="A wave", parameters=inputs(), metrics=metrics(time_s="time"), **given)


@pytest.mark.parametrize("given", ['fmu="plant.fmu"', "program=3"])
def test_a_program_or_an_fmu_of_a_file_in_python_is_refused_with_the_place_for_it(tmp_path, given):
    (tmp_path / "sim.py").write_text(f"""
from mc_engine import Simulator
from mc_engine.model import inputs, metrics

SIMULATOR = Simulator(title="A wave", parameters=inputs(), metrics=metrics(time_s="time"), {given})
""")
    with pytest.raises(
        ModelError, match=r"sim.py: a program or an FMU flies by the table \[simulator\] of the campaign"
    ):
        load_simulator("sim.py", tmp_path)


def test_a_model_that_contradicts_itself_is_refused():
    for change, sentence in [
        (
            {"parameters": (Parameter(0.0, "", name="a_m", unit="m"), Parameter(0.0, "", name="a_s", unit="s"))},
            'two inputs .* called "a"',
        ),
        ({"metrics": (Field("", name="top_m", unit="m"),) * 2}, 'two columns .* called "top_m"'),
        ({"event_list": (Event("rise", "rising"),)}, "has .rise. as its `function`; it must be a function"),
    ]:
        with pytest.raises(ModelError, match=sentence):
            replace(WAVE, **change)


def test_a_unit_that_is_not_known_is_named():
    with pytest.raises(ModelError, match=r'"depth_m" has the unit "metre"'):
        replace(WAVE, metrics=(Field("", name="depth_m", unit="metre"),))


def model_file(folder, helper):
    (folder / "helper.py").write_text(helper)
    model = Path(WAVE_FOLDER / "wave.py").read_text()
    (folder / "model.py").write_text(
        f"from helper import TITLE\n\n{model}\nobject.__setattr__(MODEL, 'title', TITLE)\n"
    )


def test_a_model_imports_the_files_beside_it_and_sees_their_edits(tmp_path):
    for title in ("first", "second"):
        model_file(tmp_path, f"TITLE = '{title}'\n")
        assert load_model("model.py", tmp_path).title == title
    other = tmp_path / "other"
    other.mkdir()
    model_file(other, "TITLE = 'another campaign'\n")
    assert load_model("model.py", other).title == "another campaign"


@pytest.mark.parametrize(
    ("helper", "sentence"),
    [
        ("TITLE = = 2\n", "helper.py, line 1: SyntaxError: invalid syntax"),
        ("import sys\nsys.exit(3)\n", "helper.py, line 2: ends the program; it may only define MODEL or SIMULATOR"),
        ("def f():\n    return 1 / 0\nTITLE = f()\n", "helper.py, line 2: ZeroDivisionError: division by zero"),
        ("import no_such_package\n", "helper.py, line 1: ModuleNotFoundError: No module named 'no_such_package'"),
    ],
)
def test_an_error_of_the_model_s_own_code_is_a_sentence_with_its_place(tmp_path, monkeypatch, helper, sentence):
    model_file(tmp_path, helper)
    with pytest.raises(ModelError) as from_file:
        load_model("model.py", tmp_path)
    assert str(from_file.value) == sentence
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "faulty_module.py").write_text(f"{helper}MODEL = None\n")
    with pytest.raises(ModelError) as from_module:
        load_model("faulty_module")
    assert str(from_module.value) in (
        sentence.replace("helper.py", "faulty_module.py"),
        '"faulty_module" needs the package "no_such_package", which is not installed',
    )


@pytest.mark.parametrize(
    ("reference", "sentence"),
    [
        ("this", '"this" is a module of Python itself'),
        ("trap", '"trap" has no MODEL; end it with MODEL = model'),
        ("trap_package.inner", '"trap_package.inner" has no MODEL'),
        ("trap_package.nothing", 'there is no module "trap_package.nothing"'),
        ("trap.inner", 'there is no module "trap.inner"'),
    ],
)
def test_a_module_that_defines_no_model_is_not_imported(reference, sentence, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    trap = f"open({str(tmp_path / 'sprung')!r}, 'w')\n"
    (tmp_path / "trap.py").write_text(trap)
    (tmp_path / "trap_package").mkdir()
    (tmp_path / "trap_package" / "__init__.py").write_text(trap)
    (tmp_path / "trap_package" / "inner.py").write_text(trap)
    with pytest.raises(ModelError, match=re.escape(sentence)):
        load_model(reference)
    assert not (tmp_path / "sprung").exists()
    assert reference not in sys.modules


def test_a_model_in_a_package_of_the_user_s_own_is_found(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "own_package").mkdir()
    (tmp_path / "own_package" / "__init__.py").write_text("")
    (tmp_path / "own_package" / "wave.py").write_text((WAVE_FOLDER / "wave.py").read_text())
    (tmp_path / "own_package" / "names.py").write_text("from own_package.wave import MODEL\n")
    assert load_model("own_package.wave").name == load_model("own_package.names").name == WAVE.name


def test_the_working_folder_of_python_m_holds_no_models(tmp_path):
    (tmp_path / "evil.py").write_text("open('sprung', 'w')\nMODEL = None\n")
    (tmp_path / "campaign.toml").write_text('[campaign]\nmodel = "evil"\ncases = 1\ndesign = "mc"\nseed = 1\n')
    command = [sys.executable, "-m", "mc_engine", "check", "campaign.toml"]
    done = subprocess.run(command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert 'there is no module "evil"' in done.stderr
    assert not (tmp_path / "sprung").exists()
