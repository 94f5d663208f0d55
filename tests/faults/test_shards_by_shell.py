"""Shards as a job array flies them: processes of the command line that know nothing of one another."""

import subprocess
import sys
import time

import numpy as np
import pytest
from trapped import ENVIRONMENT, campaign_folder, files_of

from mc_engine import load_campaign
from mc_engine.runner import runner

CASES, OF = 4000, 20


def engine(*arguments, **options):
    command = [sys.executable, "-m", "mc_engine", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, **options)


def done(process):
    """What the process says on stderr, when it has come to a good end."""
    errors = process.communicate(timeout=300.0)[1]
    assert process.returncode == 0, errors
    return errors


def killed_midway(campaign, shard, folder):
    """A shard whose process is killed when its first part has landed."""
    slow = {**ENVIRONMENT, "STONES_SLEEP_S": "2"}
    process = engine("run", campaign, "--shard", shard, "--out", folder, "--workers", 1, env=slow)
    deadline = time.monotonic() + 120.0
    while not list((folder / "cases").glob("part-*")) and time.monotonic() < deadline:
        time.sleep(0.02)
    process.kill()
    process.communicate()


@pytest.mark.parametrize(
    ("of", "killed", "repeated"),
    [(2, 1, 1), pytest.param(OF, 3, 2, marks=pytest.mark.slow)],
)
def test_shards_of_the_shell_in_random_order_merge_to_the_bytes_of_one_run(
    tmp_path, of, killed, repeated, record_property
):
    rng = np.random.default_rng(4)
    campaign = campaign_folder(tmp_path / "stones", CASES)
    numbers = rng.permutation(np.arange(1, of + 1))
    folders = {int(number): tmp_path / f"shard-{number}" for number in numbers}
    for i, (number, folder) in enumerate(folders.items()):
        if i < killed:
            killed_midway(campaign, f"{number}/{of}", folder)
            again = engine("run", campaign, "--shard", f"{number}/{of}", "--out", folder, env=ENVIRONMENT)
            errors = again.communicate(timeout=300.0)[1]
            assert again.returncode == 2
            assert f"`mc-engine resume {folder}` flies the rest" in errors
            done(engine("resume", folder, "--workers", 1, env=ENVIRONMENT))
        else:
            done(engine("run", campaign, "--shard", f"{number}/{of}", "--out", folder, env=ENVIRONMENT))
    twice = []
    for number in list(folders)[-repeated:]:
        twice.append(tmp_path / f"twice-{number}")
        done(engine("run", campaign, "--shard", f"{number}/{of}", "--out", twice[-1], env=ENVIRONMENT))
    everything = [*folders.values(), *twice]
    shards = [everything[i] for i in rng.permutation(len(everything))]
    done(engine("merge", tmp_path / "merged", *shards, "--no-report", "--chunk", 300, env=ENVIRONMENT))
    whole = runner.run(load_campaign(campaign), tmp_path / "whole", workers=2, chunk=300)
    assert files_of(tmp_path / "merged") == files_of(whole.path)
    for what, number in (("shards", of), ("killed", killed), ("flown twice", repeated)):
        record_property(what, number)
    record_property("files equal byte by byte", len(files_of(whole.path)))
