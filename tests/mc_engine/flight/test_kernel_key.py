"""The name of a compiled kernel: it changes with every compiled number, and with nothing else."""

import shutil
import subprocess
import sys
import time

import pytest
from test_kernel import fall, speed

import mc_engine
from mc_engine.campaign.search import SHIPPED
from mc_engine.flight import kernel
from mc_engine.flight.kernel_parts import parts_of
from mc_engine.lanes import kernel_cache
from mc_engine.lanes.kernel_key import Recorder, kernel_key
from mc_engine.model import load_model
from tests.mc_engine.store.small_run import ENVIRONMENT


def edited(*edits, text=None):
    """The falling stone's source with these replacements, each of which must find its place."""
    text = text or fall("2.0")
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    return text


def named(folder, files):
    """(key, whether all was known) of the model `model.py` among these files in a new folder."""
    folder.mkdir()
    for name, text in files.items():
        (folder / name).write_text(text)
    model = load_model("model.py", folder)
    return kernel_key(parts_of(model, False, Recorder()), "a template")


HELPER = "from mc_engine.lanes import physics\n\nGAIN = 2.0\n\n\n@physics\ndef gain(x):\n    return GAIN * x\n"
ARRAY = "from mc_engine.lanes import physics\nimport numpy as np\n\nTABLE = np.array([1.0, 2.0])"
EVENT = ("@physics\ndef observe", "@physics\ndef fast(s):\n    return s.v - 3.0\n\n\n@physics\ndef observe")
WATCHED = (
    "initial=initial,",
    "initial=initial, events={'ground': Event(fast)}, extrema={'top': maximum_of('v_m_s', '')},",
)
EXTREMES = "import AdaptiveStep, Event, FixedStep, last_above, maximum_of, minimum_of"
EVENTFUL = edited(EVENT, WATCHED, ("import FixedStep", EXTREMES))
IMPORTED = {"model.py": edited(("2.0 * p.gravity", "gain(p.gravity)"), ("State =", "from helper import gain\nState =")),
            "helper.py": HELPER}  # fmt: skip
READ = edited(("2.0 * p.gravity", "helper.GAIN * p.gravity"), ("State =", "import helper\nState ="))
MADE = edited(
    ("2.0 * p.gravity", "double(p.gravity)"),
    ("State =", "def made(k):\n    @physics\n    def times(x):\n        return k * x\n    return times\n\n\n"
                "double = made(2.0)\nState ="),
)  # fmt: skip
NESTED = edited(("2.0 * p.gravity", "twice(p.gravity)"), ("    return State(v=twice", "    def twice(x):\n        "
                "return 2.0 * x\n    return State(v=twice"))  # fmt: skip
CALLED = edited(("2.0 * p.gravity", "times(p.gravity)"), ("State =", "@physics\ndef times(x, k=2.0):\n    return k * x"
                "\n\n\nState ="))  # fmt: skip
CLASS = edited(("2.0 * p.gravity", "Gain.two * p.gravity"), ("State =", "class Gain:\n    two = 2.0\n\n\nState ="))
SPACE = edited(("2.0 * p.gravity", "GAIN.two * p.gravity"), ("State =", "from types import SimpleNamespace\nGAIN = "
               "SimpleNamespace(two=2.0)\nState ="))  # fmt: skip
PASSED = edited(("2.0 * p.gravity", "gain_in(helper) * p.gravity"), ("State =", "import helper\n\n\n@physics\ndef "
                "gain_in(space):\n    return space.GAIN\n\n\nState ="))  # fmt: skip
PAIR = edited(("2.0 * p.gravity", "Pair(2.0, p.gravity).a * p.gravity"), ("State =", "from collections import "
              'namedtuple\nPair = namedtuple("Pair", "a b")\nState ='))  # fmt: skip
LISTED = edited(("2.0 * p.gravity", "TABLE[1] * p.gravity"), ("from mc_engine.lanes import physics", ARRAY))
LIBRARY = edited(("2.0 * p.gravity", "gain(p.gravity)"), ("State =", "from fall_library import gain\nState ="))


@pytest.mark.parametrize(
    ("files", "name", "old", "new"),
    [
        ({"model.py": fall("2.0")}, "model.py", "2.0 *", "3.0 *"),
        ({"model.py": fall("2.0")}, "model.py", "2.0 *", "2 *"),
        ({"model.py": fall("0.0")}, "model.py", "0.0 * p", "-0.0 * p"),
        ({"model.py": fall("2.0")}, "model.py", "State(v=0.0)", "State(v=1.0)"),
        (IMPORTED, "helper.py", "2.0", "3.0"),
        (IMPORTED, "helper.py", "GAIN * x", "GAIN + x"),
        ({"model.py": READ, "helper.py": HELPER}, "helper.py", "GAIN = 2.0", "GAIN = 3.0"),
        ({"model.py": PASSED, "helper.py": HELPER}, "helper.py", "GAIN = 2.0", "GAIN = 3.0"),
        ({"model.py": MADE}, "model.py", "made(2.0)", "made(3.0)"),
        ({"model.py": NESTED}, "model.py", "2.0 * x", "3.0 * x"),
        ({"model.py": CALLED}, "model.py", "k=2.0", "k=3.0"),
        ({"model.py": CLASS}, "model.py", "two = 2.0", "two = 3.0"),
        ({"model.py": SPACE}, "model.py", "two=2.0", "two=3.0"),
        ({"model.py": PAIR}, "model.py", '"a b"', '"b a"'),
        ({"model.py": LISTED}, "model.py", "1.0, 2.0", "1.0, 3.0"),
        ({"model.py": LISTED}, "model.py", "[1.0, 2.0])", "[1.0, 2.0]).view(np.int64)"),
        ({"model.py": LISTED}, "model.py", "np.array([1.0, 2.0])", "(1.0, 2.0)"),
        ({"model.py": LISTED.replace("np.array([1.0, 2.0])", "(1.0, 2.0)")}, "model.py", "1.0, 2.0", "1.0, 3.0"),
        ({"model.py": EVENTFUL}, "model.py", "Event(fast)", "Event(fast, 'rising')"),
        ({"model.py": EVENTFUL}, "model.py", "Event(fast)", "Event(fast, 'falling', 'switch')"),
        ({"model.py": EVENTFUL}, "model.py", "maximum_of('v_m_s', '')", "minimum_of('v_m_s', '')"),
        ({"model.py": EVENTFUL}, "model.py", "maximum_of('v_m_s', '')", "last_above('v_m_s', 5.0, '')"),
        ({"model.py": EVENTFUL}, "model.py", "maximum_of('v_m_s', '')", "maximum_of('v_m_s', '', smooth=False)"),
        ({"model.py": EVENTFUL}, "model.py", "FixedStep(0.5, 2.0)", "AdaptiveStep(2.0)"),
    ],
)  # fmt: skip
def test_every_change_of_a_compiled_number_is_another_kernel(tmp_path, files, name, old, new):
    before, known = named(tmp_path / "before", files)
    assert known
    assert old in files[name]
    text = files[name].replace(old, new)
    text = text.replace("initial=initial, ", "initial=initial, switch=fast, ") if "'switch'" in new else text
    assert named(tmp_path / "after", {**files, name: text})[0] != before


def test_a_function_of_the_same_text_and_other_globals_is_another_kernel(tmp_path):
    files = {**IMPORTED, "other.py": HELPER.replace("2.0", "3.0")}
    swapped = {**files, "model.py": files["model.py"].replace("from helper", "from other")}
    assert named(tmp_path / "one", files)[0] != named(tmp_path / "two", swapped)[0]


def test_a_library_of_physics_belongs_to_the_kernel(tmp_path, monkeypatch):
    (tmp_path / "site").mkdir()
    monkeypatch.syspath_prepend(tmp_path / "site")
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # it is told from a changed file by the second
    keys = []
    for text in (HELPER, HELPER.replace("2.0", "3.0")):
        (tmp_path / "site" / "fall_library.py").write_text(text)
        sys.modules.pop("fall_library", None)
        keys.append(named(tmp_path / f"model{len(keys)}", {"model.py": LIBRARY}))
    assert keys[0][0] != keys[1][0]
    assert keys[0][1]


@pytest.mark.parametrize(
    "edit",
    [
        ("@physics\ndef rhs", "# the derivative\n\n\n@physics\ndef rhs"),
        ("    return State(v=2.0", '    """Derivative of the speed."""\n    return State(v=2.0'),
        ("    return State(v=2.0 * p.gravity)", "    return State(  # m/s^2\n        v=2.0 * p.gravity\n    )"),
        ('9.0, "acceleration"', '8.0, "strength of the gravity", low=1.0'),
        ('title="Fall"', 'title="A stone"'),
        ("FixedStep(0.5, 2.0)", "FixedStep(0.25, 4.0)"),
        ("State = ", "UNUSED = 5.0\nState = "),
        ("MODEL = ", "def prepare(inputs, settings, refusals):\n    return vars(inputs)\n\n\nMODEL = "),
    ],
)
def test_what_is_not_compiled_changes_no_kernel(tmp_path, edit):
    before = named(tmp_path / "before", {"model.py": fall("2.0"), "beside.py": "A = 1\n"})
    assert named(tmp_path / "after", {"model.py": edited(edit), "beside.py": "A = 2\n"}) == before


CURVES = {
    "model.py": edited(
        ("2.0 * p.gravity", "thrust(t) + drag(t)"),
        ("State =", "from mc_engine.physics.curves import curve\nthrust = curve('a.csv', 'time_s', 'thrust_n')\n"
                    "drag = curve('b.csv', 'time_s', 'thrust_n')\nState ="),
    ),
    "a.csv": "time_s,thrust_n\n0,1\n1,2\n",
    "b.csv": "time_s,thrust_n\n0,3\n1,4\n",
}  # fmt: skip


def test_the_numbers_of_a_curve_are_no_part_of_the_kernel_and_its_kind_and_place_are(tmp_path):
    first = named(tmp_path / "first", CURVES)
    assert first == named(tmp_path / "numbers", {**CURVES, "a.csv": "time_s,thrust_n\n0,7\n0.3,5\n1,2\n"})
    others = [
        edited(("thrust(t) + drag(t)", "drag(t) + thrust(t)"), text=CURVES["model.py"]),
        edited(("thrust(t) + drag(t)", "thrust(t) + thrust(t)"), text=CURVES["model.py"]),
        edited(("'b.csv', 'time_s', 'thrust_n'", "'b.csv', 'time_s', 'thrust_n', outside='zero'"),
               text=CURVES["model.py"]),
    ]  # fmt: skip
    keys = [named(tmp_path / f"other{i}", {**CURVES, "model.py": text}) for i, text in enumerate(others)]
    assert all(complete for _, complete in [first, *keys])
    assert len({first, *keys}) == 4


def test_what_the_walk_does_not_know_is_reported_and_named_by_the_whole_source(tmp_path, monkeypatch):
    text = edited(("2.0 * p.gravity", "Gain.TWO.value * p.gravity"), ("State =", "from enum import Enum\n\n\nclass "
                  "Gain(Enum):\n    TWO = 2.0\n\n\nState ="))  # fmt: skip
    assert not named(tmp_path / "key", {"model.py": text})[1]
    monkeypatch.setenv("MC_ENGINE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(kernel, "Kernel", lambda path, compiled: path)
    paths = set()
    for version in (text, text.replace("TWO = 2.0", "TWO = 3.0")):
        (tmp_path / "model.py").write_text(version)
        paths.add(kernel.build_kernel(load_model("model.py", tmp_path), tmp_path, 1))
    kernel.build_kernel.cache_clear()
    assert len(paths) == 2


def test_a_name_taken_from_the_engine_does_not_hide_what_a_function_does(tmp_path):
    stolen = "import functools\nfrom mc_engine.lanes import sqrt\n\n\n@physics\n@functools.wraps(sqrt)\ndef gain(x):\n"
    files = [{"model.py": edited(("2.0 * p.gravity", "gain(p.gravity)"), ("State =", f"{stolen}    return {k} * x\n\n\n"
             "State ="))} for k in (2.0, 3.0)]  # fmt: skip
    assert named(tmp_path / "one", files[0])[0] != named(tmp_path / "two", files[1])[0]


@pytest.fixture
def compiled(tmp_path, monkeypatch):
    """The kernels that were compiled since, an item each, with an empty cache to begin with."""
    kept, save = [], kernel_cache.save

    def saved(path, content):
        if path.name.startswith("kernel"):  # the cache has other loops, too
            kept.append(path)
        save(path, content)

    monkeypatch.setattr(kernel_cache, "save", saved)
    monkeypatch.setenv("MC_ENGINE_CACHE", str(tmp_path / "cache"))
    return kept


def test_edits_of_words_and_copies_of_a_campaign_fly_without_another_compilation(tmp_path, compiled):
    here, there = tmp_path / "here", tmp_path / "there"
    shutil.copytree(SHIPPED / "minimal", here)
    text = (here / "campaign.toml").read_text()
    first = mc_engine.run(mc_engine.load_campaign(here / "campaign.toml"), tmp_path / "first")
    assert len(compiled) == 1
    model = (here / "model.py").read_text()
    (here / "model.py").write_text(edited(("largest speed", "greatest speed"), ("@physics", "# physics\n@physics"),
                                          text=model))  # fmt: skip
    (here / "campaign.toml").write_text(f"# edited\n{text}")
    mc_engine.run(mc_engine.load_campaign(here / "campaign.toml"), tmp_path / "second")
    shutil.copytree(here, there)
    third = mc_engine.run(mc_engine.load_campaign(there / "campaign.toml"), tmp_path / "third")
    assert first.cases().equals(third.cases())
    mc_engine.extend(tmp_path / "third", third.cases().shape[0] + 8)  # as `resume`: by the model that the run keeps
    mc_engine.replay(tmp_path / "first", 3)
    mc_engine.replay(tmp_path / "third", 3)
    assert len(compiled) == 1


_FLIGHT = """
import sys, time
from pathlib import Path

import numpy as np

from mc_engine.flight.flight import fly
from mc_engine.flight.kernel import build_kernel
from mc_engine.lanes import kernel_cache
from mc_engine.model import load_model

folder, role = Path(sys.argv[1]), sys.argv[2]
save = kernel_cache.save


def slowly(*given):
    (folder / "compiled").touch()
    while not (folder / "asking").exists():
        time.sleep(0.02)
    time.sleep(1.0)
    save(*given)


model = load_model("model.py", folder)
build_kernel(model, folder, 1)
if role == "first":
    kernel_cache.save = slowly
else:
    (folder / "asking").touch()
fly(model, {"gravity_m_s2": 9.0}, np.array([0]), 1, folder=folder, width=1)
print(build_kernel(model, folder, 1).compilations)
"""


def test_a_process_that_asks_for_a_kernel_under_compilation_waits_and_loads_it(tmp_path):
    (tmp_path / "model.py").write_text(fall(7.0))
    environment = {**ENVIRONMENT, "MC_ENGINE_CACHE": str(tmp_path / "cache")}

    def flight(role):
        command = [sys.executable, "-c", _FLIGHT, str(tmp_path), role]
        return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)

    first = flight("first")
    while not (tmp_path / "compiled").exists():
        assert first.poll() is None
        time.sleep(0.02)
    second = flight("second")
    assert [first.communicate(timeout=120)[0], second.communicate(timeout=120)[0]] == ["1\n", "0\n"]


def test_a_killed_holder_of_a_kernels_lock_blocks_nobody(tmp_path):
    script = ("import sys, time\nfrom pathlib import Path\nfrom mc_engine.lanes.kernel_cache import _locked\n"
              "with _locked(Path(sys.argv[1])):\n    print('held', flush=True)\n    time.sleep(100)")  # fmt: skip
    holder = subprocess.Popen([sys.executable, "-c", script, str(tmp_path / "lock")], stdout=subprocess.PIPE, text=True)
    assert holder.stdout.readline() == "held\n"
    descriptor = (tmp_path / "lock").open("ab")
    with pytest.raises(BlockingIOError):
        kernel_cache.fcntl.flock(descriptor, kernel_cache.fcntl.LOCK_EX | kernel_cache.fcntl.LOCK_NB)
    holder.kill()
    holder.communicate()
    with kernel_cache._locked(tmp_path / "lock"), pytest.raises(BlockingIOError):
        kernel_cache.fcntl.flock(descriptor, kernel_cache.fcntl.LOCK_EX | kernel_cache.fcntl.LOCK_NB)
    descriptor.close()


def test_a_file_system_without_locks_compiles_as_ever(tmp_path, monkeypatch):
    def refused(*_):
        raise OSError("no locks here")

    monkeypatch.setattr(kernel_cache.fcntl, "flock", refused)
    monkeypatch.setenv("MC_ENGINE_CACHE", str(tmp_path / "cache"))
    (tmp_path / "model.py").write_text(fall(8.0))
    assert speed(tmp_path, "model.py") == 144.0
