"""Models whose physics stands in several files: beside the model, in packages there, or in an installed package."""

import os
import subprocess
import sys

import pytest
from small_run import ENVIRONMENT

from mc_engine.campaign import SHIPPED, load_campaign
from mc_engine.errors import CampaignError
from mc_engine.flown_campaign import companions_of
from mc_engine.kernel import source_digest
from mc_engine.runner import extend, replay, run
from mc_engine.store import open_store

MODEL = (SHIPPED / "minimal" / "model.py").read_text()
CAMPAIGN = (SHIPPED / "minimal" / "campaign.toml").read_text()
PULL = "g = -MU_EARTH / (r2 * sqrt(r2))"
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
    text = MODEL.replace(PULL, "g = pull(r2)").replace("from collections", f"{imports}\nfrom collections", 1)
    reference = model if "/" not in model else model.removesuffix(".py").replace("/", ".")
    campaign = CAMPAIGN.replace('"model.py"', f'"{reference}"')
    for name, content in {**files, model: text, "campaign.toml": campaign}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)
    return folder


def flown(folder, *words):
    """What the command line says in a process of its own."""
    command = [sys.executable, "-m", "mc_engine", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=ENVIRONMENT, cwd=folder)
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


@pytest.mark.parametrize("layout", LAID_OUT)
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
    assert "same bits" in flown(tmp_path, "replay", "first", 3)  # the run has files of its own
    flown(tmp_path, "extend", "first", "--cases", 32, "--no-report")


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


def test_a_folder_of_an_installed_name_does_not_hide_it(tmp_path):
    (tmp_path / "numpy").mkdir()
    (tmp_path / "scipy").mkdir()
    (tmp_path / "scipy" / "notes.txt").write_text("")
    campaign_in(tmp_path, BESIDE, "import numpy.linalg\nfrom dynamics import pull")
    assert load_campaign(tmp_path / "campaign.toml").model.name == "minimal"


AERO = """import numpy as np
from pathlib import Path

FACTORS = np.loadtxt(Path(__file__).with_name("factors.csv"), delimiter=",")


def tables(o):
    return np.loadtxt(Path(__file__).parent / "data" / "table.csv", delimiter=",", ndmin=1)
"""


def test_data_that_a_model_reads_goes_with_the_run_and_counts_as_its_source(tmp_path, monkeypatch):
    model = MODEL.replace("State = namedtuple", AERO + "\nMU = float(FACTORS[0])\nState = namedtuple", 1)
    model = model.replace(PULL, "g = -MU * look_up(o.tables, 0.0) / (r2 * sqrt(r2))").replace(
        "cos, physics", "cos, look_up, physics"
    )
    model = model.replace("    initial=initial,", "    initial=initial,\n    tables=tables,")
    folder = tmp_path / "mine"
    (folder / "data").mkdir(parents=True)
    (folder / "model.py").write_text(model)
    (folder / "campaign.toml").write_text(CAMPAIGN)
    (folder / "factors.csv").write_text("3.986004418e14,0.0\n")
    (folder / "data" / "table.csv").write_text("1.0\n")
    (folder / "thesis.csv").write_text("2.0\n")
    flown(tmp_path, "run", folder, "--cases", 16, "--no-report", "--out", "first")
    assert {path.name for path in (tmp_path / "first").rglob("*.csv")} == {"factors.csv", "table.csv"}
    (folder / "factors.csv").write_text("3.9e14,0.0\n")
    assert "same bits" in flown(tmp_path, "replay", "first", 3)
    flown(tmp_path, "run", folder, "--cases", 16, "--no-report", "--out", "edited")
    first, edited = (next((tmp_path / run / "cases").iterdir()).read_bytes() for run in ("first", "edited"))
    assert first != edited


def test_an_edited_table_of_numbers_is_read_again_in_the_same_process(tmp_path):
    model = MODEL.replace("State = namedtuple", AERO + "\nMU = float(FACTORS[0])\nState = namedtuple", 1)
    (tmp_path / "model.py").write_text(model.replace(PULL, "g = -MU / (r2 * sqrt(r2))"))
    (tmp_path / "campaign.toml").write_text(CAMPAIGN)
    digests = set()
    for number in ("3.986004418e14", "3.9e14", "3.986004418e14"):
        (tmp_path / "factors.csv").write_text(f"{number},0.0\n")
        campaign = load_campaign(tmp_path / "campaign.toml")
        assert campaign.model.rhs.function.__globals__["MU"] == float(number)
        digests.add(source_digest(campaign.model, tmp_path))
    assert len(digests) == 2


def test_what_another_model_of_the_folder_reads_is_no_source_of_this_one(tmp_path):
    one = MODEL.replace("State = namedtuple", AERO + "\nMU = float(FACTORS[0])\nState = namedtuple", 1)
    for name, text in {"a.csv": "3.9e14,0.0\n", "b.csv": "3.8e14,0.0\n"}.items():
        (tmp_path / name).write_text(text)
    for name in ("a", "b"):
        model = one.replace("factors.csv", f"{name}.csv").replace(PULL, "g = -MU / (r2 * sqrt(r2))")
        (tmp_path / f"model_{name}.py").write_text(model)
        (tmp_path / f"{name}.toml").write_text(CAMPAIGN.replace("model.py", f"model_{name}.py"))
    read = {}
    for name in ("a", "b"):
        campaign = load_campaign(tmp_path / f"{name}.toml")
        read[name] = [path.name for path in campaign.model.sources.late]
    assert read == {"a": ["a.csv"], "b": ["b.csv"]}


def test_folders_of_a_model_cannot_have_the_names_of_those_of_a_run(tmp_path):
    campaign_in(tmp_path, {"cases/dyn.py": DYNAMICS.format(constants="cases.constants"), "cases/constants.py": MU},
                "from cases.dyn import pull")  # fmt: skip
    with pytest.raises(CampaignError, match=r"cases/constants.py: every run has a folder"):
        companions_of(load_campaign(tmp_path / "campaign.toml"))


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


def test_a_nested_source_that_is_imported_is_told_in_a_sentence(tmp_path):
    files = {**BESIDE, "constants.py": f"{MU}x = {'(' * 100_000}"}
    with pytest.raises(CampaignError, match=r"(?s)constants.py|too many nested|MemoryError"):
        load_campaign(campaign_in(tmp_path, files, "from dynamics import pull"), cases=4)


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
    assert open_store(tmp_path / "flown").verify() == []
    assert replay(tmp_path / "flown", 3).equal
    assert extend(tmp_path / "flown", 12, workers=1).n_cases == 12


@pytest.mark.parametrize("way", ["../mine/lib/errors.csv", "{folder}/lib/errors.csv"])
def test_a_name_that_leads_out_of_the_folder_and_back_is_refused_with_the_straight_one(way, tmp_path):
    folder = tmp_path / "mine"
    named_campaign(folder, "model.py", way.format(folder=folder))
    with pytest.raises(CampaignError, match=r'leads through other folders than .*; write "lib/errors.csv"'):
        load_campaign(folder)
