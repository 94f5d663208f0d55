"""The command that compares two runs: compare."""

import importlib
from pathlib import Path
from typing import Annotated

import typer

from mc_engine.command_line.app import USAGE, app, existing_run, exit_status, leave, new_file, run_at

CHANGED = 1


@app.command()
@exit_status()
def compare(
    before: Annotated[str, typer.Argument(metavar="A", help="The directory or URL of the run before.")],
    after: Annotated[str, typer.Argument(metavar="B", help="The directory or URL of the run after.")],
    alpha: Annotated[
        float, typer.Option(help="Chance of even one false alarm in all tests together, above 0, below 1.")
    ] = 0.003,
    tolerance: Annotated[
        float, typer.Option(min=0.0, help="Standard deviations; smaller differences of a pair are rounding.")
    ] = 1e-6,
    report: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE", help="Where to write the comparison, .html or .pdf; may be given twice.", parser=new_file
        ),
    ] = None,
) -> None:
    """What changed from run A to run B beyond chance.

    Exit status 0: no significant change; 1: a metric or a fraction of cases changed, or a requirement has a
    worse verdict on the same cases.
    """
    wrong = [path for path in report or [] if path.suffix not in (".html", ".pdf")]
    if wrong:
        leave(USAGE, f"--report {wrong[0]}: the name must end in .html or .pdf")
    if not 0.0 < alpha < 1.0:
        leave(USAGE, f"--alpha {alpha:g}: must lie between 0 and 1, such as 0.003")
    a, b = existing_run(run_at(before)), existing_run(run_at(after))
    from mc_engine.studies.comparison import compare_runs
    from mc_engine.studies.comparison_lines import comparison_lines

    found = compare_runs(a, b, (before, after), alpha=alpha, tolerance=tolerance)
    for line in comparison_lines(found):
        typer.echo(line)
    for path in report or []:
        # As for the reports of a run: imported only where they are asked for.
        importlib.import_module("reports.studies.comparison").write_comparison(found, path, (a, b))
        typer.echo(str(path))
    if found.changed:
        raise typer.Exit(CHANGED)
