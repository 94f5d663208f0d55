"""What `publish` says of a store that lies, loses or damages, and what a `fetch` that was killed leaves."""

import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from mc_engine.errors import StoreError
from mc_engine.store.object_store import AT_ONCE, Publisher, _Remote, fetch, publish
from mc_engine.store.opening import open_store
from tests.mc_engine.command_line.cart import call
from tests.mc_engine.store.small_run import ENVIRONMENT, created, filled

pytest.importorskip("fsspec")


@pytest.fixture
def run(tmp_path):
    return filled(created(tmp_path / "run")).path


@pytest.fixture
def away(tmp_path):
    return tmp_path / "away"


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*")
            if path.is_file() and path.name != ".lock"}  # fmt: skip


@pytest.mark.parametrize("lie", ["nothing is written", "what is read is not what is listed", "a file is lost"])
def test_success_is_said_only_of_what_is_listed_and_read_back(run, away, lie, monkeypatch):
    if lie == "a file is lost":  # after it was read back
        write = _Remote.write

        def written_and_lost(remote, name, content):
            write(remote, name, content)
            if name == "manifest.json":
                (away / name).unlink()

        monkeypatch.setattr(_Remote, "write", written_and_lost)
    else:  # a store that answers from its own memory of what it was sent
        sent = {}
        monkeypatch.setattr(_Remote, "write", lambda remote, name, content: sent.update({name: content}))
        monkeypatch.setattr(_Remote, "read", lambda remote, name: sent[name])
        if lie == "what is read is not what is listed":
            sizes = _Remote.listed
            monkeypatch.setattr(_Remote, "listed", lambda remote: dict.fromkeys(sent, 1) | sizes(remote))
    done = call("publish", run, f"file://{away}")
    assert done.exit_code == 5
    assert "is not there; publish again; the run is safe\n" in done.stderr
    assert "published" not in done.stdout


@pytest.mark.parametrize("count", [20, pytest.param(1000, marks=pytest.mark.slow)])
def test_what_was_damaged_up_there_is_sent_again_before_publish_says_it_is_there(run, away, count, record_property):
    publish(run, f"file://{away}")
    names, draw, missed = sorted(contents(away)), np.random.default_rng(5), []
    for number in range(count):
        name = names[draw.integers(len(names))]
        content = bytearray((away / name).read_bytes())
        if not content:
            continue
        content[draw.integers(len(content))] ^= 1 << draw.integers(8)
        (away / name).write_bytes(content)
        done = call("publish", run, f"file://{away}")
        whole = contents(away) == contents(run)
        if done.exit_code not in (0, 5) or (done.exit_code == 0) != whole or "Traceback" in done.output:
            missed.append((number, name, done.output))
        if done.exit_code:  # of its journal nobody can say whose it was: it has to be removed first
            shutil.rmtree(away)
            publish(run, f"file://{away}")
    record_property("flips", count)
    assert missed == []


def test_a_copy_that_is_kept_up_to_date_reads_back_what_it_sends_and_no_more(run, away, monkeypatch):
    url, read, seen = f"file://{away}", _Remote.read, []
    publish(run, url)
    open_store(run).note("finished")
    monkeypatch.setattr(_Remote, "read", lambda remote, name: seen.append(name) or read(remote, name))
    with Publisher(run, url, every_s=60.0):
        pass
    assert "journal.jsonl" in seen
    assert not [name for name in seen if name.startswith("cases/")]


def test_files_are_sent_several_at_a_time_and_the_journal_between_what_it_records_and_the_rest(run, away, monkeypatch):
    (run / "notes.txt").write_text("mine")
    write, at_once, most, order = _Remote.write, [], [], []

    def slow(remote, name, content):
        at_once.append(name)
        most.append(len(at_once))
        time.sleep(0.05)
        write(remote, name, content)
        at_once.remove(name)
        order.append(name)

    monkeypatch.setattr(_Remote, "write", slow)
    publication = publish(run, f"file://{away}")
    assert 2 < max(most) <= AT_ONCE
    place = order.index("journal.jsonl")
    assert sorted(order[place + 1 :]) == ["notes.txt"]
    assert {"campaign.toml", "manifest.json"} < {*order[:place]}
    assert sorted(publication.sent) == sorted(order)
    assert publication.sent_bytes == sum(map(len, contents(away).values()))


KILLED = """
import sys, time
from mc_engine.store import object_store
object_store._write_fetched = lambda *_: (sys.stdout.write("copying\\n"), sys.stdout.flush(), time.sleep(60))
object_store.fetch(sys.argv[1], object_store.Path(sys.argv[2]))
"""


@pytest.fixture
def killed(run, away, tmp_path):
    """A fetch that was killed in the middle; its folder is left behind."""
    publish(run, f"file://{away}")
    process = fetching(away, tmp_path / "back")
    ended_by(process, signal.SIGKILL)
    assert [path.name for path in left_in(tmp_path)] != []
    return tmp_path / "back"


def fetching(away, back):
    command = [sys.executable, "-c", KILLED, f"file://{away}", str(back)]
    return begun(command)


def begun(command):
    """The process of a script that says that it is copying, and then hangs."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=ENVIRONMENT)
    with process.stdout:
        assert process.stdout.readline() == "copying\n"
    return process


def ended_by(process, number):
    process.send_signal(number)
    process.wait(10.0)


def left_in(folder):
    return [path for path in folder.iterdir() if path.name.startswith(".")]


@pytest.mark.skipif(os.name == "nt", reason="there are no such signals")
def test_the_next_fetch_clears_away_what_a_killed_one_left_and_nothing_else(killed, away, run, tmp_path):
    (tmp_path / ".back.of.mine").mkdir()
    (tmp_path / ".other.x.tmp").mkdir()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("mine")
    (tmp_path / ".back.link.tmp").symlink_to(tmp_path / "mine")
    fetch(f"file://{away}", killed)
    assert contents(killed) == contents(run)
    assert sorted(path.name for path in left_in(tmp_path)) == [".back.link.tmp", ".back.of.mine", ".other.x.tmp"]
    assert (tmp_path / "mine" / "thesis.txt").read_text() == "mine"


@pytest.mark.skipif(os.name == "nt", reason="there are no such signals")
def test_a_fetch_leaves_another_that_is_at_work_alone(run, away, tmp_path):
    publish(run, f"file://{away}")
    process = fetching(away, tmp_path / "back")
    (at_work,) = left_in(tmp_path)
    fetch(f"file://{away}", tmp_path / "back")
    assert left_in(tmp_path) == [at_work]
    ended_by(process, signal.SIGKILL)


@pytest.mark.skipif(os.name == "nt", reason="there are no such signals")
def test_a_fetch_that_is_stopped_leaves_nothing_behind(run, away, tmp_path):
    publish(run, f"file://{away}")
    handled = "from mc_engine.interruption import install_handlers, under_way\ninstall_handlers()\n"
    script = KILLED.replace("object_store.fetch(", f"{handled}with under_way(): object_store.fetch(")
    command = [sys.executable, "-c", script, f"file://{away}", str(tmp_path / "back")]
    process = begun(command)
    time.sleep(0.1)
    ended_by(process, signal.SIGTERM)
    assert left_in(tmp_path) == []


def test_a_copy_that_fails_leaves_nothing_behind(run, away, tmp_path):
    publish(run, f"file://{away}")
    next(away.glob("cases/*")).unlink()
    with pytest.raises(StoreError):
        fetch(f"file://{away}", tmp_path / "back")
    assert left_in(tmp_path) == []
