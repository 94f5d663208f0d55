"""A disk that fails at the n-th open, write, sync or rename: an error that names the path, never a wrong table."""

import errno
from pathlib import Path

import pytest
from stones import assert_as_unbroken, assert_no_wrong_row, completed, results, stones
from watched_disk import BROKEN, FORBIDDEN, FULL, FailingCall, watched_disk

from mc_engine.errors import EngineError
from mc_engine.runner import runner

CASES, CHUNK = 200, 20


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Campaign, bytes and table of the unbroken run of ten parts."""
    folder = tmp_path_factory.mktemp("stones")
    campaign = stones(folder / "campaign", CASES)
    store = runner.run(campaign, folder / "whole", workers=2, chunk=CHUNK)
    return campaign, results(store.path), store.cases()


def check_one_failure(folder, flown, kind, n, number, lasting=False):
    """One run whose n-th operation of a kind fails; whether the run had so many."""
    campaign, whole, table = flown
    run, message = folder / f"{kind}-{n}-{number}", ""
    with watched_disk(run, FailingCall(kind, n, number, lasting)) as disk:
        try:
            runner.run(campaign, run, workers=2, chunk=CHUNK)
        except EngineError as error:
            message = str(error)
    if disk.failed and message:
        assert str(run) in message, message
        assert any(_file(path) in message for path in disk.failed), message
    assert message or not disk.failed or _may_be_passed_over(kind, disk.failed[0]), f"{kind} {n}: no error"
    if (run / "journal.jsonl").exists():
        assert_no_wrong_row(run, table)
    completed(run, campaign, CHUNK)
    assert_as_unbroken(run, whole)
    return bool(disk.failed)


def _file(path):
    """The name of the file that a temporary one was to become."""
    name = path.name
    return (
        name[1:].split(".parquet")[0]
        if name.startswith((".part", ".nominal"))
        else name.removesuffix(".tmp").lstrip(".")
    )


def _may_be_passed_over(kind, path):
    """The lock's record is for messages, the receipt of a part saves it from a kill; neither is missed."""
    return path.name == ".receipt.tmp" or (path.name == ".lock" and kind in ("write", "sync"))


def check_failures(folder, flown, kind, number, begin, step):
    """Every step-th operation of a kind, until there are no more; how many runs failed."""
    n, runs = begin, 0
    while check_one_failure(folder, flown, kind, n, number):
        n, runs = n + step, runs + 1
    return runs


KINDS = ("open", "write", "sync", "rename")
NUMBERS = (FULL, BROKEN, FORBIDDEN)


@pytest.mark.parametrize("kind", KINDS)
def test_a_failing_call_costs_no_row_and_is_told_with_its_path(flown, tmp_path, kind, record_property):
    begin = KINDS.index(kind)
    number = NUMBERS[begin % 3]
    runs = check_failures(tmp_path, flown, kind, number, begin, step=17)
    record_property("runs that failed", runs)
    assert runs >= 1


@pytest.mark.slow
@pytest.mark.parametrize("number", NUMBERS, ids=errno.errorcode.get)
@pytest.mark.parametrize("kind", KINDS)
def test_whichever_call_fails_no_row_is_lost_and_the_path_is_told(flown, tmp_path, kind, number, record_property):
    runs = check_failures(tmp_path, flown, kind, number, begin=0, step=1)
    record_property("runs that failed", runs)
    print(f"{kind}, {errno.errorcode[number]}: {runs} runs failed, all named the path and were completed")
    assert runs > 10


@pytest.mark.parametrize("kind", ["write", "sync"])
def test_a_disk_that_stays_broken_keeps_what_was_committed(flown, tmp_path, kind):
    for n in (1, 6, 15, 26):
        assert check_one_failure(Path(tmp_path), flown, kind, n, FULL, lasting=True)
