"""One probability and one confidence in all of a report: [report] of the campaign file, else 99.73 % with 90 %."""

import json

import numpy as np
import pytest
from synthetic_run import synthetic_run

from mc_engine.campaign.loading import load_campaign
from mc_engine.errors import CampaignError
from mc_engine.runner.manifest import manifest_of
from mc_engine.studies.comparison import compare_runs
from reports.contents import build
from reports.document.blocks import Table, blocks_of
from reports.formats.html import render_html
from reports.formats.json_data import render_json
from reports.formats.markdown import render_markdown
from reports.run.flown import Flown
from reports.studies.comparison import build_comparison

CAMPAIGN = """
[campaign]
model = "campaigns.minimal.model"
cases = 10
design = "mc"
seed = 1
"""


def loaded(report, tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(CAMPAIGN + report)
    return load_campaign(file)


def test_the_campaign_file_says_both_and_the_manifest_keeps_them(tmp_path):
    said = loaded("[report]\nprobability = 0.99\nconfidence = 0.95\n", tmp_path)
    assert manifest_of(said)["report"] == {"probability": 0.99, "confidence": 0.95}
    assert manifest_of(loaded("", tmp_path))["report"] == {"probability": 0.9973, "confidence": 0.9}
    assert said.digest == loaded("", tmp_path).digest  # how a run is told, not what it is


@pytest.mark.parametrize(
    ("report", "sentence"),
    [
        ("probability = 0.3", "report.probability: 0.3 is not allowed; it must be at least 0.5"),
        ("confidence = 1.0", "report.confidence: 1.0 is not allowed; it must be below 1"),
        ("confidenc = 0.9", 'report.confidenc: is not a known key; did you mean "confidence"?'),
    ],
)
def test_what_is_wrong_in_it_gets_one_sentence(report, sentence, tmp_path):
    with pytest.raises(CampaignError) as found:
        loaded(f"[report]\n{report}\n", tmp_path)
    assert sentence in str(found.value)


def test_no_other_percentages_stand_in_a_report():
    text = render_markdown(build(synthetic_run(3000), "run")).decode().replace("\u202f", " ")
    assert "99.73 %" in text
    for other in ("95 %", "97.725", "2.275", "99 %"):
        assert other not in text.replace("99.99 %", "").replace("97.95 %", "")


def test_another_pair_is_that_of_headline_tables_bounds_and_data():
    run = synthetic_run(3000, failed=0, requirements=[], report={"probability": 0.99, "confidence": 0.8})
    document = build(run, "run")
    percentiles = next(one for one in blocks_of(document, Table) if one.caption == "Percentiles of the metrics")
    assert [column.title for column in percentiles.columns[2:]] == ["0.5\u202f%", "50\u202f%", "99.5\u202f%"]
    assert "each holding with 80\u202f%" in percentiles.note
    text = render_markdown(document).decode().replace("\u202f", " ")
    assert "with 80 % band of every rank" in text
    assert "90 %" not in text.replace("99.73 % and 90 % by default", "")
    assert any("99.5th percentile" in card.detail and "80\u202f% upper" in card.detail for card in document.costs)
    record = json.loads(render_json(document))
    assert (record["probability"], record["confidence"]) == (0.99, 0.8)
    assert [one["probability"] for one in record["metrics"][0]["quantiles"]] == [0.005, 0.01, 0.5, 0.99, 0.995]


def test_a_probability_of_one_half_has_the_median_once_and_both_quartiles():
    run = synthetic_run(300, failed=0, requirements=[], report={"probability": 0.5, "confidence": 0.8})
    document = build(run, "run")
    table = next(one for one in blocks_of(document, Table) if one.caption == "Percentiles of the metrics")
    assert [column.title for column in table.columns[2:]] == ["25\u202f%", "50\u202f%", "75\u202f%"]
    force = next(row for row in table.rows if row[0].text.startswith("peak force"))
    expected = np.quantile(run.table["peak_force_n"], (0.25, 0.5, 0.75), method="median_unbiased")
    np.testing.assert_allclose([cell.value for cell in force[2:]], expected)
    assert "75\u202f%" in render_html(document).decode()


def test_the_bound_of_a_percentile_is_the_tolerance_limit_that_the_matrix_shows():
    flown = Flown(synthetic_run(3000, failed=0), "run")
    for verdict in flown.verdicts:
        bound = flown.summaries[verdict.metric].at(0.9973).upper
        assert bound == verdict.demonstrated
        values = np.sort(flown.values(verdict.metric))
        assert bound in values  # an order statistic


def test_a_comparison_states_its_intervals_with_the_confidence_of_the_second_run():
    runs = [synthetic_run(400, failed=0, seed=seed) for seed in (1, 2)]
    runs[1].table["peak_force_n"] += 8.0
    reach = []
    for confidence in (0.9, 0.99):
        runs[1].manifest["report"] = {"probability": 0.9973, "confidence": confidence}
        compared = compare_runs(*runs, ("a", "b"))
        force = next(one.shift for one in compared.metrics if one.metric == "peak_force_n")
        reach.append(force.upper - force.lower)
        text = render_markdown(build_comparison(compared)).decode().replace("\u202f", " ")
        assert f"the {100.0 * confidence:.0f} % interval of the quantity" in text
    assert reach[0] < reach[1]
