"""The command that times a campaign: bench."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from mc_engine.command_line.app import CampaignFile, app, exit_status

if TYPE_CHECKING:
    from mc_engine.studies.lane_speed import Timing

_REPEATS = 20


@app.command()
@exit_status()
def bench(
    file: CampaignFile,
    cases: Annotated[
        int | None,
        typer.Option(min=1, max=10_000_000, help="Cases of a flight; by default those of a short time."),
    ] = None,
    repeats: Annotated[
        int, typer.Option(min=1, max=10_000, help="Flights of each build; the fastest counts.")
    ] = _REPEATS,
) -> None:
    """How fast a campaign flies on one thread, and how much faster its cases fly side by side than one at a time.

    Only the flights are timed: compiling, sampling and storing are not. Nothing is stored.
    """
    from mc_engine.campaign.loading import load_campaign
    from mc_engine.flight.kernel import usual_width
    from mc_engine.model.faults import naming_faults
    from mc_engine.studies.lane_speed import campaign_flight, measure

    campaign = load_campaign(file)
    with naming_faults(campaign.model_reference, "the model"):
        flight = campaign_flight(campaign, cases)
        timing = measure(flight, sorted({1, 8, usual_width(campaign.model)}), repeats)
    typer.echo(f"{campaign.name}: {flight.n_cases} cases a flight, the fastest of {repeats}, one thread")
    for line in _lines(timing, usual_width(campaign.model)):
        typer.echo(line)


def _lines(timing: "Timing", usual: int) -> Iterator[str]:
    for width, seconds in timing.case_s.items():
        title = "one case at a time" if width == 1 else f"{width} side by side"
        step = f", {timing.ns[width]:6.1f} ns a step" if width in timing.ns else ""
        factor = "" if width == 1 else f", {timing.ratio(width):5.2f} times as fast"
        mark = " (as `run`)" if width == usual else ""
        yield f"  {title:<18} {1.0 / seconds:9,.0f} cases/s{step}{factor}{mark}"
