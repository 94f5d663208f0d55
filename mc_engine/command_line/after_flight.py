"""The commands on an existing run: report, status, summary, verify, export, publish, fetch."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mc_engine.command_line.app import (
    DAMAGED,
    USAGE,
    RunFolder,
    RunPlace,
    app,
    beginning,
    existing_run,
    exit_status,
    leave,
    new_file,
    object_store,
    ranges,
    refuse_unwritable_file,
    refuse_unwritable_folder,
    run_at,
    write_reports,
)
from mc_engine.command_line.next_step import MERGE, after_merge
from mc_engine.errors import StoreError, UsageError
from mc_engine.interruption import advise
from mc_engine.numbers_in_text import counted
from mc_engine.shell_words import shell_word
from mc_engine.store.run_files import RARE_EVENT, RUN, TUNING, kind_of
from mc_engine.store.urls import is_url, store_url
from mc_engine.suggestions import hint

if TYPE_CHECKING:
    from mc_engine.store.store import Store

REPORT_FORMATS = ("html", "pdf", "md", "json")
EXPORT_FORMATS = ("csv", "oem")
_OEM_COLUMNS = 6
Url = Annotated[str, typer.Argument(metavar="URL", help="The copy, as s3://bucket/runs/deorbit.", parser=object_store)]


@app.command()
@exit_status()
def report(
    folders: Annotated[
        list[str], typer.Argument(metavar="RUN...", help="Directories of runs, or URLs of published ones.")
    ],
    kinds: Annotated[
        list[str] | None,
        typer.Option(
            "--format",
            help="html, pdf, md or json; may be given several times. By default html and pdf, with the data as json.",
            autocompletion=beginning(REPORT_FORMATS),
        ),
    ] = None,
    template: Annotated[
        Path | None,
        typer.Option(help="Markdown file with Jinja expressions: your own sections, placed first in each report."),
    ] = None,
) -> None:
    """Write the reports of runs, tunings or rare events anew."""
    advise(lambda: f"interrupted; `mc-engine report {' '.join(map(shell_word, folders))}` writes the reports")

    for kind in kinds or ():
        if kind not in REPORT_FORMATS:
            leave(USAGE, f'--format "{kind}" is not known; {", ".join(REPORT_FORMATS)}')
    if template is not None and not template.is_file():
        leave(USAGE, f"--template {template}: there is no such file")
    paths, published = [], {}
    for named in folders:
        folder = run_at(named)
        if folder != Path(named):
            published[folder] = named
        paths.append(existing_run(folder).path if kind_of(folder) in (RUN, None) else folder)
    options: dict[str, Any] = {} if template is None else {"template": template, "beside": paths}
    for path in paths:
        for file in write_reports(path, tuple(kinds or ("html", "pdf")), **options):
            typer.echo(f"{published[path]}/{file.name}" if path in published else str(file))
        if path in published:
            echo_publication(path, published[path])


@app.command()
@exit_status()
def status(place: RunPlace) -> None:
    """Print the progress of a run and the statuses of its cases. For a tuning or a rare event, print its result."""
    from mc_engine.runner.summary import case_line
    from mc_engine.store.case_rows import recorded_cases, rows_so_far
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
    if imported := store.manifest.get("imported"):
        typer.echo(f"imported  from {imported['file']}; the engine did not fly these cases")
    if shard := store.manifest.get("shard"):
        cases = [(shard["first"], shard["stop"])] * (shard["first"] < shard["stop"])
        typer.echo(f"shard     {shard['number']} of {shard['of']}, cases {ranges(cases)}")
    writer = holder(folder)
    missing = store.missing()
    if writer is not None:
        rows, _ = rows_so_far(store.path)
        further = f", {counted(rows, 'further case')} complete" if rows else ""
        typer.echo(f"flying    by {described(writer)}{further}")
    elif missing:
        resume = f"resume RUN --publish {shell_word(place)}" if is_url(place) else f"resume {shell_word(place)}"
        recorded = 0 if is_url(place) else recorded_cases(store.path)
        flies = f"flies them but {recorded:,} whose rows are recorded" if recorded else "flies them"
        advice = after_merge(folder) or f"`mc-engine {resume}` {flies}"
        typer.echo(f"missing   {ranges(missing)}; {advice}")
    elif lost := store.lost_files():
        leave(DAMAGED, f"{place}/{lost[0]}: is gone; `mc-engine verify {shell_word(place)}` names all damage")
    else:
        typer.echo(f"complete; {MERGE}" if shard else "complete")


@app.command()
@exit_status()
def summary(
    place: RunPlace,
    metric: Annotated[list[str] | None, typer.Option(help="Only this metric; may be given several times.")] = None,
) -> None:
    """Print moments and quantiles of the metrics of a run. The run may have any size; it is read part by part."""
    from mc_engine.runner.summary import analyses_line, summaries, summary_lines
    from mc_engine.section import ReportSection
    from mc_engine.statistics import SAMPLING_DESIGNS
    from mc_engine.store.manifest_file import design_in

    store = existing_run(run_at(place))
    known = [column.name for column in store.columns if column.role == "metric"]
    for name in metric or ():
        if name not in known:
            leave(USAGE, f'--metric "{name}" is no metric of this run; it has {", ".join(known) or "none"}')
    random = design_in(store.manifest) in SAMPLING_DESIGNS
    for name, statistics in summaries(store, metric or None).items():
        typer.echo("\n".join(summary_lines(name, statistics, store.units[name], random)))
    if random:
        each = 100.0 * ReportSection(**store.manifest.get("report", {})).confidence
        fixed = " whose number was fixed in advance; here they hold somewhat less often" * bool(analyses_line(store))
        typer.echo(
            f"in brackets: distribution-free limits, each holding with {each:.6g} % for independent cases{fixed}"
        )


@app.command()
@exit_status()
def verify(place: RunPlace) -> None:
    """Verify all checksums of a run, a tuning or a rare event. Reports and replays are included."""
    from mc_engine.store.verification import RESUME, damages, remedies

    folder = run_at(place)
    if kind_of(folder) is None:
        existing_run(folder)
    items = damages(folder)
    problems = [item for item in items if item.mended_by != RESUME]
    for item in items:
        typer.echo(f"{place}/{item.what}" + f"; {RESUME}" * (item.mended_by == RESUME), err=True)
    if problems:
        ways = "; ".join(remedies("RUN" if is_url(place) else place, problems))
        if is_url(place):
            ways = f"in RUN, the run's own directory: {ways}; then `mc-engine publish RUN {shell_word(place)}`"
        leave(DAMAGED, f"{place}: {counted(len(problems), 'problem')}; {ways}")
    typer.echo(f"{place}: every byte is as it was written")


@app.command()
@exit_status()
def export(
    place: RunPlace,
    kind: Annotated[
        str,
        typer.Option(
            "--format",
            help="csv, or oem (CCSDS ephemerides, one point per case).",
            autocompletion=beginning(EXPORT_FORMATS),
        ),
    ] = "csv",
    columns: Annotated[
        str | None,
        typer.Option(help="Columns, separated by commas; for oem those of x, y, z and their rates."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Output file; by default end_states.csv or .oem in RUN.", parser=new_file),
    ] = None,
    epoch: Annotated[
        str | None, typer.Option(help="For oem: start of the flights in UTC; by default the setting epoch_utc.")
    ] = None,
    frame: Annotated[str | None, typer.Option(help="For oem: reference frame of the columns, such as EME2000.")] = None,
    centre: Annotated[str | None, typer.Option(help="For oem: the body at the origin; by default EARTH.")] = None,
) -> None:
    """Write the end states of the cases to a file for other tools."""
    if kind not in EXPORT_FORMATS:
        leave(USAGE, f'--format "{kind}" is not known; {" or ".join(EXPORT_FORMATS)}')
    if out is None and is_url(place):
        leave(USAGE, f"--out is missing: {store_url(place)} is a URL; name a file here")
    store = existing_run(run_at(place))
    path = out if out is not None else store.path / f"end_states.{kind}"
    refuse_unwritable_file("--out", path)
    if path.suffix.lower() in {".parquet", *(f".{other}" for other in EXPORT_FORMATS if other != kind)}:
        leave(USAGE, f"--out {path}: --format {kind} writes another kind of file; let the name end in .{kind}")
    from mc_engine.studies.end_states import end_columns, write_csv

    names = end_columns(store) if columns is None else _named_columns(store, columns)
    if kind == "csv":
        for option, value in (("--epoch", epoch), ("--frame", frame), ("--centre", centre)):
            if value is not None:
                leave(USAGE, f"{option} is for --format oem; leave it out, a table has none")
        typer.echo(f"{path}: {write_csv(store, names, path):,} cases")
        return
    _write_oem(store, names if columns else [], path, epoch, frame, "EARTH" if centre is None else centre)


def _named_columns(store: "Store", text: str) -> list[str]:
    """The columns of --columns, each of them once."""
    names = [name.strip() for name in text.split(",")] if text.strip() else []
    if not names:
        leave(USAGE, "--columns names no column; leave the option out for the columns at the end of the flights")
    for name in names:
        if name not in store.units:
            leave(USAGE, f'--columns: there is no column "{name}"{hint(name, store.units)}')
        if names.count(name) > 1:
            leave(USAGE, f'--columns: "{name}" is there twice; name each column once')
    return names


def _write_oem(store: "Store", names: list[str], path: Path, epoch: str | None, frame: str | None, centre: str) -> None:
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
    """The campaign's epoch, if its model has the setting epoch_utc."""
    records: list[dict[str, Any]] = store.manifest.get("settings", [])
    return next((str(record["value"]) for record in records if record["name"] == "epoch_utc"), None)


@app.command()
@exit_status()
def publish(folder: RunFolder, url: Url) -> None:
    """Copy a run to an object store. Only missing or different files are sent (needs fsspec, s3fs)."""
    advise(lambda: f"interrupted; `mc-engine publish {shell_word(folder)} {shell_word(url)}` sends the rest")
    existing_run(folder)
    echo_publication(folder, url)


def echo_publication(folder: Path, url: str) -> None:
    """Publish the run, and print what was sent."""
    from mc_engine.store.object_store import publish

    try:
        done = publish(folder, url)
    except StoreError as error:
        if isinstance(error, UsageError) or not str(error).startswith(url):  # of the request, or of the run itself
            raise
        again = f", `mc-engine publish {shell_word(folder)} {shell_word(url)}` sends the rest"
        raise StoreError(f"{error}; the run is safe{'' if 'publish again' in str(error) else again}") from error
    files = counted(len(done.sent), "file")
    typer.echo(f"published    {done.url}: {files}, {done.sent_bytes:,} bytes; {done.kept} were there")


@app.command()
@exit_status()
def fetch(
    url: Url, folder: Annotated[Path, typer.Argument(metavar="DIR", help="Directory of the copy.", parser=new_file)]
) -> None:
    """Copy a run from an object store to a new directory. The checksum of every part is verified."""
    from mc_engine.store.object_store import fetch

    refuse_unwritable_folder(folder, option="")
    typer.echo(f"run          {fetch(url, folder)}")
