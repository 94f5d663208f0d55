"""The commands on a single case: debug and replay."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from mc_engine.command_line.app import (
    DAMAGED,
    USAGE,
    CampaignFile,
    RunFolder,
    app,
    existing_run,
    exit_status,
    leave,
    ranges,
    replay_picture,
)
from mc_engine.errors import StoreError
from mc_engine.suggestions import hint, listed

if TYPE_CHECKING:
    from mc_engine.runner.debugging import Debugged, Stop


@app.command()
@exit_status()
def debug(
    file: CampaignFile,
    case: Annotated[int | None, typer.Option(min=0, help="Its case_id; by default the nominal case.")] = None,
    at_time: Annotated[
        float | None,
        typer.Option(min=0.0, metavar="S", help="Stop in the first call of rhs at this time [s] or later."),
    ] = None,
    at_event: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Stop when this event happens: in switch, in the next rhs where the model has no switch, or in "
            "observe or evaluate where it ends the case. A delayed event happens at its crossing, and as NAME_due when "
            "it acts.",
        ),
    ] = None,
    at_nan: Annotated[
        bool,
        typer.Option("--at-nan", help="Stop at the line that ends the flight by a result that is infinite or NaN."),
    ] = False,
) -> None:
    """Fly one case by Python and stop in a debugger. It stops inside the model's own functions.

    Without an option it stops at the first line of rhs, at the start. If the physics contains breakpoint() or print, it
    stops only at each breakpoint(). The debugger is that of Python's breakpoint(): pdb, or the one that
    PYTHONBREAKPOINT names. Without a terminal it reads its commands from standard input.
    """
    from bdb import BdbQuit

    from mc_engine.campaign.loading import load_campaign
    from mc_engine.model.faults import naming_faults
    from mc_engine.model.simulator import Simulator

    if sum([at_time is not None, at_event is not None, at_nan]) > 1:
        leave(USAGE, "--at-time, --at-event, --at-nan: choose one of them")
    campaign = load_campaign(file)
    if isinstance(campaign.model, Simulator):
        leave(USAGE, f"{file}: flies a simulator, which has no physics to stop in; debug its own program")
    from mc_engine.runner.debugging import Stop, fly_debugged, has_own_stops
    from mc_engine.runner.histories import inputs_of

    if at_event is not None:
        _refuse_unknown_event(campaign.model, at_event)
    stop: Stop | None = Stop(at_time, at_event, at_nan)
    if stop == Stop() and has_own_stops(campaign.model):
        stop = None
    inputs, noise = inputs_of(campaign, case)
    if case is not None and case >= campaign.cases:
        typer.echo(
            f"the campaign has the cases 0 to {campaign.cases - 1}; {case} is one that `extend` would add", err=True
        )
    who = "the nominal case" if case is None else f"case {case}"
    with naming_faults(campaign.model_reference, who):
        try:
            ended = fly_debugged(campaign.model, inputs, noise, campaign.seed, stop, typer.echo)
        except BdbQuit:  # the user left the debugger
            return
    _echo_end(who, ended, stop)


def _refuse_unknown_event(model: Any, name: str) -> None:
    known = [event.name for event in model.event_list]
    if name not in known:
        has = f"; it has {listed(known)}" if known else "; it has none"
        leave(USAGE, f'--at-event "{name}": is no event of the model{hint(name, known) or has}')


def _echo_end(who: str, ended: "Debugged", stop: "Stop | None") -> None:
    if stop is not None and not ended.stopped:
        missed = (
            "no number broke the flight"
            if stop.not_finite
            else (
                f'the event "{stop.event}" did not happen' if stop.event else f"it did not come to t = {stop.time:g} s"
            )
        )
        typer.echo(f"not stopped: {missed}", err=True)
    metrics = "".join(f", {name} = {value:.6g}" for name, value in ended.metrics.items() if ended.status == "ok")
    typer.echo(f"{who}: {ended.status} at t = {ended.end_time:.6g} s{metrics}")


# then the message for -1 is that it is no case, instead of no option
@app.command(context_settings={"ignore_unknown_options": True})
@exit_status()
def replay(folder: RunFolder, case: Annotated[int, typer.Argument(metavar="CASE", min=0, help="Its case_id.")]) -> None:
    """Fly one case again and compare it bit for bit. Its time history is written and plotted.

    The numbers of a simulator that is not deterministic are compared within its tolerance.
    """
    store = existing_run(folder)
    if store.missing(range(case, case + 1)):
        leave(USAGE, f"{folder}: case {case} is not there; the run has {ranges(store.committed())}")
    from mc_engine.runner import runner
    from mc_engine.runner.summary import failure_words
    from mc_engine.studies.replay_files import write_replay

    flight = runner.replay(folder, case)
    if flight.lost:
        typer.echo(flight.lost)
    if not flight.equal:
        for difference in flight.differences:
            typer.echo(str(difference), err=True)
    elif flight.tolerance is None:
        typer.echo(f"case {case}: every stored number has the same bits")
    else:
        within = f"within the tolerance of its simulator, {flight.tolerance:g} of the number"
        typer.echo(f"case {case}: every stored number is {within}; bits were not compared")
    if failed := failure_words(flight.row):
        typer.echo(f"case {case} {failed}")
    if store.manifest.get("quantities") and not len(flight.history):
        typer.echo(f"case {case} has no history")
    elif store.manifest.get("quantities"):  # a simulator without outputs has no history
        try:
            for path in write_replay(store, case, flight.history, replay_picture(store, case, flight.history)):
                typer.echo(str(path))
        except StoreError as error:
            why = f"case {case} was compared; its history and picture were not written: {error}"
            if flight.equal:
                raise type(error)(why) from error
            typer.echo(why, err=True)
    if not flight.equal:
        from mc_engine.studies.run_changes import changed_lines, machine_changes

        others = "; ".join(changed_lines(machine_changes(store.manifest)))
        why = f"it is of another machine ({others})" if others else "its results depend on more than its inputs"
        leave(DAMAGED, f"case {case} is not the one in {folder}: the run was changed, or {why}")
