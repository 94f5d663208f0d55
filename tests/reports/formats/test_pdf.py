"""The typeset report."""

import ctypes
import io
import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pypdf
import pypdfium2
import pytest
from payloads import PAYLOADS, hostile
from synthetic_run import synthetic_run

from reports import build, render_pdf
from reports.document.blocks import Cell, Column, FigureBlock, Section, Table, blocks_of
from reports.document.columns import spans
from reports.formats.pdf import NO_EAST_ASIAN, typst_input

MARKUP = [
    '#panic("x")',
    "*bold* _x_ $x^2$ `raw`",
    *(
        pytest.param(markup, marks=pytest.mark.slow)
        for markup in ("= heading", "@reference <label>", "\\ \\u{41} // comment", "$\\frac{")
    ),
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


@pytest.mark.parametrize(("title", "lacking"), [("降轨", True), ("着陸", True), ("착륙", True), ("Ωé ☕ Ж", False)])
def test_a_pdf_says_that_its_typeface_lacks_east_asian_characters(title, lacking):
    """They were boxes without a word."""
    run = synthetic_run(30)
    run.manifest["campaign"]["title"] = title
    assert (NO_EAST_ASIAN in typst_input(build(run, "run"))) == lacking


def test_a_small_text_is_below_the_number_with_its_unit_and_neither_is_broken(pdf, tmp_path):
    text = text_of(pdf, tmp_path)
    assert re.search(r"^ *fuel +at most 2\.5[\u202f ]kg  ", text, re.MULTILINE)
    assert re.search(r"  for 99\.73[\u202f ]% with", text)


def test_limits_of_many_digits_leave_the_names_of_requirements_their_room():
    run = synthetic_run(300, failed=0)
    force = {**run.manifest["requirements"][1], "name": "momentum_at_separation", "at_most": 1234567.890123}
    run.manifest["requirements"] = [force, {**force, "at_least": -1234567.890123}]
    run.table["peak_force_n"] += 1e6
    document = build(run, "run")
    own = replace(
        document, sections=(Section("own", "Own", (next(blocks_of(document, Table)),)),), verdicts=(), costs=()
    )
    pages = [page.get_textpage() for page in pypdfium2.PdfDocument(render_pdf(own))]

    def ends(text):
        """Left and right end of every place where a text is in one line."""
        for page in pages:
            search = page.search(text)
            while found := search.get_next():
                yield page.get_charbox(found[0])[0], page.get_charbox(sum(found) - 1)[2]

    (_, name_ends), (limit_begins, _) = next(ends("separation")), next(ends("at most 1"))
    assert name_ends < limit_begins


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
    assert "Table 1. Verification matrix" in text
    assert "Figure 1. Margins of the requirements" in text
    assert "Figure 5. Correction fuel" in text
    assert re.search(r"\b2 ?/ ?\d", text)
    assert re.search(r"Provenance\W+\d", text)


@pytest.mark.parametrize("markup", MARKUP)
def test_what_users_write_is_never_read_as_markup(markup, tmp_path):
    run = synthetic_run(40, failed=2, figures=[])
    run.manifest["campaign"]["title"] = markup
    run.manifest["inputs"][0]["source"] = markup
    squeezed = re.sub(r"\s", "", text_of(render_pdf(build(run, "run")), tmp_path))
    assert re.sub(r"\s", "", markup) in squeezed


def test_a_date_that_cannot_be_read_is_left_out():
    assert render_pdf(build(synthetic_run(5, failed=0, created_utc="yesterday"), "run")).startswith(b"%PDF")


def test_every_page_but_the_last_is_at_least_half_full(pdf):
    pages = [page.render(scale=0.5, grayscale=True).to_numpy() for page in pypdfium2.PdfDocument(pdf)]
    for grey in pages[1:-1]:
        body = grey[: int(0.93 * len(grey))]  # without the foot
        assert np.flatnonzero((body < 200).any(axis=1)).max() > 0.5 * len(grey)


def test_no_type_is_smaller_than_seven_and_a_half_points(pdf):
    sizes = {}
    for page in pypdfium2.PdfDocument(pdf):
        for item in page.get_objects(filter=[pypdfium2.raw.FPDF_PAGEOBJ_TEXT], max_depth=8):
            height = ctypes.c_float()
            assert pypdfium2.raw.FPDFTextObj_GetFontSize(item.raw, height)
            _, _, c, d, _, _ = item.get_matrix().get()
            sizes[round(height.value * (c * c + d * d) ** 0.5, 2)] = item
    assert len(sizes) >= 3
    assert min(sizes) >= 7.45


def test_text_of_figures_is_found_and_set_in_the_typefaces_of_the_page(pdf, tmp_path):
    text = text_of(pdf, tmp_path)
    for label in ("peak force [N]", "time [s]", "required limit"):
        assert label in text
    fonts = [item["/FontName"].split("+")[1] for item in _dictionaries(pypdf.PdfReader(io.BytesIO(pdf)))
             if item.get("/Type") == "/FontDescriptor"]  # fmt: skip
    assert set(fonts) == {"DejaVuSans", "DejaVuSans-Bold", "DejaVuSansMono"}


def test_a_table_leaves_no_row_alone_on_a_page():
    blocks = []
    for n in range(2, 60, 3):
        rows = tuple((Cell(f"first of {n}" if k == 0 else f"last of {n}" if k == n - 1 else f"{k}"),) for k in range(n))
        blocks.append(Table("rows", (Column("head"),), rows, number=n))
    document = replace(build(synthetic_run(5, failed=0), "run"), sections=(Section("t", "Tables", tuple(blocks)),))
    for page in pypdf.PdfReader(io.BytesIO(render_pdf(document))).pages[1:]:
        lines = [line for line in page.extract_text().splitlines() if line.strip()]
        for k, line in enumerate(lines):
            before, after = (lines[k + step] if 0 <= k + step < len(lines) else "" for step in (-1, 1))
            assert not (line.startswith("last of") and before == "head"), line
            assert not (line.startswith("first of") and not re.match(r"\d|last", after)), line


def test_a_grouped_cell_is_shown_once_and_stands_for_all_its_rows():
    rows = tuple((Cell(metric), Cell(name)) for metric, name in (("load", "ld"), ("load", "cd"), ("miss", "cd")))
    columns = Column("Metric", grouped=True), Column("Contributor")
    assert spans(Table("Contributors", columns, rows)) == [2, 0, 1]
    assert spans(Table("Contributors", columns[1:] * 2, rows)) == [1, 1, 1]
    assert spans(Table("Contributors", columns, ())) == []


def test_a_figure_that_continues_on_the_next_page_has_its_key_there_too(tmp_path):
    document = build(synthetic_run(200, failed=0), "run")
    figure = next(one for one in blocks_of(document, FigureBlock) if one.drawing.key and len(one.drawing.plots) > 1)
    many = replace(figure, drawing=replace(figure.drawing, plots=figure.drawing.plots[:2] * 12, across=2))
    own = replace(document, sections=(Section("own", "Own", (many,)),))
    pages = [page for page in text_of(render_pdf(own), tmp_path).split("\f") if many.drawing.plots[0].x.label in page]
    assert len(pages) > 1
    assert many.drawing.key[-1].key == "required limit"
    assert [page.count("required limit") for page in pages] == [1] * len(pages)


def test_the_list_of_contents_is_not_broken_at_the_end_of_the_first_page():
    document = build(synthetic_run(300, failed=0), "run")
    contents = tuple(replace(document.sections[-1], anchor=f"s{k}", title=f"Entry {k}") for k in range(12))
    full = replace(document, verdicts=document.verdicts[:1] * 12, sections=contents)
    pages = [page.extract_text() for page in pypdf.PdfReader(io.BytesIO(render_pdf(full))).pages]
    listed = next(text for text in pages if "Contents" in text).partition("Contents")[2]
    assert all(f"Entry {k}" in listed for k in range(12))
