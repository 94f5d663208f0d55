"""The verbs that read a run: report, status, verify."""

from typing import Annotated

import typer

from mc_engine.command_line import (
    DAMAGED,
    USAGE,
    RunFolder,
    app,
    counted,
    existing_run,
    exit_status,
    leave,
    ranges,
    write_reports,
)


@app.command()
@exit_status()
def report(
    folder: RunFolder,
    kind: Annotated[str | None, typer.Option("--format", help="html or pdf; both by default.")] = None,
) -> None:
    """Write the reports of a run, or of a tuning, anew."""
    from mc_engine.tuning_folder import is_tuning_directory

    if kind not in (None, "html", "pdf"):
        leave(USAGE, f'--format "{kind}" is not known; html or pdf')
    path = folder if is_tuning_directory(folder) else existing_run(folder).path
    for written in write_reports(path, ("html", "pdf") if kind is None else (kind,)):
        typer.echo(str(written))


@app.command()
@exit_status()
def status(folder: RunFolder) -> None:
    """How far a run is, and how its cases ended; of a tuning, what it has found."""
    from mc_engine.run_summary import case_line
    from mc_engine.tuning_folder import is_tuning_directory, open_tuning, outcome_lines
    from mc_engine.writer_lock import described, holder

    if is_tuning_directory(folder):
        record = open_tuning(folder)
        typer.echo(f"tuning       {folder}\ncampaign     {record.manifest['campaign']['name']}")
        typer.echo("\n".join(outcome_lines(record)))
        return
    store = existing_run(folder)
    typer.echo(f"run       {folder}")
    typer.echo(f"campaign  {store.manifest['campaign'].get('name', '')}")
    typer.echo(f"cases     {case_line(store)}")
    writer = holder(folder)
    missing = store.missing()
    if writer is not None:
        typer.echo(f"flying    by {described(writer)}")
    elif missing:
        typer.echo(f"missing   {ranges(missing)}; `mc-engine resume {folder}` flies them")
    elif lost := store.lost_files():
        leave(DAMAGED, f"{folder}/{lost[0]}: is gone; `mc-engine verify {folder}` names all damage")
    else:
        typer.echo("complete")


@app.command()
@exit_status()
def verify(folder: RunFolder) -> None:
    """Hold every byte of a run against its journal, or of a tuning against its manifest."""
    from mc_engine.store import is_run_directory
    from mc_engine.tuning_folder import is_tuning_directory, open_tuning
    from mc_engine.verification import damage

    if is_tuning_directory(folder):
        open_tuning(folder)  # which reads every byte
        typer.echo(f"{folder}: every byte is as it was written")
        return

    if not is_run_directory(folder):
        existing_run(folder)
    problems = damage(folder)
    for problem in problems:
        typer.echo(f"{folder}/{problem}", err=True)
    if problems:
        leave(DAMAGED, f"{folder}: {counted(problems, 'problem')}")
    typer.echo(f"{folder}: every byte is as it was written")
