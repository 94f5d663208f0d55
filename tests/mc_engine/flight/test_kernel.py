"""Compiled kernels and their cache: one per model, width and state of the sources, and quick the second time."""

import errno
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import mc_engine
from mc_engine.campaign.search import SHIPPED
from mc_engine.errors import UsageError
from mc_engine.flight import kernel
from mc_engine.flight.flight import fly
from mc_engine.flight.kernel import clock_number, finer, grid_of
from mc_engine.lanes import kernel_cache
from mc_engine.model import AdaptiveStep, FixedStep, load_model
from tests.faults.falling import MODEL as FALL
from tests.mc_engine.store.small_run import ENVIRONMENT


def fall(factor):
    """Source of a model whose speed after 2 s is 2 * factor * gravity."""
    return FALL.replace("FACTOR = 1.0\n", "").replace("FACTOR", str(factor))


def speed(folder, name, gravity=9.0, width=1):
    """Speed [m/s] flown by the model in `folder / name`."""
    model = load_model(name, folder)
    return fly(model, {"gravity_m_s2": gravity}, np.array([0]), 1, folder=folder, width=width)["speed_m_s"][0]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with two models, and in `cache` the compiled kernels."""
    folder = tmp_path_factory.mktemp("models")
    (folder / "model.py").write_text(fall(1.0))
    (folder / "heavy.py").write_text(fall(3.0))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MC_ENGINE_CACHE", str(folder / "cache"))
        yield folder


def kernel_files(folder):
    return sorted(path.relative_to(folder / "cache").as_posix() for path in folder.rglob("kernel_w*.py"))


def in_another_process(folder):
    """Speed, seconds of the first flight, and how often its kernel came from the cache or did not, of a new process."""
    script = (
        "import json, sys, time\nfrom pathlib import Path\nimport numpy as np\n"
        "from mc_engine.flight.flight import fly\nfrom mc_engine.flight.kernel import build_kernel\n"
        "from mc_engine.model import load_model\n"
        "folder = Path(sys.argv[1])\nmodel = load_model('model.py', folder)\nstart = time.perf_counter()\n"
        "row = fly(model, {'gravity_m_s2': 9.0}, np.array([0]), 1, folder=folder, width=1)\n"
        "seconds = time.perf_counter() - start\nkernel = build_kernel(model, folder, 1)\n"
        "print(json.dumps({'speed': row['speed_m_s'][0], 'seconds': seconds,"
        " 'hits': kernel.loads, 'misses': kernel.compilations, 'compiler': 'numba' in sys.modules}))"
    )
    command = [sys.executable, "-c", script, str(folder)]
    environment = {**ENVIRONMENT, "MC_ENGINE_CACHE": str(folder / "cache")}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    return json.loads(done.stdout)


def test_two_models_in_one_folder_have_a_kernel_each(folder):
    assert (speed(folder, "model.py"), speed(folder, "heavy.py")) == (18.0, 54.0)
    assert len(kernel_files(folder)) == 2


def test_another_process_loads_the_kernel_from_the_cache(folder):
    assert speed(folder, "model.py") == 18.0
    other = in_another_process(folder)
    assert (other["speed"], other["misses"], other["hits"]) == (18.0, 0, 1)
    assert not other["compiler"]  # which takes longer to import than the flight


def test_an_edited_model_flies_by_its_new_source_in_the_same_process_and_in_others(folder):
    assert speed(folder, "model.py") == 18.0
    before = kernel.source_digest(load_model("model.py", folder), folder), len(kernel_files(folder))
    (folder / "model.py").write_text(fall(2.0))
    assert kernel.source_digest(load_model("model.py", folder), folder) != before[0]
    assert in_another_process(folder)["speed"] == 36.0
    assert speed(folder, "model.py") == 36.0
    assert len(kernel_files(folder)) == before[1] + 1
    (folder / "model.py").write_text(fall(1.0))
    assert speed(folder, "model.py") == 18.0


def test_a_file_beside_the_model_and_every_file_of_its_package_belong_to_the_digest(tmp_path):
    (tmp_path / "model.py").write_text(fall(1.0))
    digests = [kernel.source_digest(load_model("model.py", tmp_path), tmp_path)]
    for text in ("A = 1\n", "A = 2\n"):
        (tmp_path / "tables.py").write_text(text)
        digests.append(kernel.source_digest(load_model("model.py", tmp_path), tmp_path))
    assert len(set(digests)) == 3
    deorbit = load_model("campaigns.deorbit")
    folder = Path(sys.modules["campaigns.deorbit"].__file__).parent
    assert set(deorbit.sources.files) == set(folder.rglob("*.py"))


def test_every_source_that_kernels_are_made_of_belongs_to_the_digest(tmp_path, monkeypatch):
    (tmp_path / "model.py").write_text(fall(1.0))
    read, read_bytes = set(), Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: (read.add(path), read_bytes(path))[1])
    model = load_model("model.py", tmp_path)
    kernel.source_digest(model, tmp_path)
    engine = Path(mc_engine.__file__).parent
    made_of = [*engine.glob("lanes/*.py"), *engine.glob("physics/*.py"), *engine.glob("flight/kernel*.py")]
    made_of += [
        engine / "model/fields.py",
        engine / "model/record.py",
        engine / "status.py",
        engine / "units.py",
        tmp_path / "model.py",
    ]
    assert set(made_of) <= read
    assert len(made_of) > 15


@pytest.fixture
def handed_over(monkeypatch):
    """Kernel files are written, but handed over as their names: nothing is compiled."""
    monkeypatch.setattr(kernel, "Kernel", lambda path, compiled: path)
    kernel.build_kernel.cache_clear()
    yield
    kernel.build_kernel.cache_clear()


def test_widths_have_kernel_files_of_their_own_and_copies_of_a_model_share_them(tmp_path, monkeypatch, handed_over):
    monkeypatch.setenv("MC_ENGINE_CACHE", str(tmp_path / "cache"))
    paths = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "model.py").write_text(fall(1.0))
        model = load_model("model.py", tmp_path / name)
        paths += [kernel.build_kernel(model, tmp_path / name, width) for width in (1, 8, 16)]
    assert len(set(paths)) == 3
    assert paths[:3] == paths[3:]
    assert all(path.is_relative_to(tmp_path / "cache") for path in paths)
    assert "f, method, Parameters, Settings, 16," in paths[-1].read_text()


def test_the_cache_lies_where_the_user_says_or_where_the_system_keeps_such_things(tmp_path, monkeypatch):
    monkeypatch.setenv("MC_ENGINE_CACHE", str(tmp_path / "mine"))
    assert kernel.cache_folder() == tmp_path / "mine"
    monkeypatch.delenv("MC_ENGINE_CACHE")
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    assert kernel.cache_folder() == tmp_path / "home" / "mc-engine"
    # a home that is a file can hold no folder
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    temporary = Path(tempfile.gettempdir())
    assert kernel.cache_folder() == temporary / f"mc-engine-{os.getuid()}"
    assert kernel.cache_folder().stat().st_mode & 0o077 == 0  # what stands in it is run, so nobody else writes there
    # another user may have made a folder of this name
    monkeypatch.setattr(os, "getuid", lambda: 4_000_000_000)
    (temporary / "mc-engine-4000000000").mkdir()
    try:
        private = kernel.cache_folder()
        assert private.parent == temporary
        assert private.name != "mc-engine-4000000000"
        assert private == kernel.cache_folder()
        private.rmdir()
    finally:
        (temporary / "mc-engine-4000000000").rmdir()


def test_a_file_of_the_cache_that_was_cut_costs_a_compilation_and_no_flight(folder):
    in_another_process(folder)
    for path in (folder / "cache").rglob("*.kernel"):
        path.write_bytes(path.read_bytes()[:100])
    assert in_another_process(folder)["speed"] == 18.0
    assert in_another_process(folder)["hits"] == 1


def test_threads_may_write_the_same_file_of_the_cache_at_once(tmp_path, monkeypatch):
    replace, both = os.replace, threading.Barrier(2)

    def together(source, target):
        both.wait(10.0)
        replace(source, target)

    monkeypatch.setattr(os, "replace", together)
    with ThreadPoolExecutor(2) as threads:
        list(threads.map(partial(kernel_cache.replace_file, tmp_path / "a.kernel"), [b"first", b"other"]))
    assert (tmp_path / "a.kernel").read_bytes() in (b"first", b"other")
    assert [path.name for path in tmp_path.iterdir()] == ["a.kernel"]


def test_a_file_with_options_of_numba_in_the_working_folder_belongs_to_what_a_kernel_is_compiled_for(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    one, files = kernel_cache.Kernel(tmp_path / "kernel.py", lambda form: ("", None)), []
    for options in (None, b"opt: 0", b"opt: 3"):
        if options is not None:
            (tmp_path / ".numba_config.yaml").write_bytes(options)
        kernel_cache._target.cache_clear()
        files.append(one.file(("float64",)))
    kernel_cache._target.cache_clear()
    assert len({*files}) == 3


def test_the_folder_of_numbas_own_cache_belongs_to_no_kernel(tmp_path, monkeypatch):
    one, files = kernel_cache.Kernel(tmp_path / "kernel.py", lambda form: ("", None)), []
    for name, value in (("NUMBA_CACHE_DIR", "here"), ("NUMBA_CACHE_DIR", "there"), ("NUMBA_OPT", "1")):
        monkeypatch.setenv(name, value)
        kernel_cache._target.cache_clear()
        files.append(one.file(("float64",)))
    kernel_cache._target.cache_clear()
    assert files[0] == files[1] != files[2]


def test_a_full_disk_of_the_cache_is_told_and_the_cases_fly(tmp_path, monkeypatch, caplog):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    (tmp_path / "model.py").write_text(fall(4.0))
    monkeypatch.setenv("MC_ENGINE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(Path, "write_bytes", full)
    assert speed(tmp_path, "model.py") == 72.0
    (told,) = [record.getMessage() for record in caplog.records if record.name == "mc_engine"]
    assert told.startswith(str(tmp_path / "cache"))
    assert "No space left on device; compiled kernels cannot be kept there" in told


def test_a_cache_that_cannot_be_is_named_with_its_variable_before_a_run_is_begun(tmp_path, monkeypatch):
    (tmp_path / "model.py").write_text(fall(5.0))
    (tmp_path / "cache").touch()
    monkeypatch.setenv("MC_ENGINE_CACHE", str(tmp_path / "cache"))
    campaign = mc_engine.load_campaign("minimal")
    for flight in (lambda: speed(tmp_path, "model.py"), lambda: mc_engine.run(campaign, tmp_path / "run")):
        with pytest.raises(UsageError, match=r"cache.*: Not a directory; .* name another folder in MC_ENGINE_CACHE"):
            flight()  # no DiskError: there is no run to resume
    assert not (tmp_path / "run").exists()


@pytest.mark.slow  # copies of a campaign and other processes are in test_kernel_key.py and above
def test_the_same_campaign_under_the_same_relative_path_elsewhere_flies_from_the_cache(tmp_path):
    script = """
from pathlib import Path

import numpy as np

from mc_engine.flight.flight import fly
from mc_engine.model import load_model

model = load_model("model.py", Path("case"))
inputs = {item.name: item.default for item in model.parameters}
assert fly(model, inputs, np.zeros(1, dtype=int), 1, folder=Path("case"), width=1)["status"][0] == "ok"
"""
    for place in ("here", "there"):
        shutil.copytree(SHIPPED / "minimal", tmp_path / place / "case")
        command = [sys.executable, "-c", script]
        environment = {**ENVIRONMENT, "MC_ENGINE_CACHE": str(tmp_path / "cache")}
        done = subprocess.run(command, cwd=tmp_path / place, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


def test_a_finer_clock_has_half_of_the_steps_or_a_tenth_of_the_tolerances_and_the_same_samples():
    settings = SimpleNamespace(step=0.3, tolerance=1e-6)
    assert grid_of(FixedStep("step", 2.0, control_every=5), settings) == (7, 0.3, 5)
    assert grid_of(finer(FixedStep("step", 2.0, control_every=5), 2.0), settings) == (14, 0.15, 10)
    clock = finer(AdaptiveStep(10.0, "tolerance", (1e-3, 1e-6), control_period=0.5), 10.0)
    assert clock_number(clock.rtol, settings) == pytest.approx(1e-7)
    assert clock.atol == pytest.approx((1e-4, 1e-7))
    assert (clock.until, clock.control_period) == (10.0, 0.5)
