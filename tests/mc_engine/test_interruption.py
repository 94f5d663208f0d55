"""Ctrl-C and SIGTERM outside of the flight itself: exit status 4, and the command that goes on as the last words."""

import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from mc_engine.campaign.loading import load_campaign
from mc_engine.command_line.next_step import is_complete
from mc_engine.interruption import COMPLETING, NOTHING_BEGUN, ONCE_MORE, in_threads
from mc_engine.runner import runner
from tests.mc_engine.store.small_run import ENVIRONMENT

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no signals from process to process")

# A process of the command line in which a function of the engine is exchanged for one that ends it.
SCRIPT = """
import hashlib, importlib, os, signal, sys, threading, time
from mc_engine.__main__ import main

def send(count=1):
    for _ in range(count):
        os.kill(os.getpid(), signal.{signal})
        time.sleep(0.01)

def work(*pauses_s, rounds=10**9):
    "Code that leaves the interpreter alone, as a kernel does, for minutes, while a signal comes after each pause."
    threading.Thread(target=lambda: [(time.sleep(pause), send()) for pause in pauses_s]).start()
    hashlib.pbkdf2_hmac("sha256", b"", b"", rounds)

def victim(*arguments, **options):
    {body}

module, name = {place!r}.rsplit(".", 1)
original = getattr(importlib.import_module(module), name)
setattr(importlib.import_module(module), name, victim)
sys.argv = ["mc-engine", *{arguments!r}]
{then}
main()
"""
CAMPAIGN, REPORTS = "mc_engine.campaign.loading.load_campaign", "reports.write_reports"
KERNEL = "mc_engine.flight.flight._bound_kernel"
HISTORIES = "mc_engine.runner.sessions.write_histories"
COMPANION = "mc_engine.runner.sessions._fly_companion"  # the last that is flown


def command(place, body, *arguments, by="SIGTERM", then=""):
    """A command in which `body` stands for the function at `place`, and which does `then` before it begins.

    As a module: only then Python's own way of ending after an interruption matters.
    """
    script = SCRIPT.format(signal=by, body=body, place=place, arguments=[str(word) for word in arguments], then=then)
    with TemporaryDirectory() as folder:
        (Path(folder) / "exchanged.py").write_text(script)
        path = os.pathsep.join([folder, ENVIRONMENT["PYTHONPATH"]])
        done = subprocess.run([sys.executable, "-m", "exchanged"], capture_output=True, text=True, timeout=60,
                              env={**ENVIRONMENT, "PYTHONPATH": path})  # fmt: skip
    assert "Traceback" not in done.stderr, done.stderr
    return done


def ended(*words, **options):
    """Exit status of such a command, and its last words."""
    done = command(*words, **options)
    return done.returncode, done.stderr.splitlines()[-1]


@pytest.mark.parametrize("by", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize(
    "body",
    [
        pytest.param("send()", id="in a call"),
        pytest.param('exec("send()", {"send": send})', id="in generated code"),
        pytest.param("send(2)", id="twice"),
        pytest.param("try: send()\n    except BaseException: raise ValueError from None", id="made another error"),
    ],
)
def test_a_signal_before_anything_is_there_says_so(tmp_path, body, by):
    said = ended(CAMPAIGN, body, "run", "minimal", "--out", tmp_path / "run", by=by)
    assert said == (4, NOTHING_BEGUN)


def test_a_signal_that_a_library_swallows_stops_the_flight_that_follows(tmp_path):
    body = "\n    ".join(["try: send()", "except BaseException: pass", "return original('minimal', cases=20)"])
    run = tmp_path / "run"
    status, said = ended(CAMPAIGN, body, "run", "minimal", "--out", run)
    assert (status, said) == (4, f"interrupted with 0 of 20 cases; `mc-engine resume {run}` flies the rest")


@pytest.mark.parametrize(
    "body", ["send()", pytest.param("\n    ".join(["try: send()", "finally: send()"]), marks=pytest.mark.slow)]
)
def test_a_signal_after_the_flight_stops_the_reports_and_names_the_command_that_writes_them(tmp_path, body):
    run, unreported = tmp_path / "run", tmp_path / "unreported"
    status, said = ended(REPORTS, body, "run", "minimal", "--cases", 20, "--out", run)
    assert (status, said) == (4, f"interrupted; all cases are there, `mc-engine report {run}` writes the reports")
    assert is_complete(run)
    assert ended(REPORTS, body, "report", run) == (4, f"interrupted; `mc-engine report {run}` writes the reports")
    late = "\n    ".join(["done = original(*arguments)", "send()", "return done"])
    done = command(COMPANION, late, "run", "minimal", "--cases", 20, "--no-report", "--out", unreported)
    assert done.returncode == 0
    assert COMPLETING in done.stderr.splitlines()
    assert is_complete(unreported)
    early = "\n    ".join(["send()", "return original(*arguments)"])
    status, said = ended(HISTORIES, early, "run", "minimal", "--cases", 20, "--no-report", "--out", tmp_path / "cut")
    assert (status, said.split(";")[0]) == (4, "interrupted with 20 of 20 cases and without the saved time histories")


def test_a_signal_to_a_verb_that_keeps_nothing_says_to_give_it_again():
    assert ended(CAMPAIGN, "send()", "check", "minimal") == (4, ONCE_MORE)


def test_two_signals_end_a_kernel_that_python_cannot_interrupt(tmp_path):
    run = tmp_path / "run"
    done = command(KERNEL, "return lambda: work(0.5, 1.0)", "run", "minimal", "--out", run)
    rest = f"interrupted; what was committed is safe, `mc-engine resume {run}` flies the rest"
    assert done.returncode == 4
    assert done.stderr.splitlines()[-2:] == [COMPLETING, rest]


@pytest.mark.parametrize(
    ("words", "pauses_s"),
    [(("replay", "RUN", "3"), "0.5"), (("bench", "minimal"), "0.5"), (("rare", "minimal"), "0.5, 1.0")],
)
def test_signals_end_a_kernel_of_a_command_that_is_no_run(tmp_path, monkeypatch, words, pauses_s):
    """The first one, but for a search, which has the flights under way complete."""
    monkeypatch.chdir(tmp_path)
    if words[0] == "replay":
        runner.run(load_campaign("minimal", cases=20), tmp_path / "RUN", workers=1)
    status, said = ended(KERNEL, f"return lambda: work({pauses_s})", *words)
    assert (status, said.split(";")[0]) == (4, "interrupted")


def test_items_that_are_not_begun_when_one_fails_are_left():
    begun = []

    def work(item):
        begun.append(item)
        if item == 2:
            raise ValueError("two")
        time.sleep(0.1)
        return -item

    assert in_threads(work, [0, 1, 3], 2) == [0, -1, -3]
    assert in_threads(work, []) == []
    begun.clear()
    with pytest.raises(ValueError, match="two"):
        in_threads(work, range(9))
    time.sleep(0.3)
    assert begun == [0, 1, 2, *begun[3:4]]


def test_a_signal_while_the_command_line_is_loaded_says_that_nothing_was_begun():
    """The first of its modules that is loaded after `install_handlers` never finishes loading."""
    script = (
        "import os, signal, sys, time\n"
        "class Finder:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'mc_engine.command_line.commands':\n"
        "            os.kill(os.getpid(), signal.SIGTERM)\n"
        "            time.sleep(30.0)\n"
        "from mc_engine.__main__ import main\n"
        "sys.meta_path.insert(0, Finder())\nmain()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=ENVIRONMENT, timeout=60)
    assert (done.returncode, done.stderr) == (4, f"{NOTHING_BEGUN}\n")
