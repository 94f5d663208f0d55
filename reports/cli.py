"""What `mc-engine report RUN...` does: read the runs or tunings, build the contents, write the files."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from mc_engine.durable_file import make_folder, temporary_name, write_durably
from mc_engine.rare_event_folder import is_rare_event_directory, open_rare_event
from mc_engine.store import open_store
from mc_engine.tuning_folder import is_tuning_directory, open_tuning
from reports.contents import build, titled
from reports.document import Attachment, Document
from reports.flown import Flown
from reports.html import render_html
from reports.markdown import FILE, FOLDER, figure_files, render_markdown
from reports.pdf import render_pdf
from reports.pictures import Pictures
from reports.rare_events import build_rare_event
from reports.tuning import build_tuning
from reports.user_sections import RunFacts, TemplateError, run_facts, with_own_sections


def _html(document: Document, pictures: Pictures) -> list[Attachment]:
    return [Attachment("report.html", render_html(document))]


def _pdf(document: Document, pictures: Pictures) -> list[Attachment]:
    return [Attachment("report.pdf", render_pdf(document, pictures))]


def _markdown(document: Document, pictures: Pictures) -> list[Attachment]:
    return [Attachment(FILE, render_markdown(document)), *figure_files(document, pictures)]


# The first file of each is the report, the others belong to it.
FORMATS: dict[str, Callable[[Document, Pictures], list[Attachment]]] = {"html": _html, "pdf": _pdf, "md": _markdown}
USUAL = ("html", "pdf")


def write_reports(
    run_path: str | Path,
    formats: Sequence[str] = USUAL,
    template: str | Path | None = None,
    beside: Sequence[str | Path] = (),
) -> list[Path]:
    """Write report.html, report.pdf and report.md (those asked for) into the directory of a run or tuning.

    template : a file with sections of the user's own; it sees this run and those of `beside`, see `user_sections`.
    Returns the paths of the reports and of files that belong to them (a footprint's KML), not of a Markdown report's
    figures.  The contents are built once.  Every file appears whole or not at all.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        raise ValueError(f'"{unknown[0]}" is no format of a report; use {", ".join(FORMATS)}')
    path = Path(run_path)
    document = _document(path, Path(template) if template else None, [Path(other) for other in beside])
    pictures, written = Pictures(), []
    for name in dict.fromkeys(formats):
        files = FORMATS[name](document, pictures)
        _remove_stale(path, _write_all(path, files[1:]))
        written += _write_all(path, files[:1])
    return written + _write_all(path, document.files)


def report(run_path: str | Path, format: str | None = None) -> list[Path]:
    """`write_reports` for one format, or for the page and the PDF without one."""
    return write_reports(run_path, (format,) if format else USUAL)


def _document(path: Path, template: Path | None, beside: Sequence[Path]) -> Document:
    name = path.resolve().name
    if is_tuning_directory(path):
        if template is not None:
            raise TemplateError(f"{path}: is a tuning; a template speaks of runs")
        return build_tuning(open_tuning(path), name)
    if is_rare_event_directory(path):
        if template is not None:
            raise TemplateError(f"{path}: is a rare event; a template speaks of runs")
        return build_rare_event(open_rare_event(path), name)
    run = open_store(path)
    document = build(run, name)
    if template is None:
        return document
    facts = run_facts(Flown(run, name), document.title)
    others = {other.resolve(): other for other in beside}
    runs = [facts if other == path.resolve() else _facts(other) for other in others] or [facts]
    return with_own_sections(document, template, facts, runs)


def _facts(path: Path) -> RunFacts:
    if is_tuning_directory(path):
        raise TemplateError(f"{path}: is a tuning; a template speaks of runs")
    flown = Flown(open_store(path), path.name)
    return run_facts(flown, titled(flown))


def _remove_stale(path: Path, figures: Sequence[Path]) -> None:
    """Take away the figures of an earlier Markdown report that this one does not have."""
    for file in (path / FOLDER).glob("figure-*.svg") if figures else ():
        if file not in figures:
            file.unlink()


def _write_all(path: Path, files: Iterable[Attachment]) -> list[Path]:
    return [_write(path / file.name, file.content) for file in files]


def _write(path: Path, content: bytes) -> Path:
    """Write one file, whole or not at all; DiskError or StoreError names it."""
    make_folder(path.parent)
    try:
        write_durably(path, content)
    except KeyboardInterrupt:
        temporary_name(path).unlink(missing_ok=True)  # of a full disk it is gone already
        raise
    return path
