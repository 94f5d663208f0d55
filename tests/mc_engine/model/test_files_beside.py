"""Models whose physics stands in several files: beside the model, in packages there, or in an installed package."""

import os
import subprocess
import sys

import pytest

from mc_engine.campaign.loading import load_campaign
from mc_engine.campaign.search import SHIPPED
from mc_engine.errors import CampaignError, ModelError, StoreError
from mc_engine.flight.kernel import source_digest
from mc_engine.model import load_model
from mc_engine.runner.flown_campaign import companions_of
from mc_engine.runner.runner import extend, replay, run
from mc_engine.store.opening import open_store
from mc_engine.store.verification import damage
from tests.mc_engine.command_line.cart import call
from tests.mc_engine.store.small_run import ENVIRONMENT

MODEL = (SHIPPED / "minimal" / "model.py").read_text()
CAMPAIGN = (SHIPPED / "minimal" / "campaign.toml").read_text()
PULL = "g = -MU_EARTH * rsqrt(r2) ** 3"
DYNAMICS = """from {constants} import MU
from mc_engine.lanes import physics, sqrt


@physics
def pull(r2):
    return -MU / (r2 * sqrt(r2))
"""
MU = "MU = 3.986004418e14\n"
assert PULL in MODEL


def campaign_in(folder, files, imports, model="model.py"):
    """The minimal campaign, its pull taken from elsewhere.  files : name -> text."""
    text = MODEL.replace(PULL, "g = pull(r2)").replace("from mc_engine", f"{imports}\nfrom mc_engine", 1)
    reference = model if "/" not in model else model.removesuffix(".py").replace("/", ".")
    campaign = CAMPAIGN.replace('"model.py"', f'"{reference}"')
    for name, content in {**files, model: text, "campaign.toml": campaign}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)
    return folder


def said(folder, *words):
    """What the command line says in a process of its own."""
    command = [sys.executable, "-m", "mc_engine", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=ENVIRONMENT, cwd=folder)


def flown(folder, *words):
    """The same, of a command that succeeds."""
    done = said(folder, *words)
    assert done.returncode == 0, done.stderr
    return done.stdout


BESIDE = {"dynamics.py": DYNAMICS.format(constants="constants"), "constants.py": MU}
LAID_OUT = {
    "beside": (
        {"dynamics.py": DYNAMICS.format(constants="constants"), "constants.py": MU},
        "from dynamics import pull",
    ),
    "package": (
        {"lib/__init__.py": "", "lib/dyn.py": DYNAMICS.format(constants=".constants"), "lib/constants.py": MU},
        "from lib.dyn import pull",
    ),
    "folder": (
        {"lib/dyn.py": DYNAMICS.format(constants="lib.deep.constants"), "lib/deep/constants.py": MU},
        "import lib.dyn\npull = lib.dyn.pull",
    ),
}


@pytest.mark.parametrize(
    "layout", ["package", *(pytest.param(other, marks=pytest.mark.slow) for other in ("beside", "folder"))]
)
def test_physics_in_other_files_flies_again_in_another_process_and_follows_their_edits(layout, tmp_path):
    files, imports = LAID_OUT[layout]
    folder = campaign_in(tmp_path / "mine", files, imports)
    flown(tmp_path, "run", folder, "--cases", 16, "--no-report", "--out", "first")
    flown(tmp_path, "run", folder, "--cases", 16, "--no-report", "--out", "second")
    constants = next(name for name in files if name.endswith("constants.py"))
    (folder / constants).write_text("MU = 3.9e14\n")
    flown(tmp_path, "run", folder, "--cases", 16, "--no-report", "--out", "edited")
    first, second, edited = ((tmp_path / run / "cases").iterdir() for run in ("first", "second", "edited"))
    bytes_of = [next(parts).read_bytes() for parts in (first, second, edited)]
    assert bytes_of[0] == bytes_of[1] != bytes_of[2]
    assert replay(tmp_path / "first", 3).equal  # the run has files of its own
    assert extend(tmp_path / "first", 32, workers=1).n_cases == 32


def test_the_sources_of_an_installed_model_are_all_that_it_reaches_in_its_package(tmp_path, monkeypatch):
    files = {
        "pkg_beside/phys/dyn.py": DYNAMICS.format(constants="..constants"),
        "pkg_beside/constants.py": MU,
    }
    campaign_in(tmp_path, files, "from ..phys.dyn import pull", model="pkg_beside/models/orbit.py")
    monkeypatch.syspath_prepend(tmp_path)
    digests = []
    for constants in (MU, "MU = 3.9e14\n"):
        (tmp_path / "pkg_beside" / "constants.py").write_text(constants)
        for name in [name for name in sys.modules if name.startswith("pkg_beside")]:
            del sys.modules[name]
        model = load_campaign(tmp_path / "campaign.toml").model
        assert model.rhs.function.__globals__["pull"].function.__globals__["MU"] == float(constants.split()[-1])
        digests.append(source_digest(model, None))
        (tmp_path / "pkg_beside" / "constants.py").write_text("MU = 1.0\n")
        assert source_digest(model, None) == digests[-1]  # of what was imported
    assert len(set(digests)) == 2


ELSEWHERE = """from mc_engine.lanes import physics
from laws.numbers import Law


@physics
def pull(r2):
    return (-1.3e-6 if Law.SQUARE == 1 else -1.2e-6) + 0.0 * r2
"""


def test_physics_that_a_file_imports_from_another_folder_count_as_its_source(tmp_path, monkeypatch):
    folder = campaign_in(tmp_path / "mine", {}, "from laws.pull import pull")
    monkeypatch.setitem(ENVIRONMENT, "PYTHONPATH", f"{ENVIRONMENT['PYTHONPATH']}{os.pathsep}{tmp_path / 'lib'}")
    times = []
    for number in (1, 2):
        law = f"from enum import IntEnum\n\n\nclass Law(IntEnum):\n    SQUARE = {number}\n"
        files = {"__init__.py": "", "pull.py": ELSEWHERE, "numbers.py": law}
        for name, text in files.items():
            (tmp_path / "lib" / "laws" / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / "lib" / "laws" / name).write_text(text)
        done = said(folder, "run", ".", "--out", f"run{number}", "--cases", "2", "--no-report")
        assert done.returncode == 0, done.stderr
        times.append(open_store(folder / f"run{number}").cases()["apogee_time_s"][0])
    assert times[1] != times[0]  # a kernel that an enumeration is in is named by the sources
    refused = said(folder, "extend", "run1", "--cases", "4")
    assert "was flown by other sources of engine or model" in refused.stderr


AERO = """import numpy as np
from pathlib import Path

FACTORS = np.loadtxt(Path(__file__).with_name("factors.csv"), delimiter=",")
MU = float(FACTORS[0])
"""
LATER = """

def tables(o):
    return np.loadtxt(Path(__file__).parent / "data" / "table.csv", delimiter=",", ndmin=1)
"""


def model_with_data(declared='("factors.csv",)', first=AERO, later=""):
    """The minimal model with a number from a file; declared : the argument `data`.  later : text with `tables`."""
    text = MODEL.replace("State = states", f"{first}{later}\nState = states", 1)
    text = text.replace(PULL, "g = -MU / (r2 * sqrt(r2))")
    arguments = f"data={declared}, " + ("tables=tables, " if later else "")
    return text.replace("initial=initial, ", f"initial=initial, {arguments}")


def put(folder, files):
    """Write a campaign with its files.  files : name -> text."""
    for name, text in {"campaign.toml": CAMPAIGN, "factors.csv": "3.986004418e14,0.0\n", **files}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def test_declared_data_goes_with_the_run_and_counts_as_the_models_source(tmp_path):
    model = model_with_data('("factors.csv", "data/table.csv")', later=LATER)
    folder = put(tmp_path / "mine", {"model.py": model, "data/table.csv": "1.0\n", "thesis.csv": "2.0\n"})
    assert call("check", folder).exit_code == 0
    flown(tmp_path, "run", folder, "--cases", 16, "--no-report", "--out", "first")
    assert {path.name for path in (tmp_path / "first").rglob("*.csv")} == {"factors.csv", "table.csv"}
    (folder / "factors.csv").write_text("3.9e14,0.0\n")
    assert replay(tmp_path / "first", 3).equal
    flown(tmp_path, "run", folder, "--cases", 16, "--no-report", "--out", "edited")
    first, edited = (next((tmp_path / run / "cases").iterdir()).read_bytes() for run in ("first", "edited"))
    assert first != edited
    (tmp_path / "first" / "factors.csv").write_text("3.9e14,0.0\n")
    with pytest.raises(StoreError, match=r"factors.csv"):
        extend(tmp_path / "first", 32)


def test_an_edited_table_of_numbers_is_read_again_in_the_same_process(tmp_path):
    put(tmp_path, {"model.py": model_with_data()})
    digests = set()
    for number in ("3.986004418e14", "3.9e14", "3.986004418e14"):
        (tmp_path / "factors.csv").write_text(f"{number},0.0\n")
        campaign = load_campaign(tmp_path / "campaign.toml")
        assert campaign.model.rhs.function.__globals__["MU"] == float(number)
        digests.add(source_digest(campaign.model, tmp_path))
    assert len(digests) == 2


CHANGING = f"{AERO}\nPath(__file__).with_name('factors.csv').write_text('3.9e14,0.0')\n"
MISTAKES = {
    "missing": ({"model.py": model_with_data().replace("factors.csv", "aero.csv")},
                r'model.py, line \d+: there is no file "aero.csv"; .*named in data=\("aero.csv",\)'),
    "missing and not read": ({"model.py": model_with_data('("aero.csv",)')},
                             'data: there is no file "aero.csv" beside the model'),
    "outside": ({"model.py": model_with_data('("../factors.csv",)'), "../factors.csv": ""},
                'data: "../factors.csv" lies outside the folder of the model'),
    "computed": ({"model.py": model_with_data("NAMES", f"{AERO}\nNAMES = ('factors.csv',)")},
                 r'data: write "factors.csv" into the call itself'),
    "a text": ({"model.py": model_with_data('"factors.csv"')}, r"`data`; it must be a tuple"),
    "changing": ({"model.py": model_with_data(first=CHANGING)},
                 r'"factors.csv" was changed while the model was loaded'),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_wrong_data_is_refused_with_a_sentence(mistake, tmp_path):
    files, sentence = MISTAKES[mistake]
    with pytest.raises(CampaignError, match=sentence):
        load_campaign(put(tmp_path / "mine", files))


@pytest.mark.parametrize("later", ["", LATER])
def test_a_file_that_is_read_and_not_declared_is_named_before_anything_flies(later, tmp_path):
    model = model_with_data('("factors.csv",)' if later else "()", later=later)
    folder = put(tmp_path / "mine", {"model.py": model, "data/table.csv": "1.0\n"})
    for command in (["check", folder], ["run", folder, "--out", tmp_path / "run"]):
        done = said(tmp_path, *command)
        assert done.returncode == 2
        assert ("table.csv" if later else "factors.csv") in done.stderr
        assert "a run keeps copies only of the model's sources and of the files that its `data` names" in done.stderr
        assert str(tmp_path) not in done.stderr
        assert not (tmp_path / "run").exists()


def test_data_of_an_installed_model_count_as_its_source(tmp_path, monkeypatch):
    put(tmp_path / "pkg_data", {"model.py": model_with_data()})
    put(tmp_path, {"campaign.toml": CAMPAIGN.replace("model.py", "pkg_data.model")})
    monkeypatch.syspath_prepend(tmp_path)
    digests = set()
    for number in ("3.986004418e14", "3.9e14"):
        (tmp_path / "pkg_data" / "factors.csv").write_text(f"{number},0.0\n")
        sys.modules.pop("pkg_data.model", None)
        model = load_campaign(tmp_path / "campaign.toml").model
        assert model.rhs.function.__globals__["MU"] == float(number)
        digests.add(source_digest(model, None))
    assert len(digests) == 2
    (tmp_path / "pkg_data" / "factors.csv").write_text("4.1e14,0.0\n")  # the module in memory has the numbers of before
    with pytest.raises(CampaignError, match=r'"factors.csv" was changed .* begin again in a new Python process'):
        load_campaign(tmp_path / "campaign.toml")


def test_a_curve_that_another_model_of_the_package_has_read_is_not_taken_as_it_is_now(tmp_path, monkeypatch):
    curve = "from mc_engine.physics.curves import curve\nK = curve('k.csv', y_unit='m')\n"
    files = {name: f"{MODEL}\nfrom pkg_curve.common import K\n" for name in ("a.py", "b.py")}
    put(tmp_path / "pkg_curve", {**files, "common.py": curve, "k.csv": "x,y\n0,1\n5,1\n"})
    monkeypatch.syspath_prepend(tmp_path)
    load_model("pkg_curve.a")
    (tmp_path / "pkg_curve" / "k.csv").write_text("x,y\n0,2\n5,2\n")
    with pytest.raises(ModelError, match=r'"k.csv" was changed .* begin again in a new Python process'):
        load_model("pkg_curve.b")


@pytest.mark.parametrize("other", ["pipe", "folder", "lost link", "deep", "signs"])
def test_what_lies_beside_a_model_and_is_not_its_own_hinders_nothing(other, tmp_path):
    folder = campaign_in(tmp_path / "mine", BESIDE, "from dynamics import pull")
    stranger = folder / "stranger.py"
    make = {
        "pipe": lambda: os.mkfifo(stranger),
        "folder": stranger.mkdir,
        "lost link": lambda: stranger.symlink_to(tmp_path / "nowhere.py"),
        "deep": lambda: stranger.write_text("x = " + "(" * 100_000),
        "signs": lambda: stranger.write_text("x = " + "-" * 50_000 + "1"),
    }
    make[other]()
    companions = companions_of(load_campaign(folder, cases=4))
    assert {"model.py", "dynamics.py", "constants.py"} <= set(companions)
    assert ("stranger.py" in companions) == (other in ("deep", "signs"))


def test_a_source_that_is_a_link_out_of_the_folder_goes_with_the_run_under_the_links_name(tmp_path):
    (tmp_path / "library.py").write_text(MU)
    files = {name: text for name, text in BESIDE.items() if name != "constants.py"}
    folder = campaign_in(tmp_path / "mine", files, "from dynamics import pull")
    (folder / "constants.py").symlink_to(tmp_path / "library.py")
    assert companions_of(load_campaign(folder, cases=4))["constants.py"] == MU.encode()


EMPIRICAL = """[campaign]
model = "{model}"
design = "mc"
cases = 8
seed = 1
[dispersion.magnitude_error_pct]
dist = "empirical"
file = "{file}"
column = "error"
"""


def named_campaign(folder, model, file):
    """The minimal model with an input from a file, under names that lead to them in some way or other."""
    (folder / "lib").mkdir(parents=True)
    (folder / "lib" / "model.py").write_text(MODEL)
    (folder / "lib" / "errors.csv").write_text("error\n1.0\n-1.0\n0.5\n")
    (folder / "model.py").symlink_to("lib/model.py")
    (folder / "errors.csv").symlink_to("lib/errors.csv")
    (folder / "campaign.toml").write_text(EMPIRICAL.format(model=model, file=file))


@pytest.mark.parametrize(
    ("model", "file"), [("model.py", "lib/../lib/errors.csv"), ("lib/../lib/model.py", "errors.csv")]
)
def test_a_run_stands_alone_whatever_way_the_campaign_names_its_files(model, file, tmp_path, monkeypatch):
    named_campaign(tmp_path / "mine", model, file)
    monkeypatch.chdir(tmp_path)
    run(load_campaign(tmp_path / "mine"), tmp_path / "flown", workers=1)
    (tmp_path / "mine").rename(tmp_path / "away")
    assert damage(tmp_path / "flown") == []
    assert replay(tmp_path / "flown", 3).equal
    assert extend(tmp_path / "flown", 12, workers=1).n_cases == 12


def test_a_run_directory_with_the_name_of_an_imported_module_is_no_source(tmp_path):
    """As after `run rocketpy.toml --out rocketpy` of a simulator that imports RocketPy."""
    folder = campaign_in(tmp_path, BESIDE, "from dynamics import pull")
    campaign = load_campaign(folder / "campaign.toml", cases=2)
    run(campaign, folder / "dynamics")
    assert (folder / "dynamics" / "model.py").exists()
    assert source_digest(load_campaign(folder / "campaign.toml").model, None) == source_digest(campaign.model, None)
