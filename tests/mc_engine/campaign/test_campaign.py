import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy import HERE, load, problems

from mc_engine.campaign.cases import case_table, dispersion_records
from mc_engine.campaign.loading import load_campaign
from mc_engine.errors import CampaignError
from mc_engine.sampling.designs import BY_LEVELS, DESIGNS

TEXT = """
[campaign]
model = "toy.py"
design = "sobol"
cases = 64
seed = 0
title = "Stones"

[dispersion.speed_pct]
dist = "normal"
three_sigma = 20.0
source = "thrower"
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "toy.py").write_text((HERE / "toy.py").read_text())
    (tmp_path / "campaign.toml").write_text(TEXT)
    return tmp_path


def test_a_campaign_is_read_from_its_file(folder):
    campaign = load_campaign(folder / "campaign.toml")
    assert (campaign.design, campaign.cases, campaign.seed, campaign.title) == ("sobol", 64, 0, "Stones")
    assert (campaign.name, campaign.text, campaign.directory) == (folder.name, TEXT, folder)
    assert (campaign.model.name, campaign.model_reference) == ("toy", "toy.py")
    assert [(dispersion.name, dispersion.dist, dispersion.source) for dispersion in campaign.dispersions] == [
        ("speed_pct", "normal", "thrower")
    ]


def test_cases_and_seed_can_be_given_from_outside():
    campaign = load("", cases=7, seed=0)
    assert (campaign.cases, campaign.seed) == (7, 0)


def test_the_file_caps_the_steps_of_a_model_that_chooses_them(tmp_path):
    text = '[campaign]\nmodel = "campaigns.reentry"\ncases = 3\nseed = 1\ndesign = "mc"\nmax_steps = 7\n'
    capped = load_campaign("capped", text=text, directory=tmp_path)
    free = load_campaign("free", text=text.replace("max_steps = 7", ""), directory=tmp_path)
    assert (capped.model.clock.attempts, capped.model.reference) == (7, "campaigns.reentry")
    assert free.model.clock.attempts > 7
    assert capped.digest != free.digest
    assert "fixed grid" in problems("max_steps = 7\n")["campaign.max_steps"]


@pytest.mark.parametrize(
    ("option", "place"), [({"cases": 0}, "cases"), ({"seed": -1}, "seed"), ({"cases": True}, "cases")]
)
def test_numbers_from_outside_are_checked_like_those_of_the_file(option, place):
    assert list(problems("", **option)) == [f"campaign.{place}"]


def test_every_mistake_is_reported_at_once_against_the_model_too():
    messages = problems("""
        [parameters]
        mass_kg = -1
        [dispersion.sped_pct]
        dist = "normal"
        sigma = 1
        [dispersion.angle_deg]
        dist = "uniform"
        lower = 20
        upper = 10
        [requirement.range]
        metric = "rnge_m"
        [retention]
        histories = { worst = { metric = "fuel" } }
    """)
    assert messages == {
        "parameters.mass_kg": "-1 is not allowed; the model accepts 0 kg and above",
        "dispersion.sped_pct": 'is not a parameter of toy; did you mean "speed_pct"?',
        "dispersion.angle_deg.lower": "20 is not below upper = 10",
        "requirement.range.metric": '"rnge_m" is not a metric of toy; did you mean "range_m"?',
        "requirement.range": "has no limit; give at_most, at_least or both",
        "retention.histories.worst.metric": '"fuel" is not a metric of toy; known are "range_m", "propellant_kg"',
    }


def test_a_model_that_is_not_there_is_refused_with_the_rest_of_the_mistakes():
    for model, message in [
        ("toi.py", 'there is no file "toi.py" beside the campaign file'),
        ("campaigns.deorbitt", 'there is no module "campaigns.deorbitt"'),
        ("mc_engine.status", '"mc_engine.status" has no MODEL'),
        ("../x y", "is neither a module"),
        ("", '"" is empty'),
    ]:
        head = f'[campaign]\nmodel = "{model}"\ndesign = "mc"\nseed = 1\ncases = true\n'
        messages = problems("", head=head)
        assert set(messages) == {"campaign.model", "campaign.cases"}
        assert message in messages["campaign.model"]


@pytest.mark.parametrize("design", ["mc", "lhs", "sobol"])
def test_a_random_design_needs_cases_and_a_seed(design):
    messages = problems("", design, head='[campaign]\nmodel = "toy.py"\ndesign = "{design}"\n#cases\n')
    assert list(messages) == ["campaign.cases", "campaign.seed"]


GRID = "[dispersion.speed_pct]\nhalf_range = 1\nlevels = 3\n[dispersion.height_km]\nvalues = [1, 2]\n"


def test_a_grid_with_another_number_of_cases_is_refused():
    message = '7 is not allowed; the design "grid" has 6 cases by itself'
    assert problems("cases = 7\n" + GRID, "grid") == {"campaign.cases": message}
    assert problems(GRID, "grid", cases=7) == {"campaign.cases": message}


def test_a_grid_of_more_than_a_thousand_million_cases_is_refused_unbuilt():
    body = "".join(
        f"[dispersion.{name}]\nlower = 1\nupper = 2\nlevels = 100_000\n" for name in ("speed_pct", "height_km")
    )
    assert problems(body, "grid") == {"campaign.design": "10000000000 cases; at most 1000000000 are possible"}


def test_a_file_that_is_not_utf8_is_refused_with_its_line(folder):
    (folder / "campaign.toml").write_bytes(b"# ok\n# \xff\n")
    with pytest.raises(CampaignError, match="line 2: is not text in UTF-8"):
        load_campaign(folder)


def digest(old="", new="", **options):
    return load_campaign("x", text=TEXT.replace(old, new) if old else TEXT, directory=HERE, **options).digest


def test_the_digest_tells_campaigns_apart_by_content_and_not_by_layout():
    assert digest() == digest("cases = 64", "cases = 64   # as in the plan")
    assert digest() == digest("cases = 64", "cases = 128")  # extended, and still the same campaign
    assert digest() != digest("seed = 0", "seed = 1")
    assert digest(seed=1) == digest("seed = 0", "seed = 1")
    assert digest() == digest("[campaign]", "[report]\nprobability = 0.95\n[campaign]")  # how a run is told
    assert digest() != digest("20.0", "21.0")
    assert digest() != digest("sobol", "mc")
    assert digest("sobol", "lhs") != digest("sobol", "lhs", cases=65)


def test_the_digest_follows_the_order_of_dispersions_which_are_dimensions():
    item, other = (f'[dispersion.{n}]\ndist = "uniform"\nhalf_range = 1\n' for n in ("speed_pct", "height_km"))
    assert load(item + other).digest != load(other + item).digest


SHAPES = [
    ("normal", "sigma lower"),
    ("normal", "mean three_sigma upper"),
    ("uniform", "half_range"),
    ("triangular", "lower mode upper"),
    ("lognormal", "median log_sigma upper"),
    ("lognormal", "mean sigma lower"),
    ("beta", "alpha beta lower upper"),
    ("exponential", "origin scale lower upper"),
    ("constant", "value"),
]
NUMBERS = st.floats(-20.0, 120.0) | st.sampled_from([0.0, 1e-49, 1e40, -1e45, 1e-300])


@given(
    design=st.sampled_from(["mc", "lhs", "sobol", "grid", "one_at_a_time"]),
    name=st.sampled_from(["speed_pct", "angle_deg", "mass_kg", "height_km"]),
    shape=st.sampled_from(SHAPES),
    numbers=st.lists(NUMBERS, min_size=4, max_size=4),
)
@settings(max_examples=500)
def test_a_dispersion_is_either_refused_or_draws_what_the_model_accepts(design, name, shape, numbers):
    dist, keys = shape
    lines = [f"{key} = {value!r}" for key, value in zip(keys.split(), numbers, strict=False)]
    if design == "grid" and dist != "constant":
        lines.append("levels = 3")
    body = f'[dispersion.{name}]\ndist = "{dist}"\n' + "\n".join(lines)
    try:
        campaign = load(body, design)
    except CampaignError:
        return
    values = case_table(campaign, np.arange(campaign.cases))[name]
    item = campaign.model.input(name)
    assert ((values >= item.low) & (values <= item.high)).all()
    assert np.isfinite(values).all()
    assert dispersion_records(campaign)[0]["distribution"].startswith((dist, "3 levels", "2 levels", "1 level"))


@pytest.mark.parametrize(("design", "cases", "nearest"), [("saltelli", 10, "8 or 12"), ("morris", 10, "9 or 12")])
def test_a_design_in_blocks_takes_whole_blocks_and_independent_inputs(design, cases, nearest):
    axes = "[dispersion.{}]\ndist = 'uniform'\nlower = 1.0\nupper = 2.0\n"
    body = axes.format("mass_kg") + axes.format("delay_s")
    message = problems(f"cases = {cases}\n{body}", design)["campaign.cases"]
    assert message.endswith(f"{nearest} would fit")
    assert problems(f"cases = 12\n{body}", design) == {}
    pair = '[[correlation]]\nbetween = ["mass_kg", "delay_s"]\nrank = 0.3\n'
    assert "is for independent inputs" in problems(f"cases = 12\n{body}{pair}", design)["correlation"]


@pytest.mark.parametrize("key", ["cases", "seed"])
@pytest.mark.parametrize("design", sorted({*DESIGNS} - {*BY_LEVELS, "table"}))
def test_a_missing_number_of_cases_or_seed_is_described_by_the_designs_that_need_none(design, key):
    lines = ['model = "campaigns.deorbit"', f'design = "{design}"', "cases = 64", "seed = 1"]
    text = "\n".join(["[campaign]", *(line for line in lines if not line.startswith(key))])
    said = rf"campaign\.{key}: is missing: [^;]*; grid, one_at_a_time and table need none"
    with pytest.raises(CampaignError, match=said):
        load_campaign("x", text=text + '\n[dispersion.ve_pct]\ndist = "normal"\nsigma = 1.0\n')
