"""URLs of object stores: what is incomplete is refused before anything is flown, and nothing secret is said."""

import sys

import pytest
from small_run import created, filled

from mc_engine import load_campaign
from mc_engine.errors import CampaignError, EngineError
from mc_engine.store.object_store import Publisher, fetch, publish
from mc_engine.store.urls import is_url, store_url
from tests.mc_engine.command_line.cart import call

pytest.importorskip("fsspec")

INCOMPLETE = {
    "s3://": "names no bucket",
    "S3://": "names no bucket",
    "gs://": "names no bucket",
    "s3:///x": "names no bucket",
    "s3:/x": "is no URL",
    "://x": "is no URL",
    "memory://": "names no bucket or path",
    "file://": "names no absolute path",
    "file:///": "names no absolute path",
    "file://relative/x": "names no absolute path",
    "nosuch://bucket/x": '"nosuch" is no object store',
    "simplecache::s3://bucket/x": "is no URL",
    " s3://bucket/x": "is no URL",
    "s3://bucket/a b": "has a space",
    "s3:// /x": "has a space",
    "s3://bucket/\u202ex": "that cannot be seen",
    "s3://bucket/\x1b[2J": "that cannot be seen",
    "s3://bucket/\nx": "that cannot be seen",
    "s3://bucket/../x": '".." in its path',
    "s3://..": '".." in its path',
    "file:///home/../x": '".." in its path',
    "s3://bucket//x": "an empty part",
}
SECRET = ("s3://key:hidden@bucket/x", "s3://key:hid/den@bucket/x", "s3://hidden@bucket/x", "ftp://me:hidden@host/x",
          "s3://bucket/x?token=hidden", "https://host/x#hidden", "s3:/key:hidden@bucket/x")  # fmt: skip


def test_a_complete_url_is_taken_as_it_is():
    for text, url in [
        ("s3://bucket", "s3://bucket"),
        ("S3://bucket/runs/x/", "s3://bucket/runs/x"),
        ("memory://runs", "memory://runs"),
        ("file:///runs/x", "file:///runs/x"),
        ("abfs://container@account/x", "abfs://container@account/x"),
        ("sftp://me@host:22/x", "sftp://me@host:22/x"),
    ]:
        assert (store_url(text), store_url(url), is_url(text)) == (url, url, True)


@pytest.mark.parametrize("path", ["runs/x", "./s3", "/tmp/x", "C:/runs", "C:\\runs", "a:b", ".", "x.toml"])
def test_a_path_is_no_url(path):
    assert not is_url(path)


def commands(text):
    """All that take a URL; of a text that is none, those for which it is no path either."""
    to_a_store = (["publish", "run", text], ["run", "cart", "--publish", text], ["resume", "run", "--publish", text],
                  ["extend", "run", "--cases", 50, "--publish", text], ["fetch", text, "back"])  # fmt: skip
    to_a_place = (["status", text], ["report", text], ["compare", "run", text], ["run", "cart", "--out", text])
    return (*to_a_store, *to_a_place) if is_url(text) else to_a_store


EVERYWHERE = ("s3://", "s3:/x", "://x", "s3://bucket/a b")  # the others by the first command and the last


@pytest.mark.parametrize("text", INCOMPLETE)
def test_an_incomplete_url_ends_with_2_before_anything_is_flown_or_written(here, text):
    filled(created(here / "run"))
    before = sorted(here.rglob("*"))
    first, *more, last = commands(text)
    for words in (first, *(more if text in EVERYWHERE else ()), last):
        done = call(*words)
        assert done.exit_code == 2, (words, done.output)
        assert INCOMPLETE[text] in done.stderr
        assert done.stderr.count("\n") == 1 + text.count("\n")
    assert sorted(here.rglob("*")) == before


@pytest.mark.parametrize("text", INCOMPLETE)
def test_the_engine_called_from_python_refuses_them_too(here, text):
    run = filled(created(here / "run")).path
    for use in (lambda: publish(run, text), lambda: fetch(text, here / "back"), lambda: Publisher(run, text)):
        with pytest.raises(EngineError):
            use()
    assert sorted(path.name for path in here.iterdir()) == ["cart", "run"]


@pytest.mark.parametrize("text", SECRET)
def test_credentials_in_a_url_are_refused_and_never_said(here, text):
    filled(created(here / "run"))
    commands = (["publish", "run", text], ["run", "cart", "--publish", text], ["fetch", text, "back"], ["status", text],
                ["report", text], ["run", "cart", "--out", text], ["replay", text, "3"], ["run", text], ["check", text],
                ["export", text])  # fmt: skip
    for words in commands:
        done = call(*words)
        assert done.exit_code == 2, (words, done.output)
        assert "hid" not in done.output
        assert "***" in done.output
    with pytest.raises(CampaignError) as caught:
        load_campaign(text)
    assert "hid" not in str(caught.value)


def test_the_package_that_a_store_needs_is_the_only_one_that_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "gcsfs", None)  # as where it is not installed
    with pytest.raises(EngineError, match=r"gs://bucket/x: needs a package: .*gcsfs") as refusal:
        fetch("gs://bucket/x", tmp_path / "run")
    assert "s3fs" not in str(refusal.value)
