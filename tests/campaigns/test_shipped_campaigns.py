"""Every shipped campaign can be loaded, and says where its numbers come from."""

import numpy as np
import pytest

from mc_engine import load_campaign
from mc_engine.campaign.search import list_campaigns
from mc_engine.flight.flight import chosen_cases
from mc_engine.model import load_model
from mc_engine.model.preparation import prepare
from reports.run.history_bands import OUTER, outer_percentile

MAIN = ("deorbit", "flexible_satellite", "geo_injection", "geo_servicing", "reentry")


def test_the_main_campaigns_save_enough_histories_for_the_outermost_percentiles():
    first = [load_campaign(name).retention.first for name in MAIN]
    assert {outer_percentile(n) for n in first} == {OUTER[0]}


def test_every_dispersion_and_requirement_of_a_shipped_campaign_has_its_source():
    campaigns = [load_campaign(shipped.name) for shipped in list_campaigns()]
    unsourced = [
        f"{campaign.name}: {part.name}"
        for campaign in campaigns
        if campaign.design != "table" and campaign.name != "minimal"  # a table names its numbers; a first try has none
        for part in (*campaign.dispersions, *campaign.requirements)
        if not part.source
    ]
    assert len(campaigns) > 30
    assert unsourced == []


ELLIPTIC = {"initial_inclination_deg": 46.0, "parking_eccentricity": 0.2, "parking_argument_of_perigee_deg": 20.0}
DESIGNED = pytest.mark.deep  # a program of burns, or a reference: it takes seconds
PLACES = ("sun_moon", "reference")  # parameters that say where in the tables of all these cases a case's own begin


@pytest.mark.parametrize(
    ("model", "n", "given"),
    [("campaigns.deorbit", 40, {}), ("campaigns.flexible_satellite", 40, {}), ("campaigns.geo_servicing", 12, {}),
     ("campaigns.geo_injection", 200, {}), pytest.param("campaigns.geo_injection", 40, ELLIPTIC, marks=DESIGNED),
     ("campaigns.reentry.autopilot", 40, {}),
     pytest.param("campaigns.reentry", 12, {"vehicle": "given", "guidance": "law3", "entry_radius_km": 0.0},
                  marks=DESIGNED)],
)  # fmt: skip
def test_what_is_prepared_for_a_case_has_the_same_bits_alone_and_among_others(model, n, given):
    """Every parameter is off its nominal value, those too that no shipped campaign disperses: NumPy's sums of
    products take another order for another number of cases.
    """
    loaded, random = load_model(model), np.random.default_rng(5)
    inputs = {setting.name: setting.default for setting in loaded.settings}
    for parameter in loaded.parameters:
        change = random.uniform(-1.0, 1.0, n)
        size = 2e-3 * parameter.default or {"m": 1e5, "m/s": 100.0}.get(parameter.unit, 0.02)
        off = parameter.default + size * change
        inputs[parameter.name] = np.clip(off, parameter.low, parameter.high)
    inputs |= given
    together = prepare(loaded, inputs, n)
    assert not together.refusals.mask.all()
    names = loaded.kernel_parameters._fields
    for case in range(n):
        one = {name: value[[case]] if isinstance(value, np.ndarray) else value for name, value in inputs.items()}
        alone = prepare(loaded, one, 1)
        for name, own, among in zip(names, alone.parameters[:, 0], together.parameters[:, case], strict=True):
            assert name in PLACES or own.tobytes() == among.tobytes(), (case, name, own, among)


WITH_THRUSTERS = {"duration_s": 20.0, "actuator": "pwpf"}
WIDE_ERRORS = {"thrust_factor": [0.6, 0.9, 1.2, 1.3], "initial_mass_factor": [0.75, 0.9, 1.5]}  # some escape


@pytest.mark.parametrize(
    ("model", "given", "more"),
    [("campaigns.deorbit", {"ve_pct": -12.0, "oe_pct": 7.0}, {}), ("campaigns.flexible_satellite", WITH_THRUSTERS, {}),
     ("campaigns.geo_injection", {}, WIDE_ERRORS), ("campaigns.reentry", {}, {})],
)  # fmt: skip
def test_a_metric_without_a_number_in_a_completed_case_is_declared_so(model, given, more):
    """Each parameter at its ends; a number as large as 1e100 stands for one that there is not."""
    loaded = load_model(model)
    ends = {item.name: [end for end in (item.low, item.high) if np.isfinite(end)] for item in loaded.parameters}
    trials = [(name, value) for name, values in [*ends.items(), *more.items()] for value in values]
    nominal = {item.name: item.default for item in loaded.parameters} | given
    inputs = {name: np.full(len(trials), nominal[name]) for name, _ in trials}
    for case, (name, value) in enumerate(trials):
        inputs[name][case] = value
    flown = chosen_cases(loaded, given | inputs)
    done = flown["status"] == "ok"
    assert done.sum() > 0.5 * len(trials)
    undeclared = {
        f"{metric.name} at {trials[case][0]} = {trials[case][1]:g}"
        for metric in loaded.metrics
        for case in np.flatnonzero(done)
        if not (metric.sometimes or np.isfinite(flown[metric.name][case])) or abs(flown[metric.name][case]) > 1e100
    }
    assert undeclared == set()
