"""Escaping of text for Markdown."""

import re

SPACE = re.compile(r"[ \t\n]+")  # not the narrow ones inside numbers; a document has no others that break lines
_SPECIAL = re.compile(r"([\\`*\[\]<>#|~&$])")
_UNDERSCORE = re.compile(r"(?<![^\W_])_|_(?![^\W_])")  # inside a word it emphasises nothing
_ADDRESS = re.compile(r":(?=//)|(?<=www)\.|@", re.IGNORECASE)  # what some readers turn into links
_LINE_START = re.compile(r"^(\s*)([-+](?=[-\s]|$)|=(?=[=\s]|$)|\d+[.)](?=\s|$))")


def escaped(text: str) -> str:
    """Text that no reader of Markdown takes for anything else, on one line."""
    line = _SPECIAL.sub(r"\\\1", SPACE.sub(" ", text).strip())
    line = _ADDRESS.sub(lambda match: "\\" + match[0], _UNDERSCORE.sub(r"\\_", line))
    return _LINE_START.sub(lambda match: f"{match[1]}{match[2][:-1]}\\{match[2][-1]}", line)
