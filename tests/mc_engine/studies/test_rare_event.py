"""Rare events of campaigns: against plain cases and a closed form, from the command line, and what is refused."""

import math
import re
import signal
from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate, optimize, stats
from typer.testing import CliRunner

from mc_engine.campaign.cases import case_table, full_inputs
from mc_engine.campaign.loading import load_campaign
from mc_engine.campaign.search import SHIPPED
from mc_engine.command_line.commands import app
from mc_engine.errors import CampaignError, RunInterrupted
from mc_engine.flight.flight import fly
from mc_engine.physics.constants import EQUATORIAL_RADIUS, MU_EARTH
from mc_engine.sampling.correlation import normal_correlation
from mc_engine.sampling.distributions import Discrete, Empirical, Normal
from mc_engine.section import ReportSection
from mc_engine.statistics.rare_events import Evaluated, RareEvent
from mc_engine.studies.limit_state import OWN_COLUMNS, LimitState, chosen_requirement
from mc_engine.studies.rare_event import METHODS, _failed_inputs, estimate_rare_event
from mc_engine.studies.rare_event_folder import open_rare_event, probability_words, rare_event_lines

MINIMAL = SHIPPED / "minimal"


def minimal(at_least=645.8, text=""):
    """The smallest campaign with another limit: a thousandth of its cases is below 645.8 km."""
    toml = (MINIMAL / "campaign.toml").read_text().replace("at_least = 600.0", f"at_least = {at_least}") + text
    return load_campaign("minimal", text=toml, directory=MINIMAL)


def apogee_km(magnitude_pct, pitch_deg):
    """Altitude of the apogee by the conic section; Curtis, Orbital Mechanics, 3rd ed., eq. (2.50) and (2.71)."""
    r, dv, pitch = EQUATORIAL_RADIUS + 300e3, 100.0 * (1.0 + 0.01 * magnitude_pct), math.radians(pitch_deg)
    radial, along = dv * math.sin(pitch), math.sqrt(MU_EARTH / r) + dv * math.cos(pitch)
    energy = 0.5 * (radial**2 + along**2) - MU_EARTH / r
    eccentricity = math.sqrt(1.0 + 2.0 * energy * (r * along) ** 2 / MU_EARTH**2)
    return (-MU_EARTH / (2.0 * energy) * (1.0 + eccentricity) - EQUATORIAL_RADIUS) / 1000.0


def probability_below(limit_km):
    """Normal size of the burn (sigma 1 %), uniform pitch within 2 degrees: one integral over the pitch."""

    def at(pitch):
        size = optimize.brentq(lambda pct: apogee_km(pct, pitch) - limit_km, -50.0, 50.0, xtol=1e-10)
        return stats.norm.cdf(size)

    return integrate.quad(at, -2.0, 2.0, epsrel=1e-6)[0] / 4.0


@pytest.fixture(scope="module")
def estimate(tmp_path_factory):
    return estimate_rare_event(minimal(), out=tmp_path_factory.mktemp("rare") / "out", workers=1)


def test_plain_cases_of_the_campaign_agree(estimate):
    campaign, n = minimal(), 200_000
    ids = np.arange(n)
    flown = fly(
        campaign.model, full_inputs(campaign, case_table(campaign, ids)), ids, campaign.seed, folder=campaign.directory
    )
    share = np.mean(flown["apogee_altitude_km"] < 645.8)
    result, three_sigma = estimate.result, 3.0 * math.sqrt(1e-3 / n)
    assert result["lower"] - three_sigma <= share <= result["upper"] + three_sigma
    assert share == pytest.approx(probability_below(645.8), abs=three_sigma)


@pytest.mark.parametrize("method", ["subset", "cross-entropy"])
def test_a_millionth_on_the_model_itself_is_that_of_the_integral(tmp_path, method):
    record = estimate_rare_event(minimal(639.9), out=tmp_path / "out", method=method, workers=1)
    result, failed, p = record.result, record.cases[record.cases["failed"]], probability_below(639.9)
    assert 5e-7 < p < 2e-6
    assert result["lower"] <= p <= result["upper"]
    assert result["cases"] < 0.1 / p
    size = next(entry for entry in result["inputs"] if entry["name"] == "magnitude_error_pct")
    assert size["likeliest"] == pytest.approx(size["likeliest_sigma"], rel=1e-6)  # sigma is 1 %
    assert size["likeliest_sigma"] < -4.0
    assert size["mean_sigma"] == pytest.approx(np.average(failed["magnitude_error_pct"], weights=failed["weight"]))


def test_the_directory_holds_every_case_with_what_it_came_to(estimate):
    cases, result = estimate.cases, estimate.result
    assert cases.attrs["units"]["apogee_altitude_km"] == "km"
    assert len(cases) == result["cases"]
    assert (cases["failed"] == (cases["apogee_altitude_km"] < 645.8)).all()
    assert cases.loc[cases["failed"], "weight"].sum() == pytest.approx(result["probability"], rel=1e-12)
    row = cases[cases["failed"]].iloc[0]
    again = apogee_km(row["magnitude_error_pct"], row["pitch_error_deg"])
    assert again == pytest.approx(row["apogee_altitude_km"], abs=0.01)
    np.testing.assert_allclose(cases["margin"], cases["apogee_altitude_km"] - 645.8, atol=1e-9)


def test_the_result_does_not_depend_on_the_threads(estimate, tmp_path):
    again = estimate_rare_event(minimal(), out=tmp_path / "out", workers=2)
    assert again.result == estimate.result
    assert again.cases.equals(estimate.cases)


def test_the_interval_holds_with_the_confidence_of_the_campaigns_report(estimate, tmp_path):
    assert estimate.result["confidence"] == minimal().report.confidence == 0.9
    surer = replace(minimal(), report=ReportSection(confidence=0.99))
    other = estimate_rare_event(surer, out=tmp_path / "out", workers=1).result
    assert other["probability"] == estimate.result["probability"]
    assert other["lower"] < estimate.result["lower"] < estimate.result["upper"] < other["upper"]


def test_the_upper_end_holds_with_the_confidence_that_the_requirement_asks_for(estimate, tmp_path):
    (requirement,) = minimal().requirements
    surer = replace(minimal(), requirements=(replace(requirement, confidence=0.999),))
    result = estimate_rare_event(surer, out=tmp_path / "out", workers=1).result
    assert result["confidence"] == 0.998  # an upper end of the interval alone then holds with 0.999
    assert result["upper"] > estimate.result["upper"]
    assert "with 99.9 % confidence, so it is" in probability_words(result)


def test_inputs_have_the_distributions_and_correlations_of_the_campaign():
    text = '\n[[correlation]]\nbetween = ["magnitude_error_pct", "pitch_error_deg"]\nrank = 0.6\n'
    campaign = minimal(text=text)
    limit = LimitState(campaign, campaign.requirements[0])
    u = np.random.default_rng(1).standard_normal((20_000, 2))
    inputs, plain = limit.inputs(u), case_table(campaign, np.arange(20_000))
    for name in limit.names:
        assert stats.ks_2samp(inputs[name], plain[name]).pvalue > 0.01
    assert stats.spearmanr(*inputs.values()).statistic == pytest.approx(0.6, abs=0.02)
    pearson = np.corrcoef(limit.sigmas(u).T)[0, 1]
    assert pearson == pytest.approx(float(normal_correlation(0.6)), abs=0.02)


def test_a_case_without_a_number_has_failed_and_one_at_its_limit_has_not():
    campaign = minimal()
    u = np.array([[0.0, 0.0], [-99.0, 0.0]])
    first = LimitState(campaign, campaign.requirements[0])
    first(u[:1], np.array([0]))
    at = minimal(float(first.metric[0][0]))
    assert LimitState(at, at.requirements[0])(u[:1], np.array([0]))[0] > 0.0
    size, pitch = campaign.dispersions
    never = replace(campaign, dispersions=(replace(size, distribution=Normal(0.0, 20.0)), pitch))
    lost = LimitState(never, never.requirements[0])
    assert np.isneginf(lost(u, np.array([0, 1]))[1])  # less than nothing is no burn: refused
    assert lost.status[0][1] == "refused"


def test_of_failures_on_two_sides_the_nearest_case_of_each_is_told(tmp_path):
    campaign = minimal()
    both = replace(campaign, requirements=(replace(campaign.requirements[0], at_most=669.2),))
    record = estimate_rare_event(both, out=tmp_path / "out", cases_per_level=1000, workers=1)
    failed = record.cases[record.cases["failed"]]
    size = failed["magnitude_error_pct"].to_numpy()
    u = np.column_stack([size, stats.norm.ppf(0.5 + failed["pitch_error_deg"] / 4.0)])
    nearest = np.argmin((u**2).sum(axis=1))
    across = np.argmin(np.where(u @ u[nearest] < 0.0, (u**2).sum(axis=1), np.inf))
    told = record.result["inputs"][0]
    assert (told["likeliest"], told["across"]) == pytest.approx((size[nearest], size[across]), rel=1e-9)
    assert told["likeliest"] * told["across"] < 0.0


def test_failures_all_around_the_origin_are_one_region(tmp_path):
    result = estimate_rare_event(minimal(5000.0), out=tmp_path / "out", cases_per_level=500, workers=1).result
    assert result["probability"] == 1.0
    assert [remark.split(":")[0] for remark in result["remarks"]] == ["Failures are frequent"]


def with_pitch(campaign, distribution):
    """The campaign with another distribution of its second input."""
    size, pitch = campaign.dispersions
    return replace(campaign, dispersions=(size, replace(pitch, distribution=distribution)))


def test_failed_cases_of_earlier_levels_alone_describe_no_failures():
    """As where the noise of the flight decides: a plain case failed, and none that importance sampling drew."""
    limit = LimitState(minimal(), chosen_requirement(minimal(), None), 1)
    u, level = np.zeros((2, len(limit.names))), np.arange(2)
    cases = Evaluated(u, np.array([-1.0, 1.0]), level, level, np.array([0.0, 1.0]))
    event = RareEvent("cross-entropy", 0.0, 0.0, 0.1, 0.9, math.inf, (), cases, ())
    assert _failed_inputs(limit, event) == ([], [])


def test_inputs_that_cannot_be_led_to_failure_are_refused_in_a_sentence():
    for campaign, said in [
        (with_pitch(minimal(), Discrete((-1.0, 1.0), (0.5, 0.5))), "dispersion.pitch_error_deg: has no values between"),
        (with_pitch(minimal(), Empirical((-1.0, 0.0, 2.0))), "dispersion.pitch_error_deg: measured values say nothing"),
        (replace(minimal(), design="grid"), 'campaign.design: "grid" gives its cases no probabilities; use "?mc'),
        (replace(minimal(), dispersions=()), "dispersion: nothing is dispersed"),
        (replace(minimal(), first=minimal()), "inputs.from: takes inputs from another run"),
    ]:
        with pytest.raises(CampaignError, match=said) as refused:
            LimitState(campaign, campaign.requirements[0])
        assert len(refused.value.problems) == 1


def test_inputs_and_a_metric_with_the_name_of_an_own_column_are_refused_before_a_flight(tmp_path, estimate):
    inputs = {dispersion.name for dispersion in minimal().dispersions}
    assert set(estimate.cases.columns) == {"case_id", "status", *OWN_COLUMNS, *inputs, "apogee_altitude_km"}
    for name, text in (("sim.py", COUNTS), ("c.toml", COUNTED)):
        for old, new in (('count"', 'margin"'), ("count=", "margin="), ("a_pct", "level"), ('or")', 'or", unit="")')):
            text = text.replace(old, new)
        (tmp_path / name).write_text(text)
    told = command(tmp_path / "c.toml", "--out", tmp_path / "out")
    assert told.exit_code == 2
    assert 'dispersion.level: "level" is the name of a column of every rare event' in told.output
    assert 'requirement.few.metric: "margin" is the name of a column of every rare event' in told.output
    assert not (tmp_path / "out").exists()


def command(*arguments):
    return CliRunner().invoke(app, ["rare", *map(str, arguments)])


def test_the_command_line_says_probability_interval_cost_and_failures(tmp_path):
    done = command(MINIMAL, "--cases-per-level", 1000, "--out", tmp_path / "out", "--no-report", "--workers", 1)
    assert done.exit_code == 0, done.output
    assert "below" in done.output or "of not meeting it" in done.output
    record = open_rare_event(tmp_path / "out")
    for line in rare_event_lines(record.result):
        assert line in done.output
    assert f"{record.result['failed']:,} of them outside the limit" in done.output  # they have completed
    status = CliRunner().invoke(app, ["status", str(tmp_path / "out")])
    assert "requirement  apogee: apogee_altitude_km at least 600 km" in status.output
    assert CliRunner().invoke(app, ["verify", str(tmp_path / "out")]).exit_code == 0


@pytest.mark.parametrize("method", METHODS)
def test_the_help_names_the_fewest_cases_of_a_level_that_are_accepted(tmp_path, method):
    least = int(re.search(r"(\d+)<=x<=10000000", command("--help").output).group(1))
    with pytest.raises(CampaignError, match=f"{least - 1} cases per level are too few; {least} are the least"):
        estimate_rare_event(minimal(), out=tmp_path / "out", method=method, cases_per_level=least - 1, workers=1)
    options = ("--method", method, "--out", tmp_path / "out")
    refused = command(MINIMAL, "--cases-per-level", least - 1, *options)
    assert refused.exit_code == 2
    assert "preparing" not in refused.output


def test_an_interruption_is_a_sentence_and_stores_nothing(tmp_path):
    def interrupt(flown, failed):
        if flown:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(RunInterrupted, match="nothing is stored"):
        estimate_rare_event(minimal(), out=tmp_path / "out", workers=1, progress=interrupt)
    assert not (tmp_path / "out").exists()


def test_a_campaign_has_to_say_what_failure_is():
    campaign = load_campaign("deorbit")
    with pytest.raises(CampaignError, match="there are several; choose one of "):
        chosen_requirement(campaign, None)
    assert chosen_requirement(campaign, "fuel").metric == "propellant_kg"


COUNTS = """
import numpy as np
from mc_engine import Parameter, Simulator
from mc_engine.model import Field, inputs, metrics

SIMULATOR = Simulator(
    title="Counts",
    parameters=inputs(a_pct=Parameter(0.0, "error")),
    metrics=metrics(count=Field("pulses", unit="")),
    fly=lambda x, case: {"count": np.round(x["a_pct"])},
    batch=True,
)
"""
COUNTED = """
[campaign]
simulator = "sim.py"
cases = 100
design = "mc"
seed = 1
[dispersion.a_pct]
dist = "normal"
sigma = 1.0
[requirement.few]
metric = "count"
at_most = 1.0
share = 0.9
confidence = 0.9
"""


def test_a_case_right_at_its_limit_has_not_failed_and_its_margin_is_nothing(tmp_path):
    """It was 4.9e-324 in the table of levels."""
    (tmp_path / "sim.py").write_text(COUNTS)
    campaign = load_campaign("counts", text=COUNTED, directory=tmp_path)
    found = estimate_rare_event(campaign, out=tmp_path / "out", cases_per_level=500, workers=1)
    at_limit = found.cases[found.cases["count"] == 1.0]
    assert len(at_limit) > 50
    assert set(at_limit["margin"]) == {0.0}
    assert not at_limit["failed"].any()
    assert found.result["levels"][1]["margin"] == 0.0
    assert found.result["lower"] <= stats.norm.sf(1.5) <= found.result["upper"]
