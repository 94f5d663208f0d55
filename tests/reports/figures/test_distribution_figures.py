"""Histograms: what is cut off is said."""

import re

import numpy as np
import pytest

from mc_engine.statistics import summarize
from reports.drawing import paper, screen
from reports.drawing.marks import Bar, Limit
from reports.figures.distributions import histogram, histograms, shown_range
from reports.text.numbers import given_percent, number

OUTER = (0.00135, 0.99865)


def panel(values):
    return histogram(values, "peak [N]", summarize(values), OUTER, title="all")


def bins(plot):
    """Edges of the bins and cases in them."""
    (bars,) = [mark for mark in plot.marks if isinstance(mark, Bar) and mark.key == "cases"]
    return np.append(bars.left, bars.right[-1]), bars.top


def told(plot):
    """What stands above the panel on what is beyond its axis."""
    return plot.title.removeprefix("all").replace("\n", " ").strip()


def near_seven(nominal, limits):
    values = 7.0 + 1e-4 * np.random.Generator(np.random.Philox(key=3)).normal(0.0, 1.0, 1000)
    found = histogram(values, "peak [N]", summarize(values), OUTER, title="all", nominal=nominal, limits=limits)
    return found, histograms([found])


def test_a_nominal_or_limit_far_from_all_cases_is_told_and_does_not_squeeze_them():
    found, drawing = near_seven(0.0, (-9.0, 9.0))
    assert told(found) == "nominal 0, limits −9 and 9 beyond the axis"
    panel = screen.specifications(drawing)[0]
    low, high = panel["layout"]["xaxis"]["range"]
    assert high - low < 1.1 * (bins(found)[0][-1] - bins(found)[0][0])
    assert "beyond" in panel["layout"]["title"]["text"]
    assert max(map(len, panel["layout"]["title"]["text"].split("<br>"))) <= 28  # else it is clipped
    assert not {"nominal", "required limit"} & {mark.key for mark in drawing.key}


def test_a_nominal_and_a_limit_near_the_cases_are_drawn():
    found, drawing = near_seven(7.0, (7.001,))
    assert told(found) == ""
    assert {"nominal", "required limit"} <= {mark.key for mark in drawing.key}
    assert screen.specifications(drawing)[0]["layout"]["xaxis"]["range"][1] > 7.001


def test_an_axis_of_large_numbers_has_their_power_of_ten_at_its_end():
    large, plain = (paper.svg(histograms([panel(scale * np.arange(100.0))])) for scale in (1e6, 1.0))
    assert "×10⁶</text>" in large
    assert "×10" not in plain


@pytest.mark.parametrize("values", [(0.0, 1.0), (3.0, 4.0, 5.0), range(9)])
def test_an_axis_of_whole_numbers_has_no_tick_between_them(values):
    plot = panel(np.repeat(np.asarray(values, dtype=np.float64), 6))
    layout = screen.specifications(histograms([plot]))[0]["layout"]
    for axis in (layout["xaxis"], layout["yaxis"]):
        low, high = axis["range"]
        assert 0.5 < (high - low) / axis["nticks"]  # plotly takes the next larger 1, 2 or 5 times a power of ten
        assert axis["tickformat"] == ",.3~f"  # a tick that a zoom puts between them is not rounded


def test_numbers_of_a_narrow_histogram_tell_its_bins_and_bounds_apart():
    """To five digits, a bound of −1234.5679 would be printed as −1234.5, beyond a limit of −1234.5678."""
    values = -1234.5678 - 0.01 * np.random.Generator(np.random.Philox(key=8)).exponential(2.0, 2000)
    found = histogram(values, "neg [K]", summarize(values), OUTER, title="all", with_intervals=True)
    (bars,) = [mark for mark in found.marks if isinstance(mark, Bar) and mark.key == "cases"]
    assert len({text.partition(":")[0] for text in bars.texts}) == len(bars.texts)
    (said,) = [mark.name for mark in found.marks if isinstance(mark, Limit) and mark.key == "median"]
    value, lower, upper = (float(text.replace("−", "-")) for text in re.findall(r"−[\d.]+", said))
    assert lower < value < upper < -1234.5678
    assert len({float(end.replace("−", "-")) for end in re.findall(r"−[\d.]+", found.words.partition(";")[0])}) == 2


def spoilt(n=10_000, outliers=(900.0, 1000.0, -5000.0)):
    values = np.random.Generator(np.random.Philox(key=1)).normal(0.0, 1.0, n)
    values[: len(outliers)] = outliers
    return values


def test_a_few_far_cases_do_not_squeeze_the_rest_and_are_counted():
    found = panel(spoilt())
    assert -8.0 < bins(found)[0][0] < -3.0
    assert 3.0 < bins(found)[0][-1] < 8.0
    assert bins(found)[1].sum() == 10_000 - 3
    assert np.count_nonzero(bins(found)[1]) > 20
    assert told(found) == "3 cases beyond the axis"


def test_a_percentile_stays_in_a_histogram_whose_tail_is_cut_and_one_beyond_the_axis_is_told():
    """Of a metric with a long tail, the upper bound of the outer percentile is among the cases that are cut off."""
    values = np.random.Generator(np.random.Philox(key=4)).standard_t(1.5, 2000)
    summary = summarize(values, probabilities=(0.005, 0.5, 0.995, 0.9995))
    end = shown_range(values)[1]
    found = histogram(values, "peak [N]", summary, (0.005, 0.995, 0.9995), title="all", with_intervals=True)
    within, cut = summary.at(0.995), summary.at(0.9995)
    assert within.value < end < within.upper
    assert end < cut.value
    lines = [mark.at for mark in found.marks if isinstance(mark, Limit)]
    assert sorted(lines) == [summary.at(p).value for p in (0.005, 0.5, 0.995)]
    (bands,) = [mark for mark in found.marks if isinstance(mark, Bar) and "confidence" in mark.key]
    assert (bands.left[2], bands.right[2]) == (within.lower, bins(found)[0][-1])
    n = 2000 - int(bins(found)[1].sum())
    assert told(found) == f"{n} cases, {given_percent(0.9995)} percentile {number(cut.value)} beyond the axis"


def test_without_far_cases_all_are_shown_and_nothing_is_said():
    values = np.random.Generator(np.random.Philox(key=2)).exponential(1.0, 10_000)
    assert shown_range(np.minimum(values, 6.0)) == (values.min(), 6.0)
    found = panel(np.minimum(values, 6.0))
    assert bins(found)[1].sum() == 10_000
    assert told(found) == ""


def test_values_that_are_mostly_equal_keep_their_range():
    values = np.zeros(5000)
    values[:3] = [1.0, 2.0, 60.0]
    assert shown_range(values) == (0.0, 60.0)


@pytest.mark.parametrize("outliers", [(900.0, 1000.0, -5000.0), (50.0,) * 40])
def test_the_axis_ends_near_the_bins_whatever_the_outer_quantiles_are(outliers):
    found = panel(spoilt(outliers=outliers))
    drawing = histograms([found])
    (low, high) = screen.specifications(drawing)[0]["layout"]["xaxis"]["range"]
    width = bins(found)[0][-1] - bins(found)[0][0]
    assert high - low < 1.1 * width
