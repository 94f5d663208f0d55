"""The verbs that fly cases: run, resume, extend, replay, tune."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mc_engine.command_line import (
    DAMAGED,
    NOT_MET,
    TOO_MANY_FAILED,
    USAGE,
    CampaignFile,
    Cases,
    NoReport,
    RunFolder,
    Workers,
    app,
    existing_run,
    exit_status,
    leave,
    ranges,
    write_reports,
)
from mc_engine.errors import StoreError

if TYPE_CHECKING:
    from mc_engine.store import Store


@app.command()
@exit_status()
def run(
    file: CampaignFile,
    out: Annotated[Path | None, typer.Option(help="Directory of the run; by default runs/<campaign>-<time>.")] = None,
    cases: Cases = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed, in place of the file's.")] = None,
    no_report: NoReport = False,
    workers: Workers = None,
    upstream: Annotated[
        Path | None, typer.Option("--from", help="Run to take inputs from, in place of the one that [inputs] names.")
    ] = None,
    judge: Annotated[bool, typer.Option("--judge", help="Exit with 1 unless every requirement passes.")] = False,
    max_failed: Annotated[int | None, typer.Option(min=0, help="Exit with 3 if more cases fail.")] = None,
) -> None:
    """Fly a campaign and write its reports."""
    from mc_engine.campaign import load_campaign
    from mc_engine.run_folder import default_folder

    if upstream is not None:
        existing_run(upstream)
    campaign = load_campaign(file, cases=cases, seed=seed, upstream=upstream)
    path = out if out is not None else default_folder(campaign.name)
    _refuse_folder(path)
    store = _fly(lambda runner, progress: runner.run(campaign, path, progress=progress, workers=workers))
    _finish(store, no_report, judge, max_failed)


def _refuse_folder(path: Path) -> None:
    """An occupied --out is a slip of the user's; told before anything is compiled."""
    from mc_engine.store import refuse_occupied

    try:
        refuse_occupied(path)
    except StoreError as error:
        leave(USAGE, f"--out {error}")
    existing = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    if not (existing.is_dir() and os.access(existing, os.W_OK)):
        leave(USAGE, f"--out {path}: {existing} is no folder that can be written to")


def _fly(fly: Callable[[Any, Any], "Store"]) -> "Store":
    from mc_engine import runner
    from mc_engine.progress import Progress

    with Progress() as progress:
        if not progress.stream.isatty():
            typer.echo("preparing; a model that is new takes some seconds to compile", err=True)
        return fly(runner, progress)


def _finish(store: "Store", no_report: bool, judge: bool = False, max_failed: int | None = None) -> None:
    """What every flight ends with: reports, a summary, and an exit status where one was asked for."""
    from mc_engine.run_summary import case_line, failed_cases, verdict_line, verdicts

    reports = [] if no_report else write_reports(store.path, ("html", "pdf"))
    typer.echo(f"run          {store.path}")
    typer.echo(f"cases        {case_line(store)}")
    judged = verdicts(store)
    for verdict in judged:
        typer.echo(f"requirement  {verdict_line(verdict, store.units)}")
    for report_path in reports:
        typer.echo(f"report       {report_path}")
    failed = failed_cases(store)
    if max_failed is not None and failed > max_failed:
        leave(TOO_MANY_FAILED, f"{failed} cases failed; at most {max_failed} were allowed")
    if judge and any(verdict.outcome != "pass" for verdict in judged):
        leave(NOT_MET, "not every requirement is met")


@app.command()
@exit_status()
def resume(folder: RunFolder, no_report: NoReport = False, workers: Workers = None) -> None:
    """Complete a run that was interrupted."""
    existing_run(folder)
    store = _fly(lambda runner, progress: runner.resume(folder, progress=progress, workers=workers))
    _finish(store, no_report)


@app.command()
@exit_status()
def extend(
    folder: RunFolder,
    cases: Annotated[int, typer.Option(min=1, help="How many cases the run is to have in all.")],
    no_report: NoReport = False,
    workers: Workers = None,
) -> None:
    """Add cases to a run; 1000 extended to 2000 are the same as 2000 from the start."""
    from mc_engine.designs import EXTENSIBLE

    store = existing_run(folder)
    wanted, design = store.n_cases, store.manifest["campaign"]["design"]
    if store.manifest.get("upstream") is not None:
        leave(USAGE, f"{folder}: takes its inputs from another run; extend that one, and fly this campaign anew")
    if design not in EXTENSIBLE:
        leave(USAGE, f'{folder}: the design "{design}" cannot be extended; {", ".join(EXTENSIBLE)} can')
    if cases <= wanted:
        leave(USAGE, f"--cases {cases}: {folder} has {wanted} cases; give the number it is to have in all")
    store = _fly(lambda runner, progress: runner.extend(folder, cases, progress=progress, workers=workers))
    _finish(store, no_report)


@app.command()
@exit_status()
def replay(folder: RunFolder, case: Annotated[int, typer.Argument(metavar="CASE", min=0, help="Its case_id.")]) -> None:
    """Fly one case again, alone: compare every stored number bit for bit, and write and plot its history."""
    store = existing_run(folder)
    if store.missing(range(case, case + 1)):
        leave(USAGE, f"{folder}: case {case} is not there; the run has {ranges(store.committed())}")
    from mc_engine import runner
    from mc_engine.replay_files import write_replay

    flight = runner.replay(folder, case)
    for path in write_replay(store, case, flight.history):
        typer.echo(str(path))
    if not flight.equal:
        for difference in flight.differences:
            typer.echo(str(difference), err=True)
        leave(DAMAGED, f"case {case} is not the one in {folder}: the run was changed, or flown by other sources")
    typer.echo(f"case {case}: every stored number has the same bits")


@app.command()
@exit_status()
def tune(
    file: CampaignFile,
    out: Annotated[
        Path | None, typer.Option(help="Directory of the result; by default runs/<campaign>-<time>.")
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, max=2**32 - 1, help="Seed of the search.")] = None,
    generations: Annotated[int | None, typer.Option(min=1, help="Generations, in place of the file's.")] = None,
    population: Annotated[int | None, typer.Option(min=4, help="Candidates in each, in place of the file's.")] = None,
    no_report: NoReport = False,
    workers: Workers = None,
) -> None:
    """Search parameters for the best metrics, as the section tuning of FILE says (needs pymoo)."""
    from mc_engine.campaign import load_campaign
    from mc_engine.run_folder import default_folder

    campaign = load_campaign(file)
    path = out if out is not None else default_folder(campaign.name)
    _refuse_folder(path)
    from mc_engine.progress import Progress
    from mc_engine.tuning import tune
    from mc_engine.tuning_folder import outcome_lines

    with Progress() as progress:
        record = tune(
            campaign,
            path,
            seed=seed,
            generations=generations,
            population=population,
            workers=workers,
            progress=progress,
        )
    for line in [f"tuning       {path}", *outcome_lines(record)]:
        typer.echo(line)
    for report_path in [] if no_report else write_reports(path, ("html", "pdf")):
        typer.echo(f"report       {report_path}")
