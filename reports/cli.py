"""The work of `mc-engine report RUN...`: read the runs or tunings, build the contents, write the files."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from mc_engine.errors import UsageError
from mc_engine.store.derived_files import FIGURES, derived_files
from mc_engine.store.opening import open_store
from mc_engine.store.run_files import RARE_EVENT, TUNING, kind_of, path_of, readable
from reports.contents import build, titled
from reports.document.blocks import Attachment, Document
from reports.formats.html import render_html
from reports.formats.json_data import FILE as JSON
from reports.formats.json_data import render_json
from reports.formats.markdown import FILE, figure_files, render_markdown
from reports.formats.pdf import typeset, typst_input
from reports.run.flown import Flown
from reports.user_sections.sections import RunFacts, TemplateError, run_facts, with_own_sections

Rendering = Callable[[], list[Attachment]]  # the first file is the report, the others belong to it


def _html(document: Document) -> Rendering:
    return lambda: [Attachment("report.html", render_html(document))]


def _pdf(document: Document) -> Rendering:
    content = typst_input(document)  # at once: typst takes longest, and leaves the interpreter to the others
    return lambda: [Attachment("report.pdf", typeset(content))]


def _json(document: Document) -> Rendering:
    return lambda: [Attachment(JSON, render_json(document))]


def _markdown(document: Document) -> Rendering:
    return lambda: [Attachment(FILE, render_markdown(document)), *figure_files(document)]


FORMATS: dict[str, Callable[[Document], Rendering]] = {"html": _html, "pdf": _pdf, "md": _markdown, "json": _json}
USUAL = ("html", "pdf")


def write_reports(
    run_path: str | Path,
    formats: str | Sequence[str] = USUAL,
    template: str | Path | None = None,
    beside: Sequence[str | Path] = (),
) -> list[Path]:
    """Write reports in `formats`, and report.json, into the directory of a run, a tuning or a rare event.

    template : a file with the user's own sections; it sees this run and those of `beside`, see `user_sections`.
    Returns the paths of the reports and of the files that belong to them (a footprint's KML), but not of the figures of
    a Markdown report.  The contents are built once.  All files of a format appear together or not at all.
    """
    formats = (formats,) if isinstance(formats, str) else tuple(formats)
    if unknown := [name for name in formats if name not in FORMATS]:
        raise UsageError(f'"{unknown[0]}" is no format of a report; use {", ".join(FORMATS)}')
    path = path_of(run_path, "a report is made by the path of a run, and {} is none")
    document = _document(path, Path(template) if template else None, [Path(other) for other in beside])
    written, kept = [], derived_files(path)
    renderings = [FORMATS[name](document) for name in dict.fromkeys(formats)]
    with ThreadPoolExecutor() as pool:
        for files in pool.map(lambda render: render(), renderings):
            kept.write({file.name: file.content for file in files}, alone_in=FIGURES if files[1:] else None)
            written.append(path / files[0].name)
    if "json" not in formats:
        kept.write({JSON: render_json(document)})
    if document.files:
        kept.write({file.name: file.content for file in document.files})
    return written + [path / file.name for file in document.files]


def report(run_path: str | Path, format: str | None = None) -> list[Path]:
    """`write_reports` for one format, or for the page and the PDF without one."""
    return write_reports(run_path, format or USUAL)


def _document(path: Path, template: Path | None, beside: Sequence[Path]) -> Document:
    name, kind = readable(path.resolve().name), kind_of(path)
    if kind in (TUNING, RARE_EVENT) and template is not None:
        raise TemplateError(f"{path}: is a {kind}; a template speaks of runs")
    if kind == TUNING:  # loaded here, since most reports are of runs
        from mc_engine.studies.tuning_folder import open_tuning
        from reports.studies.tuning import build_tuning

        return build_tuning(open_tuning(path), name)
    if kind == RARE_EVENT:
        from mc_engine.studies.rare_event_folder import open_rare_event
        from reports.studies.rare_events import build_rare_event

        return build_rare_event(open_rare_event(path), name)
    run = open_store(path)
    document = build(run, name)
    if template is None:
        return document
    facts = run_facts(Flown(run, name), document.title)
    others = {other.resolve(): other for other in beside}
    runs = [facts if other == path.resolve() else _facts_of(other) for other in others] or [facts]
    return with_own_sections(document, template, facts, runs)


def _facts_of(path: Path) -> RunFacts:
    if (kind := kind_of(path)) in (TUNING, RARE_EVENT):
        raise TemplateError(f"{path}: is a {kind}; a template speaks of runs")
    flown = Flown(open_store(path), readable(path.name))
    return run_facts(flown, titled(flown))
