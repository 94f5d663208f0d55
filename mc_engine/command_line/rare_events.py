"""The command for probabilities too small for plain cases: rare."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mc_engine.command_line.app import (
    USAGE,
    CampaignFile,
    NoReport,
    Workers,
    app,
    beginning,
    exit_status,
    leave,
    new_folder,
    refuse_occupied_folder,
    write_reports,
)
from mc_engine.command_line.next_step import after_search
from mc_engine.interruption import NOTHING_BEGUN, advise, heed

_SECONDS_BETWEEN_LINES = 5.0

if TYPE_CHECKING:
    from mc_engine.campaign.parts import Requirement


def _requirements_beginning(ctx: typer.Context, incomplete: str) -> list[str]:
    """What the shell offers for a requirement: those of the campaign that stands on the line already."""
    from mc_engine.campaign.search import requirement_names

    # an option that still lacks its word leaves the argument before it unread
    file = ctx.params.get("file") or next(iter(ctx.args), "")
    return [name for name in requirement_names(file) if name.startswith(incomplete)]


@app.command()
@exit_status()
def rare(
    file: CampaignFile,
    requirement: Annotated[
        str | None, typer.Option(help="Its name; the only one by default.", autocompletion=_requirements_beginning)
    ] = None,
    method: Annotated[
        str, typer.Option(help="subset or cross-entropy.", autocompletion=beginning(("subset", "cross-entropy")))
    ] = "subset",
    cases_per_level: Annotated[
        int, typer.Option(min=1, max=10_000_000, help="Cases that each level stands on.")
    ] = 10_000,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed, in place of the file's.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Directory of the result; by default runs/<campaign>-…", parser=new_folder),
    ] = None,
    no_report: NoReport = False,
    workers: Workers = None,
) -> None:
    """The probability that a requirement of FILE is not met, down to one in millions, with its interval."""
    advise(lambda: NOTHING_BEGUN)
    from mc_engine.campaign.loading import load_campaign
    from mc_engine.store.run_folder import default_folder
    from mc_engine.studies.limit_state import chosen_requirement, refuse_unmappable
    from mc_engine.studies.rare_event import METHODS, estimate_rare_event
    from mc_engine.studies.rare_event_folder import rare_event_lines

    if method not in METHODS:
        leave(USAGE, f'--method "{method}" is not known; {" or ".join(METHODS)}')
    campaign = load_campaign(file, seed=seed)
    _refuse_to_choose(campaign.requirements, requirement)
    chosen_requirement(campaign, requirement)
    refuse_unmappable(campaign)
    path = out if out is not None else default_folder(f"{campaign.name}-rare")
    refuse_occupied_folder(path)
    advise(lambda: after_search(path, "rare.json", "the estimate is"))
    typer.echo("preparing; a model that is new takes some seconds to compile", err=True)
    found = estimate_rare_event(
        campaign,
        requirement,
        path,
        method=method,
        cases_per_level=cases_per_level,
        workers=workers,
        progress=_Teller(),
    )
    heed()
    for line in (f"rare event   {path}", *rare_event_lines(found.result)):
        typer.echo(line)
    for report_path in [] if no_report else write_reports(path, ("html", "pdf")):
        typer.echo(f"report       {report_path}")


def _refuse_to_choose(requirements: Sequence["Requirement"], name: str | None) -> None:
    if name is None and len(requirements) > 1:
        names = ", ".join(one.name for one in requirements)
        leave(USAGE, f"--requirement is missing: the campaign has several; choose one of {names}")


class _Teller:
    """A line now and then: how many levels there will be is not known, so there is no remaining time."""

    def __init__(self) -> None:
        self._last = time.monotonic()

    def __call__(self, flown: int, failed: int) -> None:
        if time.monotonic() - self._last >= _SECONDS_BETWEEN_LINES:
            self._last = time.monotonic()
            typer.echo(f"{flown:,} cases, {failed:,} of them failed", err=True)
