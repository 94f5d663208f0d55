"""Reports of runs whose texts would steer, reorder or hide: every format shows them as escapes."""

import io
import json

import pypdf
import pytest
from payloads import hostile

from reports import build, render_html, render_pdf
from reports.document.blocks import Document, Section, Text
from reports.formats.html import plotly_script
from reports.formats.markdown import figure_files, render_markdown
from reports.user_sections.sections import run_facts, with_own_sections
from tests.mc_engine.told import HIDDEN, LONE, PAYLOAD, STEERING

REFUSED = STEERING | HIDDEN | {LONE}
SHOWN = r"\u202eevil\u2066\u200b\u2028"


@pytest.fixture(scope="module")
def document():
    run = hostile(PAYLOAD)
    run.manifest["campaign"]["title"] = PAYLOAD + LONE
    for record in [*run.manifest["columns"][4:], *run.manifest["quantities"], *run.manifest["parameters"]]:
        record["unit"] = PAYLOAD
    run.manifest["requirements"][1]["name"] = "line\nline"
    run.manifest["created_utc"] = PAYLOAD
    return build(run, f"run{PAYLOAD}{LONE}")


def test_the_page_has_no_such_character(document):
    text = render_html(document).decode()
    text = text.replace(plotly_script(), "")
    assert not REFUSED & set(text)
    assert text.count(SHOWN) > 20
    record = text.split('id="figures">')[1].split("</script>")[0]
    assert SHOWN in json.dumps(json.loads(record), ensure_ascii=False).replace("\\\\", "\\")
    assert not any(f"\\u{ord(one):04x}" in record.replace("\\\\", "") for one in REFUSED)


def test_the_pdf_is_typeset_and_has_no_such_character(document):
    reader = pypdf.PdfReader(io.BytesIO(render_pdf(document)))
    text = "".join(page.extract_text() for page in reader.pages)
    assert not (REFUSED - {"\u200b"}) & set(text)  # which the template itself puts where a name may break
    assert "evil" in text


def test_markdown_and_its_pictures_have_no_such_character(document):
    text = render_markdown(document).decode()
    assert not REFUSED & set(text)
    assert text.count("\\\\u202eevil") > 20  # a backslash of the escape is escaped once more
    for file in figure_files(document):
        assert not REFUSED & set(file.content.decode())


def test_values_in_a_section_of_the_users_own_are_clean(document, tmp_path):
    flown_run = hostile(PAYLOAD)
    from reports.run.flown import Flown

    facts = run_facts(Flown(flown_run, PAYLOAD), PAYLOAD)
    template = tmp_path / "own.md"
    template.write_text("# Own \u202e {{ run.title }}\n\n    code\x1b[2J\n\n{{ run.name }}\n", encoding="utf-8")
    own = with_own_sections(document, template, facts, [facts])
    for text in (render_markdown(own).decode(), render_html(own).decode().replace(plotly_script(), "")):
        assert not REFUSED & set(text)


def test_a_document_is_clean_once_it_is_made_and_tells_lines_apart():
    section = Section("a", "b\u202e", (Text(("one\ntwo\tthree\x1b", LONE), "code"),))
    made = Document("t\u200b", "s", "", (("f\x07", "v"),), (), (), ("w\u2066",), (section,))
    assert (made.title, made.facts, made.warnings) == (r"t\u200b", ((r"f\x07", "v"),), (r"w\u2066",))
    assert made.sections[0].blocks[0].paragraphs == ("one\ntwo\tthree\\x1b", r"\udcff")
