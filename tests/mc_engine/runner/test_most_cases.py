"""More cases than a run can have are refused as a slip of the user's, before anything is written."""

import pytest

from mc_engine.errors import CampaignError
from mc_engine.runner import runner
from mc_engine.status import MOST_CASES
from tests.mc_engine.command_line.cart import call, fails_with

LIMIT = f"{MOST_CASES + 1} is not allowed; it must be at most {MOST_CASES}"


def test_more_cases_than_a_run_can_have_are_a_slip_of_the_users(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fails_with(2, call("run", "minimal", "--cases", MOST_CASES + 1, "--out", "run"), LIMIT)
    done = call("run", "minimal", "--cases", 20, "--out", "run", "--no-report")
    assert done.exit_code == 0, done.output
    journal = (tmp_path / "run" / "journal.jsonl").read_bytes()
    fails_with(2, call("extend", "run", "--cases", MOST_CASES + 1), f"cases: {LIMIT}")
    with pytest.raises(CampaignError, match=LIMIT):
        runner.extend("run", MOST_CASES + 1)
    assert (tmp_path / "run" / "journal.jsonl").read_bytes() == journal
    fails_with(2, call("merge", "merged", "run", "--chunk", MOST_CASES + 1), f"1<=x<={MOST_CASES}")
    assert not (tmp_path / "merged").exists()
