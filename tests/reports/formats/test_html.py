"""The HTML page: complete in one file, and safe from what users write."""

import json
import re
from html.parser import HTMLParser

import pytest
from payloads import PAYLOADS, hostile
from synthetic_run import synthetic_run

from reports import build, render_html

MEGABYTE = 1_000_000


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


def test_the_page_of_ten_thousand_cases_is_below_three_and_a_half_megabytes(page):
    assert len(page.encode()) < 3.5 * MEGABYTE


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
    images = [attributes for _, attributes in Elements(page).found if attributes.get("role") == "group"]
    assert len(images) == page.count('<figure class="drawing"') >= 9
    assert all(len(attributes["aria-label"]) > 40 for attributes in images)


def test_the_page_is_the_same_twice(page):
    assert page == render_html(build(synthetic_run(), "run")).decode()


@pytest.fixture(scope="module")
def harmless():
    return render_html(build(hostile("harmless"), "run")).decode()


@pytest.mark.parametrize("payload", PAYLOADS)
def test_what_users_write_stays_text(payload, harmless):
    struck = render_html(build(hostile(payload), "run")).decode()

    def shape(page):
        return [(tag, sorted(attributes)) for tag, attributes in Elements(page).found if tag != "wbr"]

    assert shape(struck) == shape(harmless)
    for figure in figures(struck):
        assert "<" not in figure["layout"].get("title", {}).get("text", "")
        assert "<" not in figure["layout"]["xaxis"]["title"]["text"]
