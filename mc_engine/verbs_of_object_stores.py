"""The verbs that take runs to object stores and back: publish, fetch."""

from pathlib import Path
from typing import Annotated

import typer

from mc_engine.command_line import USAGE, RunFolder, app, counted, existing_run, exit_status, is_url, leave, new_file
from mc_engine.interruption import advise
from mc_engine.shell_words import shell_word

Url = Annotated[str, typer.Argument(metavar="URL", help="Such as s3://bucket/runs/deorbit.")]


@app.command()
@exit_status()
def publish(folder: RunFolder, url: Url) -> None:
    """Copy a run to an object store; only what is missing there or differs travels (needs fsspec, s3fs)."""
    advise(lambda: f"interrupted; `mc-engine publish {shell_word(folder)} {shell_word(url)}` sends the rest")
    existing_run(folder)
    echo_publication(folder, url)


def echo_publication(folder: Path, url: str) -> None:
    """Publish the run, and say what was sent."""
    from mc_engine.object_store import publish

    refuse_path(url)
    done = publish(folder, url)
    typer.echo(f"published    {url}: {counted(done.sent, 'file')}, {done.sent_bytes:,} bytes; {done.kept} were there")


def refuse_path(url: str) -> None:
    """A local path in place of a URL is a slip of the user's."""
    if not is_url(url):
        leave(USAGE, f"{url}: is no URL such as s3://bucket/runs/deorbit")


@app.command()
@exit_status()
def fetch(
    url: Url, folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where the copy is to be.", parser=new_file)]
) -> None:
    """Copy a run from an object store to a new directory; every part is held against its journal."""
    from mc_engine.object_store import fetch

    refuse_path(url)
    typer.echo(f"run          {fetch(url, folder)}")
