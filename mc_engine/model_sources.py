"""The source files that decide a model's numbers: those of its package or folder, and what they import.

More than the model may need; an edit of a file that it does not need costs a compilation, no wrong number.
"""

import sys
from pathlib import Path
from types import ModuleType

from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.syntax_tree import imported_names

_ENGINE = "mc_engine"  # its own sources are counted apart


def sources_beside(file: Path) -> list[Path]:
    """Sources of a model that is a file: all beside it, and the folders beside it that they import, whole."""
    folder = file.parent
    beside = sorted(folder.glob("*.py"))
    roots = {name.split(".")[0] for path in beside for name in imported_names(path.read_bytes())}
    packages = [folder / root for root in sorted(roots) if (folder / root).is_dir()]
    return [*beside, *(path for package in packages for path in sorted(package.rglob("*.py")))]


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
