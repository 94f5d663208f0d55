"""The smallest campaign with deliberate mistakes, for the tests of what the engine says about them."""

from mc_engine.campaign.loading import SHIPPED, load_campaign

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


def line_of(folder, text):
    """The line of the campaign's model on which `text` begins."""
    model = (folder / "model.py").read_text()
    return 1 + model[: model.index(text)].count("\n")
