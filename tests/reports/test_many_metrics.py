"""What a figure or a table leaves out of many key metrics is said beside it."""

import numpy as np
from synthetic_run import synthetic_run

from reports.contents import build
from reports.document.blocks import FigureBlock, Table, blocks_of

MANY = 15


def test_figures_and_tables_of_some_of_many_key_metrics_say_so():
    run = synthetic_run(300, failed=0)
    draws = np.random.Generator(np.random.Philox(key=3)).normal(size=(MANY, 300))
    names = [f"index_{k:02d}_m" for k in range(MANY)]
    for name, draw in zip(names, draws, strict=True):
        run.table[name] = draw + run.table["ve_pct"]
        run.manifest["columns"].append({"name": name, "unit": "m", "role": "metric", "description": "index"})
    common = {"at_most": 1.0, "at_least": None, "share": 0.5, "confidence": 0.9}
    run.manifest["requirements"] = [{"name": name, "metric": name, **common} for name in names]
    run.manifest["figures"] = []
    document = build(run, "run")
    captions = " ".join(block.caption for block in blocks_of(document, FigureBlock))
    assert "contributors to the first 6 of 8 metrics" in captions
    assert f"probability plots of the first 12 of {MANY} key metrics." in captions
    assert f"correlations of the first 8 of {MANY} key metrics and" in captions
    tables = [table.caption for table in blocks_of(document, Table)]
    assert f"Convergence of the estimates, first 8 of {MANY} key metrics" in tables
    (section,) = [one for one in document.sections if one.title == "Contributors"]
    said = " ".join(text for one in section.blocks for text in getattr(one, "paragraphs", ()))
    assert "The effects on 7 other key metrics are not estimated." in said


def test_a_metric_of_a_failed_requirement_is_a_key_result_wherever_it_stands():
    """The first four metrics were the key results; the fifth, whose requirement failed, was not among them."""
    run = synthetic_run(300, failed=0)
    names = [column["name"] for column in run.manifest["columns"] if column["role"] == "metric"][:6]
    common = {"at_least": None, "share": 0.5, "confidence": 0.9}
    run.manifest["requirements"] = [{"name": name, "metric": name, "at_most": 1e9, **common} for name in names]
    run.manifest["requirements"][4]["at_most"] = -1e9
    run.manifest["figures"] = []
    labels = [card.label for card in build(run, "run").costs]
    assert labels == ["max position error", "correction impulse", "propellant", "peak force"]
