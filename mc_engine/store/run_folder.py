"""Where a run goes when the user names no folder."""

import os
import re
from datetime import UTC, datetime
from pathlib import Path

NO_TEXT = "lies where a name is no text in UTF-8; rename the folder or file"


def readable(name: str) -> str:
    """The name of a file or folder as text that every file and stream takes, whatever bytes the disk has for it."""
    return os.fsencode(name).decode("utf-8", "replace")


def default_folder(campaign_name: str) -> Path:
    """`runs/<campaign>-<UTC time>`, a folder that is not there yet."""
    stem = re.sub(r"[^\w.-]+", "-", campaign_name)
    path = Path("runs") / f"{stem}-{datetime.now(UTC):%Y%m%dT%H%M%SZ}"
    return path if not path.exists() else path.with_name(f"{path.name}-{datetime.now(UTC):%f}")


def runs_in(folder: Path) -> list[Path]:
    """The run directories that lie in `folder`, the one begun last at the end."""
    manifests = folder.glob("*/manifest.json") if folder.is_dir() else ()
    return [file.parent for file in sorted(manifests, key=lambda file: (file.stat().st_mtime_ns, file))]
