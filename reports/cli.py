"""What `mc-engine report RUN [--format html|pdf]` does: read the run or tuning, build the contents, write the files."""

from collections.abc import Callable, Sequence
from pathlib import Path

from mc_engine.store import open_store
from mc_engine.tuning_folder import is_tuning_directory, open_tuning
from reports.contents import build
from reports.document import Document
from reports.html import render_html
from reports.pdf import render_pdf
from reports.tuning import build_tuning

RENDERERS: dict[str, Callable[[Document], bytes]] = {"html": render_html, "pdf": render_pdf}


def write_reports(run_path: str | Path, formats: Sequence[str] = ("html", "pdf")) -> list[Path]:
    """Write report.html and report.pdf (those asked for) into the directory of a run or tuning; returns their paths.

    The contents are built once, and files that belong to them (a footprint's KML) are written besides.  Every file
    appears whole or not at all.
    """
    unknown = [name for name in formats if name not in RENDERERS]
    if unknown:
        raise ValueError(f'"{unknown[0]}" is no format of a report; use {" or ".join(RENDERERS)}')
    path = Path(run_path)
    name = path.resolve().name
    document = build_tuning(open_tuning(path), name) if is_tuning_directory(path) else build(open_store(path), name)
    pages = [_write(path / f"report.{name}", RENDERERS[name](document)) for name in dict.fromkeys(formats)]
    return pages + [_write(path / file.name, file.content) for file in document.files]


def report(run_path: str | Path, format: str | None = None) -> list[Path]:
    """`write_reports` for one format, or for both without one."""
    return write_reports(run_path, (format,) if format else tuple(RENDERERS))


def _write(path: Path, content: bytes) -> Path:
    # A hidden neighbour first, so that a reader never sees half a report.
    unfinished = path.with_name(f".{path.name}.unfinished")
    unfinished.write_bytes(content)
    unfinished.replace(path)
    return path
