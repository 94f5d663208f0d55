import json
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mc_engine.campaign.reading import Findings, parse_toml, read_sections
from mc_engine.errors import CampaignError, Problem

CAMPAIGN = '[campaign]\nmodel = "m.py"\ndesign = "mc"\ncases = 5\nseed = 0\n'


def read(text):
    findings = Findings()
    sections = read_sections(tomllib.loads(text), findings)
    return sections, {problem.place: problem.message for problem in findings.problems}


def test_all_mistakes_are_found_in_one_pass():
    _, messages = read("""
        retentoin = {}
        [campaign]
        modle = "m.py"
        design = "lsh"
        cases = true
        seed = -1
        [settings]
        step_s = 0.1
        [parameters]
        mass_kg = nan
        [dispersion.a]
        dist = "nromal"
        [dispersion.b]
        dist = "normal"
        low = 0.0
        high = 2.0
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
    assert messages == {
        "retentoin": 'is not a section; did you mean "retention"?',
        "settings": "is not a section; settings are given in [parameters]",
        "campaign.model": 'is missing: a module such as "campaigns.deorbit", or "model.py" beside this file',
        "campaign.modle": 'is not a known key; did you mean "model"?',
        "campaign.design": '"lsh" is not known; did you mean "lhs"?',
        "campaign.cases": "true is not a whole number",
        "campaign.seed": "-1 is not allowed; it must be at least 0",
        "parameters.mass_kg": "nan is not a finite number",
        "dispersion.a.dist": '"nromal" is not known; did you mean "normal"?',
        "dispersion.b.low": 'is not a known key; did you mean "lower"?',
        "dispersion.b.high": 'is not a known key; did you mean "upper"?',
        "dispersion.b.sgima": 'is not a known key; did you mean "sigma"?',
        "dispersion.b.sigma": "-2 is not allowed; it must be above 0",
        "correlation 1.between": "1 given; at least 2 needed",
        "correlation 1.rank": "1.5 is not allowed; it must be below 1",
        "requirement.fuel.share": "1.0 is not allowed; it must be below 1",
        "requirement.fuel.confidence": "0 is not allowed; it must be above 0",
    }


def test_a_number_of_cases_that_is_none_is_refused():
    for key, message in [
        ("cases = 0", "0 is not allowed; it must be at least 1"),
        ("cases = -3", "-3 is not allowed; it must be at least 1"),
        ("cases = 2_000_000_000", "2000000000 is not allowed; it must be at most 1000000000"),
        ("cases = 1e4", "10000.0 is not a whole number; write 10000"),
        ("cases = 1e30", "1e+30 is not allowed; it must be at most 1000000000"),
        ("cases = -2.0", "-2.0 is not allowed; it must be at least 1"),
        ("cases = 2.5", "2.5 is not a whole number"),
        ('cases = "many"', '"many" is not a whole number'),
        ("cases = false", "false is not a whole number"),
        ("cases = nan", "nan is not a whole number"),
    ]:
        _, messages = read(CAMPAIGN.replace("cases = 5", key))
        assert messages == {"campaign.cases": message}


def test_broken_toml_is_reported_with_line_and_column():
    for text, place in [
        ("[campaign]\nmodel = \n", "line 2, column 9"),
        ("[campaign]\nseed = 1\nseed = 2\n", "line 3, column 9"),
        ("[campaign\nseed = 1\n", "line 1, column 10"),
        ("seed = 1 # \x00", "line 1, column 12"),
        ('a = "', "end of document"),
    ]:
        with pytest.raises(CampaignError, match="this is not TOML") as caught:
            parse_toml(text, "x.toml")
        assert caught.value.problems[0].place == place


def test_a_word_with_a_line_break_is_told_in_one_line():
    """As of a string in three quotes whose end stands on the next line."""
    _, messages = read(CAMPAIGN + '[dispersion.a]\ndist = """normal\n"""\n')
    (place,) = messages
    assert str(Problem(place, messages[place])) == r'dispersion.a.dist: "normal\n" is not known; did you mean "normal"?'


def test_usual_mistakes_in_toml_are_told_with_their_fix():
    for text, message in [
        ("[campaign]\ndesign = mc\n", "invalid value; a text stands in quotes, a truth value is true or false"),
        ("[campaign]\nseed = 1\nseed = 2\n[x]", "cannot overwrite a value; a name stands once in its section"),
        ("[dispersion.mass_kg]\n[dispersion.mass_kg]\n", "cannot declare [dispersion.mass_kg] twice"),
        ("[report]\n[report]\n", "cannot declare [report] twice"),
        ("[a.\"('b')\"]\n[a.\"('b')\"]\n", "cannot declare [a.('b')] twice"),
    ]:
        with pytest.raises(CampaignError) as caught:
            parse_toml(text, "x.toml")
        assert caught.value.problems[0].message.startswith(f"this is not TOML: {message}")


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
    findings = Findings()
    read_sections(document, findings)
    assert findings.problems
    assert all(problem.message and json.dumps(str(problem)) for problem in findings.problems)
