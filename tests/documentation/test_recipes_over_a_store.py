"""Recipes that fly pieces on many nodes over an object store: the commands of their files, against an S3 server."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml

pytest.importorskip("moto.server")
sys.path.append(str(Path(__file__).resolve().parents[1] / "faults"))
from test_examples import EXAMPLES, environment_in
from trapped import campaign_folder, files_of

from mc_engine import load_campaign
from mc_engine.runner import runner
from mc_engine.store.object_store import fetch
from mc_engine.store.verification import damage
from tests.benchmarks.scaling.storage import BUCKET, s3_server

FLY, MERGE = yaml.safe_load_all((EXAMPLES / "kubernetes_job.yml").read_text())
ARRAY = (EXAMPLES / "job_array.sh").read_text()
CASES, PIECES = 1200, 3  # of 400 cases, in parts of 64
LONGEST_S = 120.0


@pytest.fixture(scope="module")
def store():
    """An object store, whose address and keys are in the environment."""
    with s3_server():
        yield BUCKET


def container(job):
    (only,) = job["spec"]["template"]["spec"]["containers"]
    return only


def settings(job):
    """The environment that the manifest itself gives."""
    return {one["name"]: one.get("value") for one in container(job)["env"]}


def test_the_jobs_are_as_kubernetes_wants_them_and_have_as_many_pods_as_pieces():
    assert [(job["apiVersion"], job["kind"]) for job in (FLY, MERGE)] == [("batch/v1", "Job")] * 2
    spec = FLY["spec"]
    assert spec["completionMode"] == "Indexed"
    assert spec["completions"] == spec["parallelism"] == int(settings(FLY)["PIECES"]) == int(settings(MERGE)["PIECES"])
    assert settings(FLY)["STORE"] == settings(MERGE)["STORE"]
    assert spec["backoffLimitPerIndex"] > 0
    (codes,) = (rule["onExitCodes"] for rule in spec["podFailurePolicy"]["rules"] if "onExitCodes" in rule)
    assert codes == {"containerName": container(FLY)["name"], "operator": "In", "values": [2]}
    assert [job["metadata"]["labels"]["step"] for job in (FLY, MERGE)] == ["fly", "merge"]
    for job in (FLY, MERGE):
        pod, only = job["spec"]["template"]["spec"], container(job)
        assert pod["restartPolicy"] == "Never"  # podFailurePolicy takes nothing else
        assert set(only["resources"]["requests"]) == {"cpu", "memory"}
        assert {mount["name"] for mount in only["volumeMounts"]} == {volume["name"] for volume in pod["volumes"]}
        assert only["workingDir"] in [mount["mountPath"] for mount in only["volumeMounts"]]


def test_the_campaign_is_read_only_and_no_secret_is_in_the_file():
    volumes = {volume["name"]: volume for volume in FLY["spec"]["template"]["spec"]["volumes"]}
    (mount,) = (one for one in container(FLY)["volumeMounts"] if one["mountPath"] == settings(FLY)["CAMPAIGN"])
    assert mount["readOnly"]
    assert "configMap" in volumes[mount["name"]]
    for job in (FLY, MERGE):
        assert list(settings(job)) == [name for name in settings(job) if not re.search("KEY|SECRET|TOKEN|PASS", name)]
        assert container(job)["envFrom"] == [{"secretRef": {"name": "object-store"}}]


def config_map(source, folder):
    """The files of a campaign as Kubernetes mounts a ConfigMap: links to a folder that nobody may write to."""
    data = folder / "..data"
    data.mkdir(parents=True)
    for file in source.iterdir():
        (data / file.name).write_bytes(file.read_bytes())
        (folder / file.name).symlink_to(Path("..data") / file.name)
        (data / file.name).chmod(0o444)
    for path in (data, folder):
        path.chmod(0o555)
    return folder


class Pod:
    """A pod of a Job, begun in an empty working directory.  more : what Kubernetes sets, and this machine."""

    def __init__(self, job, work, **more):
        work.mkdir()
        only, self.work = container(job), work
        variables = {**environment_in(work), **settings(job), "HOME": os.environ["HOME"], "TMPDIR": str(work), **more}
        command = [*only["command"], *only["args"]]
        self.process = subprocess.Popen(command, cwd=work, env=variables, stderr=subprocess.PIPE, text=True)

    def ended(self):
        return ended(self.process)


def ended(process):
    """(exit status, what it said on stderr) of a process that ends by itself."""
    try:
        errors = process.communicate(timeout=LONGEST_S)[1]
    finally:
        process.kill()
    return process.returncode, errors


def terminated_midway(process, shard):
    """Send SIGTERM when the first part is committed; the run ends in good order."""
    deadline = time.monotonic() + LONGEST_S
    while not list((shard / "cases").glob("part-*")):
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline
        time.sleep(0.02)
    process.send_signal(signal.SIGTERM)
    status, errors = ended(process)
    assert status == 4, errors


def sessions(shard):
    """How often the run in a directory was begun or resumed."""
    return (shard / "journal.jsonl").read_text().count('"started"')


def check_merged(merged, campaign, folder):
    """The merged run has every byte of the results of one process."""
    whole = runner.run(load_campaign(campaign), folder / "whole")
    assert damage(merged) == []
    assert len(runner.open_store(merged).cases()) == CASES
    assert files_of(merged) == files_of(whole.path)


def test_the_pods_of_the_indexed_job_fly_their_pieces_and_the_second_job_merges_them(tmp_path, store):
    source = campaign_folder(tmp_path / "stones", CASES)
    url = f"{store}/kubernetes"
    told = {"STORE": url, "PIECES": str(PIECES), "CAMPAIGN": str(config_map(source, tmp_path / "campaign"))}

    def pod(index, name, **more):
        indexed = {"JOB_COMPLETION_INDEX": str(index), "WORKERS": "1"}
        return Pod(FLY, tmp_path / name, **told, **indexed, **more)

    lost = pod(1, "lost", STONES_SLEEP_S="1")
    terminated_midway(lost.process, lost.work / "shard")
    again = [pod(index, f"pod-{index}") for index in range(PIECES)]
    assert [one.ended()[0] for one in again] == [0] * PIECES
    assert [sessions(one.work / "shard") for one in again] == [1, 2, 1]  # the second piece was resumed
    merge = Pod(MERGE, tmp_path / "merge", STORE=url, PIECES=str(PIECES))
    status, errors = merge.ended()
    assert status == 0, errors
    check_merged(fetch(f"{url}/merged", tmp_path / "merged"), source, tmp_path)


def test_an_index_whose_piece_is_whole_changes_nothing_when_it_is_begun_again(tmp_path, store):
    source = campaign_folder(tmp_path / "stones", CASES)
    told = {"STORE": f"{store}/again", "PIECES": str(PIECES), "CAMPAIGN": str(source), "WORKERS": "1"}
    parts = []
    for name in ("first", "second"):
        pod = Pod(FLY, tmp_path / name, JOB_COMPLETION_INDEX="0", **told)
        status, errors = pod.ended()
        assert status == 0, errors
        parts.append({path.name: path.read_bytes() for path in (pod.work / "shard" / "cases").iterdir()})
    assert parts[0] == parts[1]


def test_a_pod_whose_campaign_is_wrong_ends_with_the_status_that_ends_its_index(tmp_path, store):
    told = {"STORE": f"{store}/wrong", "PIECES": "1", "CAMPAIGN": str(tmp_path / "none"), "WORKERS": "1"}
    assert Pod(FLY, tmp_path / "pod", JOB_COMPLETION_INDEX="0", **told).ended()[0] == 2


def test_a_pod_that_does_not_reach_the_store_flies_nothing(tmp_path, store):
    source = campaign_folder(tmp_path / "stones", CASES)
    told = {"STORE": f"{store}/away", "PIECES": "1", "CAMPAIGN": str(source), "WORKERS": "1"}
    pod = Pod(FLY, tmp_path / "pod", JOB_COMPLETION_INDEX="0", AWS_ENDPOINT_URL="http://127.0.0.1:9", **told)
    assert pod.ended()[0] == 5
    assert not (pod.work / "shard").exists()


@pytest.mark.slow  # the same array flies without a store in test_examples.py, and pods fly over one above
def test_the_slurm_array_keeps_its_pieces_on_the_store_from_which_they_are_merged(tmp_path, store):
    source = campaign_folder(tmp_path / "stones", CASES)
    url, text = f"{store}/slurm", ARRAY
    for before, ours in (
        ("CAMPAIGN=my_case", f"CAMPAIGN={source}"), ("PIECES=20", f"PIECES={PIECES}"), ("STORE= ", f"STORE={url} "),
        ("seq 20", f"seq {PIECES}"), ("s3://bucket/my_case", url),
    ):  # fmt: skip
        assert before in text
        text = text.replace(before, ours)
    script = tmp_path / "job_array.sh"
    script.write_text(text)

    def job(number, node, **more):
        """A job of the array on a node with a folder of its own."""
        (tmp_path / node).mkdir()
        told = {"SLURM_ARRAY_TASK_ID": str(number), "SLURM_ARRAY_TASK_COUNT": str(PIECES), "SLURM_CPUS_PER_TASK": "1"}
        variables = {**environment_in(tmp_path / node), **told, **more}
        return subprocess.Popen(["bash", script], cwd=tmp_path / node, env=variables, stderr=subprocess.PIPE, text=True)

    terminated_midway(job(2, "lost", STONES_SLEEP_S="1"), tmp_path / "lost" / "shards" / "shard-2")
    numbers = range(1, PIECES + 1)
    jobs = [job(number, f"node-{number}") for number in numbers]
    assert [ended(one)[0] for one in jobs] == [0] * PIECES
    assert [sessions(tmp_path / f"node-{n}" / "shards" / f"shard-{n}") for n in numbers] == [1, 2, 1]
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (fetching,) = re.findall(r"^#   (seq .*)$", text, re.MULTILINE)
    (merging,) = re.findall(r'--wrap "([^"]*)"$', text, re.MULTILINE)
    for command in (fetching, merging):
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", command], cwd=elsewhere, env=environment_in(elsewhere), check=False
        )
        assert done.returncode == 0
    check_merged(elsewhere / "runs" / "merged", source, tmp_path)
