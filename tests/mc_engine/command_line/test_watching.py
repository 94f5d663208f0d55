"""`mc-engine run --watch`: flown again on every saved change, mistakes told on the page, until Ctrl-C."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest

from mc_engine.command_line.watching import _stamps
from tests.mc_engine.model.mistaken_campaign import write_campaign
from tests.mc_engine.store.small_run import ENVIRONMENT

PATIENCE_S = 120.0


@contextmanager
def watched(folder):
    """The process that watches `folder`, its page in `page` beside it."""
    command = [sys.executable, "-m", "mc_engine", "run", folder.name, "--watch", "--cases", "20", "--out", "page"]
    process = subprocess.Popen(
        command, cwd=folder.parent, env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def shown_when(page, holds):
    """What the page is told to show, once that holds."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if (page / "state.js").exists():
            text = (page / "state.js").read_text()
            state = json.loads(re.fullmatch(r"state\((.*)\);\n", text)[1])
            if holds(state):
                return state
        time.sleep(0.1)
    raise AssertionError(f"the page never showed it; it shows {text}")


def save(file, text):
    """Save as an editor does, a little later than the file before."""
    time.sleep(0.05)
    file.write_text(text)


@pytest.mark.skipif(sys.platform == "win32", reason="sends SIGINT to one process")
def test_every_saved_change_is_flown_and_a_mistake_is_told_above_the_results_before_it(tmp_path):
    folder, page = write_campaign(tmp_path / "mine"), tmp_path / "page"
    model = (folder / "model.py").read_text()
    with watched(folder) as process:
        first = shown_when(page, lambda state: state["report"] > 0)
        report = (page / "report.html").read_bytes()
        assert b"Apogee raised by one burn" in report
        assert not re.search(rb'(?:src|href)="?https?:', (page / "watch.html").read_bytes())
        save(folder / "model.py", model.replace("vy=g * s.y)", "vy=g * s.z)"))
        mistake = shown_when(page, lambda state: state["mistake"])
        assert mistake["mistake"].startswith("model.py, line 30")
        assert mistake["report"] == first["report"]
        assert mistake["line"].endswith("not flown; below, the results before the mistake")
        assert (page / "report.html").read_bytes() == report
        save(folder / "model.py", model)
        mended = shown_when(page, lambda state: state["report"] > first["report"])
        assert mended["mistake"] == ""
        save(folder / "notes.csv", "a data file that lies beside the model\n")
        shown_when(page, lambda state: state["report"] > mended["report"])
        process.send_signal(signal.SIGINT)
        out, complaint = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 4
    assert "no longer watched; the latest results stay in page/watch.html" in complaint
    assert "model.py, line 30" in complaint
    assert out.count("flown in") == 3
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine", "page"]  # no run is kept


def test_a_file_of_the_same_time_and_size_in_the_place_of_another_is_a_saved_change(tmp_path):
    folder = write_campaign(tmp_path / "mine")
    before, old, other = _stamps(folder / "campaign.toml"), folder / "model.py", tmp_path / "other.py"
    other.write_text(old.read_text().replace("10_000", "20_000"))
    os.utime(other, ns=(old.stat().st_atime_ns, old.stat().st_mtime_ns))  # as `rsync --times` and `tar` do
    other.replace(old)
    assert _stamps(folder / "campaign.toml") != before


def test_what_only_a_kept_run_can_have_is_refused(tmp_path):
    command = [sys.executable, "-m", "mc_engine", "run", "minimal", "--watch", "--until", "verdict"]
    done = subprocess.run(command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True)
    assert (done.returncode, "--until: is not for --watch, which keeps no run" in done.stderr) == (2, True)
    assert list(tmp_path.iterdir()) == []


def test_a_backend_that_is_not_there_is_told_before_watching_begins(tmp_path):
    command = [sys.executable, "-m", "mc_engine", "run", "minimal", "--watch", "--backend", "fork"]
    done = subprocess.run(command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, timeout=PATIENCE_S)
    assert (done.returncode, '"fork" is not known' in done.stderr) == (2, True)
    assert list(tmp_path.iterdir()) == []
