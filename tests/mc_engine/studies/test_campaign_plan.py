"""What a campaign's requirements take."""

import pytest

from mc_engine.studies.plan import plan_lines
from tests.mc_engine.campaign.toy import load

RANGE = '[requirement.range]\nmetric = "range_m"\nat_least = 1.0\nshare = 0.9973\nconfidence = 0.9\n'
FUEL = '[requirement.fuel]\nmetric = "propellant_kg"\nat_most = 1.0\nshare = 0.95\nconfidence = 0.95\n'
SPREAD = '[dispersion.mass_kg]\ndist = "normal"\nsigma = 1.0\n'


def plan(body, design="mc", cases=10_000, **options):
    campaign = load(body + SPREAD, design, cases=cases if design == "mc" else None)
    return list(plan_lines(campaign, **options))


def numbers(lines, heading):
    """The second word of the rows under the line that begins so, a heading between."""
    first = next(place for place, line in enumerate(lines) if line.startswith(heading)) + 2
    rows = [line.split() for line in lines[first:]]
    return [row[1] for row in rows[: next((k for k, row in enumerate(rows) if not row or row[0] != str(k)), None)]]


def test_each_requirement_has_the_smallest_samples_for_its_own_share():
    lines = plan(RANGE + FUEL)
    assert numbers(lines, "range:") == ["852", "1440", "1970", "2473", "2959", "3433"]
    assert numbers(lines, "fuel:") == ["59", "93", "124", "153", "181", "208"]
    assert any(line.startswith("  93 cases allow 1 failure; they pass") for line in plan(FUEL, cases=93))


def test_all_together_take_the_most_of_each_and_the_joint_share_less():
    lines = plan(RANGE + FUEL)
    assert numbers(lines, "every requirement") == ["852", "1440", "1970", "2473", "2959", "3433"]
    assert "all at once: share 0.9473 with confidence 0.9" in lines
    assert numbers(lines, "all at once")[0] == "43"
    heading = next(place for place, line in enumerate(lines) if "confidence shared among 3 (Bonferroni)" in line)
    assert lines[heading + 1].split() == ["0", "852", "1259"]  # ln(0.1 / 3) / ln(0.9973)
    assert numbers(plan(RANGE), "range:")[0] == "852"
    assert not any(line.startswith(("every", "all at once")) for line in plan(RANGE))


@pytest.mark.parametrize(
    ("cases", "words"),
    [
        (851, "851 in the file are too few, even if none fails: 852 are needed"),
        (10_000, "10,000 cases allow 19 failures"),
    ],
)
def test_the_files_own_number_of_cases_is_held_against_the_plan(cases, words):
    assert any(line.strip().startswith(words) for line in plan(RANGE, cases=cases))
