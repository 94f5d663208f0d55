import subprocess
import sys

import pytest
from cart import small_store

from tests.mc_engine.store.small_run import ENVIRONMENT


def loaded_by(*arguments):
    """The modules that a process of its own has loaded after the verb."""
    script = (
        "import sys\nfrom mc_engine.command_line.commands import app\n"
        f"try:\n    app({list(map(str, arguments))!r})\nexcept SystemExit as end:\n    assert not end.code, end.code\n"
        "print('\\n'.join(['LOADED', *sys.modules]))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, env=ENVIRONMENT)
    return set(done.stdout.split("LOADED\n")[1].split())


SLOW = {"numba", "matplotlib", "reports"}


@pytest.mark.parametrize(
    "arguments", [["list"], ["schema"], ["published"], ["plan", "--share", "0.99", "--confidence", "0.9"]]
)
def test_list_schema_and_plan_load_neither_numba_nor_matplotlib(arguments):
    assert not SLOW & loaded_by(*arguments)


@pytest.mark.parametrize("arguments", [["--help"], ["run", "--help"], ["verify", "--help"], ["check", "--help"]])
def test_help_loads_no_numpy_and_no_pydantic_either(arguments):
    assert not (SLOW | {"numpy", "pandas", "pyarrow", "pydantic"}) & loaded_by(*arguments)


def test_check_and_status_load_neither_numba_nor_matplotlib(here):
    small_store(here / "flown")
    for arguments in (["check", "--no-model", here / "cart"], ["check", "minimal"], ["status", here / "flown"]):
        assert not SLOW & loaded_by(*arguments)


def test_a_run_its_status_and_its_summary_load_no_pandas(here):
    run = here / "flown"
    for arguments in (["run", "minimal", "--cases", 8, "--no-report", "--out", run], ["status", run], ["summary", run]):
        assert "pandas" not in loaded_by(*arguments)


def test_parts_of_numpy_that_scipy_only_names_are_not_loaded(tmp_path):
    command = [sys.executable, "-X", "importtime", "-m", "mc_engine", "run", "minimal", "--cases", "8", "--no-report"]
    command += ["--out", str(tmp_path / "flown")]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=ENVIRONMENT)
    loaded = {line.split("|")[-1].strip() for line in done.stderr.splitlines()}
    assert {"scipy.special", "numpy.f2py"} <= loaded
    assert not {"numpy.f2py.crackfortran", "numpy.polynomial.chebyshev", "unittest.case"} & loaded


def test_the_engine_is_imported_where_the_system_has_no_signals_of_posix():
    script = (
        "import signal\n"
        "known = {'SIGABRT', 'SIGFPE', 'SIGILL', 'SIGINT', 'SIGSEGV', 'SIGTERM'}  # of Windows\n"
        "for name in [name for name in vars(signal) if name[:3] == 'SIG' and name[3:4].isalpha()]:\n"
        "    if name not in known:\n"
        "        delattr(signal, name)\n"
        "import mc_engine.command_line.app, mc_engine.runner.runner, mc_engine.flight.simulated\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, env=ENVIRONMENT)
