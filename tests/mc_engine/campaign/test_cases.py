import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import kstest, norm, spearmanr
from toy import load

from mc_engine.campaign.cases import case_table, dispersion_records, full_inputs
from mc_engine.errors import CampaignError
from mc_engine.sampling.designs import EXTENSIBLE, RANDOM
from mc_engine.sampling.streams import stream
from mc_engine.status import MOST_CASES

BODY = """
[dispersion.speed_pct]
dist = "normal"
three_sigma = 20
[dispersion.height_km]
dist = "uniform"
half_range = 500
unit = "m"
[dispersion.mass_kg]
dist = "lognormal"
log_sigma = 0.1
[dispersion.delay_s]
dist = "exponential"
scale = 3
upper = 10
[dispersion.control]
dist = "discrete"
values = ["off", "clipped"]
weights = [1, 3]
[[correlation]]
between = ["speed_pct", "mass_kg"]
rank = 0.6
"""
MORE = '[dispersion.angle_deg]\ndist = "triangular"\nhalf_range = 5\n'
NAMES = ["speed_pct", "height_km", "mass_kg", "delay_s", "control"]


@pytest.mark.parametrize("design", [*RANDOM, "grid", "one_at_a_time"])
@given(data=st.data())
@settings(max_examples=15)
def test_cases_in_any_order_and_any_chunks_are_the_same_cases(design, data):
    if design in RANDOM:
        campaign = load(BODY, design)
    else:
        axes = "".join(f"[dispersion.{name}]\nvalues = [1, 2, 3]\n" for name in NAMES[:2])
        campaign = load(axes + '[dispersion.control]\nvalues = ["off", "clipped"]\n', design)
    order = np.array(data.draw(st.permutations(range(campaign.cases))))
    cuts = sorted(data.draw(st.lists(st.integers(0, campaign.cases), max_size=5)))
    pieces = [case_table(campaign, piece) for piece in np.split(order, cuts)]
    for name, values in case_table(campaign, np.arange(campaign.cases)).items():
        joined = np.concatenate([piece[name] for piece in pieces if len(piece[name])])
        assert (joined.dtype, joined.tolist()) == (values.dtype, values[order].tolist())


def test_monte_carlo_draws_are_the_quantiles_of_the_addressed_streams():
    table = case_table(load(BODY, seed=7), np.arange(50))
    u = np.array([stream(7, "speed_pct", case).random() for case in range(50)])
    assert table["speed_pct"] == pytest.approx(norm.ppf(u) * 20.0 / 3.0, rel=1e-12)


@pytest.mark.parametrize("design", RANDOM)
def test_the_draws_follow_the_distributions_and_the_correlation(design):
    table = case_table(load(BODY, design, cases=4096), np.arange(4096))
    assert kstest(table["speed_pct"], norm(0.0, 20.0 / 3.0).cdf).pvalue > 0.001
    assert kstest((table["height_km"] - 9.5), "uniform").pvalue > 0.001
    assert kstest(np.log(table["mass_kg"] / 100.0) / 0.1, "norm").pvalue > 0.001
    assert table["delay_s"].max() < 10.0
    assert (table["control"] == "off").mean() == pytest.approx(0.25, abs=0.03)
    assert spearmanr(table["speed_pct"], table["mass_kg"]).statistic == pytest.approx(0.6, abs=0.03)
    assert spearmanr(table["speed_pct"], table["delay_s"]).statistic == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize("case", [-1, 64])
def test_a_case_that_the_campaign_does_not_have_is_refused(case):
    with pytest.raises(CampaignError, match=f"there is no case {case}; they are 0 to 63"):
        case_table(load(BODY, "lhs", cases=64), np.array([0, case]))


@pytest.mark.parametrize("design", EXTENSIBLE)
def test_a_design_without_end_has_the_cases_of_the_largest_campaign_and_no_others(design):
    """Beyond 2^32 cases the Sobol' points were those of other cases."""
    body = '[dispersion.speed_pct]\ndist = "normal"\nsigma = 1\n'
    campaign = load(body, design, cases=60)
    assert np.isfinite(case_table(campaign, [MOST_CASES - 1])["speed_pct"]).all()
    for case in (MOST_CASES, 2**32 + 5, 2**64 - 1, 10**30):
        with pytest.raises(CampaignError, match=f"there is no case {case}; they are 0 to {MOST_CASES - 1}"):
            case_table(campaign, np.array([case]))


def test_all_inputs_are_the_nominal_ones_but_for_the_dispersed_columns():
    campaign = load("[parameters]\nheight_km = 3\n" + MORE)
    inputs = full_inputs(campaign, case_table(campaign, np.arange(4)))
    assert set(inputs) == set(campaign.nominal)
    assert inputs["angle_deg"].shape == (4,)
    assert (inputs["height_km"], inputs["control"], inputs["drag"]) == (3.0, "continuous", True)


def test_records_say_each_dispersion_as_its_review_table_would():
    body = BODY + '[dispersion.angle_deg]\ndist = "normal"\nsigma = 2\nlower = 40\nsource = "thrower, table 2"\n'
    records = {record["name"]: record for record in dispersion_records(load(body))}
    assert records["angle_deg"] == {
        "name": "angle_deg",
        "unit": "deg",
        "description": "Angle of throw",
        "nominal": 45.0,
        "distribution": "normal, σ = 2 deg",
        "bounds": "from 40 deg",
        "source": "thrower, table 2",
        "note": "",
    }
    texts = {name: (record["distribution"], record["bounds"]) for name, record in records.items()}
    assert texts["speed_pct"] == ("normal, 3σ = 20 %", "")
    assert texts["height_km"] == ("uniform, ±0.5 km", "")  # given in m
    assert texts["mass_kg"] == ("lognormal, σ of ln = 0.1", "")
    assert texts["delay_s"] == ("exponential, origin = 0 s, scale = 3 s", "up to 10 s")  # from the nominal value
    assert texts["control"] == ("discrete, values = off, clipped, weights = 1, 3", "")


def test_the_record_of_a_word_names_its_choices_in_the_order_of_the_model():
    (record,) = dispersion_records(load('[dispersion.control]\nvalues = ["off", "continuous", "clipped"]\n', "grid"))
    assert record["choices"] == ["continuous", "clipped", "off"]


def test_the_bounds_of_levels_are_not_a_further_level():
    """The text "3 levels: 1, 2, 3 s, 1 to 3 s" read as four of them."""
    (record,) = dispersion_records(load("[dispersion.delay_s]\nlower = 1\nupper = 3\nlevels = 3\n", "grid"))
    assert (record["distribution"], record["bounds"]) == ("3 levels: 1, 2, 3 s", "")


@pytest.mark.benchmark
def test_a_million_cases_of_six_dispersions_are_drawn_in_about_a_second():
    from time import perf_counter

    campaign = load(BODY.replace("upper = 10", "") + MORE, cases=1_000_000)
    case_table(campaign, np.arange(10))  # imports scipy
    times = []
    for _ in range(2):
        start = perf_counter()
        case_table(campaign, np.arange(1_000_000))
        times.append(perf_counter() - start)
    print(f"\ncase table: {min(times):.2f} us per case of six dispersions")
    assert min(times) < 5.0  # about 0.7 s; the gate only catches a loop over cases
