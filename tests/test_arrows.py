"""Imports point one way: campaigns -> mc_engine <- reports."""

import ast
from pathlib import Path

import pytest

import mc_engine

ROOT = Path(__file__).resolve().parents[1]


def imported(package):
    """(file, module) of every import in a package."""
    for path in sorted((ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            yield from ((path.relative_to(ROOT).as_posix(), name) for name in names)


@pytest.mark.parametrize(
    ("package", "forbidden"),
    [("mc_engine", {"campaigns", "reports", "tests"}), ("campaigns", {"reports", "tests"}), ("reports", {"campaigns"})],
)
def test_no_import_points_against_the_arrows(package, forbidden):
    assert [one for one in imported(package) if one[1].split(".")[0] in forbidden] == []


def test_reports_know_of_the_engine_only_what_a_store_and_its_statistics_are():
    known = {
        "store",
        "statistics",
        "status",
        "units",
        "figures",
        "errors",
        "derived_files",
        "directory_kinds",
        "durable_file",
        "journal",
        "run_folder",
        "run_summary",
        "replay_files",
        "tuning_folder",
        "rare_event_folder",
        "comparison",
        "run_changes",
        "shell_words",
        "text",
    }
    used = {name.split(".")[1] for _, name in imported("reports") if name.startswith("mc_engine.")}
    assert used <= known


def test_the_public_names_are_these():
    names = """
        AdaptiveStep Campaign CampaignError Case EngineError Event Extremum Field FixedStep Model ModelError Parameter
        Refusals Replay Run RunInterrupted Setting Store StoreError TuningRecord case_table extend list_campaigns
        load_campaign open_run open_store open_tuning replay resume run tune
    """
    assert sorted(mc_engine.__all__) == names.split()
    for name in mc_engine.__all__:
        assert getattr(mc_engine, name) is not None


def test_no_file_is_longer_than_400_lines():
    roots = [ROOT / name for name in ("mc_engine", "campaigns", "reports", "tests")]
    written = [path for root in roots for path in root.rglob("*") if path.suffix in {".py", ".toml", ".md", ".css"}]
    assert len(written) > 500
    lines = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8").count("\n") for path in written}
    assert {name: number for name, number in lines.items() if number > 400} == {}
