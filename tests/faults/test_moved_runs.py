"""A run directory that is moved or removed while the run flies: what is said, and what is kept."""

import os
import shutil
import signal

import pytest
from stones import stones
from test_signals import begin, end

from mc_engine.errors import StoreError
from mc_engine.runner import runner
from mc_engine.store.verification import damage


def rename(run, moved):
    run.rename(moved)


def replace(run, moved):
    run.rename(moved)
    run.mkdir()


def remove(run, moved):
    run.rename(moved)  # all at once: a run without its folder of cases, but with its journal, is told of that folder
    shutil.rmtree(moved, ignore_errors=True)


@pytest.mark.parametrize(
    ("backend", "happen", "signals"),
    [
        pytest.param("threading", rename, 0, marks=pytest.mark.slow),
        ("loky", rename, 0),
        pytest.param("threading", rename, 2, marks=pytest.mark.slow),
        pytest.param("loky", remove, 0, marks=pytest.mark.slow),
        pytest.param("threading", replace, 0, marks=pytest.mark.slow),
        pytest.param("threading", remove, 0, marks=pytest.mark.slow),
        pytest.param("loky", replace, 0, marks=pytest.mark.slow),
        pytest.param("loky", rename, 1, marks=pytest.mark.slow),
        pytest.param("loky", rename, 2, marks=pytest.mark.slow),
    ],
)
def test_a_run_whose_directory_is_gone_says_so_and_goes_on_at_its_new_place(tmp_path, backend, happen, signals):
    process, run, moved = begin(tmp_path, backend, 0.3), tmp_path / "run", tmp_path / "moved"
    happen(run, moved)
    for _ in range(signals):
        os.killpg(process.pid, signal.SIGINT)
    errors = end(process)
    assert process.returncode == 4, errors
    option = "" if backend == "threading" else f" --backend {backend}"
    assert f"{run}: was moved or removed while the run was flying; if it was moved, " in errors.splitlines()[-1]
    assert errors.endswith(f"`mc-engine resume NEW_PLACE{option}` flies the rest\n")
    assert str(run) not in errors.splitlines()[-1].replace(f"{run}: was moved", "")
    if happen is not remove:
        assert damage(moved) == []
        assert runner.resume(moved, workers=2).missing() == []
        assert damage(moved) == []
        assert [path.name for path in tmp_path.glob("run/**/*")] == []  # nothing came back at the old place


@pytest.mark.parametrize("name", ["manifest.json", "campaign.toml"])
def test_a_run_that_lost_what_says_what_it_is_does_not_end_as_complete(tmp_path, name):
    def remove_once(*_):
        (tmp_path / "run" / name).unlink(missing_ok=True)

    with pytest.raises(StoreError, match=rf"{name}: is gone; put the original back"):
        runner.run(stones(tmp_path, 40), tmp_path / "run", progress=remove_once)
