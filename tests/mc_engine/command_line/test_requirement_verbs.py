"""The verbs that plan for requirements, and fly until they are decided."""

from cart import CAMPAIGN, call, fails_with


def test_plan_reads_the_requirements_of_a_campaign(here):
    result = call("plan", "cart", "--failures", "1")
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert lines[0] == "cart: 20 cases, design mc"
    assert lines[2] == "reach: share 0.9973 with confidence 0.9"
    assert lines[4].split()[:2] == ["1", "1440"]
    assert "20 in the file are too few, even if none fails: 852 are needed" in result.stdout


def test_until_takes_one_word_and_a_campaign_that_can_be_judged_on_the_way(here):
    fails_with(2, call("run", "cart", "--until", "tomorrow"), '"tomorrow" is not known')
    (here / "cart" / "campaign.toml").write_text(CAMPAIGN.replace('"mc"', '"lhs"'))
    fails_with(2, call("run", "cart", "--until", "verdict", "--out", "a"), 'cases of "lhs" are not independent')
    assert not (here / "a").exists()


def test_a_share_or_confidence_next_to_one_never_reads_as_one(here):
    said = call("plan", "--share", "0.9", "--confidence", "0.999999999999", "--failures", "0")
    assert said.stdout.startswith("share 0.9 with confidence 0.999999999999\n")
    fails_with(2, call("plan", "--share", "0.9999999999999", "--confidence", "0.9"), "--share is 0.9999999999999; it")
