"""One figure as a picture file, typeset by typst."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import typst


def render_picture(svg: str, kind: Any) -> bytes:
    """One figure as PDF or PNG, on white."""
    page: Any = b'#set page(width: auto, height: auto, margin: 4pt)\n#image(bytes(sys.inputs.svg), format: "svg")'
    return typst.compile(
        page, font_paths=[fonts()], ignore_system_fonts=True, sys_inputs={"svg": svg}, format=kind, ppi=144.0
    )


def fonts() -> str:
    """The folder of the DejaVu typefaces, which come with matplotlib; found without importing it."""
    package = find_spec("matplotlib")
    return str(Path(str(package and package.origin)).parent / "mpl-data" / "fonts" / "ttf")
