"""Every count of cases in a report is that of the table, and what is labelled alike is equal in all its formats: on all
shipped campaigns, each flown with a few cases.
"""

import json
import re
import shutil
import subprocess
import tomllib
from dataclasses import fields, is_dataclass
from html.parser import HTMLParser

import jsonschema
import numpy as np
import pytest
from figure_marks import FORMS, classes

from mc_engine.campaign.loading import load_campaign
from mc_engine.campaign.search import find_campaign
from mc_engine.runner.runner import run
from mc_engine.statistics import CHOSEN_DESIGNS
from reports import render_html, render_pdf
from reports.contents import build
from reports.document.blocks import Table, blocks_of
from reports.formats.json_data import render_json, schema
from reports.formats.markdown import code, render_markdown
from reports.text.markdown_text import escaped
from reports.text.numbers import words
from tests.shipped_campaigns import samples

QUICK = ("reentry", "minimal")  # of which pages are drawn always
CASES = 60
BLOCKS = 32  # flown for the contributors
NUMBER = r"(\d[\d\u202f]*)"
COUNTS = (
    re.compile(NUMBER + r" inside all limits"),  # outcome sentences
    re.compile(r"inside all limits: " + NUMBER),  # keys of figures
    re.compile(r"all at once.{0,400}?" + NUMBER + r" of \d[\d\u202f]* cases inside", re.DOTALL),
)
EVERY_CASE = re.compile(r"all cases are inside (all limits|the limits? of [^.]*)\.")


FLYABLE = samples(tunings=False)
every_campaign = pytest.mark.parametrize("reported", FLYABLE, indirect=True, scope="module")
quick_campaigns = pytest.mark.parametrize(
    "reported",
    [pytest.param(*each.values, marks=[] if each.values[0] in QUICK else pytest.mark.slow) for each in FLYABLE],
    indirect=True,
    scope="module",
)


def small(name, **given):
    """A shipped campaign with few cases, of which few have a history, and few flights for the contributors."""
    path = find_campaign(name)
    text = re.sub(r"(\[sensitivity\][^\[]*?\ncases = )\d+", rf"\g<1>{BLOCKS}", path.read_text())
    text = re.sub(r"(\bfirst = )(\d+)", lambda found: f"{found[1]}{min(int(found[2]), 20)}", text)
    random = tomllib.loads(text)["campaign"].get("design") in ("mc", "lhs", "sobol")
    cases = CASES if random else None
    return load_campaign(name, cases=cases, text=text, directory=path.parent, **given)


def texts(item):
    """Every text of a document, the keys of its figures among them."""
    if isinstance(item, str):
        yield item
    elif isinstance(item, tuple | list):
        for one in item:
            yield from texts(one)
    elif is_dataclass(item):
        for one in fields(item):
            yield from texts(getattr(item, one.name))
        if hasattr(item, "interactive"):
            yield from texts(item.key)
            yield item.alternative


def whole(text):
    return int(text.replace("\u202f", ""))


def inside(table, records):
    """bool[n], from the table alone."""
    kept = (table["status"] == "ok").to_numpy(copy=True)
    for one in records:
        values = table[one["metric"]].to_numpy(dtype=float)
        kept &= np.isfinite(values)
        kept &= values <= (np.inf if one["at_most"] is None else one["at_most"])
        kept &= values >= (-np.inf if one["at_least"] is None else one["at_least"])
    return kept


@pytest.fixture(scope="module")
def reported(request, tmp_path_factory):
    """A shipped campaign flown with few cases: its store and its report."""
    folder = tmp_path_factory.mktemp("flown")
    campaign = small(request.param)
    if campaign.first is not None:
        run(small(campaign.first.name), folder / "upstream")
        campaign = small(request.param, upstream=folder / "upstream")
    store = run(campaign, folder / "run")
    return store, build(store, "run")


@every_campaign
def test_every_count_of_a_report_is_that_of_the_table(reported):
    store, document = reported
    table, records = store.cases(), store.manifest["requirements"]
    said = list(texts(document))
    expected = int(inside(table, records).sum())
    found = [(whole(one), text) for text in said for count in COUNTS for one in count.findall(text)]
    assert not [pair for pair in found if pair[0] != expected]
    assert found or not records
    cards = {card.label: card for card in document.verdicts}
    for one in records:
        passed = int(inside(table, [one]).sum())
        assert f"{passed:,} of {len(table):,} cases inside".replace(",", "\u202f") in cards[one["name"]].detail
        rows = [row for row in rows_of(document) if row[0].text == one["name"] and " / " in row[3].text]
        assert all(row[3].text == f"{passed:,} / {len(table):,}".replace(",", "\u202f") for row in rows)
    for caption, cases_by_class in corridors(document):
        for told in (text for text in cases_by_class if text.startswith("inside")):
            names = re.sub(r"^inside the limits? of ", "", told)
            of = [one for one in records if f" {one['name']}," in f" {names}," or "all limits" in told]
            assert cases_by_class[told] == int(inside(table, of).sum()), caption
    for told in (told for text in said for told in EVERY_CASE.findall(text)):
        of = [one for one in records if f" {one['name']}," in f" {told}," or told == "all limits"]
        assert inside(table, of).all(), told


def rows_of(document):
    section = next(one for one in document.sections if one.anchor == "requirements")
    return list(section.blocks[0].rows) if hasattr(section.blocks[0], "rows") else []


def corridors(document):
    for section in document.sections:
        for block in section.blocks:
            if getattr(getattr(block, "drawing", None), "form", "") == FORMS["corridor"]:
                yield block.caption, classes(block.drawing)


# ---- the formats


@pytest.fixture(scope="module")
def record(reported):
    return json.loads(render_json(reported[1]))


@every_campaign
def test_the_data_validate_against_their_schema_and_have_the_numbers_of_the_table(reported, record):
    store, _ = reported
    jsonschema.Draft202012Validator.check_schema(schema())
    jsonschema.validate(record, schema())
    table, requirements = store.cases(), store.manifest["requirements"]
    counts = {"cases": store.n_cases, "flown": len(table), "completed": int((table["status"] == "ok").sum())}
    assert record["counts"] == {**counts, "inside_all_limits": int(inside(table, requirements).sum())}
    ok = (table["status"] == "ok").to_numpy()
    for one in record["metrics"]:
        values = table[one["name"]].to_numpy(dtype=float)[ok]
        values = values[np.isfinite(values)]
        assert one["n_used"] == values.size
        if values.size > 1:
            found = [one["mean"], one["sigma"], one["minimum"], one["maximum"]]
            spread = np.ptp(values) * 1e-9 + 1e-14 * np.abs(values).max()
            assert found == pytest.approx([values.mean(), values.std(ddof=1), values.min(), values.max()], abs=spread)
    for limits, one in zip(requirements, record["requirements"], strict=True):
        assert (one["name"], one["passed"]) == (limits["name"], int(inside(table, [limits]).sum()))
        worst = [case for case in record["worst"] if case["requirement"] == limits["name"]]
        values = table.set_index("case_id")[limits["metric"]]
        assert [case["value"] for case in worst] == [values[case["case_id"]] for case in worst]
        assert sorted(case["margin"] for case in worst) == [case["margin"] for case in worst]
        ends = np.array([np.inf if limits["at_most"] is None else limits["at_most"],
                         -np.inf if limits["at_least"] is None else limits["at_least"]])  # fmt: skip
        margins = np.minimum(ends[0] - values[ok], values[ok] - ends[1])
        assert worst[0]["margin"] == pytest.approx(np.nanmin(margins[np.isfinite(margins)]), rel=1e-12)


@every_campaign
def test_the_tables_show_the_numbers_of_the_data(reported, record):
    store, document = reported
    tables = list(blocks_of(document, Table))
    for one in record["metrics"]:
        chosen = store.manifest["campaign"]["design"] in CHOSEN_DESIGNS
        numbers = [one["minimum"], one["maximum"], *([] if chosen else [one["mean"], one["sigma"]])]
        assert bool(one["quantiles"]) == (not chosen and one["n_used"] > 0)
        numbers += [
            quantile["value"] for quantile in one["quantiles"] if quantile["probability"] in (0.00135, 0.5, 0.99865)
        ]
        shown = [
            cell.value for row in rows_about(tables, words(one["name"], one["unit"])) for cell in row if cell.value
        ]
        assert in_one_unit([number for number in numbers if number], shown), one["name"]


@every_campaign
def test_the_worst_cases_of_the_tables_are_those_of_the_data(reported, record):
    store, document = reported
    rows = [row for table in blocks_of(document, Table) for row in table.rows if row[0].case is not None]
    metrics = [one["metric"] for one in store.manifest["requirements"]]
    failed = [one["metric"] for one in record["requirements"] if one["verdict"] == "fail"]
    open_ones = [one["metric"] for one in record["requirements"] if one["verdict"] == "not demonstrable"]
    first = list(dict.fromkeys([*failed, *open_ones, *metrics]))[:4]
    alone = [one for one in record["requirements"] if metrics.count(one["metric"]) == 1 and one["metric"] in first]
    for one in alone:
        worst = [case for case in record["worst"] if case["requirement"] == one["name"]][:5]
        values = {case["case_id"]: case["value"] for case in worst if case["value"]}
        if values and np.ptp(list(values.values())) > 1e-9 * max(map(abs, values.values())):  # else it is constant
            worst_id = next(iter(values))
            factors = {
                cell.value / values[worst_id] for row in rows if row[0].case == worst_id for cell in row if cell.value
            }
            assert any(all(holds(rows, case, factor * value) for case, value in values.items()) for factor in factors)


def holds(rows, case, value):
    shown = [cell.value for row in rows if row[0].case == case for cell in row if cell.value]
    return bool(np.isclose(shown, value, rtol=1e-9, atol=0.0).any())


def rows_about(tables, name):
    for table in tables:
        yield from (row for row in table.rows if re.match(rf"{re.escape(name)}( |$)", row[0].text))


def in_one_unit(numbers, shown):
    """Whether all numbers are among those shown, in their own unit or all in the same other one."""
    factors = {cell / numbers[0] for cell in shown} if numbers else {1.0}
    known = np.array(shown, dtype=float)
    return any(all(np.isclose(known, one * factor, rtol=1e-9, atol=0.0).any() for one in numbers) for factor in factors)


class _Tables(HTMLParser):
    """Rows of cells by the number of their table: the text of each cell without white space."""

    def __init__(self):
        super().__init__()
        self.tables, self.rows, self.cell = {}, None, None

    def handle_starttag(self, tag, attributes):
        name = dict(attributes).get("id") or ""
        if tag == "figure" and name.startswith("table-"):
            self.rows = self.tables.setdefault(int(name.removeprefix("table-")), [])
        elif tag == "tr" and self.rows is not None:
            self.rows.append([])
        elif tag == "td" and self.rows is not None:
            self.rows[-1].append("")
            self.cell = True

    def handle_endtag(self, tag):
        self.cell = None if tag == "td" else self.cell
        self.rows = None if tag == "figure" else self.rows

    def handle_data(self, data):
        if self.cell:
            self.rows[-1][-1] += bare(data)


def bare(text):
    return re.sub(r"[\s\u200b\u2060\u00ad]", "", text)


@quick_campaigns
def test_page_markdown_pdf_and_data_have_the_same_tables_and_cards(reported, record, tmp_path):
    _, document = reported
    page = _Tables()
    page.feed(render_html(document).decode())
    text, markdown = bare(pdf_text(render_pdf(document), tmp_path)), render_markdown(document).decode()
    assert [[card.answer in markdown, bare(card.answer) in text] for card in document.verdicts + document.costs] == [
        [True, True] for _ in document.verdicts + document.costs
    ]
    held = {one["number"]: one for part in record["sections"] for one in part["blocks"] if one["kind"] == "table"}
    tables = list(blocks_of(document, Table))
    assert [table.number for table in tables] == list(held)
    for table in tables:
        said = [[f"{cell.text} ({cell.small})" if cell.small else cell.text for cell in row] for row in table.rows]
        assert held[table.number]["rows"] == said
        shown = [row for row in page.tables[table.number] if row]
        assert len(shown) == len(table.rows)
        for row, cells in zip(table.rows, shown, strict=True):
            for column, cell, there in zip(table.columns, row, cells, strict=True):
                assert bare(cell.text) in there, table.caption
                assert bare(cell.small) in there, table.caption
                written = code(cell.text) if column.kind in ("code", "name") else escaped(cell.text)
                assert written in markdown, table.caption
                if column.kind == "number":
                    assert bare(cell.text) in text, table.caption
                    assert bare(cell.small) in text, table.caption


def pdf_text(pdf, tmp_path):
    if shutil.which("pdftotext") is None:
        pytest.skip("needs the Debian package poppler-utils")
    (tmp_path / "report.pdf").write_bytes(pdf)
    done = subprocess.run(["pdftotext", "-raw", tmp_path / "report.pdf", "-"], capture_output=True, check=True)
    return done.stdout.decode()
