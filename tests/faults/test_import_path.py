"""Files in the current folder that are named as libraries are: no process of the engine imports them."""

import sys

import pytest
from falling import engine, falling

from mc_engine import load_campaign, run
from tests.mc_engine.flight.falling_ball import python_campaign

NAMES = (
    "psutil json numpy random typing numba pandas pyarrow joblib distributed msgpack tomllib pickle signal"
).split()


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    return falling(tmp_path_factory.mktemp("campaign"))


def flown_among(names, folder, campaign, backend, again=True):
    """Fly, and fly again what failed, from a folder where files have these names: none of them is imported."""
    folder.mkdir()
    for name in names:
        (folder / f"{name}.py").write_text(f"open('imported_{name}', 'w')\nraise RuntimeError('imported {name}')\n")
    options = ["--workers", 1, "--no-report", "--backend", backend]
    for words in [["run", campaign, "--out", "flown"], ["rerun", "flown", "--failed"]][: 1 + again]:
        done = engine(*words, *options, cwd=folder)
        assert done.returncode == 0, done.stderr
        assert "imported" not in done.stderr
    assert not list(folder.glob("imported_*"))


@pytest.fixture(scope="module")
def simulator(tmp_path_factory):
    return python_campaign(tmp_path_factory.mktemp("simulator") / "ball", cases=4)


@pytest.mark.parametrize("backend", ["loky", pytest.param("dask", marks=pytest.mark.slow)])
def test_files_named_as_libraries_in_the_current_folder_are_not_imported(backend, campaign, tmp_path):
    if backend == "dask":
        pytest.importorskip("distributed")
    flown_among(NAMES, tmp_path / "here", campaign, backend, again=backend == "loky")


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["threading", "loky", "dask"])
@pytest.mark.parametrize("name", NAMES)
def test_no_such_file_is_imported_alone_either(name, backend, campaign, tmp_path):
    flown_among([name], tmp_path / "here", campaign, backend)


@pytest.mark.parametrize(
    "backend", ["threading", *(pytest.param(name, marks=pytest.mark.slow) for name in ("loky", "dask"))]
)
def test_processes_of_a_simulator_import_no_such_file(backend, simulator, tmp_path):
    if backend == "dask":
        pytest.importorskip("distributed")
    flown_among(NAMES, tmp_path / "here", simulator, backend, again=False)


def test_processes_do_not_import_from_the_current_folder_of_an_interactive_session(simulator, tmp_path, monkeypatch):
    for name in {*NAMES} & sys.modules.keys():  # others are imported from there by the session itself
        (tmp_path / f"{name}.py").write_text(f"raise RuntimeError('imported {name}')\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", ["", *sys.path])  # as Python has it there
    campaign = load_campaign(simulator, seed=4)
    assert run(campaign, tmp_path / "run", workers=1).status_counts() == {"ok": 4}
