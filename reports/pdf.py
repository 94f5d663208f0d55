"""The report typeset on A4 by typst: the same contents, vector figures, the same bytes every time."""

import json
import time
from dataclasses import asdict
from datetime import datetime
from importlib.resources import as_file, files
from typing import Any

import matplotlib
import typst

from mc_engine.errors import EngineError
from reports.document import Block, Document, FigureBlock, Table, Terms, Text
from reports.pictures import Pictures

KINDS = {Text: "text", Terms: "terms", Table: "table", FigureBlock: "figure"}


def render_pdf(document: Document, pictures: Pictures | None = None) -> bytes:
    """The PDF.  Its creation date is that of the run.

    All text reaches typst as JSON strings, which it never reads as markup.
    """
    if time.time() < 0.0:  # typst asks for it, and panics
        raise EngineError("the clock of this computer stands before 1970, with which no PDF is made; set it")
    content = json.dumps(_plain(document, pictures or Pictures()), ensure_ascii=False, allow_nan=False)
    with as_file(files("reports").joinpath("templates")) as templates:
        return typst.compile(
            str(templates / "report.typ"),
            root=str(templates),
            font_paths=[matplotlib.get_data_path() + "/fonts/ttf"],
            ignore_system_fonts=True,  # the machine's fonts must not change the pages
            sys_inputs={"report": content},
            format="pdf",
        )


def _plain(document: Document, pictures: Pictures) -> dict[str, Any]:
    """The document as plain data, figures as SVG."""
    return {
        "kind": document.kind,
        "question": document.question,
        "title": document.title,
        "subtitle": document.subtitle,
        "date": _date(document.created),
        "facts": [list(fact) for fact in document.facts],
        "verdicts": [asdict(card) for card in document.verdicts],
        "costs": [asdict(card) for card in document.costs],
        "warnings": list(document.warnings),
        "sections": [
            {
                "title": section.title,
                "anchor": section.anchor,
                "blocks": [_block(block, pictures) for block in section.blocks],
            }
            for section in document.sections
        ],
    }


def _block(block: Block, pictures: Pictures) -> dict[str, Any]:
    if isinstance(block, FigureBlock):
        drawing = block.drawing
        body: dict[str, Any] = {
            "caption": block.caption,
            "alternative": drawing.alternative,
            "svg": pictures.svg(block),
        }
    else:
        body = asdict(block)
        body["style"] = body.pop("kind", "")  # of a text; "kind" says which block it is
    return {"kind": KINDS[type(block)], **body}


def _date(created: str) -> list[int] | None:
    """Year to second of an ISO time; None for one that cannot be read."""
    try:
        moment = datetime.fromisoformat(created)
    except ValueError:
        return None
    return [moment.year, moment.month, moment.day, moment.hour, moment.minute, moment.second]
