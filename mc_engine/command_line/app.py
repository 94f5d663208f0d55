"""The application of the command line, and what its commands share: exit statuses, arguments, checks of paths.

Exit status: 0 done, 1 a requirement is not met (`run --judge`) or something has changed (`compare`), 2 wrong usage or
invalid campaign, 3 more failed cases than allowed (`run --max-failed`), 4 interrupted or disk full, can be resumed,
5 directory damaged or busy, replay differs, or object store unreachable, 6 unexpected error or out of memory, with a
log file.
"""

import errno
import importlib
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from copy import copy
from functools import partial
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from mc_engine.command_line.next_step import after_merge
from mc_engine.errors import DiskError, EngineError, RunInterrupted, StoreError, UsageError
from mc_engine.interruption import INTERRUPTED, interruption_message, signalled, under_way
from mc_engine.numbers_in_text import LARGEST_WHOLE, counted, is_real, is_whole
from mc_engine.shell_words import shell_word
from mc_engine.store.run_files import JOURNAL, NO_TEXT, RUN, is_run_directory, kind_of, readable, runs_in
from mc_engine.store.urls import is_url, store_url
from mc_engine.unforeseen import UNFORESEEN, unforeseen

if TYPE_CHECKING:
    from mc_engine.store.store import Store

NOT_MET, USAGE, TOO_MANY_FAILED, DAMAGED = 1, 2, 3, 5  # and INTERRUPTED, 4
_RECORDED = (".json", ".jsonl", ".parquet", ".toml")  # what a directory of results has beside its reports


class _Commands(TyperGroup):
    """The commands; their options accept numbers only in the syntax of `numbers_in_text`."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        command = super().get_command(ctx, cmd_name)
        for param in command.params if command is not None else ():
            kind = copy(param.type)
            if kind.name.startswith(("int", "float")):
                kind.convert = partial(_converted, param.type)  # type: ignore[method-assign]
                param.type = kind
        return command


def _converted(kind: Any, value: Any, param: Any, ctx: Any) -> Any:
    whole = kind.name.startswith("int")
    if isinstance(value, str) and not (is_whole(value) if whole else is_real(value) and isfinite(float(value))):
        if value.startswith("--"):  # an unknown option where a command takes numbers below zero
            kind.fail(f"{value!a} is no option of this command; give the number alone", param, ctx)
        most = f" in digits alone, such as 10000, of at most {LARGEST_WHOLE}" if whole else ", such as 0.5 or 1e-3"
        kind.fail(f"{value!a} is not a {'whole ' if whole else ''}number{most}", param, ctx)
    return kind.convert(value, param, ctx)


app = typer.Typer(
    cls=_Commands,
    help="Monte Carlo dispersion campaigns for spacecraft guidance, navigation and control.",
    epilog="Exit status: 0 done, 1 a requirement not met or a change found, 2 wrong usage or invalid campaign, 3 too "
    "many failed cases, 4 interrupted or disk full, 5 directory damaged or busy, replay differs, or object store "
    "unreachable, 6 unexpected error or out of memory.",
    no_args_is_help=True,
    rich_markup_mode=None,  # plain help: importing rich takes longer than all the rest
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120},
)


def beginning(words: Iterable[str]) -> Callable[[str], list[str]]:
    """Shell completion from these words."""
    return lambda incomplete: [word for word in words if word.startswith(incomplete)]


def campaigns_beginning(incomplete: str) -> list[str]:
    """Shell completion of a campaign: shipped names, folders with a campaign, and .toml files."""
    from mc_engine.campaign.search import campaign_names, campaign_paths

    return [name for name in (*campaign_names(), *campaign_paths(incomplete)) if name.startswith(incomplete)]


CampaignFile = Annotated[
    str,
    typer.Argument(
        metavar="FILE_OR_NAME",
        help="A campaign file, its folder, or a shipped name such as deorbit.",
        autocompletion=campaigns_beginning,
    ),
]


# Parsers of arguments: they get the text before it becomes a Path, which would change a URL.
def object_store(text: str) -> str:
    try:
        return store_url(text)
    except EngineError as error:
        leave(USAGE, str(error))


def _on_disk(text: str, instead: str) -> Path:
    if is_url(text):
        url = object_store(text)
        leave(USAGE, f"{url}: is a URL, and a local path is needed here; {instead.format(shell_word(url))}")
    if text != readable(text):
        leave(USAGE, f"{readable(text)}: {NO_TEXT}")
    if not text:
        leave(USAGE, "a name is empty where a folder or a file has to be named; write . for the working folder")
    return Path(text)


def run_here(text: str) -> Path:
    return _on_disk(text, "`mc-engine fetch {} DIR` makes a directory of it, and --publish keeps it up to date")


def new_folder(text: str) -> Path:
    return _on_disk(text, "fly into a folder, and --publish {} or `mc-engine publish` keeps a copy up there")


def new_file(text: str) -> Path:
    return _on_disk(text, "name a file here, and copy it from there")


RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="The directory of a run.", parser=run_here)]
RunPlace = Annotated[str, typer.Argument(metavar="RUN", help="The directory of a run, or the URL of a published one.")]
Cases = Annotated[int | None, typer.Option(min=1, help="Number of cases, in place of the file's.")]
Workers = Annotated[
    int | None, typer.Option(min=1, max=100_000, help="Threads or processes that fly cases; all cores by default.")
]
BackendName = Annotated[
    str,
    typer.Option(
        "--backend",
        metavar="NAME",
        help="Where cases fly: threading, loky (processes), dask (a cluster), cuda (NVIDIA cards), auto.",
        autocompletion=beginning(("threading", "loky", "dask", "cuda", "auto")),
    ),
]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="With dask: the scheduler, such as tcp://node1:8786.")
]
CaseSeconds = Annotated[
    float | None, typer.Option(min=0.1, max=1e8, help="With loky or dask: give up a case that takes longer.")
]
Memory = Annotated[
    int | None, typer.Option(min=512, max=2**30, metavar="MIB", help="With loky or dask: most memory of a worker.")
]
Patience = Annotated[
    float | None,
    typer.Option(
        min=1.0, max=1e8, metavar="S", help="With dask: give up after this time without a worker; by default 300 s."
    ),
]
Publish = Annotated[
    str | None,
    typer.Option(metavar="URL", parser=object_store, help="Update a copy, such as s3://bucket/x, during the run."),
]
NoReport = Annotated[bool, typer.Option("--no-report", help="Write no reports.")]


@contextmanager
def exit_status() -> Iterator[None]:
    """Turn every error into a message on standard error and an exit status."""
    try:
        with under_way():
            yield
    except (RunInterrupted, DiskError) as error:  # both can be resumed
        leave(INTERRUPTED, str(error))
    except UsageError as error:
        leave(USAGE, str(error))
    except StoreError as error:
        leave(DAMAGED, str(error))
    except EngineError as error:  # of the campaign, the model, or a package that is missing
        leave(USAGE, str(error))
    except KeyboardInterrupt:
        leave(INTERRUPTED, interruption_message())
    except OSError as error:
        if error.errno == errno.ENOMEM:
            leave(UNFORESEEN, unforeseen(error))
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        leave(INTERRUPTED if full else USAGE, f"{error.filename}: {error.strerror}" if error.filename else str(error))
    except (typer.Exit, typer.Abort, typer.BadParameter, SystemExit):
        raise
    except BaseException as error:  # a panic of a Rust library is no Exception
        if signalled():
            leave(INTERRUPTED, interruption_message())
        leave(UNFORESEEN, unforeseen(error))


def leave(status: int, message: str) -> NoReturn:
    typer.echo(message, err=True)
    raise typer.Exit(status) from None


def existing_run(path: Path) -> "Store":
    """The run in `path`.  A path that is no run directory is wrong usage, not damage."""
    from mc_engine.store.opening import open_store

    _refuse_unreadable(path)
    if not is_run_directory(path):
        leave(USAGE, f"{path}: {_no_run(path)}")
    return open_store(path)


def _no_run(path: Path) -> str:
    """Why a path is no run directory, and what to do."""
    from mc_engine.campaign.search import campaign_names

    if kind := kind_of(path):
        return f"holds a {kind} and no run; `mc-engine status {shell_word(path)}` shows what was found"
    if str(path) in campaign_names():
        return f"is a campaign and no run; `mc-engine run {shell_word(path)}` flies it"
    if not path.exists():
        return "there is no such folder; `mc-engine run` makes one"
    if path.is_file() and kind_of(path.parent):
        return f"is a file of a {kind_of(path.parent)}; name its directory, {path.parent}"
    if runs := runs_in(path):
        return f"is no run directory; it holds {counted(len(runs), 'run')}, the latest is {runs[-1]}"
    return "is no run directory; `mc-engine run` makes one"


def run_at(place: str) -> Path:
    """The directory `place`; for a URL, a copy that is removed when this process ends."""
    from mc_engine.store.object_store import local_copy

    folder = local_copy(place)
    _refuse_unreadable(folder)
    return folder


def _refuse_unreadable(path: Path) -> None:
    if os.path.isdir(path) and not os.access(path, os.R_OK | os.X_OK):
        leave(USAGE, f"{path}: is a folder that this user may not read")


def refuse_occupied_folder(path: Path, option: str = "--out ") -> None:
    """End the command if the new folder is occupied or cannot be written to; called before anything is compiled.

    option : what the sentence begins with; empty where the folder is an argument
    """
    from mc_engine.store.opening import open_store
    from mc_engine.store.store import refuse_occupied
    from mc_engine.store.writer_lock import LOCK_NAME

    if (path / JOURNAL).exists() and is_run_directory(path) and open_store(path).missing():
        advice = after_merge(path) or f"`mc-engine resume {shell_word(path)}` flies the rest"
        leave(USAGE, f"{option}{path}: holds a run that is not complete; {advice}")
    # With a lock file and no journal, a creation was interrupted; `create_store` knows which files it may have left.
    complete = (path / JOURNAL).exists() or kind_of(path) not in (None, RUN)
    if complete or not (path / LOCK_NAME).exists():
        try:
            refuse_occupied(path)
        except StoreError as error:
            leave(USAGE, f"{option}{error}")
    if run := next((parent for parent in path.absolute().parents if os.path.isfile(parent / JOURNAL)), None):
        leave(USAGE, f"{option}{path}: lies inside the {kind_of(run)} {run.name}; choose another folder")
    refuse_unwritable_folder(path, option)


def refuse_unwritable_folder(path: Path, option: str = "--out ") -> None:
    """End the command unless `path` is a writable folder, or one can be made there."""
    existing = next(folder for folder in (path, *path.absolute().parents) if os.path.lexists(folder))
    if not existing.exists():
        leave(USAGE, f"{option}{path}: {existing} is a symbolic link to {os.readlink(existing)}, which is not there")
    if not (existing.is_dir() and os.access(existing, os.W_OK)):
        leave(USAGE, f"{option}{path}: {existing} is no folder that can be written to")


def refuse_unwritable_file(option: str, path: Path) -> None:
    """End the command if no file can be made at `path`; called before the work whose result it will hold."""
    if not path.parent.is_dir():
        leave(USAGE, f"{option} {path}: there is no folder {path.parent}")
    if path.is_dir():
        leave(USAGE, f"{option} {path}: is a folder; name a file")
    if os.path.lexists(path) and (path.is_symlink() or not path.is_file()):  # /dev/null would become a file for all
        leave(USAGE, f"{option} {path}: is a link, a device or a pipe, and would be replaced; name a file")
    if not os.access(path.parent, os.W_OK):
        leave(USAGE, f"{option} {path}: this user may not write to the folder {path.parent}; name a file elsewhere")
    file = path.resolve()
    inside = next((folder for folder in file.parents if (folder / JOURNAL).is_file()), None)
    if inside is not None and file.parent != inside:  # readers take all files in `cases` for cases
        leave(USAGE, f"{option} {path}: lies in a folder of the {kind_of(inside)} {inside.name}; name a file elsewhere")
    if inside is not None and path.exists() and (file.stem == "report" or file.suffix in _RECORDED):
        leave(USAGE, f"{option} {path}: is a file of the {kind_of(inside)} {inside.name}; name another")


def ranges(ranges: list[tuple[int, int]]) -> str:
    return ", ".join(f"{first} to {stop - 1}" for first, stop in ranges) or "none"


def write_reports(path: Path, formats: tuple[str, ...], **options: Any) -> list[Path]:
    """Write the reports of a run.  The engine works without the package of reports, which is imported only here."""
    try:
        return importlib.import_module("reports").write_reports(path, formats=formats, **options)
    except DiskError as error:
        report = f"`mc-engine report {shell_word(path)}`"
        raise DiskError(f"{error}; what was flown is safe, {report} writes the reports") from error


def echo_preparation(system: Any) -> None:
    """Print that a model may have to be compiled; nothing for a simulator.

    system : a Model, a Simulator, or the folder of a run.
    """
    from mc_engine.model.record import Model
    from mc_engine.runner.summary import is_compiled

    if isinstance(system, Model) or (isinstance(system, Path) and is_compiled(existing_run(system))):
        typer.echo("preparing; a model that is new takes some seconds to compile", err=True)


def replay_picture(store: Any, case: int, history: Any) -> bytes:
    """A PNG of the case's history with nominal, envelopes and limits, in the style of the reports."""
    return bytes(importlib.import_module("reports").replay_picture(store, case, history))
