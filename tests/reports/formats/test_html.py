"""The HTML page: complete in one file, and safe from what users write."""

import base64
import json
import re
from html.parser import HTMLParser

import pytest
from payloads import ONE_BY_ONE, hostile
from synthetic_run import synthetic_run

from reports import build, render_html
from reports.text.numbers import count

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


def case_record(page):
    return json.loads(re.search(r'id="case-data">(.*?)</script>', page, re.DOTALL)[1])


def test_a_page_holds_all_cases_while_their_inputs_and_key_metrics_are_four_hundred_thousand_numbers():
    record = case_record(render_html(build(synthetic_run(30_000), "run")).decode())
    assert record["ids"] == [0, 30_000]
    assert 160_000 < 30_000 * len(record["columns"]) <= 400_000


def test_a_page_that_cannot_hold_all_cases_says_how_many_it_counts():
    page = render_html(build(synthetic_run(90_000), "run")).decode()
    held = len(base64.b64decode(case_record(page)["outcome"]["bdata"]))
    assert 0 < held < 90_000
    assert f"This page holds {count(held)} of {count(90_000)} cases, and counts no others." in page


def test_what_the_curve_of_a_case_is_drawn_over_is_sent_once(page):
    assert "behind" not in case_record(page)
    panels = [figure for figure in figures(page) if figure.get("quantity")]
    assert panels
    for panel in panels:
        drawn = [trace["name"] for trace in panel["data"]]
        others = [drawn[place] for place in range(len(drawn)) if place not in panel["behind"]]
        assert any(name == "nominal" for name in others)
        assert all(name.startswith(("nominal", "case ")) for name in others)


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


def test_a_long_name_may_break_so_that_it_pushes_no_verdict_off_the_page():
    name = "apoapsis_within_the_capability_of_the_orbit_trim_manoeuvres"
    fuel = {"name": name, "metric": "propellant_kg", "at_most": 2.5, "at_least": None, "share": 0.9, "confidence": 0.9}
    text = render_html(build(synthetic_run(200, failed=0, requirements=[fuel]), "run")).decode()
    cells = re.findall(r'<td class="text[^>]*>([^<]*_.*?)</td>|<span class="label">([^<]*_.*?)</span>', text)
    assert {"".join(found).partition("<small>")[0] for found in cells} == {name.replace("_", "_<wbr>")}


def test_the_page_is_the_same_twice(page):
    assert page == render_html(build(synthetic_run(), "run")).decode()


@pytest.fixture(scope="module")
def harmless():
    return render_html(build(hostile("harmless"), "run")).decode()


@pytest.mark.parametrize("payload", ONE_BY_ONE)
def test_what_users_write_stays_text(payload, harmless):
    struck = render_html(build(hostile(payload), "run")).decode()

    def shape(page):
        return [(tag, sorted(attributes)) for tag, attributes in Elements(page).found if tag != "wbr"]

    assert shape(struck) == shape(harmless)
    for figure in figures(struck):
        assert "<" not in figure["layout"].get("title", {}).get("text", "")
        assert "<" not in figure["layout"]["xaxis"]["title"]["text"].replace("<br>", "")  # the page's own line ends
