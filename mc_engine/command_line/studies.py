"""The commands on several runs, and on results beyond one run: import, tune, rare, compare, published, bench."""

import importlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mc_engine.command_line.app import (
    USAGE,
    CampaignFile,
    Cases,
    NoReport,
    Workers,
    app,
    beginning,
    echo_preparation,
    existing_run,
    exit_status,
    leave,
    new_file,
    new_folder,
    refuse_occupied_folder,
    refuse_unwritable_file,
    run_at,
    write_reports,
)
from mc_engine.command_line.flight import finish
from mc_engine.command_line.next_step import after_search
from mc_engine.durable_file import write_durably
from mc_engine.interruption import NOTHING_BEGUN, advise, in_threads, raise_if_signalled
from mc_engine.store.run_files import default_folder

if TYPE_CHECKING:
    from mc_engine.campaign.loading import Campaign
    from mc_engine.studies.lane_speed import Timing

CHANGED = 1  # the exit status of `compare`
_SECONDS_BETWEEN_LINES = 5.0
_REPEATS = 20
_FEWEST_OF_LEVEL = 500  # cases, which both methods need


@app.command("import")
@exit_status()
def import_(
    results: Annotated[
        Path, typer.Argument(metavar="FILE", help="Table of results, .parquet or .csv.", parser=new_file)
    ],
    campaign: Annotated[str, typer.Option(metavar="FILE_OR_NAME", help="The campaign of the cases.")],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Directory of the new run.", parser=new_folder)],
    history: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Table of time histories: case_id, t_s, outputs.", parser=new_file),
    ] = None,
    cases: Cases = None,
    no_report: NoReport = False,
) -> None:
    """Make a run from results of another program. They are a table of case_id, inputs and metrics.

    The inputs must agree with those of `mc-engine sample` for the campaign.
    """
    from mc_engine.campaign.loading import load_campaign
    from mc_engine.runner.importing import import_results

    loaded = load_campaign(campaign, cases=cases)
    refuse_occupied_folder(out)
    finish(import_results(loaded, results, out, history), no_report)


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
        int | None, typer.Option(min=1, max=100_000, help="Number of generations, in place of the file's.")
    ] = None,
    population: Annotated[
        int | None, typer.Option(min=4, max=100_000, help="Candidates in a generation, in place of the file's.")
    ] = None,
    no_report: NoReport = False,
    workers: Workers = None,
) -> None:
    """Search for the parameters with the best metrics. [tuning] of FILE specifies both (needs pymoo)."""
    advise(lambda: NOTHING_BEGUN)
    from mc_engine.campaign.loading import load_campaign

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
    _echo_result(path, [f"tuning       {path}", *tuning_lines(record)], no_report)


@app.command()
@exit_status()
def rare(
    file: CampaignFile,
    requirement: Annotated[str | None, typer.Option(help="Its name; not needed for a single one.")] = None,
    method: Annotated[
        str, typer.Option(help="subset or cross-entropy.", autocompletion=beginning(("subset", "cross-entropy")))
    ] = "subset",
    cases_per_level: Annotated[
        int, typer.Option(min=_FEWEST_OF_LEVEL, max=10_000_000, help="Number of cases at each level.")
    ] = 10_000,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed, in place of the file's.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Directory of the result; by default runs/<campaign>-…", parser=new_folder),
    ] = None,
    no_report: NoReport = False,
    workers: Workers = None,
) -> None:
    """Estimate how probable it is that a requirement is not met. The probability may be down to one in millions."""
    advise(lambda: NOTHING_BEGUN)
    from mc_engine.campaign.loading import load_campaign
    from mc_engine.studies.limit_state import chosen_requirement, refuse_unmappable
    from mc_engine.studies.rare_event import METHODS, estimate_rare_event
    from mc_engine.studies.rare_event_folder import rare_event_lines

    if method not in METHODS:
        leave(USAGE, f'--method "{method}" is not known; {" or ".join(METHODS)}')
    campaign = load_campaign(file, seed=seed)
    refuse_unmappable(campaign, chosen_requirement(campaign, requirement))
    path = out if out is not None else default_folder(f"{campaign.name}-rare")
    refuse_occupied_folder(path)
    advise(lambda: after_search(path, "rare.json", "the estimate is"))
    echo_preparation(campaign.model)
    lines = _ProgressLines()
    estimate = estimate_rare_event(
        campaign,
        requirement,
        path,
        method=method,
        cases_per_level=cases_per_level,
        workers=workers,
        progress=lambda flown, failed: lines.tell(f"{flown:,} cases, {failed:,} of them outside the limit"),
    )
    _echo_result(path, [f"rare event   {path}", *rare_event_lines(estimate.result)], no_report)


def _echo_result(path: Path, lines: list[str], no_report: bool) -> None:
    """Print the lines of a result, and write its reports."""
    raise_if_signalled()
    for line in lines:
        typer.echo(line)
    for report_path in [] if no_report else write_reports(path, ("html", "pdf")):
        typer.echo(f"report       {report_path}")


class _ProgressLines:
    """Prints a line every few seconds."""

    def __init__(self) -> None:
        self.begin = self._last = time.monotonic()

    def tell(self, line: str) -> None:
        if time.monotonic() - self._last >= _SECONDS_BETWEEN_LINES:
            self._last = time.monotonic()
            typer.echo(line, err=True)


@app.command()
@exit_status()
def compare(
    before: Annotated[str, typer.Argument(metavar="A", help="Directory or URL of the run before the change.")],
    after: Annotated[str, typer.Argument(metavar="B", help="Directory or URL of the run after the change.")],
    alpha: Annotated[
        float, typer.Option(help="Probability of one or more false alarms in all tests together, above 0, below 1.")
    ] = 0.003,
    tolerance: Annotated[
        float, typer.Option(min=0.0, help="Smaller differences of a pair, in standard deviations, are ignored.")
    ] = 1e-6,
    report: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE", help="File for the comparison, .html or .pdf; may be given twice.", parser=new_file
        ),
    ] = None,
) -> None:
    """Test which results changed significantly from run A to run B.

    Exit status 0: no significant change; 1: a metric or a fraction of cases changed, or a requirement has a
    worse verdict on the same cases.
    """
    wrong = [path for path in report or [] if path.suffix not in (".html", ".pdf")]
    if wrong:
        leave(USAGE, f"--report {wrong[0]}: the name must end in .html or .pdf")
    for path in report or ():
        refuse_unwritable_file("--report", path)
    if not 0.0 < alpha < 1.0:
        leave(USAGE, f"--alpha {alpha:g}: must lie between 0 and 1, such as 0.003")
    a, b = existing_run(run_at(before)), existing_run(run_at(after))
    from mc_engine.studies.comparison import compare_runs
    from mc_engine.studies.comparison_lines import comparison_lines

    comparison = compare_runs(a, b, (before, after), alpha=alpha, tolerance=tolerance)
    for line in comparison_lines(comparison):
        typer.echo(line)
    for path in report or []:
        importlib.import_module("reports.studies.comparison").write_comparison(comparison, path, (a, b))
        typer.echo(str(path))
    if comparison.changed:
        raise typer.Exit(CHANGED)


@app.command()
@exit_status()
def published(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Campaigns whose values are all listed.")
    ] = None,
    compute: Annotated[
        bool, typer.Option("--compute", help="Compute the values anew; runs code of the campaigns.")
    ] = False,
    no_slow: Annotated[
        bool, typer.Option("--no-slow", help="With --compute: use the stored values of slow records.")
    ] = False,
    update_lock: Annotated[
        bool, typer.Option("--update-lock", help="With --compute: store the values in published.lock.toml.")
    ] = False,
    write: Annotated[
        Path | None,
        typer.Option(
            parser=new_file,
            metavar="FILE",
            help="Markdown file to insert it into, between <!-- published --> and <!-- end -->.",
        ),
    ] = None,
) -> None:
    """Compare published values with ours, as Markdown. Outcomes: reached, close, improved, not reached, unknown.

    Without a name: the number of each outcome in the shipped campaigns, and the headline numbers.  Our values are read
    from `published.lock.toml`, unless --compute is given.
    """
    from mc_engine.studies.published_table import (
        campaign_table,
        headline_table,
        published_file,
        published_files,
        written_into,
    )

    if (no_slow or update_lock) and not compute:
        leave(USAGE, f"--{'no-slow' if no_slow else 'update-lock'} is for --compute")
    if compute and not names:
        leave(USAGE, "--compute needs the NAME of a campaign")
    tables = []
    for name in names or ():
        path = published_file(name)
        tables.append(campaign_table(path, _computed(path, not no_slow, update_lock) if compute else None))
    text = "\n\n".join(tables or [headline_table(published_files())])
    if write is None:
        typer.echo(text)
    else:
        write_durably(write, written_into(write, text).encode())


def _computed(path: Path, slow: bool, update_lock: bool) -> dict[str, float | str]:
    """Our values, computed now; prints on stderr which differ from the stored ones."""
    advise(lambda: NOTHING_BEGUN)
    from mc_engine.studies.published import differing, kept_values, read_published
    from mc_engine.studies.published_values import computed_values, write_lock

    records, kept = read_published(path), kept_values(path)
    lines = _ProgressLines()
    values = computed_values(
        path, slow=slow, progress=lambda done, total, name: lines.tell(f"{done} of {total} values, now {name}")
    )
    typer.echo(f"{len(values)} values in {time.monotonic() - lines.begin:.1f} s", err=True)
    if not slow:
        values |= {
            record["quantity"]: kept[record["quantity"]]
            for record in records
            if record.get("slow") and record["quantity"] in kept
        }
    for quantity in differing(records, values, kept) if kept else ():
        typer.echo(f"{quantity}: {values.get(quantity, 'none')}, kept is {kept.get(quantity, 'none')}", err=True)
    if update_lock:
        typer.echo(f"kept in {write_lock(path, values, records).name}", err=True)
    return values


@app.command()
@exit_status()
def bench(
    file: CampaignFile,
    cases: Annotated[
        int | None,
        typer.Option(min=1, max=10_000_000, help="Cases in each flight; by default as many as take a short time."),
    ] = None,
    repeats: Annotated[
        int, typer.Option(min=1, max=10_000, help="Flights per measurement; the fastest counts.")
    ] = _REPEATS,
    methods: Annotated[
        bool, typer.Option("--methods", help="Find the fastest integration method with the error of the model's own.")
    ] = False,
    card: Annotated[
        bool,
        typer.Option("--card", help="Measure cards and all cores of this machine; --backend auto uses the result."),
    ] = False,
) -> None:
    """Measure the speed of a campaign on one thread. One case at a time is compared with SIMD batches.

    With --methods, every method is timed with the longest step, or the loosest tolerance, at which its error is that of
    the model's own method. Only flights are timed, not compiling, sampling and storing. Nothing is stored.
    """
    from mc_engine.campaign.loading import load_campaign
    from mc_engine.flight.kernel import registers, usual_width
    from mc_engine.model.faults import naming_faults
    from mc_engine.studies.lane_speed import campaign_flight, measure

    if methods and card:
        raise typer.BadParameter("--methods and --card are two measurements; ask for one of them")
    campaign = load_campaign(file)
    _say_all_fly(campaign, cases)
    if methods:
        _echo_methods(campaign, cases, repeats)
        return
    if card:
        _bench_card(campaign, cases)
        return
    with naming_faults(campaign.model_reference, "the model"):
        [flight] = in_threads(lambda campaign: campaign_flight(campaign, cases), [campaign])
        widths = (1, registers().doubles, 2 * registers().doubles)
        [timing] = in_threads(lambda flight: measure(flight, widths, repeats), [flight])
    typer.echo(f"{campaign.name}: {flight.n_cases} cases a flight, the fastest of {repeats}, one thread")
    for line in _timing_lines(timing, usual_width(flight.model)):
        typer.echo(line)


def _say_all_fly(campaign: "Campaign", cases: int | None) -> None:
    """Say that there are fewer cases than asked for, where the design cannot have more."""
    from mc_engine.campaign.cases import is_endless

    if cases is not None and cases > campaign.cases and campaign.first is None and not is_endless(campaign):
        typer.echo(f"--cases {cases:,}: {campaign.name} has {campaign.cases:,} cases by its design; all fly", err=True)


def _echo_methods(campaign: "Campaign", cases: int | None, repeats: int) -> None:
    from mc_engine.model.faults import naming_faults
    from mc_engine.studies.lane_speed import compare_methods

    with naming_faults(campaign.model_reference, "the model"):
        [[own, *others]] = in_threads(lambda campaign: compare_methods(campaign, cases, repeats), [campaign])
    typer.echo(f"{campaign.name}: methods at the error of the model's own, one thread")
    said = ["the model's own", own.metric, f"without {', '.join(own.left_out)}" if own.left_out else ""]
    whose = f"  ({'; '.join(filter(None, said))})"
    for timing in (own, *others):
        mark = f", {own.case_s / timing.case_s:5.2f} times as fast" if timing is not own else whose
        method, case_us = timing.clock.method, timing.case_s * 1e6
        typer.echo(f"  {method:<7} {timing.setting:<26} error {timing.error:.1e} {case_us:10,.2f} µs a case{mark}")
    ahead = others and others[0].case_s < own.case_s
    typer.echo(f"the fastest: clock={others[0].declaration}" if ahead else "the fastest: the model's own")


def _bench_card(campaign: "Campaign", cases: int | None) -> None:
    from mc_engine.model.faults import naming_faults
    from mc_engine.runner.backends import measure_card

    with naming_faults(campaign.model_reference, "the model"):
        processor, card = measure_card(campaign, cases)
    typer.echo(f"{campaign.name}: all cores {processor:,.0f} cases/s, a card {card:,.0f} cases/s")


def _timing_lines(timing: "Timing", usual: int) -> Iterator[str]:
    for width, seconds in timing.case_s.items():
        title = "one case at a time" if width == 1 else f"{width} side by side"
        step = f", {timing.ns[width]:6.1f} ns a step" if width in timing.ns else ""
        factor = "" if width == 1 else f", {timing.ratio(width):5.2f} times as fast"
        mark = " (as `run`)" if width == usual else ""
        yield f"  {title:<18} {1.0 / seconds:9,.0f} cases/s{step}{factor}{mark}"
