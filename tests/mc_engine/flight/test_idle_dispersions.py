"""`check` names a dispersion that moves no metric, but not one that acts in rare cases; and counts refused cases."""

from mc_engine.campaign.loading import load_campaign
from mc_engine.flight.contract_flight import faults
from mc_engine.flight.flyers import flyer_of
from mc_engine.runner.flown_campaign import copies_of
from tests.mc_engine.model.mistaken_campaign import with_input, write_campaign


def test_an_input_that_acts_only_with_a_rare_failure_moves_metrics(tmp_path):
    write_campaign(
        tmp_path,
        *with_input('failed=Parameter(0.0, "1: the burn fails", unit=""), lost_pct=Parameter(0.0, "lost then")'),
        ("(1.0 + p.magnitude_error)", "(1.0 + p.magnitude_error - p.failed * p.lost)"),
    )
    file = tmp_path / "campaign.toml"
    rare = 'failed = { dist = "discrete", values = [0, 1], weights = [9999, 1] }\n'
    lost = 'lost_pct = { dist = "uniform", lower = 10.0, upper = 90.0 }\n'
    file.write_text(file.read_text().replace("[dispersion]", f"[dispersion]\n{rare}{lost}#"))
    assert faults(load_campaign(file)) == []


def test_check_counts_the_cases_that_will_be_refused(tmp_path):
    prepare = "prepare(inputs, settings, refusals):\n    refusals.add(inputs.pitch_error > 0.0, 'burn points up')\n"
    write_campaign(
        tmp_path,
        ("@physics\ndef initial", f"def {prepare}    return vars(inputs)\n\n\n@physics\ndef initial"),
        ("initial=initial,", "initial=initial, prepare=prepare,"),
    )
    faults_found, remarks = flyer_of(load_campaign(tmp_path / "campaign.toml")).second_look(copies_of)
    assert (faults_found, remarks) == (
        [],
        ["513 of the first 1,000 cases are refused; the first of them: burn points up"],
    )
