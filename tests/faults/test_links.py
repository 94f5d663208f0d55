"""Symbolic links at every name of a directory: no writer follows one, nothing outside changes, `verify` names each."""

import re
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from counted_directories import PAGES, TEXTS, a_rare_event, a_run, a_tuning, copied
from stones import call
from trapped import ROOT

from mc_engine import durable_file, load_campaign, open_store
from mc_engine.durable_file import (
    copy_into,
    make_way,
    names_in,
    open_to_append,
    publish,
    read_inside,
    remove_file,
    remove_folder,
    temporary_name,
    write_inside,
)
from mc_engine.errors import EngineError, StoreError
from mc_engine.runner import runner
from mc_engine.store.derived_files import derived_files
from mc_engine.store.verification import damage
from tests.mc_engine.flight.falling_ball import python_campaign

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="links need rights")

MADE = {"run": a_run, "tuning": a_tuning, "rare event": a_rare_event}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A directory of each kind."""
    folder = tmp_path_factory.mktemp("whole")
    return {kind: made(folder) for kind, made in MADE.items()}


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def write_all_there_is(folder, kind):
    """Every way in which the engine writes into a directory."""
    for files in (PAGES, TEXTS, {"report-figures/figure-1.svg": b"another"}):
        with suppress(EngineError):
            derived_files(folder).write(files, alone_in="report-figures" if files is not PAGES else None)
    if kind == "run":
        for use in (use_store, lambda run: runner.resume(run, workers=1, repair=True)):
            with suppress(EngineError):
                use(folder)


def use_store(run):
    store = open_store(run)
    with store.lock():
        rows = store.cases().iloc[:20]
        store.withdraw(store.parts[0])
        store.append(0, 20, {name: rows[name].to_numpy() for name in rows})
        store.write_nominal(store.nominal())
        store.write_histories(store.histories())


@pytest.mark.parametrize("kind", ["run", pytest.param("tuning", marks=pytest.mark.slow), "rare event"])
def test_no_writer_follows_a_link_at_any_name_and_verify_names_it(whole, tmp_path, kind):
    names = sorted(path.relative_to(whole[kind]).as_posix() for path in whole[kind].rglob("*"))
    inner = [name for name in names if not name.endswith(".lock")]
    spare = [temporary_name(name) for name in inner] + [".lock", ".derived.lock", "cases/.receipt.tmp"]
    for number, name in enumerate([*inner, *spare]):
        folder, outside = copied(whole[kind], tmp_path / f"{number}"), tmp_path / f"{number}-outside"
        place = folder / name
        if place.exists() and name in inner:
            place.rename(outside)
        else:
            place.unlink(missing_ok=True)
            outside.write_bytes(b"mine")
        if not place.parent.exists():
            continue
        place.symlink_to(outside)
        before = contents(outside) if outside.is_dir() else outside.read_bytes()
        if name in inner:
            assert any(name in what for what in damage(folder)), name
            assert call("verify", folder).exit_code == 5
        write_all_there_is(folder, kind)
        assert (contents(outside) if outside.is_dir() else outside.read_bytes()) == before, name


def test_report_and_replay_refuse_a_folder_that_is_a_link_and_leave_what_lies_there(tmp_path):
    run, theirs = a_run(tmp_path), tmp_path / "theirs"
    theirs.mkdir()
    for name in ("figure-99.svg", "case-3.parquet", "case-3.png"):
        (theirs / name).write_bytes(b"mine")
    for folder, verb in (("report-figures", ("report", "--format", "md")), ("replay", ("replay", "3"))):
        (run / folder).rename(tmp_path / folder)
        (run / folder).symlink_to(theirs)
        said = call(verb[0], run, *verb[1:])
        assert (said.exit_code, isinstance(said.exception, SystemExit)) == (5, True), said.output
        assert f"{folder}: is a symbolic link" in said.stderr
        assert f"{folder}: is a symbolic link" in " ".join(damage(run))
        assert set(contents(theirs).values()) == {b"mine"}
        assert len(contents(theirs)) == 3
        (run / folder).unlink()
        (tmp_path / folder).rename(run / folder)
    (tmp_path / "alias").symlink_to(run)  # the way to the directory is the user's own
    assert call("report", tmp_path / "alias", "--format", "md").exit_code == 0
    assert call("verify", tmp_path / "alias").exit_code == 0


@pytest.mark.parametrize("holds_folders", [True, False], ids=["by descriptor", "by path"])
def test_names_lead_nowhere_but_into_the_directory(tmp_path, monkeypatch, holds_folders):
    monkeypatch.setattr(durable_file, "_HOLDS_FOLDERS", holds_folders and durable_file._HOLDS_FOLDERS)
    root, outside = tmp_path / "root", tmp_path / "outside"
    for folder in (root / "in", outside):
        folder.mkdir(parents=True)
    (outside / "a").write_bytes(b"mine")
    (root / "link").symlink_to(outside)
    write_inside(root, "in/.a.tmp", b"new")
    acts = (
        lambda name: write_inside(root, name, b"theirs"),
        lambda name: remove_file(root, name),
        lambda name: publish(root, "in/.a.tmp", name),
        lambda name: make_way(root, f"{name}/b"),
        lambda name: read_inside(root, name),
        lambda name: names_in(root, f"{name}/.."),
        lambda name: open_to_append(root, name),
        lambda name: copy_into(root, name, outside / "a"),
        lambda name: remove_folder(root, name),
    )
    for act in acts:
        for name in ("link/a", "../outside/a", "in/../../outside/a", f"{outside}/a", "", "in//a", "in/\0"):
            with pytest.raises(StoreError):
                act(name)
    assert contents(outside) == {"a": b"mine"}
    write_inside(root, "in/a", b"ours")
    assert read_inside(root, "in/a") == b"ours"
    assert names_in(root, "in") == ["a"]


@pytest.fixture(scope="module")
def failed(tmp_path_factory):
    """The run of a simulator of which case 3 fails."""
    folder = tmp_path_factory.mktemp("failed")
    file = python_campaign(folder / "ball", cases=8, fault="if case.id == 3: raise ValueError('once more')")
    return runner.run(load_campaign(file), folder / "run", workers=1).path


def test_a_folder_that_is_a_link_hides_no_other_damage(tmp_path):
    run = a_run(tmp_path)
    for folder in ("replay", "report-figures"):
        (run / folder).rename(tmp_path / folder)
        (run / folder).symlink_to(tmp_path / folder)
    (run / "footprint.kml").write_bytes(b"not recorded")
    said = {line.partition(": ")[0] for line in damage(run) if "symbolic link" in line or "does not count" in line}
    assert {"replay", "report-figures", "footprint.kml"} <= said


@pytest.mark.parametrize(
    "name",
    ["simulator", pytest.param("simulator/case-0000003", marks=pytest.mark.slow), "simulator/case-0000003/case.json"],
)
def test_what_a_simulator_leaves_behind_stays_in_the_run(failed, tmp_path, name):
    run, outside = copied(failed, tmp_path / "run"), tmp_path / "outside"
    kept = contents(run / "simulator")
    assert [*kept] == ["case-0000003/case.json"]
    (run / name).rename(outside)
    (run / name).symlink_to(outside)
    theirs = contents(outside) if outside.is_dir() else outside.read_bytes()
    if name == "simulator":
        assert damage(run) == ["simulator: is no folder of this run's own"]
        with pytest.raises(StoreError, match="simulator: is a symbolic link"):
            runner.rerun(run)
        with pytest.raises(StoreError, match="simulator: is a symbolic link"):
            runner.extend(run, 16, workers=1)
    else:
        runner.rerun(run)
        assert contents(run / "simulator") == kept  # in a new folder, or a new file
    assert (contents(outside) if outside.is_dir() else outside.read_bytes()) == theirs


def test_only_regular_files_of_a_case_are_kept(tmp_path):
    (tmp_path / "secret").write_text("mine")
    lines = [
        "import os",
        f"os.symlink({str(tmp_path / 'secret')!r}, case.folder / 'link')",
        f"os.symlink({str(tmp_path)!r}, case.folder / 'way')",
        "os.mkfifo(case.folder / 'pipe')",
        "(case.folder / 'in').mkdir()",
        "(case.folder / 'in/deck.inp').write_text('10.0')",
        "raise ValueError('no')",
    ]
    file = python_campaign(tmp_path / "ball", cases=2, fault="\n".join(lines))
    runner.run(load_campaign(file), tmp_path / "run", workers=1)
    folder = tmp_path / "run/simulator/case-0000001"
    kept = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))
    assert kept == ["case.json", "in", "in/deck.inp"]


# What writes, replaces, removes or makes files and folders.
WRITES = re.compile(
    r"\.(?:write_bytes|write_text|unlink|touch|mkdir|rmdir|rename(?!\(columns)|symlink_to|hardlink_to)\("
    r"|\bos\.(?:open|remove|replace|rename|rmdir|makedirs|truncate|link|symlink)\(|\bshutil\.(?!which)|\btempfile\."
    r"|\bopen\([^)\n]*[\"'](?:[wax]b?\+?|r?b?\+b?)[\"']"
)
ELSEWHERE = {
    "mc_engine/durable_file.py": "the one place",
    "mc_engine/cache_folder.py": "the folder of compiled kernels and kept designs",
    "mc_engine/flight/case_process.py": "a simulator's temporary folder, outside of any run",
    "mc_engine/flight/case_worker.py": "folders of cases in a simulator's temporary folder, outside of any run",
    "mc_engine/flight/kernel.py": "the cache of compiled kernels",
    "mc_engine/flight/program_flight.py": "input files of a program, in a simulator's temporary folder",
    "mc_engine/lanes/kernel_cache.py": "locks of kernels under compilation",
    "mc_engine/runner/backends.py": "what bench measured of cards, in the folder of compiled kernels",
    "mc_engine/store/object_store.py": "scratch folders beside a fetched copy",
    "mc_engine/model/sources.py": "what spawned processes import, in a simulator's temporary folder",
    "mc_engine/process_tree.py": "a simulator's temporary folder, where its engine was killed",
    "mc_engine/text.py": "the null device",
    "mc_engine/command_line/watching.py": "the page of --watch, which is no run",
    "mc_engine/command_line/before_flight.py": "init makes a folder that the user named",
    "mc_engine/documentation/website.py": "the site of the documentation",
    "mc_engine/unforeseen.py": "the log of an error, in the folder of temporary files",
    "mc_engine/store/writer_lock.py": "the lock of a directory",
    "reports/figures/table_figures.py": "a picture, to the place that the user names",
}


def test_no_other_module_writes_files():
    sources = [path for package in ("mc_engine", "reports") for path in sorted((ROOT / package).rglob("*.py"))]
    assert len(sources) > 200
    texts = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in sources}
    assert {name for name, text in texts.items() if WRITES.search(text)} == {*ELSEWHERE}
    assert Path(durable_file.__file__).name == "durable_file.py"
