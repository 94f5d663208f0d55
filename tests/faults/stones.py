"""A run of stones that takes a tenth of a second, and what must be said of it after any fault."""

import shutil

import numpy as np
from typer.testing import CliRunner

from mc_engine import load_campaign, open_store
from mc_engine.command_line.commands import app
from mc_engine.durable_file import is_temporary
from mc_engine.runner import runner
from mc_engine.store.verification import damage

TEXT = """[campaign]
model = "tests.faults.traps.model"
design = "mc"
seed = 5
cases = {cases}

[dispersion.height_m]
dist = "normal"
sigma = 10.0

[dispersion.speed_m_s]
dist = "uniform"
lower = -5.0
upper = 5.0

[retention]
histories = {{ nominal = true, first = 2 }}
"""


def stones(folder, cases):
    """The campaign; its file stands in `folder`."""
    folder.mkdir(exist_ok=True)
    (folder / "campaign.toml").write_text(TEXT.format(cases=cases))
    return load_campaign(folder / "campaign.toml")


def flown_stones(folder, cases, chunk):
    """The unbroken run in `folder`, in parts of so many cases."""
    return runner.run(stones(folder / "campaign", cases), folder / "whole", workers=2, chunk=chunk)


def copy_of(store, folder):
    """A copy of a run, to be broken."""
    return shutil.copytree(store.path, folder / "run")


def call(verb, run, *options):
    """What the command line makes of a run."""
    return CliRunner().invoke(app, [verb, str(run), *options])


def results(run):
    """The bytes of every file that holds the results of a complete run, by its role."""
    store = open_store(run)
    files = [part.file for part in store.parts]
    found = {file: (run / file).read_bytes() for file in [*files, "nominal.parquet"]}
    return {**found, "histories": (run / store.history_part.file).read_bytes()}


def completed(run, campaign, chunk):
    """The run after a fault, resumed, or begun anew in the same folder where there was no case yet."""
    if (run / "journal.jsonl").exists():
        return runner.resume(run, workers=2, chunk=chunk)
    return runner.run(campaign, run, workers=2, chunk=chunk)


def assert_as_unbroken(run, whole):
    """The run has the bytes of the unbroken one, no damage, and nothing is left lying about.

    whole : what `results` says of the unbroken run.
    """
    assert damage(run) == []
    assert results(run) == whole
    expected = {file for file in whole if file.startswith("cases/")}
    assert {path.relative_to(run).as_posix() for path in (run / "cases").iterdir()} == expected
    assert not [path for path in run.rglob("*") if is_temporary(path.name)]


def assert_no_wrong_row(run, table):
    """What the run counts can be read, and every row is that of the unbroken run.  table : all cases of that one."""
    store = open_store(run)
    counted = store.cases()
    ids = counted["case_id"].to_numpy()
    assert np.array_equal(ids, np.unique(ids))
    assert counted.equals(table.iloc[ids].reset_index(drop=True))
    return store
