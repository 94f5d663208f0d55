"""Import of the files and packages that lie beside a campaign's model."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any

from mc_engine.files_read import USER


@contextmanager
def importable(folder: Path, mark: str) -> Iterator[None]:
    """Let what lies in `folder` be imported, and forget its names again: another campaign's may have the same.

    mark : of the texts of the folder.  A module goes on under a name with it, so that a cached kernel finds the
    functions that it was made of again, and no others.
    """
    before, finder = set(sys.modules), _Beside(folder, mark)
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
        new = [name for name in set(sys.modules) - before if not name.startswith(USER)]
        for name in [name for name in new if _lies_in(sys.modules[name], folder)]:  # a path may ask for its parent
            del sys.modules[name]


def _lies_in(module: ModuleType, folder: Path) -> bool:
    file = getattr(module, "__file__", None)
    places = [file] if file is not None else list(getattr(module, "__path__", ()))
    return any(folder in Path(place).parents for place in places)


def _is_elsewhere(name: str) -> bool:
    return name in sys.stdlib_module_names or PathFinder.find_spec(name) is not None


class _Beside(MetaPathFinder):
    """Finds sources in a folder and the packages in it, before all others."""

    def __init__(self, folder: Path, mark: str):
        self._folder, self._mark = folder, mark

    def find_spec(self, fullname: str, path: Any = None, target: ModuleType | None = None) -> ModuleSpec | None:
        spec = PathFinder.find_spec(fullname, [str(self._folder)] if path is None else path, target)
        if spec is None:
            return None
        if spec.origin is None:  # a folder without __init__.py is a package only where no other has its name
            return None if path is not None or _is_elsewhere(fullname) else spec
        if self._folder not in Path(spec.origin).parents:
            return None
        if isinstance(spec.loader, SourceFileLoader):
            spec.loader = _Renamed(f"{USER}{fullname.replace('.', '_')}_{self._mark}", spec.origin)
        return spec


class _Renamed(SourceFileLoader):
    """Loads a source under a name of its own, which its functions have for their module."""

    def exec_module(self, module: ModuleType) -> None:
        module.__name__ = self.name
        sys.modules[self.name] = module
        try:
            super().exec_module(module)
        except BaseException:
            del sys.modules[self.name]
            raise
