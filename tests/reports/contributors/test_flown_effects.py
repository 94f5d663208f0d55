"""The section and the data of a run that flew further cases for its contributors."""

import json
import shutil
from pathlib import Path

import mc_engine
from reports.contents import build
from reports.document.blocks import Table, blocks_of
from reports.formats.json_data import render_json
from reports.formats.markdown import render_markdown

MODEL = Path(__file__).parents[2] / "mc_engine" / "contributions" / "model.py"
HEAD = '[campaign]\nmodel = "model.py"\ncases = 60\ndesign = "mc"\nseed = 3\n[sensitivity]\ncases = 256\n'
INPUTS = "".join(
    f'[dispersion.{name}]\ndist = "uniform"\nlower = 0.0\nupper = 1.0\n' for name in ("x1", "x2", "x3", "x4")
)
LINE = '[requirement.line]\nmetric = "line"\nat_most = 9.0\nshare = 0.9\n'


def test_the_data_hold_the_effects_on_metrics_without_a_requirement_too(tmp_path):
    shutil.copy(MODEL, tmp_path)
    (tmp_path / "campaign.toml").write_text(HEAD + INPUTS + LINE)
    run = mc_engine.run(mc_engine.load_campaign(tmp_path / "campaign.toml"), tmp_path / "run", workers=1)
    document = build(run, "run")
    effects = {}
    for row in json.loads(render_json(document))["contributors"]:
        effects.setdefault(row["metric"], []).append((row["input"], row["total"]))
    assert [*effects] == ["line", "ishigami", "sobol_g", "noise", "scaled"]
    assert effects["noise"][0][0] == "random draws"
    assert {name for name, total in effects["sobol_g"] if total > 0.1} == {"x1", "x2"}
    (table,) = [one for one in blocks_of(document, Table) if one.caption.startswith("Contributors to each metric")]
    assert {row[0].text for row in table.rows} == {"line"}
    assert "The effects on 4 other metrics are in report.json." in render_markdown(document).decode()
