"""`mc-engine debug`: a flight by Python that stops where it is told to, with the debugger's commands piped in."""

import re
import subprocess
import sys
from pathlib import Path

import mc_engine
from tests.mc_engine.flight.falling_ball import python_campaign
from tests.mc_engine.model.mistaken_campaign import line_of, write_campaign
from tests.mc_engine.store.small_run import ENVIRONMENT

PAGE = Path(mc_engine.__file__).parent / "documentation" / "how_to" / "looking_inside.md"
BELOW = "    g = -MU_EARTH"


def debug(*words, typed="", **variables):
    """(exit status, what was printed, what was complained of), folders left out of the debugger's places."""
    command = [sys.executable, "-m", "mc_engine", "debug", *map(str, words)]
    done = subprocess.run(command, input=typed, capture_output=True, text=True, env=ENVIRONMENT | variables)
    return done.returncode, re.sub(r"(?m)^(.*> )/\S*/(\w+\.py)", r"\1\2", done.stdout), done.stderr


def test_the_page_shows_what_the_debugger_shows_in_the_lines_of_the_model():
    ((asked, *shown),) = [
        text.splitlines() for text in re.findall(r"(?ms)^```console\n(.*?)^```", PAGE.read_text(encoding="utf-8"))
    ]
    typed, words = re.fullmatch(r"\$ printf '(.*)' \| mc-engine debug (.*)", asked).groups()
    status, printed, _ = debug(*words.split(), typed=typed.replace(r"\n", "\n"))
    assert status == 0
    assert [line.rstrip() for line in printed.splitlines()] == shown


def test_it_stops_at_the_first_line_of_rhs_or_at_an_event_and_flies_on_to_the_end():
    status, printed, _ = debug("minimal", typed="p s.x - 6678136.6, s.y\nc\n")
    assert status == 0
    assert printed.startswith(
        "stopped in `rhs` at t = 0 s\n> model.py(28)rhs()\n-> r2 = s.x * s.x + s.y * s.y\n(Pdb) ("
    )
    end = re.search(r"the nominal case: ok at t = ([\d.]+) s, apogee_altitude_km = 657\.307", printed)
    status, printed, _ = debug("minimal", "--at-event", "apogee", typed="p s.x * s.vx + s.y * s.vy\nq\n")
    assert status == 0
    assert f"stopped in `observe` at t = {end[1]}" in printed
    assert abs(float(re.search(r"\(Pdb\) (\S+)\n", printed)[1])) < 1e-3  # of 4e13 m^2/s a degree from there
    assert "the nominal case" not in printed  # left before its end
    status, _, complaint = debug("minimal", "--at-time", "1e5")
    assert (status, complaint) == (0, "not stopped: it did not come to t = 100000 s\n")
    status, _, complaint = debug("minimal", "--at-event", "apoge")
    assert (status, 'did you mean "apogee"?' in complaint) == (2, True)


def test_it_stops_at_the_line_that_loses_a_number(tmp_path):
    lost = "    low = sqrt(s.x + 7.0e6)"
    write_campaign(tmp_path / "lost", (BELOW, f"{lost}\n{BELOW}"), ("vy=g * s.y)", "vy=g * s.y + 0.0 * low)"))
    status, printed, _ = debug(tmp_path / "lost", "--at-nan", typed="p s.x + 7.0e6 < 0.0\nn\np low\nc\n")
    assert status == 0
    assert f"> model.py({line_of(tmp_path / 'lost', lost)})rhs()\n-> {lost.strip()}\n(Pdb) True\n" in printed
    assert "(Pdb) nan\n" in printed
    assert "the nominal case: not-finite at t = " in printed


def test_an_error_of_the_physics_is_named_with_its_line(tmp_path):
    wrong = "    low = math.sqrt(s.x - 7.0e6)"
    edits = ("from mc_engine.lanes", "import math\n\nfrom mc_engine.lanes"), (BELOW, f"{wrong}\n{BELOW}")
    folder = write_campaign(tmp_path / "wrong", *edits)
    status, _, complaint = debug(folder, "--at-nan")
    assert status == 2
    assert f"model.py, line {line_of(folder, wrong)}: ValueError: math domain error" in complaint


def test_print_and_breakpoint_of_the_physics_run_there_and_are_refused_elsewhere(tmp_path):
    (tmp_path / "hooked.py").write_text(
        "import sys\n\ndef stop():\n    here = sys._getframe(1)\n"
        "    print('in', here.f_code.co_name, sorted(here.f_locals))\n"
    )
    told = f'    if s.x < -7.035443e6:\n        print("far", s.x)\n        breakpoint()\n{BELOW}'
    folder = write_campaign(tmp_path / "told", (BELOW, told))
    path = f"{tmp_path}:{ENVIRONMENT['PYTHONPATH']}"
    status, printed, _ = debug(folder, PYTHONBREAKPOINT="hooked.stop", PYTHONPATH=path)
    assert status == 0
    lines = printed.splitlines()
    assert re.fullmatch(r"far -70355\d\d\.\d+", lines[0])
    assert lines[1] == "in rhs ['r2', 's']"
    command = [sys.executable, "-m", "mc_engine", "check", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, env=ENVIRONMENT)
    assert done.returncode == 2
    for word in ('print("far", s.x)`: `print`', "breakpoint()`: `breakpoint`"):
        assert f"{word} would run in every step of every case; `mc-engine debug` flies one case that runs it" in (
            done.stdout + done.stderr
        )


def test_a_simulator_and_two_stops_at_once_are_answered_with_a_sentence(tmp_path):
    status, _, complaint = debug(python_campaign(tmp_path / "ball"))
    assert status == 2
    assert "flies a simulator, which has no physics to stop in; debug its own program" in complaint
    assert debug("minimal", "--at-nan", "--at-time", "3")[0] == 2


def test_it_stops_in_observe_where_an_event_ends_a_case_that_also_notes_it(tmp_path):
    noted = ('at_end("altitude_km", "altitude of the apogee")', 'value_at("apogee", "altitude_km", "altitude there")')
    folder = write_campaign(tmp_path / "noted", noted, ("import Event,", "import value_at, Event,"))
    _status, printed, complaint = debug(folder, "--at-event", "apogee", typed="q\n")
    assert "did not happen" not in printed + complaint
    assert "stopped in `observe` at t = " in printed
    assert re.search(r"> model\.py\(\d+\)observe\(\)", printed)


SAMPLED = (
    ("clock=FixedStep(step=10.0, until=10_000.0)", "clock=AdaptiveStep(until=10_000.0, control_period=1000.0)"),
    ("import Event, FixedStep", "import AdaptiveStep, Event"),
    ("from mc_engine.lanes", "from collections import namedtuple\n\nfrom mc_engine.lanes"),
    ("@physics\ndef observe", """Memory = namedtuple("Memory", "samples", defaults=(0.0,))


@physics
def control(t, m):
    print("sample", float(t))
    return Memory(samples=m.samples + 1.0)


@physics
def across(s): return s.x


@physics
def switch(s, m): print("acts"); return s, m


@physics
def observe"""),
    ("events={", 'memory=Memory, control=control, switch=switch, '
     'events={"quarter": Event(across, "falling", "switch", after=50.0), '),
)  # fmt: skip


def test_what_physics_prints_is_of_calls_that_have_an_effect(tmp_path):
    folder = write_campaign(tmp_path / "sampled", *SAMPLED)
    status, printed, _ = debug(folder)
    assert status == 0
    assert printed.splitlines()[:-1] == ["sample 0.0", "sample 1000.0", "acts", "sample 2000.0"]


def test_it_stops_where_a_delayed_event_crosses_and_in_a_function_of_one_line(tmp_path):
    folder = write_campaign(tmp_path / "sampled", *SAMPLED)
    _, printed, _ = debug(folder, "--at-event", "quarter", typed="p abs(s.x) < 1.0\nq\n")
    assert re.search(r"stopped in `rhs` at t = 1\d+\.\d+ s\n> model\.py\(\d+\)rhs\(\)\n.*\n\(Pdb\) True", printed)
    _, printed, _ = debug(folder, "--at-event", "quarter_due", typed="p s.x < -1e5\nq\n")
    assert re.search(r"> model\.py\(\d+\)switch\(\)\n-> def switch\(s, m\): .*\n\(Pdb\) True", printed)
