"""Runs on object stores: an S3-speaking server on this machine, and fsspec's own store in memory."""

import hashlib
import logging
import shutil
import subprocess
import sys
import threading
import time
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest
from stones import stones
from typer.testing import CliRunner

from mc_engine.command_line.commands import app
from mc_engine.errors import StoreError, UsageError
from mc_engine.store.derived_files import derived_files
from mc_engine.store.object_store import Publisher, _Remote, fetch, publish
from mc_engine.store.opening import open_store
from mc_engine.store.verification import damage
from tests.mc_engine.store.small_run import ENVIRONMENT, block, created, filled

fsspec = pytest.importorskip("fsspec")


@pytest.fixture(scope="module")
def s3():
    """A bucket "runs" of a server that speaks S3; its address and keys stand in the environment, as for any other."""
    server_class = pytest.importorskip("moto.server").ThreadedMotoServer
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    server = server_class(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AWS_ENDPOINT_URL", f"http://{host}:{port}")
        patch.setenv("AWS_ACCESS_KEY_ID", "key")
        patch.setenv("AWS_SECRET_ACCESS_KEY", "secret")
        patch.setenv("AWS_DEFAULT_REGION", "us-east-1")
        fsspec.filesystem("s3").mkdir("runs")
        yield "s3://runs"
        fsspec.filesystem("s3").clear_instance_cache()
    server.stop()


@pytest.fixture
def memory():
    files = fsspec.filesystem("memory")
    files.store.clear()
    files.pseudo_dirs[:] = [""]
    return "memory://runs"


@pytest.fixture
def run(tmp_path):
    """A run of forty cases in four parts, with a report."""
    filled(created(tmp_path / "run"))
    derived_files(tmp_path / "run").write({"report.html": b"<p>forty cases</p>"})
    return tmp_path / "run"


def digests(folder):
    paths = [path for path in folder.rglob("*") if path.is_file() and path.suffix != ".lock" and path.name != ".lock"]
    return {path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def test_a_run_comes_back_from_s3_byte_by_byte(s3, run, tmp_path):
    sent = publish(run, f"{s3}/study/one").sent
    assert sent.index("journal.jsonl") > max(i for i, name in enumerate(sent) if name.startswith("cases/"))
    assert sent[-2:] == ("report.html", "derived.jsonl")
    back = fetch(f"{s3}/study/one", tmp_path / "back")
    assert digests(back) == digests(run)
    assert damage(back) == []


def test_a_run_comes_back_from_a_web_server_and_one_that_does_not_answer_is_told(run, tmp_path):
    pytest.importorskip("aiohttp")
    handler = partial(SimpleHTTPRequestHandler, directory=tmp_path)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        url = f"http://127.0.0.1:{server.server_port}/run"
        threading.Thread(target=server.serve_forever, daemon=True).start()
        assert digests(fetch(url, tmp_path / "back")) == digests(run)
        with pytest.raises(UsageError, match="nothing: holds no run"):
            fetch(f"{url}/nothing", tmp_path / "none")
        server.shutdown()
    with pytest.raises(StoreError, match="Cannot connect") as told:
        fetch(url, tmp_path / "none")
    assert not isinstance(told.value, UsageError)


def test_a_run_that_flies_keeps_its_copy_on_s3_and_a_report_on_it_is_written_there(s3, tmp_path):
    stones(tmp_path, 60)
    answer = run_verb("run", tmp_path / "campaign.toml", "--out", tmp_path / "run", "--publish", f"{s3}/flown")
    assert "published" in answer
    assert open_store(f"{s3}/flown").cases().equals(open_store(tmp_path / "run").cases())
    fsspec.filesystem("s3").rm(f"{s3}/flown/report.html")
    answer = run_verb("report", f"{s3}/flown", "--format", "html")
    assert answer.splitlines()[0] == f"{s3}/flown/report.html"
    assert fsspec.filesystem("s3").cat_file(f"{s3}/flown/report.html").startswith(b"<!doctype html>")
    run_verb("extend", tmp_path / "run", "--cases", 80, "--publish", f"{s3}/flown", "--no-report")
    assert len(open_store(f"{s3}/flown").cases()) == 80


def test_a_copy_that_cannot_be_kept_is_refused_before_a_case_flies(memory, run, tmp_path):
    stones(tmp_path, 60)
    publish(run, memory)
    answer = CliRunner().invoke(
        app, ["run", f"{tmp_path}/campaign.toml", "--out", f"{tmp_path}/new", "--publish", memory]
    )
    assert (answer.exit_code, answer.output) == (2, f"{memory}: holds another run; choose another place\n")
    assert not (tmp_path / "new").exists()
    flown = tmp_path / "flown"
    run_verb("run", tmp_path / "campaign.toml", "--out", flown, "--publish", f"{memory}/flown", "--no-report")
    earlier = shutil.copytree(flown, tmp_path / "earlier")
    run_verb("extend", flown, "--cases", 80, "--publish", f"{memory}/flown", "--no-report")
    before = digests(earlier)
    for words in (["resume", f"{earlier}"], ["extend", f"{earlier}", "--cases", "90"]):
        answer = CliRunner().invoke(app, [*words, "--publish", f"{memory}/flown"])
        assert (answer.exit_code, answer.output) == (
            2,
            f"{memory}/flown: holds a later state of this run; fetch that one\n",
        )
        assert digests(earlier) == before


def run_verb(*words):
    answer = CliRunner().invoke(app, [str(word) for word in words])
    assert answer.exit_code == 0, answer.output
    return answer.output


def test_what_is_committed_is_sent_while_the_run_flies_and_when_it_breaks_off(memory, tmp_path):
    store, seen = created(tmp_path / "run"), []

    def fly():
        for first in range(0, 30, 10):
            store.append(first, 10, block(first, 10))
            begin = time.monotonic()
            while first < 20 and first not in seen and time.monotonic() < begin + 20.0:
                seen.extend([first] if copied(memory) == first + 10 else [])
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), Publisher(store.path, memory, every_s=0.01):
        fly()
    assert seen == [0, 10]
    assert copied(memory) == 30


def copied(url):
    """How many cases the copy at `url` has; none before its journal is there."""
    try:
        return len(open_store(url).cases())
    except StoreError:
        return 0


def test_the_copy_of_a_reader_that_is_killed_is_removed_by_the_next_reader(run, tmp_path):
    publish(run, url := f"file://{tmp_path}/there")
    (copies := tmp_path / "temporary").mkdir()
    code = f"from mc_engine import open_store\nopen_store({url!r})\nprint('read', flush=True)\ninput()"

    def reader():
        command, pipe = [sys.executable, "-c", code], subprocess.PIPE
        begun = subprocess.Popen(command, stdin=pipe, stdout=pipe, env={**ENVIRONMENT, "TMPDIR": str(copies)})
        assert begun.stdout.readline() == b"read\n"
        return begun

    killed, reading = reader(), reader()
    killed.kill()
    killed.communicate()
    assert len(list(copies.iterdir())) == 2
    reader().communicate(b"\n")
    assert len(list(copies.rglob("journal.jsonl"))) == len(list(copies.iterdir())) == 1  # of the one that still reads
    reading.communicate(b"\n")
    assert not list(copies.iterdir())


def test_a_bucket_that_is_not_there_is_a_sentence_and_damage(s3, run):
    answer = CliRunner().invoke(app, ["publish", str(run), "s3://no-such-bucket/x"])
    assert answer.exit_code == 5
    assert answer.output.startswith("s3://no-such-bucket/x: ")
    assert answer.output.count("\n") == 1


def test_an_upload_that_breaks_off_anywhere_is_completed_and_never_loads_wrong(memory, run, tmp_path, monkeypatch):
    whole = digests(run)
    whole_parts = sum(name not in ("journal.jsonl", "report.html", "derived.jsonl") for name in whole) - 1
    write = _Remote.write
    for stop in range(len(whole)):
        url = f"{memory}/{stop}"
        written = []

        def breaks_off(remote, name, content, written=written, stop=stop):
            if len(written) == stop:
                remote._files.pipe_file(f"{remote._root}/{name}", content[: len(content) // 2])
                raise ConnectionError("the line is cut")
            written.append(name)
            write(remote, name, content)

        monkeypatch.setattr(_Remote, "write", breaks_off)
        with pytest.raises(StoreError, match="the line is cut"):
            publish(run, url)
        monkeypatch.setattr(_Remote, "write", write)
        if len(written) > whole_parts:
            ids = open_store(url).cases()["case_id"].tolist()
            assert ids == list(range(40 if "journal.jsonl" in written else len(ids)))
        else:
            with pytest.raises(StoreError, match="holds no run"):
                fetch(url, tmp_path / "none")
        assert len(publish(run, url).sent) == len(whole) - stop
        assert digests(fetch(url, tmp_path / f"back-{stop}")) == whole


def test_another_run_or_other_files_or_a_later_state_are_not_overwritten(memory, run, tmp_path):
    before = tmp_path / "before"
    shutil.copytree(run, before)
    open_store(run).note("finished")
    publish(run, memory)
    with pytest.raises(StoreError, match="later state"):
        publish(before, memory)
    filled(created(tmp_path / "other"))
    with pytest.raises(StoreError, match="holds another run"):
        publish(tmp_path / "other", memory)
    fsspec.filesystem("memory").pipe_file("elsewhere/thesis.txt", b"x")
    with pytest.raises(StoreError, match=r"holds thesis\.txt and no run"):
        publish(run, "memory://elsewhere")


def test_a_run_is_not_copied_into_itself(run):
    before = digests(run)
    for send in (publish, Publisher):  # the latter before the flight
        with pytest.raises(UsageError, match=f"copy: lies in {run} itself"):
            send(run, f"file://{run}/copy")
    assert digests(run) == before


@pytest.mark.parametrize("lost", [False, True], ids=["damaged", "lost"])
@pytest.mark.parametrize("inside", ["", "sensitivity/"])
def test_damage_is_neither_sent_nor_fetched_and_the_message_says_what_to_do(memory, run, tmp_path, lost, inside):
    filled(created(run / "sensitivity"))
    publish(run, memory)
    files = fsspec.filesystem("memory")
    part = inside + open_store(run).parts[1].file
    content = bytearray(files.cat_file(f"runs/{part}"))
    content[100] ^= 1
    if lost:
        files.rm_file(f"runs/{part}")
        (run / part).rename(tmp_path / "part")
    else:
        files.pipe_file(f"runs/{part}", bytes(content))
        (run / part).rename(tmp_path / "part")
        (run / part).write_bytes(bytes(content))
    with pytest.raises(StoreError, match=f"^{memory}/{part}: .*; `mc-engine publish RUN {memory}` sends it again"):
        fetch(memory, tmp_path / "back")
    with pytest.raises(StoreError, match=f"^{run}/{part}: .*; `mc-engine verify {run}` names all damage$"):
        publish(run, "memory://fresh")
    (tmp_path / "part").replace(run / part)
    assert publish(run, memory).sent == (part,)
    assert damage(fetch(memory, tmp_path / "back")) == []


def test_a_damaged_journal_at_a_url_is_sent_again_if_its_first_line_says_whose_it_is(memory, run, tmp_path):
    publish(run, memory)
    files = fsspec.filesystem("memory")
    lines = files.cat_file("runs/journal.jsonl").splitlines(keepends=True)
    files.pipe_file("runs/journal.jsonl", b"".join([*lines[:2], b"x" + lines[2][1:], *lines[3:]]))
    with pytest.raises(StoreError, match=f"line 3: damaged; `mc-engine publish RUN {memory}` sends it again"):
        open_store(memory)
    assert publish(run, memory).sent == ("journal.jsonl",)
    assert len(open_store(memory).cases()) == 40
    files.pipe_file("runs/journal.jsonl", b"".join([b"x" + lines[0][1:], *lines[1:]]))
    with pytest.raises(StoreError, match=r"line 1: damaged, .*remove that file and publish again"):
        publish(run, memory)


def test_no_command_that_is_printed_for_a_url_is_one_that_refuses_urls(memory, tmp_path):
    store = created(tmp_path / "begun")
    store.append(0, 10, block(0, 10))
    publish(tmp_path / "begun", memory)
    assert f"10 to 39; `mc-engine resume RUN --publish {memory}` flies them" in run_verb("status", memory)
    filled(created(tmp_path / "whole")).note("started")  # and no line "finished"
    publish(tmp_path / "whole", "memory://whole")
    answer = CliRunner().invoke(app, ["verify", "memory://whole"])
    assert answer.exit_code == 5
    assert "in RUN, the run's own directory: `mc-engine resume RUN --repair` flies" in answer.stderr
    assert answer.stderr.endswith("; then `mc-engine publish RUN memory://whole`\n")


def test_names_from_a_store_stay_inside_the_folder(memory, run, tmp_path):
    publish(run, memory)
    files = fsspec.filesystem("memory")
    files.store["/runs/../../evil.txt"] = files.store["/runs/report.html"]
    with pytest.raises(StoreError, match="lies outside the run"):
        fetch(memory, tmp_path / "back")
    assert not list(tmp_path.rglob("evil.txt"))


def test_verbs_that_read_take_a_url_as_they_take_a_folder(memory, run, tmp_path):
    publish(run, memory)
    for verb in (["status"], ["summary"], ["verify"], ["compare", run]):
        there, here = run_verb(*verb, memory), run_verb(*verb, run)
        assert there.replace(memory, str(run)) == here
    run_verb("export", memory, "--out", tmp_path / "end_states.csv")
    run_verb("export", run)
    assert (tmp_path / "end_states.csv").read_bytes() == (run / "end_states.csv").read_bytes()


@pytest.mark.parametrize(
    ("words", "instead"),
    [
        (["resume", "URL"], "`mc-engine fetch URL DIR`"),
        (["extend", "URL", "--cases", "50"], "`mc-engine fetch URL DIR`"),
        (["rerun", "--failed", "URL"], "`mc-engine fetch URL DIR`"),
        (["replay", "URL", "3"], "`mc-engine fetch URL DIR`"),
        (["publish", "URL", "URL"], "`mc-engine fetch URL DIR`"),
        (["merge", "out", "URL"], "`mc-engine fetch URL DIR`"),
        (["run", "minimal", "--from", "URL"], "`mc-engine fetch URL DIR`"),
        (["run", "minimal", "--out", "URL"], "--publish URL"),
        (["tune", "flexible_satellite/stage_1", "--out", "URL"], "--publish URL"),
        (["rare", "deorbit", "--out", "URL"], "--publish URL"),
        (["merge", "URL", "shard"], "--publish URL"),
        (["export", "URL"], "--out is missing"),
        (["export", "run", "--out", "URL"], "name a file here"),
        (["compare", "a", "b", "--report", "URL"], "name a file here"),
        (["sample", "minimal", "--out", "URL"], "name a file here"),
        (["fetch", "URL", "URL"], "name a file here"),
        (["init", "URL"], "name a file here"),
    ],
)
def test_a_url_where_something_is_written_is_refused_with_what_to_do_instead(tmp_path, monkeypatch, words, instead):
    monkeypatch.chdir(tmp_path)
    url = "s3://bucket/run.csv"
    answer = CliRunner().invoke(app, [word.replace("URL", url) for word in words])
    assert answer.exit_code == 2
    assert url in answer.output
    assert instead.replace("URL", url) in answer.output
    assert answer.output.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
