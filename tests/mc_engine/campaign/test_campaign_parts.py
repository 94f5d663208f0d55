import pytest
from toy import load, problems

from mc_engine.campaign.inputs import check_value
from mc_engine.campaign.parts import Requirement
from mc_engine.campaign.reading import Findings
from mc_engine.campaign.sections import HistoriesSection
from mc_engine.model import Setting

TWO = """
[dispersion.speed_pct]
dist = "normal"
sigma = 1
[dispersion.height_km]
dist = "uniform"
half_range = 1
"""
THIRD = '[dispersion.mass_kg]\ndist = "uniform"\nhalf_range = 1\n'
PAIRS = ('"speed_pct", "height_km"', '"speed_pct", "mass_kg"', '"height_km", "mass_kg"')
OPPOSED = [f"[[correlation]]\nbetween = [{pair}]\nrank = -0.7\n" for pair in PAIRS]
CONSTANT_MASS = '[dispersion.mass_kg]\ndist = "constant"\nvalue = 1'
FALLING_MASS = '[dispersion.mass_kg]\ndist = "discrete"\nvalues = [30, 20]\n'
DISCRETE_CONTROL = '[dispersion.control]\ndist = "discrete"\nvalues = ["off"]'
CORRELATION = '[[correlation]]\nbetween = ["speed_pct", "height_km"]\nrank = 0.3\n'


def test_parameters_override_numbers_words_and_switches():
    campaign = load('[parameters]\nmass_kg = 50\ncontrol = "off"\ndrag = false\nstep_s = 1\n')
    changed = {"mass_kg": 50.0, "control": "off", "drag": False, "step_s": 1.0}
    assert campaign.parameters == changed
    assert {name: campaign.nominal[name] for name in changed} == changed
    assert campaign.nominal["height_km"] == 10.0


def test_a_setting_that_counts_takes_whole_numbers_alone():
    count, findings = (
        Setting(2, "Number of thrusters", low=1, high=8, whole=True, name="thrusters", unit=""),
        Findings(),
    )
    assert check_value(4.0, count, findings, "") == 4.0
    assert check_value(2.5, count, findings, "") is None
    message = "2.5 is not a whole number; thrusters is Number of thrusters"
    assert [problem.message for problem in findings.problems] == [message]


def _with(partner, rank="0.3"):
    return TWO + CORRELATION.replace("height_km", partner).replace("0.3", rank)


def _required(lines):
    return f"[requirement.r]\n{lines}"


def _kept(histories):
    return f"[retention]\nhistories = {{ {histories} }}"


# what stands in the file, place, message
MISTAKES = [
    ("[parameters]\nmass_kg = -1", "parameters.mass_kg", "-1 is not allowed; the model accepts 0 kg and above"),
    ("[parameters]\nmass_kg = true", "parameters.mass_kg", "true is not a number; mass_kg is Mass [kg]"),
    ('[parameters]\ncontrol = "of"', "parameters.control", '"of" is not known; did you mean "off"?'),
    ("[parameters]\ndrag = 1", "parameters.drag", "1.0 is neither true nor false"),
    ("[parameters]\nstep_s = 0", "parameters.step_s", "0 is not allowed; the model accepts 0.01 to 10 s"),
    ("[parameters]\nmas_kg = 1", "parameters.mas_kg", 'is not a parameter of toy; did you mean "mass_kg"?'),
    ("[parameters]\ndrag_area_m2 = 60", "parameters",
     "the nominal case cannot be flown: the drag area is larger than the sky"),
    (_with("heigth_km"), "correlation 1.between", '"heigth_km" is not dispersed; did you mean "height_km"?'),
    (_with("speed_pct"), "correlation 1.between", '"speed_pct" is there twice'),
    (TWO + CORRELATION + CORRELATION.replace(PAIRS[0], '"height_km", "speed_pct"'), "correlation 2.between",
     '"height_km" and "speed_pct" have a correlation already'),
    (_with("height_km", "1.0"), "correlation 1.rank", "1.0 is not allowed; it must be below 1"),
    (_with("height_km", "-1.0"), "correlation 1.rank", "-1.0 is not allowed; it must be above -1"),
    (_with("height_km", "0.9999999999"), "correlation", "no numbers can be correlated like this: "
     "speed_pct ~ height_km = 0.9999999999 (the matrix is not positive definite)"),
    (TWO + THIRD + "".join(OPPOSED), "correlation", "no numbers can be correlated like this: "
     "speed_pct ~ height_km = -0.7, speed_pct ~ mass_kg = -0.7, height_km ~ mass_kg = -0.7 "
     "(the matrix is not positive definite)"),
    (_with("mass_kg") + CONSTANT_MASS, "correlation 1.between", '"mass_kg" is constant; it cannot be correlated'),
    (_with("mass_kg") + FALLING_MASS, "correlation 1.between",
     'the values of "mass_kg" must rise to be correlated; sort them, each with its weight'),
    (_with("control") + DISCRETE_CONTROL, "correlation 1.between",
     '"control" is a setting; only parameters can be correlated'),
    (_required('metric = "range_m"'), "requirement.r", "has no limit; give at_most, at_least or both"),
    ('[requirement.completed]\nmetric = "range_m"\nat_most = 1', "requirement.completed",
     "is what the share of completed cases is called; give it another name"),
    (_required('metric = "rang_m"\nat_most = 1'), "requirement.r.metric",
     '"rang_m" is not a metric of toy; did you mean "range_m"?'),
    (_required('metric = "range_m"\nat_most = 1\nat_least = 2'), "requirement.r.at_least", "2 is above at_most = 1"),
    (_required('metric = "range_m"\nat_most = true'), "requirement.r.at_most", "true is not a number"),
    (_required("at_most = 1"), "requirement.r.metric", "is missing: a metric of the model"),
    (_required('metric = "range_m"\nat_most = 1\nshare = 1'), "requirement.r.share",
     "1 is not allowed; it must be below 1"),
    (_required('metric = "range_m"\nat_most = 1\nconfidence = 0.0'), "requirement.r.confidence",
     "0.0 is not allowed; it must be above 0"),
    (_kept('worst = { metric = "fuel_kg" }'), "retention.histories.worst.metric",
     '"fuel_kg" is not a metric of toy; known are "range_m", "propellant_kg"'),
    (_kept('worst = [{ metric = "range_m" }, { metric = "rnge_m" }]'), "retention.histories.worst 2.metric",
     '"rnge_m" is not a metric of toy; did you mean "range_m"?'),
    (_kept("cases = [3, 100]"), "retention.histories.cases", "there is no case 100; they are 0 to 99"),
    (_kept("first = true"), "retention.histories.first", "true is not a whole number"),
]  # fmt: skip


def test_a_part_of_the_file_that_does_not_fit_the_model_is_refused_with_its_place_and_the_reason():
    for body, place, message in MISTAKES:
        assert problems(body) == {place: message}


GROUPED = '[sensitivity]\ncases = 64\ngroup = { both = ["speed_pct", "height_km"] }\n'


@pytest.mark.parametrize("places", [["dispersion.speed_pct.sigma"], ["campaign.design"]], ids=["dispersion", "design"])
def test_a_dispersion_with_a_mistake_is_not_said_to_be_missing_where_it_is_named(places):
    body = TWO.replace("sigma = 1", "sigma = -1") if places[0].startswith("dispersion") else TWO
    design = "mc" if body != TWO else "mcc"
    assert list(problems(body + CORRELATION + GROUPED, design)) == places
    rest = CORRELATION.replace("height_km", "heigth_km") + GROUPED
    assert list(problems(body + rest, design)) == [*places, "correlation 1.between"]


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


def test_retention_names_first_worst_and_single_cases():
    campaign = load("""
        [retention]
        histories = { nominal = false, first = 3, cases = [17, 5], worst = [
            { metric = "propellant_kg", count = 2 }, { metric = "range_m", side = "smallest" }] }
    """)
    worst = [{"metric": "propellant_kg", "count": 2}, {"metric": "range_m", "side": "smallest"}]
    kept = HistoriesSection.model_validate({"nominal": False, "first": 3, "cases": [17, 5], "worst": worst})
    assert (campaign.retention, campaign.retention.rows) == (kept, 1500)
    assert [(of.metric, of.count, of.side) for of in kept.worst_of] == [
        ("propellant_kg", 2, None),
        ("range_m", 5, "smallest"),
    ]
