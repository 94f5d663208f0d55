"""Markdown as sections of a report: headings, paragraphs, lists, pipe tables and code.

Emphasis is dropped and HTML stays text: a report's blocks are plain text, which every format writes safely.
A paragraph "Table: ..." before a table is its caption.
"""

from collections.abc import Callable, Iterator, Sequence

from markdown_it import MarkdownIt
from markdown_it.token import Token

from reports.document.blocks import Block, Cell, Column, Section, Table, Text

CAPTION = "Table:"
Placed = Callable[[str], list[Block] | None]  # what a paragraph stands for, if it is not text


def sections_of(source: str, placed: Placed, anchor: str) -> tuple[Section, ...]:
    """Sections of a Markdown text, one for each heading "# ...".

    placed : gives the blocks that a paragraph stands for, or None.  Raises ValueError, with the line first, for text
    before the first heading.
    """
    sections: list[tuple[str, list[Block]]] = []
    tokens = MarkdownIt("commonmark", {"html": False}).enable("table").parse(source)
    blocks = _Reader(tokens, placed)
    for block in blocks:
        if isinstance(block, str):
            sections.append((block, []))
        elif sections:
            sections[-1][1].append(block)
        else:
            raise ValueError(f"line {blocks.line}: text stands before the first heading; begin with “# Title”")
    return tuple(
        Section(f"{anchor}-{k}", title, tuple(blocks_of_section))
        for k, (title, blocks_of_section) in enumerate(sections, start=1)
    )


class _Reader:
    """Blocks in reading order; a heading "# ..." comes as its title.  line : where the last one began."""

    def __init__(self, tokens: Sequence[Token], placed: Placed):
        self.tokens = tokens
        self.placed = placed
        self.line = 1
        self._caption = ""

    def __iter__(self) -> Iterator[Block | str]:
        place = 0
        while place < len(self.tokens):
            token = self.tokens[place]
            end = _closing_token(self.tokens, place)
            self.line = token.map[0] + 1 if token.map else self.line
            yield from self._blocks(token, self.tokens[place:end])
            place = end

    def _blocks(self, token: Token, inside: Sequence[Token]) -> Iterator[Block | str]:
        texts = [_flat(item) for item in inside if item.type == "inline"]
        if token.type == "heading_open":
            yield texts[0] if token.tag == "h1" else Text((texts[0],), "heading")
        elif token.type == "paragraph_open":
            yield from self._paragraph(texts[0])
        elif token.type in ("bullet_list_open", "ordered_list_open"):
            yield Text(tuple(texts), "list")
        elif token.type in ("fence", "code_block"):
            yield Text((token.content.rstrip("\n"),), "code")
        elif token.type == "table_open":
            yield _pipe_table(inside, self._caption)
            self._caption = ""
        elif texts:  # a quotation
            yield Text(tuple(texts))

    def _paragraph(self, text: str) -> Iterator[Block]:
        blocks = self.placed(text)
        if blocks is not None:
            yield from blocks
        elif text.startswith(CAPTION):
            self._caption = text.removeprefix(CAPTION).strip()
        elif text:
            yield Text((text,))


def _closing_token(tokens: Sequence[Token], place: int) -> int:
    """Index after the token that closes the one at `place`."""
    level = 0
    for index in range(place, len(tokens)):
        level += tokens[index].nesting
        if level == 0:
            return index + 1
    return len(tokens)


def _flat(token: Token) -> str:
    """The text of an inline token, without emphasis; a link's address stands behind its text."""
    parts: list[str] = []
    address = ""
    for child in token.children or ():
        if child.type in ("text", "code_inline", "html_inline", "image"):
            parts.append(child.content)
        elif child.type in ("softbreak", "hardbreak"):
            parts.append(" ")
        elif child.type == "link_open":
            address = str(child.attrs.get("href", ""))
        elif child.type == "link_close" and "".join(parts[-1:]) != address:
            parts.append(f" ({address})")
    return "".join(parts).strip()


def _pipe_table(tokens: Sequence[Token], caption: str) -> Table:
    """A pipe table; a column that is aligned right holds numbers."""
    columns: list[Column] = []
    rows: list[list[Cell]] = []
    for token, inline in zip(tokens, [*tokens[1:], tokens[-1]], strict=True):
        if token.type == "th_open":
            kind = "number" if "right" in str(token.attrs.get("style", "")) else "text"
            columns.append(Column(_flat(inline), kind))
        elif token.type == "tr_open":
            rows.append([])
        elif token.type == "td_open":
            text = _flat(inline)
            rows[-1].append(Cell(text, _number(text)))
    return Table(caption or "Of this report’s own", tuple(columns), tuple(tuple(row) for row in rows if row))


def _number(text: str) -> float | None:
    """A number to sort by, as the report writes numbers."""
    try:
        return float(text.replace("\u202f", "").replace("−", "-"))
    except ValueError:
        return None
