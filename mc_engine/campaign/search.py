"""Finds campaign files, the shipped ones by name and any other by its path, and reads their text."""

import os
import re
import tomllib
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from mc_engine.errors import CampaignError, ModelError, Problem
from mc_engine.store.run_files import NO_TEXT, readable
from mc_engine.store.urls import is_url, without_secrets
from mc_engine.suggestions import hint

_LARGEST_FILE = 250_000  # bytes; more of them could take the reader of TOML longer than a second
SHIPPED = Path(__file__).resolve().parents[2] / "campaigns"


class ShippedCampaign(NamedTuple):
    """A campaign that comes with the engine; `title` is the one in its file."""

    name: str
    path: Path
    title: str


def list_campaigns() -> list[ShippedCampaign]:
    """The campaigns that come with mc-engine.

    Returns a list of named tuples (name, path, title), sorted by name: "deorbit" is campaigns/deorbit/campaign.toml,
    "deorbit/map" is campaigns/deorbit/map.toml.

    Raises nothing: a file that cannot be read has an empty title.

    >>> [campaign.name for campaign in list_campaigns()][:2]
    ['deorbit', 'deorbit/demonstration']
    """
    files = sorted(_shipped().items())
    return [ShippedCampaign(name, path, str(campaign_section(path).get("title", ""))) for name, path in files]


def campaign_names() -> list[str]:
    """The names of all shipped campaigns, without opening a file."""
    return sorted(_shipped())


def campaign_paths(begun: str) -> list[str]:
    """Folders, and .toml files, whose path begins with `begun`; a folder ends in a slash."""
    folder, slash, name = begun.rpartition("/")
    before = folder + slash
    try:
        entries = sorted(Path(before or ".").iterdir())
    except (OSError, ValueError):
        return []
    fitting = [entry for entry in entries if entry.name.startswith(name) and (name or not entry.name.startswith("."))]
    return [
        f"{before}{entry.name}{'/' if entry.is_dir() else ''}"
        for entry in fitting
        if entry.is_dir() or entry.suffix == ".toml"
    ]


def model_sources() -> dict[str, str]:
    """Where the model of each folder of shipped campaigns comes from; this loads the models.

    A model that cannot be loaded, or has no source, is left out.
    """
    from mc_engine.model.record import load_model

    sources = {}
    for path in sorted(SHIPPED.glob("*/campaign.toml")):
        with suppress(ModelError):
            if source := load_model(str(campaign_section(path).get("model")), path.parent).source:
                sources[path.parent.name] = source
    return sources


def find_campaign(reference: str | Path) -> Path:
    """The file of a shipped name, of a path to a .toml file, or of a folder that holds campaign.toml.

    A shipped name takes precedence over a folder of that name; write "./deorbit" for the folder.
    """
    text = str(reference)
    shipped = _shipped()
    if text in shipped:
        return shipped[text]
    path = Path(text)
    file = path / "campaign.toml" if os.path.isdir(path) else path
    if os.path.isfile(file):  # not Path.is_file: a name may be too long, or hold a zero byte
        if (place := str(file.resolve())) != readable(place):
            raise CampaignError(readable(text), [Problem("", NO_TEXT)])
        if file.suffix == ".py":
            raise CampaignError(text, [Problem("", "is no campaign file; name the .toml file that names this model")])
        return file
    raise CampaignError(without_secrets(text), [Problem("", _not_found(text, path, list(shipped)))])


def campaign_text(path: Path) -> str:
    """The contents of a campaign file; CampaignError where it cannot be read, is too large, or is not UTF-8."""
    try:
        data = path.read_bytes() if path.stat().st_size <= _LARGEST_FILE else None
    except OSError as error:
        raise CampaignError(path.name, [Problem("", f"cannot be read: {error.strerror}")]) from None
    if data is None:
        raise CampaignError(
            path.name, [Problem("", "is larger than 250 kB; a long table of cases belongs into a CSV file")]
        )
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise CampaignError(path.name, [Problem(f"line {line}", "is not text in UTF-8")]) from None


def campaign_name(path: Path) -> str:
    """The shipped name of a file, or a name made from its path."""
    path = path.resolve()
    for name, shipped in _shipped().items():
        if shipped == path:
            return name
    return path.parent.name if path.stem == "campaign" and path.parent.name else path.stem


def _shipped() -> dict[str, Path]:
    files = {}
    for path in SHIPPED.glob("*/*.toml"):
        name = path.parent.name if path.stem == "campaign" else f"{path.parent.name}/{path.stem}"
        if path.stem != "published" and re.fullmatch(r"[\w-]+(/[\w-]+)?", name):
            files[name] = path
    return files


def campaign_section(path: Path) -> dict[str, Any]:
    """The table [campaign] of a file as it is written, which is not checked; empty where there is none."""
    try:
        section = tomllib.loads(path.read_text(encoding="utf-8")).get("campaign")
    except (OSError, ValueError):
        return {}
    return section if isinstance(section, dict) else {}


def _not_found(text: str, path: Path, names: list[str]) -> str:
    if text and os.path.isdir(path):
        others = [name for name in campaign_paths(f"{text.rstrip('/')}/") if name.endswith(".toml")]
        instead = f", but {others[0]}" if others else "; `mc-engine init DIR` makes a campaign in a new folder"
        return f"holds no campaign.toml{instead}"
    if path.suffix == ".toml":
        return (
            "there is no such file; `mc-engine list` names the shipped campaigns, `mc-engine init DIR` makes a new one"
        )
    if is_url(text):
        return "is a URL; a campaign is read from a file here"
    near = hint(text, names)
    meant = near if "did you mean" in near else ""
    if "/" not in text and not text.startswith("."):
        known = meant or "; `mc-engine list` names the campaigns"
        return f"there is no campaign of that name, and no such path{known}"
    return f"there is no such path{meant or ' with a campaign.toml; `mc-engine init` makes one'}"
