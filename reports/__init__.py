"""Reports of a run: one self-contained HTML page and one typeset PDF with the same contents.

Modules are imported when the names are first used, because the process that fills in a template needs hardly any.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from reports.cli import report, write_reports
    from reports.contents import build
    from reports.formats.html import render_html
    from reports.formats.pdf import render_pdf
    from reports.replays import replay_picture

_HOME = {
    "build": "contents",
    "render_html": "formats.html",
    "render_pdf": "formats.pdf",
    "replay_picture": "replays",
    "report": "cli",
    "write_reports": "cli",
}

__all__ = ["build", "render_html", "render_pdf", "replay_picture", "report", "write_reports"]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
