"""What a run amounts to, in a few lines for a terminal.  The reports say the rest."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from mc_engine.status import OK, STATUS_NAME
from mc_engine.store import Store

if TYPE_CHECKING:
    from mc_engine.statistics import Verdict


def failed_cases(store: Store) -> int:
    """How many committed cases did not fly to their end."""
    return sum(count for word, count in store.status_counts().items() if word != STATUS_NAME[OK])


def case_line(store: Store) -> str:
    """Such as "9,000 of 10,000 cases: 8,998 ok, 2 no-stop"."""
    counts = store.status_counts()
    words = ", ".join(f"{count:,} {word}" for word, count in sorted(counts.items(), key=lambda item: -item[1]))
    return f"{sum(counts.values()):,} of {store.n_cases:,} cases" + (f": {words}" if words else "")


def verdicts(store: Store) -> "list[Verdict]":
    """Every requirement of the run, judged on the cases at hand."""
    from mc_engine.statistics import judge

    requirements = store.manifest.get("requirements", [])
    if not requirements:
        return []
    table = store.cases(list(dict.fromkeys(["status", *(record["metric"] for record in requirements)])))
    ok = (table["status"] == STATUS_NAME[OK]).to_numpy(dtype=bool)
    design = store.manifest["campaign"].get("design", "mc")
    return [judge(record, table[record["metric"]].to_numpy(), ok, design) for record in requirements]


def verdict_line(verdict: "Verdict", units: Mapping[str, str]) -> str:
    """Such as "fuel: pass, propellant_kg ≤ 2.5 kg in 9,998 of 10,000 cases (wanted 99.73 % with 90 % confidence)"."""
    limits = [
        f"{sign} {limit:g} {units.get(verdict.metric, '')}".rstrip()
        for sign, limit in (("≤", verdict.at_most), ("≥", verdict.at_least))
        if limit is not None
    ]
    wanted = f"wanted {100 * verdict.share:.6g} % with {100 * verdict.confidence:.6g} % confidence"
    inside = f"in {verdict.passed:,} of {verdict.tried:,} cases"
    return f"{verdict.name}: {verdict.outcome}, {verdict.metric} {' and '.join(limits)} {inside} ({wanted})"
