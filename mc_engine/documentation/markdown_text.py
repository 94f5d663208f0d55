"""Markdown from plain prose: docstrings and help texts, with nothing in them read as markup but `code`."""

import re
from collections.abc import Iterable, Sequence

_MARKUP = re.compile(r"([\\*_\[\]<>#|$~^{}!])")
_FENCE = "``````"


def escaped(text: str) -> str:
    """One line of prose; what stands between backticks is code."""
    pieces = re.split(r"(`[^`\n]+`)", text)
    line = "".join(
        piece if piece.startswith("`") and len(piece) > 1 else _MARKUP.sub(r"\\\1", piece) for piece in pieces
    )
    return re.sub(r"^(\s*)([-+]|\d+[.)])(?=\s)", r"\1\\\2", line)


def prose(docstring: str) -> str:
    """Paragraphs of a docstring; those set out in columns or steps keep their layout."""
    paragraphs = re.split(r"\n\s*\n", docstring.strip("\n"))
    return "\n\n".join(_block(paragraph) for paragraph in paragraphs if paragraph.strip())


def _block(paragraph: str) -> str:
    if paragraph.startswith(">>> "):
        return f"{_FENCE}pycon\n{paragraph}\n{_FENCE}"
    return f"{_FENCE}text\n{paragraph}\n{_FENCE}" if _is_set_out(paragraph) else _flowing(paragraph)


def _is_set_out(paragraph: str) -> bool:
    lines = paragraph.split("\n")
    if any(re.match(r"\S.* : ", line) for line in lines):
        return False
    columns = sum(bool(re.search(r"\S {3,}\S", line)) for line in lines)
    return all(line.startswith("    ") for line in lines) or columns > 0 or any(line[:1] == " " for line in lines)


def _flowing(paragraph: str) -> str:
    """Running text, and a list in which each line that begins with the name of an argument begins an item."""
    text: list[str] = []
    items: list[str] = []
    for line in paragraph.split("\n"):
        if _begins_item(line):
            items.append(f"- {escaped(line.strip())}")
        elif items:
            items[-1] += " " + escaped(line.strip())
        else:
            text.append(escaped(line.strip()))
    return "\n".join([*text, *[""] * bool(text and items), *items])


def _begins_item(line: str) -> bool:
    """Whether it begins with a name and " : ", unlike a name behind a sentence, which is running text."""
    name, colon, _ = line.partition(" : ")
    return bool(colon) and not line.startswith(" ") and not re.search("[.;:] ", name)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A pipe table; cells are Markdown already."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(" ".join(cell.split()) for cell in line) + " |" for line in lines)


def code(text: str) -> str:
    """Text as code within a table's cell."""
    return f"`{text}`".replace("|", "\\|") if text else ""
