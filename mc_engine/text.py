"""Text of unknown origin on its way to a reader: a terminal, a page, a picture.

Names, units and sentences of a run, a campaign or a folder may come from anyone.  Written as they are, some characters
move the cursor, retitle the window, turn the order of reading round, or hide.
"""

from unicodedata import category


def clean(text: str) -> str:
    r"""The text with every character that steers, reorders or hides replaced by its escape, such as \x1b or \u202e.

    Those are controls but newline and tab, format characters (bidirectional, zero-width), line and paragraph
    separators, lone surrogates (of file names that are not UTF-8), and private and unassigned code points.
    """
    if text.isprintable():
        return text
    return "".join(letter if _is_shown(letter) else _escape(letter) for letter in text)


def _is_shown(letter: str) -> bool:
    return letter.isprintable() or letter in "\n\t" or category(letter) == "Zs"


def _escape(letter: str) -> str:
    return letter.encode("unicode_escape").decode("ascii")
