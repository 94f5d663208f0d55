"""The report as Markdown (CommonMark with pipe tables), its figures as SVG files in a folder beside it."""

import re
from collections.abc import Iterable, Iterator

from mc_engine.store.derived_files import FIGURES
from reports.document.blocks import (
    Attachment,
    Block,
    Card,
    Cell,
    Column,
    Document,
    FigureBlock,
    Section,
    Table,
    Terms,
    Text,
    blocks_of,
)
from reports.drawing import paper
from reports.text.markdown_text import SPACE, escaped

FILE = "report.md"
MARKS = {"good": "✓ ", "bad": "✗ ", "open": "? "}


def render_markdown(document: Document) -> bytes:
    """The text, UTF-8; `figure_files` are the pictures that it shows."""
    lines = [*_head_lines(document), *_contents_lines(document.sections)]
    for section in document.sections:
        lines += [f"{'###' if section.kind == 'part' else '##'} {escaped(_titled(section))}", ""]
        for block in section.blocks:
            lines += [*_block_lines(block), ""]
    return ("\n".join(lines).rstrip() + "\n").encode("utf-8")


def figure_files(document: Document) -> Iterator[Attachment]:
    """The figures on white, since a reader in dark mode would not see black lines."""
    for block in blocks_of(document, FigureBlock):
        svg = paper.svg(block.drawing)
        ground = re.sub(r"(<svg [^>]*>)", r'\1<rect width="100%" height="100%" fill="#ffffff"/>', svg, count=1)
        yield Attachment(f"{FIGURES}/{_figure_file(block)}", ground.encode("utf-8"))


def code(text: str) -> str:
    """A code span; text with a backtick of its own stays plain."""
    line = SPACE.sub(" ", text).strip()
    if not line:
        return ""
    return escaped(line) if "`" in line or "\\" in line else "`" + line.replace("|", "\\|") + "`"


def _head_lines(document: Document) -> Iterator[str]:
    yield from (f"# {escaped(document.title)}", "", escaped(document.kind), "")
    for what, text in document.facts:
        yield f"- {escaped(what)}: {escaped(text)}"
    yield from ("", f"**{escaped(document.subtitle)}**", "")
    for warning in document.warnings:
        yield from (f"> {escaped(warning)}", "")
    yield from _card_lines(document.question, document.verdicts)
    yield from _card_lines("Key results", document.costs)


def _card_lines(title: str, cards: Iterable[Card]) -> Iterator[str]:
    lines = [f"- {escaped(card.label)}: **{MARKS.get(card.tone, '')}{escaped(card.answer)}**. {escaped(card.detail)}"
             for card in cards]  # fmt: skip
    if lines:
        yield from (f"**{title}**", "", *lines, "")


def _contents_lines(sections: Iterable[Section]) -> Iterator[str]:
    yield from ("**Contents**", "")
    for section in sections:
        place = re.sub(r"[^\w\- ]", "", _titled(section).lower()).replace(" ", "-")
        yield f"{'  ' * (section.kind == 'part')}- [{escaped(_titled(section))}](#{place})"
    yield ""


def _titled(section: Section) -> str:
    """A section's title with its number, if it has one."""
    word = "Appendix " if section.kind == "appendix" else ""
    return f"{word}{section.number} {section.title}".strip()


def _block_lines(block: Block) -> list[str]:
    if isinstance(block, FigureBlock):
        picture = f"![{escaped(block.drawing.alternative)}]({FIGURES}/{_figure_file(block)})"
        return [picture, "", f"**Figure {block.number}.** {escaped(block.caption)}"]
    if isinstance(block, Table):
        return _table_lines(block)
    if isinstance(block, Terms):
        return [f"- **{escaped(term)}**: {escaped(meaning)}" for term, meaning in block.entries]
    assert isinstance(block, Text)
    if block.kind == "list":
        return [f"- {escaped(item)}" for item in block.paragraphs]
    if block.kind == "code":
        return [f"    {line}" for text in block.paragraphs for line in text.splitlines()]
    before = {"heading": "### ", "warning": "> "}.get(block.kind, "")
    return "\n\n".join(before + escaped(paragraph) for paragraph in block.paragraphs).split("\n")


def _figure_file(block: FigureBlock) -> str:
    return f"figure-{block.number}.svg"


def _table_lines(block: Table) -> list[str]:
    head = " | ".join(escaped(column.title) for column in block.columns)
    rule = " | ".join("---:" if column.kind == "number" else "---" for column in block.columns)
    rows = [" | ".join(map(_cell_text, row, block.columns)) for row in block.rows]
    note = ["", escaped(block.note)] if block.note else []
    lines = [f"| {line} |" for line in (head, rule, *rows)]
    return [f"**Table {block.number}.** {escaped(block.caption)}", "", *lines, *note]


def _cell_text(cell: Cell, column: Column) -> str:
    text = code(cell.text) if column.kind in ("code", "name") else escaped(cell.text)
    if cell.tone:
        text = f"**{MARKS[cell.tone]}{text}**"
    small = escaped(cell.small)
    if small and text:
        return f"{text} {small}" if cell.small.startswith(("(", "[")) else f"{text} ({small})"
    return text or small
