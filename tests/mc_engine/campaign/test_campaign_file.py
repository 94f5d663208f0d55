import json

import pytest

from mc_engine.campaign.sections import DISTRIBUTIONS, CampaignFile, schema


def test_the_schema_is_json_and_names_every_section_and_distribution():
    text = json.dumps(schema())
    assert set(schema()["properties"]) == set(CampaignFile.model_fields)
    assert all(f'"const": "{name}"' in text for name in DISTRIBUTIONS)


def test_the_schema_forbids_unknown_keys_as_the_reader_does():
    definitions = schema()["$defs"]
    assert all(one["additionalProperties"] is False for one in definitions.values())


@pytest.mark.parametrize("name", DISTRIBUTIONS)
def test_every_distribution_takes_a_source(name):
    assert {"source", "note", "unit"} <= DISTRIBUTIONS[name].model_fields.keys()
