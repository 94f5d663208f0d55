"""The reference of functions and classes, from their definitions and docstrings, read from the source files."""

import ast
import importlib.util
from collections.abc import Iterator
from pathlib import Path

from mc_engine.documentation.markdown_text import prose

# Module, and what a reader looks for there.  Of a package that only passes names on, its modules follow.
SECTIONS = {
    "engine": (
        "Campaigns, runs and their results",
        "runner.runner campaign.loading campaign.search campaign.cases store.store store.opening studies.opened_run "
        "model.declarations model.declared model.fields model.record model.simulator model.figures model.designs "
        "studies.tuning studies.tuning_folder studies.comparison studies.rare_event errors status",
    ),
    "random": (
        "Designs, distributions and random numbers",
        "sampling.designs sampling.distributions sampling.correlation sampling.streams units dates",
    ),
    "lanes": ("Mathematics inside models", "lanes.physics_function lanes.functions lanes.elementary"),
    "physics": ("Shared physics", "physics"),
    "statistics": ("Statistics", "statistics"),
}
_HEAD = """# Functions and classes

`import mc_engine` provides the names that most programs need: NAMES. Import all others from the modules below.
The descriptions state meaning, units, shapes, errors, and the source with its equation; arrays are written
`float64[n_cases, n_state]`.
"""
Definition = ast.FunctionDef | ast.ClassDef


def pages() -> Iterator[tuple[str, str]]:
    """An overview, and a page for each section."""
    import mc_engine

    names = ", ".join(f"`{name}`" for name in mc_engine.__all__)
    listed = "\n".join(f"- [{title}](functions/{key}.md)" for key, (title, _) in SECTIONS.items())
    toctree = "\n".join(f"functions/{key}" for key in SECTIONS)
    hidden = f"```{{toctree}}\n:hidden:\n\n{toctree}\n```"
    yield "functions.md", "\n\n".join([_HEAD.replace("NAMES", names), listed, hidden]) + "\n"
    for key, (title, modules) in SECTIONS.items():
        bodies = [text for name in modules.split() for path in files(name) for text in _module(path)]
        yield f"functions/{key}.md", "\n\n".join([f"# {title}", *bodies]) + "\n"


def files(name: str) -> list[Path]:
    """The file of a module, or those of all modules of a package."""
    spec = importlib.util.find_spec(f"mc_engine.{name}")
    assert spec is not None  # the names above are tested
    assert spec.origin is not None
    path = Path(spec.origin)
    return [path] if path.name != "__init__.py" else [file for file in sorted(path.parent.glob("*.py")) if file != path]


def definitions(path: Path) -> list[Definition]:
    """The functions and classes of a file whose names do not begin with an underscore."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = [node for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    return [node for node in nodes if not node.name.startswith("_")]


def _module(path: Path) -> Iterator[str]:
    root = Path(__file__).resolve().parents[2]
    name = ".".join(path.relative_to(root).with_suffix("").parts)
    yield f"## {name}"
    yield f"```{{py:module}} {name}\n```"
    yield prose(ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "")
    for definition in definitions(path):
        yield _entry(definition, "class" if isinstance(definition, ast.ClassDef) else "function")


def _entry(definition: Definition, kind: str) -> str:
    inner = [prose(ast.get_docstring(definition) or "")]
    if isinstance(definition, ast.ClassDef):
        for method in definition.body:
            if isinstance(method, ast.FunctionDef) and method.name[0] != "_" and ast.get_docstring(method) is not None:
                inner.append(_entry(method, "method"))
    fence = "`" * (12 if kind == "class" else 9)  # longer than what it holds
    text = "\n\n".join(part for part in inner if part)
    return f"{fence}{{py:{kind}}} {_signature(definition, kind)}\n{text}\n{fence}"


def _signature(definition: Definition, kind: str) -> str:
    if isinstance(definition, ast.ClassDef):
        fields = [ast.unparse(field) for field in definition.body if isinstance(field, ast.AnnAssign)]
        return f"{definition.name}({', '.join(_shortened(field) for field in fields)})" if fields else definition.name
    arguments = definition.args
    if kind == "method" and arguments.args and arguments.args[0].arg in ("self", "cls"):
        arguments.args = arguments.args[1:]
    if any(
        isinstance(mark, ast.Name) and mark.id in ("property", "cached_property") for mark in definition.decorator_list
    ):
        return definition.name
    returns = f" -> {ast.unparse(definition.returns)}" if definition.returns else ""
    return f"{definition.name}({ast.unparse(arguments)}){returns}"


def _shortened(field: str) -> str:
    """A field with its type; a default that calls a function is left out, as signatures have no place for it."""
    name, _, default = field.partition(" = ")
    return name if "(" in default else field
