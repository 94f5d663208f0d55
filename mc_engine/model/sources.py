"""The source files of a model, on which its results depend: those of its package or folder, and what they import.

The list may hold files that the model does not need.  Each file is read once: the same content is run, digested, and
kept in the run directory.
"""

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from types import ModuleType

from mc_engine.errors import ModelError
from mc_engine.lanes.physics_function import PhysicsFunction
from mc_engine.model.files import FileFault, resolve_beside, sources_in
from mc_engine.model.imports import PACKAGES, USER, CapturedLoader, importable, new_module
from mc_engine.model.syntax_tree import curve_files, data_names, imported_names

_ENGINE = "mc_engine"  # its own sources are counted apart


@dataclass(frozen=True)
class Sources:
    """A model's module and the files that it was made of, as they were read.

    home : folder that the names of the files begin in.  folder : the model's own.  data : contents of the files that
    model(..., data=...) names and of those that curves are read from, as they were before the import.
    elsewhere : texts of the modules with physics that a user's file imports from other folders, by their names.
    """

    module: ModuleType
    home: Path
    folder: Path
    files: Mapping[Path, bytes]
    data: Mapping[Path, bytes]
    elsewhere: Mapping[str, bytes] = field(default_factory=dict)

    def named(self) -> Iterator[tuple[str, bytes]]:
        """Names, such as "lib/guidance.py", and contents in a fixed order."""
        yield from _named({**self.files, **self.data}, self.home)

    def with_data(self, names: Sequence[str], read: Iterable[Path]) -> "Sources":
        """The same with the data of the model itself; ModelError for a name that is wrong.

        read : files that its curves were read from; each must stand in a call of `curve` or `surface`.

        The model opens its data itself while it is imported.  What lay there before the import and lies there after it
        is what the model has read.
        """
        try:
            paths = {resolve_beside(self.folder, name, "the model"): name for name in names}
        except FileFault as fault:
            raise ModelError(f"data: {fault}") from None
        for path, name in paths.items():
            if path not in self.data:
                raise ModelError(f'data: write "{name}" into the call itself, as in model(..., data=("{name}",))')
        for path in _curves_beside(self.files):
            paths.setdefault(path, path.name)
        for path in read:
            if path.resolve() not in map(Path.resolve, paths):
                raise ModelError(f'write "{path.name}" into the call of `curve` or `surface` itself, not as a variable')
        for path, name in paths.items():
            if _content(path) != self.data.get(path):
                changed = f'data: "{name}" was changed while the model was loaded'
                raise ModelError(f"{changed}; begin again in a new Python process")
        return replace(self, data={path: self.data[path] for path in paths})


_OF_FILES: dict[str, Sources] = {}  # by the name of the module
_NAMED: dict[str, list[tuple[str, bytes]]] = {}  # sources and data of a user's file, by the mark in that name


def sources_of_file(path: Path) -> Sources:
    """Import a user's file under a name that depends on its text and data, so that an edited file is a new module.

    The files and packages beside it can be imported, and count as its text.
    """
    files = sources_beside(path)
    data = _data_in(path.parent, files)
    texts = (f"{file}\n{len(text)}\n".encode() + text for file, text in {**files, **data}.items())
    mark = sha256(str(path).encode() + b"".join(texts)).hexdigest()[:12]
    name = f"{USER}{path.stem}_{mark}"
    if name not in _OF_FILES:
        _NAMED[mark] = list(_named({**files, **data}, path.parent))
        with importable(path.parent, mark, files):
            module = new_module(name, path, files[path])
            _OF_FILES[name] = Sources(module, path.parent, path.parent, files, data, _elsewhere(mark))
    return _OF_FILES[name]


def made_of(module: str) -> list[tuple[str, bytes]]:
    """Names and contents of the sources and data of a loaded module and its package or folder, as they were read."""
    if module.startswith(USER):
        mark = module.rpartition("_")[2]
        return [*_NAMED[mark], *_elsewhere(mark).items()]
    return list(sources_of_module(module, Path(str(sys.modules[module].__file__)).parent).named())


def _elsewhere(mark: str) -> dict[str, bytes]:
    """Texts of the modules with physics that a user's file, and those beside it, import from other folders."""
    own = [name for name in [*sys.modules] if name.startswith(USER) and name.endswith(f"_{mark}")]
    reached = _deciding(own).items()
    return {name: text for name, text in reached if not sys.modules[name].__name__.startswith(USER)}


def _named(contents: Mapping[Path, bytes], home: Path) -> Iterator[tuple[str, bytes]]:
    for path in sorted(contents):
        yield path.relative_to(home).as_posix() if path.is_relative_to(home) else path.name, contents[path]


_STUB = """from pathlib import Path
from mc_engine.model.sources import sources_of_file
sources_of_file(Path({file!r}))
"""


def leave_importable(sources: Sources | None, folder: Path) -> None:
    """Let spawned processes import a user's file, and those next to it, by the names that they have in this one.

    folder : made for that, and put at the end of the import path, which the new processes take over.
    """
    if sources is None or not sources.module.__name__.startswith(USER):
        return  # a module that is installed is found by them, too
    folder.mkdir()
    for name in [name for name in sys.modules if name.startswith(USER)]:
        (folder / f"{name}.py").write_text(_STUB.format(file=str(sources.module.__file__)), encoding="utf-8")
    sys.path.append(str(folder))


def _data_in(folder: Path, sources: Mapping[Path, bytes]) -> dict[Path, bytes]:
    """Contents of the files that calls of `model` in these sources name as their data, and of those that their curves
    are read from; what cannot be read is left out."""
    names = sorted({name for source in sources.values() for name in data_names(source)})
    return {**_curves_beside(sources), **_files_named(names, folder)}


def _data_of(sources: Mapping[Path, bytes]) -> dict[Path, bytes]:
    """Contents of the data and curves that these sources name, from the folder of each."""
    data = _curves_beside(sources)
    for file, source in sources.items():
        data |= _files_named(data_names(source), file.parent)
    return data


def _curves_beside(sources: Mapping[Path, bytes]) -> dict[Path, bytes]:
    """Contents of the files, named from the folder of each source, that its curves and surfaces are read from."""
    contents: dict[Path, bytes] = {}
    for file, source in sources.items():
        contents |= _files_named(curve_files(source), file.parent)
    return dict(sorted(contents.items()))


def _files_named(names: Iterable[str], folder: Path) -> dict[Path, bytes]:
    """Contents of the files of these names, from a folder; what cannot be read is left out."""
    contents = {}
    for name in names:
        with suppress(FileFault):
            path = resolve_beside(folder, name)
            if (content := _content(path)) is not None:
                contents[path] = content
    return contents


def sources_beside(file: Path) -> dict[Path, bytes]:
    """Sources of a model that is a file: all Python files next to it, and whole folders there that they import."""
    contents = {**_contents(file.parent.glob("*.py")), file: file.read_bytes()}
    waiting, seen = [file], set[str]()
    while waiting:
        for root in {name.split(".")[0] for name in imported_names(contents[waiting.pop()])} - seen - {""}:
            seen.add(root)
            package = _contents(sources_in(file.parent / root))
            contents |= package
            waiting += [*package, *([beside] if (beside := file.parent / f"{root}.py") in contents else [])]
    return dict(sorted(contents.items()))


def _contents(paths: Iterable[Path]) -> dict[Path, bytes]:
    return {path: content for path in paths if (content := _content(path)) is not None}


def _content(path: Path) -> bytes | None:
    """None where it cannot be read: a pipe or a folder of such a name is no source."""
    try:
        return path.read_bytes() if path.is_file() else None
    except OSError:
        return None


def sources_of_module(name: str, folder: Path) -> Sources:
    """Import a module with its model: its folder, and what it reaches of its package or of other physics.

    What a program has imported before, by itself, counts as what its files say now.
    """
    root = name.partition(".")[0]
    data, before = _data_in(folder, _contents(folder.glob("*.py"))), {*sys.modules}
    with PACKAGES.loading(root):
        module = import_module(name)
    assert module.__file__ is not None  # a model's module always comes from a file
    home = Path(module.__file__)
    inside_package = home.name == "__init__.py" or "." in name
    beside = home.parent.rglob("*.py") if inside_package else home.parent.glob("*.py")
    contents = {path: PACKAGES.read(root, path) for path in beside if path.is_file()}
    reached = _deciding([name])
    contents |= {_file_of(known): text for known, text in reached.items()}
    loaded = {_file_of(known) for known in (name, *reached) if known in before}
    read = _data_of({file: text for file, text in contents.items() if file in loaded})
    data = PACKAGES.data(root, {**_data_of(contents), **data}, read)
    base = home.parents[name.count(".") + (home.name == "__init__.py")]
    return Sources(module, base, folder, contents, data)


def _modules_imported_by(name: str) -> list[str]:
    """Modules, by name, that a loaded one imports."""
    module = sys.modules[name]
    package = module.__name__ if hasattr(module, "__path__") else module.__name__.rpartition(".")[0]
    return [imported for imported in imported_names(_text_of_module(name), package) if imported in sys.modules]


def _text_of_module(name: str) -> bytes:
    """What a loaded module was made of."""
    module = sys.modules[name]
    loader = getattr(module, "__loader__", None)
    if isinstance(loader, CapturedLoader):
        return loader.content
    return PACKAGES.read(name.partition(".")[0], Path(str(module.__file__)))


def _deciding(models: list[str]) -> dict[str, bytes]:
    """Texts of the modules that may decide the numbers of loaded ones, which import them at first or second hand."""
    waiting, seen, texts = [*models], {*models}, dict[str, bytes]()
    while waiting:
        importing = waiting.pop()
        for reached in _modules_imported_by(importing):
            if reached not in seen and _decides(reached, importing):
                seen.add(reached)
                waiting.append(reached)
                texts[reached] = _text_of_module(reached)
    return dict(sorted(texts.items()))


def _file_of(name: str) -> Path:
    return Path(str(sys.modules[name].__file__))


def _decides(name: str, importing: str) -> bool:
    """Whether a module may decide the numbers of one that imports it: of the same package, or with physics in it."""
    module, root = sys.modules[name], name.split(".")[0]
    if root == _ENGINE or not str(getattr(module, "__file__", None)).endswith(".py"):
        return False
    return root == importing.split(".")[0] or any(isinstance(value, PhysicsFunction) for value in vars(module).values())
