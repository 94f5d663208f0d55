"""Disks that fill up in the middle of a run: exit status 4, a sentence with the path, and nothing committed is lost."""

import shutil
import subprocess
import sys

import pytest
from stones import assert_as_unbroken, assert_no_wrong_row, results, stones
from trapped import ENVIRONMENT

from mc_engine.runner import runner

MIB = 2**20
KIB_OF_LARGEST_FILE = 6

# The command line with a limit on the size of any file it writes, which every system of the POSIX kind keeps.
LIMITED = f"""
import resource, signal, sys
from mc_engine.__main__ import main
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # so that the write fails, as on a full disk
resource.setrlimit(resource.RLIMIT_FSIZE, ({KIB_OF_LARGEST_FILE * 1024},) * 2)
sys.argv[0] = "mc-engine"
main()
"""


@pytest.fixture(params=[1, pytest.param(10, marks=pytest.mark.slow)], ids="{} MiB".format)
def small_disk(request, tmp_path):
    """A folder on a disk of so many MiB, and the size."""
    place = tmp_path / "disk"
    place.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={request.param}m", "tmpfs", str(place)],
                             capture_output=True, check=False) if sys.platform == "linux" else None  # fmt: skip
    if mounted is None or mounted.returncode:
        pytest.skip("a disk of a chosen size can be mounted by root on Linux alone")
    yield place, request.param
    subprocess.run(["umount", str(place)], check=True)


def engine(*arguments, script=None):
    command = [sys.executable, "-c", script] if script else [sys.executable, "-m", "mc_engine"]
    done = subprocess.run(
        [*command, *map(str, arguments)], capture_output=True, text=True, env=ENVIRONMENT, check=False
    )
    assert "Traceback" not in done.stderr
    return done


def check_stopped(done, run, table):
    """The run came to its end with a sentence; what it counts is right.  How many cases that is."""
    assert done.returncode == 4, done.stderr
    assert str(run) in done.stderr
    assert f"`mc-engine resume {run}`" in " ".join(done.stderr.split())
    return len(assert_no_wrong_row(run, table).cases(["case_id"]))


def test_a_disk_that_fills_up_ends_the_run_with_status_4_and_all_that_was_committed(
    small_disk, tmp_path, record_property
):
    place, mib = small_disk
    cases = 25_000 * mib  # of some 80 bytes each
    campaign = stones(tmp_path / "campaign", cases)
    whole = runner.run(campaign, tmp_path / "whole", workers=2, chunk=cases // 50)
    done = engine("run", tmp_path / "campaign", "--out", place / "run", "--no-report", "--workers", 2)
    committed = check_stopped(done, place / "run", whole.cases())
    record_property("committed cases", committed)
    record_property("of", cases)
    assert 0 < committed < cases
    assert "No space left" in done.stderr
    again = engine("resume", place / "run", "--no-report")  # still full
    assert check_stopped(again, place / "run", whole.cases()) >= committed


def test_reports_on_a_full_disk_end_with_status_4_and_leave_nothing_half_written(small_disk, tmp_path, record_property):
    place, mib = small_disk
    stones(tmp_path / "campaign", 200)
    run = place / "run"
    assert engine("run", tmp_path / "campaign", "--out", run, "--no-report").returncode == 0
    filler = place / "filler"
    filler.write_bytes(bytes(shutil.disk_usage(place).free - 100_000))
    before = {path.name for path in run.iterdir()}
    done = engine("report", run)
    assert done.returncode == 4, done.stderr
    assert done.stderr.startswith(f"{run}/report.html: No space left on device; ")
    assert f"`mc-engine report {run}` writes the reports" in done.stderr
    assert {path.name for path in run.iterdir()} - {".derived.lock"} == before
    filler.unlink()
    assert engine("verify", run).returncode == 0
    record_property("MiB", mib)


def test_a_run_whose_files_may_not_grow_stops_in_the_same_way_and_goes_on_when_they_may(tmp_path):
    pytest.importorskip("resource", reason="Windows limits no sizes of files")
    campaign = stones(tmp_path / "campaign", 4000)
    whole = runner.run(campaign, tmp_path / "whole", workers=1, chunk=100)
    run = tmp_path / "run"
    done = engine("run", tmp_path / "campaign", "--out", run, "--no-report", "--workers", 1, script=LIMITED)
    assert done.returncode == 4, done.stderr
    assert "File too large" in done.stderr
    if (run / "journal.jsonl").exists():
        assert_no_wrong_row(run, whole.cases())
        runner.resume(run, workers=1, chunk=100)
    else:
        runner.run(campaign, run, workers=1, chunk=100)
    assert_as_unbroken(run, results(whole.path))
