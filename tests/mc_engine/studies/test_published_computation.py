"""Our side of published values: computed from a case, from many cases, from a function; kept in the lock file."""

import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from mc_engine.campaign.search import SHIPPED
from mc_engine.command_line.commands import app
from mc_engine.errors import ModelError
from mc_engine.studies.published import kept_values
from mc_engine.studies.published_values import computed_values, dispersed_cases

ONE_CASE = """
[[published]]
quantity = "apogee"
published = 700.0
unit = "km"
column = "apogee_altitude_km"
at = { pitch_error_deg = 1.0 }
status = "legible"
reason = "a number for this test"
"""
MANY_CASES = """
[[published]]
quantity = "spread of the apogee"
published = 5.0
unit = "km"
statistic = "standard deviation"
of = "apogee_altitude_km"
over = ["pitch_error_deg", "magnitude_error_pct"]
cases = 50
status = "legible"
reason = "a number for this test"
"""
FUNCTION = """
[[published]]
quantity = "gain"
published = "lost"
unit = ""
compute = "{}"
status = "lost"
"""


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "minimal"
    shutil.copytree(SHIPPED / "minimal", folder)
    return folder


def file_with(folder, *records):
    path = folder / "published.toml"
    path.write_text("\n".join(records))
    return path


def test_a_column_is_of_the_case_with_these_inputs_and_a_statistic_of_the_first_cases_of_the_file(folder):
    values = computed_values(file_with(folder, ONE_CASE, MANY_CASES))
    flown = dispersed_cases(folder / "campaign.toml")["apogee_altitude_km"]
    assert len(flown) == 2000
    assert values["spread of the apogee"] == pytest.approx(np.std(flown[:50], ddof=1), rel=1e-12)
    no_error = computed_values(file_with(folder, ONE_CASE.replace("1.0", "0.0")))["apogee"]
    assert 0.0 < no_error - values["apogee"] < 10.0


def test_a_campaign_that_is_edited_is_computed_anew_in_the_same_process(folder):
    path = file_with(folder, MANY_CASES)
    before = computed_values(path)["spread of the apogee"]
    campaign = folder / "campaign.toml"
    campaign.write_text(campaign.read_text().replace("three_sigma = 3.0", "three_sigma = 6.0"))
    assert computed_values(path)["spread of the apogee"] > 1.5 * before


def test_what_is_not_the_campaigns_is_an_error_that_names_the_record(folder):
    for record, sentence in [
        (ONE_CASE.replace("apogee_altitude_km", "perigee_km"), "'apogee': perigee_km is no metric of model.py"),
        (ONE_CASE.replace('unit = "km"', 'unit = "m"'), '\'apogee\': apogee_altitude_km is in "km", the record in "m"'),
        (ONE_CASE.replace("pitch_error_deg", "pitch_deg"), "'apogee': pitch_deg: no input of the model"),
        (MANY_CASES.replace(', "magnitude_error_pct"', ""), "minimal disperses magnitude_error_pct, pitch_error_deg"),
        (MANY_CASES.replace("cases = 50", "at = { altitude_km = 1.0 }"), "minimal has altitude_km = "),
        (FUNCTION.format("os:getcwd"), r'compute = "os:getcwd" is no function of a module below the package model\.py'),
    ]:
        with pytest.raises(ModelError, match=rf"minimal, .*{sentence}"):
            computed_values(file_with(folder, record))


def test_a_function_is_of_a_module_below_the_campaigns_package_and_defined_there(tmp_path):
    folder = tmp_path / "deorbit"
    folder.mkdir()
    shutil.copy(SHIPPED / "deorbit" / "campaign.toml", folder)
    for reference, sentence in [
        ("campaigns.reentry.published.values:density_kg_m3", "is no function of a module below"),
        ("campaigns.deorbit:MODEL", "is no function of a module below"),
        ("campaigns.deorbit_2:f", "is no function of a module below"),
        ("campaigns.deorbit.published:np", "defines no function np"),
        ("campaigns.deorbit.published:chosen_case", "defines no function chosen_case"),
        ("campaigns.deorbit.published:absent", "defines no function absent"),
    ]:
        with pytest.raises(ModelError, match=sentence):
            computed_values(file_with(folder, FUNCTION.format(reference)))
    good = FUNCTION.format("campaigns.deorbit.published:modulator")
    assert computed_values(file_with(folder, good)) == {"gain": "3, 1, 57.62 s, 3.97 N, 2.34 N"}


def test_the_command_computes_says_what_differs_and_keeps_it(folder):
    path = file_with(folder, ONE_CASE)
    runner = CliRunner()
    assert "has no computed value" in runner.invoke(app, ["published", str(folder)]).output
    done = runner.invoke(app, ["published", str(folder), "--compute", "--update-lock"])
    assert done.exit_code == 0
    kept = kept_values(path)["apogee"]
    assert "kept in published.lock.toml" in done.stderr
    assert f"| {kept:.6g} km |" in done.stdout
    path.with_name("published.lock.toml").write_text("[ours]\napogee = 1.0\n")
    done = runner.invoke(app, ["published", str(folder), "--compute"])
    assert "apogee: " in done.stderr
    assert "kept is 1.0" in done.stderr
    assert kept_values(path) == {"apogee": 1.0}
