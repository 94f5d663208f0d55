"""Files that a campaign reads from its own folder, as the run directory keeps them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mc_engine.durable_file import sha256_inside
from mc_engine.errors import StoreError


def companion_problems(run: Path, created: Mapping[str, Any]) -> list[str]:
    """A sentence for every file beside the campaign that is gone or edited; `created` are the facts of the creation."""
    problems = []
    for name, digest in created.get("companions", {}).items():
        try:
            if sha256_inside(run, name) != digest:
                problems.append(f"{name}: damaged or edited, its SHA-256 is not the one in the journal")
        except StoreError as error:
            problems.append(str(error).removeprefix(f"{run}/"))
    return problems
