"""What a run amounts to, in a few lines for a terminal.  The reports say the rest."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from mc_engine.errors import StoreError
from mc_engine.parts import CASE_COLUMNS, read_part
from mc_engine.status import NOT_FINITE, OK, STATUS_NAME
from mc_engine.store import Store

if TYPE_CHECKING:
    import numpy as np

    from mc_engine.statistics import Summary, Verdict


def failed_cases(store: Store) -> int:
    """How many committed cases did not fly to their end."""
    return sum(count for word, count in store.status_counts().items() if word != STATUS_NAME[OK])


def first_not_finite(store: Store) -> int | None:
    """The first committed case that ended not-finite, if one did."""
    for part in store.parts:
        if part.status.get(STATUS_NAME[NOT_FINITE]):
            table = read_part(store.path, part, CASE_COLUMNS[:2])
            lost = table["status"].to_numpy(zero_copy_only=False) == STATUS_NAME[NOT_FINITE]
            return int(table["case_id"].to_numpy()[lost][0])
    return None


def case_line(store: Store) -> str:
    """Such as "9,000 of 10,000 cases: 8,998 ok, 2 no-stop"."""
    counts = store.status_counts()
    words = ", ".join(f"{count:,} {word}" for word, count in sorted(counts.items(), key=lambda item: -item[1]))
    return f"{sum(counts.values()):,} of {store.n_cases:,} cases" + (f": {words}" if words else "")


def verdicts(store: Store) -> "list[Verdict]":
    """Every requirement of the run, judged on the cases at hand."""
    return judgement(store)[0]


def judgement(store: Store) -> "tuple[list[Verdict], Verdict | None]":
    """The verdicts on all requirements of the run, and the joint one where there are several."""
    from mc_engine.statistics import judge_all, was_looked_at

    requirements = store.manifest.get("requirements", [])
    if not requirements:
        return [], None
    table = store.cases(list(dict.fromkeys(["status", *(record["metric"] for record in requirements)])))
    ok = (table["status"] == STATUS_NAME[OK]).to_numpy(dtype=bool)
    design = store.manifest["campaign"].get("design", "mc")
    looked = was_looked_at(store.manifest, store.n_cases)
    return judge_all(requirements, lambda name: table[name].to_numpy(), ok, design, looked)


def look_line(store: Store) -> str:
    """How the number of cases came about, where it was not fixed in advance; else empty."""
    from mc_engine.statistics import was_looked_at

    if not was_looked_at(store.manifest, store.n_cases):
        return ""
    looks = store.manifest.get("looks", [])
    begun = store.manifest["campaign"]["cases"]
    if looks:
        scheduled = sum(look <= store.n_cases for look in looks)
        times = "once" if scheduled == 1 else f"{scheduled} times"
        story = f"judged {times} on the way, at {store.n_cases:,} cases last, of at most {looks[-1]:,}"
    else:
        story = f"extended from {begun:,} to {store.n_cases:,} cases"
    return f"{story}; the verdicts hold at every number of cases at once"


def verdict_line(verdict: "Verdict", units: Mapping[str, str]) -> str:
    """Such as "fuel: pass, propellant_kg ≤ 2.5 kg in 9,998 of 10,000 cases (wanted 99.73 % with 90 % confidence)"."""
    limits = [
        f"{sign} {limit:g} {units.get(verdict.metric, '')}".rstrip()
        for sign, limit in (("≤", verdict.at_most), ("≥", verdict.at_least))
        if limit is not None
    ]
    wanted = f"wanted {100 * verdict.share:.6g} % with {100 * verdict.confidence:.6g} % confidence"
    inside = f"in {verdict.passed:,} of {verdict.tried:,} cases"
    asked = f"{verdict.metric} {' and '.join(limits)}" if limits else "every limit kept"
    return f"{verdict.name}: {verdict.outcome}, {asked} {inside} ({wanted})"


def summaries(store: Store, metrics: Sequence[str] | None = None) -> "dict[str, Summary]":
    """Summary of every metric, or of those named, of a run of any size: it is read part by part, never whole.

    StoreError for a name that is no column.  A failed case has no number, whatever stands in its row.
    """
    from mc_engine.statistics.summary import summarize_parts

    known = [column.name for column in store.columns if column.role == "metric"]
    names = known if metrics is None else list(metrics)
    for name in names:
        if name not in known:
            raise StoreError(f'{store.path}: there is no metric "{name}"; there are {", ".join(known) or "none"}')
    return summarize_parts(lambda: _metric_parts(store, names), names)


def _metric_parts(store: Store, names: Sequence[str]) -> "Iterator[dict[str, np.ndarray]]":
    import numpy as np

    from mc_engine.parts import read_part

    columns = [column for column in store.columns if column.name in ("status", *names)]
    for part in store.parts:
        table = read_part(store.path, part, columns)
        ok = table["status"].to_numpy() == STATUS_NAME[OK]
        yield {name: np.where(ok, table[name].to_numpy().astype(np.float64, copy=False), np.nan) for name in names}


def summary_lines(metric: str, summary: "Summary", unit: str, random: bool) -> list[str]:
    """The summary in lines for a terminal; limits of quantiles only where cases are a random sample."""
    head = f"{metric}{f' [{unit}]' if unit else ''}: {summary.n_used:,} of {summary.n_tried:,} cases have a number"
    if summary.n_used == 0:
        return [head]
    sd = "-" if summary.sd is None else f"{summary.sd:.6g}"
    lines = [head, f"  mean {summary.mean:.8g}, sd {sd}, from {summary.minimum:.8g} to {summary.maximum:.8g}"]
    for item in summary.quantiles:
        limits = [f"{limit:.8g}" if limit is not None else "too few cases" for limit in (item.lower, item.upper)]
        interval = f"  [{', '.join(limits)}]" if random else ""
        lines.append(f"  {100.0 * item.probability:>7.3f} %  {item.value:.8g}{interval}")
    return lines
