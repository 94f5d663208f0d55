"""The source files that decide a model's numbers: those of its package or folder, and what they import.

More than the model may need; an edit of a file that it does not need costs a compilation, no wrong number.
"""

import sys
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.syntax_tree import imported_names

_ENGINE = "mc_engine"  # its own sources are counted apart


def sources_beside(file: Path) -> list[Path]:
    """Sources of a model that is a file: all beside it, and the folders beside it that they import, whole."""
    beside = _sources(file.parent.glob("*.py"))
    packages = [path for name in _imported_beside(file) for path in _sources((file.parent / name).rglob("*.py"))]
    return [*beside, *packages]


def _sources(paths: Iterable[Path]) -> list[Path]:
    """Those that can be read: a pipe or a folder of such a name is no source."""
    return sorted(path for path in paths if path.is_file())


def _imported_beside(file: Path) -> list[str]:
    """Folders beside a model that it, or others beside it, import; a file that nothing imports is not parsed."""
    waiting: list[Path] = [file]
    seen: set[str] = set()
    while waiting:
        roots = {name.split(".")[0] for name in imported_names(waiting.pop().read_bytes())} - seen - {""}
        seen |= roots
        waiting += _sources(file.parent / f"{root}.py" for root in roots)
        waiting += [path for root in roots for path in _sources((file.parent / root).rglob("*.py"))]
    return sorted(name for name in seen if (file.parent / name).is_dir())


def sources_of_module(name: str) -> list[Path]:
    """Sources of a model in an imported module: its folder, and what it reaches of its package or of other physics."""
    module = sys.modules[name]
    assert module.__file__ is not None  # a model's module always comes from a file
    home = Path(module.__file__)
    inside_package = home.name == "__init__.py" or "." in name
    found = set(home.parent.rglob("*.py") if inside_package else home.parent.glob("*.py"))
    waiting, seen = [name], {name}
    while waiting:
        for reached in _imports(waiting.pop()):
            if reached not in seen and _decides(reached, name):
                seen.add(reached)
                waiting.append(reached)
                found.add(Path(str(sys.modules[reached].__file__)))
    return sorted(found)


def _imports(name: str) -> list[str]:
    """Modules, by name, that a loaded one imports."""
    module = sys.modules[name]
    names = imported_names(Path(str(module.__file__)).read_bytes(), _package(module))
    return [one for one in names if one in sys.modules]


def _package(module: ModuleType) -> str:
    return module.__name__ if hasattr(module, "__path__") else module.__name__.rpartition(".")[0]


def _decides(name: str, model: str) -> bool:
    """Whether a module may decide the model's numbers: of the same package, or with physics in it."""
    module, root = sys.modules[name], name.split(".")[0]
    if root == _ENGINE or not str(getattr(module, "__file__", None)).endswith(".py"):
        return False
    return root == model.split(".")[0] or any(isinstance(value, PhysicsFunction) for value in vars(module).values())
