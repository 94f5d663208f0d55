"""Cases of simulators that crash, hang, leak or give nothing: each costs itself, and nothing is left running."""

import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from mc_engine import ModelError, load_campaign, resume, run
from tests.mc_engine.flight.falling_ball import noting_campaign, program_campaign, python_campaign

SAMPLE, WHOLE = (4, 50), (100, 250)  # cases with a fault, of so many: in the deep tests and in the slow ones
SAMPLE_KILLS, WHOLE_KILLS = (("function", 3),), 50  # of the engine, after so many cases
PYTHON_FAULTS = {
    "segfault": ("import ctypes\n    ctypes.string_at(0)", "crashed", "ended by SIGSEGV at "),
    "kill": ("import os\n    os.kill(os.getpid(), 9)", "crashed", "ended by SIGKILL"),
    "endless": ("while True: pass", "time-limit", "took longer than LIMIT s"),
    "memory": ("x = bytearray(10 * 2**30)", "memory-limit", "needed more memory"),
    "exit": ("import sys\n    sys.exit(3)", "crashed", "ends its process by SystemExit(3)"),
    "hard exit": ("import os\n    os._exit(3)", "crashed", "ended with exit code 3"),
    "nothing": ("return None", "no-result", "returned NoneType"),
    "NaN": ("return {'fall_time_s': np.nan, 'impact_speed_m_s': 1.0}", "not-finite", "is not a number"),
    "wrong key": ("return {'time': 1.0, 'impact_speed_m_s': 1.0}", "no-result", '"fall_time_s" is missing'),
    "text": ("return {'fall_time_s': '1.0', 'impact_speed_m_s': 1.0}", "no-result", "is '1.0', which is no number"),
    "truth": ("return {'fall_time_s': 1.0, 'impact_speed_m_s': True}", "no-result", "is True, which is no number"),
    "array of truth": (
        "return {'fall_time_s': 1.0, 'impact_speed_m_s': np.array(True)}",
        "no-result",
        "is array(True), which is no number",
    ),
    "complex": (
        "return {'fall_time_s': 1.0, 'impact_speed_m_s': np.sqrt(-1.0 + 0j)}",
        "no-result",
        "which is no number",
    ),
    "refused": ("raise Refuse('too heavy')", "refused", "too heavy"),
    "no text": (
        "raise type('Odd', (Exception,), {'__str__': lambda self: self.lost})",
        "crashed",
        "Odd: its text cannot be given, as its __str__ raises AttributeError",
    ),
    "closed": (
        "import os, threading\n    threading.Thread(target=__import__('time').sleep, args=(30.0,)).start()\n"
        "    os.closerange(3, 256)",
        "crashed",
        "closed the connection to the engine, and did not end",
    ),
    "loud": ("print('x' * 5_000_000)\n    raise ValueError('loud')", "crashed", "ValueError: loud"),
}
WRITE = 'file = fopen(argv[2], "w"); fprintf(file, '
USED = r'\"used\": {\"mass_kg\": %.17g, \"drag_area_m2\": %.17g, \"height_m\": %.17g}}", mass, area, height'
C_FAULTS = {
    "abort": ("abort();", "crashed", "ended by SIGABRT"),
    "kill": ("kill(getpid(), SIGKILL);", "crashed", "ended by SIGKILL"),
    "endless": ("for (;;) ;", "time-limit", "took longer than LIMIT s"),
    "memory": ("for (;;) { char *p = malloc(1 << 20); memset(p, 1, 1 << 20); }", "memory-limit", "more than 300 MiB"),
    "worker": ("kill(getppid(), SIGKILL); usleep(1000000);", "crashed", "ended by SIGKILL"),
    "loud": ('for (int i = 0; i < 100000; i++) puts("' + 50 * "x" + '"); return 3;', "crashed", "exit code 3"),
    "NaN": (f'{WRITE}"{{\\"time\\": NaN, \\"speed\\": 1, {USED}); return 0;', "not-finite", "is not a number"),
    "wrong key": (f'{WRITE}"{{\\"t\\": 1, \\"speed\\": 1, {USED}); return 0;', "no-result", 'has no "time"'),
    "no history": (
        f'{WRITE}"{{\\"time\\": 1, \\"speed\\": 1, {USED}); fclose(file); return 0;',
        "no-result",
        "wrote no history.csv",
    ),
    "two columns": (
        f'{WRITE}"{{\\"time\\": 1, \\"speed\\": 1, {USED}); fclose(file); file = fopen("history.csv", "w"); '
        'fputs("t,speed_m_s,speed_m_s\\n0,0,1\\n", file); return 0;',
        "no-result",
        'history.csv has two columns "speed_m_s"',
    ),
    "exit": ('fprintf(stderr, "licence lost\\n"); return 3;', "crashed", "ended with exit code 3: licence lost"),
    "nothing": ("return 0;", "no-result", "wrote no result.json"),
    "half": ('file = fopen(argv[2], "w"); fprintf(file, "{\\"time\\": 1."); return 0;', "no-result", "cannot be read"),
    "no folder": ('system("rm -rf \\"$PWD\\""); return 0;', "no-result", "wrote no result.json"),
    "previous": ("mass = 10.0;", "no-result", "the program used mass_kg = 10"),
}


METRICS = ["fall_time_s", "impact_speed_m_s"]


def at(cases, fault):
    return f"if case.id in {cases}:\n    {fault}"


def in_c(cases, fault):
    return f"if ({' || '.join(f'id == {case}' for case in cases)}) {{ {fault} }}"


def one_of_each(faults):
    """Fault -> its case, by chance, of SAMPLE."""
    return dict(zip(faults, np.random.default_rng(21).permutation(SAMPLE[1]).tolist(), strict=False))


def check_blame(table, faults, cases):
    """Every fault costs its own case, with its own status and reason, and no other one."""
    for name, case in cases.items():
        (row,) = table[table["case_id"] == case].to_dict("records")
        _, status, reason = faults[name]
        assert row["status"] == status, name
        assert reason.replace("LIMIT", f"{ONE_EXCEEDS:g}") in row["reason"], name
    assert set(table["case_id"][table["status"] != "ok"]) == set(cases.values())


def refuse_others(table, cases, status, reason):
    failed = table[table["status"] != "ok"]
    assert tuple(failed["case_id"]) == cases
    assert set(failed["status"]) == {status}
    assert all(reason in one for one in failed["reason"])


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """The table without faults."""
    folder = tmp_path_factory.mktemp("sound")
    return run(load_campaign(python_campaign(folder / "ball", cases=WHOLE[1])), folder / "run", workers=2).cases()


@pytest.fixture(params=[SAMPLE, pytest.param(WHOLE, marks=pytest.mark.slow)], ids=["sample", "whole"])
def faulty(request):
    """(the cases with a fault, drawn by chance; how many there are in all)."""
    failing, cases = request.param
    return tuple(sorted(np.random.default_rng(21).permutation(cases)[:failing].tolist())), cases


# Time limit [s] of a case: long enough for a loaded machine where one case exceeds it, or none; else many exceed it.
ONE_EXCEEDS, NONE_EXCEEDS, MANY_EXCEED = 6.0, 60.0, 2.0
LIMITS = "time_limit_s={}, memory_limit_mib=2000.0,"


def limit_of(fault):
    return MANY_EXCEED if fault == "endless" else NONE_EXCEEDS


def test_every_fault_of_a_function_costs_its_case(tmp_path, sound):
    cases = one_of_each(PYTHON_FAULTS)
    fault = "\n".join(at((case,), PYTHON_FAULTS[name][0]) for name, case in cases.items())
    file = python_campaign(tmp_path / "ball", cases=SAMPLE[1], fault=fault, options=LIMITS.format(ONE_EXCEEDS))
    table = run(load_campaign(file), tmp_path / "run", workers=2).cases()
    check_blame(table, PYTHON_FAULTS, cases)
    well = (table["status"] == "ok").to_numpy()
    assert table[well].equals(sound[: SAMPLE[1]][well])
    assert len(list((tmp_path / "run/simulator").iterdir())) == len(cases)


@pytest.mark.slow
@pytest.mark.parametrize("name", PYTHON_FAULTS)
def test_a_fault_of_many_calls_of_a_function_costs_their_cases(tmp_path, sound, faulty, name):
    (failing, cases), (fault, status, reason) = faulty, PYTHON_FAULTS[name]
    file = python_campaign(
        tmp_path / "ball", cases=cases, fault=at(failing, fault), options=LIMITS.format(limit_of(name))
    )
    table = run(load_campaign(file), tmp_path / "run", workers=2).cases()
    refuse_others(table, failing, status, reason.replace("LIMIT", f"{limit_of(name):g}"))
    well = (table["status"] == "ok").to_numpy()
    assert table[well].equals(sound[:cases][well])
    assert len(list((tmp_path / "run/simulator").iterdir())) == len(failing)


def test_every_fault_of_a_program_costs_its_case(tmp_path, sound):
    cases = one_of_each(C_FAULTS)
    fault = " ".join(in_c((case,), C_FAULTS[name][0]) for name, case in cases.items())
    file = program_campaign(tmp_path / "ball", cases=SAMPLE[1], fault=fault, limit_s=ONE_EXCEEDS)
    table = run(load_campaign(file), tmp_path / "run", workers=2).cases()
    check_blame(table, C_FAULTS, cases)
    well = (table["status"] == "ok").to_numpy()
    assert np.allclose(table[METRICS][well], sound[METRICS][: SAMPLE[1]][well], rtol=1e-12, atol=0.0)
    assert running(str(tmp_path / "ball")) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", C_FAULTS)
def test_a_fault_of_many_runs_of_a_program_costs_their_cases(tmp_path, sound, faulty, name):
    (failing, cases), (fault, status, reason) = faulty, C_FAULTS[name]
    file = program_campaign(tmp_path / "ball", cases, in_c(failing, fault), limit_s=limit_of(name))
    table = run(load_campaign(file), tmp_path / "run", workers=2).cases()
    refuse_others(table, failing, status, reason.replace("LIMIT", f"{limit_of(name):g}"))
    well = (table["status"] == "ok").to_numpy()
    assert np.allclose(table[METRICS][well], sound[METRICS][:cases][well], rtol=1e-12, atol=0.0)
    assert running(str(tmp_path / "ball")) == []


TEMPLATES = {
    "unsafe": ("{{ ''.__class__.__mro__ }}", "access to attribute '__class__' of 'str' object is unsafe"),
    "by zero": ("{{ 1.0 / (mass_kg - mass_kg) }}", "float division by zero"),
    "no member": ("{{ mass_kg.metres }}", "'float object' has no attribute 'metres'"),
    "another file": ("{% include '/etc/hostname' %}", "no loader"),
    "memory": ("{{ 'a' * (3 * 10**9) }}", "needs more than 2048 MiB"),
    "time": (2 * "{% for i in range(90000) %}" + "{{ '' }}" + 2 * "{% endfor %}", "takes longer than 10 s"),
}


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs limits of memory")
@pytest.mark.parametrize("name", [*[n for n in TEMPLATES if n != "time"], pytest.param("time", marks=pytest.mark.slow)])
def test_a_template_that_gives_no_text_costs_its_case_and_is_named(tmp_path, name):
    template, reason = TEMPLATES[name]
    file = program_campaign(tmp_path / "ball", cases=4)
    lines = f"{{% if case_id == 2 %}}{template}{{% endif %}}\n"
    deck = tmp_path / "ball/case.txt.j2"
    deck.write_text(deck.read_text() + lines)
    begin = time.thread_time()
    campaign = load_campaign(file)
    assert time.thread_time() - begin < 5.0  # nothing in a template is computed before its case is written
    table = run(campaign, tmp_path / "run", workers=2).cases()
    refuse_others(table, (2,), "crashed", reason)
    assert table["reason"][2].startswith("the template of case.txt")


def test_the_echo_finds_an_input_that_is_rounded(tmp_path):
    file = program_campaign(tmp_path / "ball", cases=4, mass="(double)(float)mass")
    table = run(load_campaign(file), tmp_path / "run", workers=1).cases()
    assert set(table["status"]) == {"no-result"}
    assert table["reason"].str.contains("the program used mass_kg = ").all()


def test_what_a_function_does_to_its_process_ends_with_its_case(tmp_path, monkeypatch, sound):
    monkeypatch.chdir(tmp_path)  # the run is named from the folder that the cases leave
    left = "import os, signal, sys, time\nprint('flies', time.sleep(0.2))\nassert os.path.exists('here')"
    gone = "os.chdir(case.folder); signal.setitimer(0, 0.1); print(end='lost'); os.close(1); sys.stderr.close()"
    fault = f"{left}\nif case.id % 2:\n    {gone}\n    inputs['height_m'] = -1.0\n    raise ValueError('odd')"
    Path("here").touch()
    table = run(load_campaign(python_campaign(Path("ball"), cases=4, fault=fault)), Path("run"), workers=1).cases()
    refuse_others(table, (1, 3), "crashed", "ValueError: odd")
    assert table[::2].equals(sound[:4:2])
    assert json.loads(Path("run/simulator/case-0000001/case.json").read_text())["height_m"] == table["height_m"][1]


def test_a_crash_of_start_is_told_with_its_place(tmp_path):
    file = python_campaign(
        tmp_path / "ball", cases=2, imports="import ctypes", options="start=lambda: ctypes.string_at(0),"
    )
    with pytest.raises(ModelError, match=r"^sim\.py: ended by SIGSEGV at __init__\.py, line \d+ in string_at$"):
        run(load_campaign(file), tmp_path / "run", workers=1)


@pytest.mark.parametrize(("kind", "cases"), [("fork", 20), ("spawn", 2), ("forkserver", 2)])
def test_a_function_may_use_a_pool_of_processes(tmp_path, kind, cases):
    fault = f"with many.get_context({kind!r}).Pool(1) as pool:\n    pool.map(twice, [1.0])"
    imports = "import multiprocessing as many\ndef twice(x):\n    return 2.0 * x"
    file = python_campaign(tmp_path / "ball", cases, fault, "time_limit_s=30.0,", imports)
    assert run(load_campaign(file), tmp_path / "run", workers=1).status_counts() == {"ok": cases}


def test_an_import_of_a_file_beside_that_comes_too_late_is_told_with_its_mend(tmp_path):
    file = python_campaign(tmp_path / "ball", cases=2, fault="import gains")
    (tmp_path / "ball/gains.py").write_text("GAIN = 1.0\n")
    table = run(load_campaign(file), tmp_path / "run", workers=1).cases()
    refuse_others(table, (0, 1), "crashed", "named 'gains'; it lies beside the file: import it at the top, not in a")


@pytest.mark.parametrize("given", ["np.full(4, '1.0')", "pd.Series(['1.0'] * 4)", "[True] * 4", "time > 0.0"])
def test_text_and_truth_values_of_a_batch_are_no_numbers(tmp_path, given):
    fault = f"time = np.ones(4)\nreturn {{'fall_time_s': {given}, 'impact_speed_m_s': time}}"
    file = python_campaign(tmp_path / "ball", cases=4, fault=fault, options="batch=True,")
    table = run(load_campaign(file), tmp_path / "run", workers=1).cases()
    refuse_others(table, (0, 1, 2, 3), "no-result", '"fall_time_s" is no array of numbers')


def test_a_masked_element_of_a_batch_is_not_a_number(tmp_path):
    time = "np.ma.masked_array(np.ones(case.id.size), case.id == 2)"
    fault = f"if case.id.min() >= 0:\n    return {{'fall_time_s': {time}, 'impact_speed_m_s': {time}}}"
    file = python_campaign(tmp_path / "ball", cases=4, fault=fault, options="batch=True,")
    table = run(load_campaign(file), tmp_path / "run", workers=1).cases()
    refuse_others(table, (2,), "not-finite", '"fall_time_s" is not a number')


def test_a_case_of_a_batch_that_crashes_is_found(tmp_path, sound):
    fault = "if np.isin(case.id, (1, 6)).any():\n    import os\n    os.kill(os.getpid(), 9)"
    file = python_campaign(tmp_path / "ball", cases=8, fault=fault, options="batch=True,")
    table = run(load_campaign(file), tmp_path / "run", workers=1).cases()
    refuse_others(table, (1, 6), "crashed", "ended by SIGKILL")


def running(word):
    found = []
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdecimal() and word in (folder / "cmdline").read_bytes().decode():
                found.append(int(folder.name))
        except OSError:
            continue
    return found


def doing(pid):
    """What the threads of a process wait for, to be read where a test fails."""
    folder = Path(f"/proc/{pid}")
    try:
        return [(task / "stat").read_text().split()[2] + (task / "wchan").read_text() for task in folder.glob("task/*")]
    except OSError:
        return ["has ended"]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_children_left_behind_are_ended(tmp_path, faulty):
    failing, cases = faulty
    start = "import subprocess\n    subprocess.Popen(['sleep', '4321'], start_new_session=True)"
    run(
        load_campaign(python_campaign(tmp_path / "a", cases=cases, fault=at(failing, start))),
        tmp_path / "run-a",
        workers=2,
    )
    fork = 'if (!fork()) { setsid(); if (!fork()) execlp("sleep", "sleep", "4321", NULL); _exit(0); } usleep(50000);'
    run(
        load_campaign(program_campaign(tmp_path / "b", cases=cases, fault=in_c(failing, fork))),
        tmp_path / "run-b",
        workers=2,
    )
    assert running("4321") == []


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere it has no guard")
def test_a_process_that_begins_after_its_engine_has_died_removes_its_folder(tmp_path):
    (tmp_path / "work").mkdir()
    connection, other = os.pipe()
    words = ["mc_engine.flight.case_worker", str(connection), str(tmp_path / "work"), "0"]  # no process has number 0
    begun = subprocess.Popen([sys.executable, "-m", "mc_engine.process_tree", *words], pass_fds=(connection,))
    os.close(connection)
    assert begun.wait(60) == 1
    assert not (tmp_path / "work").exists()
    os.close(other)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere a function ends its own programs")
def test_a_killed_engine_leaves_neither_the_programs_of_a_function_nor_its_folder(tmp_path, monkeypatch):
    fault = "import ctypes, subprocess\nsubprocess.Popen(['sleep', '4323'], start_new_session=True)\n"
    file = python_campaign(tmp_path / "ball", cases=2, fault=f"{fault}ctypes.PyDLL(None).sleep(4323)")  # no thread runs
    (tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    command = [sys.executable, "-m", "mc_engine", "run", file, "--out", tmp_path / "run", "--workers", "1"]
    engine, end = subprocess.Popen(command), time.monotonic() + 60.0
    while time.monotonic() < end and not running("sleep\0004323"):
        time.sleep(0.05)
    assert running("sleep\0004323")
    engine.kill()
    engine.wait()
    while time.monotonic() < end and (running("sleep\0004323") or os.listdir(tmp_path / "temporary")):
        time.sleep(0.05)
    assert running("sleep\0004323") == []
    assert os.listdir(tmp_path / "temporary") == []


def more_kills():
    """Of a whole test, at random instants."""
    rng = np.random.default_rng(22)
    for kill in range(WHOLE_KILLS):
        kind, after = ("function", "program")[kill % 2], int(rng.integers(1, 118))
        yield pytest.param(kind, after, marks=pytest.mark.slow, id=f"{kind}-{after}-{kill}")


def parts(folder):
    """The bytes of the parts of a run, in order."""
    return [path.read_bytes() for path in sorted((folder / "cases").glob("*.parquet"))]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
@pytest.mark.parametrize(("kind", "after"), [*SAMPLE_KILLS, *more_kills()])
def test_a_killed_engine_resumes_without_flying_a_finished_case_twice(tmp_path, kind, after):
    starts = tmp_path / "starts"
    file = noting_campaign(kind, tmp_path / "ball", 120, 0.03, starts)
    command = [
        sys.executable,
        "-m",
        "mc_engine",
        "run",
        file,
        "--out",
        tmp_path / "run",
        "--no-report",
        "--workers",
        "2",
    ]
    engine = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end = time.monotonic() + 60.0
    while time.monotonic() < end and not (starts.exists() and starts.read_text().count("\n") > after):
        time.sleep(0.01)
    os.kill(engine.pid, signal.SIGKILL)
    engine.wait()
    end = time.monotonic() + 120.0  # a process that is still starting learns of it when it has started
    while time.monotonic() < end and running(f"\0{engine.pid}\0"):  # the last argument of the processes it started
        time.sleep(0.1)
    assert [(pid, doing(pid)) for pid in running(f"\0{engine.pid}\0")] == []
    resume(tmp_path / "run", workers=2)
    flown = Counter(starts.read_text().split())
    # in flight at the kill: a case or its last lines a worker; the nominal and the first two for their histories
    twice = [case for case, times in flown.items() if times > 1 and case not in ("-1", "0", "1")]
    assert len(twice) <= 2
    run(load_campaign(file), tmp_path / "whole", workers=2)
    assert parts(tmp_path / "run") == parts(tmp_path / "whole")
