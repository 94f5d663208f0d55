"""Directories of results: names of their files, their kind by these names, and where they lie.  No file is read."""

import os
import re
from datetime import UTC, datetime
from pathlib import Path

from mc_engine.durable_file import temporary_name
from mc_engine.errors import UsageError

JOURNAL, MANIFEST = "journal.jsonl", "manifest.json"
CAMPAIGN = "campaign.toml"
NOMINAL, NOMINAL_CASE = "nominal.parquet", -1  # file and case_id of the nominal case
NO_NOMINAL = "the imported table has no case -1, the nominal"  # reason in its row then
SENSITIVITY = "sensitivity"  # the run directory, inside a run, of the flights for contributions
SIMULATOR = "simulator"  # the folder, inside a run, of what cases of a simulator left behind
CUT_SHORT = {temporary_name(name) for name in (CAMPAIGN, MANIFEST, JOURNAL, NOMINAL)}  # of a creation cut short
NO_FOLDER = "the folder is gone"
NO_TEXT = "lies where a name is no text in UTF-8; rename the folder or file"
RUN, TUNING, RARE_EVENT = "run", "tuning", "rare event"
STEMS = {TUNING: "tuning", RARE_EVENT: "rare"}


def path_of(place: object, refusal: str) -> Path:
    """The path that a caller in Python gave; UsageError for what is none.

    refusal : the sentence, with {} for the type of what was given
    """
    if isinstance(place, str | os.PathLike):
        return Path(place)
    own = getattr(place, "path", None)
    beside = f"; its path is {own}" if isinstance(own, Path) else ""
    raise UsageError(f"{refusal.format(type(place).__name__)}{beside}")


def kind_of(path: str | Path) -> str | None:
    """RUN, TUNING or RARE_EVENT, also of a directory that is damaged; None for anything else."""
    folder = Path(path)
    if (folder / MANIFEST).is_file():
        return RUN
    journal = (folder / JOURNAL).is_file()
    for kind, stem in STEMS.items():
        if (folder / f"{stem}.json").is_file() or (journal and (folder / f"{stem}.toml").is_file()):
            return kind
    return RUN if journal else None


def is_run_directory(path: str | Path) -> bool:
    """True if `path` is or was a run directory, whole or damaged."""
    return kind_of(path) == RUN


def readable(name: str) -> str:
    """The name of a file or folder as valid Unicode, with a replacement character for bytes that are not UTF-8."""
    return os.fsencode(name).decode("utf-8", "replace")


def stem_of(campaign_name: str) -> str:
    """A campaign's name as a part of a folder's name."""
    return re.sub(r"[^\w.-]+", "-", campaign_name)


def default_folder(campaign_name: str) -> Path:
    """`runs/<campaign>-<UTC time>`, a folder that does not exist."""
    path = Path("runs") / f"{stem_of(campaign_name)}-{datetime.now(UTC):%Y%m%dT%H%M%SZ}"
    return path if not path.exists() else path.with_name(f"{path.name}-{datetime.now(UTC):%f}")


def runs_in(folder: Path) -> list[Path]:
    """The run directories in `folder`, in the order in which they were begun."""
    manifests = folder.glob("*/manifest.json") if folder.is_dir() else ()
    return [file.parent for file in sorted(manifests, key=lambda file: (file.stat().st_mtime_ns, file))]
