"""Files that a campaign reads from its own folder, as the run directory keeps them."""

from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any


def companion_problems(run: Path, created: Mapping[str, Any]) -> list[str]:
    """A sentence for every file beside the campaign that is gone or edited; `created` are the facts of the creation."""
    problems = []
    for name, digest in created.get("companions", {}).items():
        try:
            if sha256((run / name).read_bytes()).hexdigest() != digest:
                problems.append(f"{name}: damaged or edited, its SHA-256 is not the one in the journal")
        except OSError as error:
            problems.append(f"{name}: {error.strerror}")
    return problems
