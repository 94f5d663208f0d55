"""The [tuning] of a campaign file: what it may say, and every mistake at once."""

import pytest
from toy import load, problems

DISPERSED = """
[dispersion.mass_kg]
dist = "normal"
sigma = 1.0
"""
TUNING = """
[tuning]
population = 8

[tuning.parameter.angle_deg]
lower = 10.0
upper = 80.0

[tuning.objective.far]
metric = "range_m"
goal = "maximise"

[tuning.objective.fuel]
metric = "propellant_kg"
quantile = 0.9

[tuning.constraint.near]
metric = "range_m"
at_most = 5.0
"""
GOOD = DISPERSED + TUNING
POINT = """
[[tuning.published]]
name = "Table 8"
values = { far = 1.0, fuel = 2.0 }
"""


def test_a_good_tuning_is_read_and_what_is_not_said_has_its_default():
    tuning = load(GOOD).tuning
    assert [parameter.name for parameter in tuning.parameters] == ["angle_deg"]
    assert [(objective.name, objective.goal, objective.quantile) for objective in tuning.objectives] == [
        ("far", "maximise", None),
        ("fuel", "minimise", 0.9),
    ]
    assert (tuning.population, tuning.generations, tuning.patience, tuning.seed) == (8, 60, None, None)
    assert tuning.nominal
    assert tuning.robust


# what is changed in GOOD, place, words
SLIPS = [
    ('metric = "range_m"\ngoal', 'metric = "rnage_m"\ngoal', "tuning.objective.far.metric", 'did you mean "range_m"?'),
    ("[dispersion.mass_kg]", "[dispersion.angle_deg]", "tuning.parameter.angle_deg", "chosen or dispersed, not both"),
    (DISPERSED, "", "tuning.objective.fuel.quantile", "nothing is dispersed"),
    ("lower = 10.0", "lower = 80.0", "tuning.parameter.angle_deg.lower", "80 is not below upper = 80"),
    ("objective.far", "objective.angle_deg", "tuning.objective.angle_deg", "is the name of a parameter already"),
    ("objective.far", "objective.feasible", "tuning.objective.feasible", "a column of every tuning"),
    ("at_most = 5.0", "at_most = 5.0\nat_least = 1.0\nquantile = 0.5", "tuning.constraint.near.quantile", "two limits"),
    ("[tuning.constraint.near]", "[tuning.constrain.near]", "tuning.constrain", 'did you mean "constraint"?'),
    ("[tuning.constraint.near]", "[[tuning.constraint]]", "tuning.constraint", "write [tuning.constraint.NAME]"),
]


@pytest.mark.parametrize(("old", "new", "place", "words"), SLIPS)
def test_a_slip_is_told_with_its_place(old, new, place, words):
    assert old in GOOD
    assert words in problems(GOOD.replace(old, new))[place]


def test_a_tuning_needs_something_to_tune_and_something_to_tune_for():
    assert "has no objective" in problems("[tuning]\n")["tuning"]
    assert "write [tuning.parameter.NAME]" in problems("[tuning]\nparameter = 3\n")["tuning.parameter"]


def test_a_quantile_needs_cases_drawn_at_random():
    body = GOOD.replace('dist = "normal"\nsigma = 1.0', "values = [99.0, 101.0]")
    assert "draws no cases at random" in problems(body, design="grid")["tuning.objective.fuel.quantile"]


def test_a_mistake_in_an_objective_is_none_of_the_points_that_have_a_number_for_it():
    body = GOOD.replace('goal = "maximise"', 'goal = "up"') + POINT
    assert list(problems(body)) == ["tuning.objective.far.goal"]


def test_a_published_point_has_a_number_for_every_objective():
    body = GOOD + '[[tuning.published]]\nname = "Table 8"\nvalues = { far = 1.0, fule = 2.0 }\n'
    messages = problems(body)
    assert 'did you mean "fuel"?' in messages["tuning.published 1.values.fule"]
    assert "is missing" in messages["tuning.published 1.values.fuel"]
