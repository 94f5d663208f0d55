"""What the pages say of a sample of a run that is too large to be held."""

import numpy as np
import pytest
from synthetic_run import COLUMNS, SyntheticRun, fly, kept, synthetic_run

from mc_engine.sampling.designs import unit_cube
from reports.contributors.designed_indices import designed_blocks
from reports.document.blocks import Table
from reports.run import all_cases
from reports.run.flown import Flown
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
