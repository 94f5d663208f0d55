"""Contributors of the entry: the flights beside the run, and a Saltelli design of SALib's flown as a table of cases."""

import re
import tomllib

import pandas as pd
import pytest
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling
from scipy.stats import norm

from mc_engine import load_campaign, open_store
from mc_engine.campaign.search import find_campaign
from mc_engine.runner import runner
from mc_engine.statistics.pick_freeze import layout_of, pick_freeze

METRICS = ("peak_load_g", "peak_heat_rate_w_m2", "peak_dynamic_pressure_pa")
INPUTS = ("ld_factor", "cd_factor", "entry_flight_path_angle_error_deg")
# Total effects of the draw by SALib from 8192 blocks of its design: 0.443 +- 0.014, 0.291 +- 0.010 and 0.177 +- 0.006.
WEATHER = {"peak_load_g": 0.443, "peak_heat_rate_w_m2": 0.291, "peak_dynamic_pressure_pa": 0.177}
# By how much the variance of 10 000 cases falls if the mean air is flown in all of them.
MEAN_AIR = {"peak_load_g": 0.55, "peak_heat_rate_w_m2": 0.29, "peak_dynamic_pressure_pa": 0.24}
BLOCKS = 1024
SURE = 1.96  # standard errors of an interval of 95 %, as SALib's are


@pytest.fixture(scope="module")
def beside(tmp_path_factory):
    """First and total effects and the fall with their standard errors, by metric and group; the inputs' records."""
    folder = tmp_path_factory.mktemp("beside") / "run"
    path = find_campaign("reentry")
    text = re.sub(r"(\[sensitivity\][^\[]*?\ncases = )\d+", rf"\g<1>{BLOCKS}", path.read_text())
    campaign = load_campaign("reentry", cases=50, text=text, directory=path.parent)
    assert campaign.sensitivity.cases == BLOCKS
    run = runner.run(campaign, folder)
    store = open_store(folder / "sensitivity")
    cases = store.cases(["case_id", *METRICS])
    found = pick_freeze(
        layout_of(store.manifest["sensitivity"]), cases["case_id"].to_numpy(), {name: cases[name] for name in METRICS}
    )
    effects = {
        metric: {
            group: [
                (found.first[g, k], found.first_error[g, k]),
                (found.total[g, k], found.total_error[g, k]),
                (found.fall[g, k], found.fall_error[g, k]),
            ]
            for g, group in enumerate(found.groups)
        }
        for k, metric in enumerate(found.metrics)
    }
    return effects, run.manifest["inputs"]


@pytest.fixture(scope="module")
def salib(beside, tmp_path_factory):
    """What SALib makes of its own design, by metric: effects and half intervals by input."""
    _, inputs = beside
    problem = {"num_vars": len(inputs), "names": [one["name"] for one in inputs], "bounds": [[0.0, 1.0]] * len(inputs)}
    points = sampling.sample(problem, BLOCKS, calc_second_order=False, seed=7)
    folder = tmp_path_factory.mktemp("salib")
    text = find_campaign("reentry").read_text()
    declared = tomllib.loads(text)["dispersion"]
    table = {}
    for one, column in zip(inputs, points.T, strict=True):
        law = declared[one["name"]]
        drawn = law["dist"] == "normal"
        table[one["name"]] = norm.ppf(column, one["nominal"], law["three_sigma"] / 3.0) if drawn else column
    pd.DataFrame(table).to_csv(folder / "cases.csv", index=False)
    kept = re.sub(r"\[dispersion.*?\n\n", "", text.partition("[sensitivity]")[0], flags=re.DOTALL)
    kept = re.sub(r"\ncases = .*", "", kept)
    asked = kept.replace('design = "mc"', 'design = "table"\ntable = "cases.csv"')
    (folder / "campaign.toml").write_text(asked)
    cases = runner.run(load_campaign(folder / "campaign.toml"), folder / "run").cases(["status", *METRICS])
    assert len(cases) == BLOCKS * (len(inputs) + 2)
    assert (cases["status"] == "ok").all()
    found = {}
    for metric in METRICS:
        values = cases[metric].to_numpy()
        one = analysis.analyze(problem, (values - values.mean()) / values.std(), calc_second_order=False, seed=1)
        found[metric] = {
            name: [(one["S1"][k], one["S1_conf"][k]), (one["ST"][k], one["ST_conf"][k])]
            for k, name in enumerate(problem["names"])
        }
    return found


@pytest.mark.parametrize("metric", METRICS)
def test_first_and_total_effects_are_those_of_salib_within_their_intervals(beside, salib, metric):
    effects, _ = beside
    assert {name for name in effects[metric]} >= set(INPUTS)
    for name in INPUTS:
        for (ours, error), (theirs, half) in zip(effects[metric][name][:2], salib[metric][name], strict=True):
            assert abs(ours - theirs) <= SURE * error + half, (metric, name)
    # The air of a day is a random draw of ours, and an input like others to SALib.
    ours, error = effects[metric]["random draws"][1]
    theirs, half = salib[metric]["weather_draw"][1]
    assert abs(ours - theirs) <= SURE * error + half
    assert ours == pytest.approx(WEATHER[metric], abs=0.06)


@pytest.mark.parametrize("metric", METRICS)
def test_the_variance_falls_by_what_the_mean_air_in_all_cases_leaves_out(beside, metric):
    fall, error = beside[0][metric]["random draws"][2]
    assert error < 0.04
    assert fall == pytest.approx(MEAN_AIR[metric], abs=0.06)
