"""Import of a model and of the modules in its folder or package, from file contents that are read exactly once.

The code that runs is compiled from the same bytes that are digested and that the run directory keeps.  Bytecode files
are not used, because Python matches them to a source only by its size and its modification time in seconds.
"""

import linecache
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader, SourcelessFileLoader
from importlib.util import decode_source, module_from_spec, spec_from_file_location
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

USER = "mc_engine_user_"  # begins the name of every module from a campaign's folder
_ENGINE = "mc_engine"


class CapturedLoader(SourceFileLoader):
    """Makes a module from the given content.  name : of the module from then on, whatever name it is imported by"""

    def __init__(self, name: str, path: Path | str, content: bytes):
        super().__init__(name, str(path))
        self.content = content

    def get_data(self, path: str) -> bytes:
        return self.content if path == self.path else super().get_data(path)

    def get_code(self, fullname: str) -> Any:
        code = self.source_to_code(self.content, self.path)
        text = decode_source(self.content)  # for all that shows or reads the source; without a time it is never stale
        linecache.cache[self.path] = (len(text), None, text.splitlines(keepends=True), self.path)
        return code

    def exec_module(self, module: ModuleType) -> None:
        module.__name__ = self.name
        sys.modules[self.name] = module
        try:
            super().exec_module(module)
        except BaseException:
            sys.modules.pop(self.name, None)
            raise


def new_module(name: str, path: Path, content: bytes, **names: Any) -> ModuleType:
    """Run a source as the module `name`.  names : what it finds defined."""
    spec = spec_from_file_location(name, path, loader=CapturedLoader(name, path, content))
    assert spec is not None  # with a loader there always is one
    assert spec.loader is not None
    module = module_from_spec(spec)
    vars(module).update(names)
    spec.loader.exec_module(module)
    return module


@contextmanager
def importable(folder: Path, mark: str, contents: Mapping[Path, bytes]) -> Iterator[None]:
    """Let the sources in `folder` be imported, and forget their names again: another campaign's may have the same.

    contents : of the sources, by file.  mark : of their contents.  A module goes on under a name with it, so that a
    cached kernel finds the functions that it was made of again, and no others.
    """
    finder = _Beside(folder, mark, contents)
    # what a program has imported from there by itself may come from a bytecode file
    before = {name: module for name, module in sys.modules.items() if _is_imported_from(folder, name, module)}
    for name in before:
        del sys.modules[name]
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
        for name in [name for name in sys.modules if name.partition(".")[0] in finder.roots]:
            del sys.modules[name]
        sys.modules.update(before)


def _is_imported_from(folder: Path, name: str, module: ModuleType) -> bool:
    file = getattr(sys.modules.get(name.partition(".")[0], module), "__file__", None) or ""
    return not name.startswith((_ENGINE, "__main__")) and folder in Path(file).parents[:2]


class _Beside(MetaPathFinder):
    """Finds sources in a folder, and in the packages there, for a model and before all others.

    roots : names of what was found in the folder.
    """

    def __init__(self, folder: Path, mark: str, contents: Mapping[Path, bytes]):
        self._folder, self._mark, self._contents = folder, mark, contents
        self.roots: set[str] = set()

    def find_spec(self, fullname: str, path: Any = None, target: ModuleType | None = None) -> ModuleSpec | None:
        if not (_is_asked_by_a_model() if path is None else fullname.partition(".")[0] in self.roots):
            return None
        places = [Path(home) / fullname.rpartition(".")[2] for home in path or [self._folder]]
        spec = next((spec for place in places if (spec := self._source(fullname, place)) is not None), None)
        other = PathFinder.find_spec(fullname) if path is None else None
        known = other is not None or fullname in sys.stdlib_module_names
        if spec is None and not known and (folders := [str(place) for place in places if place.is_dir()]):
            spec = ModuleSpec(fullname, None, is_package=True)  # a folder is a package where no other has its name
            spec.submodule_search_locations = folders
        if spec is not None:
            self.roots.add(fullname.partition(".")[0])
        elif path is not None or isinstance(getattr(other, "loader", None), SourcelessFileLoader):
            raise ModuleNotFoundError(f"No module named {fullname!r}", name=fullname)  # there may be bytecode
        return spec

    def _source(self, fullname: str, place: Path) -> ModuleSpec | None:
        name = f"{USER}{fullname.replace('.', '_')}_{self._mark}"
        for file, inside in ((place / "__init__.py", [str(place)]), (place.with_name(f"{place.name}.py"), None)):
            if (content := self._contents.get(file)) is not None:
                loader = CapturedLoader(name, file, content)
                return spec_from_file_location(fullname, file, loader=loader, submodule_search_locations=inside)
        return None


def _is_asked_by_a_model() -> bool:
    """Whether the current import is in a model: imports in a library never refer to files next to a model."""
    frame: FrameType | None = sys._getframe(2)
    while frame is not None and str(frame.f_globals.get("__name__")).partition(".")[0] == "importlib":
        frame = frame.f_back
    return frame is not None and str(frame.f_globals.get("__name__")).startswith(USER)


class _Packages(MetaPathFinder):
    """Finds the sources of packages that hold models, and of physics that these import.

    contents : what was read, by root and file.  A package that is imported anew is read anew.
    """

    def __init__(self) -> None:
        self.contents: dict[str, dict[Path, bytes]] = {}
        self._loading = 0

    def read(self, root: str, file: Path) -> bytes:
        """The content of a file, as it was when it was first asked for."""
        known = self.contents.setdefault(root, {})
        if file not in known:
            known[file] = file.read_bytes()
        return known[file]

    def data(self, root: str, contents: Mapping[Path, bytes], read: Collection[Path]) -> dict[Path, bytes]:
        """These contents of a model's data; of what modules in memory have read and was given before, that of then."""
        known = self.contents.setdefault(root, {})
        known |= {file: content for file, content in contents.items() if not (file in read and file in known)}
        return {file: known[file] for file in contents}

    @contextmanager
    def loading(self, root: str) -> Iterator[None]:
        """Within, a model of package `root` is imported, with physics from wherever it comes."""
        if self not in sys.meta_path:
            sys.meta_path.insert(0, self)
        self.contents.setdefault(root, {})
        self._loading += 1
        try:
            yield
        finally:
            self._loading -= 1

    def find_spec(self, fullname: str, path: Any = None, target: ModuleType | None = None) -> ModuleSpec | None:
        root = fullname.partition(".")[0]
        if root == _ENGINE or not (root in self.contents or (self._loading and root not in sys.stdlib_module_names)):
            return None
        if fullname not in sys.modules and path is None and root in self.contents:
            self.contents[root] = {}
        spec = find_elsewhere(self, fullname, path)
        if spec is None or spec.origin is None:
            return None
        if root in self.contents and isinstance(spec.loader, SourcelessFileLoader):
            raise ImportError(f"{fullname} is bytecode without its source", name=fullname)
        if type(spec.loader) is not SourceFileLoader:
            return None
        file = Path(spec.origin)
        if root not in self.contents and _ENGINE.encode() not in file.read_bytes():
            return None
        spec.loader = CapturedLoader(fullname, file, self.read(root, file))
        return spec


def find_elsewhere(asking: Any, fullname: str, path: Sequence[str] | None) -> ModuleSpec | None:
    """What the first finder but the one that asks says of a module."""
    others = (finder for finder in sys.meta_path if finder is not asking and hasattr(finder, "find_spec"))
    return next((spec for finder in others if (spec := finder.find_spec(fullname, path)) is not None), None)


def find_unimported(reference: str) -> ModuleSpec | None:
    """Where a module is, None if nowhere.  Nothing is imported, not even the packages that it is in."""
    top, *inner = reference.split(".")
    spec = find_elsewhere(PACKAGES, top, None)
    for name in inner:
        if spec is None or spec.submodule_search_locations is None:
            return None  # a module that is no package has nothing in it
        # without the names of its packages: a namespace package asks for the import of those that it is in
        spec = PathFinder.find_spec(name, list(spec.submodule_search_locations))
    return spec


PACKAGES = _Packages()
