"""The site builds without a word, needs no network, and its links lead somewhere."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from urllib.parse import unquote, urlsplit

FETCHED = {
    ("img", "src"),
    ("script", "src"),
    ("link", "href"),
    ("iframe", "src"),
    ("source", "src"),
    ("object", "data"),
}


class Page(HTMLParser):
    """What one page links to, what it loads by itself, and the places in it that can be linked to."""

    def __init__(self, path):
        super().__init__()
        self.path, self.links, self.loaded, self.places, self.styles = path, [], [], set(), ""
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.places.add(values.get("id"))
        self.styles += values.get("style") or ""
        self.links += [values["href"]] if tag == "a" and values.get("href") else []
        self.loaded += [value for name, value in attrs if (tag, name) in FETCHED and values.get("rel") != "canonical"]


def build(folder):
    return subprocess.run(
        [sys.executable, "-m", "mc_engine.documentation", str(folder)], capture_output=True, text=True, check=False
    )


def foreign(address):
    return bool(urlsplit(address).netloc) and not address.startswith("data:")


def broken_links(pages):
    """(page, link) of each that leads to no file, or to no place in it."""
    for page in pages.values():
        for link in [*page.links, *page.loaded]:
            parts = urlsplit(link)
            if parts.scheme:
                continue
            target = (page.path.parent / unquote(parts.path)).resolve() if parts.path else page.path
            place = unquote(parts.fragment)
            if not target.is_file() or (place and target in pages and place not in pages[target].places):
                yield page.path.name, link


def test_the_site_builds_without_a_word_and_needs_no_network(tmp_path):
    site = tmp_path / "site"
    built = build(site)
    assert (built.returncode, built.stderr) == (0, "")
    pages = {path.resolve(): Page(path) for path in site.rglob("*.html")}
    assert len(pages) > 30
    assert [(page.path.name, one) for page in pages.values() for one in page.loaded if foreign(one)] == []
    assert [page.path.name for page in pages.values() if "url(" in page.styles] == []
    for sheet in site.rglob("*.css"):
        text = sheet.read_text(encoding="utf-8")
        assert re.findall(r"@import[^;]*//[^;]*|url\(\s*['\"]?(?:https?:)?//[^)]*\)", text) == [], sheet.name
    assert list(broken_links(pages)) == []
