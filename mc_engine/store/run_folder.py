"""Folders of runs: the default one of a new run, and those that a folder holds."""

import os
import re
from datetime import UTC, datetime
from pathlib import Path

NO_TEXT = "lies where a name is no text in UTF-8; rename the folder or file"


def readable(name: str) -> str:
    """The name of a file or folder as valid Unicode, with a replacement character for bytes that are not UTF-8."""
    return os.fsencode(name).decode("utf-8", "replace")


def default_folder(campaign_name: str) -> Path:
    """`runs/<campaign>-<UTC time>`, a folder that does not exist."""
    stem = re.sub(r"[^\w.-]+", "-", campaign_name)
    path = Path("runs") / f"{stem}-{datetime.now(UTC):%Y%m%dT%H%M%SZ}"
    return path if not path.exists() else path.with_name(f"{path.name}-{datetime.now(UTC):%f}")


def runs_in(folder: Path) -> list[Path]:
    """The run directories in `folder`, in the order in which they were begun."""
    manifests = folder.glob("*/manifest.json") if folder.is_dir() else ()
    return [file.parent for file in sorted(manifests, key=lambda file: (file.stat().st_mtime_ns, file))]
