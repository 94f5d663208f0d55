"""Cases of simulators that crash, hang, leak or give nothing: each costs itself, and nothing is left running."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

from mc_engine import load_campaign, resume, run
from tests.mc_engine.flight.falling_ball import program_campaign, python_campaign

AT = (3, 11, 17, 40)  # cases
PYTHON_FAULTS = {
    "segfault": ("import ctypes\n    ctypes.string_at(0)", "crashed", "ended by SIGSEGV at "),
    "kill": ("import os\n    os.kill(os.getpid(), 9)", "crashed", "ended by SIGKILL"),
    "endless": ("while True: pass", "time-limit", "took longer than 1 s"),
    "memory": ("x = bytearray(10 * 2**30)", "memory-limit", "needed more memory"),
    "exit": ("import sys\n    sys.exit(3)", "crashed", "ends its process by SystemExit(3)"),
    "hard exit": ("import os\n    os._exit(3)", "crashed", "ended with exit code 3"),
    "nothing": ("return None", "no-result", "returned NoneType"),
    "NaN": ("return {'fall_time_s': np.nan, 'impact_speed_m_s': 1.0}", "not-finite", "is not a number"),
    "wrong key": ("return {'time': 1.0, 'impact_speed_m_s': 1.0}", "no-result", '"fall_time_s" is missing'),
    "refused": ("raise Refuse('too heavy')", "refused", "too heavy"),
    "loud": ("print('x' * 5_000_000)\n    raise ValueError('loud')", "crashed", "ValueError: loud"),
}
C_FAULTS = {
    "abort": ("abort();", "crashed", "ended by SIGABRT"),
    "kill": ("kill(getpid(), SIGKILL);", "crashed", "ended by SIGKILL"),
    "endless": ("for (;;) ;", "time-limit", "took longer than 2 s"),
    "memory": ("for (;;) { char *p = malloc(1 << 20); memset(p, 1, 1 << 20); }", "memory-limit", "more than 300 MiB"),
    "exit": ('fprintf(stderr, "licence lost\\n"); return 3;', "crashed", "ended with exit code 3: licence lost"),
    "nothing": ("return 0;", "no-result", "wrote no result.json"),
    "half": ('file = fopen(argv[2], "w"); fprintf(file, "{\\"time\\": 1."); return 0;', "no-result", "cannot be read"),
    "previous": ("mass = 10.0;", "no-result", "the program used mass_kg = 10"),
}


def at(cases, fault):
    return f"if case.id in {cases}:\n    {fault}"


def in_c(cases, fault):
    return f"if ({' || '.join(f'id == {case}' for case in cases)}) {{ {fault} }}"


def refuse_others(table, status, reason):
    failed = table[table["status"] != "ok"]
    assert tuple(failed["case_id"]) == AT
    assert set(failed["status"]) == {status}
    assert all(reason in one for one in failed["reason"])


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sound")
    return run(load_campaign(python_campaign(folder / "ball", cases=50)), folder / "run", workers=2).cases()


@pytest.mark.parametrize("name", PYTHON_FAULTS)
def test_a_fault_of_a_function_costs_its_case(tmp_path, sound, name):
    fault, status, reason = PYTHON_FAULTS[name]
    limits = "time_limit_s=1.0, memory_limit_mib=2000.0,"
    file = python_campaign(tmp_path / "ball", cases=50, fault=at(AT, fault), options=limits)
    table = run(load_campaign(file), tmp_path / "run", workers=2).cases()
    refuse_others(table, status, reason)
    well = table["status"] == "ok"
    assert table[well].equals(sound[well.to_numpy()])
    assert len(list((tmp_path / "run/simulator").iterdir())) == len(AT)


@pytest.mark.parametrize("name", C_FAULTS)
def test_a_fault_of_a_program_costs_its_case(tmp_path, name):
    fault, status, reason = C_FAULTS[name]
    file = program_campaign(tmp_path / "ball", cases=50, fault=in_c(AT, fault))
    refuse_others(run(load_campaign(file), tmp_path / "run", workers=2).cases(), status, reason)


def test_the_echo_finds_an_input_that_is_rounded(tmp_path):
    file = program_campaign(tmp_path / "ball", cases=4, mass="(double)(float)mass")
    table = run(load_campaign(file), tmp_path / "run", workers=1).cases()
    assert set(table["status"]) == {"no-result"}
    assert table["reason"].str.contains("the program used mass_kg = ").all()


def test_a_case_of_a_batch_that_crashes_is_found(tmp_path, sound):
    fault = f"if np.isin(case.id, {AT}).any():\n    import os\n    os.kill(os.getpid(), 9)"
    file = python_campaign(tmp_path / "ball", cases=50, fault=fault, options="batch=True,")
    table = run(load_campaign(file), tmp_path / "run", workers=1).cases()
    refuse_others(table, "crashed", "ended by SIGKILL")


def running(word):
    found = []
    for folder in Path("/proc").iterdir():
        try:
            if folder.name.isdecimal() and word in (folder / "cmdline").read_bytes().decode():
                found.append(int(folder.name))
        except OSError:
            continue
    return found


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_children_left_behind_are_ended(tmp_path):
    start = "import subprocess\n    subprocess.Popen(['sleep', '4321'], start_new_session=True)"
    run(load_campaign(python_campaign(tmp_path / "a", cases=50, fault=at(AT, start))), tmp_path / "run-a", workers=2)
    fork = 'if (!fork()) { setsid(); if (!fork()) execlp("sleep", "sleep", "4321", NULL); _exit(0); } usleep(50000);'
    run(load_campaign(program_campaign(tmp_path / "b", cases=50, fault=in_c(AT, fork))), tmp_path / "run-b", workers=2)
    assert running("4321") == []


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
@pytest.mark.parametrize("after", [3, 30, 90])  # cases
def test_a_killed_engine_resumes_without_flying_a_finished_case_twice(tmp_path, after):
    starts = tmp_path / "starts"
    fault = f"import time\ntime.sleep(0.03)\nwith open({str(starts)!r}, 'a') as file: print(case.id, file=file)"
    file = python_campaign(tmp_path / "ball", cases=120, fault=fault)
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
    time.sleep(1.0)
    assert running(f"\0{engine.pid}\0") == []  # the last argument of the processes that it started
    table = resume(tmp_path / "run", workers=2).cases()
    flown = Counter(starts.read_text().split())
    # in flight at the kill: a case or its last lines a worker; the nominal and the first two for their histories
    twice = [case for case, times in flown.items() if times > 1 and case not in ("-1", "0", "1")]
    assert len(twice) <= 2
    whole = run(load_campaign(file), tmp_path / "whole", workers=1)
    assert table.equals(whole.cases())
