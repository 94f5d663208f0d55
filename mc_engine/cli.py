"""The command line, `mc-engine VERB`.

Exit status: 0 done, 1 a requirement is not met (`run --judge`), 2 usage or campaign file, 3 more failed cases than
allowed (`run --max-failed`), 4 interrupted and resumable, 5 store damaged or busy.

Every verb imports what it needs itself: `--help`, `check`, `list`, `schema`, `plan` and `status` load neither
numba nor matplotlib.
"""

import importlib
import json
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from mc_engine.errors import EngineError, RunInterrupted, StoreError

if TYPE_CHECKING:
    from mc_engine.store import Store

NOT_MET, USAGE, TOO_MANY_FAILED, INTERRUPTED, DAMAGED = 1, 2, 3, 4, 5

app = typer.Typer(
    help="Monte Carlo dispersion campaigns for spacecraft guidance, navigation and control.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

CampaignFile = Annotated[
    str, typer.Argument(metavar="FILE_OR_NAME", help="A campaign file, its folder, or a shipped name such as deorbit.")
]
RunFolder = Annotated[Path, typer.Argument(metavar="RUN", help="The directory of a run.")]
Cases = Annotated[int | None, typer.Option(min=1, help="Number of cases, in place of the file's.")]
Workers = Annotated[int | None, typer.Option(min=1, help="Threads that fly cases; all cores by default.")]
NoReport = Annotated[bool, typer.Option("--no-report", help="Leave the reports out.")]


def main() -> None:
    """Run the command line of this process; does not return."""
    try:
        app(prog_name="mc-engine")
    except KeyboardInterrupt:  # before a verb was under way
        raise SystemExit(INTERRUPTED) from None


@contextmanager
def exit_status() -> Iterator[None]:
    """Turn what the engine raises on purpose into its sentence on stderr and an exit status."""
    try:
        yield
    except StoreError as error:
        _leave(DAMAGED, str(error))
    except RunInterrupted as error:
        _leave(INTERRUPTED, str(error))
    except EngineError as error:  # of the campaign, the model, or a package that is missing
        _leave(USAGE, str(error))
    except KeyboardInterrupt:
        _leave(INTERRUPTED, "interrupted")
    except OSError as error:
        _leave(USAGE, f"{error.filename}: {error.strerror}" if error.filename else str(error))


def _leave(status: int, message: str) -> NoReturn:
    typer.echo(message, err=True)
    raise typer.Exit(status) from None


def _existing_run(path: Path) -> "Store":
    """The run in `path`; a path that never was a run is a slip of the user's, not damage."""
    from mc_engine.store import is_run_directory, open_store

    if not path.exists():
        _leave(USAGE, f"{path}: there is no such folder")
    if not is_run_directory(path):
        _leave(USAGE, f"{path}: is no run directory; `mc-engine run` makes one")
    return open_store(path)


# ---- before flying


@app.command()
@exit_status()
def init(folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where the new campaign is to be.")]) -> None:
    """Copy the smallest campaign, a model and its file, to DIR as a start for your own."""
    from mc_engine.campaign import SHIPPED

    names = ("campaign.toml", "model.py")
    for name in names:
        if (folder / name).exists():
            _leave(USAGE, f"{folder / name}: is there already; choose another folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in names:
            shutil.copyfile(SHIPPED / "minimal" / name, folder / name)
    except OSError as error:
        _leave(USAGE, f"{error.filename or folder}: {error.strerror}")
    typer.echo(f"{folder}: campaign.toml and model.py; fly them with `mc-engine run {folder}`")


@app.command()
@exit_status()
def check(file: CampaignFile) -> None:
    """Read a campaign file and report everything that is wrong with it."""
    from mc_engine.campaign import load_campaign

    campaign = load_campaign(file)
    typer.echo(
        f"{campaign.name}: {campaign.cases:,} cases, design {campaign.design}, "
        f"{_counted(campaign.dispersions, 'dispersion')}, {_counted(campaign.correlations, 'correlation')}, "
        f"{_counted(campaign.requirements, 'requirement')}; no problems"
    )


def _counted(things: Any, word: str) -> str:
    return f"{len(things)} {word}{'' if len(things) == 1 else 's'}"


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
            _leave(USAGE, f"{name} is {value}; it must lie between 0 and 1, without them")
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
        _leave(USAGE, f"--out {out}: the name must end in {' or '.join(SUFFIXES)}")
    if out is not None and not out.parent.is_dir():
        _leave(USAGE, f"--out {out}: there is no folder {out.parent}")
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


# ---- flying


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
        _existing_run(upstream)
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
        _leave(USAGE, f"--out {error}")
    existing = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    if not (existing.is_dir() and os.access(existing, os.W_OK)):
        _leave(USAGE, f"--out {path}: {existing} is no folder that can be written to")


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

    reports = [] if no_report else _write_reports(store.path, ("html", "pdf"))
    typer.echo(f"run          {store.path}")
    typer.echo(f"cases        {case_line(store)}")
    judged = verdicts(store)
    for verdict in judged:
        typer.echo(f"requirement  {verdict_line(verdict, store.units)}")
    for report_path in reports:
        typer.echo(f"report       {report_path}")
    failed = failed_cases(store)
    if max_failed is not None and failed > max_failed:
        _leave(TOO_MANY_FAILED, f"{failed} cases failed; at most {max_failed} were allowed")
    if judge and any(verdict.outcome != "pass" for verdict in judged):
        _leave(NOT_MET, "not every requirement is met")


def _write_reports(path: Path, formats: tuple[str, ...]) -> list[Path]:
    # The engine imports nothing of the reports, so that it can be used and tested without them; only this verb,
    # which exists for the user's convenience, looks for them, and at the moment they are asked for.
    return importlib.import_module("reports").write_reports(path, formats=formats)


@app.command()
@exit_status()
def resume(folder: RunFolder, no_report: NoReport = False, workers: Workers = None) -> None:
    """Complete a run that was interrupted."""
    _existing_run(folder)
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

    store = _existing_run(folder)
    wanted, design = store.n_cases, store.manifest["campaign"]["design"]
    if store.manifest.get("upstream") is not None:
        _leave(USAGE, f"{folder}: takes its inputs from another run; extend that one, and fly this campaign anew")
    if design not in EXTENSIBLE:
        _leave(USAGE, f'{folder}: the design "{design}" cannot be extended; {", ".join(EXTENSIBLE)} can')
    if cases <= wanted:
        _leave(USAGE, f"--cases {cases}: {folder} has {wanted} cases; give the number it is to have in all")
    store = _fly(lambda runner, progress: runner.extend(folder, cases, progress=progress, workers=workers))
    _finish(store, no_report)


@app.command()
@exit_status()
def replay(folder: RunFolder, case: Annotated[int, typer.Argument(metavar="CASE", min=0, help="Its case_id.")]) -> None:
    """Fly one case again, alone: compare every stored number bit for bit, and write and plot its history."""
    store = _existing_run(folder)
    if store.missing(range(case, case + 1)):
        _leave(USAGE, f"{folder}: case {case} is not there; the run has {_ranges(store.committed())}")
    from mc_engine import runner
    from mc_engine.replay_files import write_replay

    flight = runner.replay(folder, case)
    for path in write_replay(store, case, flight.history):
        typer.echo(str(path))
    if not flight.equal:
        for difference in flight.differences:
            typer.echo(str(difference), err=True)
        _leave(DAMAGED, f"case {case} is not the one in {folder}: the run was changed, or flown by other sources")
    typer.echo(f"case {case}: every stored number has the same bits")


def _ranges(ranges: list[tuple[int, int]]) -> str:
    return ", ".join(f"{first} to {stop - 1}" for first, stop in ranges) or "none"


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
    """Search the parameters that [tuning] names for the best metrics, and write front and reports (needs pymoo)."""
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
    for report_path in [] if no_report else _write_reports(path, ("html", "pdf")):
        typer.echo(f"report       {report_path}")


# ---- after flying


@app.command()
@exit_status()
def report(
    folder: RunFolder,
    kind: Annotated[str | None, typer.Option("--format", help="html or pdf; both by default.")] = None,
) -> None:
    """Write the reports of a run, or of a tuning, anew."""
    from mc_engine.tuning_folder import is_tuning_directory

    if kind not in (None, "html", "pdf"):
        _leave(USAGE, f'--format "{kind}" is not known; html or pdf')
    path = folder if is_tuning_directory(folder) else _existing_run(folder).path
    for written in _write_reports(path, ("html", "pdf") if kind is None else (kind,)):
        typer.echo(str(written))


@app.command()
@exit_status()
def status(folder: RunFolder) -> None:
    """How far a run is, and how its cases ended."""
    from mc_engine.run_summary import case_line
    from mc_engine.writer_lock import described, holder

    store = _existing_run(folder)
    typer.echo(f"run       {folder}")
    typer.echo(f"campaign  {store.manifest['campaign'].get('name', '')}")
    typer.echo(f"cases     {case_line(store)}")
    writer = holder(folder)
    missing = store.missing()
    if writer is not None:
        typer.echo(f"flying    by {described(writer)}")
    elif missing:
        typer.echo(f"missing   {_ranges(missing)}; `mc-engine resume {folder}` flies them")
    elif lost := store.lost_files():
        _leave(DAMAGED, f"{folder}/{lost[0]}: is gone; `mc-engine verify {folder}` names all damage")
    else:
        typer.echo("complete")


@app.command()
@exit_status()
def verify(folder: RunFolder) -> None:
    """Hold every byte of a run against its journal."""
    from mc_engine.store import is_run_directory
    from mc_engine.verification import damage

    if not is_run_directory(folder):
        _existing_run(folder)
    problems = damage(folder)
    for problem in problems:
        typer.echo(f"{folder}/{problem}", err=True)
    if problems:
        _leave(DAMAGED, f"{folder}: {_counted(problems, 'problem')}")
    typer.echo(f"{folder}: every byte is as it was written")
