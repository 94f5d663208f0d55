"""The same campaign by threads, processes, a Dask cluster and shards: the same bytes in every file of results."""

import gc
import shutil
import subprocess
import sys

import numpy as np
import pytest
from distributed import Client, LocalCluster
from trapped import ENVIRONMENT, campaign_folder, files_of, trapped

from mc_engine import load_campaign
from mc_engine.errors import CampaignError, EngineError, RunInterrupted, StoreError
from mc_engine.flight.chunks import Task
from mc_engine.runner import cluster_pool, runner
from mc_engine.runner.backends import Backend
from mc_engine.runner.shards import Shard
from mc_engine.runner.worker_process import WorkerSetup, run_in_worker
from mc_engine.store.verification import damage

CASES, CHUNK = 1500, 100


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    return trapped(tmp_path_factory.mktemp("stones"), CASES)


@pytest.fixture(scope="module")
def whole(campaign, tmp_path_factory):
    """The campaign flown by two threads."""
    return runner.run(campaign, tmp_path_factory.mktemp("whole") / "run", workers=2, chunk=CHUNK)


def test_processes_write_the_bytes_of_threads(campaign, whole, tmp_path, record_property):
    store = runner.run(campaign, tmp_path / "run", workers=2, chunk=CHUNK, backend="loky")
    assert files_of(store.path) == files_of(whole.path)
    record_property("files equal byte by byte", len(files_of(whole.path)))


def test_a_cluster_that_loses_a_worker_and_gains_one_writes_the_bytes_of_threads(
    campaign, whole, tmp_path, monkeypatch, record_property
):
    """Over TCP, with a worker killed after the first part and another one added after the third."""
    monkeypatch.setenv("STONES_SLEEP_S", "0.1")
    done_so_far = []
    with LocalCluster(n_workers=2, threads_per_worker=1, protocol="tcp", dashboard_address="127.0.0.1:0") as cluster:

        def disturb(done, total, failed):
            done_so_far.append(done)
            if len(done_so_far) == 2:
                next(iter(cluster.workers.values())).process.process._process.kill()
            if len(done_so_far) == 4:
                cluster.scale(3)

        backend = Backend("dask", cluster.scheduler_address)
        assert cluster.scheduler_address.startswith("tcp://")
        store = runner.run(campaign, tmp_path / "run", chunk=CHUNK, backend=backend, progress=disturb)
    assert len(done_so_far) > 4
    monkeypatch.delenv("STONES_SLEEP_S")
    assert files_of(store.path) == files_of(whole.path)
    record_property("files equal byte by byte", len(files_of(whole.path)))


def test_shards_in_any_order_some_killed_and_some_twice_merge_to_the_whole(campaign, whole, tmp_path, record_property):
    rng = np.random.default_rng(8)
    shards, folders = [Shard(number, 20) for number in range(1, 21)], []
    for shard in rng.permutation(np.array(shards, dtype=object)):
        folders.append(tmp_path / f"shard-{shard.number}")
        runner.run(campaign, folders[-1], workers=1, chunk=20, shard=shard)
    for folder in rng.choice(folders, 3, replace=False):
        lose_parts(folder)
        runner.resume(folder, workers=1)
    for number in (4, 17):
        folders.append(tmp_path / f"again-{number}")
        runner.run(campaign, folders[-1], workers=2, chunk=33, shard=Shard(number, 20))
    merged = runner.merge(tmp_path / "merged", [folders[i] for i in rng.permutation(len(folders))], chunk=CHUNK)
    assert files_of(merged.path) == files_of(whole.path)
    record_property("files equal byte by byte", len(files_of(whole.path)))
    assert damage(merged.path) == []


def lose_parts(folder):
    """Leave the shard as a kill after its second part leaves it."""
    journal = folder / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    second = [i for i, line in enumerate(lines) if b'"event":"part"' in line][1]
    journal.write_bytes(b"".join(lines[: second + 1]) + lines[second + 1][:20])


def test_missing_shards_are_named_with_the_commands_that_fly_them(campaign, tmp_path):
    for number in (1, 3):
        runner.run(campaign, tmp_path / f"{number}", workers=1, chunk=100, shard=Shard(number, 4))
    lose_parts(tmp_path / "3")
    with pytest.raises(StoreError) as caught:
        runner.merge(tmp_path / "merged", [tmp_path / "1", tmp_path / "3"])
    text = str(caught.value)
    assert "cases 375 to 749, 950 to 1499 are missing" in text
    assert f"`mc-engine resume {tmp_path / '3'}`" in text
    assert f"`mc-engine run {tmp_path / '1'} --cases 1500 --seed 1 --shard 2/4 --out DIR`" in text
    assert "--shard 4/4" in text
    assert "--shard 1/4" not in text
    assert not (tmp_path / "merged").exists()


def test_shards_that_differ_or_are_of_another_campaign_are_not_merged(campaign, tmp_path):
    for number in (1, 2):
        runner.run(campaign, tmp_path / f"{number}", shard=Shard(number, 2))
    (tmp_path / "other").mkdir()
    other = trapped(tmp_path / "other", CASES, {5: 3})
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TRAPS_OFF", "3")
        runner.run(other, tmp_path / "1b", shard=Shard(1, 2))
    with pytest.raises(StoreError, match="1b: is not of the campaign of"):
        runner.merge(tmp_path / "merged", [tmp_path / "1", tmp_path / "2", tmp_path / "1b"])
    shutil.copytree(tmp_path / "1", tmp_path / "1c")
    change_a_number(tmp_path / "1c")
    assert damage(tmp_path / "1c") == []
    with pytest.raises(StoreError, match="differ on case 7"):
        runner.merge(tmp_path / "merged", [tmp_path / "1", tmp_path / "2", tmp_path / "1c"])


def change_a_number(folder):
    """A part whose receipt holds, and in which case 7 has another metric."""
    from mc_engine.store import parts
    from mc_engine.store.opening import open_store

    store = open_store(folder)
    part = store.parts[0]
    table = parts.read_part(folder, part).to_pandas()
    table.loc[7, "end_height_m"] += 1e-9
    arrays = {name: table[name].to_numpy() for name in table}
    store.withdraw(part)
    store.append(part.first, part.rows, arrays)


def test_a_shard_is_no_run_to_extend_or_to_take_inputs_from(campaign, tmp_path):
    store = runner.run(load_campaign("minimal", cases=200), tmp_path / "shard", shard=Shard(2, 2))
    assert store.committed() == [(100, 200)]
    assert store.missing() == []
    assert store.histories().empty
    with pytest.raises(StoreError, match="is a shard; merge the shards"):
        runner.extend(store.path, 300)
    text = '[campaign]\nmodel = "campaigns.deorbit"\ndesign = "mc"\nseed = 1\n[inputs]\nfrom = "shard"\n'
    with pytest.raises((CampaignError, StoreError), match="is a shard"):
        load_campaign("chain", text=text, directory=tmp_path)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("fork",), '"fork" is not known; there are threading, loky, dask'),
        (("loky", "tcp://node:1"), 'a scheduler is for the backend "dask"'),
        (("threading", None, 3.0), "a thread cannot be limited in time or memory"),
        (("cuda", None, 3.0), "a card cannot be limited in time or memory"),
        (("dask", "tcp://node:1", None, 1000), "dask worker --memory-limit"),
        (
            ("dask", "localhost"),
            "--scheduler localhost: missing port number .*; write an address such as tcp://node1:8786",
        ),
        (("loky", None, "3"), "case_seconds: '3' is not allowed; it must be a finite number above 0"),
        (("loky", None, True), "case_seconds: True is not allowed; it must be a finite number above 0"),
        (("loky", None, 10**400), "0 is not allowed; it must be a finite number above 0"),
        (("loky", None, np.float32("inf")), "inf. is not allowed; it must be a finite number above 0"),
        (("loky", None, None, -512), "memory_mib: -512 is not allowed"),
        (("dask", None, None, None, float("nan")), "patience_s: nan is not allowed"),
        (("dask", 8786), "--scheduler 8786: .*; write an address such as tcp://node1:8786"),
        (("dask", "foo://node:1"), "unknown address scheme 'foo'"),
        (("dask", "tls://127.0.0.1:1"), "needs keys; name them in Dask's configuration, distributed.comm.tls"),
        (("dask", "no such:x"), "--scheduler no such:x: "),
        (("loky", None, None, None, 60.0), 'patience is for the backend "dask", whose workers come and go'),
    ],
)
def test_backends_that_cannot_be_are_told(arguments, words):
    with pytest.raises(EngineError, match=words):
        Backend(*arguments)


def test_a_grid_without_a_seed_can_be_resumed_and_replayed(tmp_path):
    folder = campaign_folder(tmp_path / "stones", 50)
    text = (folder / "campaign.toml").read_text().replace("seed = 1\n", "")
    store = runner.run(load_campaign("stones", text=text, directory=folder), tmp_path / "run")
    assert runner.replay(store.path, 7).equal


def test_a_script_whose_workers_would_run_it_again_is_told_where_its_run_belongs(tmp_path):
    (tmp_path / "script.py").write_text(
        'from mc_engine import load_campaign, run\nrun(load_campaign("minimal"), "run", backend="dask", workers=1)\n'
    )
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True)
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert 'in a script, runs with Dask stand below `if __name__ == "__main__":`' in last
    assert last.endswith("`mc-engine resume run --backend dask` flies the rest")


def test_a_scheduler_that_is_not_there_leaves_a_run_that_can_be_resumed(campaign, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster_pool, "START_S", 0.5)
    with pytest.raises(RunInterrupted, match=r"there is no scheduler: .*`mc-engine resume .*--backend dask"):
        runner.run(campaign, tmp_path / "run", chunk=CHUNK, backend=Backend("dask", "tcp://127.0.0.1:1"))
    assert runner.resume(tmp_path / "run").status_counts() == {"ok": CASES}
    # a client left half begun may be closed in the thread of the next one, which then does not start
    assert {one.status for one in gc.get_objects() if type(one) is Client} <= {"closed"}


def test_a_worker_of_other_sources_is_refused(campaign, whole):
    """A machine with another engine would write other numbers: it says so, and writes none."""
    setup = WorkerSetup(str(whole.path), str(campaign.directory), CASES)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mc_engine.runner.manifest.sampling_digest", lambda: "another")
        with pytest.raises(StoreError, match="was flown by other sources"):
            run_in_worker(setup, Task(0, 10))
    assert run_in_worker(setup, Task(0, 10)).part.rows == 10
