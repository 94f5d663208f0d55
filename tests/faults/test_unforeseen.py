"""Errors that nobody foresaw, and too little memory: a sentence, a log of one's own, and the exit status 6."""

import os
import re
import resource
import stat
import subprocess
import sys
import threading
import warnings
from pathlib import Path

import pytest
import typer
from mutated_records import assert_answered, call

import mc_engine
from mc_engine import unforeseen
from mc_engine.command_line.app import exit_status

ROOT = Path(mc_engine.__file__).resolve().parents[1]


class Panic(BaseException):
    """What a library in Rust raises; it is no Exception."""


def deep(n):
    return deep(n + 1) + 1


FAULTS = {
    "a mistake": (lambda: 1 / 0, "ZeroDivisionError: 'division by zero'"),
    "a panic": (lambda: (_ for _ in ()).throw(Panic("index out of range")), "Panic: 'index out of range'"),
    "recursion": (lambda: deep(0), "RecursionError"),
    "half a letter": (lambda: "\ud800".encode(), "UnicodeEncodeError"),
    "memory": (lambda: bytearray(2**62), "the memory that this process may have does not suffice"),
    "memory of a library": (lambda: (_ for _ in ()).throw(OSError(12, "Cannot allocate memory")), "does not suffice"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_an_error_nobody_foresaw_is_a_sentence_a_log_and_the_exit_status_6(capsys, fault):
    act, words = FAULTS[fault]
    with pytest.raises(typer.Exit) as left:
        exit_status()(act)()
    said = capsys.readouterr().err
    assert left.value.exit_code == 6
    assert words in said
    assert said.count("\n") == 1
    log = Path(re.search(r"; (\S+\.log) says where", said)[1]).expanduser()
    assert "Traceback" in log.read_text()
    assert os.name == "nt" or stat.S_IMODE(log.stat().st_mode) == 0o600
    log.unlink()


def test_a_disk_that_takes_no_log_changes_nothing(monkeypatch, tmp_path):
    monkeypatch.setattr(unforeseen.tempfile, "tempdir", str(tmp_path / "absent"))
    assert unforeseen.unforeseen(ValueError("x")).endswith("ValueError: 'x'")


def test_warnings_and_errors_of_threads_are_lines_without_source(monkeypatch, capsys):
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)
    monkeypatch.setattr(threading, "excepthook", threading.excepthook)
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)
    unforeseen.catch_all()
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.showwarning = unforeseen._tell_warning
        warnings.warn("overflow\nencountered", RuntimeWarning, stacklevel=1)
    thread = threading.Thread(target=lambda: 1 / 0)
    thread.start()
    thread.join()
    first, second = capsys.readouterr().err.splitlines()
    assert re.fullmatch(r"warning: test_unforeseen\.py, line \d+: overflow encountered", first)
    assert second.startswith("the program failed, ")
    Path(re.search(r"(\S+\.log)", second)[1]).expanduser().unlink()


def limited(mib, *arguments, cwd):
    """A process of the command line that may have so many MiB of addresses."""

    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (mib * 2**20, mib * 2**20))

    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run([sys.executable, "-m", "mc_engine", *map(str, arguments)], capture_output=True, text=True,
                          timeout=300, preexec_fn=limit, cwd=cwd, env=environment, check=False)  # fmt: skip


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems keep no limit of addresses")
@pytest.mark.parametrize(
    "mib", [400, 683, *(pytest.param(mib, marks=pytest.mark.slow) for mib in (900, 976, 1500, 1953, 3000))]
)
def test_with_little_memory_a_command_works_or_says_so(tmp_path, mib):
    (tmp_path / "runs").mkdir()
    for command in (("check", "minimal"), ("run", "minimal", "--cases", "50", "--out", "runs/a"), ("report", "runs/a")):
        done = limited(mib, *command, cwd=tmp_path)
        assert done.returncode in (0, 2, 6) or (command[0] == "report" and done.returncode == 5), done.stderr
        assert "Traceback" not in done.stderr
        assert "OpenBLAS" not in done.stderr
        assert len(done.stderr.splitlines()) < 8
        if mib < 900:
            assert (done.returncode, done.stderr.count("\n")) == (6, 1)
            assert "`ulimit -v`" in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="there a working folder cannot be removed")
@pytest.mark.parametrize("started", ["-m mc_engine", "-P -m mc_engine"])  # the latter as by the installed command
def test_a_working_folder_that_was_removed_is_told_and_is_no_unmet_requirement(tmp_path, started):
    script = f'mkdir gone && cd gone && rmdir ../gone && exec "{sys.executable}" {started} check minimal'
    done = subprocess.run(["sh", "-c", script], capture_output=True, text=True, cwd=tmp_path, check=False,
                          env={**os.environ, "PYTHONPATH": str(ROOT)})  # fmt: skip
    assert done.returncode == 2
    assert done.stderr == "the working folder: No such file or directory; change to another folder first\n"


def test_a_build_time_that_numpy_cannot_read_is_told(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "SOURCE_DATE_EPOCH": "abc"}
    done = subprocess.run([sys.executable, "-m", "mc_engine", "run", "minimal", "--cases", "8"], capture_output=True,
                          text=True, cwd=tmp_path, env=environment, check=False)  # fmt: skip
    assert done.returncode == 2
    assert done.stderr == "SOURCE_DATE_EPOCH: 'abc' is no whole number of seconds; correct or unset it\n"


def test_without_numbas_compiler_a_command_says_so(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-m", "mc_engine", "check", "minimal"], capture_output=True, text=True,
                          cwd=tmp_path, env=environment, check=False)  # fmt: skip
    assert done.returncode == 2
    assert "NUMBA_DISABLE_JIT" in done.stderr
    assert "Traceback" not in done.stderr


OPTIONS = [
    *[("run", "minimal", "--backend", "loky", "--out", "r", option, value) for option, value in [
        ("--memory", "9" * 20), ("--memory", "1_000"), ("--memory", "9" * 12), ("--memory", "\u0661\u0662\u0663\u0664"),
        ("--memory", "1e3"), ("--case-seconds", "nan"), ("--case-seconds", "inf"), ("--case-seconds", "-1"),
        ("--case-seconds", "1e300"), ("--case-seconds", "1_0"), ("--patience", "nan"), ("--patience", "inf"),
        ("--workers", "9" * 20), ("--workers", "0"), ("--workers", "9" * 5000), ("--max-failed", "9" * 20),
        ("--max-failed", "-1"), ("--seed", "9" * 20), ("--seed", "0x10"), ("--cases", "9" * 20), ("--cases", "-5")]],
    *[("plan", "--share", share, "--confidence", confidence) for share, confidence in [
        ("nan", "0.9"), ("0.9", "inf"), ("1e-300", "0.9"), ("0.9999999999999999", "0.9"), ("0.9", "1e-300")]],
    ("plan", "--share", "0.9", "--confidence", "0.9", "--failures", "9" * 18),
    *[("compare", "a", "b", "--tolerance", value) for value in ("nan", "inf", "-1", "infinity")],
    ("compare", "a", "b", "--alpha", "nan"),
    *[("tune", "minimal", option, "9" * 18) for option in ("--generations", "--population", "--seed", "--workers")],
    *[("rare", "minimal", option, "9" * 20) for option in ("--cases-per-level", "--seed", "--workers")],
    *[("bench", "minimal", option, "9" * 18) for option in ("--cases", "--repeats")],
    ("merge", "a", "b", "--chunk", "9" * 18), ("extend", "a", "--cases", "9" * 18),
]  # fmt: skip


@pytest.mark.parametrize("arguments", OPTIONS, ids=lambda one: " ".join(one)[:60])
def test_numbers_of_options_that_cannot_be_are_refused(tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    assert_answered(call(*arguments), 2)
    assert not list(tmp_path.iterdir())
