"""What `init` makes is short enough to be read at a sitting, shows one of each thing, and runs at once."""

import tomllib

import pytest
from typer.testing import CliRunner

from mc_engine.campaign.loading import load_campaign
from mc_engine.command_line.commands import app


def call(*words):
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("newcomer") / "my_case"
    call("init", folder)
    return folder


def test_it_shows_parameters_dispersions_a_requirement_an_event_and_retention(made):
    campaign = load_campaign(made)
    assert len(campaign.model.parameters) > len(campaign.dispersions) >= 2
    assert all(one.source for one in campaign.dispersions)
    assert [event.name for event in campaign.model.event_list] == ["apogee"]
    assert len(campaign.requirements) == 1
    assert tomllib.loads((made / "campaign.toml").read_text())["retention"]["histories"] == {
        "nominal": True,
        "first": 3,
    }


def test_it_flies_as_it_is_to_a_report_whose_requirement_is_met(made):
    run = made.parent / "flown"
    call("run", made, "--out", run, "--cases", "200", "--judge")
    assert "Apogee raised by one burn" in (run / "report.html").read_text(encoding="utf-8")
    assert (run / "report.pdf").read_bytes().startswith(b"%PDF")
