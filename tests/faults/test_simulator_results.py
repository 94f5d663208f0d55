"""What simulators give that is no number and no history: such a case has no result, and the reason says why."""

import re
import tempfile
import time

import pytest
from typer.testing import CliRunner

from mc_engine import RunInterrupted, load_campaign, replay, resume, run
from mc_engine.command_line.commands import app
from mc_engine.flight import program_flight
from mc_engine.flight.flyers import flyer_of
from mc_engine.runner.flown_campaign import copies_of
from tests.mc_engine.flight.falling_ball import python_campaign

RESULTS = {
    "mark": ('\ufeff{"time": 1.5}', "ok", ""),
    "text": ('{"time": " -2.5E1 "}', "ok", ""),
    "nothing": ('{"time": null}', "ok", ""),  # of a metric that may be missing
    "large": ('{"time": 1%s}' % ("0" * 400), "not-finite", '"fall_time_s" is infinite'),
    "groups": ('{"time": "1_000"}', "no-result", '"fall_time_s" is 1_000, which is no number'),
    "Fortran": (
        '{"time": "0.15D+01"}',
        "no-result",
        '"fall_time_s" is 0.15D+01, which is no number; write its exponent with the letter E',
    ),
    "digits": ('{"time": "\u0661"}', "no-result", '"fall_time_s" is \u0661, which is no number'),
    "truth": ('{"time": true}', "no-result", '"fall_time_s" is true, which is no number'),
    "twice": ('{"time": 1.0, "time": 2.0}', "no-result", '"fall_time_s" is [1.0, 2.0], which is no number'),
    "deep": ("[" * 100_000, "no-result", "result.json cannot be read: maximum recursion depth"),
    "bytes": ("\udcff", "no-result", "result.json is not text in UTF-8"),
}


def test_a_result_is_read_by_the_syntax_of_numbers_and_of_text(tmp_path):
    for case, (text, _, _) in enumerate(RESULTS.values()):
        (tmp_path / f"{case}.json").write_bytes(text.encode(errors="surrogateescape"))
    (tmp_path / "-1.json").write_text('{"time": 1.0}')
    (tmp_path / "campaign.toml").write_text(f"""
[campaign]
cases = {len(RESULTS)}
design = "mc"
seed = 3
[simulator]
command = ["cp", "{tmp_path}/{{case_id}}.json", "result.json"]
result = "result.json"
parameter.mass_kg = {{ default = 10.0 }}
metric.fall_time_s = {{ read = "time", sometimes = true }}
[dispersion.mass_kg]
dist = "normal"
sigma = 0.5
""")
    table = run(load_campaign(tmp_path / "campaign.toml"), tmp_path / "run", workers=1).cases()
    assert table["fall_time_s"][:2].tolist() == [1.5, -25.0]
    for row, (_, status, reason) in zip(table.to_dict("records"), RESULTS.values(), strict=True):
        assert row["status"] == status, row
        assert reason in row["reason"]


def test_the_reason_of_a_crash_is_the_message_of_a_fortran_program_and_its_replay_has_the_same_bits(tmp_path):
    program = tmp_path / "fall"  # writes what gfortran does; addresses and the time are others in every process
    program.write_text("""#!/bin/sh
echo "At line 8 of file fall.f90 (unit = 10, file = 'fall.nml')
Fortran runtime error: Cannot match namelist object name .0 (process $$)

Error termination. Backtrace:
#0  0x7fb6$$c2 in ???
#8  0x7fb6$$49 in __libc_start_call_main
\tat ../sysdeps/nptl/libc_start_call_main.h:58
#9  0xffffffffffffffff in ???" >&2
exit 2
""")
    program.chmod(0o755)
    (tmp_path / "campaign.toml").write_text("""
[campaign]
cases = 1
design = "mc"
seed = 3
[simulator]
command = ["./fall"]
result = "result.json"
parameter.mass_kg = { default = 10.0 }
metric.fall_time_s = {}
[dispersion.mass_kg]
dist = "normal"
sigma = 0.5
""")
    store = run(load_campaign(tmp_path / "campaign.toml"), tmp_path / "run", workers=1)
    why = "At line 8 of file fall.f90 (unit = 10, file = 'fall.nml') | Fortran runtime error: Cannot match namelist "
    assert store.row(0)["reason"].startswith(f"ended with exit code 2: {why}object name .0 (process ")
    assert replay(tmp_path / "run", 0).differences == ()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"#!/no/such/shell\n", 'its first line names "/no/such/shell", which is not there'),
        (b"#!/bin/sh\r\necho\r\n", r'its first line names "/bin/sh\r", which is not there'),
        (b"echo 1\n", "it is no program for this machine, and no script, whose first line is such as #!/bin/sh"),
        (b"", "it is no program for this machine, and no script, whose first line is such as #!/bin/sh"),
    ],
)
def test_a_program_that_the_system_cannot_start_is_named_with_the_reason(tmp_path, content, said):
    (tmp_path / "fall").write_bytes(content)
    (tmp_path / "campaign.toml").write_text("""
[campaign]
cases = 1
design = "mc"
seed = 3
[simulator]
command = ["./fall"]
result = "result.json"
parameter.mass_kg = { default = 10.0 }
metric.fall_time_s = { read = "time" }
""")
    table = run(load_campaign(tmp_path / "campaign.toml"), tmp_path / "run", workers=1).cases()
    assert table["reason"].tolist() == [f"fall cannot be started: {said}"]


def test_a_pattern_that_is_searched_for_too_long_gives_no_result(monkeypatch):
    monkeypatch.setattr(program_flight, "BOUNDED_S", 0.2)
    sentence = 'the search of stdout for "(a+)+$", by which "time_s" is read, takes longer than 0.2 s'
    with pytest.raises(ValueError, match=re.escape(sentence)):
        program_flight._number("time_s", None, None, "(a+)+$", 25 * "a" + "!", False)


HISTORIES = {
    "times": ("pd.DataFrame({'t_s': [0.0, 2.0, 1.5], 'speed_m_s': 1.0})", "of the history fall from 2 s to 1.5 s"),
    "no time": (
        "pd.DataFrame({'t_s': [0.0, float('nan')], 'speed_m_s': 1.0})",
        "a time of the history is not",
    ),
    "column": ("pd.DataFrame({'t_s': [0.0], 'speed': [1.0]})", 'the history has no column "speed_m_s"'),
    "word": ("pd.DataFrame({'t_s': [0.0], 'speed_m_s': ['fast']})", 'column "speed_m_s" of the history is no numbers'),
    "text": ("{'t_s': [0.0], 'speed_m_s': ['1.0']}", 'column "speed_m_s" of the history is no numbers'),
    "truth": ("pd.DataFrame({'t_s': [0.0], 'speed_m_s': [True]})", 'column "speed_m_s" of the history is no numbers'),
    "shape": ("{'t_s': [[0.0]], 'speed_m_s': [[1.0]]}", 'column "t_s" of the history has the shape (1, 1)'),
    "dates": ("{'t_s': np.array([1], 'm8[s]'), 'speed_m_s': [1.0]}", 'column "t_s" of the history is no numbers'),
    "complex": ("{'t_s': [0.0], 'speed_m_s': np.ones(1) * 1j}", 'column "speed_m_s" of the history is no numbers'),
    "lengths": ("{'t_s': [0.0, 1.0], 'speed_m_s': [1.0]}", "columns of the history have 2 and 1 rows"),
    "number": ("3.0", "the history is a float; it must be a DataFrame"),
}


@pytest.mark.parametrize("options", ["", "batch=True,"], ids=["case", "batch"])
def test_a_history_that_cannot_be_read_is_no_result(tmp_path, options):
    one = "np.ones_like(inputs['mass_kg'])"
    tables = ", ".join(f"lambda: {table}" for table, _ in HISTORIES.values())
    history = f"[{tables}][int(np.ravel(case.id)[0])]()"
    fault = f"return {{'fall_time_s': {one}, 'impact_speed_m_s': {one}}}, {history}"
    file = python_campaign(tmp_path / "ball", cases=len(HISTORIES), fault=fault, options=options)
    rows = run(load_campaign(file), tmp_path / "run", workers=1).cases()
    assert set(rows["status"]) == {"no-result"}
    for said, (_, reason) in zip(rows["reason"], HISTORIES.values(), strict=True):
        assert reason in said


def test_the_reason_of_a_case_is_the_same_whichever_folder_its_worker_has(tmp_path):
    """Otherwise its replay, and another shard with the same case, would differ from what is stored."""
    fault = [
        "import os, sys",
        "if case.id == 0: open(case.folder / 'none.txt')",
        "if case.id == 1: print('no', case.folder / 'none.txt', file=sys.stderr, flush=True); os._exit(3)",
    ]
    campaign = load_campaign(python_campaign(tmp_path / "ball", cases=2, fault="\n".join(fault)))
    store = run(campaign, tmp_path / "run", workers=1)
    missing = "sim.py, line 12: FileNotFoundError: [Errno 2] No such file or directory: 'case-0000000/none.txt'"
    assert store.row(0)["reason"] == missing
    assert store.row(1)["reason"] == "ended with exit code 3: no case-0000001/none.txt"
    assert [replay(store.path, case).differences for case in (0, 1)] == [(), ()]


def test_a_reason_keeps_all_folders_but_that_of_the_worker_and_takes_no_time():
    begun = time.monotonic()
    assert program_flight.flown(1, 60_000 * "x").reason == 600 * "x"  # 36 s where each letter may begin a folder
    assert time.monotonic() - begun < 2.0
    work = f"{tempfile.gettempdir()}/mc-engine-abcd_123/case-7"
    said = program_flight.flown(1, f"'{work}/a.csv' is not /opt/mc-engine-releases/a.csv").reason
    assert said == "'case-7/a.csv' is not /opt/mc-engine-releases/a.csv"


@pytest.mark.parametrize(
    "numbers", ["[complex(x, 1) for x in time]", "[x > 0.0 for x in time]", "[np.complex64(x + 1j) for x in time]"]
)
def test_a_list_of_numpy_numbers_of_another_kind_is_no_array_of_numbers(tmp_path, numbers):
    file = python_campaign(tmp_path / "kind", cases=4, options="batch=True,")
    source = file.parent / "sim.py"
    text = source.read_text()
    assert '"fall_time_s": time,' in text
    source.write_text(text.replace('"fall_time_s": time,', f'"fall_time_s": {numbers},'))
    table = run(load_campaign(file), tmp_path / "run", workers=1).cases()
    assert set(table["reason"]) == {'"fall_time_s" is no array of numbers'}


@pytest.mark.parametrize("options", ["", "batch=True,"], ids=["case", "batch"])
def test_a_whole_number_that_no_float_holds_is_infinite(tmp_path, options):
    huge = "{'fall_time_s': HUGE, 'impact_speed_m_s': HUGE}".replace("HUGE", "[10**5000]" if options else "10**5000")
    file = python_campaign(tmp_path / "huge", cases=1, fault=f"return {huge}", options=options)
    row = run(load_campaign(file), tmp_path / "run", workers=1).row(0)
    assert (row["status"], row["reason"]) == ("not-finite", '"fall_time_s" is infinite')


def test_memory_that_is_filled_with_small_objects_ends_the_case_as_memory_limit(tmp_path):
    fault = "texts, k = {}, 0\nwhile True:\n    texts[k] = str(k) * 10  # until not even a reply has room\n    k += 1"
    file = python_campaign(tmp_path / "ball", cases=1, fault=fault, options="memory_limit_mib=300,")
    row = run(load_campaign(file), tmp_path / "run", workers=1).row(0)
    assert (row["status"], row["reason"]) == ("memory-limit", "needed more memory than the simulator may have")


def test_a_truth_value_is_not_the_input_one():
    said = program_flight._input_difference({"used": {"gain": True}}, "used", {"gain": 1.0})
    assert said == "the program used gain = True, where the case has 1.0"
    assert program_flight._input_difference({"used": {"on": True, "gain": 1}}, "used", {"on": True, "gain": 1.0}) == ""


IN_A_BATCH = {
    "short": ("time[: max(1, len(time) - 1)]", 'each of its cases alone does not: "fall_time_s" has the shape (3,)'),
    "sorted": ("np.sort(time)", "not independent: fall_time_s differ between a batch of 4"),
    "shared": ("time - time.mean()", "not independent: fall_time_s differ between a batch of 4"),
    "own": ("time", ""),
}


@pytest.mark.parametrize(("numbers", "said"), IN_A_BATCH.values(), ids=IN_A_BATCH)
def test_check_says_where_a_batch_has_other_results_than_its_cases_alone(tmp_path, numbers, said):
    file = python_campaign(tmp_path / "batch", cases=40, options="batch=True,")
    source = file.parent / "sim.py"
    source.write_text(source.read_text().replace('"fall_time_s": time,', f'"fall_time_s": {numbers},'))
    faults, _ = flyer_of(load_campaign(file)).second_look(copies_of)
    assert said in "\n".join(faults)
    assert len(faults) == bool(said)


OF_A_PROCESS = {
    "first case": ("FIRST = {}", "inputs['mass_kg'] = FIRST.setdefault('mass', inputs['mass_kg'])"),
    "drawn once": ("import numpy\nMASS = numpy.random.default_rng().uniform(9.0, 10.0)", "inputs['mass_kg'] = MASS"),
}


@pytest.mark.parametrize(("imports", "fault"), OF_A_PROCESS.values(), ids=OF_A_PROCESS)
def test_check_says_where_results_depend_on_the_process_of_a_case(tmp_path, imports, fault):
    file = python_campaign(tmp_path / "ball", cases=4, fault=fault, imports=imports, options="slots=1,")
    told = CliRunner().invoke(app, ["check", str(file)])
    assert told.exit_code == 2
    assert "1 problem\n  not deterministic: fall_time_s, impact_speed_m_s differ between two flights" in told.output


def test_check_accepts_differences_within_the_declared_tolerance(tmp_path):
    imports, fault = OF_A_PROCESS["drawn once"]
    for tolerance, expected in ((0.5, 0), (1e-9, 2)):
        options = f"slots=1, deterministic=False, tolerance={tolerance},"
        file = python_campaign(tmp_path / str(tolerance), cases=4, fault=fault, imports=imports, options=options)
        told = CliRunner().invoke(app, ["check", str(file)])
        assert told.exit_code == expected
        words = "by more than the tolerance of 1e-09" if expected else "not deterministic, as declared: fall_time_s"
        assert words in told.output


@pytest.mark.parametrize("options", ["", "batch=True,"], ids=["case", "batch"])
def test_a_copy_of_the_process_that_a_case_begins_gives_no_results(tmp_path, options):
    fork = """
import os, time
if os.fork() == 0: inputs = {**inputs, 'mass_kg': 2.0 * inputs['mass_kg']}
else: time.sleep(0.1)  # in which the copy would reply
"""
    tables = []
    for name, fault in (("plain", ""), ("copies", fork)):
        file = python_campaign(tmp_path / name, cases=8, fault=fault, options=options)
        tables.append(run(load_campaign(file), tmp_path / f"{name}_run", workers=1).cases())
    assert tables[1].equals(tables[0])


LICENCE = """
from pathlib import Path

def licence():
    left = int(Path({0!r}).read_text())
    Path({0!r}).write_text(str(left - 1))
    if left <= 0:
        raise OSError("no licence is left")
"""


@pytest.mark.parametrize("backend", ["threading", "loky"])
def test_a_start_that_fails_once_cases_have_completed_interrupts_a_run_that_is_resumed(tmp_path, backend):
    licences = tmp_path / "licences"
    ends = "import os\nif case.id in (3, 5):\n    os.kill(os.getpid(), 9)"
    imports = LICENCE.format(str(licences))
    file = python_campaign(tmp_path / "ball", cases=8, fault=ends, imports=imports, options="start=licence,")
    campaign, path = load_campaign(file), tmp_path / "run"
    said = r"OSError: no licence is left; what was committed is safe, `mc-engine resume \S+run( --backend loky)?` flies"
    licences.write_text("2")
    with pytest.raises(RunInterrupted, match=said):
        run(campaign, path, workers=1, backend=backend)
    licences.write_text("0")
    with pytest.raises(RunInterrupted, match=said):
        resume(path, workers=1)
    licences.write_text("9")
    whole = run(campaign, tmp_path / "whole", workers=1).cases()
    licences.write_text("9")
    assert resume(path, workers=1).cases().equals(whole)
