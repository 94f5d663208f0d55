"""The contents of a report as plain data: sections of texts, tables and figures, in reading order.

Built once by `contents`, rendered by `html`, `pdf` and `markdown`.  All strings are plain text, which the renderers
escape.  A document contains no control characters and no characters that reorder or hide text.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, fields, is_dataclass, replace
from itertools import count
from string import ascii_uppercase
from typing import Any

import numpy as np

from mc_engine.text import clean
from reports.drawing.marks import Drawing


@dataclass(frozen=True)
class Text:
    """Paragraphs; kind "plain", "warning", "heading" (within a section), "list" (its points) or "code" (its lines)."""

    paragraphs: tuple[str, ...]
    kind: str = "plain"


@dataclass(frozen=True)
class Terms:
    """A glossary: pairs of a term and its meaning."""

    entries: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Cell:
    """text, with a number to sort by; small stands under it; tone: "", "good", "bad" or "open".

    case : number of the case that the cell names; a page that holds its history links to it.
    """

    text: str
    value: float | None = None
    small: str = ""
    tone: str = ""
    case: int | None = None


@dataclass(frozen=True)
class Column:
    """kind: "text", "name" (a column name), "code" or "number".

    grouped : of a first column, whether equal cells in consecutive rows are shown once.
    """

    title: str
    kind: str = "text"
    grouped: bool = False


@dataclass(frozen=True)
class Table:
    """A numbered table; rows hold one Cell per column."""

    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""
    number: int = 0


@dataclass(frozen=True)
class FigureBlock:
    """A numbered figure; size: "wide", "half", "small" or "matrix", the least width of a panel on the screen."""

    caption: str
    drawing: Drawing
    size: str = "wide"
    number: int = 0


Block = Text | Terms | Table | FigureBlock
Found = Iterable[Block | str | None]  # what the maker of a section finds to say


@dataclass(frozen=True)
class Section:
    """A titled part of the report; anchor is unique in it.

    kind : "chapter", "part" of the chapter before it, or "appendix".  number : 1, 2, ..., A, B, ..., none of a part.
    """

    anchor: str
    title: str
    blocks: tuple[Block, ...]
    kind: str = "chapter"
    number: str = ""


@dataclass(frozen=True)
class Card:
    """One line of the headline box: a label, its result, and a sentence on it."""

    label: str
    answer: str
    detail: str
    tone: str = ""


@dataclass(frozen=True)
class CaseColumn:
    """One column of `CaseData`: a number per case, NaN for none, or a word.

    role : "dispersion", "metric", or "place" for one that only figures show.
    """

    name: str
    label: str
    role: str
    values: np.ndarray | tuple[str, ...]


@dataclass(frozen=True)
class CaseData:
    """Cases in an interactive page: all, or those drawn in figures, the worst, and those that did not pass.

    outcome : per case an index into `outcomes`.  axes : names of the two columns that the figure of cases starts with.
    histories : by case, then quantity, its times and values; time, quantities : their labels; the nominal is case -1.
    """

    n_tried: int
    ids: np.ndarray
    outcome: np.ndarray
    outcomes: tuple[str, ...]
    columns: tuple[CaseColumn, ...]
    axes: tuple[str, str] | None
    time: str
    quantities: dict[str, str]
    histories: dict[int, dict[str, tuple[Any, Any]]]


@dataclass(frozen=True)
class Attachment:
    """A file that is written next to the report."""

    name: str
    content: bytes


@dataclass(frozen=True)
class Document:
    """The whole report.  created: ISO date and time, UTC, of the run (not of the report); kind: what stands above.

    data : the numbers of a run's report for programs, by the fields of `formats.json_data.ReportRecord`.
    """

    title: str
    subtitle: str
    created: str
    facts: tuple[tuple[str, str], ...]
    verdicts: tuple[Card, ...]
    costs: tuple[Card, ...]
    warnings: tuple[str, ...]
    sections: tuple[Section, ...] = field(default=())
    kind: str = "Monte Carlo dispersion report"
    question: str = "Verdict"
    files: tuple[Attachment, ...] = ()
    cases: CaseData | None = None
    data: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for member in fields(self):
            object.__setattr__(self, member.name, _cleaned(getattr(self, member.name)))


def _cleaned(value: Any) -> Any:
    """The value with all strings in it clean; the value itself where it holds none that is not."""
    if isinstance(value, str):
        return clean(value)
    if isinstance(value, float | int):  # of which there may be a hundred thousand
        return value
    if isinstance(value, dict):
        return {_cleaned(name): _cleaned(item) for name, item in value.items()}
    if isinstance(value, tuple | list):
        items = [_cleaned(item) for item in value]
        same = all(new is old for new, old in zip(items, value, strict=True))
        return value if same else type(value)(items)
    if is_dataclass(value) and not isinstance(value, type):
        held = {member.name: getattr(value, member.name) for member in fields(value)}
        changed = {name: new for name, old in held.items() if (new := _cleaned(old)) is not old}
        return replace(value, **changed) if changed else value
    return value


def numbered(said: Iterable[Section]) -> tuple[Section, ...]:
    """Sections of a document with their chapters, tables and figures numbered in reading order."""
    counts: dict[type, int] = {Table: 0, FigureBlock: 0}
    numbers = {"chapter": map(str, count(1)), "appendix": iter(ascii_uppercase)}
    sections = []
    for section in said:
        blocks: list[Block] = []
        for block in section.blocks:
            if isinstance(block, Table | FigureBlock):
                counts[type(block)] += 1
                block = replace(block, number=counts[type(block)])
            blocks.append(block)
        number = next(numbers[section.kind]) if section.kind in numbers else ""
        sections.append(replace(section, blocks=tuple(blocks), number=number))
    return tuple(sections)


def as_blocks(said: Found) -> tuple[Block, ...]:
    """Blocks without the absent ones; a sentence becomes a paragraph."""
    return tuple(Text((item,)) if isinstance(item, str) else item for item in said if item is not None)


def blocks_of(document: Document, kind: type) -> Iterator[Any]:
    """All blocks of one kind, in reading order."""
    for section in document.sections:
        yield from (block for block in section.blocks if isinstance(block, kind))
