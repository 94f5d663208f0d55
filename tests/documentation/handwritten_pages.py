"""The pages that people wrote, and the code blocks and commands in them."""

import re
from pathlib import Path

from mc_engine.documentation.website import HOME, handwritten

ROOT = HOME.parents[1]
PAGES = [*(path for path in handwritten() if path.suffix == ".md"), ROOT / "README.md"]
_FENCE = re.compile(
    r"(?:<!-- (?P<mark>[^\n]*) -->\n)?^```(?P<kind>\w+)[^\n]*\n(?P<text>.*?)^```", re.DOTALL | re.MULTILINE
)


def name_of(page: Path) -> str:
    """The page as a reader knows it, for the names of tests."""
    return page.relative_to(ROOT).as_posix().removeprefix("mc_engine/documentation/")


def blocks(page: Path, kind: str) -> list[tuple[str, str]]:
    """(text, mark) of each fenced block of a language; the mark is a comment on the line before it."""
    found = _FENCE.finditer(page.read_text(encoding="utf-8"))
    return [(one["text"], one["mark"] or "") for one in found if one["kind"] == kind]


def commands(page: Path) -> list[str]:
    """What follows `mc-engine` in the page's shell blocks and between its backticks."""
    prose = _FENCE.sub("", page.read_text(encoding="utf-8"))
    shown = [*blocks(page, "sh"), *blocks(page, "console")]
    lines = [line.removeprefix("$ ") for text, _ in shown for line in text.replace("\\\n", " ").splitlines()]
    lines += re.findall(r"`(mc-engine [^`]+)`", prose)
    parts = [part for line in lines for part in re.split(r"\|\||&&|;", line.split(" #")[0])]
    return [found[1] for part in parts if (found := re.search(r"(?:^|\s|/)mc-engine (.*)", part.strip()))]
