"""Saved time histories: the chosen cases are flown once more, one by one, and sampled over time."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.loading import Campaign
from mc_engine.campaign.sensitivity_design import noise_ids
from mc_engine.flight.chunks import NOMINAL_NOISE
from mc_engine.flight.flyer import Columns
from mc_engine.flight.flyers import flyer_of
from mc_engine.statistics.worst import limits_on, worst_cases
from mc_engine.status import CRASHED, MEMORY_LIMIT, NO_RESULT, OK, REFUSED, STATUS_NAME, TIME_LIMIT, WORKER_DIED
from mc_engine.store.parts import problem_of
from mc_engine.store.store import Store

_DANGEROUS = tuple(STATUS_NAME[code] for code in (WORKER_DIED, TIME_LIMIT, CRASHED, MEMORY_LIMIT, NO_RESULT))


def inputs_of(campaign: Campaign, case_id: int | None) -> tuple[dict[str, Any], int]:
    """(inputs, what addresses the noise) of a case of a campaign, or of its nominal case."""
    if case_id is None:
        return dict(campaign.nominal), NOMINAL_NOISE
    return _inputs_of_all(campaign, [case_id])[0]


def _inputs_of_all(campaign: Campaign, case_ids: list[int]) -> list[tuple[dict[str, Any], int]]:
    """As `inputs_of`, of several cases, which are drawn together."""
    ids = np.array(case_ids, dtype=np.int64)
    table, noise = case_table(campaign, ids), noise_ids(campaign, ids)
    rows = ({name: column[row] for name, column in table.items()} for row in range(ids.size))
    return [(full_inputs(campaign, inputs), int(number)) for inputs, number in zip(rows, noise, strict=True)]


def write_histories(store: Store, campaign: Campaign, workers: int, stopped: Callable[[], bool]) -> bool:
    """Fly the chosen cases again, in threads, and store their histories; False if stopped before all are complete.

    Cases that killed their worker, crashed, or exceeded a limit are left out, since they would do so again.  Nothing is
    flown if undamaged histories of the same cases are stored already.
    """
    from joblib import Parallel, delayed

    if not campaign.model.quantities:  # of a simulator without outputs
        return True
    retained = retained_cases(store, campaign)
    if _are_kept(store, campaign, retained):
        return True
    flights = [(-1, *inputs_of(campaign, None))] if campaign.retention.nominal else []
    flights += [(case, *flight) for case, flight in zip(retained, _inputs_of_all(campaign, retained), strict=True)]

    def history(*flight: Any) -> Columns | None:
        return None if stopped() else _flown_history(campaign, *flight)

    pool = Parallel(
        n_jobs=min(workers, max(len(flights), 1), flyer_of(campaign).most_workers or workers), backend="threading"
    )
    histories = list(pool(delayed(history)(*flight) for flight in flights))
    if any(columns is None for columns in histories):
        return False
    filled = [columns for columns in histories if columns["case_id"].size]
    if filled:
        store.write_histories({name: np.concatenate([columns[name] for columns in filled]) for name in filled[0]})
    return True


def _are_kept(store: Store, campaign: Campaign, retained: list[int]) -> bool:
    part = store.history_part
    if part is None or problem_of(store.path / part.file, store.histories):
        return False
    expected = {*retained, -1} if campaign.retention.nominal else {*retained}
    return set(store.histories().get("case_id", [])) == {case for case in expected if _has_history(store, case)}


def _has_history(store: Store, case_id: int) -> bool:
    """False for a refused case, which has never started."""
    row = store.nominal() if case_id < 0 else store.row(case_id)
    return row["status"] != STATUS_NAME[REFUSED]


def retained_cases(store: Store, campaign: Campaign) -> list[int]:
    """The cases whose history is saved: the first ones, those listed, and the worst completed ones; each once."""
    retention = campaign.retention
    chosen = [*range(min(retention.first, store.n_cases)), *(case for case in retention.cases if case < store.n_cases)]
    requirements = [vars(requirement) for requirement in campaign.requirements]
    for worst in retention.worst:
        table = store.cases(["case_id", "status", worst.metric])  # by case_id, which decides between equal values
        limits = limits_on(worst.metric, requirements) if worst.side is None else None
        rows = worst_cases(
            table[worst.metric], table["status"] == STATUS_NAME[OK], worst.n_cases, worst.side != "smallest", limits
        )
        chosen += [int(case) for case in table["case_id"].to_numpy()[rows]]
    dangerous = _dangerous_cases(store)
    return [case for case in dict.fromkeys(chosen) if case not in dangerous]


def _dangerous_cases(store: Store) -> set[int]:
    if not set(store.status_counts()) & set(_DANGEROUS):
        return set()
    table = store.cases(["case_id", "status"])
    return set(table.loc[table["status"].isin(_DANGEROUS), "case_id"])


def _flown_history(campaign: Campaign, case_id: int, inputs: dict[str, Any], noise: int) -> Columns:
    _, history = flyer_of(campaign).history(inputs, noise, campaign.retention.rows)
    return _with_case(case_id, history)


def _with_case(case_id: int, history: Columns) -> Columns:
    """One history as columns: case_id, t_s and the outputs."""
    return {"case_id": np.full(len(history["t_s"]), case_id, dtype=np.int64), **history}


def history_frame(case_id: int, history: Columns) -> pd.DataFrame:
    """One history as a table: case_id, t_s and the outputs."""
    return pd.DataFrame(_with_case(case_id, history))
