import json
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mc_engine.campaign.reading import Findings, parse_toml, read_sections, shown
from mc_engine.errors import CampaignError

CAMPAIGN = '[campaign]\nmodel = "m.py"\ndesign = "mc"\ncases = 5\nseed = 0\n'


def read(text):
    found = Findings()
    sections = read_sections(tomllib.loads(text), found)
    return sections, {problem.place: problem.message for problem in found.problems}


def test_all_mistakes_are_found_in_one_pass():
    _, found = read("""
        retentoin = {}
        [campaign]
        modle = "m.py"
        design = "lsh"
        cases = true
        seed = -1
        [parameters]
        mass_kg = nan
        [dispersion.a]
        dist = "nromal"
        [dispersion.b]
        dist = "normal"
        sgima = 1.0
        sigma = -2
        [[correlation]]
        between = ["a"]
        rank = 1.5
        [requirement.fuel]
        metric = "m"
        share = 1.0
        confidence = 0
    """)
    assert found == {
        "retentoin": 'is not a section; did you mean "retention"?',
        "campaign.model": 'is missing: a module such as "campaigns.deorbit", or "model.py" beside this file',
        "campaign.modle": 'is not a known key; did you mean "model"?',
        "campaign.design": '"lsh" is not known; did you mean "lhs"?',
        "campaign.cases": "true is not a whole number",
        "campaign.seed": "-1 is not allowed; it must be at least 0",
        "parameters.mass_kg": "nan is not a finite number",
        "dispersion.a.dist": '"nromal" is not known; did you mean "normal"?',
        "dispersion.b.sgima": 'is not a known key; did you mean "sigma"?',
        "dispersion.b.sigma": "-2 is not allowed; it must be above 0",
        "correlation 1.between": "1 given; at least 2 needed",
        "correlation 1.rank": "1.5 is not allowed; it must be below 1",
        "requirement.fuel.share": "1.0 is not allowed; it must be below 1",
        "requirement.fuel.confidence": "0 is not allowed; it must be above 0",
    }


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("cases = 0", "0 is not allowed; it must be at least 1"),
        ("cases = -3", "-3 is not allowed; it must be at least 1"),
        ("cases = 2_000_000_000", "2000000000 is not allowed; it must be at most 1000000000"),
        ("cases = 1e4", "10000.0 is not a whole number; write 10000"),
        ("cases = 2.5", "2.5 is not a whole number"),
        ('cases = "many"', '"many" is not a whole number'),
        ("cases = false", "false is not a whole number"),
        ("cases = nan", "nan is not a whole number"),
    ],
)
def test_a_number_of_cases_that_is_none_is_refused(key, message):
    _, found = read(CAMPAIGN.replace("cases = 5", key))
    assert found == {"campaign.cases": message}


def test_zero_is_a_seed():
    sections, found = read(CAMPAIGN)
    assert (sections.campaign.seed, found) == (0, {})


@pytest.mark.parametrize("number", ["nan", "inf", "-inf"])
def test_a_number_that_is_not_finite_is_refused_everywhere(number):
    text = f"""
        [parameters]
        a = {number}
        [dispersion.b]
        dist = "normal"
        mean = {number}
        sigma = 1
        [dispersion.c]
        dist = "discrete"
        values = [1, {number}]
        [requirement.d]
        metric = "m"
        at_most = {number}
    """
    _, found = read(CAMPAIGN + text)
    assert list(found) == ["parameters.a", "dispersion.b.mean", "dispersion.c.values 2", "requirement.d.at_most"]
    assert set(found.values()) == {f"{number} is not a finite number"}


def test_numbers_of_astronomical_size_are_refused_before_they_overflow():
    _, found = read(CAMPAIGN + '[parameters]\na = 1e60\n[dispersion.b]\ndist = "normal"\nsigma = 1e-90\nmean = -1e90')
    assert list(found) == ["parameters.a", "dispersion.b.mean", "dispersion.b.sigma"]


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("[campaign]\nmodel = \n", "line 2, column 9"),
        ("[campaign]\nseed = 1\nseed = 2\n", "line 3, column 9"),
        ("[campaign\nseed = 1\n", "line 1, column 10"),
        ("seed = 1 # \x00", "line 1, column 12"),
        ('a = "', "end of document"),
    ],
)
def test_broken_toml_is_reported_with_line_and_column(text, place):
    with pytest.raises(CampaignError, match="this is not TOML") as caught:
        parse_toml(text, "x.toml")
    assert caught.value.problems[0].place == place


@pytest.mark.parametrize("text", ["a = " + "9" * 5000, "a = " + "[" * 100_000])
def test_toml_that_overwhelms_the_reader_is_refused(text):
    with pytest.raises(CampaignError, match="not TOML that can be read"):
        parse_toml(text, "x.toml")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("campaign = 3", "campaign"),
        ("parameters = []", "parameters"),
        ("dispersion = 1", "dispersion"),
        ("requirement = 'x'", "requirement"),
        ("correlation = {}", "correlation"),
        ("retention = 1", "retention"),
        ("[dispersion]\na = 3", "dispersion.a"),
        ("[dispersion]\na = {dist = 3}", "dispersion.a.dist"),
        ("[retention]\nhistories = 3", "retention.histories"),
    ],
)
def test_a_section_that_is_no_table_is_refused(text, place):
    _, found = read(text)
    assert place in found


def test_entries_of_a_list_are_counted_from_one():
    text = CAMPAIGN + '[retention]\nhistories = { worst = [{ metric = "a" }, { metrc = "b", side = "big" }] }'
    _, found = read(text)
    assert found == {
        "retention.histories.worst 2.metric": "is missing: a metric of the model",
        "retention.histories.worst 2.metrc": 'is not a known key; did you mean "metric"?',
        "retention.histories.worst 2.side": '"big" is not known; known are "largest", "smallest"',
    }


def test_a_single_worst_has_no_number_in_its_place():
    _, found = read(CAMPAIGN + '[retention]\nhistories = { worst = { metric = "a", count = 0 } }')
    assert found == {"retention.histories.worst.count": "0 is not allowed; it must be at least 1"}


def test_an_unprintable_name_does_not_reach_the_terminal():
    _, found = read(CAMPAIGN + '[dispersion."\\u001b[2J"]\ndist = "x"')
    assert list(found) == ['dispersion."\\u001b[2J".dist']
    assert shown("\x1b[2J") == '"\\u001b[2J"'


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)
KEYS = st.sampled_from(
    "campaign parameters dispersion correlation requirement retention dist one many histories worst between "
    "values normal sigma metric count design cases".split()
)
DOCUMENTS = st.recursive(
    JSON | st.sampled_from(["normal", "discrete", "mc", "grid"]),
    lambda inner: st.dictionaries(KEYS, inner, max_size=6) | st.lists(inner, max_size=2),
    max_leaves=30,
)


@given(document=st.dictionaries(KEYS, DOCUMENTS, max_size=6))
def test_no_document_makes_the_reader_stumble(document):
    found = Findings()
    read_sections(document, found)
    assert found.problems
    assert all(problem.message and json.dumps(str(problem)) for problem in found.problems)
