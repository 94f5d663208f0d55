"""What the pages say of a sample of a run that is too large to be held."""

import landing_run
import numpy as np
import pandas as pd
import pytest
from synthetic_run import COLUMNS, SyntheticRun, fly, kept, synthetic_run

from mc_engine.sampling.designs import unit_cube
from reports.contributors.designed_indices import designed_blocks
from reports.contributors.sensitivity import sensitivity_blocks
from reports.document.blocks import FigureBlock, Table
from reports.run import all_cases
from reports.run.flown import Flown
from reports.run.history_bands import fair_cases
from reports.sections.convergence import convergence_blocks
from reports.sections.corridors import corridor_blocks
from reports.sections.figure_blocks import distribution_blocks
from reports.sections.levels import level_blocks
from reports.sections.published import published_blocks
from reports.sections.single_cases import case_blocks
from reports.text.numbers import count

BLOCKS = 4000


def sample(folder, made, monkeypatch, cases):
    """The run on the disk with a sample of so many cases."""
    monkeypatch.setattr(all_cases, "MOST_CELLS", cases * len(COLUMNS))
    flown = Flown(kept(folder / "run", made.manifest, made.table), "run")
    assert flown.sampled
    return flown


@pytest.mark.parametrize(("design", "size"), [("saltelli", 4), ("morris", 3)])
def test_a_sample_of_a_design_in_blocks_has_whole_blocks(tmp_path, monkeypatch, design, size):
    """Of single cases hardly any block was whole: the report had no indices."""
    made = synthetic_run(n := size * BLOCKS, failed=0)
    ve, oe = (40.0 * (u - 0.5) for u in unit_cube(design, 1, ("ve_pct", "oe_pct"), np.arange(n), n))
    made.manifest["campaign"].update(design=design, cases=n)
    made = SyntheticRun(made.manifest, made.table.assign(ve_pct=ve, oe_pct=oe, **fly(ve, oe)), made.nominal_row)
    flown = sample(tmp_path, made, monkeypatch, 2000)
    blocks = list(designed_blocks(flown, flown.inputs))
    (table,) = [block for block in blocks if isinstance(block, Table)]
    whole = 2000 // size
    assert table.rows[0][0].small.startswith(f"{whole} / {whole} ")
    assert table.caption.endswith(f", from {count(size * whole)} of {count(n)} cases picked evenly")


@pytest.fixture
def made():
    """40 000 cases, with a limit on the fuel that none is beyond."""
    made = synthetic_run(40_000, failed=0)
    limit = {"name": "fuel", "metric": "propellant_kg", "at_most": 8.0, "at_least": None, "share": 0.99,
             "confidence": 0.9}  # fmt: skip
    figure = {"kind": "corridor", "title": "Corridor", "x": "ve_pct", "y": "oe_pct", "metrics": ["propellant_kg"]}
    made.manifest.update(requirements=[limit], figures=[figure])
    made.manifest["campaign"].update(design="mc", cases=40_000)
    return made


def test_few_failures_of_a_sample_are_not_those_of_all_cases(tmp_path, monkeypatch, made):
    """Fewer than five cases failed, it said, where eight did, and bars of 2 000 cases were called those of 40 000."""
    made.table.loc[np.arange(11, 40_000, 5003), "propellant_kg"] = 9.0
    flown = sample(tmp_path, made, monkeypatch, 2000)
    these = f"{count(2000)} cases picked evenly from {count(40_000)}"
    assert flown.n_tried - flown.every.inside_all == 8
    said = [block for block in sensitivity_blocks(flown) if isinstance(block, str)]
    assert any(f", of {these} fewer than 5 failed or fewer than 5 passed: fuel" in one for one in said)
    assert next(distribution_blocks(flown)).caption.endswith(f" Bars: {these}.")
    assert next(case_blocks(flown)).caption.endswith(f" Points: {these}.")


def test_cases_of_a_sample_that_are_all_inside_are_not_all_cases(tmp_path, monkeypatch, made):
    made.table.loc[12, "propellant_kg"] = 9.0
    flown = sample(tmp_path, made, monkeypatch, 2000)
    assert 12 not in flown.case_ids
    (said,) = corridor_blocks(flown)
    these = f"{count(2000)} cases picked evenly from {count(40_000)}"
    assert said == f"Corridor: not drawn; all {these} are inside all limits."


def test_a_sample_that_needs_fewer_cases_than_the_run_has_says_so(tmp_path, monkeypatch, made):
    """It needs about 660 cases, it said of a run of 40 000."""
    flown = sample(tmp_path, made, monkeypatch, 300)
    (table,) = [block for block in convergence_blocks(flown) if isinstance(block, Table)]
    assert table.rows[0][-1].small == f"needs about 660 cases; the run has {count(40_000)}"


def test_published_values_of_cases_outside_a_sample_are_not_denied(tmp_path, monkeypatch, made):
    """They were "not computed by the cases of this run"; case 12 of it has the number."""
    at = {"ve_pct": float(made.table["ve_pct"][12]), "oe_pct": float(made.table["oe_pct"][12])}
    made.manifest["published"] = [
        {"quantity": "fuel", "published": 2.0, "unit": "kg", "column": "propellant_kg", "at": at}
    ]
    flown = sample(tmp_path, made, monkeypatch, 2000)
    assert 12 not in flown.case_ids
    said = next(block for block in published_blocks(flown) if isinstance(block, str))
    these = f"the {count(2000)} cases picked evenly from {count(40_000)}, which alone were looked at"
    assert said == f"1 published value of the model is not computed by {these}, but by:"


def test_the_first_cases_of_a_large_run_are_fair_however_many_of_all_failed(tmp_path, monkeypatch, made):
    """The eleventh failed case without a history was taken for the end of the first cases: the envelope left out 28."""
    refused = np.arange(0, 60, 5)
    made.table.loc[refused, "status"] = "refused"
    flown = sample(tmp_path, made, monkeypatch, 2000)
    saved = [case for case in range(60) if case not in refused]
    monkeypatch.setattr(flown, "histories", pd.DataFrame({"case_id": saved}))
    assert fair_cases(flown) == saved
    assert flown.every.failed(3)["case_id"].tolist() == [0, 5, 10]


def test_levels_of_a_sample_were_not_flown_on_different_cases(tmp_path, monkeypatch):
    """Each set of cases that differ in the guidance law alone had lost some of its cases."""
    run = landing_run.landing_run(20_000, laws=("near", "far"))
    run.table = run.table.assign(case_id=np.arange(40_000))
    monkeypatch.setattr(all_cases, "MOST_CELLS", 100 * len(landing_run.COLUMNS))
    store = kept(
        tmp_path / "run", run.manifest, run.table[[one[0] for one in landing_run.COLUMNS]], columns=landing_run.COLUMNS
    )
    captions = [block.caption for block in level_blocks(Flown(store, "run")) if isinstance(block, FigureBlock)]
    assert len(captions) == 1
    assert "In the selected cases, its levels have different other inputs" in captions[0]
