"""The message of an interrupted command: the state of the run, and the command that continues.

Read from the journal without numba or pandas, since the signal may have interrupted their import.
"""

import json
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from mc_engine.errors import EngineError
from mc_engine.interruption import NOTHING_BEGUN
from mc_engine.shell_words import shell_word
from mc_engine.store.run_files import JOURNAL, MANIFEST

if TYPE_CHECKING:
    from mc_engine.store.store import Store

MERGE = "`mc-engine merge RUN SHARD...` makes one run of all shards, and its reports"
_UNFINISHED = ("created", "started", "rerun", "extended", "part-withdrawn")  # events that `finished` has to follow


def after_flight(run: Path, options: str = "", url: str | None = None, rerun: bool = False, lines: int = 0) -> str:
    """The message for a flight into the directory `run`.

    options : those of the backend.  url : where the run is published.  rerun : the flight was of failed cases.
    lines : of the journal when the command began
    """
    if not (run / JOURNAL).is_file():
        return NOTHING_BEGUN
    events, manifest = _events(run), json.loads((run / MANIFEST).read_bytes())
    if advice := after_merge(run):
        return f"interrupted; {advice}"
    # a run with interim analyses is complete once it is decided, which `resume` finds out
    if manifest.get("looks") or not _is_finished(events):
        command = "rerun --failed" if rerun and "rerun" in events else "resume"
        again = f"`mc-engine {command} {shell_word(run)}{options}{f' --publish {shell_word(url)}' if url else ''}`"
        return f"interrupted; what was committed is safe, {again} flies the rest"
    if len(events) == lines:  # neither `extend` nor `rerun` had begun
        return NOTHING_BEGUN
    if manifest.get("shard"):
        return f"interrupted; all cases of the shard are in {run}, `mc-engine merge RUN SHARD...` joins the shards"
    copy = f", `mc-engine publish {shell_word(run)} {shell_word(url)}` sends them and the cases" if url else ""
    return f"interrupted; all cases are there, `mc-engine report {shell_word(run)}` writes the reports{copy}"


def after_merge(run: Path) -> str:
    """What to do about a merge that broke off before it had taken over all rows of its shards; "" for any other run."""
    events = _events(run) if (run / JOURNAL).is_file() else []
    if "merged" not in events or "started" in events:
        return ""
    word = shell_word(run)
    return f"remove {word} and run the same `mc-engine merge` again; `mc-engine resume {word}` would fly its cases anew"


def is_complete(run: Path) -> bool:
    """True if the run in `run` is complete, no file of it is missing, and no killed writer left files there."""
    from mc_engine.store.opening import open_store
    from mc_engine.store.writer_lock import is_left_by_dead

    store = open_store(run)
    finished = _is_finished(_events(run)) and not store.missing() and not store.lost_files()
    return finished and not is_left_by_dead(run)


def after_run(store: "Store") -> str:
    """What can be done with a run that is complete."""
    from mc_engine.runner.flown_campaign import campaign_of
    from mc_engine.sampling.designs import extension_problem

    if store.manifest.get("shard"):
        return MERGE
    word, more = shell_word(store.path), ""
    with suppress(EngineError):
        campaign_of(store)  # refuses a run of other sources, or an imported one
        if not extension_problem(store.manifest, store.n_cases, store.n_cases + 1):
            more = f"`mc-engine extend {word} --cases N` adds cases, "
    return f"{more}`mc-engine report {word}` writes the reports anew"


def journal_lines(run: Path) -> int:
    """How many lines the journal of a run has; 0 if there is none."""
    return len(_events(run)) if (run / JOURNAL).is_file() else 0


def _events(run: Path) -> list[str]:
    from mc_engine.store.journal import read_journal, scan

    return [entry.event for entry in scan(read_journal(run / JOURNAL)).entries]


def _is_finished(events: list[str]) -> bool:
    last = {event: number for number, event in enumerate(events)}
    return last.get("finished", -1) > max((last[event] for event in _UNFINISHED if event in last), default=0)


def after_search(folder: Path, record: str, words: str) -> str:
    """The message for a search whose result is the file `record` in `folder`.  words : subject of the sentence."""
    if not (folder / record).is_file():
        return NOTHING_BEGUN
    return f"interrupted; {words} in {folder}, `mc-engine report {shell_word(folder)}` writes the report"
