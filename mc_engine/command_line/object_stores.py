"""The commands that take runs to object stores and back: publish, fetch."""

from pathlib import Path
from typing import Annotated

import typer

from mc_engine.command_line.app import RunFolder, app, counted, existing_run, exit_status, new_file, object_store
from mc_engine.interruption import advise
from mc_engine.shell_words import shell_word

Url = Annotated[str, typer.Argument(metavar="URL", help="Such as s3://bucket/runs/deorbit.", parser=object_store)]


@app.command()
@exit_status()
def publish(folder: RunFolder, url: Url) -> None:
    """Copy a run to an object store; only what is missing there or differs travels (needs fsspec, s3fs)."""
    advise(lambda: f"interrupted; `mc-engine publish {shell_word(folder)} {shell_word(url)}` sends the rest")
    existing_run(folder)
    echo_publication(folder, url)


def echo_publication(folder: Path, url: str) -> None:
    """Publish the run, and say what was sent."""
    from mc_engine.store.object_store import publish

    done = publish(folder, url)
    files = counted(done.sent, "file")
    typer.echo(f"published    {done.url}: {files}, {done.sent_bytes:,} bytes; {done.kept} were there")


@app.command()
@exit_status()
def fetch(
    url: Url, folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where the copy is to be.", parser=new_file)]
) -> None:
    """Copy a run from an object store to a new directory; the checksum of every part is verified."""
    from mc_engine.store.object_store import fetch

    typer.echo(f"run          {fetch(url, folder)}")
