"""Copies of run directories on object stores: `publish` and `fetch`.  s3://, gs://, memory://, file://, ...

A run is flown in a local directory, since an object store can neither sync nor rename.  The files that the journal
records are copied: first parts, then campaign and manifest, then the journal, then reports.  The copy is therefore
valid at any moment, also during the flight, and publishing again completes one that was interrupted: only files that
are missing or differ are sent.  Each file is read back, and all are listed, before `publish` returns.  Credentials come
from the environment, as fsspec and its packages read them.
"""

import atexit
import json
import os
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

from mc_engine.durable_file import disk_errors, is_temporary, make_folder, read_file, sync_folder, write_durably
from mc_engine.errors import DiskError, EngineError, StoreError, UsageError
from mc_engine.extras import how_to_install
from mc_engine.interruption import in_threads
from mc_engine.shell_words import shell_word
from mc_engine.store.counted_files import CountedFiles
from mc_engine.store.derived_files import derived_files
from mc_engine.store.journal import Entry, Scan, read_journal, scan
from mc_engine.store.parts import PART_FOLDERS, is_part_file
from mc_engine.store.receipts import receipts_of
from mc_engine.store.run_files import CAMPAIGN, JOURNAL, MANIFEST, SENSITIVITY, is_run_directory, path_of
from mc_engine.store.urls import ON_DISK, is_url, store_url
from mc_engine.store.writer_lock import LOCK_FILES, LOCK_NAME, WriterLock

_INNER = f"{SENSITIVITY}/{JOURNAL}"  # of the flights for sensitivities, a run directory inside the run
AT_ONCE = 8  # files that are sent or read at a time: a store answers many requests in the time of one
PATIENCE = 10.0  # the wait after a copy, in multiples of the time that the copy took


@dataclass(frozen=True)
class Publication:
    """Result of `publish`: names of files and number of bytes sent; kept : number of files that were there already."""

    url: str
    sent: tuple[str, ...]
    sent_bytes: int
    kept: int


def publish(run: Path, url: str, trusting: bool = False) -> Publication:
    """Copy the run in directory `run` to `url`; on return every file is listed there and was read back.

    trusting : compare only the size of files that the journal there records with the same digest; for repeated copies.
    Parts there that the journal no longer records are removed.  StoreError if the store cannot be reached; UsageError
    if it holds anything but an earlier state of this run; EngineError if `url` is incomplete.
    """
    if not is_run_directory(run):
        raise UsageError(f"{run}: is no run directory")
    _refuse_inside(run, url)
    derived, verify = derived_files(run), f"`mc-engine verify {shell_word(run)}` names all damage"
    with _naming(verify):
        journal = _sound(scan(read_journal(run / JOURNAL)), run / JOURNAL)
        counted, made = _counted(journal.entries), derived.read_with_journal()
        if (run / _INNER).exists() and not (run / SENSITIVITY).is_symlink():
            inner = _sound(scan(content := read_journal(run / _INNER)), run / _INNER)
            counted |= _counted_inside(inner)
            made[_INNER] = content[: inner.length]
    contents = {**counted, JOURNAL: None, **dict.fromkeys(_others(run, counted, derived)), **made}
    with _reaching(url):
        remote = _Remote(url)
        before = remote.journal()
        _refuse_another_run(run, remote, before, journal, set(contents))
        trusted = _counted(before.entries) if before is not None and trusting else {}

        def send(name: str) -> tuple[int, bool]:
            """Size of a file, and whether it was sent."""
            with _naming(verify):
                content = made[name] if name in made else read_file(run / name)
                if name == JOURNAL:
                    content = content[: journal.length]  # the run may have added lines since
                digest = sha256(content).hexdigest()
                if counted.get(name, digest) != digest:
                    raise StoreError(f"{run / name}: damaged, its SHA-256 is not the one in the journal")
            is_there = remote.holds(name, content, trusted.get(name) == digest)
            if not is_there:
                remote.write(name, content)
            return len(content), not is_there

        results: dict[str, tuple[int, bool]] = {}
        others = [name for name in contents if name not in counted and name != JOURNAL]
        for names in ([*counted], [JOURNAL], others):  # one after the other, so that the copy is valid
            results |= zip(names, in_threads(send, names, AT_ONCE), strict=True)
        for name in remote.sizes:
            if (is_part_file(name) or derived.are_called(name)) and name not in contents:
                remote.remove(name)
        listed = remote.listed()
    if lost := [name for name, (size, _) in results.items() if listed.get(name) != size]:
        raise StoreError(f"{remote.url}/{lost[0]}: was sent and is not there; publish again")
    sent = {name: size for name, (size, was_sent) in results.items() if was_sent}
    return Publication(remote.url, tuple(sent), sum(sent.values()), len(contents) - len(sent))


def fetch(url: str, folder: Path) -> Path:
    """Copy the run at `url` to the new directory `folder`, with its reports; the checksum of every part is verified.

    The copy is made under a temporary name, so that one that fails leaves no `folder`.  The next `fetch` removes what a
    killed one left.  UsageError if `folder` is not empty or the URL holds no run.
    """
    url = store_url(url)
    if folder.exists() and any(folder.iterdir()):
        raise UsageError(f"{folder}: is not empty; choose another folder")
    with _scratch(folder) as scratch:
        _copy(url, scratch)
        with disk_errors(folder):
            if folder.exists():
                folder.rmdir()
            os.replace(scratch, folder)
        sync_folder(folder.parent)
    return folder


@contextmanager
def _scratch(folder: Path) -> Iterator[Path]:
    """A temporary folder next to `folder`; those of this user that killed processes left there are removed."""
    prefix, suffix = f".{folder.name}.", ".tmp"
    make_folder(folder.parent)
    with disk_errors(folder):
        alike = [path for path in folder.parent.iterdir() if path.name.startswith(prefix) and path.suffix == suffix]
        own = Path(tempfile.mkdtemp(prefix=prefix, suffix=suffix, dir=folder.parent))
    with _locked(own):
        for other in alike:
            with suppress(OSError, StoreError):  # refused if its process is still running
                if other.lstat().st_uid == own.stat().st_uid and (other / LOCK_NAME).exists():  # else it just begins
                    with _locked(other):
                        pass
        yield own / "run"


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Lock a folder within the block, and remove it at the end."""
    lock = WriterLock(folder)
    lock.acquire()
    try:
        yield
    finally:
        lock.release()
        shutil.rmtree(folder, ignore_errors=True)


def _copy(url: str, folder: Path) -> None:
    """Copy the files of the run at a URL, its journal last; StoreError for a damaged one."""
    with _reaching(url):
        remote = _Remote(url)
        again = f"`mc-engine publish RUN {shell_word(remote.url)}` sends it again from the run's own directory"
        with _naming(again):
            journal = remote.journal()
            if journal is None:
                send = f"`mc-engine publish RUN {shell_word(remote.url)}` sends one"
                raise UsageError(f"{remote.url}: holds no run; {send}")
            counted = _counted(_sound(journal, f"{remote.url}/{JOURNAL}").entries)
            if _INNER in remote.sizes:
                counted |= _counted_inside(_sound(scan(remote.read(_INNER)), f"{remote.url}/{_INNER}"))
        others = [name for name in remote.sizes if name not in counted and name != JOURNAL and not is_part_file(name)]

        def get(name: str) -> None:
            with _naming(again):
                if name not in remote.sizes:
                    raise StoreError(f"{remote.url}/{name}: is not there")
                content = remote.read(name)
                if counted.get(name, "") not in ("", sha256(content).hexdigest()):
                    raise StoreError(f"{remote.url}/{name}: damaged, its SHA-256 is not the one in the journal")
            _write_fetched(folder, name, content, url)

        in_threads(get, [*counted, *others], AT_ONCE)
        _write_fetched(folder, JOURNAL, remote.read(JOURNAL)[: journal.length], url)
    for run in (folder, folder / SENSITIVITY):
        for part_folder in PART_FOLDERS if (run / JOURNAL).exists() else ():
            make_folder(run / part_folder)  # an object store has no empty folders


_copies: list[Path] = []  # the folder of this process for them


def local_copy(place: str | Path) -> Path:
    """The directory `place`; for a URL, a copy that is removed when this process ends.

    If it is killed, the next process that makes one removes it.
    """
    path = path_of(place, "a run is opened by its path or URL, and {} is neither")
    if not is_url(place):
        return path
    if not _copies or not _copies[-1].is_dir():
        until_the_end = ExitStack()
        atexit.register(until_the_end.close)
        _copies.append(until_the_end.enter_context(_scratch(Path(tempfile.gettempdir()) / "mc-engine")).parent)
    scratch = Path(tempfile.mkdtemp(dir=_copies[-1]))
    return fetch(str(place), scratch / str(place).rstrip("/").rpartition("/")[2])


def refuse_publication(url: str, run: Path | None) -> None:
    """Refuse a URL to which `run` cannot be copied; called before a long flight.

    run : an existing run directory; None for a run that has not begun
    StoreError if `url` cannot be listed; UsageError if it holds another run, or a later state of this one.
    """
    with _reaching(url):
        remote = _Remote(url)
        if (before := remote.journal()) is None:
            return
        if run is None:
            raise UsageError(f"{remote.url}: holds another run; choose another place")
        _refuse_another_run(run, remote, before, scan(read_journal(run / JOURNAL)), set())


def _counted(entries: tuple[Entry, ...]) -> dict[str, str]:
    """SHA-256 by name of the files that the journal records, in the order in which they are sent."""
    created = entries[0].facts
    heads = {**created.get("companions", {}), CAMPAIGN: created["campaign"], MANIFEST: created["manifest"]}
    return {**{part.file: part.sha256 for part in receipts_of(entries)[0].all_parts()}, **heads}


def _counted_inside(journal: Scan) -> dict[str, str]:
    """The same of the flights for sensitivities, by their own journal."""
    return {f"{SENSITIVITY}/{name}": digest for name, digest in _counted(journal.entries).items()}


def _others(run: Path, counted: Mapping[str, str], derived: CountedFiles) -> list[str]:
    """Names of the other files in the run directory: no parts, reports, replays, locks or temporary files."""
    paths = [path for path in sorted(run.rglob("*")) if path.is_file() and not path.is_symlink()]
    files = [path.relative_to(run).as_posix() for path in paths]
    ours = {*counted, JOURNAL, *LOCK_FILES}
    left = [name for name in files if name not in ours and not is_part_file(name) and not derived.are_called(name)]
    return [name for name in left if not is_temporary(Path(name).name)]


def _refuse_inside(run: Path, url: str) -> None:
    scheme, _, place = store_url(url).partition("://")
    if scheme in ON_DISK and Path(place).resolve().is_relative_to(run.resolve()):
        raise UsageError(f"{url}: lies in {run} itself, and each copy would hold the one before; choose another place")


def _sound(journal: Scan, place: Path | str) -> Scan:
    """The journal itself; StoreError if a line of it is damaged."""
    if journal.damaged or not journal.entries or journal.entries[0].event != "created":
        raise StoreError(f"{place}, line {journal.damaged[0] if journal.damaged else 1}: damaged")
    for number, why in receipts_of(journal.entries)[1].items():
        raise StoreError(f"{place}, line {number}: damaged, {why}")
    return journal


def _refuse_another_run(run: Path, remote: "_Remote", before: Scan | None, journal: Scan, ours: set[str]) -> None:
    if before is not None:
        if not before.entries or before.entries[0].number > 1:
            lost = f"{remote.url}/{JOURNAL}, line 1: damaged, and it alone says whose copy this is"
            raise StoreError(f"{lost}; if it is one of {run}, remove that file and publish again")
        theirs = before.entries[0]
        if (theirs.at, theirs.facts) != (journal.entries[0].at, journal.entries[0].facts):
            raise UsageError(f"{remote.url}: holds another run; choose another place")
        if before.length > journal.length:
            raise UsageError(f"{remote.url}: holds a later state of this run; fetch that one")
    elif foreign := sorted(set(remote.sizes) - ours):
        held = f"holds {foreign[0]} and no run" if foreign[0] else "is a file"
        raise UsageError(f"{remote.url}: {held}; choose another place")


def _write_fetched(folder: Path, name: str, content: bytes, url: str) -> None:
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):  # an object store may hold any names
        raise StoreError(f"{url}: {json.dumps(name)} lies outside the run")
    make_folder(path.parent)
    write_durably(path, content)


@contextmanager
def _naming(next_step: str) -> Iterator[None]:
    """Add the next step to the message for a file that is missing or damaged."""
    try:
        yield
    except (DiskError, UsageError):
        raise
    except StoreError as error:
        raise StoreError(f"{error}; {next_step}") from error


class _Remote:
    """The objects below a URL.  sizes : their lengths by name, as listed when this object was made; -1 if not told."""

    def __init__(self, url: str):
        from fsspec.core import url_to_fs

        self.url = store_url(url)
        self._files, root = url_to_fs(self.url, use_listings_cache=False)
        self._root = str(root).rstrip("/")
        with suppress(FileNotFoundError, NotADirectoryError):
            self._files.ls(self._root)  # an error where the store does not answer; `find` would list nothing
        self.sizes = self.listed()

    def listed(self) -> dict[str, int]:
        """Lengths by name of the objects at this moment; -1 where the store, such as a web server, tells none."""
        self._files.invalidate_cache()
        listed: dict[str, dict[str, Any]] = self._files.find(self._root, detail=True)
        sizes = {path: facts["size"] for path, facts in listed.items()}
        return {path[len(self._root) :].lstrip("/"): -1 if size is None else int(size) for path, size in sizes.items()}

    def journal(self) -> Scan | None:
        """The journal at the URL, with lines that may be damaged; None if there is none."""
        if JOURNAL not in self.sizes:
            return None
        journal = scan(self.read(JOURNAL))
        if not journal.entries and not journal.damaged:  # sending was interrupted within the first line
            return None
        return journal

    def read(self, name: str) -> bytes:
        return bytes(self._files.cat_file(f"{self._root}/{name}"))

    def holds(self, name: str, content: bytes, trusted: bool) -> bool:
        """True if the object has this content.  trusted : compare its length only."""
        return self.sizes.get(name) == len(content) and (trusted or self.read(name) == content)

    def write(self, name: str, content: bytes) -> None:
        path = f"{self._root}/{name}"
        self._files.makedirs(path.rpartition("/")[0], exist_ok=True)  # no effect in stores without folders
        self._files.pipe_file(path, content)
        if self.read(name) != content:
            raise StoreError(f"{self.url}/{name}: the content there differs from what was sent; publish again")

    def remove(self, name: str) -> None:
        self._files.rm_file(f"{self._root}/{name}")


@contextmanager
def _reaching(url: str) -> Iterator[None]:
    """Turn any error of a store's package into a StoreError that begins with the URL."""
    try:
        yield
    except EngineError:
        raise
    except ImportError as error:
        ours = url.startswith("s3") or "fsspec" in str(error)  # of other stores fsspec names the package itself
        how = f"; {how_to_install('cloud')}" if ours else ""
        raise UsageError(f"{url}: needs a package: {error}{how}") from error
    except TimeoutError as error:
        raise StoreError(f"{url}: the store has not answered in time") from error
    except Exception as error:  # each store's package has its own errors
        raise StoreError(f"{url}: {type(error).__name__}: {error}") from error


class Publisher:
    """Within a `with` block, copies the committed state of `run` to `url`, every `every_s` seconds and at the end.

    A copy that fails is tried again at the next interval and does not stop the flight; the error of the last copy is
    written to standard error.
    """

    def __init__(self, run: Path, url: str, every_s: float = 30.0):
        _refuse_inside(run, url)
        self._run, self._url, self._every_s = run, store_url(url), every_s
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._keep_up, name="publisher", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._done.set()
        self._thread.join()
        if trouble := self._copy():
            print(f"not published: {trouble}", file=sys.stderr)

    def _keep_up(self) -> None:
        wait_s = self._every_s
        while not self._done.wait(wait_s):
            begin = time.monotonic()
            self._copy()
            wait_s = max(self._every_s, PATIENCE * (time.monotonic() - begin))

    def _copy(self) -> EngineError | None:
        if is_run_directory(self._run):
            try:
                publish(self._run, self._url, trusting=True)
            except EngineError as error:
                return error
        return None
