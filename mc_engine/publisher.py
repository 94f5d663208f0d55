"""A run's copy on an object store, kept up to date while the run flies."""

import sys
import threading
import time
from pathlib import Path
from typing import Self

from mc_engine.errors import EngineError
from mc_engine.object_store import publish
from mc_engine.store import is_run_directory
from mc_engine.urls import store_url

PATIENCE = 10.0  # waits so many times as long as the last copy took, so that copying takes at most a tenth of the time


class Publisher:
    """Within `with`, copies what the run in `run` has committed to `url`, every `every_s` seconds and at the end.

    A machine that is lost takes at most what was committed since with it.  A copy that fails is tried again; what the
    last one failed of is told on standard error, and the flight goes on.
    """

    def __init__(self, run: Path, url: str, every_s: float = 30.0):
        self._run, self._url, self._every_s = run, store_url(url), every_s
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._keep_up, name="publisher", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._done.set()
        self._thread.join()
        if trouble := self._copy():
            print(f"not published: {trouble}", file=sys.stderr)

    def _keep_up(self) -> None:
        wait_s = self._every_s
        while not self._done.wait(wait_s):
            begin = time.monotonic()
            self._copy()
            wait_s = max(self._every_s, PATIENCE * (time.monotonic() - begin))

    def _copy(self) -> EngineError | None:
        if is_run_directory(self._run):
            try:
                publish(self._run, self._url, trusting=True)
            except EngineError as error:
                return error
        return None
