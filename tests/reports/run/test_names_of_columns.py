"""What a report tells under a name is of the column with this name, also where another number has the name too."""

import numpy as np
import pytest
from synthetic_run import synthetic_run

from reports.run.flown import Flown


def renamed(old, new):
    """A run in which a metric has another name, in the table, the columns and the requirements."""
    run = synthetic_run(300)
    run.table = run.table.rename(columns={old: new})
    run.nominal_row = {new if name == old else name: value for name, value in run.nominal_row.items()}
    for column in run.manifest["columns"]:
        column["name"] = new if column["name"] == old else column["name"]
    limit = {"name": "late", "metric": new, "at_most": 352.0, "at_least": None, "share": 0.9, "confidence": 0.9}
    run.manifest["requirements"] = [limit]
    return Flown(run, "run")


def test_a_metric_with_the_name_of_the_time_is_a_metric():
    flown, named = renamed("settling_time_s", "t_s"), renamed("settling_time_s", "duration_s")
    assert flown.columns["t_s"].role == "metric"
    assert flown.columns["t_s"].description == named.columns["duration_s"].description
    assert (flown.key_metrics[0], named.key_metrics[0]) == ("t_s", "duration_s")
    assert [fact.name for fact in flown.with_role("metric")] == list(flown.summaries)
    assert flown.unit("t_s") == "s" == named.unit("t_s")  # that of the histories


@pytest.mark.parametrize("choices", [("1", "2"), ("1", "off")])
def test_words_that_look_like_numbers_are_words(choices):
    run = synthetic_run(300)
    run.table["mode"] = np.where(np.arange(300) % 2, *choices).astype(object)
    run.manifest["columns"].append({"name": "mode", "unit": "", "role": "dispersion", "description": "of the control"})
    flown = Flown(run, "run")
    assert np.isnan(flown.values("mode")).all()
    assert flown.every.ends("mode") is None
    assert np.isfinite(flown.values("ve_pct")).all()
