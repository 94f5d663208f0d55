from pathlib import Path

import numpy as np
import pandas
import pytest
from toy import HERE, load, problems

from mc_engine import CampaignError, load_campaign, run
from mc_engine.campaign.cases import case_table, dispersion_records
from tests.mc_engine.model.mistaken_campaign import write_campaign

HEAD = '[campaign]\nmodel = "toy.py"\ndesign = "{design}"\ntable = "cases.csv"\n'
CSV = "case_id,speed_pct,control,drag,height_km\n0,1.5,off,true,10\n1,-2,clipped,false,20\n2,3,off,TRUE,30\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "toy.py").write_text((HERE / "toy.py").read_text())
    (tmp_path / "cases.csv").write_text(CSV)
    return tmp_path


def test_each_row_is_a_case_and_each_column_a_dispersion(folder):
    campaign = load("", "table", head=HEAD, directory=folder)
    assert campaign.cases == 3
    table = case_table(campaign, np.array([2, 0]))
    assert {name: values.tolist() for name, values in table.items()} == {
        "speed_pct": [3.0, 1.5],
        "control": ["off", "off"],
        "drag": [True, True],
        "height_km": [30.0, 10.0],
    }


def test_a_column_may_have_a_source_and_a_unit(folder):
    body = '[dispersion.height_km]\nunit = "m"\nsource = "radar"'
    campaign = load(body, "table", head=HEAD, directory=folder)
    assert case_table(campaign, np.arange(3))["height_km"].tolist() == [0.01, 0.02, 0.03]
    record = dispersion_records(campaign)[-1]
    assert (record["name"], record["source"], record["distribution"]) == ("height_km", "radar", "column of cases.csv")


def test_parquet_is_read_like_csv(folder):
    pandas.read_csv(folder / "cases.csv").to_parquet(folder / "cases.parquet")
    ours = load("", "table", head=HEAD.replace(".csv", ".parquet"), directory=folder)
    theirs = load("", "table", head=HEAD, directory=folder)
    for name, values in case_table(ours, np.arange(3)).items():
        assert values.tolist() == case_table(theirs, np.arange(3))[name].tolist()


def test_a_blank_before_a_quoted_name_or_word_is_no_part_of_it(folder):
    spaced = CSV.replace(",", ", ").replace("speed_pct", '"speed_pct"').replace("clipped", '"clipped"')
    (folder / "cases.csv").write_text(spaced)
    table = case_table(load("", "table", head=HEAD, directory=folder), np.arange(3))
    assert (table["speed_pct"][1], table["control"][1]) == (-2.0, "clipped")


def test_a_fault_in_the_table_is_refused_with_row_and_column(folder):
    for old, new, message in [
        ("speed_pct", "sped_pct", 'the column "sped_pct" is not a parameter of toy; did you mean "speed_pct"?'),
        ("1.5", "x", '"cases.csv", row 1, column "speed_pct": "x" is not a finite number'),
        ("-2", "inf", '"cases.csv", row 2, column "speed_pct": "inf" is not a finite number'),
        ("-2", "-200", '"cases.csv", row 2, column "speed_pct": -200 is not within -100 % and above'),
        ("clipped", "cut", '"cases.csv", row 2, column "control": "cut" is none of continuous, clipped, off'),
        ("false", "no", '"cases.csv", row 2, column "drag": "no" is none of true, false'),
        ("\n1,-2,", "\n1,", '"cases.csv", line 3: 4 fields; its first line names 5 columns'),
        ("height_km", "speed_pct", '"cases.csv" has the column "speed_pct" twice'),
    ]:
        (folder / "cases.csv").write_text(CSV.replace(old, new))
        assert problems("", "table", head=HEAD, directory=folder) == {"campaign.table": message}


def test_a_whole_number_in_a_table_is_whole(folder):
    """2.5 was flown, although all other designs refused it."""
    toy = (folder / "toy.py").read_text().replace("Setting(0.5, ", "Setting(1.0, whole=True, description=")
    (folder / "toy.py").write_text(toy)
    message = '"cases.csv", row 2, column "step_s": 2.5 is not a whole number'
    for cell, found in [("2", {}), ("2.5", {"campaign.table": message})]:
        (folder / "cases.csv").write_text(f"step_s\n3\n{cell}\n")
        assert problems("", "table", head=HEAD, directory=folder) == found


def test_a_column_with_a_wrong_cell_is_not_called_missing(folder):
    (folder / "cases.csv").write_text(CSV.replace("1.5", "x"))
    found = problems('[dispersion.speed_pct]\nsource = "radar"', "table", head=HEAD, directory=folder)
    assert found == {"campaign.table": '"cases.csv", row 1, column "speed_pct": "x" is not a finite number'}


def test_a_table_has_its_cases_in_order_and_may_go_to_the_ends_of_a_range(folder):
    head, *rows = CSV.replace("-2", "-100").splitlines()
    (folder / "cases.csv").write_text("\n".join([head, *rows]))
    assert case_table(load("", "table", head=HEAD, directory=folder), np.array([1]))["speed_pct"].tolist() == [-100.0]
    (folder / "cases.csv").write_text("\n".join([head, rows[0], rows[2], rows[1]]))
    message = '"cases.csv", row 2: case_id is 2; rows are numbered 0, 1, 2, ...'
    assert problems("", "table", head=HEAD, directory=folder) == {"campaign.table": message}


def test_a_table_without_rows_or_without_parameters_is_refused(folder):
    (folder / "cases.csv").write_text("speed_pct\n")
    assert problems("", "table", head=HEAD, directory=folder)["campaign.table"].endswith("no rows below its first line")
    (folder / "cases.csv").write_text("case_id\n0\n")
    assert problems("", "table", head=HEAD, directory=folder)["campaign.table"].endswith("no column of a parameter")


def test_a_table_where_none_belongs_or_none_is_there_is_refused(folder):
    for design, head, body, place, message in [
        ("table", HEAD.replace("table = ", "# "), "", "campaign.table", "is missing: CSV or Parquet beside this file"),
        ("mc", HEAD + "cases = 3\nseed = 1\n", "", "campaign.table", 'the design "mc" reads no table'),
        ("table", HEAD.replace("cases.csv", "../x.csv"), "", "campaign.table", '"../x.csv" lies outside the folder'),
        ("table", HEAD.replace("cases.csv", "x.csv"), "", "campaign.table", 'there is no file "x.csv"'),
        ("table", HEAD.replace("cases.csv", "..x.csv"), "", "campaign.table", 'there is no file "..x.csv"'),
        ("table", HEAD + "cases = 2\n", "", "campaign.cases", '2 is not allowed; the design "table" has 3 cases'),
        ("table", HEAD, "[dispersion.mass_kg]", "dispersion.mass_kg", "the table has no such column"),
        ("table", HEAD, "[dispersion.height_km]\nhalf_range = 2", "dispersion.height_km.half_range", "the design"),
        ("table", HEAD, '[dispersion.height_km]\nunit = "kg"', "dispersion.height_km.unit", '"kg" is not a unit'),
        ("table", HEAD, '[dispersion.height_km]\nunit = "Meter"', "dispersion.height_km.unit", '"Meter" is not a unit'),
        ("table", HEAD, '[dispersion.speed_pct]\nunit = "deg"', "dispersion.speed_pct.unit", '"deg" is not a unit'),
    ]:
        found = problems(body, design, head=head, directory=folder)
        assert list(found) == [place]
        assert found[place].startswith(message)


def test_the_digest_follows_the_table(folder):
    before = load("", "table", head=HEAD, directory=folder).digest
    (folder / "cases.csv").write_text(CSV.replace("1.5", "1.6"))
    assert load("", "table", head=HEAD, directory=folder).digest != before


@pytest.mark.parametrize("change", [lambda path: path.write_text("pitch_error_deg\n2.0\n"), Path.unlink])
def test_a_table_that_is_edited_or_removed_after_its_campaign_was_loaded_is_not_flown(tmp_path, change):
    write_campaign(tmp_path)
    (tmp_path / "cases.csv").write_text("pitch_error_deg\n1.0\n")
    text = '[campaign]\nmodel = "model.py"\ndesign = "table"\ntable = "cases.csv"\n'
    campaign = load_campaign("edited", text=text, directory=tmp_path)
    change(tmp_path / "cases.csv")
    with pytest.raises(CampaignError, match=r'"cases.csv" was edited or removed after the campaign was loaded; load'):
        run(campaign, tmp_path / "run")
    assert not (tmp_path / "run").exists()
