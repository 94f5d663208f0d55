"""The page in a real browser: all drawn, cases chosen and looked up, nothing logged, nothing asked of a network."""

from base64 import b64decode
from dataclasses import replace
from importlib.resources import files
from io import BytesIO

import numpy as np
import pypdf
import pytest
from browser import INSTALLED, chromium
from landing_run import landing_run
from payloads import PAYLOADS, hostile
from synthetic_run import synthetic_run

from reports import build, render_html
from reports.document.blocks import Cell, Column, FigureBlock, Section, Table, Text, blocks_of, numbered
from reports.drawing.marks import Axis, Drawing, Line, Plot

pytestmark = pytest.mark.skipif(not INSTALLED, reason="needs the Debian package chromium")
COUNT = "document.getElementById('selection-count').textContent"
ROWS = (
    "[...document.querySelectorAll('#selection-table tbody tr')].map((row) => [...row.cells].map((c) => c.textContent))"
)
PLACE = """(() => {
  const panel = document.querySelector(`#${document.getElementById('explorer').dataset.figure} .nsewdrag`);
  panel.scrollIntoView({block: 'start', behavior: 'instant'});
  const box = panel.getBoundingClientRect();
  return [box.x, box.y, box.width, box.height];
})()"""

DRAWN = "[...document.querySelectorAll('.panels > .panel')].map((p) => p.querySelectorAll('.main-svg').length)"
SCROLLED = """(async () => {
  for (const panel of document.querySelectorAll('.panels > .panel')) {
    panel.scrollIntoView({block: 'center', behavior: 'instant'});
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  }
})()"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with chromium(tmp_path_factory.mktemp("profile")) as page:
        yield page


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_bytes(render_html(build(synthetic_run(600), "run")))
    return path


@pytest.fixture(scope="module")
def opened(browser, file):
    """The page with every figure drawn, whichever test of it comes first."""
    browser.open(file)
    browser.run(SCROLLED)
    browser.until(f"{DRAWN}.every(Boolean)")
    return browser


@pytest.fixture
def page(opened):
    """The page with nothing chosen and nothing open."""
    opened.run("document.getElementById('selection-close').click(); document.getElementById('history').close()")
    yield opened
    assert opened.logged == []
    assert opened.requests == []


def test_every_panel_of_every_figure_is_drawn(page):
    drawn = page.run(DRAWN)
    assert len(drawn) == page.run("JSON.parse(document.getElementById('figures').textContent).length")
    assert len(drawn) > 10
    assert all(drawn)


def test_nothing_can_be_sent_from_a_figure(page):
    offered = page.run("[...document.querySelectorAll('.modebar-btn')].map((button) => button.dataset.title)")
    assert "Download plot" in offered
    assert not [title for title in offered if "hare" in title or "loud" in title]


def test_failed_cases_are_chosen_without_a_mouse_and_listed_with_their_inputs(page):
    page.run("document.querySelector('[data-outcome=\"2\"]').focus()")
    page.key("Enter", "\r")
    assert page.run(COUNT).startswith("12 cases chosen of 600")
    table = synthetic_run(600).table
    rows = page.run(ROWS)
    assert [int(row[0]) for row in rows] == list(range(588, 600))
    assert {row[1] for row in rows} == {"failed"}
    for row, ve in zip(rows, table["ve_pct"][588:], strict=True):
        assert float(row[2].replace("−", "-")) == pytest.approx(ve, rel=1e-4)


def test_a_box_drawn_over_a_cloud_lists_its_cases_and_lifts_them_out_in_every_figure(page):
    x, y, width, height = page.settled(PLACE)
    page.drag([(x + 3, y + 3), (x + width / 3, y + height / 4), (x + width - 3, y + height / 3)])
    page.until("!document.getElementById('selection').hidden")
    chosen = {int(row[0]) for row in page.run(ROWS)}
    assert 5 < len(chosen) < 590
    lifted = page.run(
        "[...document.querySelectorAll('.panel')].flatMap((p) => (p.data || []).filter((t) => t.meta === 'cases').map("
        "(t) => t.selectedpoints.map((k) => t.customdata[k]).map((c) => Array.isArray(c) ? c[0] : c)))"
    )
    assert len(lifted) >= 4
    assert set().union(*lifted) <= chosen
    assert chosen == set().union(*lifted)
    page.click("#selection-close")
    assert page.run("document.getElementById('selection').hidden")


def test_a_range_of_a_histogram_chooses_all_its_cases_and_shows_them_in_every_other(page):
    bars = "document.querySelectorAll('.panel')].filter((p) => (p.data || []).some((t) => t.meta === 'bins'))"
    first = f"[...{bars}[0]"
    box = page.settled(
        f"(() => {{ const panel = {first}.querySelector('.nsewdrag'); "
        "panel.scrollIntoView({block: 'center', behavior: 'instant'}); const box = panel.getBoundingClientRect(); "
        "return [box.x, box.y, box.width, box.height]; })()"
    )
    x, y, width, height = box
    page.drag([(x + 0.3 * width, y + 5), (x + 0.4 * width, y + 9), (x + 0.6 * width, y + height - 5)])
    page.until("!document.getElementById('selection').hidden")
    low, high = page.run(
        f"(() => {{ const axis = {first}._fullLayout.xaxis; "
        "return [0.3, 0.6].map((k) => axis.p2l(k * axis._length)); })()"
    )
    column = page.run(f"{first}.data.find((t) => t.meta === 'bins').columns[0]")
    values = synthetic_run(600).table[column]
    wide = 0.01 * (high - low)
    number = int(page.run(COUNT).split()[0])
    assert (values.between(low + wide, high - wide)).sum() <= number <= (values.between(low - wide, high + wide)).sum()
    told = page.run(
        f"[...{bars}.map((p) => p.data.find((t) => t.meta === 'chosen').customdata.map("
        "(text) => Number(text.split(': ')[1].split(' ')[0])).reduce((a, b) => a + b, 0))"
    )
    assert len(told) >= 4
    assert max(told) == number  # less where cases lie beyond the axis, or have no number
    page.click("#selection-close")
    assert not page.run(f"[...{bars}.some((p) => p.data.some((t) => t.meta === 'chosen'))")


def test_a_long_table_is_searched_by_words(page):
    table = "document.querySelector('figure.table:has(.search)')"
    before = page.run(f"[...{table}.querySelectorAll('tbody tr')].map((r) => r.textContent)")
    words = before[2].lower().split()[:2]
    page.run(f"{table}.querySelector('.search input').value = '{' '.join(words)}'")
    page.run(f"{table}.querySelector('.search input').dispatchEvent(new Event('input'))")
    rows = page.run(f"[...{table}.querySelectorAll('tbody tr')].filter((r) => !r.hidden).map((r) => r.textContent)")
    assert rows == [row for row in before if all(word in row.lower() for word in words)]
    assert 0 < len(rows) < len(before)
    page.run(f"{table}.querySelector('.search input').value = ''")
    page.run(f"{table}.querySelector('.search input').dispatchEvent(new Event('input'))")


def test_the_figure_of_cases_takes_other_axes_and_a_range_of_any_column(page):
    page.run(
        "(() => { const s = document.getElementById('explorer-x');"
        " s.value = 3; s.dispatchEvent(new Event('change')); })()"
    )
    axis = "document.getElementById(document.getElementById('explorer').dataset.figure).layout.xaxis.title.text"
    assert page.run(axis) == "peak force [N]"
    page.run(
        "document.getElementById('explorer-column').value = 3; document.getElementById('explorer-low').value = '100'"
    )
    page.click("#explorer [type=submit]")
    lost = synthetic_run(600).table["peak_force_n"] >= 100.0
    assert page.run(COUNT).startswith(f"{int(lost.sum())} cases chosen")


def test_tables_sort_by_a_click_and_by_the_keyboard(page):
    table = "#worst table"
    cells = f"[...document.querySelector('{table}').tBodies[0].rows].map((row) => Number(row.cells[2].dataset.value))"
    page.click(f"{table} th:nth-child(3) button")
    rising = page.run(cells)
    assert rising == sorted(rising)
    page.run(f"document.querySelector('{table} th:nth-child(3) button').focus()")
    page.key("Enter", "\r")
    assert page.run(cells) == rising[::-1]
    assert page.run(f"document.querySelector('{table} th:nth-child(3)').getAttribute('aria-sort')") == "descending"


def test_the_history_of_a_worst_case_opens_over_the_nominal_one_and_closes_with_a_key(page):
    page.click("#worst table tbody a[href^='#case-']")
    page.until("document.getElementById('history').open")
    case = page.run("document.querySelector('#worst table tbody a').textContent")
    assert page.run("document.getElementById('history-title').textContent") == f"Case {case}"
    names = page.run("[...document.querySelectorAll('#history .panel')].map((p) => p.data.map((t) => t.name))")
    assert [one[-2:] for one in names] == [["nominal", f"case {case}"]] * 4
    page.click("#history-after")
    page.until(f"document.getElementById('history-title').textContent !== 'Case {case}'")
    page.key("Escape")
    page.until("!document.getElementById('history').open")


def test_figures_follow_the_dark_mode(page):
    ink = "document.querySelector('.panel').layout.font.color"
    light = page.run(ink)
    page.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    page.until(f"{ink} !== '{light}'")
    assert page.run(ink) == "#e8eaec"
    page.ask("Emulation.setEmulatedMedia", features=[])


def test_a_figure_is_drawn_when_it_comes_in_sight(browser, file):
    browser.open(file)
    assert not all(browser.run(DRAWN))
    browser.run(SCROLLED)
    browser.until(f"{DRAWN}.every(Boolean)")


CHOSEN = "Number(document.getElementById('selection-count').textContent.split(' case')[0].replace(/\\D/g, ''))"


def box_over(page, figure, left, right):
    """Draw a box over a share of the width of a panel, from top to bottom; its ends in the units of the axis."""
    page.settled(f"document.getElementById('{figure}').scrollIntoView({{block: 'center', behavior: 'instant'}})")
    page.until(f"document.querySelector('#{figure} .nsewdrag') !== null")
    x, y, width, height = page.settled(
        f"(() => {{ const b = document.querySelector('#{figure} .nsewdrag').getBoundingClientRect();"
        " return [b.x, b.y, b.width, b.height]; })()"
    )
    page.drag([(x + left * width, y + 1), (x + right * width, y + height / 2), (x + right * width, y + height - 1)])
    page.until("!document.getElementById('selection').hidden")
    return page.run(
        f"[{left}, {right}].map((part) => document.getElementById('{figure}')._fullLayout.xaxis.p2l(part * {width}))"
    )


def lone_figure(folder, title=""):
    plot = Plot((Line(np.arange(3.0), np.arange(3.0), "@ink"),), Axis("time [s]"), Axis(), title)
    own = Section("own", "Own", (FigureBlock("Lines", Drawing("Curves", (plot,))),))
    document = replace(build(synthetic_run(60), "run"), verdicts=(), costs=(), sections=numbered((own,)))
    (folder / "report.html").write_bytes(render_html(document))
    return folder / "report.html"


def test_figures_in_sight_are_there_with_the_first_picture_of_the_page(browser, tmp_path):
    """A screenshot that was taken as soon as the page was loaded had empty frames."""
    count = f"addEventListener('DOMContentLoaded', () => requestAnimationFrame(() => {{ first = {DRAWN}; }}))"
    browser.ask("Page.addScriptToEvaluateOnNewDocument", source=count)
    browser.open(lone_figure(tmp_path))
    assert browser.run("first") == [3]


def test_a_box_counts_every_case_of_the_run_also_where_a_figure_draws_only_some(browser, tmp_path):
    run = synthetic_run(5000)
    file = tmp_path / "report.html"
    file.write_bytes(render_html(build(run, "run")))
    browser.open(file)
    figure = browser.run(
        "reportFigures.figures.find((f) => f.data.some((t) => t.meta === 'cases' && t.customdata.length < 3000"
        " && t.columns && t.columns[0] === 've_pct')).id"
    )
    low, high = box_over(browser, figure, 0.3, 0.6)
    x = run.table["ve_pct"]
    assert browser.run(CHOSEN) == pytest.approx(int(((x >= low) & (x <= high)).sum()), abs=3)
    assert browser.run(CHOSEN) > 1000
    assert browser.run(COUNT).split("; ")[0].endswith("chosen of 5\u202f000")
    browser.run("document.getElementById('selection-close').click()")
    assert browser.logged == []


def test_a_box_over_a_footprint_chooses_the_flights_that_come_down_there(browser, tmp_path):
    run = landing_run(3000)
    file = tmp_path / "report.html"
    file.write_bytes(render_html(build(run, "run")))
    browser.open(file)
    figure = browser.run(
        "reportFigures.figures.find((f) => f.data.some((t) => t.columns && /place/.test(t.columns[0]))).id"
    )
    low, high = box_over(browser, figure, 0.4, 0.7)
    drawing = next(block.drawing for block in blocks_of(build(run, "run"), FigureBlock) if block.drawing.places)
    east = drawing.places["place: east of the mean [km]"][2]
    assert browser.run(CHOSEN) == pytest.approx(int(((east >= low) & (east <= high)).sum()), abs=3)
    browser.run("document.getElementById('selection-close').click()")
    assert browser.logged == []


@pytest.mark.parametrize(("width", "scheme"), [pytest.param(1400, "light", marks=pytest.mark.slow), (390, "dark")])
def test_axe_finds_nothing_that_keeps_a_reader_out(browser, tmp_path, width, scheme):
    axe = files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8")
    file = tmp_path / "report.html"
    file.write_bytes(render_html(build(synthetic_run(80), "run")))  # it looks at every point of a figure
    browser.ask("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width == 390)
    browser.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    try:
        browser.open(file)
        browser.run(SCROLLED)
        browser.until(f"{DRAWN}.every(Boolean)")
        browser.run(f"{axe}; null")
        rules, found = browser.run(
            "axe.run(document).then((done) => [done.passes.length, done.violations.map((one) =>"
            " `${one.id}: ${one.nodes.map((node) => node.html).join(' ')}`)])"
        )
    finally:
        browser.ask("Emulation.setEmulatedMedia", features=[])
        browser.ask("Emulation.clearDeviceMetricsOverride")
    assert found == []
    assert rules > 20


def test_what_users_write_stays_text_in_the_browser(browser, tmp_path):
    file = tmp_path / "report.html"
    text = " ".join(PAYLOADS)
    file.write_bytes(render_html(build(hostile(text, PAYLOADS), "run")))
    browser.logged.clear()
    browser.open(file)
    assert browser.run("document.querySelector('h1').textContent") == text
    assert (
        browser.run(
            "document.querySelectorAll('main img, main iframe, main object, main a[href^=\"javascript\"]').length"
        )
        == 0
    )
    browser.run("document.querySelector('[data-outcome=\"2\"]').click(); location.hash = '#case-0'")
    browser.until("document.getElementById('history').open")
    assert browser.run("window.struck === undefined")
    assert browser.logged == []
    assert browser.requests == []


@pytest.mark.parametrize("width", [1020, 1100, 1199, 1210, 1300])
def test_the_verdicts_are_in_sight_in_a_narrow_window(browser, file, width):
    browser.ask("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
    try:
        browser.open(file)
        # the widest row of the entry campaign
        words = ["dynamic-pressure<small>peak-dynamic-pressure-pa</small>", "at most 20_000_Pa", "99.73_%",
                 "10_000 / 10_000", "99.99_%<small>[99.73_%, 100.00_%]</small>", "19_999.9_Pa<small>margin 12_345_Pa",
                 "<span class='badge open'>not demonstrable</span>"]  # fmt: skip
        beyond = browser.run(
            "(() => { const s = document.querySelector('#requirements .scroll');"
            f" const row = s.querySelector('tbody tr'), words = {words};"
            " words.forEach((text, k) => { row.cells[k].innerHTML = text.replaceAll('_', '\\u202f'); });"
            " return [s.querySelector('th:last-child').textContent, s.scrollWidth - s.clientWidth]; })()"
        )
    finally:
        browser.ask("Emulation.clearDeviceMetricsOverride")
    assert beyond[0].startswith("Verdict")
    assert beyond[1] <= 0


BEYOND = """[...document.querySelectorAll('table, figure, .card, p, h1, h2')]
  .filter((one) => one.getClientRects().length)
  .filter((one) => one.getBoundingClientRect().right > document.documentElement.clientWidth + 1.5)
  .map((one) => one.outerHTML)"""


def test_nothing_reaches_beyond_a_printed_page(browser, file):
    a4_without_margins = 718
    browser.ask("Emulation.setDeviceMetricsOverride", width=a4_without_margins, height=1000, deviceScaleFactor=1,
                mobile=False)  # fmt: skip
    browser.ask("Emulation.setEmulatedMedia", media="print")
    try:
        browser.open(file)
        assert browser.run(BEYOND) == []
    finally:
        browser.ask("Emulation.setEmulatedMedia", media="")
        browser.ask("Emulation.clearDeviceMetricsOverride")


def test_a_title_of_two_lines_is_in_its_panel(browser, tmp_path):
    browser.open(lone_figure(tmp_path, "the mean deviation of the longitude over a whole day"))
    browser.until(f"{DRAWN}.every(Boolean)")
    lines = "[...document.querySelectorAll('.gtitle .line')].map((line) => line.getBoundingClientRect())"
    panel = "document.querySelector('.panel').getBoundingClientRect().top"
    frame = "document.querySelector('.panel .nsewdrag').getBoundingClientRect().top"
    tops, bottoms = (browser.run(f"{lines}.map((box) => box.{side})") for side in ("top", "bottom"))
    assert len(tops) == 2
    assert min(tops) >= browser.run(panel)
    assert max(bottoms) <= browser.run(frame)


def test_a_printed_table_repeats_its_head_on_every_page(browser, tmp_path):
    rows = tuple((Cell(f"row {k}"), Cell("value")) for k in range(150))
    long = Table("A long table", (Column("What it is"), Column("Value")), rows)
    own = Section("own", "Own", (long,))
    document = replace(build(synthetic_run(60), "run"), sections=(own,))
    (tmp_path / "report.html").write_bytes(render_html(document))
    browser.open(tmp_path / "report.html")
    printed = b64decode(browser.ask("Page.printToPDF", preferCSSPageSize=True)["data"])
    pages = [page.extract_text() for page in pypdf.PdfReader(BytesIO(printed)).pages]
    pages = [text for text in pages if "row" in text]
    assert len(pages) > 2
    assert all("What it is" in text for text in pages)


def test_a_line_of_code_is_no_wider_than_a_phone(browser, tmp_path):
    line = "mc-engine published a_model_with_a_long_name --compute --no-slow --update-lock"
    own = Section("own", "Commands", (Text((line,), "code"),))
    document = build(synthetic_run(60), "run")
    (tmp_path / "report.html").write_bytes(render_html(replace(document, sections=(own, *document.sections))))
    browser.ask("Emulation.setDeviceMetricsOverride", width=390, height=900, deviceScaleFactor=1, mobile=True)
    try:
        browser.open(tmp_path / "report.html")
        assert browser.run("document.documentElement.scrollWidth") == 390
    finally:
        browser.ask("Emulation.clearDeviceMetricsOverride")
