from itertools import pairwise

import duckdb
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_run import COLUMNS, MANIFEST, TEXT, block, created, filled, row

from mc_engine.durable_file import temporary_name
from mc_engine.errors import StoreError
from mc_engine.store import parts
from mc_engine.store.opening import open_store
from mc_engine.store.parts import write_aside
from mc_engine.store.run_files import NOMINAL_CASE, is_run_directory
from mc_engine.store.store import create_store
from mc_engine.store.verification import damage, damages, remedies

# ---- a store gives back what was put in


@settings(max_examples=25, deadline=None)
@given(cuts=st.sets(st.integers(1, 39)), order=st.randoms(use_true_random=False))
def test_the_table_is_the_same_however_the_cases_were_cut_and_ordered(tmp_path_factory, cuts, order):
    store = create_store(tmp_path_factory.mktemp("any") / "run", MANIFEST, TEXT, COLUMNS)
    edges = [0, *sorted(cuts), 40]
    ranges = list(pairwise(edges))
    order.shuffle(ranges)
    for first, stop in ranges:
        store.append(first, stop - first, block(first, stop - first))
    table = open_store(store.path).cases()
    expected = block(0, 40)
    assert table["case_id"].tolist() == list(range(40))
    for name in ("ve_pct", "propellant_kg", "end_x_km"):
        assert table[name].to_numpy().tobytes() == np.asarray(expected[name], float).tobytes()
    for name in ("control", "j2", "reason"):
        assert table[name].tolist() == expected[name].tolist()
    assert store.committed() == [(0, 40)]
    assert store.missing(45) == [(40, 45)]


@pytest.mark.parametrize("history", [False, True])
def test_every_bit_of_a_number_comes_back(history):
    numbers = np.array([0.0, -0.0, 5e-324, -1.7976931348623157e308, np.inf, -np.inf, np.nan, 1 / 3])
    numbers.view(np.uint64)[6] |= 0x8000_0000_0000_0123  # a NaN with a sign and a payload
    counts = np.array([0, -1, 2**63 - 1, -(2**63), 2**53 + 1, 1, 2, 3])
    read = parts.parquet_table(parts.parquet_bytes(pa.table({"a": numbers, "n": counts}), history))
    assert read["a"].to_numpy().tobytes() == numbers.tobytes()
    assert read["n"].to_numpy().tolist() == counts.tolist()


def test_a_store_shows_its_folder(store):
    assert repr(store) == f"Store('{store.path}')"


def test_the_table_carries_units_and_meanings(store):
    table = filled(store).cases()
    assert table.attrs["units"]["propellant_kg"] == "kg"
    assert table.attrs["descriptions"]["ve_pct"] == "error of the speed change"
    assert table.attrs["roles"]["end_x_km"] == "state"
    assert list(table.attrs["units"]) == list(table.columns) == list(store.units)


def test_an_empty_store_gives_a_table_without_rows_and_with_every_column(store):
    table = store.cases()
    assert len(table) == 0
    assert list(table.columns) == ["case_id", "status", "reason", *(column.name for column in COLUMNS)]
    assert table["propellant_kg"].dtype == np.float64
    assert table.attrs["units"]["ve_pct"] == "%"
    assert store.committed() == []
    assert store.missing() == [(0, 40)]
    assert store.status_counts() == {}
    assert store.nominal() == {}
    assert list(store.histories().columns) == ["case_id", "t_s", "force_n"]


def test_plain_pandas_reads_the_cases_with_their_units(store):
    table = pd.read_parquet(filled(store).path / "cases")
    pd.testing.assert_frame_equal(table, store.cases())
    assert table.attrs["units"]["propellant_kg"] == "kg"


def test_duckdb_reads_the_cases(store):
    run = filled(store).path
    query = f"SELECT count(*), sum(ve_pct), count(DISTINCT status) FROM '{run}/cases/*.parquet' WHERE case_id < 20"
    count, total, words = duckdb.sql(query).fetchall()[0]
    assert (count, words) == (20, 2)
    assert total == pytest.approx(block(0, 20)["ve_pct"].sum(), rel=1e-12)


def test_a_part_written_half_is_seen_by_neither_pandas_nor_duckdb(store):
    run = filled(store).path
    (run / temporary_name(f"cases/{parts.part_name(40, 10)}")).write_bytes(b"PAR1 and no more")
    assert len(pd.read_parquet(run / "cases")) == 40
    assert duckdb.sql(f"SELECT count(*) FROM '{run}/cases/*.parquet'").fetchall() == [(40,)]


def test_every_field_on_disk_has_unit_role_and_description(store):
    path = next((filled(store).path / "cases").glob("part-*"))
    schema = pq.read_schema(path)
    assert schema.field("propellant_kg").metadata == {
        b"unit": b"kg",
        b"role": b"metric",
        b"description": b"propellant used",
    }
    assert all(set(field.metadata) == {b"unit", b"role", b"description"} for field in schema)
    assert len({pq.read_schema(part).serialize().to_pybytes() for part in path.parent.iterdir()}) == 1


def test_columns_that_do_not_fit_are_refused_by_name_and_leave_nothing(store):
    for change, message in [
        ({"ve_pct": np.zeros(9)}, r'"ve_pct" has shape \(9,\), not \(10,\)'),
        ({"fuel_kg": np.zeros(10)}, '"fuel_kg" is not one of this run'),
        ({"propellant_kg": None}, '"propellant_kg" is missing'),
        ({"propellant_kg": ["a lot"] * 10}, '"propellant_kg" is no number'),
        ({"status": np.full(10, 99)}, '"status" is no word'),
        ({"case_id": np.arange(1, 11)}, "case_id does not count from 0 to 9"),
    ]:
        columns = {name: values for name, values in {**block(0, 10), **change}.items() if values is not None}
        with pytest.raises(StoreError, match=message):
            store.append(0, 10, columns)
        assert store.committed() == []
        assert list((store.path / "cases").iterdir()) == []


@pytest.mark.parametrize(("first", "count"), [(0, 10), (5, 10), (39, 1), (8, 40)])
def test_a_case_is_never_committed_twice(store, first, count):
    filled(store)
    others = {**block(first, count), "ve_pct": np.full(count, 99.0)}
    with pytest.raises(StoreError, match="committed already"):
        store.append(first, count, others)
    with store.lock(), pytest.raises(StoreError, match="committed already"):  # a worker's that was taken for dead
        store.publish(write_aside(store.path, store.columns, first, count, others))
    assert damage(store.path) == []  # refused before a committed file was written over
    assert store.cases()["ve_pct"].tolist() == block(0, 40)["ve_pct"].tolist()


def test_ranges_committed_out_of_order_leave_the_gaps_missing(store):
    store.append(30, 5, block(30, 5))
    store.append(10, 10, block(10, 10))
    store.append(35, 2, block(35, 2))
    assert store.committed() == [(10, 20), (30, 37)]
    assert store.missing() == [(0, 10), (20, 30), (37, 40)]
    assert store.missing(range(15, 32)) == [(20, 30)]
    assert store.missing(range(31, 36)) == []
    assert store.missing(0) == []


# ---- nominal, histories, notes


def test_the_nominal_is_kept_apart_as_case_minus_one(store):
    given = row(7)
    store.write_nominal(given)
    nominal = open_store(store.path).nominal()
    assert nominal["case_id"] == -1
    assert nominal["status"] == "ok"
    assert nominal["ve_pct"] == given["ve_pct"]
    assert len(store.cases()) == 0
    assert pd.read_parquet(store.path / "nominal.parquet")["propellant_kg"].tolist() == [given["propellant_kg"]]


def test_a_nominal_that_a_worker_wrote_is_committed_or_removed_by_the_next_writer(store):
    arrays = {name: np.asarray([value]) for name, value in row(7).items()}
    with store.lock():
        written = write_aside(store.path, store.columns, NOMINAL_CASE, 1, arrays)
        write_aside(store.path, store.columns, NOMINAL_CASE, 1, arrays)  # another worker's, whose writer is killed
        store.publish(written)
    content, line = (store.path / "nominal.parquet").read_bytes(), store.notes("nominal")[-1].facts
    assert len([*store.path.glob(".nominal.parquet.*.tmp")]) == 1
    with open_store(store.path).lock():
        assert not [*store.path.glob(".nominal.parquet.*.tmp")]
    store.write_nominal(row(7))
    assert (store.path / "nominal.parquet").read_bytes() == content
    assert store.notes("nominal")[-1].facts == line
    assert (line["first"], line["rows"], line["status"]) == (-1, 1, {})


def test_a_case_that_was_not_flown_has_empty_words(store):
    store.append(0, 10, {**block(0, 10), "control": np.array(["off", *[np.nan] * 9], dtype=object)})
    store.append(10, 1, {**block(10, 1), "control": np.array([np.nan])})
    assert store.cases()["control"].tolist() == ["off", *[""] * 10]


def test_histories_come_back_with_units_and_replace_those_kept_before(store):
    for scale in (1.0, 2.0):
        store.write_histories({"case_id": [3, 3, 9], "t_s": [0.0, 1.0, 0.0], "force_n": np.array([1, 2, 3]) * scale})
    histories = open_store(store.path).histories()
    assert histories["force_n"].tolist() == [2.0, 4.0, 6.0]
    assert histories["case_id"].tolist() == [3, 3, 9]
    assert histories.attrs["units"] == {"case_id": "", "t_s": "s", "force_n": "N"}
    pd.testing.assert_frame_equal(pd.read_parquet(store.path / "history"), histories)
    store.write_histories(histories)
    pd.testing.assert_frame_equal(store.histories(), histories)


# ---- creation


def test_a_directory_that_holds_a_run_is_refused_and_kept(store):
    filled(store)
    with pytest.raises(StoreError, match=rf"{store.path}: holds a run already"):
        create_store(store.path, MANIFEST, "other", COLUMNS)
    assert len(open_store(store.path).cases()) == 40


@pytest.mark.parametrize("name", ["campaign.toml", "notes.txt", "manifest.json"])
def test_a_directory_with_someones_files_is_refused_and_untouched(run, name):
    run.mkdir()
    (run / name).write_text("mine")
    with pytest.raises(StoreError, match="is not empty and holds no run"):
        created(run)
    assert [path.name for path in run.iterdir()] == [name]
    assert (run / name).read_text() == "mine"


def killed_at(n):
    calls = iter(range(1000))

    def write(root, name, content):
        if next(calls) == n:
            raise KeyboardInterrupt
        parts.write_inside(root, name, content)

    return write


def test_a_creation_that_was_killed_anywhere_can_be_made_again(tmp_path, monkeypatch):
    reached = 0
    while True:
        run = tmp_path / f"run-{reached}"
        with monkeypatch.context() as patch:
            patch.setattr("mc_engine.store.store.disk.write_inside", killed_at(reached))
            try:
                created(run)
                break
            except KeyboardInterrupt:
                reached += 1
        assert damage(created(run).path) == []
    assert reached == 3


def test_a_folder_without_a_run_is_named_in_the_refusal(tmp_path):
    with pytest.raises(StoreError, match=rf"{tmp_path}: is no run directory"):
        open_store(tmp_path)
    with pytest.raises(StoreError, match="nowhere: there is no such folder"):
        open_store(tmp_path / "nowhere")
    assert not is_run_directory(tmp_path)


def test_a_run_of_a_newer_engine_is_refused_and_not_said_to_be_damaged(run):
    create = {**MANIFEST, "format": 2}
    with pytest.raises(StoreError, match=r"newer engine; this one reads format 1: update mc-engine$"):
        create_store(run, create, TEXT, COLUMNS)
    [problem] = [item for item in damages(run) if item.file == "manifest.json"]
    assert remedies(run, [problem]) == ["update mc-engine, and verify again: whether anything is damaged is not known"]


# ---- speed
