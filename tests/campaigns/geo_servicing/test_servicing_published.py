"""The table of published values: ours computed again, every verdict held."""

import tomllib
from pathlib import Path

import pytest
from servicing_flights import MODEL, NOMINAL, fly_one

import campaigns.geo_servicing

FILE = Path(campaigns.geo_servicing.__file__).with_name("published.toml")
RECORDS = tomllib.loads(FILE.read_text(encoding="utf-8"))["published"]
STATUSES = {"legible", "re-derived", "not reproduced"}
SINGLE = [record for record in RECORDS if "column" in record]
IDS = [record["quantity"] for record in SINGLE]
DIGITS = 1e-4  # ours is written to five digits and more; rounding of the integration lies far below


@pytest.mark.parametrize("record", SINGLE, ids=IDS)
def test_our_number_is_what_the_campaign_computes(record):
    assert fly_one(**record["at"])[record["column"]] == pytest.approx(record["ours"], rel=DIGITS)


@pytest.mark.parametrize("record", SINGLE, ids=IDS)
def test_our_number_lies_in_the_printed_digits_unless_it_is_said_not_to(record):
    inside = abs(record["ours"] - record["published"]) <= record["tolerance"]
    assert inside == (record["status"] != "not reproduced")


@pytest.mark.parametrize("record", RECORDS, ids=[record["quantity"] for record in RECORDS])
def test_each_record_is_complete_and_in_the_unit_of_its_column(record):
    assert {"quantity", "published", "unit", "source", "status"} <= set(record)
    assert record["status"] in STATUSES
    assert set(record.get("at", {})) | set(record.get("over", ())) <= set(NOMINAL)
    units = {field.name: field.unit for field in MODEL.metrics}
    assert units[record.get("column", record.get("of"))] == record["unit"]


def test_the_model_carries_the_records_into_its_reports():
    assert MODEL.published == tuple(RECORDS)
    assert len({record["quantity"] for record in RECORDS}) == len(RECORDS)
