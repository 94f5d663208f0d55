"""The commands that read a run: report, status, verify."""

from pathlib import Path
from typing import Annotated, Any

import typer

from mc_engine.command_line.app import (
    DAMAGED,
    USAGE,
    RunPlace,
    app,
    beginning,
    counted,
    existing_run,
    exit_status,
    leave,
    ranges,
    run_at,
    write_reports,
)
from mc_engine.command_line.object_stores import echo_publication
from mc_engine.interruption import advise
from mc_engine.shell_words import shell_word

REPORT_FORMATS = ("html", "pdf", "md", "json")


@app.command()
@exit_status()
def report(
    folders: Annotated[
        list[str], typer.Argument(metavar="RUN...", help="Directories of runs, or URLs of published ones.")
    ],
    kind: Annotated[
        str | None,
        typer.Option(
            "--format",
            help="html, pdf, md or json; by default html and pdf, with the data as json.",
            autocompletion=beginning(REPORT_FORMATS),
        ),
    ] = None,
    template: Annotated[
        Path | None,
        typer.Option(help="Markdown with Jinja expressions: sections of your own, before the others of each report."),
    ] = None,
) -> None:
    """Write the reports of runs, tunings or rare events anew."""
    advise(lambda: f"interrupted; `mc-engine report {' '.join(map(shell_word, folders))}` writes the reports")
    from mc_engine.store.run_files import RUN, kind_of

    if kind not in (None, *REPORT_FORMATS):
        leave(USAGE, f'--format "{kind}" is not known; {", ".join(REPORT_FORMATS)}')
    if template is not None and not template.is_file():
        leave(USAGE, f"--template {template}: there is no such file")
    paths, published = [], {}
    for named in folders:
        folder = run_at(named)
        if folder != Path(named):
            published[folder] = named
        paths.append(existing_run(folder).path if kind_of(folder) in (RUN, None) else folder)
    more: dict[str, Any] = {} if template is None else {"template": template, "beside": paths}
    for path in paths:
        for written in write_reports(path, ("html", "pdf") if kind is None else (kind,), **more):
            typer.echo(f"{published[path]}/{written.name}" if path in published else str(written))
        if path in published:
            echo_publication(path, published[path])


@app.command()
@exit_status()
def status(place: RunPlace) -> None:
    """How far a run is, and how its cases ended; of a tuning or a rare event, what was found."""
    from mc_engine.runner.summary import case_line
    from mc_engine.store.run_files import RARE_EVENT, TUNING, kind_of
    from mc_engine.store.writer_lock import described, holder
    from mc_engine.studies.rare_event_folder import open_rare_event, rare_event_lines
    from mc_engine.studies.tuning_folder import open_tuning, tuning_lines

    folder = run_at(place)
    if kind_of(folder) == TUNING:
        record = open_tuning(folder)
        typer.echo(f"tuning       {place}\ncampaign     {record.manifest['campaign']['name']}")
        typer.echo("\n".join(tuning_lines(record)))
        return
    if kind_of(folder) == RARE_EVENT:
        estimate = open_rare_event(folder)
        typer.echo(f"rare event   {place}\ncampaign     {estimate.record['campaign']['name']}")
        typer.echo("\n".join(rare_event_lines(estimate.result)))
        return
    store = existing_run(folder)
    typer.echo(f"run       {place}")
    typer.echo(f"campaign  {store.manifest['campaign'].get('name', '')}")
    typer.echo(f"cases     {case_line(store)}")
    writer = holder(folder)
    missing = store.missing()
    if writer is not None:
        typer.echo(f"flying    by {described(writer)}")
    elif missing:
        typer.echo(f"missing   {ranges(missing)}; `mc-engine resume {shell_word(place)}` flies them")
    elif lost := store.lost_files():
        leave(DAMAGED, f"{place}/{lost[0]}: is gone; `mc-engine verify {shell_word(place)}` names all damage")
    else:
        typer.echo("complete")


@app.command()
@exit_status()
def summary(
    place: RunPlace,
    metric: Annotated[list[str] | None, typer.Option(help="Only this metric; may be given several times.")] = None,
) -> None:
    """Moments and quantiles of the metrics of a run of any size, read part by part."""
    from mc_engine.runner.summary import summaries, summary_lines
    from mc_engine.statistics import SAMPLING_DESIGNS

    store = existing_run(run_at(place))
    known = [column.name for column in store.columns if column.role == "metric"]
    for name in metric or ():
        if name not in known:
            leave(USAGE, f'--metric "{name}" is no metric of this run; it has {", ".join(known) or "none"}')
    random = store.manifest["campaign"].get("design", "mc") in SAMPLING_DESIGNS
    for name, found in summaries(store, metric or None).items():
        typer.echo("\n".join(summary_lines(name, found, store.units[name], random)))
    if random:
        typer.echo("in brackets: distribution-free limits, each holding with 95 % for independent cases")


@app.command()
@exit_status()
def verify(place: RunPlace) -> None:
    """Verify all checksums of a run, a tuning or a rare event, with its reports and replays."""
    from mc_engine.store.run_files import kind_of
    from mc_engine.store.verification import RESUME, damages, remedies

    folder = run_at(place)
    if kind_of(folder) is None:
        existing_run(folder)
    found = damages(folder)
    problems = [one for one in found if one.mended_by != RESUME]
    for one in found:
        typer.echo(f"{place}/{one.what}" + f"; {RESUME}" * (one.mended_by == RESUME), err=True)
    if problems:
        leave(DAMAGED, f"{place}: {counted(problems, 'problem')}; {'; '.join(remedies(place, problems))}")
    typer.echo(f"{place}: every byte is as it was written")
