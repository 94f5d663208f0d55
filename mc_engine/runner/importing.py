"""Import of results computed elsewhere into a run directory, which is reported, compared and judged like any other.

The table has a row for each case of the campaign: `case_id`, the dispersed inputs, the metrics, and optionally `status`
and `reason`.  The inputs in the table must agree with those of `mc-engine sample`.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pandas as pd

from mc_engine.campaign.cases import case_table
from mc_engine.campaign.inputs import number
from mc_engine.campaign.loading import Campaign
from mc_engine.campaign.tables_beside import numbers, read_columns
from mc_engine.errors import CampaignError, Problem
from mc_engine.flight.chunks import LARGEST_CHUNK, chunks_of
from mc_engine.flight.flyer import Columns
from mc_engine.model.files import FileFault
from mc_engine.numbers_in_text import is_number
from mc_engine.runner.flown_campaign import companions_of
from mc_engine.runner.manifest import columns_of, manifest_of
from mc_engine.sampling.distributions import column as typed_column
from mc_engine.status import NO_RESULT, NOT_FINITE, OK, STATUS_NAME
from mc_engine.store.run_files import NO_NOMINAL, NOMINAL_CASE
from mc_engine.store.store import Store, create_store
from mc_engine.suggestions import hint

_SAME = 1e-9  # of an input, which a CSV may round
_NO_METRICS = ("case_id", "status", "reason")
_NUMBERED = "; add it, with the number of each case from 0; `reset_index` of pandas makes a column of an index"
_MOST = 20  # problems of one table


def import_results(campaign: Campaign, file: Path, out: Path, history: Path | None = None) -> Store:
    """Make the run directory `out` for a campaign from the table in `file`, Parquet or CSV.

    A row with the case_id -1 is the nominal case.  history : table of case_id, t_s and the outputs.
    Raises CampaignError with every mistake of the tables.
    """
    problems: list[Problem] = []
    with _problems_of(file):
        table = {name: np.asarray(cells) for name, cells in read_columns(file).items()}
    past = None if history is None else _read_history(campaign, history)
    rows, nominal = _results(campaign, file, table, problems)
    if problems:
        raise CampaignError(file.name, problems[:_MOST])
    left_out = [name for name in table if name not in (*rows, *_NO_METRICS)]
    imported = {"file": file.name, "history": None if history is None else history.name, "left_out": left_out}
    manifest = {**manifest_of(campaign), "histories_of_first": None, "imported": imported}  # why they exist is unknown
    columns = [column for column in columns_of(campaign) if column.name in rows]  # states of a model are not in tables
    store = create_store(out, manifest, campaign.text, columns, companions_of(campaign))
    with store.lock():
        for first, stop in chunks_of([(0, campaign.cases)], LARGEST_CHUNK):
            store.append(first, stop - first, {name: column[first:stop] for name, column in rows.items()})
        store.write_nominal({name: column[0] for name, column in nominal.items()})
        if past is not None:
            store.write_histories(past)
    return store


@contextmanager
def _problems_of(file: Path) -> Iterator[None]:
    """Turn a FileFault into the CampaignError of this table."""
    try:
        yield
    except FileFault as fault:
        raise CampaignError(file.name, [Problem("", str(fault))]) from None


def _results(campaign: Campaign, file: Path, table: Columns, problems: list[Problem]) -> tuple[Columns, Columns]:
    """(rows of all cases but case_id, the nominal row), with what is wrong added to `problems`."""
    inputs = [dispersion.name for dispersion in campaign.dispersions]
    metrics = [metric.name for metric in campaign.model.metrics]
    needed = ["case_id", *inputs, *metrics]
    problems += [
        Problem(name, f"is no column of the table{_NUMBERED if name == 'case_id' else hint(name, table)}")
        for name in needed
        if name not in table
    ]
    if problems:
        return {}, {}
    try:
        values = {name: _numbers_or_nan(file, name, table[name]) for name in ("case_id", *metrics)}
    except FileFault as fault:
        problems.append(Problem("", str(fault)))
        return {}, {}
    ids = values["case_id"]
    problems += _wrong_ids(campaign, ids)
    if problems:
        return {}, {}
    order = np.argsort(ids)
    order = order[ids[order] != NOMINAL_CASE]
    drawn = case_table(campaign, np.arange(campaign.cases))
    _refuse_unknown_words(table, problems)
    place = np.flatnonzero(ids == NOMINAL_CASE)
    for name in inputs:
        _compare(name, table[name][order], drawn[name], file, problems)
        wanted = typed_column([campaign.nominal[name]] * place.size)
        _compare(name, table[name][place], wanted, file, problems, nominal=True)
    rows = {name: values[name][order] for name in metrics}
    return {**drawn, **_judged(campaign, table, order, rows)}, _nominal(campaign, table, place, values, metrics)


def _wrong_ids(campaign: Campaign, ids: np.ndarray) -> list[Problem]:
    """What is wrong with the case ids of the results: at most one problem."""
    given, counts = np.unique(ids, return_counts=True)
    missing = np.setdiff1d(np.arange(campaign.cases), given)
    if problems := _unknown_ids(campaign, ids):
        return problems
    if missing.size:
        has = f"the campaign has the cases 0 to {campaign.cases - 1}; --cases takes another number of them"
        failed = 'a case that failed needs a row, too, with a status such as "crashed"'
        return [Problem("case_id", f"case {missing[0]} is missing; {has}; {failed}")]
    twice = given[counts > 1]
    return [Problem("case_id", f"case {twice[0]:.0f} is there twice; remove one of its rows")] if twice.size else []


def _unknown_ids(campaign: Campaign, ids: np.ndarray) -> list[Problem]:
    """The first case id of a table that the campaign has not."""
    unknown = np.flatnonzero(~np.isin(ids, np.arange(NOMINAL_CASE, campaign.cases)))
    if not unknown.size:
        return []
    has = f"it has the cases 0 to {campaign.cases - 1}, and {NOMINAL_CASE} for the nominal case"
    way_out = "remove the row, or choose another number of cases with --cases"
    row = unknown[0]
    return [Problem("case_id", f"row {row + 1}: {ids[row]:.15g} is no case of the campaign; {has}; {way_out}")]


def _numbers_or_nan(file: Path, name: str, cells: np.ndarray) -> np.ndarray:
    """float64[n]; an empty cell is not a number, as a metric of a failed case.  FileFault for a word."""
    if cells.dtype.kind in "fiu":
        return cells.astype(np.float64)
    import pyarrow as pa

    empty, texts = pd.isna(cells) | (cells == ""), cells.astype(str)
    try:
        return np.asarray(pa.array(texts, pa.string(), mask=empty).cast(pa.float64()).to_numpy(zero_copy_only=False))
    except pa.ArrowInvalid:
        row = next(row for row, text in enumerate(texts) if not (empty[row] or is_number(text)))
    raise FileFault(f'"{file.name}", row {row + 1}, column "{name}": {str(cells[row])!r:.60} is not a number')


def _refuse_unknown_words(table: Columns, problems: list[Problem]) -> None:
    """Note the first status that no case can have."""
    if "status" in table:
        cells, known = table["status"], [*STATUS_NAME.values()]
        unknown = np.flatnonzero(~(pd.isna(cells) | np.isin(cells.astype(str), ["", *known])))
        if unknown.size:
            word = str(cells[unknown[0]])
            message = f'row {unknown[0] + 1}: "{word:.60}" is no status of a case{hint(word, known)}'
            problems.append(Problem("status", message))


def _compare(
    name: str, given: np.ndarray, drawn: np.ndarray, file: Path, problems: list[Problem], nominal: bool = False
) -> None:
    """Note an input that is not the one that the campaign draws, or not the nominal one."""
    if drawn.dtype.kind == "f":
        try:
            cells = numbers(file, name, given)
        except FileFault as fault:
            problems.append(Problem("", str(fault)))
            return
        wrong = np.flatnonzero(~(np.abs(cells - drawn) <= _SAME * np.maximum(np.abs(drawn), 1e-300)))
        texts = [number(float(column[wrong[0]])) for column in (cells, drawn)] if wrong.size else []
    else:
        wrong = np.flatnonzero(np.char.lower(given.astype(str)) != np.char.lower(drawn.astype(str)))
        texts = [str(column[wrong[0]]) for column in (given, drawn)] if wrong.size else []
    if wrong.size:
        differ = "1 case differs" if wrong.size == 1 else f"{wrong.size:,} cases differ"
        message = f"case {wrong[0]} has {texts[0]}, and the campaign draws {texts[1]}; {differ}"
        if nominal:
            message = f"case -1 has {texts[0]}, and the nominal value of the campaign is {texts[1]}"
        problems.append(Problem(name, f"{message}; `mc-engine sample` gives the inputs"))


def _judged(campaign: Campaign, table: Columns, order: np.ndarray, rows: Columns) -> Columns:
    """Status and reason of each case, and its metrics, which a failed case has not."""
    words = {name: np.full(len(order), "", dtype=object) for name in ("status", "reason")}
    for name in words.keys() & table.keys():
        cells = table[name][order]
        words[name] = np.where(pd.isna(cells), "", cells.astype(str)).astype(object)
    status = np.where(words["status"] == "", STATUS_NAME[OK], words["status"]).astype(object)
    for metric in campaign.model.metrics:
        if not metric.sometimes:
            lost = (status == STATUS_NAME[OK]) & ~np.isfinite(rows[metric.name])
            status[lost] = STATUS_NAME[NOT_FINITE]
            words["reason"][lost] = f'"{metric.name}" is no finite number in the imported table'
    failed = status != STATUS_NAME[OK]
    metrics = {name: np.where(failed, np.nan, column) for name, column in rows.items()}
    return {"status": status, "reason": words["reason"], **metrics}


def _nominal(campaign: Campaign, table: Columns, place: np.ndarray, values: Columns, metrics: list[str]) -> Columns:
    """The nominal row: the one with the case_id -1, judged as the others are, or one without results.

    place : int64[0 or 1], where it is in the table
    """
    known = {dispersion.name: campaign.nominal[dispersion.name] for dispersion in campaign.dispersions}
    if place.size:
        row = {**known, **_judged(campaign, table, place, {name: values[name][place] for name in metrics})}
    else:
        row = {**known, "status": STATUS_NAME[NO_RESULT], "reason": NO_NOMINAL, **dict.fromkeys(metrics, np.nan)}
    return {name: typed_column(np.ravel(value).tolist()) for name, value in row.items()}


def _read_history(campaign: Campaign, file: Path) -> Columns:
    """The columns of a history table; CampaignError for one that is missing, unknown cases, and times that fall."""
    if not campaign.model.quantities:
        what = "declares no outputs, of which a time history could be kept; leave --history out, or declare them"
        raise CampaignError(file.name, [Problem("", f"{campaign.model.name} {what}")])
    with _problems_of(file):
        table = read_columns(file)
        names = ["case_id", "t_s", *(quantity.name for quantity in campaign.model.quantities)]
        if missing := [name for name in names if name not in table]:
            raise FileFault(f'"{file.name}" has no column "{missing[0]}"')
        columns = {name: numbers(file, name, np.asarray(table[name])) for name in names}
    if problems := _unknown_ids(campaign, columns["case_id"]) or _falling_times(columns["case_id"], columns["t_s"]):
        raise CampaignError(file.name, problems)
    return {**columns, "case_id": columns["case_id"].astype(np.int64)}


def _falling_times(ids: np.ndarray, times: np.ndarray) -> list[Problem]:
    """The first row of a history whose time is before that of the case's row above it."""
    order = np.argsort(ids, kind="stable")
    falls = np.flatnonzero((np.diff(ids[order]) == 0) & (np.diff(times[order]) < 0))
    if not falls.size:
        return []
    before, row = order[falls[0]], order[falls[0] + 1]
    what = f"{number(times[row])} s follows {number(times[before])} s of case {ids[row]:.0f}"
    return [Problem("t_s", f"row {row + 1}: {what}; sort the rows of each case by time")]
