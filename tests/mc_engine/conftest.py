"""Folders that several tests of the engine begin with."""

import pytest

from tests.mc_engine.command_line.cart import CAMPAIGN, MODEL
from tests.mc_engine.store.small_run import created


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A working folder with a campaign of a cart in `cart/`."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cart").mkdir()
    (tmp_path / "cart" / "model.py").write_text(MODEL)
    (tmp_path / "cart" / "campaign.toml").write_text(CAMPAIGN)
    return tmp_path


@pytest.fixture
def run(tmp_path):
    """The directory of a run, yet to be made."""
    return tmp_path / "run"


@pytest.fixture
def store(run):
    """A run of forty cases, none of them flown."""
    return created(run)
