"""The report as Markdown: the same contents, figures beside it, and all that users write stays text."""

import re

import pytest
from markdown_it import MarkdownIt
from payloads import ONE_BY_ONE, hostile
from synthetic_run import synthetic_run

from reports import build
from reports.document.blocks import FigureBlock, Table, blocks_of
from reports.formats.markdown import code, escaped, figure_files, render_markdown


def tokens(text):
    """Every token of a reader that takes HTML, inline ones too."""
    found = MarkdownIt("commonmark", {"html": True}).enable(["table", "strikethrough"]).parse(text)
    return [item for token in found for item in (token, *(token.children or ()))]


def shape(text):
    return [token.type for token in tokens(text) if token.type not in ("text", "code_inline")]


def words(text):
    return "".join(token.content for token in tokens(text) if token.type in ("text", "code_inline"))


@pytest.fixture(scope="module")
def document():
    return build(synthetic_run(400), "run")


@pytest.fixture(scope="module")
def harmless():
    return shape(render_markdown(build(hostile("harmless"), "run")).decode())


def test_every_table_figure_and_section_is_there(document):
    text = render_markdown(document).decode()
    assert text.startswith("# De-orbit correction after an erroneous burn\n")
    for kind, word in ((Table, "Table"), (FigureBlock, "Figure")):
        for block in blocks_of(document, kind):
            assert f"**{word} {block.number}.** {escaped(block.caption)}" in text
    for section in document.sections:
        mark = "###" if section.kind == "part" else "##"
        title = f"{'Appendix ' * (section.kind == 'appendix')}{section.number} {section.title}".strip()
        assert f"\n{mark} {escaped(title)}\n" in text
    assert sum(token.type == "table_open" for token in tokens(text)) == len(list(blocks_of(document, Table)))


def test_what_a_cell_says_in_brackets_has_no_second_ones(document):
    text = render_markdown(document).decode()
    assert not re.search(r"\(\(|\(\\\[", text)
    assert re.search(r"% \\\[\d", text)  # a demonstrated probability with its bounds


def test_every_picture_is_a_file_with_its_alternative_text(document):
    text = render_markdown(document).decode()
    files = {file.name: file.content for file in figure_files(document)}
    shown = {token.attrs["src"]: token.content for token in tokens(text) if token.type == "image"}
    assert set(shown) == set(files)
    assert all(len(alternative) > 40 for alternative in shown.values())
    for content in files.values():
        assert re.search(rb'<svg [^>]*><rect width="100%" height="100%" fill="#ffffff"/>', content)


@pytest.mark.parametrize("payload", ONE_BY_ONE)
def test_what_users_write_stays_text(payload, harmless):
    text = render_markdown(build(hostile(payload), "run")).decode()
    assert shape(text) == harmless
    assert re.sub(r"\s", "", payload) in re.sub(r"\s", "", words(text))


@pytest.mark.parametrize(
    "text", ["# x", "- x", "+ x", "1. x", "12) x", "=====", "---", "    x", "> x", "| a | b |", "a\n\nb"]
)
def test_a_line_starts_nothing_but_a_paragraph(text):
    assert shape(escaped(text)) == ["paragraph_open", "inline", "paragraph_close"]
    assert words(escaped(text)) == " ".join(text.split())


def test_numbers_and_names_stay_readable():
    assert escaped("propellant_kg is 2.5 at -3, 10\u202f000 cases") == "propellant_kg is 2.5 at -3, 10\u202f000 cases"
    assert code("ve_pct [%]") == "`ve_pct [%]`"
