"""Tables, messages and copies of runs that no memory takes or no engine wrote, and numbers beyond their range."""

import contextlib
import json
import math
import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from mutated_records import assert_answered, call, put_companion

from mc_engine import load_campaign, open_store
from mc_engine.campaign import tables_beside as case_files
from mc_engine.campaign.orbit_messages import MessageFault, _finite_number
from mc_engine.campaign.tables_beside import read_columns
from mc_engine.errors import CampaignError
from mc_engine.model.files import FileFault
from mc_engine.runner import runner
from mc_engine.store.journal import encode, scan

HEAD = '[campaign]\nmodel = "campaigns.deorbit"\n'
RANDOM = HEAD + 'design = "mc"\ncases = 10\nseed = 1\n'
TABLE = HEAD + 'design = "table"\ntable = "cases.{kind}"\n'
FUEL = '[requirement.fuel]\nmetric = "propellant_kg"\nat_most = 2.5\n'


def refused(text, folder):
    with pytest.raises(CampaignError) as caught:
        load_campaign("x.toml", text=text, directory=folder)
    return str(caught.value)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (FUEL + "confidence = 1e-17", "by 1e-12 at least"),
        (FUEL + "confidence = 1e-300", "by 1e-12 at least"),
        (FUEL + "share = 0.9999999999999999", "by 1e-12 at least"),
        ('[dispersion.ve_pct]\ndist = "discrete"\nvalues = [1.0, 2.0]\nweights = [1e308, 1e308]', "at most 1e+50"),
        ('[dispersion.ve_pct]\ndist = "discrete"\nvalues = [1.0, 2.0]\nweights = [nan, 1]', "finite"),
    ],
)
def test_numbers_of_a_campaign_have_a_range(tmp_path, body, words):
    assert words in refused(RANDOM + body, tmp_path)


# ---- tables of cases


CELLS = ["1_0", "\u0661\u0662", "nan", "inf", "-Infinity", "0x10", "1e", "1,5", "\uff11", "1e400", "--1", ""]


@pytest.mark.parametrize("cell", CELLS)
def test_a_cell_is_a_number_as_people_write_it(tmp_path, cell):
    (tmp_path / "cases.csv").write_text(f've_pct,oe_pct\n1.5,2\n"{cell}",+.5e-1\n', encoding="utf-8")
    said = refused(TABLE.format(kind="csv"), tmp_path)
    assert f'row 2, column "ve_pct": "{cell}" is not a finite number' in said


@pytest.mark.parametrize("cell", CELLS)
def test_a_number_of_an_orbit_message_is_written_so_too(cell):
    with pytest.raises(MessageFault, match=r"line 9: .* is not a finite number"):
        _finite_number(9, cell)


def sparse(path, size):
    with open(path, "wb") as file:
        file.write(b"ve_pct,oe_pct\n1,2\n")
        file.truncate(size)


@pytest.mark.skipif(sys.platform == "win32", reason="files with holes need rights")
@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_a_table_of_60_gigabytes_is_refused_before_it_is_read(tmp_path, kind):
    sparse(tmp_path / f"cases.{kind}", 60 * 2**30)
    assert "has 64,424,509,440 bytes; at most " in refused(TABLE.format(kind=kind), tmp_path)
    text = RANDOM + f'[dispersion.ve_pct]\ndist = "empirical"\nfile = "cases.{kind}"'
    assert "has 64,424,509,440 bytes; at most " in refused(text, tmp_path)


def test_rows_columns_and_lines_of_a_table_have_bounds(tmp_path, monkeypatch):
    monkeypatch.setattr(case_files, "MOST_CSV_CELLS", 1000)
    path = tmp_path / "x.csv"
    for text, words in [
        ("a,b\n" + "1,2\n" * 501, "more than 1,000 cells"),
        ("a,b\n1," + "2" * 200_000, "field larger than field limit"),
        (",".join(f"c{k}" for k in range(900)) + "\n" + "1\n" * 9, "names 900 columns"),
    ]:
        path.write_text(text)
        with pytest.raises(FileFault, match=words):
            read_columns(path)
    path.write_text("a,b\n" + "1,2\n" * 500)
    assert len(read_columns(path)["b"]) == 500
    monkeypatch.setattr(case_files, "MOST_COLUMNS", 10)
    path.write_text(",".join(f"c{k}" for k in range(11)) + "\n")
    with pytest.raises(FileFault, match="11 columns; at most 10"):
        read_columns(path)


MEMORY = """
import resource, sys, time
from pathlib import Path
from mc_engine.campaign.tables_beside import FileFault, read_columns
begin = time.monotonic()
try:
    read_columns(Path(sys.argv[1]))
except FileFault as fault:
    print(fault, file=sys.stderr)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024, round(time.monotonic() - begin, 1))
"""


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="counts memory as Linux does")
@pytest.mark.parametrize("size", [250_000_000, 3_000_000_000])
def test_a_table_of_any_size_takes_bounded_memory(tmp_path, size, record_property):
    with open(tmp_path / "x.csv", "w") as file:
        file.write("a,b\n")
        rows = "".join(f"{k}.123456,{k}e-3\n" for k in range(100_000))
        for _ in range(size // len(rows)):
            file.write(rows)
    done = subprocess.run(
        [sys.executable, "-c", MEMORY, tmp_path / "x.csv"], capture_output=True, text=True, check=True
    )
    mib, seconds = map(float, done.stdout.split())
    record_property("memory in MiB", mib)
    record_property("seconds", seconds)
    assert "at most" in done.stderr or "more than" in done.stderr
    assert mib < 3000


def parquet(path, arrays, names=("ve_pct", "oe_pct")):
    pq.write_table(pa.Table.from_arrays(arrays, names=list(names[: len(arrays)])), path)


def words_of(content):
    """A column of words whose bytes are these, whether or not they are UTF-8."""
    offsets = pa.py_buffer(np.array([0, len(content)], dtype=np.int32).tobytes())
    return pa.Array.from_buffers(pa.string(), 1, [None, offsets, pa.py_buffer(content)])


PARQUETS = {
    "words that are no UTF-8": [words_of(b"\xff\xfe")],
    "nulls": [pa.array([1.0, None])],
    "lists": [pa.array([[1.0], [2.0]])],
    "records": [pa.array([{"a": 1.0}])],
    "dates": [pa.array([1, 2], pa.timestamp("ns"))],
    "decimals of 1e60": [pa.array(["1" + "0" * 60]).cast(pa.decimal256(70))],
    "bytes": [pa.array([b"\x00\xff"])],
    "infinite": [pa.array([math.inf])],
    "a column twice": [pa.array([1.0]), pa.array([2.0])],
    "no rows": [pa.array([], pa.float64())],
    "a dictionary of no UTF-8": [pa.DictionaryArray.from_arrays([0], words_of(b"\xff"))],
}


@pytest.mark.parametrize("case", PARQUETS)
def test_a_parquet_table_of_other_kinds_is_refused(tmp_path, case):
    parquet(tmp_path / "cases.parquet", PARQUETS[case], ("ve_pct", "ve_pct"))
    assert "campaign.table: " in refused(TABLE.format(kind="parquet"), tmp_path)


def test_a_parquet_table_that_swells_is_refused_by_its_own_account(tmp_path, monkeypatch):
    parquet(tmp_path / "cases.parquet", [pa.array(np.zeros(100_000))])
    monkeypatch.setattr(case_files, "MOST_PARQUET_CELLS", 99_999)
    assert "more than the 99,999 cells" in refused(TABLE.format(kind="parquet"), tmp_path)


# ---- names and texts


@pytest.fixture(scope="module")
def minimal():
    return Path(load_campaign("minimal").directory)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="names of files are text elsewhere")
def test_a_folder_whose_name_is_no_text_is_refused(tmp_path, minimal, chain):
    odd = os.fsdecode(os.path.join(os.fsencode(tmp_path), b"\xff\xfe"))
    for command in (("check", "--no-model", odd), ("run", odd), ("run", "minimal", "--out", f"{odd}x")):
        if command[0] == "check":
            shutil.copytree(minimal, odd)
        assert_answered(done := call(*command), 2)
        assert "a name is no text in UTF-8" in done.stderr
    assert not os.path.exists(f"{odd}x")
    shutil.copytree(chain.parent / "first", run := Path(odd) / "run")
    with contextlib.chdir(run):
        assert_answered(call("report", ".", "--format", "md"), 0)


@pytest.mark.parametrize("place", ["size of the burn", "largest speed", "Apogee raised by one burn"])
def test_half_a_letter_in_a_text_of_the_model_is_refused(tmp_path, minimal, place):
    shutil.copytree(minimal, tmp_path / "c")
    model = tmp_path / "c" / "model.py"
    model.write_text(model.read_text().replace(f'"{place}"', f'"{place}\\ud800"'))
    done = call("check", tmp_path / "c")
    assert_answered(done, 2)
    assert r"'\ud800'" in done.stderr


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="a clock is shifted by the loader of Linux")
def test_a_clock_before_1970_makes_no_pdf_and_says_so(monkeypatch):
    from mc_engine.errors import EngineError
    from reports.formats import pdf

    monkeypatch.setattr(pdf.time, "time", lambda: -1.0)
    with pytest.raises(EngineError, match="the clock of this computer stands before 1970"):
        pdf.typeset("{}")


# ---- copies of the run upstream, parts


FIRST = (
    '[campaign]\nmodel = "tests.faults.traps.model"\ndesign = "mc"\ncases = 30\nseed = 1\n'
    '[dispersion.height_m]\ndist = "normal"\nsigma = 10.0\n'
)
SECOND = (
    '[campaign]\nmodel = "tests.faults.traps.model"\ndesign = "mc"\nseed = 2\n'
    '[inputs]\nfrom = "../first"\n[inputs.columns]\nspeed_m_s = "impact_speed_m_s"\n'
)


@pytest.fixture(scope="module")
def chain(tmp_path_factory):
    folder = tmp_path_factory.mktemp("chain")
    for name, text in (("one", FIRST), ("two", SECOND)):
        (folder / name).mkdir()
        (folder / name / "campaign.toml").write_text(text)
    runner.run(load_campaign(folder / "one"), folder / "first", workers=1)
    return runner.run(load_campaign(folder / "two"), folder / "second", workers=1).path


FACTS = b"mc_engine.campaign.upstream"


def facts_changed(change):
    def of(table):
        facts = json.loads(table.schema.metadata[FACTS])
        facts = change(facts) or facts
        return table.replace_schema_metadata({FACTS: json.dumps(facts)})

    return of


def other(name, array):
    def of(table):
        return table.set_column(table.column_names.index(name), name, array(table))

    return of


COPIES = {
    "no Parquet": lambda table: b"PAR1 and nothing else",
    "nothing": lambda table: b"",
    "a column less": lambda table: table.drop_columns(["status"]),
    "no case_id": lambda table: table.drop_columns(["case_id"]),
    "a column twice": lambda table: table.append_column("status", table["status"]),
    "fewer rows": lambda table: table.slice(0, 7),
    "more rows": lambda table: pa.concat_tables([table, table]),
    "no rows": lambda table: table.slice(0, 0),
    "nulls": other("impact_speed_m_s", lambda table: pa.nulls(table.num_rows, pa.float64())),
    "words for numbers": other("impact_speed_m_s", lambda table: pa.array(["x"] * table.num_rows)),
    "numbers for words": other("status", lambda table: pa.array(range(table.num_rows))),
    "a dictionary": other("status", lambda table: table["status"].dictionary_encode()),
    "lists": other("impact_speed_m_s", lambda table: pa.array([[1.0]] * table.num_rows)),
    "huge words": other("reason", lambda table: pa.array(["x" * 10**6] * table.num_rows)),
    "no UTF-8": other("reason", lambda table: pa.concat_arrays([words_of(b"\xff")] * table.num_rows)),
    "a status that there is not": other("status", lambda table: pa.array(["fine"] * table.num_rows)),
    "no facts": lambda table: table.replace_schema_metadata(None),
    "facts as a list": facts_changed(lambda facts: [1]),
    "facts without columns": facts_changed(lambda facts: facts.pop("columns") and None),
    "columns of another kind": facts_changed(lambda facts: facts["columns"][0].update(kind="word")),
    "a nominal case of words": facts_changed(lambda facts: facts["nominal"].update(impact_speed_m_s="x")),
    "no nominal case": facts_changed(lambda facts: facts.update(nominal={})),
    "a name as a number": facts_changed(lambda facts: facts.update(name=7)),
}


@pytest.mark.parametrize("case", COPIES)
def test_a_crafted_copy_of_the_run_upstream_is_refused(chain, tmp_path, case):
    run = shutil.copytree(chain, tmp_path / "run")
    made = COPIES[case](pq.read_table(run / "upstream.parquet"))
    if not isinstance(made, bytes):
        pq.write_table(made, tmp_path / "made.parquet")
        made = (tmp_path / "made.parquet").read_bytes()
    put_companion(run, "upstream.parquet", made)
    (run / "cases" / open_store(run).parts[0].file.split("/")[1]).unlink()
    for command in (("replay", run, "3"), ("resume", run, "--repair", "--no-report")):
        done = call(*command)
        assert_answered(done, 2, 5)


def falsified(run, change):
    """Put another table, for which the journal vouches, in place of the first part."""
    entries = list(scan((run / "journal.jsonl").read_bytes()).entries)
    entry = next(one for one in entries if one.event == "part")
    from hashlib import sha256

    from mc_engine.store.parts import parquet_bytes

    content = parquet_bytes(change(pq.ParquetFile(run / entry.facts["file"]).read(use_threads=False)))
    (run / entry.facts["file"]).write_bytes(content)
    entry.facts.update(bytes=len(content), sha256=sha256(content).hexdigest())
    lines = [encode(number, one.at, one.event, one.facts) for number, one in enumerate(entries, start=1)]
    (run / "journal.jsonl").write_bytes(b"".join(lines))


@pytest.mark.parametrize("name", ["case_id", "status", "reason", "height_m", "impact_speed_m_s"])
def test_a_deleted_column_of_a_part_is_named_by_every_command(chain, tmp_path, name):
    run = shutil.copytree(chain.parent / "first", tmp_path / "run")
    falsified(run, lambda table: table.drop_columns([name]))
    for command in (("report", run, "--format", "md"), ("compare", run, chain.parent / "first"), ("verify", run),
                    ("replay", run, "3")):  # fmt: skip
        done = call(*command)
        assert_answered(done, 5)
        assert f'part-0000000000-0000000029.parquet: the column "{name}" is missing' in done.output


# ---- many of them


def bad_inputs(rng, folder, minimal):
    """A command with one bad input of the kinds above, which no engine takes."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(minimal, folder)
    campaign, text = folder / "campaign.toml", (minimal / "campaign.toml").read_text()
    bad = ("nan", "inf", "-inf", "1e400", "1e-17", "-1", "0", "9" * 400, "[]", "{}", '""', "true", "1e308", '"x"')
    kind = int(rng.integers(6))
    if kind == 0:
        lines = text.splitlines()
        k = int(rng.choice([number for number, line in enumerate(lines) if "=" in line]))
        key = lines[k].partition("=")[0]
        lines[k] = f"{key}= {bad[rng.integers(len(bad))]}"
        campaign.write_text("\n".join(lines))
    elif kind == 1:
        cells = ("1_0", "\u0661", "nan", "", "x", "1e999", "0x1", "\x00", '"', "1,2,3")
        table = "burn_dv_m_s,pitch_error_deg\n1,1\n" + f"2,{cells[rng.integers(len(cells))]}\n"
        (folder / "cases.csv").write_text(table)
        campaign.write_text('[campaign]\nmodel = "model.py"\ndesign = "table"\ntable = "cases.csv"\n')
    elif kind == 2:
        made = list(PARQUETS.values())[rng.integers(len(PARQUETS))]
        parquet(folder / "cases.parquet", made, ("burn_dv_m_s", "burn_dv_m_s"))
        campaign.write_text('[campaign]\nmodel = "model.py"\ndesign = "table"\ntable = "cases.parquet"\n')
    elif kind == 3:
        content = bytearray(campaign.read_bytes())
        for _ in range(20):
            content[rng.integers(len(content))] = rng.integers(256)
        campaign.write_bytes(bytes(content))
    elif kind == 4:
        model = (folder / "model.py").read_text()
        odd = ("\\ud800", "\\x00", "\\x1b[2J")[rng.integers(3)]
        (folder / "model.py").write_text(model.replace("size of the burn", f"size{odd}"))
    else:
        option = ("--cases", "--seed", "--workers", "--max-failed", "--memory", "--case-seconds")[rng.integers(6)]
        number = ("nan", "inf", "-1", "9" * 30, "1_0", "\u0661", "x", "1e3e3")[rng.integers(8)]
        return ("run", folder, "--backend", "loky", "--out", folder / "run", option, number)
    return ("check", "--no-model", folder)


@pytest.mark.parametrize("count", [40, pytest.param(200, marks=pytest.mark.slow)])
def test_mutated_bad_inputs_never_exit_with_1(tmp_path, minimal, count, record_property):
    rng = np.random.default_rng(count)
    statuses = Counter()
    for _ in range(count):
        done = call(*bad_inputs(rng, tmp_path / "c", minimal))
        assert_answered(done, 0, 2, 5, 6)  # 0 where what was meant to be bad is not
        statuses[done.exit_code] += 1
    record_property("exit statuses", " ".join(f"{status}: {n}" for status, n in sorted(statuses.items())))
    assert statuses[2] > 0.6 * count
