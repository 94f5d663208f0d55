"""Widths and line breaks of text in DejaVu Sans, estimated before the typesetter sets it.  All lengths are points."""

import re
from collections.abc import Iterator, Sequence
from xml.sax.saxutils import escape

from reports.drawing.palette import INK

TYPE, LINE = 7.5, 9.4  # size, and distance of lines
BOLD = 1.15  # width of bold type over that of plain type
# Advance widths of DejaVu Sans 2.37 in hundredths of the type size, from the space to the tilde.
_WIDTHS = dict(zip(map(chr, range(32, 127)), (
    32, 40, 46, 84, 64, 95, 78, 27, 39, 39, 50, 84, 32, 36, 32, 34, 64, 64, 64, 64, 64, 64, 64, 64, 64, 64, 34, 34, 84,
    84, 84, 53, 100, 68, 69, 70, 77, 63, 58, 77, 75, 29, 29, 66, 56, 86, 75, 79, 60, 79, 69, 63, 61, 73, 68, 99, 69, 61,
    69, 39, 34, 39, 84, 50, 50, 61, 63, 55, 63, 62, 35, 63, 63, 28, 28, 58, 28, 97, 63, 61, 63, 63, 41, 52, 39, 63, 59,
    82, 59, 59, 52, 64, 34, 64, 84,
), strict=True)) | dict.fromkeys("−×≤≥ω", 84) | dict.fromkeys("⁰¹²³⁴⁵⁶⁷⁸⁹⁻·’", 40) | {"\u202f": 20}  # fmt: skip
_OTHER = 66
_QUOTE = {'"': "&quot;"}  # so that no text looks like a colour in an attribute
_NO_XML = re.compile(r"[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def width(text: str, size: float = TYPE) -> float:
    """Width of one line."""
    return sum(_WIDTHS.get(sign, _OTHER) for sign in text) * size / 100.0


def widest(lines: Sequence[str]) -> float:
    """Width of the widest of these lines."""
    return max(map(width, lines), default=0.0)


def wrapped(text: str, room: float, most: int = 9) -> list[str]:
    """Lines not wider than `room`, but for single words; what goes beyond `most` lines is left on the last.

    A word that is wider, such as the name of a requirement, is broken behind its underscores.
    """
    lines: list[str] = []
    for paragraph in text.split("\n") if text else ():
        lines.append("")
        for word in paragraph.split(" "):
            pieces = re.findall("[^_]+_*|_+", word) if width(word) > room else [word]
            for place, piece in enumerate(pieces):
                longer = f"{lines[-1]}{'' if place else ' '}{piece}".lstrip(" ")
                if lines[-1] and width(longer) > room and len(lines) < most:
                    lines.append(piece)
                else:
                    lines[-1] = longer
    return lines


def text(
    x: float,
    y: float,
    lines: Sequence[str],
    anchor: str = "start",
    fill: str = INK,
    turned: bool = False,
    bold: bool = False,
) -> Iterator[str]:
    """Lines as SVG, the baseline of the first at y; turned ones read upwards, each to the right of the one before."""
    style = f' text-anchor="{anchor}"' * (anchor != "start") + ' font-weight="bold"' * bold
    for k, words in enumerate(lines):
        across, down = x + LINE * k * turned, y + LINE * k * (not turned)
        place = f'x="{across:.1f}" y="{down:.1f}"'
        if turned:
            place = f'transform="translate({across:.1f} {down:.1f}) rotate(-90)"'
        yield f'<text {place} fill="{fill}"{style}>{escape(_NO_XML.sub(" ", words), _QUOTE)}</text>'
