"""The smallest campaign with deliberate mistakes, for the tests of what the engine says about them."""

from pathlib import Path

from mc_engine.campaign.loading import SHIPPED, load_campaign

MODEL = (Path(__file__).with_name("in_parts") / "model.py").read_text()  # its record made part by part
DECLARED = (SHIPPED / "minimal" / "model.py").read_text()
CAMPAIGN = (SHIPPED / "minimal" / "campaign.toml").read_text()


def write_campaign(folder, *edits, text=MODEL):
    """The smallest campaign in `folder`, with each (text, other text) of its model exchanged."""
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


def declared_with(folder, *edits):
    """The smallest campaign as it is shipped, loaded."""
    return load_campaign(write_campaign(folder, *edits, text=DECLARED))


def line_of(folder, text):
    """The line of the campaign's model on which `text` begins."""
    model = (folder / "model.py").read_text()
    return 1 + model[: model.index(text)].count("\n")
