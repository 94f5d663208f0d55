import numpy as np
import pytest
from toy import HEAD, HERE, load, problems

from mc_engine.campaign.cases import case_table
from mc_engine.sampling.distributions import (
    Beta,
    Constant,
    Discrete,
    Exponential,
    Lognormal,
    Normal,
    Triangular,
    Truncated,
    Uniform,
)


def distribution(body, name="height_km"):
    return load(f"[dispersion.{name}]\n{body}").dispersions[0].distribution


def problem(body, name="height_km", design="mc", **options):
    """Key -> message, the keys without the name of the dispersion."""
    found = problems(f"[dispersion.{name}]\n{body}", design, **options)
    return {place.removeprefix(f"dispersion.{name}").lstrip("."): message for place, message in found.items()}


MIXTURE = "needs lower and upper, or half_range, not a mixture of them"
IDLE = "belongs to half_range; lower and upper already say it all"
BELOW = "-1 is not allowed; it must be at least 0"
NEGATIVE = "-1 is not allowed; the model accepts 0 kg and above"
OUTSIDE = "of the draws would be outside 0 kg and above; cut with lower and upper"
NO_LEVELS = 'the design "mc" has no levels; they are for grid and one_at_a_time'
NOT_FOR_SETTINGS = '"normal" does not fit a setting, which all cases of a batch share; use "discrete"'


# The nominal height is 10 km, that of the drag area 1 m^2.
def test_a_dispersion_is_read_in_the_unit_of_its_parameter():
    for body, expected in [
        ('dist = "normal"\nsigma = 2', Normal(10.0, 2.0)),
        ('dist = "normal"\nthree_sigma = 6\nmean = 3', Normal(3.0, 2.0)),
        ('dist = "normal"\nsigma = 2\nlower = 8', Truncated(Normal(10.0, 2.0), 8.0, np.inf)),
        (
            'dist = "normal"\nsigma = 250\nmean = 500\nupper = 750\nunit = "m"',
            Truncated(Normal(0.5, 0.25), -np.inf, 0.75),
        ),
        ('dist = "uniform"\nhalf_range = 2', Uniform(8.0, 12.0)),
        ('dist = "uniform"\nlower = 1\nupper = 2', Uniform(1.0, 2.0)),
        ('dist = "uniform"\nhalf_range = 500\nmean = 1000\nunit = "m"', Uniform(0.5, 1.5)),
        ('dist = "triangular"\nhalf_range = 2', Triangular(8.0, 10.0, 12.0)),
        ('dist = "triangular"\nlower = 1\nmode = 2\nupper = 4', Triangular(1.0, 2.0, 4.0)),
        ('dist = "lognormal"\nlog_sigma = 0.1', Lognormal(10.0, 0.1)),
        ('dist = "lognormal"\nmedian = 3000\nlog_sigma = 0.1\nunit = "m"', Lognormal(3.0, 0.1)),
        ('dist = "lognormal"\nmean = 3\nsigma = 1', Lognormal.from_moments(3.0, 1.0)),
        ('dist = "beta"\nalpha = 2\nbeta = 3\nlower = 500\nupper = 700\nunit = "m"', Beta(2.0, 3.0, 0.5, 0.7)),
        ('dist = "exponential"\nscale = 2', Exponential(10.0, 2.0)),
        ('dist = "exponential"\nscale = 2\norigin = 0', Exponential(0.0, 2.0)),
        ('dist = "discrete"\nvalues = [1, 2.5]', Discrete((1.0, 2.5), (1.0, 1.0))),
        ('dist = "discrete"\nvalues = [500, 700]\nweights = [1, 3]\nunit = "m"', Discrete((0.5, 0.7), (1.0, 3.0))),
        ('dist = "constant"\nvalue = 4', Constant(4.0)),
    ]:
        assert distribution(body) == expected


def test_parameters_move_the_nominal_value_that_a_distribution_is_about():
    campaign = load('[parameters]\nheight_km = 30\n[dispersion.height_km]\ndist = "normal"\nsigma = 1')
    assert campaign.dispersions[0].distribution == Normal(30.0, 1.0)


# what stands in [dispersion.height_km], key, message
MISTAKES = [
    ('dist = "normal"', "", "needs sigma or three_sigma"),
    ('dist = "normal"\nsigma = 1\nthree_sigma = 3', "", "needs sigma or three_sigma, not both"),
    ('dist = "normal"\nsigma = 0', "sigma", "0 is not allowed; it must be above 0"),
    ('dist = "normal"\nsigma = 1\nlower = 5\nupper = 4', "lower", "5 is not below upper = 4"),
    ('dist = "normal"\nsigma = 1\nlower = 5\nupper = 5', "lower", "5 is not below upper = 5"),
    ('dist = "normal"\nsigma = 1\nlower = 50', "lower", "the bounds leave nothing of the distribution"),
    ('dist = "normal"\nsigma = 1\nupper = -50', "upper", "the bounds leave nothing of the distribution"),
    ('dist = "normal"\nsigma = 1\nunit = "kg"', "unit",
     '"kg" is not a unit of length; known are "m", "um", "mm", "cm", "km"'),
    ('dist = "normal"\nsigma = 1\nunit = "%"', "unit",
     '"%" is not a unit of length; known are "m", "um", "mm", "cm", "km"; spreads are absolute: convert a '
     "percentage of the nominal value"),
    ('dist = "normal"\nsigma = 1\nunit = "Km"', "unit", '"Km" is not a unit of length; did you mean "km"?'),
    ('dist = "uniform"\nlower = 2', "", MIXTURE),
    ('dist = "uniform"\nhalf_range = 1\nupper = 2', "", MIXTURE),
    ('dist = "uniform"\nlower = 2\nupper = 1', "lower", "2 is not below upper = 1"),
    ('dist = "uniform"\nlower = 1\nupper = 2\nmean = 1', "mean", IDLE),
    ('dist = "uniform"\nminimum = 1\nupper = 2', "minimum", 'is not a known key; did you mean "lower"?'),
    ('dist = "triangular"\nlower = 1\nupper = 2', "mode", "the nominal value 10 is not between 1 and 2"),
    ('dist = "lognormal"\nmedian = 3', "", "needs median with log_sigma, or mean with sigma"),
    ('dist = "lognormal"\nmedian = 3\nsigma = 1', "", "needs median with log_sigma, or mean with sigma"),
    ('dist = "beta"\nalpha = 1\nbeta = 1\nlower = 2\nupper = 1', "lower", "2 is not below upper = 1"),
    ('dist = "beta"\nalpha = 2\nbeta = 1e16\nlower = 1\nupper = 2', "beta",
     "1e+16 is not allowed; it must be at most 1e+12"),  # SciPy answers NaN, and cases flew with it
    ('dist = "discrete"\nvalues = [1, 2]\nweights = [1]', "weights", "1 weight for 2 values"),
    ('dist = "discrete"\nvalues = [1, 2]\nweights = [1, 2, 3]', "weights", "3 weights for 2 values"),
    ('dist = "discrete"\nvalues = [1, 2]\nweights = [0, 0]', "weights", "are all zero"),
    ('dist = "discrete"\nvalues = [1, 2]\nweights = [5e-324, 0]', "weights", "are too small"),
    ('dist = "discrete"\nvalues = [1, 2]\nweights = [1, -1]', "weights 2", BELOW),
    ('dist = "discrete"\nvalues = [1, "x"]', "values 2", '"x" is not a number; height_km is Height [km]'),
    ('dist = "discrete"\nvalues = []', "values", "0 given; at least 1 needed"),
    ('dist = "constant"\nvalue = true', "value", "true is not a number; height_km is Height [km]"),
    ('dist = "normal"\nsigma = 1\nlevels = 5', "levels", NO_LEVELS),
    *((f'dist = "{body}', "", f"the spread is too small for the digits of {centre}: all values would be equal")
      for body, centre in [('normal"\nmean = 1e30\nsigma = 1', "1e+30"), ('lognormal"\nlog_sigma = 1e-20', "10"),
                           ('uniform"\nhalf_range = 1e-20', "10"), ('exponential"\nscale = 1e-20', "10")]),
    ("sigma = 1", "sigma", 'is a key of "normal", "lognormal"; dist is missing'),
    ("value = 4", "value", 'is a key of "constant"; dist is missing'),
]  # fmt: skip
# of other inputs: name, what stands there, key, message
MISTAKES_OF_OTHERS = [
    ("mass_kg", 'dist = "uniform"\nlower = -1\nupper = 5', "", "reaches -1 to 5; the model accepts 0 kg and above"),
    ("mass_kg", 'dist = "constant"\nvalue = -1', "value", NEGATIVE),
    ("mass_kg", 'dist = "discrete"\nvalues = [1, -1]', "values 2", NEGATIVE),
    ("mass_kg", 'dist = "normal"\nsigma = 50', "", f"0.023 {OUTSIDE}"),
    ("mass_kg", 'dist = "normal"\nsigma = 17', "", f"2e-09 {OUTSIDE}"),
    ("speed_pct", 'dist = "lognormal"\nlog_sigma = 0.1', "median",
     "the nominal value 0 is not above 0, as a log-normal must be"),
    ("mass_kg", 'dist = "normal"\nsigma = 50\nlower = -10', "", f"0.009 {OUTSIDE}"),
    ("mass_kg", 'dist = "exponential"\nscale = 5\norigin = -5', "", f"0.63 {OUTSIDE}"),
    ("control", 'dist = "discrete"\nvalues = ["off", "cliped"]', "values 2",
     '"cliped" is not known; did you mean "clipped"?'),
    ("control", 'dist = "discrete"\nvalues = [true]', "values 1", 'true is not one of "continuous", "clipped", "off"'),
    ("drag", 'dist = "discrete"\nvalues = [true, 1]', "values 2", "1.0 is neither true nor false"),
    ("step_s", 'dist = "discrete"\nvalues = [0.5, 20]', "values 2",
     "20 is not allowed; the model accepts 0.01 to 10 s"),
    ("control", 'dist = "normal"\nsigma = 1', "dist", NOT_FOR_SETTINGS),
]  # fmt: skip
# the same of an axis of a grid
MISTAKES_OF_AXES = [
    ("half_range = 3", "", "needs values = [...] or levels = n for the grid"),
    ("levels = 3", "", "needs lower and upper, or half_range, or three_sigma, and only one of these"),
    ("levels = 3\nlower = 1", "", "needs lower and upper, or half_range, or three_sigma, and only one of these"),
    ("levels = 3\nlower = 2\nupper = 1", "lower", "2 is not below upper = 1"),
    ("levels = 3\nhalf_range = 1e-20", "",
     "the spread is too small for the digits of 10: all values would be equal"),
    ("levels = 1\nhalf_range = 1", "levels", "1 is not allowed; it must be at least 2"),
    ("levels = 3\nvalues = [1]", "levels", "there are values already; give one of the two"),
    ("values = [true]", "values 1", "true is not a number; height_km is Height [km]"),
    *((f"values = [1, 2]\n{key} = 1", key, "belongs to levels = n; values already say it all")
      for key in ("mean", "half_range", "three_sigma", "lower", "upper")),
    *((f"{body}\nvalues = [1, 2]", "values", f"do not go with {body.splitlines()[0]}; leave one of the two out")
      for body in ('dist = "normal"\nsigma = 1', 'dist = "uniform"\nhalf_range = 1')),
    *((f'dist = "constant"\nvalue = 1\n{line}', line.split()[0],
       "belongs to an axis of several levels; a constant has one, its value")
      for line in ("levels = 3", "values = [2, 3]")),
]  # fmt: skip


def test_a_wrong_dispersion_is_refused_with_the_reason():
    for body, key, message in MISTAKES:
        assert problem(body) == {key: message}
    for name, body, key, message in MISTAKES_OF_OTHERS:
        assert problem(body, name) == {key: message}
    for body, key, message in MISTAKES_OF_AXES:
        assert problem(body, design="grid") == {key: message}
    assert problem("levels = 3\nlower = -1\nupper = 5", "mass_kg", "grid") == {"": NEGATIVE}


def test_a_tail_of_one_in_a_thousand_million_is_cut_at_the_range_of_the_parameter():
    # 100 kg with sigma 15 kg: below zero lies 1.3e-11.
    assert distribution('dist = "normal"\nsigma = 15', "mass_kg") == Truncated(Normal(100.0, 15.0), 0.0, np.inf)


def levels(body, design="grid", name="height_km"):
    return load(f"[dispersion.{name}]\n{body}", design).dispersions[0].levels


def test_a_grid_takes_values_or_equal_steps_between_bounds():
    for body, expected in [
        ("values = [1, 2, 4]", (1.0, 2.0, 4.0)),
        ("lower = 1\nupper = 2\nlevels = 3", (1.0, 1.5, 2.0)),
        ("half_range = 2\nlevels = 5", (8.0, 9.0, 10.0, 11.0, 12.0)),
        ("three_sigma = 2\nlevels = 2", (8.0, 12.0)),
        ("half_range = 2\nmean = 3\nlevels = 2", (1.0, 5.0)),
        ('half_range = 500\nlevels = 3\nunit = "m"', (9.5, 10.0, 10.5)),
        ('dist = "normal"\nsigma = 1\nlevels = 3', (7.0, 10.0, 13.0)),
        ('dist = "normal"\nsigma = 1\nlower = 9\nupper = 12\nlevels = 2', (9.0, 12.0)),
        ('dist = "uniform"\nhalf_range = 1\nlevels = 2', (9.0, 11.0)),
        ('dist = "discrete"\nvalues = [3, 4]', (3.0, 4.0)),
        ('dist = "discrete"\nvalues = [3, 4, 5]\nweights = [1, 0, 2]', (3.0, 5.0)),
        ('dist = "constant"\nvalue = 3', (3.0,)),
    ]:
        assert levels(body) == pytest.approx(expected)
    assert levels("half_range = 2", "one_at_a_time") == (8.0, 12.0)


@pytest.mark.parametrize(
    ("design", "body"),
    [
        ("mc", 'dist = "uniform"\nlower = 10\nupper = 35\nunit = "cm"'),  # 35 cm is 0.35000000000000003 m
        ("mc", 'dist = "beta"\nalpha = 2\nbeta = 2\nlower = 10\nupper = 35\nunit = "cm"'),
        ("mc", 'dist = "discrete"\nvalues = [10, 35]\nunit = "cm"'),
        ("mc", 'dist = "constant"\nvalue = 35\nunit = "cm"'),
        ("mc", 'dist = "empirical"\nfile = "lengths.csv"\nunit = "cm"'),
        ("mc", 'dist = "uniform"\nhalf_range = 17.5\nunit = "cm"'),  # about 0.175 m: 0 to 0.35 m
        ("mc", 'dist = "triangular"\nmode = 0.21\nhalf_range = 0.14'),  # 0.35 is the next number below the sum
        ("grid", 'values = [10, 35]\nunit = "cm"'),
        ("one_at_a_time", 'half_range = 17.5\nunit = "cm"'),
        ("table", 'unit = "cm"'),
    ],
)
def test_an_end_of_the_range_is_reached_in_any_unit_and_by_any_sum(tmp_path, design, body):
    """The message was "reaches 0.1 to 0.35; the model accepts 0 to 0.35 m"."""
    toy = (
        (HERE / "toy.py")
        .read_text()
        .replace('height_km=Parameter(10.0, "Height")', 'length_m=Parameter(0.175, "L", low=0.0, high=0.35)')
    )
    for name, text in {"toy.py": toy, "lengths.csv": "length_m\n10\n35\n"}.items():
        (tmp_path / name).write_text(text)
    head = HEAD + ('table = "lengths.csv"\n' if design == "table" else "")
    campaign = load(f"[dispersion.length_m]\n{body}", design, directory=tmp_path, head=head)
    drawn = case_table(campaign, np.arange(campaign.cases))["length_m"]
    ends = campaign.dispersions[0].distribution.support if design == "mc" else (drawn.min(), drawn.max())
    assert (ends[1], drawn.max() <= 0.35, ends[0] >= 0.0) == (0.35, True, True)
