"""How numbers and names are written."""

import math

import pytest

from reports.text.numbers import (
    axis_label,
    beside_limit,
    column_texts,
    count,
    exact,
    fixed,
    given_percent,
    interval,
    limit_number,
    named,
    number,
    p_value,
    percent,
    percentile,
    spelled,
    typeset,
    with_unit,
    words,
)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-1.5, "−1.5"),
        (2.30559, "2.3056"),
        (7800.0, "7800"),
        (123456.0, "123\u202f456"),
        (1.23456e-6, "1.235·10⁻⁶"),
        (-4.2e12, "−4.2·10¹²"),
        (math.nan, "not a number"),
        (-math.inf, "−∞"),
        (None, "–"),
    ],
)
def test_a_number_has_five_significant_digits_and_a_true_minus_sign(value, text):
    assert number(value) == text


def test_digits_follow_the_spread_so_that_mean_and_limits_can_be_compared():
    assert number(7800.0012, scale=0.03) == "7800.0012"
    assert number(350.0, scale=2.86) == "350.00"
    assert number(231.4, scale=140.0) == "231"


def test_a_value_far_below_its_spread_is_written_like_its_neighbours():
    assert number(5.79e-5, scale=0.0213) == "0.0001"
    assert number(-3.891e-5, scale=0.00131) == "−0.00004"
    assert number(5.79e-5, scale=2e-5) == "5.79·10⁻⁵"


def test_values_of_a_narrow_column_have_the_same_decimals():
    assert column_texts([0.0003248, 0.00032436, 0.00032495]) == ["0.00032480", "0.00032436", "0.00032495"]


def test_equal_julian_dates_of_a_column_keep_their_fraction():
    """Half a day was rounded up to the next day."""
    assert column_texts([2459000.5000030, 2459000.5000029]) == ["2\u202f459\u202f000.5"] * 2
    assert column_texts([2459000.0, None]) == ["2\u202f459\u202f000", "–"]
    assert column_texts([1.0 / 3.0, 1.0 / 3.0]) == ["0.3333", "0.3333"]


def test_whole_numbers_of_a_column_have_no_decimals():
    assert column_texts([0.0, 1.0, None, 1.0]) == ["0", "1", "–", "1"]
    assert column_texts([0.0, 1.0, 0.5]) == ["0.00", "1.00", "0.50"]


def test_what_rounds_to_zero_has_no_sign():
    assert [fixed(value, 2) for value in (-0.004, 0.004, -0.006)] == ["0.00", "0.00", "−0.01"]


def test_no_number_has_more_than_eleven_digits_however_narrow_the_spread():
    assert number(7800.00119612, scale=1e-6) == "7800.0011961"


def test_bounds_of_a_julian_date_are_not_rounded_beyond_its_limits():
    """To eight digits these are 0.4 and 0.6, beyond limits of 0.46 and 0.54 that all cases are inside of."""
    assert interval(2460000.49932, 2460000.50048, 0.00972) == "[2\u202f460\u202f000.4993, 2\u202f460\u202f000.5005]"


@pytest.mark.parametrize(
    ("share", "text"), [(0.9973, "99.73"), (1.0, "100"), (0.0, "0"), (0.999988, "99.998"), (0.97699, "97.69")]
)
def test_a_share_is_never_rounded_up(share, text):
    assert percent(share) == f"{text}\u202f%"


@pytest.mark.parametrize(
    ("share", "text"),
    [(0.9973, "99.73"), (1.0, "100"), (0.0, "0"), (0.001351, "0.14"), (1e-9, "0.01"), (0.99994, "99.994")],
)
def test_an_upper_bound_is_never_rounded_down(share, text):
    assert percent(share, up=True) == f"{text}\u202f%"


@pytest.mark.parametrize(
    ("share", "text"),
    [
        (0.99996833, "99.996833"), (0.9, "90"), (0.99865, "99.865"), (0.9973, "99.73"), (0.00135, "0.135"),
        (2.0 * 0.95 - 1.0, "90"), (1e-12, "0.0000000001"), (0.999999999999, "99.9999999999"),
    ],
)  # fmt: skip
def test_a_share_that_was_given_has_all_its_digits(share, text):
    assert given_percent(share) == f"{text}\u202f%"
    assert percentile(share).startswith(f"{text}")


@pytest.mark.parametrize(
    ("probability", "name"),
    [(0.01, "1st"), (0.02, "2nd"), (0.5, "50th"), (0.11, "11th"), (0.21, "21st"), (0.13, "13th"), (0.9973, "99.73rd"),
     (0.975, "97.5th"), (0.99865, "99.865th")],
)  # fmt: skip
def test_a_percentile_has_the_ending_of_its_last_digits(probability, name):
    assert percentile(probability) == f"{name} percentile"


def test_a_p_value_is_never_zero():
    assert (p_value(0.0123), p_value(0.0)) == ("0.012", "<\u202f1·10⁻¹²")


def test_a_count_is_grouped_in_threes():
    assert [fixed(value, 1) for value in (9999.0, 10000.0, -12345.67)] == ["9999.0", "10\u202f000.0", "−12\u202f345.7"]
    assert count(1234567) == "1\u202f234\u202f567"


def test_an_interval_says_when_the_cases_are_too_few():
    assert interval(None, None) == "too few cases"
    assert interval(1.0, None) == "[1, –]"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (246.0, "246"),
        (0.0175, "0.0175"),
        (1e-8, "1·10⁻⁸"),
        (-1e9, "−1·10⁹"),
        (12345678.5, "1.23456785·10⁷"),
        (10000000.0, "1·10⁷"),
        (9999999.0, "9999999"),
        (True, "yes"),
        ("off", "off"),
    ],
)
def test_an_input_is_written_as_it_was_given(value, text):
    assert exact(value) == text


@pytest.mark.parametrize(
    ("name", "meaning", "label"),
    [
        ("sun right ascension", "of the Sun", "sun right ascension"),
        ("failure time", "when one engine fails; beyond the landing, none", "failure time"),
        ("misalignment", "of the thrust, from the nozzle", "misalignment"),
        ("ve", "VE: error of the burn's magnitude", "VE: error of the burn's magnitude"),
        ("tip x", "tip-off rate; about x", "tip x: tip-off rate"),
        ("kp", "", "kp"),
        ("kp", "a meaning that is longer than there is room for on an axis", "kp"),
    ],
)
def test_an_axis_says_the_name_in_words_and_of_a_symbol_the_meaning_too(name, meaning, label):
    assert named(name, meaning) == label


def test_a_column_name_becomes_words_without_its_unit():
    assert words("correction_impulse_m_s", "m/s") == "correction impulse"
    assert words("odd_name", "furlong") == "odd name"
    assert axis_label("propellant", "kg") == "propellant [kg]"


@pytest.mark.parametrize(
    ("unit", "printed"),
    [("W/m^2", "W/m²"), ("km^3/s^2", "km³/s²"), ("kg m^2", "kg\u202fm²"), ("uN", "µN"), ("deg/sqrt(h)", "deg/√h"),
     ("Ohm", "Ω"), ("us", "µs"), ("bar", "bar"), ("m/s", "m/s")],
)  # fmt: skip
def test_units_are_printed_with_raised_powers_and_greek_letters(unit, printed):
    assert typeset(unit) == printed
    assert axis_label("load", unit) == f"load [{printed}]"
    assert with_unit("1", unit) == f"1\u202f{printed}"


def test_a_number_that_is_nothing_beside_the_spread_is_0():
    assert number(6.66e-16, 4, 0.35) == "0"
    assert number(6.66e-16, 4) == "6.66·10⁻¹⁶"
    assert number(-2e-6, 4, 1e-5) != "0"


def test_days_are_counted_and_parts_of_other_units_stay():
    assert with_unit("1", "day") == "1\u202fday"
    assert with_unit("10", "day") == "10\u202fdays"
    assert axis_label("time", "day") == "time [days]"
    assert typeset("deg/day") == "deg/day"


def test_the_words_of_a_distribution_have_printed_signs_and_powers():
    found = [spelled(text) for text in ("normal, mean = -2, σ = 5e-4 m^2", "uniform, -2 to 1 day", "any, 3e+07")]
    assert found == [
        "normal, mean\xa0=\xa0−2, σ\xa0=\xa05·10⁻⁴\u202fm²",
        "uniform, −2 to 1\u202fdays",
        "any, 3·10⁷",
    ]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2.5, "2.5"),
        (2460000.500003, "2\u202f460\u202f000.500003"),
        (123456.7, "123\u202f456.7"),
        (2460000.5000003, "2\u202f460\u202f000.5000003"),
        (12345000.0, "1.2345·10⁷"),
        (10000004.0, "1.0000004·10⁷"),
        (1.2345e-5, "1.2345·10⁻⁵"),
        (1234567.890123, "1\u202f234\u202f567.890123"),
        (1234567.890123 / 1000.0, "1234.567890123"),  # 1234.5678901229999 km: no wider than it was given in m
        (2.5 / 86400.0, "2.8935185·10⁻⁵"),  # converted
        (2599850.0 / 86400.0, "30.090856"),  # days: in five digits it would be beyond a bound of 30.0909, which fails
        (100.0 / 3.0, "33.333333"),
        (-1e50, "−1·10⁵⁰"),
    ],
)
def test_a_limit_has_the_digits_that_it_was_given(value, text):
    assert limit_number(value) == text


def test_what_is_compared_with_a_limit_shows_how_far_it_is_from_it():
    assert beside_limit(2460000.4999983613, 1.36e-6, up=True) == "2\u202f460\u202f000.4999984"
    assert beside_limit(1.91234, 0.59, up=False) == "1.9123"
    assert beside_limit(6431.49, 0.011, up=True) == "6431.49"
    assert beside_limit(2.0, None, up=True) == beside_limit(2.0, 0.0, up=False) == "2"


@pytest.mark.parametrize(
    ("value", "down", "up"),
    [
        (2.3449, "2.34", "2.35"),
        (-2.3449, "−2.35", "−2.34"),
        (9.996, "9.99", "10"),
        (2.5, "2.5", "2.5"),
        (2.0 - 1.92, "0.08", "0.08"),  # 0.08000000000000007: no more than rounding of the difference
        (10.0 - 9.93, "0.07", "0.07"),  # 0.07000000000000028
        (1.23456e-6, "1.234·10⁻⁶", "1.235·10⁻⁶"),
        (-4.20001e12, "−4.201·10¹²", "−4.2·10¹²"),
        (0.0, "0", "0"),
    ],
)
def test_a_bound_is_rounded_to_its_own_side(value, down, up):
    digits = 5 if "·" in up else 3
    assert (number(value, digits, up=False), number(value, digits, up=True)) == (down, up)


def test_an_interval_in_print_holds_the_interval():
    assert interval(2.30559, 2.40551) == "[2.3055, 2.4056]"
    assert interval(-1.23456, 1.23451, scale=1.0) == "[−1.24, 1.24]"
