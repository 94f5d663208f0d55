"""Every published value of the shipped campaigns has an outcome, and README shows them as they stand."""

from pathlib import Path

import pytest

from mc_engine.model import load_model
from mc_engine.studies.published import OUTCOMES, outcome, read_published, read_source, with_ours
from mc_engine.studies.published_table import headline_table, published_files, written_into

README = Path(__file__).resolve().parents[1] / "README.md"
FILES = {path.parent.name: path for path in published_files()}
TABLES = {name: with_ours(path) for name, path in FILES.items()}
# the tables, figures, equations and works with results; all other tables of the sources are inputs
PLACES = {
    "deorbit": ["Table 2", "Table 3", "eq. 18", "eq. 23", "Fig. 7", "Fig. 8", "Fig. 9", "Fig. 10", "abstract"],
    "flexible_satellite": [
        "Table 4", "Table 5", "Table 8", "Table 9", "Table 12", "worst of 100", "eq. 19", "conclusions",
    ],
    "geo_injection": [f"Table {k}" for k in range(1, 9)],
    "geo_servicing": ["section 3.3", "section 9.1", "section 9.2", "section 9.3", "histogram", "start of the plots"],
    "reentry": [
        "case 1", "case 4", "case 6", "TR R-11", "Rep. 1381", "Rep. 1382", "2008-1198", "Standard Atmosphere", "Ogata",
        "eqs 7 to 13", "eqs 14 to 16", "eqs 17, 18", "chapter 2", "chapter 3", "R-532",
    ],
}  # fmt: skip


@pytest.mark.parametrize(("name", "place"), [(name, place) for name, places in PLACES.items() for place in places])
def test_every_table_and_figure_with_results_is_there(name, place):
    assert any(place in record["source"] for record in TABLES[name])


# numbers that stand together in a source, and how many there are of them
TOGETHER = {
    "flexible_satellite": {"optimum of Table 4": 5, "optimum of Table 8": 5, "optimum of Table 9": 10},
    "geo_injection": {"iterations": 3, ": burn ": 23, "propellant of burn": 12, "optimum, ": 10},
    "geo_servicing": {"3-sigma interval": 8, "histogram": 2, "coast before burn": 3, "length of burn": 3},
    "reentry": {"Apollo final phase: range to go": 11, "steep entry: load over": 2, "Stardust": 5},
}


@pytest.mark.parametrize(("name", "words"), [(name, words) for name, groups in TOGETHER.items() for words in groups])
def test_numbers_that_stand_together_are_all_there(name, words):
    assert sum(words in record["quantity"] for record in TABLES[name]) == TOGETHER[name][words]


def test_the_five_systems_have_published_values():
    assert set(FILES) == set(PLACES)


@pytest.mark.parametrize("name", FILES)
def test_a_source_is_named_and_has_headlines_that_are_told_apart(name):
    records = TABLES[name]
    assert read_source(FILES[name]).work
    assert 4 <= sum(record.get("headline", False) for record in records) <= 12
    assert len({record["quantity"] for record in records}) == len(records)


@pytest.mark.parametrize("name", FILES)
def test_every_record_has_an_outcome_and_a_value_of_ours_wherever_one_is_computed(name):
    """`with_ours` refuses a record that is close, improved or not reached and gives no reason."""
    for record in TABLES[name]:
        assert outcome(record, TABLES[name]) in OUTCOMES
        computed = any(way in record for way in ("column", "statistic", "compute"))
        assert computed == ("ours" in record), record["quantity"]


@pytest.mark.parametrize("name", FILES)
def test_the_model_carries_the_records_into_its_reports(name):
    assert load_model(f"campaigns.{name}").published == read_published(FILES[name])


def test_readme_is_in_step_with_the_command():
    table = headline_table(published_files())
    assert README.read_text(encoding="utf-8") == written_into(README, table), "mc-engine published --write README.md"
