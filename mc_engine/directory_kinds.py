"""What a directory holds, by the files that lie in it: a run, a tuning or a rare event.  Nothing is read."""

from pathlib import Path

JOURNAL, MANIFEST = "journal.jsonl", "manifest.json"
RUN, TUNING, RARE_EVENT = "run", "tuning", "rare event"
STEMS = {TUNING: "tuning", RARE_EVENT: "rare"}


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
