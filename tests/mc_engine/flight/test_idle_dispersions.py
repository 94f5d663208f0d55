"""`check` names a dispersion that moves no metric, but not one that acts in rare cases."""

from mc_engine.campaign.loading import load_campaign
from mc_engine.flight.contract_flight import faults
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
