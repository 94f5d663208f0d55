"""kill -9 of the main process at any instant: the resumed run has the bytes of the unbroken one."""

import json
import shutil
import signal
import sys

import numpy as np
import pytest
from killed_runs import KilledRuns, begun
from stones import assert_as_unbroken, assert_no_wrong_row, completed, results, stones

from mc_engine import open_store
from mc_engine.store.verification import damage

CASES, CHUNK, WORKERS = 20_000, 500, 2

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the runs are forked, which Windows cannot")


def check_kills(folder, kills, seed, broken=()):
    """Kill so many runs at random instants and complete them; chunks begun and not kept, for each kill."""
    campaign = stones(folder / "campaign", CASES)
    runs = KilledRuns(folder / "campaign", CHUNK, WORKERS, broken)
    try:
        status, seconds = runs.fly(folder / "whole")
        assert status == 0
        whole, table = results(folder / "whole"), open_store(folder / "whole").cases()
        rng, lost = np.random.default_rng(seed), []
        while len(lost) < kills:
            run = folder / "run"
            status, took = runs.fly(run, rng.uniform(0.0, seconds))
            if status == -signal.SIGKILL:
                holder = _holder(run)
                assert not holder or damage(run) == []  # what a kill leaves is no damage
                lost.append(_chunks_lost(run, table))
                store = completed(run, campaign, CHUNK)
                assert_as_unbroken(run, whole)
                assert [note.facts["from"] for note in store.notes("lock-taken-over")] == holder
            else:
                assert status == 0
                seconds = took  # the machine has become faster: aim at what a run takes now
            shutil.rmtree(run)
            run.with_name("run.begun").unlink(missing_ok=True)
        return lost
    finally:
        runs.close()


def _holder(run):
    """Whose lock a resumed run takes over: the record of the killed process, where it was writing cases."""
    if not (run / "journal.jsonl").exists():
        return []
    if not (run / ".lock").exists():
        return []
    record = (run / ".lock").read_text()
    return [json.loads(record)] if record else []


def _chunks_lost(run, table):
    """How many chunks must be begun again; the rows that were kept are those of the unbroken run."""
    if not (run / "journal.jsonl").exists():
        return 0
    with assert_no_wrong_row(run, table).lock() as store:  # counts what workers had finished
        kept = {part.first for part in store.parts}
    return len(set(begun(run)) - kept)


@pytest.mark.parametrize("kills", [1, *(pytest.param(kills, marks=pytest.mark.slow) for kills in (6, 200))])
def test_a_killed_run_loses_a_chunk_per_worker_at_most_and_is_resumed_to_the_same_bytes(
    tmp_path, kills, record_property
):
    lost = check_kills(tmp_path, kills, seed=1)
    record_property("killed runs completed to the same bytes", len(lost))
    record_property("chunks lost", lost)
    assert max(lost) <= WORKERS
