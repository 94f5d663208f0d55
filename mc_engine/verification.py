"""Verification of a run directory: every byte against what the journal says was written.

Reads only.  Unlike opening a store, it goes on after the first damage and reports all of it.
"""

import os
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from mc_engine.companions import companion_problems
from mc_engine.durable_file import is_temporary, read_short
from mc_engine.errors import StoreError
from mc_engine.journal import Scan, read_journal, scan
from mc_engine.lost_extensions import with_lost_extensions
from mc_engine.manifest_file import cases_in, parse_manifest
from mc_engine.part_contents import case_problems, history_problems, nominal_problems
from mc_engine.parts import PART_FOLDERS, Part, is_part_file, read_part
from mc_engine.receipts import Receipts, receipts_of
from mc_engine.shell_words import shell_word
from mc_engine.status import OK, STATUS_NAME
from mc_engine.store import CAMPAIGN, JOURNAL, MANIFEST, NO_FOLDER, NOMINAL, is_run_directory
from mc_engine.writer_lock import LOCK_NAME, holder

# What mends a damage, with the directory of the run in braces.
REPAIR = "`mc-engine resume {0} --repair` flies bad parts again, and removes what does not count"
ORIGINAL = "put back the original of {1}, or fetch a copy of the run; without it no repair can fly anything again"
IN_THE_WAY = "move {1} out of the run, then `mc-engine resume {0} --repair`: no writer can go on with it in its way"
AWAY = "move {1} out of the run: whatever reads its folder takes it for cases"


@dataclass(frozen=True)
class Damage:
    """What is wrong with a file of the run, in words that begin with its name, and what mends it."""

    what: str
    mended_by: str

    @property
    def file(self) -> str:
        """The file's name in the run directory."""
        return self.what.partition(": ")[0]


def damage(run: Path) -> list[str]:
    """A sentence per damage, beginning with the file's name in `run`; empty if all is as written.

    While a writer is at work, a torn last line and parts without a line are its own business and not reported.
    """
    return [one.what for one in damages(run)]


def remedies(run: Path | str, found: list[Damage]) -> list[str]:
    """A sentence for each kind of damage with what mends it; first what has to be done before all else."""
    sentences = []
    for remedy in (ORIGINAL, AWAY, IN_THE_WAY, REPAIR):
        files = list(dict.fromkeys(one.file for one in found if one.mended_by == remedy))
        if files:
            sentences.append(remedy.format(shell_word(run), ", ".join(files)))
    return sentences


def damages(run: Path) -> list[Damage]:
    """All damage in the directory, with what mends it."""
    if not is_run_directory(run):
        raise StoreError(f"{run}: is no run directory")
    busy = holder(run) is not None
    lying = sorted(_lying(run))  # before the journal: a part committed in between has its line by then
    try:
        journal = scan(read_journal(run / JOURNAL))
    except StoreError as error:
        return [Damage(_inner(run, error), ORIGINAL)]
    problems = [Damage(text, ORIGINAL) for text in _head_problems(run, journal)]
    manifest = None if problems else parse_manifest(read_short(run / MANIFEST))
    counted, wrong = _counted(journal, manifest)
    problems += _line_problems(journal, wrong, busy)
    for part in counted.parts:
        problems += _damages(run, part, case_problems(run, part, manifest))
        problems += _outside(part, manifest, counted.cases)
    if counted.nominal is not None:
        problems += _damages(run, counted.nominal, nominal_problems(run, counted.nominal, manifest))
    if counted.histories is not None:
        found = history_problems(run, counted.histories, manifest, counted.cases)
        problems += _damages(run, counted.histories, found)
    problems += _obstacles(run)
    if not busy:
        problems += _uncounted(run, lying, counted)
        problems += _unfinished(journal, counted, manifest)
        problems += _left_out(run, journal, counted, manifest)
    return problems


def _counted(journal: Scan, manifest: dict[str, Any] | None) -> tuple[Receipts, dict[int, str]]:
    """What counts once the journal is repaired, and what is wrong with the lines that are no engine's."""
    begun_with = manifest["campaign"]["cases"] if manifest else None
    wrong = receipts_of(journal.entries, begun_with)[1]
    kept = with_lost_extensions(journal.entries, {*journal.damaged, *wrong}, manifest)
    return receipts_of(kept, begun_with)[0], wrong


def _outside(part: Part, manifest: dict[str, Any] | None, n_cases: int | None) -> Iterator[Damage]:
    """A part of cases that nobody asked this directory for."""
    if manifest is None or n_cases is None:
        return
    wanted = cases_in(manifest, n_cases)
    if part.first < wanted.start or part.stop > wanted.stop:
        whose = "the shard" if manifest.get("shard") else "the run"
        what = f"has cases that are not of {whose}, which has {wanted.start} to {wanted.stop - 1}"
        yield Damage(f"{part.file}: {what}", REPAIR)


def _damages(run: Path, part: Part, problems: list[str]) -> list[Damage]:
    remedy = IN_THE_WAY if _is_folder(run / part.file) else REPAIR
    return [Damage(f"{part.file}: {problem}", remedy) for problem in problems]


def _is_folder(path: Path) -> bool:
    return path.is_dir() and not path.is_symlink()


def _obstacles(run: Path) -> Iterator[Damage]:
    """What lies beside manifest and journal and keeps every writer from its work."""
    lock = run / LOCK_NAME
    if os.path.lexists(lock) and (lock.is_symlink() or not lock.is_file()):
        yield Damage(f"{LOCK_NAME}: is no regular file", IN_THE_WAY)
    for path in sorted(run.iterdir()):
        if is_temporary(path.name) and _is_folder(path):
            yield Damage(f"{path.name}: is a folder", IN_THE_WAY)


def _inner(run: Path, error: StoreError) -> str:
    """The sentence of an error, with the file's name in the run."""
    return str(error).removeprefix(f"{run}/")


def _lying(run: Path) -> Iterator[str]:
    """All that lies where parts do, but for what the next writer removes."""
    if (run / NOMINAL).exists():
        yield NOMINAL
    for folder in PART_FOLDERS:
        if (run / folder).is_symlink() or not (run / folder).is_dir():
            yield folder
            continue
        for path in (run / folder).iterdir():
            if not is_temporary(path.name) or path.is_dir():
                yield f"{folder}/{path.name}"


def _uncounted(run: Path, lying: list[str], counted: Receipts) -> Iterator[Damage]:
    files = {part.file for part in counted.all_parts()}
    for file in lying:
        if file in PART_FOLDERS and not os.path.lexists(run / file):
            yield Damage(f"{file}: {NO_FOLDER}", REPAIR)
        elif file in PART_FOLDERS:
            yield Damage(f"{file}: is no folder of this run's own", ORIGINAL)
        elif file not in files and (file == NOMINAL or is_part_file(file)) and _is_folder(run / file):
            yield Damage(f"{file}: is a folder", IN_THE_WAY)
        elif file not in files and (file == NOMINAL or is_part_file(file)):
            yield Damage(f"{file}: has no line in the journal and does not count", REPAIR)
        elif file not in files:
            yield Damage(f"{file}: is not of this run", AWAY)


def _unfinished(journal: Scan, counted: Receipts, manifest: dict[str, Any] | None) -> Iterator[Damage]:
    """A run that has all its cases, and whose session neither came to its end nor said that it was interrupted."""
    told = [entry.event for entry in journal.entries if entry.event in ("started", "rerun", "finished", "interrupted")]
    if manifest is None or counted.cases is None or not told or told[-1] in ("finished", "interrupted"):
        return
    if not counted.missing(cases_in(manifest, counted.cases)):
        yield Damage(f"{JOURNAL}: all cases are there, and no line says that the run was finished", REPAIR)


def _left_out(run: Path, journal: Scan, counted: Receipts, manifest: dict[str, Any] | None) -> Iterator[Damage]:
    """What a run has that was finished: the nominal case, and its history where the campaign keeps it.

    Which others keep theirs, and whether they have flown at all, only a repair finds out.
    """
    if manifest is None or not journal.entries or journal.entries[-1].event != "finished":
        return
    if counted.nominal is None:
        if not os.path.lexists(run / NOMINAL):
            yield Damage(f"{NOMINAL}: the run was finished, and no line tells of its nominal case", REPAIR)
        return
    is_kept = counted.histories is None and not manifest.get("shard") and _keeps_nominal_history(run)
    if is_kept and not nominal_problems(run, counted.nominal, manifest) and _is_ok(run, counted.nominal):
        yield Damage("history: the run was finished, and no line tells of the history of its nominal case", REPAIR)


def _keeps_nominal_history(run: Path) -> bool:
    try:
        retention = tomllib.loads(read_short(run / CAMPAIGN).decode()).get("retention", {})
        return bool(retention.get("histories", {}).get("nominal", True))
    except (ValueError, AttributeError):  # no campaign at all, which is for whoever flies it to say
        return False


def _is_ok(run: Path, nominal: Part) -> bool:
    return bool(read_part(run, nominal)["status"][0].as_py() == STATUS_NAME[OK])


def _line_problems(journal: Scan, wrong: dict[int, str], busy: bool) -> Iterator[Damage]:
    lines = {number: "" for number in journal.damaged} | {number: f", {why}" for number, why in wrong.items()}
    for number, why in sorted(lines.items()):
        yield Damage(f"{JOURNAL}, line {number}: damaged{why}", REPAIR if number > 1 else ORIGINAL)
    if journal.torn and not busy:
        last = len(journal.entries) + len(journal.damaged) + 1
        yield Damage(f"{JOURNAL}, line {last}: torn; the next writer cuts it off", REPAIR)


def _head_problems(run: Path, journal: Scan) -> list[str]:
    """Manifest and campaign against the digests in the journal's first line."""
    if not journal.entries or journal.entries[0].number != 1 or receipts_of(journal.entries[:1])[1]:
        return [f"{JOURNAL}: its first line, the creation, is lost; {MANIFEST} and {CAMPAIGN} cannot be verified"]
    problems, created = [], journal.entries[0].facts
    for key, name in (("manifest", MANIFEST), ("campaign", CAMPAIGN)):
        try:
            content = read_short(run / name)
            if sha256(content).hexdigest() != created[key]:
                problems.append(f"{name}: damaged or edited, its SHA-256 is not the one in the journal")
            elif name == MANIFEST:
                parse_manifest(content)
        except StoreError as error:
            problems.append(_inner(run, error))
        except ValueError as error:
            problems.append(f"{name}: {error}")
    return problems + companion_problems(run, created)
