"""The report typeset on A4 by typst: the same contents, vector figures, the same bytes every time."""

import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from datetime import datetime
from importlib.resources import as_file, files
from typing import Any
from unicodedata import category, east_asian_width

import typst

from mc_engine.errors import EngineError
from reports.document.blocks import Block, Document, FigureBlock, Table, Terms, Text
from reports.document.columns import spans, unbroken, widths
from reports.drawing import paper
from reports.drawing.pictures import fonts

NO_EAST_ASIAN = (
    "Chinese, Japanese and Korean characters are shown as boxes: the typeface of this PDF, DejaVu Sans, has none. The "
    "HTML report shows them."
)
KINDS = {Text: "text", Terms: "terms", Table: "table", FigureBlock: "figure"}


def render_pdf(document: Document) -> bytes:
    """The PDF.  Its creation date is that of the run."""
    return typeset(typst_input(document))


def typst_input(document: Document) -> str:
    """All that typst is given: its text as JSON strings, which it never reads as markup, and figures as SVG."""
    plain = _plain_document(document)
    content = json.dumps(plain, ensure_ascii=False, allow_nan=False)
    if any(category(sign) == "Lo" and east_asian_width(sign) in "WF" for sign in set(content)):
        plain["warnings"].append(NO_EAST_ASIAN)
        content = json.dumps(plain, ensure_ascii=False, allow_nan=False)
    return content


def typeset(content: str) -> bytes:
    """The PDF of a `typst_input`.  Other threads run meanwhile."""
    if time.time() < 0.0:  # typst asks for it, and panics
        raise EngineError("the clock of this computer stands before 1970, with which no PDF is made; set it")
    with as_file(files("reports").joinpath("templates")) as templates:
        return typst.compile(
            str(templates / "report.typ"),
            root=str(templates),
            font_paths=[fonts()],
            ignore_system_fonts=True,  # the machine's fonts must not change the pages
            sys_inputs={"report": content},
            format="pdf",
        )


def _plain_document(document: Document) -> dict[str, Any]:
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
                "kind": section.kind,
                "number": section.number,
                "blocks": list(_plain_blocks(section.blocks)),
            }
            for section in document.sections
        ],
    }


def _plain_blocks(blocks: Sequence[Block]) -> Iterator[dict[str, Any]]:
    """The blocks as plain data; two figures of one panel come side by side."""
    rest = list(blocks)
    while rest:
        block = rest.pop(0)
        if _lone(block) and rest and _lone(rest[0]):
            half = 0.5 * (paper.WIDTH - paper.GAP)
            yield {"kind": "pair", "figures": [_plain_block(block, half), _plain_block(rest.pop(0), half)]}
        else:
            yield _plain_block(block)


def _lone(block: Block) -> bool:
    return isinstance(block, FigureBlock) and len(block.drawing.plots) == 1 and not block.drawing.plots[0].x.ticks


def _plain_block(block: Block, width: float = paper.WIDTH) -> dict[str, Any]:
    if isinstance(block, FigureBlock):
        drawing = block.drawing
        key, *strips = paper.strips(drawing, width)
        body: dict[str, Any] = {"caption": block.caption, "alternative": drawing.alternative, "key": key}
        body["strips"] = strips
    else:
        block = unbroken(block) if isinstance(block, Table) else block
        body = asdict(block)
        body["style"] = body.pop("kind", "")  # of a text; "kind" says which block it is
        if isinstance(block, Table):
            body |= {"widths": widths(block), "spans": spans(block)}
    return {"kind": KINDS[type(block)], **body}


def _date(created: str) -> list[int] | None:
    """Year to second of an ISO time; None for one that cannot be read."""
    try:
        moment = datetime.fromisoformat(created)
    except ValueError:
        return None
    return [moment.year, moment.month, moment.day, moment.hour, moment.minute, moment.second]
