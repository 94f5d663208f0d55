"""Widths of the columns of a printed table, chosen so that its rows take as few lines as possible."""

import re
from dataclasses import replace
from functools import lru_cache

import numpy as np

from reports.document.blocks import Cell, Column, Table
from reports.drawing import lettering
from reports.drawing.lettering import BOLD, TYPE

ROOM = 490.0  # points that a table has
INSET = 7.0  # of a column, both sides together
JUMPS = (4.0, 8.0, 16.0, 32.0, 64.0, 128.0)  # points that a column may get at a time
MONO = 0.602  # of the type size, the width of every letter of a column's name
BADGE = 18.0  # mark and margins of a verdict
_WORD = re.compile(
    r"\[[^\]]{1,22}\]|[^ \n_/-]*\d\u202f[^ \n]+ ?|[^ \n_/-]*[ \n_/-]?"
)  # not broken: a word, an interval
_VALUE = re.compile(r"[^ ]+ ?")  # of a column of numbers: with its unit, such as m/s
# Spaces within an interval and within used / tried: all of them, or all but the one before the stroke.
_JOINED = re.compile(r"(?<=,) | (?=/ )|(?<=/) "), re.compile(r"(?<=,) |(?<=/) ")
NO_BREAK = "\N{NO-BREAK SPACE}"
COMMAND = 36  # letters of a command that is not broken
SLACK = 1.06  # of a text over its lines: a line seldom ends at the edge


def unbroken(table: Table) -> Table:
    """The table with the intervals and counts in its columns of numbers on one line each, where the page has the room.

    A count is broken before its stroke where the table takes fewer lines so.
    """
    joined = [_joined(table, spaces) for spaces in _JOINED]
    measured = [(variant, *_sizes(variant)) for variant in joined]
    found = [(_printed_lines(size, least), variant) for variant, size, least in measured if _page_width(least) < ROOM]
    return min(found, key=lambda lines_and_table: lines_and_table[0], default=(0.0, table))[1]


def _joined(table: Table, spaces: re.Pattern[str]) -> Table:
    """The table with these spaces in its columns of numbers made unbreakable."""
    numbers = [column.kind == "number" for column in table.columns]
    rows = tuple(
        tuple(
            replace(cell, text=spaces.sub(NO_BREAK, cell.text)) if is_number else cell
            for is_number, cell in zip(numbers, cells, strict=True)
        )
        for cells in table.rows
    )
    return replace(table, rows=rows)


def _page_width(columns: np.ndarray) -> float:
    """Width of the page that columns of these widths take, with their insets."""
    return float(columns.sum() + INSET * len(columns))


def _printed_lines(size: np.ndarray, least: np.ndarray) -> float:
    """Lines that the rows of a table take, of which these are the `_sizes`."""
    return float(_lines(size, np.array(_widths(size, least)) - INSET).max(axis=1).sum())


def _sizes(table: Table) -> tuple[np.ndarray, np.ndarray]:
    """Widths of all texts, float64[n_rows, n_columns, 2], and of the longest word of each column."""
    shape = (len(table.rows) + 1, len(table.columns), 2)  # the head is a row, and a cell has its text and a small one
    size, least = np.zeros(shape), np.zeros(len(table.columns))
    room = [1.0, *(max(0.5 * rows, 1.0) if rows else np.inf for rows in spans(table))]  # of all rows of a cell
    for k, column in enumerate(table.columns):
        for row, cell in enumerate((Cell(column.title.replace("_", " ")), *(cells[k] for cells in table.rows))):
            for part, text in enumerate((cell.text, cell.small)):
                scale = _scale(column, text) if part == 0 and row else 1.0 if row else BOLD
                size[row, k, part] = _width(text) * scale + BADGE * bool(cell.tone and part == 0)
                size[row, k, part] /= room[row] if k == 0 else 1.0
                words = (
                    [text]
                    if (cell.tone and not part) or (column.kind == "code" and len(text) <= COMMAND)
                    else (_VALUE if column.kind == "number" and row and not part else _WORD).findall(text)
                )
                longest = max(map(_width, words), default=0.0)
                least[k] = max(least[k], longest * scale + BADGE * bool(cell.tone and part == 0))
    return size, least


@lru_cache(maxsize=10_000)
def _width(text: str) -> float:
    """Width of one line of the page's type; the same words stand in many cells."""
    return lettering.width(text, TYPE)


def widths(table: Table) -> list[float]:
    """Width of each column in points, together that of the page: longest words first, then where it saves lines."""
    return _widths(*_sizes(table))


def _widths(size: np.ndarray, least: np.ndarray) -> list[float]:
    if _page_width(least) >= ROOM:
        return list((least + INSET) * ROOM / (least + INSET).sum())
    width = least.copy()
    while (left := ROOM - INSET * len(width) - width.sum()) > JUMPS[0]:
        lines = _lines(size, width)
        others = [np.delete(lines, k, axis=1).max(axis=1, initial=1.0) for k in range(len(width))]
        jumps = [jump for jump in JUMPS if jump <= left]
        fewer = [_lines(size, width + jump) for jump in jumps]
        saved = _saved(lines, np.stack(others, axis=1), np.stack(fewer)).tolist()
        gain, k, jump = max(
            (saved[row][k] / jump, k, jump) for row, jump in enumerate(jumps) for k in range(len(width))
        )
        if not gain:
            break
        width[k] += jump
    return list(width * ((ROOM - INSET * len(width)) / width.sum()) + INSET)


def spans(table: Table) -> list[int]:
    """How many rows the first cell of each row stands for, 0 where that of a row above does."""
    cells = [row[0] for row in table.rows]
    starts = [k for k, cell in enumerate(cells) if not (table.columns[0].grouped and k and cell == cells[k - 1])]
    lengths = dict(zip(starts, np.diff([*starts, len(cells)]).tolist(), strict=True))
    return [lengths.get(k, 0) for k in range(len(cells))]


def _lines(size: np.ndarray, width: np.ndarray) -> np.ndarray:
    """Lines float64[n_rows, n_columns] that texts of these sizes take, the small ones under the others."""
    return np.ceil(SLACK * size / (width[:, None] + 0.01)).sum(axis=-1)


def _saved(lines: np.ndarray, others: np.ndarray, fewer: np.ndarray) -> np.ndarray:
    """Lines of all rows that each column saves which takes fewer, and something for those that another still takes.

    lines : float64[n_rows, n_columns].  others : of them the most in any other column.  fewer : float64[..., n_rows,
    n_columns].  Returns float64[..., n_columns].
    """
    rows = np.maximum(lines, others) - np.maximum(fewer, others)
    return np.asarray(rows.sum(axis=-2) + 0.15 * (lines - fewer).sum(axis=-2))


def _scale(column: Column, text: str) -> float:
    """Ratio of a column's type width to that of the page's body text."""
    plain = _width(text)
    return len(text) * MONO * TYPE / plain if column.kind in ("code", "name") and plain else 1.0
