"""The command that hands the end states of a run to other tools: export."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mc_engine.command_line.app import (
    USAGE,
    RunPlace,
    app,
    beginning,
    existing_run,
    exit_status,
    leave,
    new_file,
    run_at,
)
from mc_engine.store.urls import is_url, store_url
from mc_engine.suggestions import hint

if TYPE_CHECKING:
    from mc_engine.store.store import Store

FORMATS = ("csv", "oem")
_OEM_COLUMNS = 6


@app.command()
@exit_status()
def export(
    place: RunPlace,
    kind: Annotated[
        str,
        typer.Option(
            "--format", help="csv, or oem (CCSDS ephemerides, a point a case).", autocompletion=beginning(FORMATS)
        ),
    ] = "csv",
    columns: Annotated[
        str | None,
        typer.Option(help="Columns with commas between; for oem those of x, y, z and their rates."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Where to write; by default end_states.csv or .oem in RUN.", parser=new_file),
    ] = None,
    epoch: Annotated[
        str | None, typer.Option(help="For oem: start of the flights in UTC; by default the setting epoch_utc.")
    ] = None,
    frame: Annotated[str | None, typer.Option(help="For oem: reference frame of the columns, such as EME2000.")] = None,
    centre: Annotated[str, typer.Option(help="For oem: the body at the origin.")] = "EARTH",
) -> None:
    """Write where the cases ended, for other tools."""
    if kind not in FORMATS:
        leave(USAGE, f'--format "{kind}" is not known; {" or ".join(FORMATS)}')
    if out is None and is_url(place):
        leave(USAGE, f"--out is missing: {store_url(place)} is a URL; name a file here")
    store = existing_run(run_at(place))
    path = out if out is not None else store.path / f"end_states.{kind}"
    if not path.parent.is_dir():
        leave(USAGE, f"--out {path}: there is no folder {path.parent}")
    from mc_engine.studies.end_states import end_columns, write_csv

    names = [name.strip() for name in columns.split(",")] if columns else end_columns(store)
    for name in names:
        if name not in store.units:
            leave(USAGE, f'--columns: there is no column "{name}"{hint(name, store.units)}')
    if kind == "csv":
        typer.echo(f"{path}: {write_csv(store, names, path):,} cases")
        return
    _write_oem(store, names if columns else [], path, epoch, frame, centre)


def _write_oem(store: "Store", names: list[str], path: Path, epoch: str | None, frame: str | None, centre: str) -> None:
    from mc_engine.errors import StoreError
    from mc_engine.studies.end_states import write_oem

    if len(names) != _OEM_COLUMNS:
        leave(USAGE, f"--columns: {len(names)} given; an OEM needs the six of x, y, z and their rates")
    if frame is None:
        leave(USAGE, "--frame is missing: the reference frame of the columns, such as EME2000 or ICRF")
    start = epoch or _epoch_of(store)
    if start is None:
        leave(USAGE, "--epoch is missing: the start of the flights in UTC, such as 2026-01-31T12:00:00")
    try:
        written, cases = write_oem(store, names, path, start, frame, centre)
    except StoreError as error:
        leave(USAGE, str(error))
    typer.echo(f"{path}: {written:,} of {cases:,} cases, those that completed")


def _epoch_of(store: "Store") -> str | None:
    """The campaign's own epoch, where its model has the setting."""
    records: list[dict[str, Any]] = store.manifest.get("settings", [])
    return next((str(record["value"]) for record in records if record["name"] == "epoch_utc"), None)
