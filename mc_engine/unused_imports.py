"""What the import of SciPy brings along and no command uses: loaded when something in it is used."""

import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import LazyLoader
from types import ModuleType

# SciPy names all parts of NumPy, and some of them take longer to load than what it needs
_UNUSED = ("numpy.ctypeslib", "numpy.f2py", "numpy.polynomial", "numpy.testing")


def leave_out_unused() -> None:
    """From now on in this process, import the unused parts only when something in them is used."""
    sys.meta_path.insert(0, _Unused)


class _Unused:
    """A finder as in `sys.meta_path`."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        spec = PathFinder.find_spec(name, path, target) if name in _UNUSED else None
        if spec is not None and spec.loader is not None:
            spec.loader = LazyLoader(spec.loader)
        return spec
