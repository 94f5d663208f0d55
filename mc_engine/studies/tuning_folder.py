"""The directory that `mc-engine tune` writes, and its result as text.

    tuning.toml   tuning.json   evaluations.parquet   generations.parquet   front.parquet   journal.jsonl

All files are replaced together after each generation, so that a killed search leaves the result of its last complete
generation.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mc_engine.numbers_in_text import counted, digits_within
from mc_engine.store.result_folder import read_result
from mc_engine.store.run_files import TUNING, path_of

if TYPE_CHECKING:
    import pandas as pd

UNFINISHED = "not ended"  # instead of why the search ended


@dataclass(frozen=True)
class TuningRecord:
    """The result of a search by `tune`, which may have been interrupted.

    path : Path, its directory
    manifest : dict, the campaign and its sources; ["tuning"] has the settings of the search and how it ended
    evaluations : DataFrame, one row per candidate, in the order flown
    generations : DataFrame, one row per generation: the progress of the search
    front : DataFrame, the Pareto front: feasible candidates that no other one dominates; empty if none is feasible

    >>> record = open_tuning("runs/tuned")
    >>> record.feasible, list(record.front)[:4]
    (True, ['candidate', 'generation', 'altitude_km', 'burn_dv_m_s'])
    """

    path: Path
    manifest: dict[str, Any]
    evaluations: "pd.DataFrame"
    generations: "pd.DataFrame"
    front: "pd.DataFrame"

    @property
    def feasible(self) -> bool:
        """Whether a candidate was found that meets all constraints and has a number for every metric."""
        return len(self.front) > 0


def open_tuning(path: str | Path) -> TuningRecord:
    """Open the result of a search by `tune`.

    path : str or Path, its directory

    Returns a TuningRecord.

    Raises StoreError if there is none, or a file of it was damaged.

    >>> open_tuning("runs/tuned").manifest["tuning"]["end"]
    'all generations'
    """
    path = path_of(path, "a tuning is opened by its path, and {} is none")
    manifest, tables = read_result(path, TUNING)
    return TuningRecord(path, manifest, **tables)


def tuning_lines(record: TuningRecord) -> list[str]:
    """How the search ended, for the command line."""
    tuning, evaluations = record.manifest["tuning"], record.evaluations
    inside = int(evaluations["feasible"].sum())
    flown = f"{len(evaluations):,} in {counted(tuning['flown'], 'generation')}"
    lines = [f"candidates   {flown} ({tuning['end']}), {inside:,} feasible"]
    if not record.feasible:
        return [*lines, f"front        {infeasibility(record)}"]
    lines.append(f"front        {front_words(record, '{:,}'.format)}")
    units = record.front.attrs["units"]
    for objective in tuning["objectives"]:
        ends = (values := record.front[objective["name"]]).min(), values.max()
        low, high = (f"{end:.{digits_within(*ends, least=6)}g}" for end in ends)
        lines.append(f"  {objective['name']}  {low} to {high} {units[objective['name']]}".rstrip())
    not_searched = requirements_not_searched(record)
    return [*lines, f"note         {not_searched}"] if not_searched else lines


def front_words(record: TuningRecord, counted: Callable[[int], str]) -> str:
    """What the candidates of the front have in common; counted : how a number of candidates is written."""
    n = len(record.front)
    candidates = f"{counted(n)} candidate{'s are' if n > 1 else ' is'}"
    if record.manifest["tuning"]["constraints"]:
        return f"{candidates} inside all constraints and beaten by no other"
    return f"{candidates} beaten by no other; the search has no constraint"


def requirements_not_searched(record: TuningRecord) -> str:
    """A sentence on the campaign's requirements whose metric no constraint limits; empty if there are none."""
    limited = {constraint["metric"] for constraint in record.manifest["tuning"]["constraints"]}
    left_out = [item["name"] for item in record.manifest.get("requirements", []) if item["metric"] not in limited]
    if not left_out:
        return ""
    return (
        f"not part of the search, so that candidates may fail them: the campaign's requirements {', '.join(left_out)}"
    )


def infeasibility(record: TuningRecord) -> str:
    """Why there is no front, in a sentence with the least violation found."""
    tried = f"no feasible point among {len(record.evaluations):,} candidates"
    row = least_violating(record)
    if row is None:
        return f"{tried}; none of them has a number for every metric{_commonest(record.evaluations)}"
    units = record.evaluations.attrs["units"]
    broken = []
    for constraint in record.manifest["tuning"]["constraints"]:
        value, unit = float(row[constraint["name"]]), units[constraint["name"]]
        for word, limit, sign in (("at most", constraint["at_most"], 1.0), ("at least", constraint["at_least"], -1.0)):
            if limit is not None and sign * (value - limit) > 0.0:
                digits = digits_within(min(value, limit), max(value, limit), least=4)
                reached = f"{value:.{digits}g}{' ' * bool(unit)}{unit}"
                broken.append(f"{constraint['name']} {reached} where {word} {limit:.12g} is allowed")
    return f"{tried}; the least violation found is {float(row['violation']):.4g}: {', '.join(broken)}"


def _commonest(evaluations: "pd.DataFrame") -> str:
    """The end that most of the candidates' failed cases came to, as an end of a sentence."""
    ends = evaluations["commonest_failure"][evaluations["failed_cases"] > 0].value_counts(sort=False)
    return f", most often ({ends.max():,} candidates) {ends.idxmax()}" if len(ends) else ""


def least_violating(record: TuningRecord) -> "pd.Series | None":
    """The candidate nearest to the limits; None if none has a number for every metric."""
    violation = record.evaluations["violation"]
    return record.evaluations.loc[violation.idxmin()] if np.isfinite(violation.min()) else None
