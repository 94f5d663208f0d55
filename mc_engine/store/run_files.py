"""Names of the files in directories of results, and the kind of a directory by these names.  No file is read."""

from pathlib import Path

from mc_engine.durable_file import temporary_name

JOURNAL, MANIFEST = "journal.jsonl", "manifest.json"
CAMPAIGN = "campaign.toml"
NOMINAL = "nominal.parquet"
SENSITIVITY = "sensitivity"  # the run directory, inside a run, of the flights for contributions
CUT_SHORT = {temporary_name(name) for name in (CAMPAIGN, MANIFEST, JOURNAL, NOMINAL)}  # of a creation cut short
NO_FOLDER = "the folder is gone"
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


def is_run_directory(path: str | Path) -> bool:
    """True if `path` is or was a run directory, whole or damaged."""
    return kind_of(path) == RUN
