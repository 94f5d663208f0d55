"""Files that a run is made with and that never change: campaign, manifest, and what the campaign reads beside it."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from mc_engine.durable_file import sha256_inside
from mc_engine.errors import StoreError


def edited_files(run: Path, digests: Mapping[str, str]) -> Iterator[str]:
    """A sentence for every one of these files that is gone or edited.  digests : SHA-256 by name."""
    for name, digest in digests.items():
        try:
            if sha256_inside(run, name) != digest:
                yield f"{name}: damaged or edited, its SHA-256 is not the one in the journal"
        except StoreError as error:
            yield str(error).removeprefix(f"{run}/")
