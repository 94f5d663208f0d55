"""The command line as a shell meets it: the list of campaigns, completion, the time that help takes."""

import subprocess
import sys
from itertools import pairwise

import pytest
from cart import call, fails_with
from small_run import ENVIRONMENT

import mc_engine


def test_list_names_the_source_of_each_system_once_below_its_campaigns():
    lines = call("list").stdout.splitlines()
    sources = [(above.split()[0].split("/")[0], line.split("source: ")[1]) for above, line in pairwise(lines)
               if line.startswith(" ")]  # fmt: skip
    assert [folder for folder, _ in sources] == [
        "deorbit", "flexible_satellite", "geo_injection", "geo_servicing", "reentry"
    ]  # fmt: skip
    assert sources[0][1] == mc_engine.load_campaign("deorbit").model.source


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


def test_help_takes_less_than_150_ms_of_a_processor():
    """User time of the whole process, the best of some tries; a fresh one, as in a shell."""
    script = "import resource; from mc_engine.cli import app\ntry: app(['--help'])\nfinally: print(chr(10), "
    script += "resource.getrusage(resource.RUSAGE_SELF).ru_utime)"
    command = [sys.executable, "-c", script]
    tries = [subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT).stdout for _ in range(5)]
    assert min(float(text.split()[-1]) for text in tries) < 0.150


def test_a_sentence_about_what_is_missing_names_the_next_command(tmp_path):
    fails_with(2, call("check", "no_such_campaign_anywhere"), "`mc-engine list` names the campaigns")
    fails_with(2, call("status", tmp_path), "`mc-engine run` makes one")
    made = call("init", tmp_path / "new")
    assert f"`mc-engine check {tmp_path / 'new'}`" in made.output
