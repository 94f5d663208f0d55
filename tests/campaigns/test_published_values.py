"""Our side of the published values: what is kept beside a campaign is what the campaign computes."""

import pytest

from mc_engine.studies.published import differing, kept_values, read_published
from mc_engine.studies.published_table import published_file
from mc_engine.studies.published_values import computed_values

CAMPAIGNS = ["deorbit", "flexible_satellite", "geo_injection", "geo_servicing", "reentry"]


def kept_and_records(path, slow):
    """Kept values and records, of the slow records or of the others; records without a value of ours are left out."""
    records = [record for record in read_published(path) if bool(record.get("slow")) == slow]
    quantities = {record["quantity"] for record in records}
    return {name: value for name, value in kept_values(path).items() if name in quantities}, records


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_recomputed_values_are_the_kept_ones_to_the_digits_that_are_shown(name):
    path = published_file(name)
    kept, records = kept_and_records(path, slow=False)
    assert differing(records, computed_values(path, slow=False), kept) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["flexible_satellite"])
def test_recomputed_slow_values_are_the_kept_ones_to_the_digits_that_are_shown(name):
    pytest.importorskip("pymoo")
    path = published_file(name)
    kept, records = kept_and_records(path, slow=True)
    computed = computed_values(path)
    assert kept
    assert differing(records, {name: computed[name] for name in kept}, kept) == []


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_every_kept_value_is_of_a_record(name):
    path = published_file(name)
    assert set(kept_values(path)) <= {record["quantity"] for record in read_published(path)}
