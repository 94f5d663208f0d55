"""The command line as a shell meets it: the list of campaigns, completion, the time help takes, streams that refuse."""

import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from mc_engine.store.opening import open_store
from mc_engine.store.verification import damage
from tests.mc_engine.store.small_run import ENVIRONMENT


@pytest.mark.parametrize(
    ("begun", "offered"),
    [
        ("deorbit/map", ["deorbit/map", "deorbit/map_wide"]),
        ("cart", ["cart/"]),
        ("cart/", ["cart/campaign.toml"]),
        ("nowhere/", []),
    ],
)
def test_the_shell_completes_campaigns_by_name_and_by_path(tmp_path, begun, offered):
    (tmp_path / "cart").mkdir()
    for name in ("campaign.toml", "model.py"):
        (tmp_path / "cart" / name).write_text("")
    words = {"_MC_ENGINE_COMPLETE": "complete_bash", "COMP_WORDS": f"mc-engine run {begun}", "COMP_CWORD": "2"}
    done = subprocess.run(
        [sys.executable, "-m", "mc_engine"], capture_output=True, text=True, cwd=tmp_path, env={**ENVIRONMENT, **words}
    )
    assert done.stdout.split() == offered


LIBRARIES = "import asyncio, dataclasses, email, http.client, inspect, json, logging, typing, unittest"


def user_time(script, folder):
    """User time [s] of a whole fresh process, as in a shell, its bytecode kept in a folder."""
    environment = {**ENVIRONMENT, "PYTHONPYCACHEPREFIX": str(folder), "PYTHONDONTWRITEBYTECODE": ""}
    script += "\nimport resource; print(resource.getrusage(resource.RUSAGE_SELF).ru_utime)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment)
    return float(done.stdout.split()[-1])


@pytest.mark.parametrize(
    "words",
    [["run", "--help"], *(pytest.param(words, marks=pytest.mark.slow) for words in (["--help"], ["check", "--help"]))],
)
def test_help_takes_hardly_longer_than_python_takes_to_load_some_of_its_own_library(tmp_path, words):
    """0.7 to 1.2 times as long, 100 ms on a quiet machine; numpy or pydantic alone would add 0.6 of it."""
    script = f"from mc_engine.command_line.commands import app\ntry: app({words})\nexcept SystemExit: pass"
    user_time(script, tmp_path), user_time(LIBRARIES, tmp_path)
    assert any(user_time(script, tmp_path) < 1.3 * user_time(LIBRARIES, tmp_path) for _ in range(5))


# ---- streams that refuse what is written to them

posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has neither such devices nor such shells")
full = pytest.param("/dev/full", marks=pytest.mark.skipif(not Path("/dev/full").exists(), reason="only Linux has it"))
refusing = pytest.mark.parametrize("place", [full, pytest.param("pipe", marks=posix)])
RUN = ("run", "minimal", "--cases", "20", "--no-report", "--out")


@contextmanager
def refusal(place):
    """The number of a file that refuses what is written: a full device, or a pipe without a reader."""
    if place == "pipe":
        reader, number = os.pipe()
        os.close(reader)
    else:
        number = os.open(place, os.O_WRONLY)
    try:
        yield number
    finally:
        os.close(number)


def engine(*words, **streams):
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **streams}
    command = [sys.executable, "-m", "mc_engine", *map(str, words)]
    return subprocess.run(command, text=True, env=ENVIRONMENT, timeout=60, **streams)


@refusing
def test_a_standard_error_that_refuses_words_changes_no_exit_status_and_stops_no_run(tmp_path, place):
    with refusal(place) as number:
        done = engine(*RUN, tmp_path / "run", stderr=number)
        assert (done.returncode, open_store(tmp_path / "run").missing()) == (0, [])
        assert engine("verify", tmp_path / "nowhere", stderr=number).returncode == 2
        assert engine("no_such_verb", stderr=number).returncode == 2


@posix
@pytest.mark.parametrize("words", ["units", "--help"])
def test_a_reader_that_has_gone_away_is_no_error(words):
    with refusal("pipe") as number:
        done = engine(words, stdout=number)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("place", [full])
@pytest.mark.parametrize("words", ["units", "--help"])
def test_a_full_disk_behind_standard_output_is_a_sentence_and_no_success(words, place):
    with refusal(place) as number:
        done = engine(words, stdout=number)
    assert done.returncode == 4
    assert done.stderr == "standard output: No space left on device; not all was printed, all else is done\n"


@posix
def test_streams_that_the_shell_closed_are_those_of_no_file(tmp_path):
    command = [sys.executable, "-m", "mc_engine", *RUN, str(tmp_path / "run")]
    closed = ["sh", "-c", 'exec "$@" <&- >&- 2>&-', "sh", *command]
    assert subprocess.run(closed, env=ENVIRONMENT, timeout=60).returncode == 0
    assert damage(tmp_path / "run") == []
