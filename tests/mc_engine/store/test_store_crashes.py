import os

import pandas as pd
import pytest
from small_run import COLUMNS, MANIFEST, TEXT, block, filled

from mc_engine.errors import StoreError
from mc_engine.store.opening import open_store
from mc_engine.store.store import create_store
from mc_engine.store.verification import damage


def fail_at(monkeypatch, n, target):
    """Make the n-th call of os.<target> fail with a full disk; the list returned has an item once it did."""
    genuine = getattr(os, target)
    calls, failed = iter(range(10**6)), []

    def failing(*arguments, **options):
        if next(calls) == n:
            failed.append(n)
            raise OSError(28, "No space left on device")
        return genuine(*arguments, **options)

    monkeypatch.setattr(os, target, failing)
    return failed


@pytest.mark.parametrize("target", ["fsync", "replace", "write"])
def test_whichever_system_call_fails_the_error_names_a_path_and_the_run_can_go_on(tmp_path, monkeypatch, target):
    for n in range(100):
        run = create_store(tmp_path / f"run-{n}", MANIFEST, TEXT, COLUMNS).path
        with monkeypatch.context() as patch:
            failed = fail_at(patch, n, target)
            message = ""
            try:
                filled(open_store(run))
            except StoreError as error:
                message = str(error)
        assert bool(message) == bool(failed)
        assert not failed or (str(run) in message and "No space left" in message)
        store = open_store(run)
        for first, stop in store.missing():
            store.append(first, stop - first, block(first, stop - first))
        assert damage(store.path) == []
        assert store.cases()["ve_pct"].tolist() == block(0, 40)["ve_pct"].tolist()
        assert len(pd.read_parquet(run / "cases")) == 40
        if not failed:
            break
    assert not failed
    assert n >= 4  # at least once a part
