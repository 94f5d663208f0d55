"""Table 12: what ±10 % of inertia does to the end of the manoeuvre, and what of the print does not come out."""

import numpy as np
import pytest
from flexible_flights import END, FOLDER, fly_campaign

from mc_engine.campaign.loading import load_campaign

N_CASES = 2000  # a deviation of the sample is then good to 1.6 %
# Table 12: mean, standard deviation; that of q1 is printed ten times as large
TABLE_12 = {
    "q0": (0.999637, 2.50e-6),
    "q1": (-7.54e-3, 4.08e-5),
    "q2": (-0.00536, 8.49e-5),
    "q3": (0.025446, 5.79e-5),
    "omega_x_rad_s": (-5.8e-5, 5.87e-7),
    "omega_y_rad_s": (-0.00108, 4.79e-7),
    "omega_z_rad_s": (-2.12e-5, 3.19e-7),
    "eta_1": (-4.28e-5, 4.26e-6),
    "eta_2": (-2.14e-4, 2.02e-6),
    "eta_3": (7.48e-6, 3.68e-7),
    "eta_4": (-2.35e-6, 1.33e-7),
}
# the digest's own runs of the reading "fit": deviations of the uniform and of the two-valued law
UNIFORM = [1.59e-6, 4.4e-5, 9.7e-5, 6.2e-5, 6.6e-7, 5.1e-7, 3.6e-7, 4.7e-6, 2.1e-6, 3.7e-7, 1.3e-7]
TWO_VALUED = [2.7e-6, 7.7e-5, 1.6e-4, 1.1e-4, 1.0e-6, 8.4e-7, 6.4e-7, 8.2e-6, 2.6e-6, 6.8e-7, 2.3e-7]


@pytest.fixture(scope="module")
def uniform():
    return fly_campaign("campaign.toml", N_CASES)


@pytest.fixture(scope="module")
def two_valued():
    return fly_campaign("two_valued.toml", N_CASES)


def test_every_case_flies(uniform, two_valued):
    assert set(uniform["status"]) == set(two_valued["status"]) == {"ok"}


@pytest.mark.parametrize("column", END[1:])
def test_the_deviations_are_those_of_table_12(uniform, column):
    assert uniform[column].std() == pytest.approx(TABLE_12[column][1], rel=0.2)


def test_the_deviation_of_q1_is_printed_ten_times_too_large(uniform):
    """4.08e-4, with a worst case 7.9e-5 from the mean; ours is 4.1e-5, and 4.4e-5 in the digest's 500 cases."""
    assert uniform["q1"].std() == pytest.approx(4.4e-5, rel=0.2)
    farthest = np.abs(uniform["q1"] - uniform["q1"].mean()).max()
    assert 0.2 * 4.08e-4 < farthest < 0.5 * 4.08e-4


@pytest.mark.parametrize(("column", "deviation"), list(zip(END, UNIFORM, strict=True)))
def test_the_deviations_are_those_of_the_digest(uniform, column, deviation):
    assert uniform[column].std() == pytest.approx(deviation, rel=0.1)


@pytest.mark.parametrize(
    ("column", "mean", "gap"), [("q0", 0.999637, 3e-6), ("q3", 0.025446, 1.5e-4), ("omega_y_rad_s", -1.078e-3, 1e-6)]
)
def test_the_means_of_q0_q3_and_the_orbital_rate_are_those_of_table_12(uniform, column, mean, gap):
    assert uniform[column].mean() == pytest.approx(mean, rel=0.0, abs=gap)


@pytest.mark.parametrize(("column", "deviation"), list(zip(END, TWO_VALUED, strict=True)))
def test_inertia_exactly_ten_percent_off_scatters_as_the_digest_says(two_valued, column, deviation):
    """150 cases there, so 20 %: three times the sampling error of such a deviation, and the eight corners' own."""
    assert two_valued[column].std() == pytest.approx(deviation, rel=0.25 if column == "eta_2" else 0.2)


def test_inertia_exactly_ten_percent_off_scatters_too_much_for_table_12(two_valued):
    """Hence the uniform reading: every deviation but those of q0 and eta_2 is 1.6 to 2.1 times the printed one."""
    ratios = {name: two_valued[name].std() / TABLE_12[name][1] for name in END}
    apart = {name for name, ratio in ratios.items() if 1.6 < ratio < 2.1}
    assert apart == set(END) - {"q0", "eta_2"}
    assert ratios["q0"] == pytest.approx(1.08, abs=0.05)  # the one that would fit


def test_only_eight_crafts_are_met_where_inertia_is_two_valued(two_valued):
    assert len(np.unique(two_valued["q1"])) == 8


# ---- what does not come out


@pytest.mark.parametrize(("column", "gap"), [("q1", 0.14), ("q2", 0.25), ("eta_1", 0.19)])
def test_the_means_that_are_not_reproduced_stay_off_by_as_much_as_the_digest_says(uniform, column, gap):
    """Suspected cause: the control law of the print is not the one flown; its integral has two readings, neither
    of which gives q3.  Other gains (kd 22.5, kp 5.1, limit 0.31) bring the means and spoil the deviations."""
    assert abs(uniform[column].mean() / TABLE_12[column][0] - 1.0) == pytest.approx(gap, abs=0.015)


@pytest.mark.parametrize("column", ["omega_z_rad_s", "eta_2", "eta_3", "eta_4"])
def test_the_other_means_come_within_ten_percent_and_not_to_the_digits(uniform, column):
    assert 0.03 < abs(uniform[column].mean() / TABLE_12[column][0] - 1.0) < 0.1


def test_the_deviation_of_q0_is_0_63_of_the_printed_one(uniform):
    """Suspected cause: the print's quaternion is not kept at norm 1: that of its means is off by 4e-6."""
    assert uniform["q0"].std() / TABLE_12["q0"][1] == pytest.approx(0.63, abs=0.03)
    norm = np.sqrt(sum(TABLE_12[f"q{i}"][0] ** 2 for i in range(4)))
    assert norm - 1.0 == pytest.approx(4e-6, abs=1e-6)


def test_neither_multiple_of_the_integral_that_is_printed_gives_the_mean_of_q3(uniform):
    """0.5 in (13), 1 in (12): 0.009 and 0.017; see the readings of the nominal manoeuvre.  1.5 is a fit."""
    assert uniform["q3"].mean() == pytest.approx(0.02535, abs=2e-5)


# ---- the campaign file


def test_the_campaign_disperses_each_moment_of_inertia_by_ten_percent():
    campaign = load_campaign(FOLDER / "campaign.toml")
    assert [one.name for one in campaign.dispersions] == [f"inertia_{axis}_factor" for axis in "xyz"]
    assert [one.distribution.support for one in campaign.dispersions] == [(0.9, 1.1)] * 3
    assert campaign.cases >= 400


@pytest.mark.parametrize("name", ["settled", "damped", "rate"])
def test_its_requirements_hold_in_every_case(uniform, name):
    requirement = next(one for one in load_campaign(FOLDER / "campaign.toml").requirements if one.name == name)
    assert (uniform[requirement.metric] <= requirement.at_most).all()


@pytest.mark.parametrize("name", sorted(path.name for path in FOLDER.glob("*.toml") if path.stem != "published"))
def test_every_campaign_file_of_the_folder_can_be_flown(name):
    n_cases = min(load_campaign(FOLDER / name).cases, 8)
    assert set(fly_campaign(name, n_cases)["status"]) == {"ok"}


def test_everything_dispersed_at_once_still_meets_its_requirements():
    flown = fly_campaign("dispersed.toml", 64)
    assert (flown["peak_modal_displacement"] < 0.08).all()
    assert (flown["propellant_kg"] < 0.06).all()
