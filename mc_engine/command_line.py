"""What all verbs of the command line share: the application, exit statuses, kinds of arguments.

Exit status: 0 done, 1 a requirement is not met (`run --judge`), 2 usage or campaign file, 3 more failed cases than
allowed (`run --max-failed`), 4 interrupted or the disk full, and resumable, 5 store damaged or busy.
"""

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from mc_engine.errors import DiskError, EngineError, RunInterrupted, StoreError

if TYPE_CHECKING:
    from mc_engine.store import Store

NOT_MET, USAGE, TOO_MANY_FAILED, INTERRUPTED, DAMAGED = 1, 2, 3, 4, 5

app = typer.Typer(
    help="Monte Carlo dispersion campaigns for spacecraft guidance, navigation and control.",
    no_args_is_help=True,
    rich_markup_mode=None,  # plain help: rich's would take twice as long to load as all else
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 120},
)


def campaigns_beginning(incomplete: str) -> list[str]:
    """What the shell offers for a campaign: shipped names, folders with a campaign, and .toml files."""
    from mc_engine.campaign_search import campaign_names, campaign_paths

    return [name for name in (*campaign_names(), *campaign_paths(incomplete)) if name.startswith(incomplete)]


CampaignFile = Annotated[
    str,
    typer.Argument(
        metavar="FILE_OR_NAME",
        help="A campaign file, its folder, or a shipped name such as deorbit.",
        autocompletion=campaigns_beginning,
    ),
]
RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="The directory of a run.")]
Cases = Annotated[int | None, typer.Option(min=1, help="Number of cases, in place of the file's.")]
Workers = Annotated[int | None, typer.Option(min=1, help="Threads or processes that fly cases; all cores by default.")]
BackendName = Annotated[
    str, typer.Option("--backend", metavar="NAME", help="Who flies: threading, loky (processes), dask (a cluster).")
]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="With dask: a scheduler such as tcp://node1:8786.")
]
CaseSeconds = Annotated[
    float | None, typer.Option(min=0.1, help="With loky or dask: give a case up that takes longer.")
]
Memory = Annotated[int | None, typer.Option(min=512, metavar="MIB", help="With loky or dask: memory of a worker.")]
Publish = Annotated[
    str | None,
    typer.Option(metavar="URL", help="Keep a copy, such as s3://bucket/prefix, up to date while the run flies."),
]
NoReport = Annotated[bool, typer.Option("--no-report", help="Leave the reports out.")]


@contextmanager
def exit_status() -> Iterator[None]:
    """Turn what the engine raises on purpose into its sentence on stderr and an exit status."""
    try:
        yield
    except (RunInterrupted, DiskError) as error:  # a disk may have room again
        leave(INTERRUPTED, str(error))
    except StoreError as error:
        leave(DAMAGED, str(error))
    except EngineError as error:  # of the campaign, the model, or a package that is missing
        leave(USAGE, str(error))
    except KeyboardInterrupt:
        leave(INTERRUPTED, "interrupted")
    except OSError as error:
        leave(USAGE, f"{error.filename}: {error.strerror}" if error.filename else str(error))


def leave(status: int, message: str) -> NoReturn:
    typer.echo(message, err=True)
    raise typer.Exit(status) from None


def existing_run(path: Path) -> "Store":
    """The run in `path`; a path that never was a run is a slip of the user's, not damage."""
    from mc_engine.store import is_run_directory, open_store

    if not path.exists():
        leave(USAGE, f"{path}: there is no such folder")
    if not is_run_directory(path):
        leave(USAGE, f"{path}: is no run directory; `mc-engine run` makes one")
    return open_store(path)


def counted(things: Any, word: str) -> str:
    return f"{len(things)} {word}{'' if len(things) == 1 else 's'}"


def ranges(ranges: list[tuple[int, int]]) -> str:
    return ", ".join(f"{first} to {stop - 1}" for first, stop in ranges) or "none"


def write_reports(path: Path, formats: tuple[str, ...], **more: Any) -> list[Path]:
    # The engine imports nothing of the reports, so that it can be used and tested without them; only this verb,
    # which exists for the user's convenience, looks for them, and at the moment they are asked for.
    return importlib.import_module("reports").write_reports(path, formats=formats, **more)
