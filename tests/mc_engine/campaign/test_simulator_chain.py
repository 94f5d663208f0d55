"""A chain of simulators whose first campaign has yet to be flown."""

from functools import partial

import pandas as pd

from tests.mc_engine.command_line.cart import call

SIMULATOR = """
from mc_engine import Parameter, Simulator
from mc_engine.model import inputs, metrics

def fly(inputs, case):
    return {"twice_m": 2.0 * inputs["length_m"]}

SIMULATOR = Simulator("twice", inputs(length_m=Parameter(1.0, "length")), metrics(twice_m="double"), fly=fly)
"""
HEAD = '[campaign]\nsimulator = "factor.py"\ndesign = "mc"\nseed = 1\n'
DISPERSED = 'cases = 20\n[dispersion.length_m]\ndist = "normal"\nsigma = 0.1\n'


def test_check_does_not_ask_whether_an_input_moves_a_metric_where_no_input_was_moved(tmp_path):
    """Without inputs from upstream case 0 is the nominal one, and every metric was said to be the same in both."""
    (tmp_path / "factor.py").write_text(SIMULATOR)
    (tmp_path / "first.toml").write_text(HEAD + DISPERSED)
    (tmp_path / "second.toml").write_text(HEAD + '[inputs]\nfrom = "first.toml"\ncolumns = { length_m = "twice_m" }\n')
    (tmp_path / "idle.py").write_text(SIMULATOR.replace('2.0 * inputs["length_m"]', "2.0"))
    (tmp_path / "idle.toml").write_text(HEAD.replace("factor.py", "idle.py") + DISPERSED)
    for name, asked in [("first", False), ("second", False), ("idle", True)]:
        checked = call("check", tmp_path / f"{name}.toml")
        assert checked.exit_code == 0, checked.output
        assert ("does an input move it?" in checked.stdout) == asked


def test_a_campaign_that_is_flown_again_and_again_from_its_own_run_keeps_the_columns_of_every_flight(tmp_path):
    """The third flight had two columns called again_status, and no manifest could be written."""
    (tmp_path / "factor.py").write_text(SIMULATOR)
    (tmp_path / "again.toml").write_text(HEAD + DISPERSED)
    runs = [tmp_path / f"run_{k}" for k in range(4)]
    for before, here in zip([None, *runs], runs, strict=False):
        if before is not None:
            source = f'[inputs]\nfrom = "{before.name}"\ncolumns = {{ length_m = "twice_m" }}\n'
            (tmp_path / "again.toml").write_text(HEAD + source)
        flown = call("run", tmp_path / "again.toml", "--out", here, "--no-report")
        assert flown.exit_code == 0, flown.output
    first, second, third, last = (pd.read_parquet(here / "cases") for here in runs)
    for name, own in [("again_twice_m", first), ("again_2_twice_m", second), ("again_3_twice_m", third)]:
        assert last[name].tolist() == own["twice_m"].tolist()
    assert last["again_2_length_m"].tolist() == last["again_twice_m"].tolist()
    assert last["twice_m"].tolist() == (16.0 * first["length_m"]).tolist()


def test_the_sample_of_a_chain_is_written_with_the_columns_of_the_run_upstream(tmp_path):
    """As Parquet it ended with KeyError: "'first_status'"."""
    (tmp_path / "factor.py").write_text(SIMULATOR)
    (tmp_path / "first.toml").write_text(HEAD + DISPERSED)
    (tmp_path / "second.toml").write_text(HEAD + '[inputs]\nfrom = "first"\ncolumns = { length_m = "twice_m" }\n')
    assert call("run", tmp_path / "first.toml", "--out", tmp_path / "first", "--no-report").exit_code == 0
    exactly = partial(pd.read_csv, dtype=str)  # older versions of pandas read the last digit of a number inexactly
    for ending, read in [(".csv", exactly), (".parquet", pd.read_parquet)]:
        written = call("sample", tmp_path / "second.toml", "--out", tmp_path / f"drawn{ending}")
        assert written.exit_code == 0, written.output
        drawn, flown = read(tmp_path / f"drawn{ending}"), pd.read_parquet(tmp_path / "first" / "cases")
        assert drawn["length_m"].astype(float).tolist() == flown["twice_m"].tolist()
        assert drawn["first_status"].tolist() == flown["status"].tolist()


def test_a_column_of_the_run_upstream_never_takes_the_name_of_an_own_input(tmp_path):
    """The column twice_m of the campaign "first" was called first_twice_m, as was an input of the second."""
    (tmp_path / "factor.py").write_text(SIMULATOR)
    (tmp_path / "first.toml").write_text(HEAD + DISPERSED)
    assert call("run", tmp_path / "first.toml", "--out", tmp_path / "first", "--no-report").exit_code == 0
    (tmp_path / "factor.py").write_text(SIMULATOR.replace("length_m=", 'first_twice_m=Parameter(7.0, "x"), length_m='))
    (tmp_path / "second.toml").write_text(
        HEAD + '[inputs]\nfrom = "first"\ncolumns = { length_m = "twice_m" }\n'
        "[dispersion.first_twice_m]\ndist = 'uniform'\nlower = 1.0\nupper = 2.0\n"
    )
    flown = call("run", tmp_path / "second.toml", "--out", tmp_path / "second", "--no-report")
    assert flown.exit_code == 0, flown.output
    first, second = (pd.read_parquet(tmp_path / run / "cases") for run in ("first", "second"))
    assert second["first_2_twice_m"].tolist() == first["twice_m"].tolist()
    assert second["first_twice_m"].between(1.0, 2.0).all()
