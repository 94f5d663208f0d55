"""The commands that fly cases: run, resume, extend, rerun, merge."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mc_engine.command_line.after_flight import echo_publication
from mc_engine.command_line.app import (
    DAMAGED,
    NOT_MET,
    TOO_MANY_FAILED,
    USAGE,
    BackendName,
    CampaignFile,
    Cases,
    CaseSeconds,
    Memory,
    NoReport,
    Patience,
    Publish,
    RunFolder,
    Scheduler,
    Workers,
    app,
    echo_preparation,
    existing_run,
    exit_status,
    leave,
    new_folder,
    ranges,
    refuse_occupied_folder,
    run_here,
    write_reports,
)
from mc_engine.command_line.next_step import MERGE, after_flight, after_merge, after_run, is_complete, journal_lines
from mc_engine.errors import DiskError, RunInterrupted, UsageError
from mc_engine.interruption import NOTHING_BEGUN, advise, raise_if_signalled
from mc_engine.numbers_in_text import counted
from mc_engine.shell_words import shell_word
from mc_engine.status import MOST_CASES
from mc_engine.store.run_files import default_folder

if TYPE_CHECKING:
    from mc_engine.runner.shards import Shard
    from mc_engine.store.store import Store


@app.command()
@exit_status()
def run(
    context: typer.Context,
    file: CampaignFile,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Directory of the run; by default runs/<campaign>-<time>.", parser=new_folder),
    ] = None,
    cases: Cases = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed, in place of the file's.")] = None,
    no_report: NoReport = False,
    workers: Workers = None,
    backend: BackendName = "threading",
    scheduler: Scheduler = None,
    case_seconds: CaseSeconds = None,
    memory: Memory = None,
    patience: Patience = None,
    shard: Annotated[
        str | None, typer.Option(metavar="K/N", help="Fly shard K of N; `merge` joins the shards.")
    ] = None,
    upstream: Annotated[
        Path | None,
        typer.Option(
            "--from",
            metavar="RUN",
            help="Run to take inputs from, in place of the one in [inputs].",
            parser=run_here,
        ),
    ] = None,
    judge: Annotated[bool, typer.Option("--judge", help="Exit with 1 unless all requirements are met.")] = False,
    max_failed: Annotated[int | None, typer.Option(min=0, help="Exit with 3 if more cases fail.")] = None,
    publish: Publish = None,
    until: Annotated[
        str | None,
        typer.Option(help='"verdict": stop as soon as all requirements are decided, at latest after all cases.'),
    ] = None,
    watch: Annotated[
        bool,
        typer.Option("--watch", help="Fly 200 cases, or --cases, on every saved change; show a page in --out."),
    ] = False,
) -> None:
    """Fly a campaign and write its reports."""
    if watch:
        from mc_engine.command_line.watching import watch_campaign

        watch_campaign(file, out, context)
        return
    advise(lambda: NOTHING_BEGUN)
    from mc_engine.campaign.loading import load_campaign

    if upstream is not None:
        existing_run(upstream)
    _refuse_publication(publish)
    if until not in (None, "verdict"):
        leave(USAGE, f'--until "{until}" is not known; the word is verdict')
    if shard is not None and out is None:
        leave(USAGE, "--shard needs --out, a folder of each shard's own")
    if shard is not None and (until is not None or judge):
        option = "--judge" if until is None else "--until"
        leave(USAGE, f"--shard and {option}: a shard alone decides nothing; judge the run that `merge` makes")
    campaign = load_campaign(file, cases=cases, seed=seed, upstream=upstream)
    path = out if out is not None else default_folder(campaign.name)
    refuse_occupied_folder(path)
    options = _worker_options(path, workers, backend, scheduler, case_seconds, memory, patience, publish)
    publisher = _publisher(path, publish)
    if campaign.sensitivity is not None and shard is None:  # the progress counts them, whatever --cases says
        flights = f"{campaign.sensitivity.flights:,} further cases"
        typer.echo(f"{flights} are flown for the contributions of the inputs, see [sensitivity]", err=True)
    if until is None:
        piece = _shard(shard)
        store = _with_progress(
            lambda runner, note: runner.run(campaign, path, progress=note, shard=piece, **options),
            campaign.model,
            publisher,
        )
    else:
        from mc_engine.runner.stopping import fly_until_decided, refuse_undecidable

        refuse_undecidable(campaign)
        store = _with_progress(
            lambda _, note: fly_until_decided(campaign, path, progress=note, **options), campaign.model, publisher
        )
    finish(store, no_report, judge, max_failed, publish, file)


def _worker_options(
    folder: Path,
    workers: int | None,
    backend: str,
    scheduler: str | None,
    case_seconds: float | None,
    memory: int | None,
    patience: float | None,
    url: str | None = None,
    rerun: bool = False,
) -> dict[str, Any]:
    """The runner's arguments on workers, from the options of a command.

    Afterwards the message of an interruption names the command that continues the run in `folder`.
    """
    from mc_engine.runner.backends import Backend

    chosen = Backend(backend, scheduler, case_seconds, memory, patience)
    lines = journal_lines(folder)
    advise(lambda: after_flight(folder, chosen.options(), url, rerun, lines))
    return {"workers": workers, "backend": chosen}


def _shard(text: str | None) -> "Shard | None":
    from mc_engine.runner.shards import Shard

    try:
        return None if text is None else Shard.parse(text)
    except UsageError as error:
        leave(USAGE, f"--shard {error}")


def _refuse_publication(url: str | None, run: Path | None = None) -> None:
    """End the command if the run, None for a new one, cannot be copied to the URL; called before a long flight."""
    if url is not None:
        from mc_engine.store.object_store import refuse_publication

        refuse_publication(url, run)


@contextmanager
def _publisher(path: Path, url: str | None) -> Iterator[None]:
    """Keeps a copy of the run in `path` at `url` up to date, if a URL is given."""
    from mc_engine.store.object_store import Publisher

    try:
        with nullcontext() if url is None else Publisher(path, url):
            yield
    except RunInterrupted as error:
        copy = f"; with --publish {shell_word(url)} it keeps the copy there up to date" if url else ""
        raise RunInterrupted(f"{error}{copy}") from error


def _with_progress(
    fly: Callable[[Any, Any], "Store"], system: Any, publisher: AbstractContextManager[Any] | None = None
) -> "Store":
    """The result of `fly(runner, progress)`; shows the progress and publishes the run during the flight."""
    from mc_engine.runner import runner
    from mc_engine.runner.progress import Progress

    with Progress() as progress, publisher or nullcontext():
        if not progress.stream.isatty():
            echo_preparation(system)
        return fly(runner, progress)


def finish(
    store: "Store",
    no_report: bool,
    judge: bool = False,
    max_failed: int | None = None,
    url: str | None = None,
    campaign: str | None = None,
) -> None:
    """Write the reports of a run, print the summary, and set the exit status according to --judge and --max-failed."""
    from mc_engine.runner import summary

    shard = store.manifest.get("shard")
    if url is not None or not (no_report or shard):
        raise_if_signalled()  # by a signal that came too late to stop the flight: it stops what is left to do
    if shard:
        if url is not None:
            echo_publication(store.path, url)
        _finish_shard(store, max_failed)
        return
    reports = [] if no_report else write_reports(store.path, ("html", "pdf"))
    typer.echo(f"run          {store.path}")
    typer.echo(f"cases        {summary.case_line(store)}")
    if nominal := summary.nominal_line(store):
        typer.echo(f"nominal      {nominal}")
    if analyses := summary.analyses_line(store):
        typer.echo(f"analyses     {analyses}")
    judged, joint = summary.outcomes(store)
    for verdict in (*judged, joint) if joint is not None else judged:
        typer.echo(f"requirement  {summary.verdict_line(verdict, store.units)}")
    for name, remark in summary.remarks(store):
        typer.echo(f"{name:12} {remark}")
    for report_path in reports:
        typer.echo(f"report       {report_path}")
    if url is not None:
        echo_publication(store.path, url)
    counts = store.status_counts()
    failed = summary.failed_cases(counts)
    if failed == sum(counts.values()):
        named = shell_word(campaign or store.path / "campaign.toml")
        look = f"`mc-engine check {named}` looks for the reason"
        why = "the column `reason` of its cases says why" if store.manifest.get("imported") else look
        typer.echo(f"no case completed; {why}", err=True)
    elif line := summary.failure_line(store):
        typer.echo(line)
    judge_failures(failed, max_failed)
    if judge and any(verdict.outcome != "pass" for verdict in judged):
        leave(NOT_MET, "not every requirement is met")


def _finish_shard(store: "Store", max_failed: int | None) -> None:
    from mc_engine.runner.summary import failed_cases

    counts = store.status_counts()
    typer.echo(f"shard        {store.path}")
    typer.echo(f"cases        {ranges(store.committed())}: " + ", ".join(f"{n:,} {word}" for word, n in counts.items()))
    typer.echo(f"next         {MERGE}")
    judge_failures(failed_cases(counts), max_failed)


def judge_failures(failed: int, allowed: int | None) -> None:
    if allowed is not None and failed > allowed:
        leave(TOO_MANY_FAILED, f"{counted(failed, 'case')} failed; at most {allowed} were allowed")


@app.command()
@exit_status()
def resume(
    folder: RunFolder,
    no_report: NoReport = False,
    workers: Workers = None,
    backend: BackendName = "threading",
    scheduler: Scheduler = None,
    case_seconds: CaseSeconds = None,
    memory: Memory = None,
    patience: Patience = None,
    repair: Annotated[bool, typer.Option("--repair", help="Fly the cases of damaged files again.")] = False,
    publish: Publish = None,
) -> None:
    """Complete a run that was interrupted."""
    options = _worker_options(folder, workers, backend, scheduler, case_seconds, memory, patience, publish)
    options["repair"] = repair
    if repair:
        from mc_engine.store.repair import mend_journal

        mend_journal(folder)
    flown = existing_run(folder)
    _refuse_publication(publish, folder)
    looks = flown.manifest.get("looks")
    if not repair and not looks and is_complete(folder):
        _leave_complete(flown, publish)
        return
    from mc_engine.runner.stopping import carry_on

    store = _with_progress(
        lambda runner, note: (carry_on if looks else runner.resume)(folder, progress=note, **options),
        folder,
        _publisher(folder, publish),
    )
    finish(store, no_report, url=publish)


def _leave_complete(store: "Store", url: str | None) -> None:
    from mc_engine.store.verification import REPAIR, damages, remedies

    folder = store.path
    if damaged := [item for item in damages(folder) if item.mended_by == REPAIR]:
        leave(DAMAGED, f"{folder}/{damaged[0].what}; {remedies(folder, damaged)[0]}")
    typer.echo(f"{folder}: is complete; {after_run(store)}")
    if url is not None:
        echo_publication(folder, url)


@app.command()
@exit_status()
def extend(
    folder: RunFolder,
    cases: Annotated[int, typer.Option(min=1, help="New total number of cases.")],
    no_report: NoReport = False,
    workers: Workers = None,
    backend: BackendName = "threading",
    scheduler: Scheduler = None,
    case_seconds: CaseSeconds = None,
    memory: Memory = None,
    patience: Patience = None,
    publish: Publish = None,
) -> None:
    """Add cases to a run. A run of 1000 cases extended to 2000 equals a run of 2000 cases."""
    from mc_engine.sampling.designs import extension_problem

    store = existing_run(folder)
    _refuse_publication(publish, folder)
    if sentence := extension_problem(store.manifest, store.n_cases, cases):
        leave(USAGE, f"{folder}: {sentence}")
    options = _worker_options(folder, workers, backend, scheduler, case_seconds, memory, patience, publish)
    store = _with_progress(
        lambda runner, note: runner.extend(folder, cases, progress=note, **options), folder, _publisher(folder, publish)
    )
    finish(store, no_report, url=publish)


@app.command()
@exit_status()
def rerun(
    folder: RunFolder,
    failed: Annotated[bool, typer.Option("--failed", help="Fly the failed cases; required.")] = False,
    no_report: NoReport = False,
    workers: Workers = None,
    backend: BackendName = "loky",
    scheduler: Scheduler = None,
    case_seconds: CaseSeconds = None,
    memory: Memory = None,
    patience: Patience = None,
) -> None:
    """Fly the failed cases of a run again. They fly in processes, in case their worker was killed from outside."""
    store = existing_run(folder)
    if not failed:
        leave(USAGE, "rerun flies only failed cases again: add --failed; the others would come out with the same bits")
    if store.missing():
        leave(USAGE, f"{folder}: is not complete; `mc-engine resume {shell_word(folder)}` flies the rest first")
    if not store.status_counts().keys() - {"ok"}:
        typer.echo(f"{folder}: no case failed; there is nothing to fly again")
        return
    options = _worker_options(folder, workers, backend, scheduler, case_seconds, memory, patience, rerun=True)
    again = _with_progress(lambda runner, progress: runner.rerun(folder, progress=progress, **options), folder)
    finish(again, no_report)


@app.command()
@exit_status()
def merge(
    out: Annotated[Path, typer.Argument(metavar="RUN", help="Directory of the new run.", parser=new_folder)],
    shards: Annotated[
        list[Path], typer.Argument(metavar="SHARD...", help="Directories made by `run --shard`.", parser=run_here)
    ],
    no_report: NoReport = False,
    chunk: Annotated[
        int | None, typer.Option(min=1, max=MOST_CASES, help="Cases in each file; by default as `run` does.")
    ] = None,
    workers: Workers = None,
) -> None:
    """Join the shards of a campaign into one run. Its table is that of a run without shards."""
    for shard in shards:
        existing_run(shard)
    refuse_occupied_folder(out, option="")
    advise(lambda: after_flight(out))
    try:
        store = _with_progress(
            lambda runner, progress: runner.merge(out, shards, progress=progress, workers=workers, chunk=chunk),
            shards[0],
        )
    except DiskError as error:
        raise DiskError("; ".join(filter(None, [str(error), after_merge(out)]))) from error
    finish(store, no_report)
