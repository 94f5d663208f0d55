"""The smallest campaign with deliberate mistakes, for the tests of what the engine says about them."""

import pytest

from mc_engine.campaign.loading import load_campaign
from mc_engine.campaign.search import SHIPPED
from mc_engine.errors import CampaignError

MODEL = (SHIPPED / "minimal" / "model.py").read_text()
CAMPAIGN = (SHIPPED / "minimal" / "campaign.toml").read_text()


def write_campaign(folder, *edits):
    """The smallest campaign in `folder`, with each (text, other text) of its model exchanged."""
    text = MODEL
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new)
    folder.mkdir(exist_ok=True)
    (folder / "model.py").write_text(text)
    (folder / "campaign.toml").write_text(CAMPAIGN)
    return folder


def campaign_with(folder, *edits):
    """The same, loaded."""
    return load_campaign(write_campaign(folder, *edits))


def refused(folder, edits, sentence, text=None):
    """The campaign with these edits has one problem, which has this sentence and the line of `text` in the model."""
    with pytest.raises(CampaignError) as error:
        campaign_with(folder, *edits)
    (problem,) = error.value.problems
    line = f"{line_of(folder, text)}: " if text else ""
    assert problem.message.startswith(f"model.py, line {line}"), (sentence, problem.message)
    assert sentence in problem.message


def given(*arguments):
    """The edit that hands `model` these arguments, too."""
    return ("observe=observe,", f"observe=observe, {', '.join(arguments)},")


def in_front(text, function="observe"):
    """The edit that puts `text` in front of one of the model's functions."""
    return (f"@physics\ndef {function}", f"{text}\n\n\n@physics\ndef {function}")


def with_input(declared):
    """Edits: one input more, such as 'law=Setting("a", "law")'."""
    return [("    altitude_km=Parameter", f"    {declared},\n    altitude_km=Parameter"),
            ("FixedStep, Parameter,", "FixedStep, Parameter, Setting,")]  # fmt: skip


def with_evaluate(result):
    """Edits: `evaluate` gives `result`, which may read the largest speed in `best.speed`, and the metric
    top_speed_m_s is left to it."""
    return [
        ('top_speed_m_s=maximum_of("speed_m_s", "largest speed")', 'top_speed_m_s="largest speed"'),
        in_front(f"@physics\ndef evaluate(t, s, best):\n    return {result}"),
        given("evaluate=evaluate", 'extrema={"speed": maximum_of("speed_m_s", "")}'),
    ]


def line_of(folder, text):
    """The line of the campaign's model on which `text` begins."""
    model = (folder / "model.py").read_text()
    return 1 + model[: model.index(text)].count("\n")
