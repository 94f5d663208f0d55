"""The tutorial as its reader works through it: the pieces of code put together are the finished files, and they fly."""

import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import mc_engine
from mc_engine.command_line.commands import app

TUTORIAL = Path(mc_engine.__file__).parent / "documentation" / "tutorial"
FINISHED = TUTORIAL / "sounding_rocket"
FILES = ("model.py", "figures.py", "campaign.toml")


def pieces():
    """The text of each file that the tutorial shows: its blocks with `title="FILE"`, in order."""
    text = (TUTORIAL / "tutorial.md").read_text(encoding="utf-8")
    blocks = re.findall(r'^```\w+ title="([^"]+)"\n(.*?)^```$', text, re.DOTALL | re.MULTILINE)
    return {name: "\n\n".join(code for file, code in blocks if file == name) for name in dict(blocks)}


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """(working folder, outputs by verb) of a reader who types the tutorial's code and flies a few cases."""
    here = tmp_path_factory.mktemp("reader")
    case = here / "sounding_rocket"
    case.mkdir()
    for name, text in pieces().items():
        (case / name).write_text(text, encoding="utf-8")
    run = str(here / "first")
    outputs = {}
    verbs = [["check", str(case)], ["run", str(case), "--out", run, "--cases", "40"], ["replay", run, "17"]]
    for verb in [*verbs, ["bench", str(case), "--cases", "16", "--repeats", "3"]]:
        done = CliRunner().invoke(app, verb)
        assert done.exit_code == 0, done.output
        outputs[verb[0]] = done.output
    return here, outputs


def test_the_blocks_of_the_text_are_the_finished_files():
    shown = pieces()
    assert set(shown) == set(FILES)
    for name in FILES:
        finished = (FINISHED / name).read_text(encoding="utf-8")
        assert [line for line in shown[name].splitlines() if line] == [line for line in finished.splitlines() if line]


def test_a_reader_who_types_it_gets_a_checked_campaign_a_report_and_a_bit_exact_replay(flown):
    here, outputs = flown
    assert "; valid" in outputs["check"]
    assert "every stored number has the same bits" in outputs["replay"]
    page = (here / "first" / "report.html").read_text(encoding="utf-8")
    for title in ("Apogee over thrust and drag", "Landing and apogee", "Altitude over speed"):
        assert title in page
    assert (here / "first" / "report.pdf").read_bytes().startswith(b"%PDF")


def test_the_command_beside_a_worst_case_works_where_its_heading_says(flown, monkeypatch):
    monkeypatch.chdir(flown[0] / "first")
    page = Path("report.html").read_text(encoding="utf-8")
    assert "Command to replay, in the run’s folder" in page
    command = re.search(r">mc-engine (replay [^<]+)<", page)[1].split()
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    assert f"case {command[-1]}: every stored number has the same bits" in done.output


def test_the_reader_sees_what_lanes_give_in_the_words_of_the_text(flown):
    text = (TUTORIAL / "tutorial.md").read_text(encoding="utf-8")
    shown = text.split("$ mc-engine bench sounding_rocket\n")[1].split("```")[0]
    without_numbers = [re.sub(r" *[\d.,]+ ", " # ", one.replace("48 cases", "16 cases")) for one in shown.splitlines()]
    printed = flown[1]["bench"].replace("of 3", "of 20").splitlines()
    assert [re.sub(r" *[\d.,]+ ", " # ", one) for one in printed] == without_numbers
    # a ratio of lanes, whatever the processor and its other work; tests/benchmarks holds the seven
    assert float(re.search(r"([\d.]+) times as fast \(as `run`\)", flown[1]["bench"])[1]) > 1.5


def test_the_rocket_burns_out_peaks_and_lands_under_its_parachute(flown):
    store = mc_engine.open_store(flown[0] / "first")
    cases = store.cases()
    assert set(cases["status"]) == {"ok"}
    assert np.allclose(cases["end_mass_kg"], 200.0, atol=1e-6)
    assert np.allclose(cases["end_altitude_km"], 0.0, atol=1e-6)
    # Under the main parachute weight is drag: v = sqrt(2 m g / (rho A)), downwards; the wind adds its own part.
    slow = np.sqrt(2.0 * 200.0 * 9.80665 / (1.225 * 30.0))
    assert np.allclose(cases["end_vz_m_s"], -slow, rtol=0.01)
    assert np.allclose(cases["end_vx_m_s"], cases["wind_m_s"], atol=0.05)


def test_more_thrust_goes_higher_and_more_drag_less_high(flown):
    cases = mc_engine.open_store(flown[0] / "first").cases()
    thrust, drag = (np.corrcoef(cases[name], cases["apogee_km"])[0, 1] for name in ("thrust_pct", "drag_pct"))
    assert thrust > 0.3
    assert drag < -0.5
