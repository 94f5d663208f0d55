"""The command on what sources print: published."""

from pathlib import Path
from typing import Annotated

import typer

from mc_engine.command_line.app import app, exit_status, new_file


def _campaigns_with_sources(incomplete: str) -> list[str]:
    from mc_engine.studies.published_table import published_files

    return [path.parent.name for path in published_files() if path.parent.name.startswith(incomplete)]


@app.command()
@exit_status()
def published(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME]...",
            help="Campaigns, for all values of their sources.",
            autocompletion=_campaigns_with_sources,
        ),
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option(
            parser=new_file,
            metavar="FILE",
            help="Put it into a Markdown file, between <!-- published --> and <!-- end -->.",
        ),
    ] = None,
) -> None:
    """Published values beside ours, as Markdown, each marked reached, not reached (why) or unknown.

    Without a name: how many there are of each in the shipped campaigns, and the headline numbers.
    """
    from mc_engine.durable_file import write_durably
    from mc_engine.studies.published_table import (
        campaign_table,
        headline_table,
        published_file,
        published_files,
        written_into,
    )

    tables = [campaign_table(published_file(name)) for name in names or ()]
    text = "\n\n".join(tables or [headline_table(published_files())])
    if write is None:
        typer.echo(text)
    else:
        write_durably(write, written_into(write, text).encode())
