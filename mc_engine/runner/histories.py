"""Histories that a run keeps: its cases flown once more, each alone, and seen on the way."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd

from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.loading import Campaign
from mc_engine.flight.chunks import NOMINAL_NOISE
from mc_engine.flight.flight import fly_history
from mc_engine.statistics.worst import limits_on, worst_cases
from mc_engine.status import OK, REFUSED, STATUS_NAME, TIME_LIMIT, WORKER_DIED
from mc_engine.store.parts import problem_of
from mc_engine.store.store import Store

_DANGEROUS = (STATUS_NAME[WORKER_DIED], STATUS_NAME[TIME_LIMIT])


def write_histories(store: Store, campaign: Campaign, workers: int, stopped: Callable[[], bool]) -> bool:
    """Fly the retained cases again, several at once, and keep their histories; False if stopped before the end.

    Cases that killed their worker, or never ended, are left out: they would do so again, here.  Nothing is flown where
    the histories of these very cases are there as they were written: what a case comes to does not change.
    """
    from joblib import Parallel, delayed

    retained = retained_cases(store, campaign)
    if _are_kept(store, campaign, retained):
        return True
    flights = [(-1, campaign.nominal, NOMINAL_NOISE)] if campaign.retention.nominal else []
    for case_id in retained:
        inputs = {name: column[0] for name, column in case_table(campaign, np.array([case_id])).items()}
        flights.append((case_id, full_inputs(campaign, inputs), case_id))

    def history(*flight: Any) -> pd.DataFrame | None:
        return None if stopped() else _history(campaign, *flight)

    pool = Parallel(n_jobs=min(workers, max(len(flights), 1)), backend="threading")
    frames = list(pool(delayed(history)(*flight) for flight in flights))
    if any(frame is None for frame in frames):
        return False
    filled = [frame for frame in frames if len(frame)]
    if filled:
        store.write_histories(pd.concat(filled, ignore_index=True))
    return True


def _are_kept(store: Store, campaign: Campaign, retained: list[int]) -> bool:
    part = store.history_part
    if part is None or problem_of(store.path / part.file, store.histories):
        return False
    wanted = {*retained, -1} if campaign.retention.nominal else {*retained}
    return set(store.histories().get("case_id", [])) == {case for case in wanted if _began(store, case)}


def _began(store: Store, case_id: int) -> bool:
    """Has the case flown at all?  One that was refused has no history."""
    row = store.nominal() if case_id < 0 else store.row(case_id)
    return row["status"] != STATUS_NAME[REFUSED]


def retained_cases(store: Store, campaign: Campaign) -> list[int]:
    """Cases that keep their history: the first, the named, and the worst of the completed ones; each once."""
    wanted = campaign.retention
    chosen = [*range(min(wanted.first, store.n_cases)), *(case for case in wanted.cases if case < store.n_cases)]
    for worst in wanted.worst:
        table = store.cases(["case_id", "status", worst.metric])  # by case, so that equal ones go by their number
        limits = limits_on(worst.metric, [vars(one) for one in campaign.requirements]) if worst.side is None else None
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


def _history(campaign: Campaign, case_id: int, inputs: dict[str, Any], noise: int) -> pd.DataFrame:
    rows = campaign.retention.rows
    _, history = fly_history(campaign.model, inputs, noise, campaign.seed, folder=campaign.directory, rows=rows)
    return history_frame(case_id, history)


def history_frame(case_id: int, history: dict[str, np.ndarray]) -> pd.DataFrame:
    """One history as a table: case_id, t_s and the quantities."""
    frame = pd.DataFrame(history)
    frame.insert(0, "case_id", np.full(len(frame), case_id, dtype=np.int64))
    return frame
