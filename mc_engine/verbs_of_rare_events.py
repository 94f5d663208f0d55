"""The verb for probabilities too small for plain cases: rare."""

import time
from pathlib import Path
from typing import Annotated

import typer

from mc_engine.command_line import USAGE, CampaignFile, NoReport, Workers, app, exit_status, leave, write_reports
from mc_engine.errors import StoreError

_SECONDS_BETWEEN_LINES = 5.0


@app.command()
@exit_status()
def rare(
    file: CampaignFile,
    requirement: Annotated[str | None, typer.Option(help="Its name; the only one by default.")] = None,
    method: Annotated[str, typer.Option(help="subset or cross-entropy.")] = "subset",
    cases_per_level: Annotated[int, typer.Option(min=1, help="Cases that each level stands on.")] = 10_000,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed, in place of the file's.")] = None,
    out: Annotated[Path | None, typer.Option(help="Directory of the result; by default runs/<campaign>-…")] = None,
    no_report: NoReport = False,
    workers: Workers = None,
) -> None:
    """The probability that a requirement of FILE is not met, down to one in millions, with its interval."""
    from mc_engine.campaign import load_campaign
    from mc_engine.limit_state import chosen_requirement, refuse_unmappable
    from mc_engine.rare_event import METHODS, estimate_rare_event
    from mc_engine.rare_event_lines import outcome_lines
    from mc_engine.run_folder import default_folder
    from mc_engine.store import refuse_occupied

    if method not in METHODS:
        leave(USAGE, f'--method "{method}" is not known; {" or ".join(METHODS)}')
    campaign = load_campaign(file, seed=seed)
    chosen_requirement(campaign, requirement)
    refuse_unmappable(campaign)
    path = out if out is not None else default_folder(f"{campaign.name}-rare")
    try:
        refuse_occupied(path)
    except StoreError as error:
        leave(USAGE, f"--out {error}")
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
    for line in (f"rare event   {path}", *outcome_lines(found.result)):
        typer.echo(line)
    for report_path in [] if no_report else write_reports(path, ("html", "pdf")):
        typer.echo(f"report       {report_path}")


class _Teller:
    """A line now and then: how many levels there will be is not known, so there is no remaining time."""

    def __init__(self) -> None:
        self._last = time.monotonic()

    def __call__(self, flown: int, failed: int) -> None:
        if time.monotonic() - self._last >= _SECONDS_BETWEEN_LINES:
            self._last = time.monotonic()
            typer.echo(f"{flown:,} cases, {failed:,} of them failed", err=True)
