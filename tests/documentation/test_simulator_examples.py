"""The worked examples of simulators, flown as they stand on the page."""

import shutil
import subprocess

import numpy as np
import pytest
from handwritten_pages import blocks
from typer.testing import CliRunner

from mc_engine import load_campaign, replay, run
from mc_engine.command_line.commands import app
from mc_engine.documentation.website import HOME

PAGE = HOME / "how_to" / "simulator_examples.md"
METRICS = ["fall_time_s", "impact_speed_m_s"]


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """The run of each example, by its name."""
    folder, runs = tmp_path_factory.mktemp("examples"), {}
    campaign, table = (text for text, _ in blocks(PAGE, "text"))
    for text, _ in blocks(PAGE, "python"):
        name = text.splitlines()[0].removeprefix("# ")
        home = folder / name.removesuffix(".py")
        home.mkdir()
        (home / name).write_text(text)
        (home / "campaign.toml").write_text(campaign.replace("ball_ivp.py", name))
    home = folder / "ball"
    home.mkdir()
    ((source, _),) = blocks(PAGE, "c")
    (home / "ball.c").write_text(source)
    compiler = shutil.which("cc") or shutil.which("gcc")
    subprocess.run([compiler, "-O2", "-o", "ball", "ball.c", "-lm"], cwd=home, check=True)
    (home / "deck.inp.j2").write_text("mass = {{ mass_kg }}\n")
    (home / "campaign.toml").write_text(campaign.replace('simulator = "ball_ivp.py"\n', "") + table)
    for home in sorted(folder.iterdir()):
        runs[home.name] = run(load_campaign(home / "campaign.toml"), folder / f"run-{home.name}", workers=2)
    return runs


def test_the_examples_are_these(flown):
    assert [*flown] == ["ball", "ball_batch", "ball_ivp"]


@pytest.mark.parametrize(("name", "rel"), [("ball", 1e-13), ("ball_ivp", 1e-9)])
def test_the_examples_agree(flown, name, rel):
    ours, theirs = flown["ball_batch"].cases(), flown[name].cases()
    assert set(theirs["status"]) == {"ok"}
    assert list(ours["mass_kg"]) == list(theirs["mass_kg"])
    assert np.allclose(ours[METRICS], theirs[METRICS], rtol=rel, atol=0.0)


@pytest.mark.parametrize("name", ["ball", "ball_batch", "ball_ivp"])
def test_each_example_replays(flown, name):
    again = replay(flown[name].path, 7)
    assert again.equal, again.differences


def test_compare_pairs_the_examples_by_case(flown):
    said = CliRunner().invoke(app, ["compare", *(str(flown[name].path) for name in ("ball_ivp", "ball"))])
    assert said.exit_code == 0, said.output
    assert "paired: 40 cases have the same inputs in both runs" in said.output
