"""Imports point one way: campaigns -> mc_engine <- reports."""

import ast
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

import pytest

import mc_engine

ROOT = Path(__file__).resolve().parents[1]


@cache
def imports(path):
    """(import, is it needed by annotations only) of a file."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    guarded = [node for node in nodes if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)]
    annotations = {id(inner) for node in guarded for inner in ast.walk(node)}
    return [(node, id(node) in annotations) for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]


def imported(package):
    """(file, module) of every import in a package."""
    for path in sorted((ROOT / package).rglob("*.py")):
        for node, _ in imports(path):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            yield from ((path.relative_to(ROOT).as_posix(), name) for name in names)


@pytest.mark.parametrize(
    ("package", "forbidden"),
    [("mc_engine", {"campaigns", "reports", "tests"}), ("campaigns", {"reports", "tests"}), ("reports", {"campaigns"})],
)
def test_no_import_points_against_the_arrows(package, forbidden):
    assert [one for one in imported(package) if one[1].split(".")[0] in forbidden] == []


# What a package may take from the engine, besides the public names of its packages: modules by room, "" is the root.
KNOWN = {
    "reports": {
        "": "units status errors durable_file numbers_in_text section shell_words text",
        "model": "figures",
        "runner": "summary",
        "statistics": "*",
        "store": "*",
        "studies": "comparison published rare_event_folder replay_files run_changes tuning_folder",
    },
    "campaigns": {  # as any user's model; `flight` and `published_values` fly the cases of published results
        "": "errors",
        "flight": "flight",
        "lanes": "noise runge_kutta_pairs",
        "model": "figures",
        "physics": "*",
        "statistics": "*",
        "studies": "published published_values",
    },
}


@pytest.mark.parametrize("package", KNOWN)
def test_reports_and_campaigns_take_from_the_engine_only_what_is_listed(package):
    engine, files = modules("mc_engine"), modules(package)
    used = {name for path in files.values() for name in taken(path, engine)}
    rooms = {f"mc_engine.{room}".rstrip("."): names.split() for room, names in KNOWN[package].items()}
    listed = [*rooms, *(f"{room}.{name}" for room, names in rooms.items() for name in names)]
    assert len(used) > 8
    assert [name for name in sorted(used) if not any(fnmatch(name, one) for one in listed)] == []
    assert [one for one in listed if "*" not in one and one.count(".") > 1 and one not in used] == []


def test_the_public_names_are_these():
    names = """
        AdaptiveStep Campaign CampaignError Case EngineError Event Extremum Field FixedStep Model ModelError Parameter
        Refusals Refuse Replay Run RunInterrupted Setting Simulator Store StoreError TuningRecord case_table extend
        list_campaigns load_campaign open_run open_store open_tuning replay resume run tune
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


# ---- the rooms of the house


# A package takes from those before it only; "" is the root: what all of the engine stands on, and what begins a report.
ORDER = {
    "mc_engine": ("", "lanes", "physics", "sampling", "statistics", "model", "store", "campaign", "flight", "runner",
                  "studies", "command_line", "documentation"),
    "reports": ("text", "drawing", "figures", "document", "run", "sections", "contributors", "footprint", "formats",
                "studies", "user_sections", ""),
}  # fmt: skip
MOST_FILES = {"lanes": 32, "statistics": 32}  # of a package; else 20


def modules(package):
    """File by dotted name."""
    files = {}
    for path in sorted((ROOT / package).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        files[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return files


def taken(path, known):
    """Modules among `known` that a file takes names from, but for annotations."""
    for node, annotations in imports(path):
        if annotations:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        else:
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (name if name in known else node.module for name in inner if {name, node.module} & known.keys())


def circles(graph):
    """Sets of modules that take from one another: what is left when those that take from nobody left are taken away."""
    left = dict(graph)
    while free := [name for name, others in left.items() if not others & left.keys()]:
        for name in free:
            del left[name]
    while free := [name for name in left if not any(name in others for others in left.values())]:
        for name in free:
            del left[name]
    return sorted(left)


@pytest.mark.parametrize("package", ["mc_engine", "campaigns", "reports"])
def test_no_modules_take_from_one_another_in_a_circle(package):
    files = modules(package)
    graph = {name: {*taken(path, files)} - {name} for name, path in files.items() if name != package}
    assert len(graph) > 50
    assert circles(graph) == []


def test_circles_are_found():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}}) == ["b", "c"]


@pytest.mark.parametrize("root", ORDER)
def test_a_package_takes_from_those_before_it_only(root):
    files, order, against = modules(root), ORDER[root], []

    def room(name):
        parts = name.split(".")
        return parts[1] if len(parts) > 1 and (ROOT / root / parts[1]).is_dir() else ""

    for name, path in files.items():
        for other in taken(path, files):
            if root not in (name, other) and order.index(room(other)) > order.index(room(name)):
                against.append(f"{name} takes from {other}")
    assert against == []


@pytest.mark.parametrize("root", ORDER)
def test_every_package_has_its_place_in_the_order(root):
    packages = {path.name for path in (ROOT / root).iterdir() if (path / "__init__.py").exists()}
    assert {"", *packages} == {*ORDER[root]}


@pytest.mark.parametrize("root", ["mc_engine", "campaigns", "reports"])
def test_no_package_is_crowded(root):
    folders = [init.parent for init in (ROOT / root).rglob("__init__.py")]
    counts = {path.relative_to(ROOT).as_posix(): len([*path.glob("*.py")]) for path in folders}
    assert {path: n for path, n in counts.items() if n > MOST_FILES.get(path.rpartition("/")[2], 20)} == {}
