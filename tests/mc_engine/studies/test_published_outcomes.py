"""What became of a published value: the rule, number by number, and the command that shows it."""

import pytest
from typer.testing import CliRunner

from mc_engine.command_line.commands import app
from mc_engine.errors import ModelError
from mc_engine.studies.published import (
    CLOSE,
    IMPROVED,
    NOT_REACHED,
    REACHED,
    UNKNOWN,
    differing,
    half_a_unit,
    outcome,
    read_published,
    with_ours,
)
from mc_engine.studies.published_table import campaign_table

RECORD = {"quantity": "fuel", "published": 3.8, "unit": "kg", "ours": 3.84, "status": "legible"}
TEXT = """
[source]
campaign = "small"
work = "Somebody 2001"

[[published]]
quantity = "|dv|"
published = 1.5e-7
unit = "m/s"
column = "dv_m_s"
status = "restored"
reason = "half of it | is ours"
headline = true

[[published]]
quantity = "time"
published = "below 80"
unit = "s"
source = "Table 2"
column = "time_s"
at_most = 80.0
status = "legible"

[[published]]
quantity = "fuel"
published = 20.0
unit = "kg"
source = "Table 3"
column = "fuel_kg"
better = "less"
status = "legible"
reason = "of the optimum"

[[published]]
quantity = "gain"
published = "lost"
status = "lost"
"""
LOCK = '[ours]\n"|dv|" = -2.5e-7\ntime = 79.5\nfuel = 19.0\n'


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "small" / "published.toml"
    path.parent.mkdir()
    path.write_text(TEXT)
    path.with_name("published.lock.toml").write_text(LOCK)
    return path


@pytest.mark.parametrize(
    ("number", "half"), [(6431.5, 0.05), (706.0, 0.5), (5, 0.5), (2.5e-6, 0.5e-7), (0.0361, 5e-5), (1e22, 0.5)]
)
def test_half_a_unit_is_of_the_last_digit_that_is_written(number, half):
    assert half_a_unit(number) == pytest.approx(half, rel=1e-12)


def test_the_outcome_follows_from_both_numbers_and_the_print():
    for changes, expected in [
        ({}, REACHED),
        ({"ours": 3.86}, NOT_REACHED),
        ({"ours": 3.86, "tolerance": 0.1}, REACHED),
        ({"ours": 3.84, "tolerance": 0.01}, NOT_REACHED),
        ({"ours": 3.815, "tolerance": 0.01}, CLOSE),
        ({"ours": 3.785, "tolerance": 0.01}, CLOSE),
        ({"ours": 3.825, "tolerance": 0.01}, NOT_REACHED),
        ({"ours": 3.6, "better": "less"}, IMPROVED),
        ({"ours": 4.0, "better": "less"}, NOT_REACHED),
        ({"ours": 4.0, "better": "more"}, IMPROVED),
        ({"ours": 3.81, "better": "less"}, REACHED),
        ({"published": "zero", "ours": "zero"}, REACHED),
        ({"published": "zero", "ours": 1e-3}, NOT_REACHED),
        ({"published": "below 4", "at_most": 4.0}, REACHED),
        ({"published": "below 3", "at_most": 3.0}, NOT_REACHED),
        ({"published": "below 3.83", "at_most": 3.83}, CLOSE),
        ({"published": "2 to 3.8", "at_least": 2.0, "at_most": 3.7}, NOT_REACHED),
        ({"published": "at least 4", "at_least": 4.0}, NOT_REACHED),
        ({"published": "lost", "status": "lost"}, UNKNOWN),
        ({"published": "curve lost", "status": "curve lost"}, UNKNOWN),
        ({"status": "not printed"}, UNKNOWN),
    ]:
        assert outcome(RECORD | changes) == expected


@pytest.mark.parametrize(("other", "expected"), [(4.0, REACHED), (3.0, NOT_REACHED)])
def test_a_record_may_have_to_lie_below_our_value_of_another(other, expected):
    less = RECORD | {"published": "less than yesterday's", "below": "fuel of yesterday"}
    assert outcome(less, [less, {"quantity": "fuel of yesterday", "ours": other}]) == expected
    assert outcome(less, [less]) == UNKNOWN


@pytest.mark.parametrize(
    ("ours", "expected"), [(-2.0, REACHED), (2.0, REACHED), (4.8, NOT_REACHED), (0.1, NOT_REACHED)]
)
def test_the_farthest_of_many_cases_is_compared_by_its_distance_from_the_mean(ours, expected):
    """Printed 2 from the mean of 0, deviation 1: ours may lie 0.3 to 3.7 from our mean, on either side."""
    of = {"of": "x", "over": ["a"], "unit": "", "quantity": "x"}
    mean = of | {"statistic": "mean", "published": 0.0, "ours": 0.0}
    deviation = of | {"statistic": "standard deviation", "published": 1.0, "ours": 9.0}
    other = deviation | {"over": ["b"], "published": 100.0}
    farthest = of | {"statistic": "farthest", "published": 2.0, "ours": ours}
    assert outcome(farthest, [mean, deviation, other, farthest]) == expected


@pytest.mark.parametrize(
    ("sentence", "left"), [("half of it | is ours", "not reached"), ("of the optimum", "improved")]
)
def test_an_outcome_without_its_reason_is_an_error_that_names_the_record(file, sentence, left):
    file.write_text(TEXT.replace(f'reason = "{sentence}"\n', ""))
    with pytest.raises(ModelError, match=rf"small, published\.toml: '.*' is {left}; give its `reason`"):
        with_ours(file)


def test_the_table_of_a_campaign_has_every_record_with_its_outcome_and_what_is_improved_apart(file):
    table = campaign_table(file).splitlines()
    counts = "4 values: 1 reached, 0 close, 1 improved, 1 not reached, 1 unknown."
    assert table[0] == f"small: Somebody 2001. {counts}"
    assert table[4:] == [
        "| \\|dv\\| |  | 1.5e-7 m/s | −2.5e-7 m/s | **not reached**: half of it \\| is ours |",
        "| time | Table 2 | below 80 s | 79.5 s | reached |",
        "| gain |  | lost | – | unknown: lost |",
        "",
        "Improved by another computation than that of the source:",
        "",
        "| Quantity | Source | Published | Ours | Improved by | Outcome |",
        "|---|---|---|---|---|---|",
        "| fuel | Table 3 | 20 kg | 19 kg | 5 % | improved: of the optimum |",
    ]


def test_a_record_with_an_unknown_key_or_without_a_way_to_compute_ours_is_named(file):
    for edit, wrong in [
        (('at_most = 80.0', 'atmost = 80.0'), r"record 2 \('time'\): atmost"),
        (('column = "time_s"', 'ours = 79.5'), r"record 2 \('time'\): ours"),
        (('column = "time_s"\n', ''), r"record 2 \('time'\): has none of column, statistic, compute"),
        (('column = "time_s"', 'column = "time_s"\ncompute = "a:b"'), "has column and compute of"),
    ]:  # fmt: skip
        file.write_text(TEXT.replace(*edit))
        with pytest.raises(ModelError, match=wrong):
            read_published(file)


@pytest.mark.parametrize(
    ("value", "same"), [(3.84, True), (3.840001, True), (3.8401, False), (None, False), ("3.84", False)]
)
def test_a_computed_value_differs_from_the_kept_one_where_the_shown_digits_do(value, same):
    computed = {} if value is None else {"fuel": value}
    assert differing([RECORD], computed, {"fuel": 3.84}) == ([] if same else ["fuel"])


def test_the_command_shows_a_campaign_of_ones_own_and_writes_it_into_a_page(file, tmp_path):
    runner, page = CliRunner(), tmp_path / "page.md"
    assert "| gain |" in runner.invoke(app, ["published", str(file.parent)]).output
    page.write_text("<!-- published -->\n<!-- end -->\n")
    assert runner.invoke(app, ["published", str(file.parent), "--write", str(page)]).exit_code == 0
    assert page.read_text() == f"<!-- published -->\n{campaign_table(file)}\n<!-- end -->\n"
