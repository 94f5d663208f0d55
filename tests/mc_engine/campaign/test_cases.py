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


def same(ours, theirs):
    return all(
        ours[name].dtype == theirs[name].dtype and ours[name].tolist() == theirs[name].tolist() for name in NAMES
    )


@pytest.mark.parametrize("design", RANDOM)
@pytest.mark.parametrize("chunk", [1, 7, 64])
def test_the_case_table_is_the_same_in_chunks_of_any_size(design, chunk):
    campaign = load(BODY, design)
    whole = case_table(campaign, np.arange(100))
    pieces = [case_table(campaign, np.arange(k, min(k + chunk, 100))) for k in range(0, 100, chunk)]
    assert same({name: np.concatenate([piece[name] for piece in pieces]) for name in NAMES}, whole)


@pytest.mark.parametrize("design", [*RANDOM, "grid", "one_at_a_time"])
@given(order=st.permutations(range(12)))
@settings(max_examples=15)
def test_the_order_of_asking_does_not_matter(design, order):
    if design in RANDOM:
        campaign = load(BODY, design)
    else:
        axes = "".join(f"[dispersion.{name}]\nvalues = [1, 2, 3]\n" for name in NAMES[:2])
        campaign = load(axes + '[dispersion.control]\nvalues = ["off", "clipped"]\n', design)
        order = [case for case in order if case < campaign.cases]
    straight, shuffled = case_table(campaign, np.arange(len(order))), case_table(campaign, np.array(order))
    for name, values in shuffled.items():
        assert values.tolist() == straight[name][np.argsort(np.argsort(order))].tolist()


@pytest.mark.parametrize("design", [one for one in EXTENSIBLE if one in RANDOM])
def test_a_thousand_cases_extended_to_two_thousand_equal_a_fresh_two_thousand(design):
    short, long = load(BODY, design, cases=1000), load(BODY, design, cases=2000)
    first, rest = case_table(short, np.arange(1000)), case_table(long, np.arange(1000, 2000))
    extended = {name: np.concatenate([first[name], rest[name]]) for name in NAMES}
    assert same(extended, case_table(long, np.arange(2000)))


@pytest.mark.parametrize("design", RANDOM)
def test_a_dispersion_added_at_the_end_leaves_the_others_as_they_were(design):
    before, after = (case_table(load(body, design), np.arange(100)) for body in (BODY, BODY + MORE))
    assert same(after, before)
    assert list(after) == [*NAMES, "angle_deg"]


@pytest.mark.parametrize("design", RANDOM)
def test_another_seed_changes_every_draw(design):
    ours, theirs = (case_table(load(BODY, design, seed), np.arange(100)) for seed in (0, 1))
    assert all((ours[name] != theirs[name]).all() for name in NAMES[:4])


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


def test_a_grid_runs_through_all_combinations_the_last_dispersion_fastest():
    axes = '[dispersion.speed_pct]\nhalf_range = 10\nlevels = 3\n[dispersion.control]\nvalues = ["off", "clipped"]\n'
    campaign = load(axes, "grid")
    table = case_table(campaign, np.arange(campaign.cases))
    assert table["speed_pct"].tolist() == [-10.0, -10.0, 0.0, 0.0, 10.0, 10.0]
    assert table["control"].tolist() == ["off", "clipped"] * 3


def test_one_at_a_time_starts_nominal_and_moves_one_input_a_case():
    axes = "[dispersion.speed_pct]\nhalf_range = 10\n[dispersion.drag]\nvalues = [false]\n"
    campaign = load("[parameters]\nspeed_pct = 1\n" + axes, "one_at_a_time")
    table = case_table(campaign, np.arange(campaign.cases))
    assert table["speed_pct"].tolist() == [1.0, -9.0, 11.0, 1.0]
    assert table["drag"].tolist() == [True, True, True, False]


def test_all_inputs_are_the_nominal_ones_but_for_the_dispersed_columns():
    campaign = load("[parameters]\nheight_km = 3\n" + MORE)
    inputs = full_inputs(campaign, case_table(campaign, np.arange(4)))
    assert set(inputs) == set(campaign.nominal)
    assert inputs["angle_deg"].shape == (4,)
    assert (inputs["height_km"], inputs["control"], inputs["drag"]) == (3.0, "continuous", True)


@pytest.mark.parametrize(("design", "case"), [("lhs", 100), ("mc", -1), ("sobol", -5)])
def test_a_case_that_is_not_in_the_design_is_refused(design, case):
    with pytest.raises(CampaignError, match=f"there is no case {case}; they are 0 to 99"):
        case_table(load(BODY, design), np.array([0, case]))


def test_a_campaign_without_dispersions_has_an_empty_case_table():
    assert case_table(load(""), np.arange(3)) == {}


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
    assert texts["delay_s"] == ("exponential, scale = 3 s", "up to 10 s")
    assert texts["control"] == ("discrete, values = off, clipped, weights = 1, 3", "")


def test_records_of_a_grid_count_its_levels():
    axes = "[dispersion.speed_pct]\nhalf_range = 10\nlevels = 21\n[dispersion.drag]\nvalues = [false, true]\n"
    texts = [record["distribution"] for record in dispersion_records(load(axes, "grid"))]
    assert texts == ["21 levels: -10, -9, ..., 10 %", "2 levels: false, true"]


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
