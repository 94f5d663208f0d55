"""The verbs that fly nothing: init, check, plan, sample, list, schema."""

import json
import shutil
from pathlib import Path
from typing import Annotated

import typer

from mc_engine.command_line import (
    USAGE,
    CampaignFile,
    Cases,
    app,
    counted,
    exit_status,
    leave,
)


@app.command()
@exit_status()
def init(folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where the new campaign is to be.")]) -> None:
    """Copy the smallest campaign, a model and its file, to DIR as a start for your own."""
    from mc_engine.campaign import SHIPPED

    names = ("campaign.toml", "model.py")
    for name in names:
        if (folder / name).exists():
            leave(USAGE, f"{folder / name}: is there already; choose another folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in names:
            shutil.copyfile(SHIPPED / "minimal" / name, folder / name)
    except OSError as error:
        leave(USAGE, f"{error.filename or folder}: {error.strerror}")
    typer.echo(f"{folder}: campaign.toml and model.py; fly them with `mc-engine run {folder}`")


@app.command()
@exit_status()
def check(file: CampaignFile) -> None:
    """Read a campaign file and report everything that is wrong with it."""
    from mc_engine.campaign import load_campaign

    campaign = load_campaign(file)
    typer.echo(
        f"{campaign.name}: {campaign.cases:,} cases, design {campaign.design}, "
        f"{counted(campaign.dispersions, 'dispersion')}, {counted(campaign.correlations, 'correlation')}, "
        f"{counted(campaign.requirements, 'requirement')}; no problems"
    )


@app.command()
@exit_status()
def plan(
    share: Annotated[float, typer.Option(help="Share of cases to be demonstrated, such as 0.9973.")],
    confidence: Annotated[float, typer.Option(help="Confidence of the demonstration, such as 0.90.")],
    failures: Annotated[int | None, typer.Option(min=0, help="Only the row for this many failures.")] = None,
) -> None:
    """How many cases demonstrate a share of success with a confidence, for 0, 1, 2, ... failures among them."""
    from mc_engine.plan import PlanRow, demonstrated_share, plan_table, smallest_sample

    for name, value in (("--share", share), ("--confidence", confidence)):
        if not 0.0 < value < 1.0:  # also false for NaN
            leave(USAGE, f"{name} is {value}; it must lie between 0 and 1, without them")
    if failures is None:
        rows = plan_table(share, confidence)
    else:
        cases = smallest_sample(share, confidence, failures)
        rows = [PlanRow(failures, cases, demonstrated_share(cases, failures, confidence))]
    typer.echo(f"share {share:.10g} with confidence {confidence:.10g}\n")
    typer.echo(f"{'failures':>8}  {'cases':>9}  demonstrated share")
    for row in rows:
        typer.echo(f"{row.failures:>8}  {row.cases:>9}  {row.shown:.6f}")


@app.command()
@exit_status()
def sample(
    file: CampaignFile,
    cases: Cases = None,
    out: Annotated[Path | None, typer.Option(help="Write the whole table here, .parquet or .csv.")] = None,
) -> None:
    """Draw the case table without flying it."""
    from mc_engine.campaign import load_campaign
    from mc_engine.sample_table import SUFFIXES, drawn_inputs, sample_text, write_sample

    if out is not None and out.suffix not in SUFFIXES:
        leave(USAGE, f"--out {out}: the name must end in {' or '.join(SUFFIXES)}")
    if out is not None and not out.parent.is_dir():
        leave(USAGE, f"--out {out}: there is no folder {out.parent}")
    campaign = load_campaign(file, cases=cases)
    table = drawn_inputs(campaign)
    if out is None:
        typer.echo(f"{campaign.name}: {campaign.cases:,} cases, design {campaign.design}\n\n{sample_text(table)}")
    else:
        write_sample(campaign, table, out)
        typer.echo(f"{out}: {campaign.cases:,} cases of {campaign.name}")


@app.command("list")
@exit_status()
def list_() -> None:
    """The shipped campaigns, by the names that `run` takes."""
    from mc_engine.campaign import list_campaigns

    campaigns = list_campaigns()
    width = max((len(campaign.name) for campaign in campaigns), default=0)
    for campaign in campaigns:
        typer.echo(f"{campaign.name:<{width}}  {campaign.title}".rstrip())


@app.command()
@exit_status()
def schema() -> None:
    """The JSON schema of campaign files, for an editor."""
    from mc_engine.campaign import schema as campaign_schema

    typer.echo(json.dumps(campaign_schema(), indent=2, ensure_ascii=False))
