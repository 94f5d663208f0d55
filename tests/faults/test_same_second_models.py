"""What flew is what is kept: sources run from the bytes that were read, whatever bytecode files say of them."""

import os
import py_compile
import subprocess

import pandas as pd
import pytest
from falling import CAMPAIGN, MODEL, engine, falling

IMPORTS = "from beside import B\nfrom lib.inner import C\n\nFACTOR = 1.00 + B + C"
IMPORTING = MODEL.replace("FACTOR = 1.0", IMPORTS)
SECOND = 1_700_000_000
assert IMPORTING != MODEL


def version(folder, number, places):
    """The campaign with its three numbers, of which those at `places` are others; all files of one second."""
    a, b, c = (f"{number if at in places else 1.0:.2f}" for at in range(3))
    (folder / "lib").mkdir(parents=True, exist_ok=True)
    (folder / "lib" / "__init__.py").write_text("")
    (folder / "lib" / "inner.py").write_text(f"C = {c}\n")
    falling(folder, IMPORTING.replace("1.00", a), beside=f"B = {b}\n")
    for path in folder.rglob("*.py"):
        os.utime(path, (SECOND, SECOND))
    return float(a) + float(b) + float(c)


def flies_what_it_keeps(tmp_path, numbers, places):
    """Versions of one length and second are copied into one folder and flown, one after the other."""
    for number in numbers:
        factor = version(tmp_path / f"{number}", number, places)
        subprocess.run(["cp", "-pr", f"{tmp_path / str(number)}/.", tmp_path / "mine"], check=True)
        run = tmp_path / f"flown_{number}"
        done = engine("run", tmp_path / "mine", "--workers", 1, "--no-report", "--out", run, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        cases = pd.read_parquet(run / "cases").query("status == 'ok'")
        assert (cases.speed_m_s / cases.gravity_m_s2 / 2.0).round(6).unique() == [factor]
        for name in ("model.py", "beside.py", "lib/inner.py"):
            assert (run / name).read_bytes() == (tmp_path / str(number) / name).read_bytes()
    assert not list((tmp_path / "mine").rglob("*.pyc"))


def test_of_two_models_of_one_second_and_length_the_one_flies_that_is_kept(tmp_path):
    flies_what_it_keeps(tmp_path, [1.25, 1.75], range(3))


@pytest.mark.slow
@pytest.mark.parametrize("place", range(3))
def test_thirty_pairs_of_one_second_and_length_fly_what_they_keep(place, tmp_path):
    flies_what_it_keeps(tmp_path, [number / 4 for number in range(5, 25)], [place])


def planted(source, *targets):
    """Bytecode that Python takes without a look at the source, and that leaves a mark."""
    evil = source.with_name("evil.txt")
    evil.write_text(f"{source.read_text()}\nopen({str(source.parent / 'sprung')!r}, 'a')\n")
    for target in targets:
        target.parent.mkdir(exist_ok=True)
        mode = py_compile.PycInvalidationMode.UNCHECKED_HASH
        py_compile.compile(str(evil), str(target), str(source), doraise=True, invalidation_mode=mode)
    evil.unlink()


def test_bytecode_planted_in_a_run_or_in_a_package_never_runs(tmp_path):
    version(tmp_path / "mine", 1.0, ())
    run = tmp_path / "flown"
    assert engine("run", "mine", "--cases", 8, "--no-report", "--out", run, cwd=tmp_path).returncode == 0
    for name in ("model", "beside", "lib/inner", "lib/__init__"):
        source = run / f"{name}.py"
        planted(source, source.parent / "__pycache__" / f"{source.stem}.cpython-311.pyc", source.with_suffix(".pyc"))
    for words in (["replay", run, 3], ["check", run, "--no-model"]):
        done = engine(*words, cwd=tmp_path, PYTHONPATH=str(run))
        assert done.returncode == 0, done.stderr
    assert not list(run.rglob("sprung"))


def test_bytecode_planted_in_an_installed_package_never_runs(tmp_path):
    version(tmp_path / "path" / "pkg", 1.0, ())
    package = tmp_path / "path" / "pkg"
    (package / "model.py").write_text(IMPORTING.replace("from beside", "from .beside").replace("from lib", "from .lib"))
    for source in [*package.rglob("*.py")]:
        planted(source, source.parent / "__pycache__" / f"{source.stem}.cpython-311.pyc")
    falling(tmp_path / "mine")
    (tmp_path / "mine" / "campaign.toml").write_text(CAMPAIGN.replace("model.py", "pkg.model"))
    done = engine("check", "mine", "--no-model", cwd=tmp_path, PYTHONPATH=str(tmp_path / "path"))
    assert done.returncode == 0, done.stderr
    assert not list(package.rglob("sprung"))


def test_a_module_that_is_bytecode_alone_is_not_found_beside_a_model(tmp_path):
    version(tmp_path / "mine", 1.0, ())
    source = tmp_path / "mine" / "beside.py"
    planted(source, source.with_suffix(".pyc"))
    source.unlink()
    done = engine("check", "mine", cwd=tmp_path, PYTHONPATH=str(tmp_path / "mine"))
    assert "No module named 'beside'" in done.stderr
    assert not (tmp_path / "mine" / "sprung").exists()
