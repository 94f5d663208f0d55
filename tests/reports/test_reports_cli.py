"""Reports written into a run directory, and the arrows between the packages."""

import numpy as np
import pytest
from synthetic_run import synthetic_run

import reports
from mc_engine.errors import UsageError
from mc_engine.store.store import Column, create_store

PUBLIC = {"build", "render_html", "render_pdf", "replay_picture", "report", "write_reports"}


@pytest.fixture
def run_path(tmp_path):
    """A real run directory with the synthetic run's rows."""
    made = synthetic_run(300, failed=4)
    columns = [Column(**record) for record in made.manifest["columns"]]
    made.manifest["campaign"]["cases"] = 300
    store = create_store(tmp_path / "deorbit-1", made.manifest, "", columns)
    store.append(0, 300, {name: made.table[name].to_numpy() for name in made.table if name != "case_id"})
    store.write_nominal(made.nominal_row)
    store.write_histories(made.history)
    store.note("finished", fly_s=1.25)
    return store.path


def test_both_reports_are_written_beside_the_data(run_path):
    written = reports.write_reports(run_path)
    assert [path.name for path in written] == ["report.html", "report.pdf"]
    assert written[0].read_bytes().startswith(b"<!doctype html>")
    assert written[1].read_bytes().startswith(b"%PDF")
    assert not list(run_path.glob(".report*"))


def test_one_format_is_enough_if_asked_for(run_path):
    assert [path.name for path in reports.report(run_path, "html")] == ["report.html"]
    assert [path.name for path in reports.write_reports(run_path, iter(["json"]))] == ["report.json"]
    assert not (run_path / "report.pdf").exists()


def test_no_path_of_this_machine_gets_into_the_page(run_path):
    page = reports.write_reports(run_path, ["html"])[0].read_text(encoding="utf-8")
    assert str(run_path.parent) not in page
    assert "mc-engine replay . " in page
    assert "timing: fly" in page


def test_an_unknown_format_is_refused_before_anything_is_written(run_path):
    with pytest.raises(UsageError, match='"docx" is no format of a report; use html, pdf, md'):
        reports.write_reports(run_path, ["html", "docx"])
    assert not (run_path / "report.html").exists()


def test_a_table_of_25_metrics_makes_a_page_below_eight_megabytes():
    run = synthetic_run(2000, failed=0)
    draw = np.random.Generator(np.random.Philox(key=8))
    for index in range(17):
        run.manifest["columns"].append({"name": f"extra_{index}_m", "unit": "m", "role": "metric", "description": ""})
        run.table[f"extra_{index}_m"] = draw.normal(size=2000)
    assert len(reports.render_html(reports.build(run, "run"))) < 8_000_000


def test_the_package_offers_these_names_and_no_others():
    assert set(reports.__all__) == PUBLIC
