"""Verification of a run, a tuning or a rare event: all files are compared with the checksums in the journals.

It only reads, and runs no code of the campaign.  Unlike opening a directory, it reports all damage, not the first.
Checksums detect damage, not forgery.
"""

import os
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from mc_engine.durable_file import is_temporary, names_in, read_short
from mc_engine.errors import StoreError
from mc_engine.shell_words import shell_word
from mc_engine.store.case_rows import is_log
from mc_engine.store.derived_files import STRANGE, derived_files, remade_by
from mc_engine.store.histories import read_histories
from mc_engine.store.journal import Scan, read_journal, scan
from mc_engine.store.manifest_file import NEWER, cases_in, columns_in, edited_files, parse_manifest
from mc_engine.store.parts import PART_FOLDERS, is_part_file, problem_of, read_part
from mc_engine.store.receipts import Receipts, receipts_of
from mc_engine.store.result_folder import COMMANDS, read_result, result_files
from mc_engine.store.run_files import (
    CAMPAIGN,
    CUT_SHORT,
    JOURNAL,
    MANIFEST,
    NO_FOLDER,
    NOMINAL,
    RUN,
    SENSITIVITY,
    SIMULATOR,
    kind_of,
)
from mc_engine.store.writer_lock import LOCK_NAME, holder, is_left_by_dead

# Remedies of damage: {0} stands for the directory, and {1} for the files.
REPAIR = "`mc-engine resume {0} --repair` flies bad parts again, and removes what does not count"
ORIGINAL = "put back the original of {1}, or fetch a copy of the run; without it no repair can fly anything again"
IN_THE_WAY = "move {1} out of the run, then `mc-engine resume {0} --repair`: until then no writer can go on"
RESUME = "left by an interrupted writer; the next `resume` removes it, and flies the rest"  # no damage
AWAY = "move {1} out of the run: all that lies in its folder of cases is read as cases"
UPDATE = "update mc-engine, and verify again: whether anything is damaged is not known"
AGAIN = "put back the original of {1}, or let `mc-engine %s` make the result again, in another folder"
_SESSION = ("started", "rerun", "finished", "interrupted")


@dataclass(frozen=True)
class Damage:
    """What is wrong with a file, in a sentence that begins with the file's name, and the remedy."""

    what: str
    mended_by: str

    @property
    def file(self) -> str:
        """The file's name in the directory."""
        return self.what.partition(": ")[0]


def damage(folder: Path) -> list[str]:
    """A sentence for each damage, beginning with the file's name in `folder`; empty if there is none.

    A torn last line and parts without a line are not reported while a process is writing, nor after it was killed: the
    next writer removes them.
    """
    return [item.what for item in damages(folder) if item.mended_by != RESUME]


def remedies(folder: Path | str, problems: list[Damage]) -> list[str]:
    """A sentence for each kind of remedy, in the order in which they have to be applied."""
    files: dict[str, list[str]] = {remedy: [] for remedy in (ORIGINAL, AWAY, STRANGE, IN_THE_WAY, REPAIR)}
    for problem in problems:
        files.setdefault(problem.mended_by, []).append(problem.file)
    named = {remedy: ", ".join(dict.fromkeys(names)) for remedy, names in files.items() if names}
    return [remedy.format(shell_word(folder), names) for remedy, names in named.items()]


def damages(folder: Path) -> list[Damage]:
    """All damage in the directory, and the files that an interrupted writer left, with the remedies."""
    kind = kind_of(folder)
    if kind is None:
        raise StoreError(f"{folder}: is no run directory")
    others: Collection[str] = ()
    if kind == RUN:
        problems, others = _run_damages(folder)
    else:
        problems = _result_damages(folder, kind)
    derived = derived_files(folder).problems(others)
    return problems + [Damage(f"{name}: {why}", remade_by(name)) for name, why in derived]


def _without_folder(folder: Path, error: StoreError) -> str:
    """The sentence of an error, with the file's name relative to the directory."""
    return str(error).removeprefix(f"{folder}/")


# ---- tunings and rare events


def _result_damages(folder: Path, kind: str) -> list[Damage]:
    ours, derived, again = result_files(folder, kind), derived_files(folder), AGAIN % COMMANDS[kind]
    recorded = ours.problems() if (folder / JOURNAL).exists() else []
    problems = [Damage(f"{name}: {why}", again) for name, why in recorded]
    for name in names_in(folder):
        if not (ours.are_called(name) or derived.are_called(name) or is_temporary(name)):
            problems.append(Damage(f"{name}: is not of this {kind}", STRANGE))
    try:
        if not problems:
            read_result(folder, kind)
    except StoreError as error:
        problems.append(Damage(_without_folder(folder, error), UPDATE if NEWER in str(error) else again))
    return problems


# ---- runs


def _run_damages(run: Path) -> tuple[list[Damage], Collection[str]]:
    """All damage of the run itself, and the names of the files with which it began."""
    busy = holder(run) is not None
    present = sorted(_present(run))  # before the journal is read, so that a part committed meanwhile has its line
    try:
        journal = scan(read_journal(run / JOURNAL))
    except StoreError as error:
        return [Damage(_without_folder(run, error), ORIGINAL)], ()
    begun = _begun_with(journal)
    problems = [Damage(text, UPDATE if NEWER in text else ORIGINAL) for text in _head_problems(run, begun)]
    manifest = None if problems else parse_manifest(read_short(run / MANIFEST))
    counted, wrong = receipts_of(journal.entries)
    killed = not busy and is_left_by_dead(run) and not (journal.damaged or wrong)
    remedy = RESUME if killed else REPAIR  # where a line is damaged, a part without a line may be that line's
    problems += _line_problems(journal, wrong, busy, remedy)
    problems += _part_problems(run, counted, manifest)
    problems += _obstacles(run)
    if not busy:
        problems += _unrecorded(run, present, counted, remedy) if begun else []
        problems += _unfinished(journal, counted, manifest, remedy)
        problems += _companion_problems(run, journal)
    if killed:
        problems += _half_written(run)
    return problems, begun


def _companion_problems(run: Path, journal: Scan) -> Iterator[Damage]:
    """Damage of the flights for sensitivities, which are a run directory inside the run."""
    flown = any(entry.event == "companion" for entry in journal.entries)
    folder = run / SENSITIVITY
    if _is_folder(folder) and kind_of(folder) == RUN:
        for item in damages(folder):
            yield Damage(f"{SENSITIVITY}/{item.what}", item.mended_by)
    elif flown and os.path.lexists(folder):
        is_empty = _is_folder(folder) and not any(folder.iterdir())
        yield Damage(f"{SENSITIVITY}: is no folder with a run", REPAIR if is_empty else IN_THE_WAY)
    elif flown:
        yield Damage(f"{SENSITIVITY}: {NO_FOLDER}", REPAIR)


def _begun_with(journal: Scan) -> dict[str, str]:
    """SHA-256 by name of the files with which the run began; empty if the journal's first line is lost."""
    if not journal.entries or journal.entries[0].number != 1 or receipts_of(journal.entries[:1])[1]:
        return {}
    created = journal.entries[0].facts
    return {MANIFEST: created["manifest"], CAMPAIGN: created["campaign"], **created.get("companions", {})}


def _head_problems(run: Path, begun: dict[str, str]) -> Iterator[str]:
    """Damage of manifest, campaign file and companions, by the digests in the journal's first line."""
    if not begun:
        yield f"{JOURNAL}: its first line, the creation, is lost; {MANIFEST} and {CAMPAIGN} cannot be verified"
        return
    problems = list(edited_files(run, begun))
    yield from problems
    try:
        if not any(problem.startswith(f"{MANIFEST}: ") for problem in problems):
            parse_manifest(read_short(run / MANIFEST))
    except (StoreError, ValueError) as error:
        yield f"{MANIFEST}: {error}"


def _part_problems(run: Path, counted: Receipts, manifest: dict[str, Any] | None) -> Iterator[Damage]:
    columns = None if manifest is None else columns_in(manifest)
    for part in counted.all_parts():
        read: Callable[[], object] = partial(read_part, run, part, None if part is counted.histories else columns)
        if part is counted.histories and manifest is not None:
            read = partial(read_histories, run, part, manifest.get("quantities", []))
        if problem := problem_of(run / part.file, read):
            yield Damage(f"{part.file}: {problem}", IN_THE_WAY if _is_folder(run / part.file) else REPAIR)


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()


def _obstacles(run: Path) -> Iterator[Damage]:
    """What lies beside manifest and journal and keeps every writer from its work."""
    for name in (LOCK_NAME, *CUT_SHORT):
        if _is_folder(run / name):
            yield Damage(f"{name}: is a folder", IN_THE_WAY)
    if os.path.lexists(run / SIMULATOR) and not _is_folder(run / SIMULATOR):
        yield Damage(f"{SIMULATOR}: is no folder of this run's own", IN_THE_WAY)


def _present(run: Path) -> Iterator[str]:
    """Names of all that is in the folders of parts, except what the next writer removes or nothing reads as cases."""
    if (run / NOMINAL).exists():
        yield NOMINAL
    for folder in PART_FOLDERS:
        if not _is_folder(run / folder):
            yield folder
            continue
        for name in names_in(run, folder):
            # pandas, pyarrow and DuckDB pass over hidden files, such as .DS_Store; DuckDB reads hidden ones in .parquet
            unread = is_temporary(name) or (name.startswith(".") and not name.endswith(".parquet"))
            if not unread or (run / folder / name).is_dir():
                yield f"{folder}/{name}"


def _half_written(run: Path) -> Iterator[Damage]:
    for path in sorted([*run.glob(".*.tmp"), *run.glob("*/.*.tmp")]):
        if path.is_file():
            name = path.relative_to(run).as_posix()
            what = "holds rows of complete cases, which are taken over" if is_log(name) else "is a temporary file"
            yield Damage(f"{name}: {what}", RESUME)


def _unrecorded(run: Path, present: list[str], counted: Receipts, remedy: str) -> Iterator[Damage]:
    files = {part.file for part in counted.all_parts()}
    for file in present:
        if file in PART_FOLDERS and not os.path.lexists(run / file):
            yield Damage(f"{file}: {NO_FOLDER}", REPAIR)
        elif file in PART_FOLDERS:
            yield Damage(f"{file}: is no folder of this run's own", ORIGINAL)
        elif file not in files and (file == NOMINAL or is_part_file(file)) and _is_folder(run / file):
            yield Damage(f"{file}: is a folder", IN_THE_WAY)
        elif file not in files and (file == NOMINAL or is_part_file(file)):
            yield Damage(f"{file}: has no line in the journal and is not part of the run", remedy)
        elif file not in files:
            yield Damage(f"{file}: is not of this run", AWAY)


def _unfinished(journal: Scan, counted: Receipts, manifest: dict[str, Any] | None, remedy: str) -> Iterator[Damage]:
    """A run that has all its cases, but no line "finished" or "interrupted" of its last session."""
    events = [entry.event for entry in journal.entries if entry.event in _SESSION]
    if manifest is None or not events or events[-1] in ("finished", "interrupted"):
        return
    if not counted.missing(cases_in(manifest, counted.cases(manifest["campaign"]["cases"]))):
        yield Damage(f"{JOURNAL}: all cases are there, and no line says that the run was finished", remedy)


def _line_problems(journal: Scan, wrong: dict[int, str], busy: bool, remedy: str) -> Iterator[Damage]:
    lines = {number: "" for number in journal.damaged} | {number: f", {why}" for number, why in wrong.items()}
    for number, why in sorted(lines.items()):
        if number > 1:  # without the first line the creation is lost, which is said of it
            yield Damage(f"{JOURNAL}, line {number}: damaged{why}", REPAIR)
    last = len(journal.entries) + len(journal.damaged) + 1
    if journal.torn and not busy and last > 1:
        yield Damage(f"{JOURNAL}, line {last}: torn; the next writer cuts it off", remedy)
