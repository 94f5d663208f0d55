"""Every count of cases in a report is that of the table: on all shipped campaigns, each flown with a few cases."""

import re
import tomllib
from dataclasses import fields, is_dataclass

import numpy as np
import pytest

from mc_engine.campaign import load_campaign
from mc_engine.campaign_search import list_campaigns
from mc_engine.runner import run
from reports.contents import build

QUICK = ("reentry", "minimal")
CASES = 120
NUMBER = r"(\d[\d\u202f]*)"
COUNTS = (
    re.compile(NUMBER + r" inside all limits"),  # outcome sentences
    re.compile(r"inside all limits: " + NUMBER),  # keys of figures
    re.compile(r"all at once.{0,400}?" + NUMBER + r" of \d[\d\u202f]* cases inside", re.DOTALL),
)


def flyable():
    for one in list_campaigns():
        if "tuning" not in tomllib.loads(one.path.read_text()):
            yield pytest.param(one.name, marks=[] if one.name in QUICK else pytest.mark.slow)


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


@pytest.mark.parametrize("name", list(flyable()))
def test_every_count_of_a_report_is_that_of_the_table(name, tmp_path):
    campaign = load_campaign(name)
    if campaign.design in ("mc", "lhs", "sobol", "halton"):
        campaign = load_campaign(name, cases=CASES)
    store = run(campaign, tmp_path / "run")
    table, records = store.cases(), store.manifest["requirements"]
    document = build(store, "run")
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
    for caption, classes in corridors(document):
        of = [
            one
            for one in records
            if f" {one['name']}," in f" {inside_class(classes)}," or "all limits" in classes[0][0]
        ]
        assert classes[0][1] == int(inside(table, of).sum()), caption


def rows_of(document):
    section = next(one for one in document.sections if one.anchor == "requirements")
    return list(section.blocks[0].rows) if hasattr(section.blocks[0], "rows") else []


def corridors(document):
    for section in document.sections:
        for block in section.blocks:
            if hasattr(getattr(block, "drawing", None), "classes"):
                yield block.caption, block.drawing.classes


def inside_class(classes):
    return re.sub(r"^inside the limits? of ", "", classes[0][0])
