"""Whether cases were enough and steps short enough: estimates against the number of cases, changes by finer steps."""

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
from reports.document.blocks import Cell, Column, FigureBlock, Table
from reports.drawing.marks import Axis, Drawing, Line, Plot, between
from reports.drawing.palette import BLUE, SKY
from reports.run.flown import Flown
from reports.text.numbers import count, first_of, given_percent, interval, number, percent, percentile, with_unit

MOST_METRICS = 8
MOST_DRAWN = 4
LITTLE, MUCH = 0.01, 0.1  # of a standard deviation: what an error of integration may be without a word, with one


def convergence_blocks(flown: Flown) -> Iterator[FigureBlock | Table | str]:
    """A figure and a table; nothing for cases that are no random sample, a sentence for too few."""
    if not flown.random or not flown.n_tried:
        return
    runs = {name: _running_estimates(flown, name) for name in flown.key_metrics[:MOST_METRICS]}
    told = {name: pair for name, pair in runs.items() if pair}
    if told:
        drawn = list(told)[:MOST_DRAWN]
        panels = tuple(_estimate_panel(flown, name, run) for name in drawn for run in told[name])
        first = f"first {MOST_DRAWN} " if len(told) > MOST_DRAWN else ""
        caption = f"Mean and outer percentile of the {first}key metrics against the number of cases{flown.sample_words}"
        yield FigureBlock(caption, Drawing("Running estimates", panels, 4), "half")
        yield _convergence_table(flown, told)
    silent = [name for name in runs if name not in told]
    if silent:
        yield (
            f"Convergence not assessed for {flown.listed(silent)}: fewer than {FEWEST} cases have a number, "
            "or it is the same in all of them."
        )


def _estimate_panel(flown: Flown, name: str, run: RunningEstimate) -> Plot:
    """One estimate and its bounds over the number of cases."""
    what, interval = _estimate_words(run), f"{given_percent(flown.stated.confidence)} confidence bounds"
    band_key = f"{interval}, where the cases are enough for both ends"
    key = "from the first so many cases, in the order of their numbers"
    marks = (
        between(run.cases, run.lower, run.upper, SKY, 0.35, interval, band_key),
        Line(run.cases, run.estimate, BLUE, what, width=2.0, key=key),
    )
    return Plot(marks, Axis("cases", log=True, margin=0.0), Axis(flown.axis(name)), what, 230.0)


def _running_estimates(flown: Flown, name: str) -> tuple[RunningEstimate, ...]:
    if flown.summaries[name].constant:
        return ()
    values = flown.values(name)
    outer = flown.stated.probability if flown.largest_is_worst(name) else flown.stated.low
    bounds = flown.stated.two_sided
    estimates = running_mean(values, bounds), running_quantile(values, outer, bounds)
    return tuple(run for run in estimates if run is not None)


def _estimate_words(run: RunningEstimate) -> str:
    return "mean" if run.probability is None else percentile(run.probability)


def _convergence_table(flown: Flown, told: dict[str, tuple[RunningEstimate, ...]]) -> Table:
    columns = (
        Column("Metric", "text", grouped=True),
        Column("Estimate", "text"),
        Column("From half the cases", "number"),
        Column("From the sample" if flown.sampled else "From all", "number"),
        Column("Bounds within", "number"),
        Column("Halves differ by chance", "number"),
        Column("Converged", "text"),
    )
    rows = tuple(_estimate_row(flown, name, run) for name, pair in told.items() for run in pair)
    note = (
        f"Converged: the {given_percent(flown.stated.confidence)} bounds of the estimate lie no farther from it than "
        f"{number(CLOSE_MEAN)} standard deviations of the metric for a mean, {number(CLOSE_QUANTILE)} for a percentile "
        "(column “bounds within”), and the first and second half of the cases do not differ beyond chance "
        f"(probability at least {percent(DRIFT)}; Welch’s test of the means, Fisher’s of the cases beyond the "
        "percentile). A mean that a few extreme cases dominate has not converged: its bounds are wrong too often, and "
        "a metric with very heavy tails has no mean. Bounds are those of "
        "independent draws: Student’s for the mean, order statistics for percentiles. "
        "A metric that has not converged may have a certain verdict: that depends on its requirement alone."
    )
    known = len(flown.key_metrics)
    whose = f", {first_of(MOST_METRICS, known, 'key metrics')}" if known > MOST_METRICS else ""
    return Table(f"Convergence of the estimates{whose}{flown.sample_words}", columns, rows, note)


def _estimate_row(flown: Flown, name: str, run: RunningEstimate) -> tuple[Cell, ...]:
    sd = flown.summaries[name].sd
    half = int(abs(run.cases - run.n_tried / 2).argmin())
    low, high = (float(end[-1]) if end[-1] == end[-1] else None for end in (run.lower, run.upper))
    reach = "open end" if run.reach is None else f"{number(run.reach, 2)} σ"
    return (
        Cell(flown.axis(name)),
        Cell(_estimate_words(run), small=f"{count(run.n_used)} of {count(run.n_tried)} cases"),
        Cell(
            number(float(run.estimate[half]), scale=sd),
            float(run.estimate[half]),
            f"first {count(int(run.cases[half]))}",
        ),
        Cell(number(float(run.estimate[-1]), scale=sd), float(run.estimate[-1]), interval(low, high, sd)),
        Cell(reach, run.reach),
        Cell(percent(round(run.halves_p, 4)), run.halves_p),
        _converged_cell(flown, run),
    )


def _converged_cell(flown: Flown, run: RunningEstimate) -> Cell:
    if run.settled:
        return Cell("converged", tone="good")
    if run.reach is not None and run.reach <= run.close:
        if run.halves_p < DRIFT:
            return Cell("no", small="the halves differ", tone="bad")
        return Cell("not yet", small="few extreme cases dominate", tone="open")
    wanted = f"needs about {count(_two_digits_up(run.cases_wanted))} cases" if run.cases_wanted else "needs more cases"
    has = f"; the run has {count(flown.n_tried)}" if flown.sampled else ""  # its estimates are of all of them
    return Cell("not yet", small=f"{wanted}{has}", tone="open")


def _two_digits_up(cases: int) -> int:
    """Two digits, upwards: the estimate of the need is rough itself."""
    step = 10 ** max(len(str(cases)) - 2, 0)
    return -(-cases // step) * step


def integration_table(flown: Flown) -> Table | None:
    """How much finer steps change the metrics that matter, against their spread; None where that is not known."""
    shares = {name: flown.integration_share(name) for name in flown.key_metrics}
    known, found = {name: share for name, share in shares.items() if share is not None}, flown.integration
    if found is None or not known:
        return None
    columns = (Column("Metric", "text"), Column("Largest change", "number"), Column("In its σ", "number"),
               Column("Error of integration", "text"))  # fmt: skip
    largest = sorted(known, key=lambda name: -known[name])[:MOST_METRICS]
    rows = tuple(_integration_row(flown, name, found.changes[name], known[name]) for name in largest)
    cases = f"{count(found.used)} of {count(found.tried)} cases"
    others = f"Of {count(len(known))} metrics, those that change most. " if len(known) > len(rows) else ""
    note = (
        f"The first cases of the run, flown again with {found.by}; {cases} completed both ways, with the same metrics. "
        f"The change is an estimate of the error of integration. {others}Negligible: at most {number(LITTLE)} standard "
        f"deviations σ of the metric; small: at most {number(MUCH)}. A metric that does not vary, or by rounding only, "
        "is not told."
    )
    return Table(f"Change of the metrics with {found.by}", columns, rows, note)


def _integration_row(flown: Flown, name: str, change: float, share: float) -> tuple[Cell, ...]:
    grade = Cell("negligible", tone="good") if share <= LITTLE else Cell("small", tone="open")
    return (
        Cell(flown.axis(name)),
        Cell(with_unit(number(change, 2), flown.own.unit(name)), change),
        Cell(f"{number(share, 2)} σ", share),
        grade if share <= MUCH else Cell("not small", small="take finer steps", tone="bad"),
    )
