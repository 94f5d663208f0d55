"""Summary of a run in a few lines for a terminal: cases, verdicts on requirements, statistics of metrics."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from math import floor, isfinite, log10
from typing import TYPE_CHECKING, Any

from mc_engine.errors import StoreError
from mc_engine.numbers_in_text import decimals_of, outward, percent_digits
from mc_engine.section import ReportSection
from mc_engine.shell_words import shell_word
from mc_engine.status import NOT_FINITE, OK, STATUS_NAME
from mc_engine.store.manifest_file import design_in, seed_remark
from mc_engine.store.parts import CASE_COLUMNS, Column, Part, numbers_in, read_part, rows_with
from mc_engine.store.run_files import NO_NOMINAL
from mc_engine.store.store import Store
from mc_engine.suggestions import listed
from mc_engine.text import clean

if TYPE_CHECKING:
    import numpy as np
    import pyarrow as pa

    from mc_engine.statistics import Summary, Verdict
    from mc_engine.statistics.streaming import Passes, Streamed

PARTS_AHEAD = 2
_ROUNDED = 1e-6  # of a metric: what finer steps may change where it does not vary
_DIGITS, _ALL_DIGITS = 8, 17  # of a metric: as a rule, and of a double


def failed_cases(counts: Mapping[str, int]) -> int:
    """Number of cases that did not complete, of the counts by status."""
    return sum(count for word, count in counts.items() if word != STATUS_NAME[OK])


def first_with(store: Store, status: str) -> int | None:
    """The first committed case of a status, or None."""
    for part in store.parts:
        if part.status.get(status):
            table = read_part(store.path, part, CASE_COLUMNS[:2])
            return int(numbers_in(table["case_id"])[rows_with(table["status"], status)][0])
    return None


def is_compiled(store: Store) -> bool:
    """Whether a compiled model flew the run: its table has the state at the end, which a simulator does not tell."""
    return any(column.role == "state" for column in store.columns) and not store.manifest.get("imported")


def failure_line(store: Store) -> str:
    """Why a case failed, the first that is not-finite or else of the most frequent status; empty if no row says why."""
    lost = STATUS_NAME[NOT_FINITE]
    counts = {word: count for word, count in store.status_counts().items() if word != STATUS_NAME[OK]}
    if counts.get(lost) and is_compiled(store):
        named = f"`mc-engine replay {shell_word(store.path)} {first_with(store, lost)}`"
        return f"not finite   {named} names the line of the model"
    for status in sorted(counts, key=lambda word: (word != lost, -counts[word])):
        case = first_with(store, status)
        if case is not None and (reason := store.row(case)["reason"]):
            return (
                f"not finite   case {case}: {reason}"
                if status == lost
                else f"failed       case {case}: {status}, {reason}"
            )
    return ""


def case_line(store: Store) -> str:
    """Such as "9,000 of 10,000 cases: 8,998 ok, 2 no-stop"."""
    counts = store.status_counts()
    words = ", ".join(f"{count:,} {word}" for word, count in sorted(counts.items(), key=lambda item: -item[1]))
    return f"{sum(counts.values()):,} of {store.n_cases:,} cases" + (f": {words}" if words else "")


def nominal_line(store: Store) -> str:
    """That the nominal case failed, with status and reason, or was not imported; empty where it is ok."""
    row = store.nominal()
    return NO_NOMINAL if row.get("reason") == NO_NOMINAL else failure_words(row)


def failure_words(row: Mapping[str, Any]) -> str:
    """Such as "failed: refused, the mass is negative"; empty for a case that is ok."""
    if row.get("status", STATUS_NAME[OK]) == STATUS_NAME[OK]:
        return ""
    return f"failed: {', '.join(str(row[name]) for name in ('status', 'reason') if row[name])}"


def judgement(store: Store) -> "tuple[list[Verdict], Verdict | None]":
    """The verdicts on all requirements of the run, and the joint verdict if there are several."""
    requirements = store.manifest.get("requirements", [])
    if not requirements:
        return [], None
    statistics = streamed(store, _judged_metrics(requirements), requirements)
    return statistics.verdicts, statistics.joint


def outcomes(store: Store) -> "tuple[list[Verdict], Verdict | None]":
    """The same verdicts without the demonstrated bounds, for which alone the parts are read more than once."""
    import numpy as np

    from mc_engine.statistics.limits import LimitCounts
    from mc_engine.statistics.requirements import judge_counted

    requirements = store.manifest.get("requirements", [])
    if not requirements:
        return [], None
    counts = LimitCounts(requirements)
    for table, numbers in metric_parts(store, _judged_metrics(requirements)):
        counts.add(numbers.__getitem__, np.ones(table.num_rows, dtype=bool))
    return judge_counted(counts, None, design_in(store.manifest), _looked(store))


def _judged_metrics(requirements: Sequence[Mapping[str, Any]]) -> list[str]:
    return list(dict.fromkeys(str(record["metric"]) for record in requirements))


def _flown(store: Store) -> int:
    return sum(part.rows for part in store.parts)


def _looked(store: Store) -> bool:
    from mc_engine.statistics import was_looked_at

    return was_looked_at(store.manifest, store.n_cases, _flown(store))


def analyses_line(store: Store) -> str:
    """How the number of cases was determined, if it was not fixed in advance; else empty."""
    if not _looked(store):
        return ""
    looks = store.manifest.get("looks", [])
    begun = store.manifest["campaign"]["cases"]
    if (flown := _flown(store)) < store.n_cases and not looks:
        history = f"{flown:,} of {store.n_cases:,} cases so far"
    elif looks and store.n_cases not in looks:
        history = f"extended to {store.n_cases:,} cases after a run until verdict of at most {looks[-1]:,} cases"
    elif looks:
        scheduled = sum(look <= store.n_cases for look in looks)
        analyses = f"{scheduled} interim {'analysis' if scheduled == 1 else 'analyses'}"
        history = f"{analyses}, the last at {store.n_cases:,} of at most {looks[-1]:,} cases"
    else:
        history = f"extended from {begun:,} to {store.n_cases:,} cases"
    return f"{history}; the verdicts hold at every number of cases at once"


def remarks(store: Store) -> Iterator[tuple[str, str]]:
    """(word, what must be known of the run): where its inputs and results come from, its seed, its steps."""
    lines = {"inputs": _upstream, "imported": _not_imported, "seed": _seed, "integration": integration_line}
    return ((word, told) for word, line in lines.items() if (told := line(store)))


def _upstream(store: Store) -> str:
    """Which run the inputs come from, as a folder may have the name of a shipped campaign; empty without one."""
    taken = store.manifest.get("upstream")
    facts = [f"{key} {taken[key]}" for key in ("cases", "seed") if key in taken] if taken else []
    return f"from a run of {taken['name']}: {', '.join(facts)}" if taken else ""


def _not_imported(store: Store) -> str:
    """The columns of a table of results that were not imported; else empty."""
    names = store.manifest.get("imported", {}).get("left_out")
    return clean(f"without {listed(names)}: no dispersed inputs or metrics of the campaign") if names else ""


def _seed(store: Store) -> str:
    """That the campaign has the seed of the one upstream; else empty."""
    return seed_remark(store.manifest["campaign"].get("seed"), store.manifest.get("upstream"))


def integration_line(store: Store) -> str:
    """That finer steps change a metric with a requirement by more than its spread in the first part; else empty."""
    import numpy as np

    found = next((entry.facts.get("integration") or {} for entry in reversed(store.notes("finished"))), {})
    changes, judged = found.get("changes", {}), _judged_metrics(store.manifest.get("requirements", []))
    metrics = [name for name in judged if name in changes]
    if not metrics:
        return ""
    columns = [column for column in store.columns if column.name in ("status", *metrics)]
    coarse = []
    for name, numbers in _metrics_of(store, store.parts[0], columns, metrics)[1].items():
        finite = numbers[np.isfinite(numbers)]
        if finite.size and changes[name] > finite.std() + _ROUNDED * abs(finite).max():
            coarse.append(name)
    told = f"with {found.get('by')}, {', '.join(coarse)} would change by more than a standard deviation"
    return told if coarse else ""


def verdict_line(verdict: "Verdict", units: Mapping[str, str]) -> str:
    """Such as "fuel: pass, mass_kg ≤ 2.5 kg in 9,998 of 10,000 cases (required: 99.73 % with 90 % confidence)"."""
    required = f"required: {percent_digits(verdict.share)} % with {percent_digits(verdict.confidence)} % confidence"
    inside = f"in {verdict.passed:,} of {verdict.tried:,} cases"
    asked = "all limits met"
    if verdict.metric:
        asked = f"{verdict.metric} {_limit_words(verdict)} {units.get(verdict.metric, '')}".rstrip()
    because = f"; {verdict.remark}" if verdict.remark else ""
    return f"{verdict.name}: {verdict.outcome}, {asked} {inside} ({required}){because}"


def _limit_words(verdict: "Verdict") -> str:
    if verdict.at_least is not None and verdict.at_most is not None:
        return f"within {verdict.at_least:,.15g} to {verdict.at_most:,.15g}"
    return f"≤ {verdict.at_most:,.15g}" if verdict.at_least is None else f"≥ {verdict.at_least:,.15g}"


def summaries(store: Store, metrics: Sequence[str] | None = None) -> "dict[str, Summary]":
    """Summary of every metric, or of those named; StoreError for a name that is no metric.

    Quantiles are the usual ones, and those between which a case lies with the probability of [report]; each bound of a
    quantile has its confidence.  Designs without random sampling, such as a grid, have no quantiles.

    A failed case has no value, even if its row contains a number.
    """
    known = [column.name for column in store.columns if column.role == "metric"]
    names = known if metrics is None else list(metrics)
    for name in names:
        if name not in known:
            raise StoreError(f'{store.path}: there is no metric "{name}"; there are {", ".join(known) or "none"}')
    from mc_engine.statistics import CHOSEN_DESIGNS, QUANTILES

    stated = ReportSection(**store.manifest.get("report", {}))
    probabilities = () if design_in(store.manifest) in CHOSEN_DESIGNS else tuple(sorted({*QUANTILES, *stated.outer}))
    return streamed(store, names, probabilities=probabilities, confidence=stated.two_sided).summaries


def streamed(
    store: Store,
    metrics: Sequence[str],
    requirements: Sequence[Mapping[str, Any]] = (),
    passes: "Passes | None" = None,
    probabilities: tuple[float, ...] | None = None,
    confidence: float = 0.90,
) -> "Streamed":
    """Summaries and verdicts of a run of any size, which is read part by part.

    passes : yields the metrics of each part, once for each pass; by default from `metric_parts`.
    """
    from mc_engine.statistics.order_statistics import QUANTILES
    from mc_engine.statistics.streaming import stream

    return stream(
        passes or (lambda names: (numbers for _, numbers in metric_parts(store, names))),
        metrics,
        requirements=requirements,
        design=design_in(store.manifest),
        looked=_looked(store),
        chained=bool(store.manifest.get("upstream")),
        probabilities=QUANTILES if probabilities is None else probabilities,
        confidence=confidence,
    )


def metric_parts(
    store: Store, metrics: Sequence[str], others: Sequence[str] = ()
) -> "Iterator[tuple[pa.Table, dict[str, np.ndarray]]]":
    """All parts in order: a table with these columns, and the metrics, NaN for cases that did not complete.

    others : columns of the table besides the metrics and the status.  The next parts are read in the background.
    """
    columns = [column for column in store.columns if column.name in ("status", *metrics, *others)]
    with ThreadPoolExecutor(PARTS_AHEAD) as pool:
        ahead: list[Future[tuple[pa.Table, dict[str, np.ndarray]]]] = []
        for part in store.parts:
            ahead.append(pool.submit(_metrics_of, store, part, columns, metrics))
            if len(ahead) > PARTS_AHEAD:
                yield ahead.pop(0).result()
        while ahead:
            yield ahead.pop(0).result()


def _metrics_of(
    store: Store, part: Part, columns: Sequence[Column], metrics: Sequence[str]
) -> "tuple[pa.Table, dict[str, np.ndarray]]":
    import numpy as np

    all_ok = part.status == {STATUS_NAME[OK]: part.rows}  # by the receipt, so that the status need not be read
    table = read_part(store.path, part, [column for column in columns if not all_ok or column.name != "status"])
    numbers = {name: numbers_in(table[name]).astype(np.float64, copy=False) for name in metrics}
    if all_ok:
        return table, numbers
    ok = rows_with(table["status"], STATUS_NAME[OK])
    return table, {name: np.where(ok, values, np.nan) for name, values in numbers.items()}


def summary_lines(metric: str, summary: "Summary", unit: str, random: bool) -> list[str]:
    """The summary in lines for a terminal; limits of quantiles only where cases are a random sample.

    Of cases that were chosen, which have no quantiles, the ends alone: a mean would be that of the choice.
    """
    head = f"{metric}{f' [{unit}]' if unit else ''}: {summary.n_used:,} of {summary.n_tried:,} cases have a number"
    if summary.n_used == 0:
        return [head]
    sd = "-" if summary.sd is None else f"{summary.sd:.6g}"
    digits = _digits(summary)
    told = f"{{:.{digits}g}}".format

    def bound(value: float | None, up: bool) -> str:
        return "too few cases" if value is None else told(outward(value, decimals_of(value, digits), up))

    moments = f"mean {told(summary.mean)}, sd {sd}, " if random or summary.quantiles else ""
    lines = [head, f"  {moments}from {told(summary.minimum)} to {told(summary.maximum)}"]
    shares = [percent_digits(item.probability) for item in summary.quantiles]
    decimals = max((len(share.partition(".")[2]) for share in shares), default=0)
    for item in summary.quantiles:
        interval = f"  [{bound(item.lower, False)}, {bound(item.upper, True)}]" if random else ""
        lines.append(f"  {100.0 * item.probability:>{decimals + 4}.{decimals}f} %  {told(item.value)}{interval}")
    return lines


def _digits(summary: "Summary") -> int:
    """Significant digits that distinguish the cases: eight, or more if the spread is small, as for Julian dates."""
    largest = max(abs(summary.minimum or 0.0), abs(summary.maximum or 0.0))
    if summary.constant or not largest or not summary.sd or not isfinite(summary.sd):
        return _DIGITS
    return min(max(3 + floor(log10(largest)) - floor(log10(summary.sd)), _DIGITS), _ALL_DIGITS)
