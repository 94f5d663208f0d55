"""Whether the number of cases was enough: mean and outer quantile of the metrics that matter against it."""

from collections.abc import Iterator

from mc_engine.statistics.convergence import (
    CLOSE_MEAN,
    CLOSE_QUANTILE,
    DRIFT,
    FEWEST,
    RunningEstimate,
    running_mean,
    running_quantile,
)
from reports.document import Cell, Column, FigureBlock, Table
from reports.figures import RunningDrawing, RunningPanel
from reports.flown import CONFIDENCE, Flown
from reports.headline import HIGH, LOW
from reports.numbers import count, interval, number, percent, percentile
from reports.tables import metric_cell

MOST_METRICS = 8
MOST_DRAWN = 4


def convergence_blocks(flown: Flown) -> Iterator[FigureBlock | Table | str]:
    """A figure and a table; nothing for cases that are no random sample, a sentence for too few."""
    if not flown.random or not flown.n_tried:
        return
    runs = {name: _runs(flown, name) for name in flown.key_metrics[:MOST_METRICS]}
    told = {name: pair for name, pair in runs.items() if pair}
    if told:
        drawn = list(told)[:MOST_DRAWN]
        panels = tuple(RunningPanel(_what(run), flown.axis(name), run) for name in drawn for run in told[name])
        caption = "Mean and outer percentile of the key metrics against the number of cases"
        yield FigureBlock(caption, RunningDrawing(panels, CONFIDENCE), "half")
        yield _table(flown, told)
    silent = [name for name in runs if name not in told]
    if silent:
        yield (
            f"Convergence not assessed for {', '.join(silent)}: fewer than {FEWEST} cases have a number, "
            "or it is the same in all of them."
        )


def _runs(flown: Flown, name: str) -> tuple[RunningEstimate, ...]:
    if flown.summaries[name].constant:
        return ()
    values = flown.values(name)
    outer = HIGH if flown.largest_is_worst(name) else LOW
    found = running_mean(values, CONFIDENCE), running_quantile(values, outer, CONFIDENCE)
    return tuple(run for run in found if run is not None)


def _what(run: RunningEstimate) -> str:
    return "mean" if run.probability is None else percentile(run.probability)


def _table(flown: Flown, told: dict[str, tuple[RunningEstimate, ...]]) -> Table:
    columns = (
        Column("Metric", "name", 2.6),
        Column("Estimate", "text", 1.5),
        Column("From half the cases", "number", 1.7),
        Column("From all", "number", 1.9),
        Column("Interval reaches", "number", 1.3),
        Column("Halves differ by chance", "number", 1.3),
        Column("Converged", "text", 1.5),
    )
    rows = tuple(_row(flown, name, run) for name, pair in told.items() for run in pair)
    note = (
        f"Converged: the {percent(CONFIDENCE)} interval of the estimate reaches no farther from it than "
        f"{number(CLOSE_MEAN)} standard deviations of the metric for a mean, {number(CLOSE_QUANTILE)} for a percentile "
        "(column “interval reaches”), and the first and second half of the cases do not differ beyond chance "
        f"(probability at least {percent(DRIFT)}; Welch’s test of the means, Fisher’s of the cases beyond the "
        "percentile). Intervals are those of independent draws: Student’s for the mean, order statistics for "
        "percentiles. "
        "A metric that has not converged may have a certain verdict: that depends on its requirement alone."
    )
    return Table("Convergence of the estimates", columns, rows, note)


def _row(flown: Flown, name: str, run: RunningEstimate) -> tuple[Cell, ...]:
    sd = flown.summaries[name].sd
    half = int(abs(run.cases - run.n_tried / 2).argmin())
    low, high = (float(end[-1]) if end[-1] == end[-1] else None for end in (run.lower, run.upper))
    reach = "open end" if run.reach is None else f"{number(run.reach, 2)} σ"
    return (
        metric_cell(flown, name),
        Cell(_what(run), small=f"{count(run.n_used)} of {count(run.n_tried)} cases"),
        Cell(
            number(float(run.estimate[half]), scale=sd),
            float(run.estimate[half]),
            f"first {count(int(run.cases[half]))}",
        ),
        Cell(number(float(run.estimate[-1]), scale=sd), float(run.estimate[-1]), interval(low, high, sd)),
        Cell(reach, run.reach),
        Cell(percent(run.halves_p), run.halves_p),
        _verdict(run),
    )


def _verdict(run: RunningEstimate) -> Cell:
    if run.settled:
        return Cell("converged", tone="good")
    if run.reach is not None and run.reach <= run.close:
        return Cell("no", small="the halves differ", tone="bad")
    wanted = f"needs about {count(_rounded(run.cases_wanted))} cases" if run.cases_wanted else "needs more cases"
    return Cell("not yet", small=wanted, tone="open")


def _rounded(cases: int) -> int:
    """Two digits, upwards: the estimate of the need is rough itself."""
    step = 10 ** max(len(str(cases)) - 2, 0)
    return -(-cases // step) * step
