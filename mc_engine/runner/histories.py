"""Repeated flights of a run's cases: chosen ones for their time histories, the first ones with finer steps."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from itertools import takewhile
from typing import TYPE_CHECKING, Any

import numpy as np

from mc_engine.campaign.cases import full_inputs
from mc_engine.campaign.columns import END_TIME
from mc_engine.campaign.loading import Campaign
from mc_engine.flight.chunks import drawn
from mc_engine.flight.flyer import NOMINAL_NOISE, Columns, Flyer, RunStopped
from mc_engine.flight.flyers import flyer_of
from mc_engine.interruption import in_threads
from mc_engine.model.simulator import Simulator
from mc_engine.runner.summary import metric_parts
from mc_engine.statistics.worst import WorstSoFar, limits_on
from mc_engine.status import CRASHED, MEMORY_LIMIT, NO_RESULT, OK, REFUSED, STATUS_NAME, TIME_LIMIT, WORKER_DIED
from mc_engine.store.parts import numbers_in, problem_of, read_part
from mc_engine.store.run_files import NOMINAL_CASE
from mc_engine.store.store import Store

if TYPE_CHECKING:
    import pandas as pd

_DANGEROUS = tuple(STATUS_NAME[code] for code in (WORKER_DIED, TIME_LIMIT, CRASHED, MEMORY_LIMIT, NO_RESULT))
_MOST_FINER, _FINER_OF = 16, 100  # cases that fly with finer steps, one of so many: it takes little time


def inputs_of(campaign: Campaign, case_id: int | None) -> tuple[dict[str, Any], int]:
    """(inputs, what addresses the noise) of a case of a campaign, or of its nominal case."""
    if case_id is None:
        return dict(campaign.nominal), NOMINAL_NOISE
    table, noise = drawn(campaign, np.array([case_id]))
    return full_inputs(campaign, {name: column[0] for name, column in table.items()}), int(noise[0])


def write_histories(store: Store, campaign: Campaign, workers: int, stopped: Callable[[], bool]) -> bool:
    """Fly the chosen cases again, in threads, and store their histories; False if stopped before all are complete.

    Cases that killed their worker, crashed, or exceeded a limit are left out, since they would do so again.  Nothing is
    flown if undamaged histories of the same cases are stored already.
    """
    if not campaign.model.quantities:  # of a simulator without outputs
        return True
    saved = cases_to_save(store, campaign)
    if _are_kept(store, campaign, saved):
        return True
    flyer = flyer_of(campaign)
    workers = min(workers, flyer.most_workers or workers)
    together = flyer.histories_together
    size = together * max(1, -(-len(saved) // (flyer.chunks_per_worker * workers * together)))
    pieces = [[NOMINAL_CASE]] if _saves_nominal(store, campaign, _DANGEROUS) else []
    pieces += [saved[first : first + size] for first in range(0, len(saved), size)]
    flown = in_threads(lambda piece: _histories_of(campaign, flyer, piece, stopped), pieces, workers)
    histories = [columns for piece in flown for columns in piece]
    if len(histories) < sum(map(len, pieces)):
        return False
    filled = [columns for columns in histories if columns["case_id"].size]
    if filled:
        store.write_histories({name: np.concatenate([columns[name] for columns in filled]) for name in filled[0]})
    return True


def integration_changes(store: Store, campaign: Campaign) -> dict[str, Any] | None:
    """How a finer integration changes the metrics of a run's first cases; None for a shard, companion or simulator.

    by : what is finer, in words.  tried : cases; used : those that complete in both flights, with the same metrics.
    changes : by metric the largest change, in its unit; without metrics that none of the cases has.
    """
    if len(store.wanted) < store.n_cases or "sensitivity" in store.manifest or isinstance(campaign.model, Simulator):
        return None
    from mc_engine.flight.compiled import CompiledFlyer

    first, metrics = store.parts[0], [metric.name for metric in campaign.model.metrics]
    tried = min(_MOST_FINER, -(-store.n_cases // _FINER_OF), first.rows)
    columns = [column for column in store.columns if column.name in ("status", END_TIME, *metrics)]
    own = read_part(store.path, first, columns).slice(0, tried)
    cases = np.flatnonzero([word == STATUS_NAME[OK] for word in own["status"].to_pylist()])
    if not cases.size:
        return None
    table, noise = drawn(campaign, cases)
    inputs = full_inputs(campaign, table)
    numbers = {name: numbers_in(own[name])[cases] for name in metrics}
    flight_s = float(numbers_in(own[END_TIME])[cases].max())
    [(by, fine)] = in_threads(lambda flyer: flyer.fly_finer(inputs, noise, flight_s), [CompiledFlyer(campaign)])
    before, after = (np.array([columns[name] for name in metrics]) for columns in (numbers, fine))
    used = (fine["status"] == STATUS_NAME[OK]) & (np.isnan(before) == np.isnan(after)).all(axis=0)
    changes = abs(after - before)[:, used]
    known = {name: change[~np.isnan(change)] for name, change in zip(metrics, changes, strict=True)}
    largest = {name: float(change.max()) for name, change in known.items() if change.size}
    return {"by": by, "tried": tried, "used": int(used.sum()), "changes": largest}


def _histories_of(campaign: Campaign, flyer: Flyer, cases: Sequence[int], stopped: Callable[[], bool]) -> list[Columns]:
    """The histories of some cases, or of the nominal, as `drawn` takes them; none any more once `stopped()` is true."""
    if stopped():
        return []
    table, noise = drawn(campaign, np.array(cases, dtype=np.int64))
    flights = flyer.histories(full_inputs(campaign, table), noise, campaign.retention.rows, stopped)
    histories = []
    with suppress(RunStopped):
        for case in takewhile(lambda _: not stopped(), cases):
            histories.append(_with_case(case, next(flights)[1]))
    return histories


def _are_kept(store: Store, campaign: Campaign, saved: list[int]) -> bool:
    """Whether undamaged histories of these cases are stored; a refused case, which has never started, has none."""
    part = store.history_part
    if part is None or problem_of(store.path / part.file, store.histories):
        return False
    refused = STATUS_NAME[REFUSED]
    expected = {*saved} - _cases_that_ended(store, (refused,))
    if _saves_nominal(store, campaign, (refused, *_DANGEROUS)):
        expected.add(NOMINAL_CASE)
    return set(store.histories().get("case_id", [])) == expected


def _saves_nominal(store: Store, campaign: Campaign, without: Sequence[str]) -> bool:
    """Whether the history of the nominal is asked for, and its status is none of `without`."""
    return campaign.retention.nominal and store.nominal()["status"] not in without


def cases_to_save(store: Store, campaign: Campaign) -> list[int]:
    """The cases whose history is saved: the first ones, those listed, and the worst completed ones; each once."""
    retention = campaign.retention
    chosen = [*range(min(retention.first, store.n_cases)), *(case for case in retention.cases if case < store.n_cases)]
    for found in _worst_cases(store, campaign):
        chosen += found.case_ids.tolist()
    dangerous = _cases_that_ended(store, _DANGEROUS)
    return [case for case in dict.fromkeys(chosen) if case not in dangerous]


def _worst_cases(store: Store, campaign: Campaign) -> list[WorstSoFar]:
    """The worst completed cases of each metric whose worst ones are to be saved, from one reading of the parts."""
    requirements = [vars(requirement) for requirement in campaign.requirements]
    asked, found = campaign.retention.worst_of, []
    for worst in asked:
        limits = limits_on(worst.metric, requirements) if worst.side is None else None
        found.append(WorstSoFar(worst.count, limits, worst.side != "smallest"))
    if asked:
        read = metric_parts(store, list(dict.fromkeys(worst.metric for worst in asked)))
        for part, (_, numbers) in zip(store.parts, read, strict=True):
            for worst, so_far in zip(asked, found, strict=True):
                so_far.add(numbers[worst.metric], part.first)
    return found


def _cases_that_ended(store: Store, words: Sequence[str]) -> set[int]:
    """The cases with one of these statuses."""
    if not set(store.status_counts()) & set(words):
        return set()
    table = store.cases(["case_id", "status"])
    return set(table.loc[table["status"].isin(words), "case_id"])


def _with_case(case_id: int, history: Columns) -> Columns:
    """One history as columns: case_id, t_s and the outputs."""
    return {"case_id": np.full(len(history["t_s"]), case_id, dtype=np.int64), **history}


def history_frame(case_id: int, history: Columns) -> "pd.DataFrame":
    """One history as a table: case_id, t_s and the outputs."""
    import pandas as pd

    return pd.DataFrame(_with_case(case_id, history))
