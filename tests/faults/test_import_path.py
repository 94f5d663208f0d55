"""Files in the current folder that are named as libraries are: no process of the engine imports them."""

import pytest
from falling import engine, falling

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


@pytest.mark.parametrize("backend", ["loky", "dask"])
def test_files_named_as_libraries_in_the_current_folder_are_not_imported(backend, campaign, tmp_path):
    if backend == "dask":
        pytest.importorskip("distributed")
    flown_among(NAMES, tmp_path / "here", campaign, backend, again=backend == "loky")


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["threading", "loky", "dask"])
@pytest.mark.parametrize("name", NAMES)
def test_no_such_file_is_imported_alone_either(name, backend, campaign, tmp_path):
    flown_among([name], tmp_path / "here", campaign, backend)
