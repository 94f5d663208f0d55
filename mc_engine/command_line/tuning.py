"""The command that searches for the best parameters: tune."""

from pathlib import Path
from typing import Annotated

import typer

from mc_engine.command_line.app import (
    CampaignFile,
    NoReport,
    Workers,
    app,
    exit_status,
    new_folder,
    refuse_occupied_folder,
    write_reports,
)
from mc_engine.command_line.next_step import after_search
from mc_engine.interruption import NOTHING_BEGUN, advise, heed


@app.command()
@exit_status()
def tune(
    file: CampaignFile,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Directory of the result; by default runs/<campaign>-<time>.", parser=new_folder
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(min=0, max=2**32 - 1, help="Seed of the search.")] = None,
    generations: Annotated[
        int | None, typer.Option(min=1, max=100_000, help="Generations, in place of the file's.")
    ] = None,
    population: Annotated[
        int | None, typer.Option(min=4, max=100_000, help="Candidates in each, in place of the file's.")
    ] = None,
    no_report: NoReport = False,
    workers: Workers = None,
) -> None:
    """Search parameters for the best metrics, as the section tuning of FILE says (needs pymoo)."""
    advise(lambda: NOTHING_BEGUN)
    from mc_engine.campaign.loading import load_campaign
    from mc_engine.store.run_folder import default_folder

    campaign = load_campaign(file)
    path = out if out is not None else default_folder(campaign.name)
    refuse_occupied_folder(path)
    advise(lambda: after_search(path, "tuning.json", "the generations that were flown are"))
    from mc_engine.runner.progress import Progress
    from mc_engine.studies.tuning import tune
    from mc_engine.studies.tuning_folder import tuning_lines

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
    heed()
    for line in [f"tuning       {path}", *tuning_lines(record)]:
        typer.echo(line)
    for report_path in [] if no_report else write_reports(path, ("html", "pdf")):
        typer.echo(f"report       {report_path}")
