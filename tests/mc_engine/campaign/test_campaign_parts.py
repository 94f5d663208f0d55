import pytest
from toy import load, problems

from mc_engine.campaign.parts import Requirement, Retention, Worst

TWO = """
[dispersion.speed_pct]
dist = "normal"
sigma = 1
[dispersion.height_km]
dist = "uniform"
half_range = 1
"""
CONSTANT_MASS = '[dispersion.mass_kg]\ndist = "constant"\nvalue = 1'
DISCRETE_CONTROL = '[dispersion.control]\ndist = "discrete"\nvalues = ["off"]'
CORRELATION = '[[correlation]]\nbetween = ["speed_pct", "height_km"]\nrank = 0.3\n'


def test_parameters_override_numbers_words_and_switches():
    campaign = load('[parameters]\nmass_kg = 50\ncontrol = "off"\ndrag = false\nstep_s = 1\n')
    changed = {"mass_kg": 50.0, "control": "off", "drag": False, "step_s": 1.0}
    assert campaign.parameters == changed
    assert {name: campaign.nominal[name] for name in changed} == changed
    assert campaign.nominal["height_km"] == 10.0


@pytest.mark.parametrize(
    ("line", "place", "message"),
    [
        ("mass_kg = -1", "parameters.mass_kg", "-1 is not allowed; the model accepts 0 kg and above"),
        ("mass_kg = true", "parameters.mass_kg", "true is not a number; mass_kg is Mass [kg]"),
        ('control = "of"', "parameters.control", '"of" is not known; did you mean "off"?'),
        ("drag = 1", "parameters.drag", "1.0 is neither true nor false"),
        ("step_s = 0", "parameters.step_s", "0 is not allowed; the model accepts 0.01 to 10 s"),
        ("mas_kg = 1", "parameters.mas_kg", 'is not a parameter of toy; did you mean "mass_kg"?'),
        ("drag_area_m2 = 60", "parameters", "the nominal case cannot be flown: the drag area is larger than the sky"),
    ],
)
def test_a_wrong_nominal_value_is_refused(line, place, message):
    assert problems(f"[parameters]\n{line}\n") == {place: message}


def _with(partner, rank="0.3"):
    return CORRELATION.replace("height_km", partner).replace("0.3", rank)


@pytest.mark.parametrize(
    ("body", "place", "message"),
    [
        (_with("heigth_km"), "correlation 1.between", '"heigth_km" is not dispersed; did you mean "height_km"?'),
        (_with("speed_pct"), "correlation 1.between", '"speed_pct" is there twice'),
        (CORRELATION * 2, "correlation 2.between", '"speed_pct" and "height_km" have a correlation already'),
        (_with("height_km", "1.0"), "correlation 1.rank", "1.0 is not allowed; it must be below 1"),
        (_with("height_km", "-1.0"), "correlation 1.rank", "-1.0 is not allowed; it must be above -1"),
        (_with("height_km", "0.9999999999"), "correlation", "no numbers can be correlated like this"),
        (_with("mass_kg") + CONSTANT_MASS, "correlation 1.between", '"mass_kg" is constant'),
        (_with("control") + DISCRETE_CONTROL, "correlation 1.between", '"control" is a setting'),
    ],
)
def test_a_correlation_that_cannot_be_is_refused(body, place, message):
    found = problems(TWO + body)
    assert list(found) == [place]
    assert found[place].startswith(message)


def test_a_matrix_that_is_not_positive_definite_is_refused_with_its_entries():
    body = TWO + '[dispersion.mass_kg]\ndist = "uniform"\nhalf_range = 1\n'
    for pair in ('"speed_pct", "height_km"', '"speed_pct", "mass_kg"', '"height_km", "mass_kg"'):
        body += f"[[correlation]]\nbetween = [{pair}]\nrank = -0.7\n"
    message = problems(body)["correlation"]
    assert "speed_pct ~ height_km = -0.7" in message
    assert "not positive definite" in message


@pytest.mark.parametrize("design", ["grid", "one_at_a_time"])
def test_a_design_without_chance_has_no_correlations(design):
    axes = "[dispersion.speed_pct]\nvalues = [1]\n[dispersion.height_km]\nvalues = [1]\n"
    assert problems(axes + CORRELATION, design)["correlation"].startswith(f'the design "{design}" has no chance in it')


def test_a_latin_hypercube_needs_room_for_its_correlations():
    message = '19 is not allowed; "lhs" with these correlations needs at least 20'
    assert problems("cases = 19\n" + TWO + CORRELATION, "lhs") == {"campaign.cases": message}
    assert problems("cases = 20\n" + TWO + CORRELATION, "lhs") == {}


def test_requirements_have_the_share_and_confidence_of_three_sigma_unless_said():
    campaign = load('[requirement.fuel]\nmetric = "propellant_kg"\nat_most = 2.5\nsource = "tank"')
    assert campaign.requirements == (Requirement("fuel", "propellant_kg", 2.5, None, 0.9973, 0.90, "tank"),)


@pytest.mark.parametrize(
    ("body", "place", "message"),
    [
        ('metric = "range_m"', "", "has no limit; give at_most, at_least or both"),
        ('metric = "rang_m"\nat_most = 1', ".metric", '"rang_m" is not a metric of toy; did you mean "range_m"?'),
        ('metric = "range_m"\nat_most = 1\nat_least = 2', ".at_least", "2 is above at_most = 1"),
        ('metric = "range_m"\nat_most = true', ".at_most", "true is not a number"),
        ("at_most = 1", ".metric", "is missing: a metric of the model"),
        ('metric = "range_m"\nat_most = 1\nshare = 1', ".share", "1 is not allowed; it must be below 1"),
        ('metric = "range_m"\nat_most = 1\nconfidence = 0.0', ".confidence", "0.0 is not allowed; it must be above 0"),
    ],
)
def test_a_requirement_that_cannot_be_judged_is_refused(body, place, message):
    assert problems(f"[requirement.r]\n{body}") == {f"requirement.r{place}": message}


def test_retention_names_first_worst_and_single_cases():
    campaign = load("""
        [retention]
        histories = { nominal = false, first = 3, cases = [17, 5], worst = [
            { metric = "propellant_kg", count = 2 }, { metric = "range_m", side = "smallest" }] }
    """)
    worst = (Worst("propellant_kg", 2, None), Worst("range_m", 5, "smallest"))
    assert campaign.retention == Retention(False, 3, worst, (17, 5))
    metric, n_cases, side = campaign.retention.worst[0]
    assert (metric, n_cases, side) == ("propellant_kg", 2, None)


@pytest.mark.parametrize(
    ("histories", "place", "message"),
    [
        ('worst = { metric = "fuel_kg" }', "worst.metric", '"fuel_kg" is not a metric of toy'),
        (
            'worst = [{ metric = "range_m" }, { metric = "rnge_m" }]',
            "worst 2.metric",
            '"rnge_m" is not a metric of toy',
        ),
        ("cases = [3, 100]", "cases", "there is no case 100; they are 0 to 99"),
        ("first = true", "first", "true is not a whole number"),
    ],
)
def test_retention_of_what_is_not_there_is_refused(histories, place, message):
    found = problems(f"[retention]\nhistories = {{ {histories} }}")
    assert list(found) == [f"retention.histories.{place}"]
    assert found[f"retention.histories.{place}"].startswith(message)
