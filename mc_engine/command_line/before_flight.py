"""The commands before a flight: init, check, plan, sample, list, schema, units."""

import json
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mc_engine.command_line.app import (
    USAGE,
    CampaignFile,
    Cases,
    app,
    exit_status,
    leave,
    new_file,
    refuse_unwritable_file,
    refuse_unwritable_folder,
)
from mc_engine.numbers_in_text import LEAST_SHARE, counted
from mc_engine.safe_path import safe_environment
from mc_engine.shell_words import shell_word

if TYPE_CHECKING:
    from mc_engine.campaign.loading import Campaign
    from mc_engine.flight.flyer import Process


@app.command()
@exit_status()
def init(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Directory of the new campaign.", parser=new_file)],
) -> None:
    """Copy a minimal campaign, model and file, to DIR. It is a start for your own."""
    from mc_engine.campaign.search import SHIPPED

    names = ("campaign.toml", "model.py")
    refuse_unwritable_folder(folder, option="")
    for name in names:
        if (folder / name).exists():
            leave(USAGE, f"{folder / name}: is there already; choose another folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in names:
            shutil.copyfile(SHIPPED / "minimal" / name, folder / name)
    except OSError as error:
        leave(USAGE, f"{error.filename or folder}: {error.strerror}")
    named = shell_word(folder)
    typer.echo(
        f"{folder}: campaign.toml and model.py\nnext: `mc-engine run {named}` flies them; change them, and "
        f"`mc-engine check {named}` says what is wrong"
    )


@app.command()
@exit_status()
def check(
    file: CampaignFile,
    model: Annotated[bool, typer.Option(help="Check the model too, by flying a few cases.")] = True,
) -> None:
    """Report all errors in a campaign file and its model.

    A few cases are flown in a separate process.  All results must exist and not depend on the other cases in the batch,
    every dispersion must have an effect, no metric may be a fixed number, and every event must happen.
    """
    from mc_engine.store.manifest_file import seed_remark

    with _flights_beside(file) if model else nullcontext() as process:
        campaign, problems, remarks = _checked(file, process)
    if problems:
        heading = f"{campaign.model_reference}: {counted(len(problems), 'problem')}"
        leave(USAGE, "\n".join([heading, *(f"  {problem}" for problem in problems)]))
    typer.echo(
        f"{campaign.name}: {counted(campaign.cases, 'case')}, design {campaign.design}, "
        f"{counted(len(campaign.dispersions), 'dispersion')}, {counted(len(campaign.correlations), 'correlation')}, "
        f"{counted(len(campaign.requirements), 'requirement')}; valid"
    )
    if alike := seed_remark(campaign.seed, campaign.upstream.rows.facts if campaign.upstream else None):
        typer.echo(f"seed {alike}")
    for line in remarks:
        typer.echo(line)


@contextmanager
def _flights_beside(file: str) -> "Iterator[Process]":
    """A separate process, as the model may crash or hang: it loads a campaign and waits to fly a few cases.

    file : as the user named it.  The process loads the campaign while `check` does, and is killed at the end.
    """
    import subprocess

    command = [sys.executable, "-m", "mc_engine.flight.contract_flight", file, "--wait"]
    other = {"PYTHONHASHSEED": "1" if os.environ.get("PYTHONHASHSEED") == "0" else "0", "TZ": "UTC-14"}
    pipe, environment = subprocess.PIPE, {**safe_environment(), **other}
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, env=environment) as process:
        try:
            yield process
        finally:
            process.kill()


def _checked(file: str, process: "Process | None") -> "tuple[Campaign, list[str], list[str]]":
    """The campaign, errors of its model, and remarks; neither without the process that flies a few cases."""
    from mc_engine.campaign.loading import load_campaign
    from mc_engine.flight.flyers import flyer_of
    from mc_engine.runner.flown_campaign import copies_of, refuse_undeclared_data

    campaign = load_campaign(file)
    flyer = flyer_of(campaign)
    if process is None:
        return campaign, [], []
    problems = flyer.faults()
    if not problems:
        refuse_undeclared_data(campaign)
        with _told_if_long(campaign):
            problems = flyer.faults_in_flight(process)
    return campaign, *((problems, []) if problems else flyer.second_look(copies_of))


_LONG = 30.0  # s


@contextmanager
def _told_if_long(campaign: "Campaign") -> Iterator[None]:
    """A line on standard error where the nominal case takes long and nothing limits it: it may hang."""
    from threading import Timer

    text = (
        f"the nominal case has not ended after {_LONG:g} s; Ctrl-C ends it, and `time_limit_s` of the simulator gives "
        "up a case that takes longer"
    )
    timer = Timer(_LONG, typer.echo, (text,), {"err": True})
    timer.daemon = True
    if getattr(campaign.model, "time_limit_s", 0.0) is None:  # a simulator without a limit
        timer.start()
    try:
        yield
    finally:
        timer.cancel()


@app.command()
@exit_status()
def plan(
    file: Annotated[
        str | None, typer.Argument(metavar="[FILE_OR_NAME]", help="A campaign, to plan for its requirements.")
    ] = None,
    share: Annotated[float | None, typer.Option(help="Success probability to be demonstrated, such as 0.9973.")] = None,
    confidence: Annotated[float | None, typer.Option(help="Confidence of the demonstration, such as 0.90.")] = None,
    failures: Annotated[
        int | None, typer.Option(min=0, max=1_000_000, help="Print only the row for this number of failures.")
    ] = None,
    two_sided: Annotated[
        bool,
        typer.Option(
            "--two-sided",
            help="Also the cases for an interval between order statistics (Wilks). A requirement with two limits needs "
            "no more cases than one with a single limit.",
        ),
    ] = False,
) -> None:
    """Print how many cases demonstrate a success probability. The failures among them may be 0, 1, 2, ...

    Give --share and --confidence, or a campaign: then the table is for its requirements, one by one and together.
    """
    from mc_engine.campaign.loading import load_campaign
    from mc_engine.studies.plan import ROWS, interval_lines, plan_lines, plan_row, table_lines

    numbers = range(ROWS) if failures is None else [failures]
    if file is not None:
        if share is not None or confidence is not None:
            leave(USAGE, f"{file}: says share and confidence itself; leave --share and --confidence out")
        campaign = load_campaign(file)
        if not campaign.requirements:
            leave(USAGE, f"{file}: sets no requirement; add [requirement.NAME], or give --share and --confidence")
        lines = [*plan_lines(campaign, numbers, two_sided)]
    else:
        share, confidence = _probability("--share", share), _probability("--confidence", confidence)
        lines = [f"share {share:.14g} with confidence {confidence:.14g}", ""]
        lines += table_lines([plan_row(share, confidence, number) for number in numbers], share, confidence)
        lines += ["", *interval_lines(share, confidence)] if two_sided else []
    for line in lines:
        typer.echo(line)


def _probability(name: str, value: float | None) -> float:
    if value is None:
        leave(USAGE, f"{name} is missing; give --share and --confidence, or a campaign file")
    if not LEAST_SHARE <= value <= 1.0 - LEAST_SHARE:
        leave(USAGE, f"{name} is {value:.16g}; it must be above 0 and below 1 by {LEAST_SHARE:g}, such as 0.9973")
    return value


@app.command()
@exit_status()
def sample(
    file: CampaignFile,
    cases: Cases = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="File for the whole table, .parquet or .csv.", parser=new_file),
    ] = None,
) -> None:
    """Print or write the inputs of all cases, without flying them."""
    from mc_engine.campaign.loading import load_campaign
    from mc_engine.campaign.sample_table import SUFFIXES, drawn_inputs, sample_text, write_sample
    from mc_engine.runner.flown_campaign import companions_of

    if out is not None and out.suffix not in SUFFIXES:
        leave(USAGE, f"--out {out}: the name must end in {' or '.join(SUFFIXES)}")
    if out is not None:
        refuse_unwritable_file("--out", out)
    campaign = load_campaign(file, cases=cases)
    if out is not None and out.resolve() in {campaign.directory.resolve() / name for name in companions_of(campaign)}:
        leave(USAGE, f"--out {out}: the campaign reads this file; name another")
    table = drawn_inputs(campaign)
    if out is None:
        typer.echo(f"{campaign.name}: {counted(campaign.cases, 'case')}, design {campaign.design}\n")
        typer.echo(sample_text(table))
    else:
        write_sample(campaign, table, out)
        typer.echo(f"{out}: {campaign.cases:,} cases of {campaign.name}")


@app.command("list")
@exit_status()
def list_() -> None:
    """List the shipped campaigns, by the names that `run` takes."""
    from mc_engine.campaign.search import list_campaigns, model_sources

    campaigns, sources = list_campaigns(), model_sources()
    width = max((len(campaign.name) for campaign in campaigns), default=0)
    for folder, group in groupby(campaigns, key=lambda campaign: campaign.name.partition("/")[0]):
        for campaign in group:
            typer.echo(f"{campaign.name:<{width}}  {campaign.title}".rstrip())
        if folder in sources:
            typer.echo(f"{'':<{width}}  source: {sources[folder]}")


@app.command()
@exit_status()
def schema() -> None:
    """Print the JSON schema of campaign files, for an editor."""
    from mc_engine.campaign.sections import schema as campaign_schema

    typer.echo(json.dumps(campaign_schema(), indent=2, ensure_ascii=False))


@app.command()
@exit_status()
def units() -> None:
    """List all units for models and campaign files. They are sorted by quantity; the first of each is the SI unit."""
    from mc_engine.units import OTHER_SUFFIXES, UNITS, by_quantity

    groups = by_quantity()
    width = max(len(quantity) for quantity in groups)
    for quantity, names in groups.items():
        typer.echo(f"{quantity:<{width}}  {', '.join(names)}")
    others = ", ".join(f"{suffix} for {unit}" for unit, suffix in OTHER_SUFFIXES.items())
    typer.echo(f"\n{len(UNITS)} units; a column's name ends in its unit: {UNITS['N m'].suffix} for N m")
    typer.echo(f"Two end otherwise: {others}")
