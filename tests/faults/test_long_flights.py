"""Kernels that fly for minutes: a signal is heard while they do, and `check` does not wait for them."""

import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from trapped import ENVIRONMENT

from mc_engine.campaign.loading import load_campaign
from mc_engine.campaign.search import SHIPPED
from mc_engine.flight.chunks import fly_cases
from mc_engine.interruption import COMPLETING
from mc_engine.store.run_files import NOMINAL_CASE

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no signals from process to process")

# 1e9 steps, unless the error of the burn's direction is none: then a stop after a millisecond, or at once
EDITS = (
    ("FixedStep(step=10.0, until=10_000.0)", "FixedStep(step=1e-5, until=10_000.0)"),
    ("def climb(s)", "def climb(t, p)"),
    ("return s.x * s.vx + s.y * s.vy", "return where(p.pitch_error == 0.0, p.burn_dv - t / 1e-3, 1.0)"),
    ("import cos, physics, rsqrt, sin, sqrt", "import cos, physics, rsqrt, sin, sqrt, where"),
)
NEVER, SOON = 1e7, 1.0  # burns [m/s] whose nominal case flies for minutes, or for a millisecond


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """The smallest model, with flights that are long, compiled."""
    folder = tmp_path_factory.mktemp("long")
    text = (SHIPPED / "minimal" / "model.py").read_text()
    for old, new in EDITS:
        assert old in text
        text = text.replace(old, new)
    (folder / "model.py").write_text(text)
    fly_cases(load_campaign(with_burn(folder, SOON)), np.array([NOMINAL_CASE]))
    return folder


def with_burn(folder, burn):
    text = (SHIPPED / "minimal" / "campaign.toml").read_text()
    (folder / "campaign.toml").write_text(f"{text}\n[parameters]\nburn_dv_m_s = {burn}\n")
    return folder


def begin(folder, run, awaited):
    """A run on the command line that flies long from the moment on in which the file `awaited` of it is there."""
    command = [sys.executable, "-m", "mc_engine", "run", str(folder), "--out", str(run), "--cases", "400"]
    process = subprocess.Popen(command, env=ENVIRONMENT, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 120.0
    while not (run / awaited).exists():
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline
        time.sleep(0.1)
    time.sleep(2.0)
    return process


@pytest.mark.parametrize(
    ("burn", "awaited"),
    [pytest.param(NEVER, "journal.jsonl", id="nominal"), pytest.param(SOON, "nominal.parquet", id="threads")],
)
def test_a_first_signal_is_answered_while_a_kernel_flies_and_a_second_one_ends_it(model, tmp_path, burn, awaited):
    run = tmp_path / "run"
    process = begin(with_burn(model, burn), run, awaited)
    try:
        process.send_signal(signal.SIGINT)
        said = next(line for line in process.stderr if line.startswith("interrupted"))
        time.sleep(1.0)
        assert process.poll() is None
        process.send_signal(signal.SIGTERM)
        rest = process.communicate(timeout=15.0)[1]
    finally:
        process.kill()
    assert said == f"{COMPLETING}\n"
    assert process.returncode == 4
    assert rest.splitlines()[-1].endswith(f"`mc-engine resume {run}` flies the rest")


# A process that checks a campaign, and gives one case a tenth of the time.
HASTY = "import sys, mc_engine.flight.contract_flight as flight\nflight.LONGEST_S = {}\nflight.main()"


@pytest.mark.parametrize(("burn", "who"), [(NEVER, "the nominal case has"), (SOON, "the first 32 cases have")])
def test_check_answers_with_the_clock_where_a_case_takes_minutes(model, burn, who):
    command = [sys.executable, "-c", HASTY.format(0.5), str(with_burn(model, burn))]
    done = subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    (sentence,) = json.loads(done.stdout)
    assert sentence.startswith(f"{who} not completed after ")
    assert "its clock allows 1,000,000,000 steps of 1e-05 s; take longer steps" in sentence
