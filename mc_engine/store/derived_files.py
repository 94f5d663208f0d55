"""Reports and replays: files that are made from the results of a run, a tuning or a rare event.

They can be made at any time, also while the run is flying, and so have a journal of their own, `derived.jsonl`.
"""

import re
from pathlib import Path

from mc_engine.store.counted_files import CountedFiles

DERIVED, FIGURES, REPLAYS = "derived.jsonl", "report-figures", "replay"
STRANGE = "move {1} out of the directory, which has no such files of its own"
_LOCK = ".derived.lock"
_NAMES = re.compile(
    r"report\.(?P<format>html|pdf|md|json)|footprint(?:-[0-9]{1,4})?\.(?:kml|geojson)"
    rf"|(?P<figure>{FIGURES}/figure-[0-9]{{1,6}}\.svg)|{REPLAYS}/case-(?P<case>[0-9]{{1,10}})\.(?:parquet|png)"
)


def derived_files(folder: Path) -> CountedFiles:
    """The reports and replays in a directory of results."""
    return CountedFiles(folder, DERIVED, _NAMES, (FIGURES, REPLAYS), _LOCK)


def remade_by(name: str) -> str:
    """What to do about a damaged file of this name; {0} stands for the directory, and {1} for the file."""
    match = _NAMES.fullmatch(name)
    if match is None and not name.startswith(f"{DERIVED}, "):
        return STRANGE
    if match is not None and match["case"]:
        return f"`mc-engine replay {{0}} {match['case']}` makes {{1}} anew"
    kind = None if match is None else "md" if match["figure"] else match["format"]
    return f"`mc-engine report {{0}}{f' --format {kind}' if kind else ''}` makes {{1}} anew"
