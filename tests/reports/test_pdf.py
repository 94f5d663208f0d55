"""The typeset report."""

import io
import re
import shutil
import subprocess

import pypdf
import pypdfium2
import pytest
from payloads import PAYLOADS, hostile
from synthetic_run import synthetic_run

from reports import build, render_pdf

MARKUP = [
    '#panic("x")',
    "*bold* _x_ $x^2$ `raw`",
    "= heading",
    "@reference <label>",
    "\\ \\u{41} // comment",
    "$\\frac{",
]


@pytest.fixture(scope="module")
def pdf():
    return render_pdf(build(synthetic_run(3000), "run"))


def text_of(pdf, tmp_path):
    """What a reader's text search finds."""
    if shutil.which("pdftotext") is None:
        pytest.skip("needs the Debian package poppler-utils")
    (tmp_path / "report.pdf").write_bytes(pdf)
    done = subprocess.run(["pdftotext", "-layout", tmp_path / "report.pdf", "-"], capture_output=True, check=True)
    return done.stdout.decode()


def test_the_same_run_gives_the_same_bytes(pdf):
    assert pdf.startswith(b"%PDF")
    assert render_pdf(build(synthetic_run(3000), "run")) == pdf


def test_two_readers_open_it_and_see_the_same_pages_with_ink_on_each(pdf):
    pages = pypdf.PdfReader(io.BytesIO(pdf)).pages
    drawn = pypdfium2.PdfDocument(pdf)
    assert len(pages) == len(drawn) > 8
    for page, other in zip(pages, drawn, strict=True):
        grey = other.render(scale=0.3, grayscale=True).to_numpy()
        assert (grey < 128).any()
        squeezed = [re.sub(r"\s", "", text) for text in (page.extract_text(), other.get_textpage().get_text_bounded())]
        assert abs(len(squeezed[0]) - len(squeezed[1])) <= 0.02 * len(squeezed[0]) + 5


def test_it_has_a_title_a_language_an_outline_and_alternative_texts(pdf):
    reader = pypdf.PdfReader(io.BytesIO(pdf))
    assert reader.metadata.title == "De-orbit correction after an erroneous burn"
    assert reader.trailer["/Root"]["/Lang"] == "en"
    assert len(reader.outline) >= 12
    assert sum("/Alt" in item for item in _dictionaries(reader)) >= 9


def test_every_font_is_embedded_and_every_figure_is_drawn_with_lines(pdf):
    reader = pypdf.PdfReader(io.BytesIO(pdf))
    fonts = [item for item in _dictionaries(reader) if item.get("/Type") == "/FontDescriptor"]
    assert fonts
    assert all({"/FontFile", "/FontFile2", "/FontFile3"} & set(font) for font in fonts)
    assert not [item for item in _dictionaries(reader) if item.get("/Subtype") == "/Image" and item["/Width"] > 64]


def test_payloads_are_typeset_as_they_were_written():
    text = " ".join(PAYLOADS)
    reader = pypdf.PdfReader(io.BytesIO(render_pdf(build(hostile(text), "run"))))
    squeezed = re.sub(r"\s", "", "".join(page.extract_text() for page in reader.pages))
    for payload in PAYLOADS:
        assert re.sub(r"\s", "", payload) in squeezed
    assert not [item for item in _dictionaries(reader) if item.get("/S") == "/URI" or "/URI" in item]


def _dictionaries(reader):
    """Every dictionary that stands as an object of its own."""
    found = (
        reader.get_object(number)
        for number in range(1, len(reader.xref_objStm) + sum(map(len, reader.xref.values())) + 1)
    )
    return [item for item in found if isinstance(item, pypdf.generic.DictionaryObject)]


def test_the_creation_date_is_that_of_the_run(pdf):
    dates = set(re.findall(rb"D:(\d{14})", pdf))
    assert dates == {b"20260421101500"}


def test_numbered_tables_figures_and_pages_are_there(pdf, tmp_path):
    text = text_of(pdf, tmp_path)
    assert "Table 1. Requirements and their verdicts" in text
    assert "Figure 1. Share of each metric" in text
    assert "Figure 3. Correction fuel" in text
    assert re.search(r"\b2 ?/ ?\d", text)
    assert re.search(r"Provenance\W+\d", text)


@pytest.mark.parametrize("markup", MARKUP)
def test_what_users_write_is_never_read_as_markup(markup, tmp_path):
    run = synthetic_run(40, failed=2, figures=[])
    run.manifest["campaign"]["title"] = markup
    run.manifest["inputs"][0]["source"] = markup
    squeezed = re.sub(r"\s", "", text_of(render_pdf(build(run, "run")), tmp_path))
    assert re.sub(r"\s", "", markup) in squeezed


@pytest.mark.parametrize(("n", "failed"), [(0, 0), (1, 0), (2, 0), (20, 20)])
def test_hardly_any_cases_and_all_failed_are_still_typeset(n, failed):
    assert render_pdf(build(synthetic_run(n, failed=failed), "run")).startswith(b"%PDF")


def test_a_date_that_cannot_be_read_is_left_out():
    assert render_pdf(build(synthetic_run(5, failed=0, created_utc="yesterday"), "run")).startswith(b"%PDF")
