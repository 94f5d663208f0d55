"""The HTML page: complete in one file, and safe from what users write."""

import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import pytest
from synthetic_run import synthetic_run

from reports import build, render_html

MEGABYTE = 1_000_000
PAYLOADS = [
    "<script>alert(1)</script>",
    "</script><script>alert(2)</script>",
    "<!--<script>",
    "<img src=x onerror=alert(3)>",
    '" onmouseover="alert(4)',
    "' onfocus='alert(5)",
    "{{ 7 * 7 }}{% raw %}",
    "javascript:alert(6)",
    '<a href="javascript:alert(7)">x</a>',
    "]]><svg/onload=alert(8)>",
]


@pytest.fixture(scope="module")
def page():
    return render_html(build(synthetic_run(), "run")).decode()


class Elements(HTMLParser):
    """Tags with their attributes, scripts left out."""

    def __init__(self, text):
        super().__init__()
        self.found = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))


def figures(page):
    return json.loads(re.search(r'id="figures">(.*?)</script>', page, re.DOTALL)[1])


def test_the_page_of_ten_thousand_cases_is_below_eight_megabytes(page):
    assert len(page.encode()) < 8 * MEGABYTE


def test_nothing_is_loaded_from_anywhere(page):
    for _, attributes in Elements(page).found:
        for name in ("src", "href", "action", "data"):
            assert not re.match(r"(https?:)?//", attributes.get(name) or "")
    assert "default-src 'none'" in page


def test_every_panel_of_every_figure_has_its_place_and_its_data(page):
    places = {attributes["id"] for tag, attributes in Elements(page).found if attributes.get("class") == "panel"}
    assert places == {figure["id"] for figure in figures(page)}
    assert len(places) >= 10


def test_every_figure_has_an_alternative_text(page):
    images = [attributes for _, attributes in Elements(page).found if attributes.get("role") == "img"]
    assert len(images) == 8
    assert all(len(attributes["aria-label"]) > 40 for attributes in images)


def test_the_page_is_the_same_twice(page):
    assert page == render_html(build(synthetic_run(), "run")).decode()


@pytest.mark.parametrize("payload", PAYLOADS)
def test_what_users_write_stays_text(payload):
    hostile = render_html(build(_hostile(payload), "run")).decode()
    harmless = render_html(build(_hostile("harmless"), "run")).decode()

    def shape(page):
        return [(tag, sorted(attributes)) for tag, attributes in Elements(page).found if tag != "wbr"]

    assert shape(hostile) == shape(harmless)
    for figure in figures(hostile):
        assert "<" not in figure["layout"].get("title", {}).get("text", "")
        assert "<" not in figure["layout"]["xaxis"]["title"]["text"]


@pytest.mark.skipif(shutil.which("chromium") is None, reason="needs the Debian package chromium")
def test_a_browser_draws_every_panel_without_an_error(page, tmp_path):
    file = tmp_path / "report.html"
    file.write_text(page, encoding="utf-8")
    done = subprocess.run(
        ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
         "--disable-background-networking", "--disable-component-update", "--disable-sync", "--enable-logging=stderr",
         "--virtual-time-budget=10000", f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", file.as_uri()],
        capture_output=True, text=True, timeout=120, check=True,
    )  # fmt: skip
    drawn = Elements(done.stdout).found
    assert "CONSOLE" not in done.stderr
    titles = sum(attributes.get("class") == "main-svg" for _, attributes in drawn)
    assert titles >= len(figures(page))


def _hostile(text):
    """A run with the same text wherever a user may write."""
    run = synthetic_run(60, failed=5, figures=[
        {"kind": "map", "metric": "propellant_kg", "x": "ve_pct", "y": "oe_pct", "title": text},
        {"kind": "scatter", "x": "propellant_kg", "y": "peak_force_n", "title": text},
    ])  # fmt: skip
    manifest = run.manifest
    manifest["campaign"] |= {"name": text, "title": text, "model": text}
    manifest["model"] |= {"title": text, "source": text}
    manifest["requirements"][0]["name"] = text
    for record in [*manifest["inputs"], *manifest["parameters"], *manifest["columns"], *manifest["settings"]]:
        record["description"] = text
    manifest["inputs"][0]["source"] = manifest["published"][0]["note"] = manifest["published"][0]["quantity"] = text
    run.table.loc[run.table["status"] != "ok", "reason"] = text
    return run
