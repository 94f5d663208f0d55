"""The command on what sources print: published."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import Annotated

import typer

from mc_engine.command_line.app import USAGE, app, exit_status, leave, new_file
from mc_engine.interruption import NOTHING_BEGUN, advise

_SECONDS_BETWEEN_LINES = 2.0


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
    compute: Annotated[
        bool, typer.Option("--compute", help="Compute our values anew; runs code of the campaigns.")
    ] = False,
    no_slow: Annotated[
        bool, typer.Option("--no-slow", help="With --compute: take the kept values of the slow records.")
    ] = False,
    update_lock: Annotated[
        bool, typer.Option("--update-lock", help="With --compute: keep the values, in published.lock.toml.")
    ] = False,
    write: Annotated[
        Path | None,
        typer.Option(
            parser=new_file,
            metavar="FILE",
            help="Put it into a Markdown file, between <!-- published --> and <!-- end -->.",
        ),
    ] = None,
) -> None:
    """Published values beside ours, as Markdown, each with its outcome: reached, close, improved, not reached, unknown.

    Without a name: how many there are of each in the shipped campaigns, and the headline numbers.  Ours are the kept
    values of `published.lock.toml` unless --compute is given.
    """
    from mc_engine.durable_file import write_durably
    from mc_engine.studies.published_table import (
        campaign_table,
        headline_table,
        published_file,
        published_files,
        written_into,
    )

    if (no_slow or update_lock) and not compute:
        leave(USAGE, f"--{'no-slow' if no_slow else 'update-lock'} is for --compute")
    if compute and not names:
        leave(USAGE, "--compute needs the NAME of a campaign")
    tables = []
    for name in names or ():
        path = published_file(name)
        tables.append(campaign_table(path, _computed(path, not no_slow, update_lock) if compute else None))
    text = "\n\n".join(tables or [headline_table(published_files())])
    if write is None:
        typer.echo(text)
    else:
        write_durably(write, written_into(write, text).encode())


def _computed(path: Path, slow: bool, update_lock: bool) -> dict[str, float | str]:
    """Our values, computed now; says on stderr which differ from the kept ones."""
    advise(lambda: NOTHING_BEGUN)
    from mc_engine.studies.published import differing, kept_values, read_published
    from mc_engine.studies.published_values import computed_values, write_lock

    records, kept = read_published(path), kept_values(path)
    with _progress() as progress:
        values = computed_values(path, slow=slow, progress=progress)
    if not slow:
        values |= {
            record["quantity"]: kept[record["quantity"]]
            for record in records
            if record.get("slow") and record["quantity"] in kept
        }
    for quantity in differing(records, values, kept) if kept else ():
        typer.echo(f"{quantity}: {values.get(quantity, 'none')}, kept is {kept.get(quantity, 'none')}", err=True)
    if update_lock:
        typer.echo(f"kept in {write_lock(path, values, records).name}", err=True)
    return values


@contextmanager
def _progress() -> Iterator[Callable[[int, int, str], None]]:
    """A call that writes a line on stderr now and then, and how long all took in the end."""
    begin = last_line = monotonic()
    total = 0

    def progress(done: int, in_all: int, quantity: str) -> None:
        nonlocal last_line, total
        total = in_all
        if done == 0 or monotonic() - last_line >= _SECONDS_BETWEEN_LINES:
            last_line = monotonic()
            typer.echo(f"{done} of {in_all} values, now {quantity}", err=True)

    yield progress
    typer.echo(f"{total} values in {monotonic() - begin:.1f} s", err=True)
