"""Runs in processes of their own that are killed at any instant, and what each had begun and kept by then."""

import json
import os
import signal
import subprocess
import sys
import time

from trapped import ENVIRONMENT, ROOT

# For processes that find the engine and the modules beside this one.
FORKING = {**ENVIRONMENT, "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests" / "faults")])}

# Imports and compiles once; each run is a process that it forks, so that a kill hits the run and not the imports.
SERVER = """
import json, os, sys, time
from pathlib import Path
import numpy as np
import broken_builds
from mc_engine import load_campaign
from mc_engine.runner import pools
from mc_engine.runner import runner
from mc_engine.flight.chunks import NOMINAL_NOISE, fly_cases
from mc_engine.flight.flight import fly_history

folder, chunk, workers = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
if len(sys.argv) > 4:
    broken_builds.BREAKS[sys.argv[4]](setattr)
campaign = load_campaign(folder / "campaign.toml")
fly_cases(campaign, np.array([-1]))
fly_history(campaign.model, campaign.nominal, NOMINAL_NOISE, campaign.seed, folder=campaign.directory)
run_task = pools.run_task

def noted(campaign, columns, run, task, **named):
    if task.first >= 0:  # the nominal is no chunk
        os.write(log, b"%d\\n" % task.first)
    return run_task(campaign, columns, run, task, **named)

pools.run_task = noted
print(json.dumps("ready"), flush=True)
for line in sys.stdin:
    run = Path(json.loads(line))
    child = os.fork()
    if child == 0:
        log = os.open(str(run) + ".begun", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        runner.run(campaign, run, workers=workers, chunk=chunk)
        os._exit(0)
    print(json.dumps(child), flush=True)
    begin = time.monotonic()
    status = os.waitpid(child, 0)[1]
    print(json.dumps([os.waitstatus_to_exitcode(status), time.monotonic() - begin]), flush=True)
"""


class KilledRuns:
    """Flies the campaign in `folder` again and again, each time in a new process."""

    def __init__(self, folder, chunk, workers, broken=()):
        command = [sys.executable, "-c", SERVER, str(folder), str(chunk), str(workers), *broken]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self._server = subprocess.Popen(command, env=FORKING, **pipes)
        assert self._answer() == "ready"

    def _answer(self):
        return json.loads(self._server.stdout.readline())

    def fly(self, run, kill_after_s=None):
        """A run in the folder `run`; its exit status, negative where a signal ended it, and how long it took [s]."""
        self._server.stdin.write(json.dumps(str(run)) + "\n")
        self._server.stdin.flush()
        process = self._answer()
        if kill_after_s is not None:
            time.sleep(kill_after_s)
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                pass  # it was done
        return self._answer()

    def close(self):
        self._server.stdin.close()
        self._server.stdout.close()
        self._server.wait(timeout=30.0)


def begun(run):
    """The first cases of all chunks that a worker of the run in `run` began."""
    path = run.with_name(f"{run.name}.begun")
    return [int(line) for line in path.read_text().split()] if path.exists() else []
