"""Ellipses and regions on scatter figures of two metrics: what they hold is counted, and units do not matter."""

import numpy as np
import pytest
from synthetic_run import synthetic_run

from reports.run.cloud_regions import cloud_regions
from reports.run.flown import Flown

NAMES = ("propellant_kg", "entry_speed_m_s")


def cloud(n=4000):
    x, y = np.random.Generator(np.random.Philox(key=8)).normal(size=(2, n))
    return x, 0.6 * x + 0.8 * y


def inside(region, x, y):
    """Counted with another's point-in-polygon test."""
    from matplotlib.path import Path

    return int(Path(np.column_stack([region.x, region.y])).contains_points(np.column_stack([x, y])).sum())


@pytest.mark.parametrize("scale", [1.0, 1e-9])
def test_the_words_say_how_many_cases_the_drawn_curves_hold(scale):
    x, y = cloud()
    y = 5.0 + scale * y
    regions = cloud_regions(Flown(synthetic_run(50), "run"), NAMES, x, y)
    assert [one.name for one in regions] == ["ellipse", "ellipse", "region"]
    for region, content in zip(regions, (0.5, 0.9973, 0.9973), strict=True):
        held = inside(region, x, y)
        said = int(region.text.replace("\u202f", "").split("holds ")[1].split(" of 4000")[0])
        assert abs(said - held) <= 3  # a polygon is a little smaller than its ellipse
        assert abs(held / 4000 - content) < 0.03


@pytest.mark.parametrize(("metric", "ends", "kinds"), [
    ("propellant_kg", [-9.0, 9.0], ["ellipse", "ellipse", "region"]), ("propellant_kg", [-1.0, None], ["region"]),
    ("entry_speed_m_s", [None, 1.0], ["region"]),
])  # fmt: skip
def test_no_ellipse_is_drawn_that_reaches_what_the_model_says_is_impossible(metric, ends, kinds):
    run = synthetic_run(50)
    run.manifest["ranges"] = {metric: ends}
    regions = cloud_regions(Flown(run, "run"), NAMES, *cloud())
    assert [one.name for one in regions] == kinds
    low, high = (np.inf if end is None else abs(end) for end in ends)
    along = regions[-1].x if metric == NAMES[0] else regions[-1].y
    assert along.min() >= -low
    assert along.max() <= high


def test_there_are_none_where_they_would_mean_nothing():
    x, y = cloud()
    run = Flown(synthetic_run(50), "run")
    assert cloud_regions(run, NAMES, x, y)
    assert cloud_regions(run, ("ve_pct", "entry_speed_m_s"), x, y) == ()  # an input
    assert cloud_regions(run, NAMES, x, np.sign(y)) == ()  # a few levels
    assert cloud_regions(run, NAMES, x, 2.0 * x) == ()  # a line
    chosen = synthetic_run(50)
    chosen.manifest["campaign"]["design"] = "grid"
    assert cloud_regions(Flown(chosen, "run"), NAMES, x, y) == ()
