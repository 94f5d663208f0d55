"""The figures' data and their two drawings."""

import json
import re
from base64 import b64decode
from dataclasses import replace

import numpy as np
import pytest
from figure_marks import FORMS
from synthetic_run import synthetic_run

from mc_engine.model.figures import ScatterFigure, to_record
from mc_engine.statistics.maps import map_metric
from reports.contents import build
from reports.document.blocks import FigureBlock, blocks_of
from reports.drawing import lettering, paper, screen
from reports.drawing.marks import Axis, Drawing, Field, Limit, Line, Plot, Points
from reports.drawing.palette import INK
from reports.drawing.strokes import Frame, stroked
from reports.figures.distributions import bin_edges
from reports.figures.histories import thinned
from reports.figures.maps import surface_method
from reports.figures.rows import margin_figure
from reports.figures.statistics import correlation_matrix
from reports.text.numbers import same_lengths

PLOT = Plot((), Axis("x"), Axis("y"), "", 240.0)


@pytest.fixture(scope="module")
def drawings():
    return [block.drawing for block in blocks_of(build(synthetic_run(3000, failed=3), "run"), FigureBlock)]


def test_what_is_no_mark_is_named():
    with pytest.raises(TypeError, match="Plot is no mark that the screen draws"):
        screen.traced(PLOT, PLOT)
    with pytest.raises(TypeError, match="Plot is no mark that is drawn as SVG"):
        stroked(PLOT, Frame(0.0, 0.0, 1.0, 1.0, (0.0, 1.0), (0.0, 1.0)))


def test_a_colour_bar_writes_large_numbers_as_the_axes_do():
    """As powers of ten; plotly's own way is 3B, which no reader of units knows."""
    z = np.array([[3e9, 3.1e9], [3.2e9, 3.5e9]])
    field = Field(np.arange(2.0), np.arange(2.0), z, np.array([3e9, 3.2e9, 3.5e9]), "energy [MJ]")
    specification = screen.specifications(Drawing("", (replace(PLOT, marks=(field,)),)))[0]
    (bar,) = [one["marker"]["colorbar"] for one in specification["data"] if "colorbar" in one.get("marker", {})]
    axis = specification["layout"]["xaxis"]
    for key in ("exponentformat", "minexponent"):
        assert bar[key] == axis[key]


@pytest.mark.parametrize(("stretch", "to_scale"), [(1.0, True), (3.5, True), (9.0, False)])
def test_two_lengths_in_one_unit_are_to_scale_unless_the_cloud_is_much_longer_than_wide(stretch, to_scale):
    run = synthetic_run(500, failed=0)
    draws = np.random.Generator(np.random.Philox(key=4)).uniform(-1.0, 1.0, (2, 500))
    run.table["east_km"], run.table["north_km"] = stretch * draws[0], draws[1]
    for name in ("east_km", "north_km"):
        run.manifest["columns"].append({"name": name, "unit": "km", "role": "metric", "description": ""})
    run.manifest["figures"] = [to_record(ScatterFigure("east_km", "north_km", "Impact"))]
    (plot,) = next(
        one for one in blocks_of(build(run, "run"), FigureBlock) if one.caption.startswith("Impact")
    ).drawing.plots
    assert (plot.equal, plot.title) == ((True, "") if to_scale else (False, "Each axis has a scale of its own"))
    assert ("scaleanchor" in screen.specifications(Drawing("", (plot,)))[0]["layout"]["yaxis"]) == to_scale


@pytest.mark.parametrize(
    "title",
    [
        "limits 1\u202f234\u202f467.890123 and 1\u202f234\u202f667.890123 beyond the axis",
        "apoapsis_within_the_capability_of_the_orbit_trim_manoeuvres",
    ],
)
def test_a_title_is_bold_to_its_end_and_as_wide_as_its_panel_at_most(title):
    panel = replace(PLOT, title=title)
    bold = re.findall('font-weight="bold">([^<]*)<', paper.svg(Drawing("", (panel, panel), 2)))
    assert re.sub("[ _]", "", "".join(bold)) == 2 * re.sub("[ _]", "", title)
    assert max(lettering.BOLD * lettering.width(line) for line in bold) <= 0.5 * (paper.WIDTH - paper.GAP)


def test_names_that_stand_upright_below_a_matrix_take_no_room_of_its_rows():
    names = [f"aerodynamic coefficient with a long name, number {k}" for k in range(8)]
    layouts = [
        screen.specifications(Drawing("", (correlation_matrix(some, np.eye(8)),)))[0]["layout"]
        for some in (names, [name[-1] for name in names])
    ]
    line = max(len(part) for text in layouts[0]["xaxis"]["ticktext"] for part in text.split("<br>"))
    assert line <= screen.NAME
    assert layouts[0]["height"] - layouts[1]["height"] == line * screen.LETTER


@pytest.mark.parametrize(("units", "lengths"), [(("km", "km"), True), (("km", "m"), False), (("deg", "deg"), False)])
def test_only_two_columns_in_one_unit_of_length_are_lengths(units, lengths):
    assert same_lengths(*units) == lengths


def test_every_case_falls_into_a_bin():
    values = np.random.Generator(np.random.Philox(key=1)).exponential(size=5000)
    counts, _ = np.histogram(values, bin_edges(values))
    assert counts.sum() == 5000
    assert 8 <= counts.size <= 48


def test_counts_get_a_bin_each():
    assert bin_edges(np.array([3.0, 4.0, 4.0, 6.0])).tolist() == [2.5, 3.5, 4.5, 5.5, 6.5]


def test_a_far_outlier_does_not_make_a_million_bins():
    assert bin_edges(np.r_[np.linspace(0.0, 1.0, 1000), 1e9]).size == 49


def test_thinning_a_history_keeps_its_shortest_pulse():
    t = np.linspace(0.0, 700.0, 70_001)
    y = np.zeros(t.size)
    y[31_337] = 30.0
    short_t, short_y = thinned(t, y)
    assert short_t.size < 1000
    assert short_y.max() == 30.0
    assert short_t[short_y.argmax()] == t[31_337]


def test_at_most_two_thousand_points_and_the_extremes_are_drawn(drawings):
    for drawing in drawings:
        for plot in drawing.plots:
            for mark in plot.marks:
                if isinstance(mark, Points):
                    assert mark.x.size <= 2020


def test_the_interactive_figures_are_json_without_nan(drawings):
    for drawing in drawings:
        json.dumps(screen.specifications(drawing), allow_nan=False)


def test_the_printed_figures_are_the_same_bytes_twice_and_hold_no_date(drawings):
    for drawing in drawings:
        first = paper.svg(drawing)
        assert first == paper.svg(drawing)
        assert "<metadata>" not in first
        assert "<path" in first
        assert "<text" in first


def test_numbers_that_differ_by_little_stay_different_on_the_screen():
    values = -2.0 + 1e-5 * np.array([0.0, 0.5, np.nan, 1.0, 0.25, 0.75])
    many = screen.packed(np.tile(values, 10))
    for shown in (np.array(screen.packed(values), dtype=float), np.frombuffer(b64decode(many["bdata"]), many["dtype"])):
        assert np.nanmax(np.abs(shown - np.resize(values, shown.size))) < 1e-9
        assert np.isnan(shown[2])
    assert screen.packed([1.0, 1.0 + 2**-52])[1] == 1.0 + 2**-52
    assert screen.packed([]) == []


@pytest.mark.parametrize("size", [1e300, 1e-300])
def test_numbers_beyond_single_precision_reach_the_page(size):
    shown = screen.packed(np.tile([size, -2.0 * size, 0.0], 10))
    assert np.frombuffer(b64decode(shown["bdata"]), shown["dtype"])[:3].tolist() == [size, -2.0 * size, 0.0]


def test_dollar_signs_in_names_are_no_mathematics():
    drawn = [block.drawing for block in blocks_of(build(_with_name("cost $x$ of $\\nosuch$"), "run"), FigureBlock)]
    labelled = [one for one in drawn if one.form == FORMS["map"] and "$x$" in one.plots[0].x.label]
    assert labelled
    for one in labelled:
        assert "<svg" in paper.svg(one)


def _with_name(name):
    run = synthetic_run(200, failed=0)
    for one in run.manifest["inputs"]:
        if one["name"] == "ve_pct":
            one["description"] = name
    return run


@pytest.mark.parametrize("ends", [(0.413, 0.527), (1500.0, 5900.0), (7510.0, 7558.0), (54.0527245, 54.0527355)])
@pytest.mark.parametrize("log", [False, True])
def test_a_narrow_panel_has_at_least_two_ticks_on_its_axis(ends, log):
    ends = (ends[0], ends[0] + 100.0 * (ends[1] - ends[0])) if log else ends
    plot = Plot((), Axis("x", reach=ends, log=log), Axis("y"))
    drawn = paper.svg(Drawing("f", (plot,), 1)), paper.svg(Drawing("f", (plot,) * 4, 4))
    for svg, panels in zip(drawn, (1, 4), strict=True):
        assert len(re.findall(r'text-anchor="middle">[−\d.·\u202f⁰¹²³⁴⁵⁶⁷⁸⁹]+</text>', svg)) >= 2 * panels


def test_tick_labels_too_wide_for_a_narrow_panel_stand_upright_and_apart():
    plot = Plot((), Axis("x", reach=(-2.000017, -1.999983)), Axis("y", ticks=((0.0, "99.865\u202f%"),)))
    svg = paper.svg(Drawing("f", (plot,) * 4, 4))
    assert not re.findall(r'text-anchor="middle">−[12]\.\d{5}<', svg)
    places = [float(x) for x in re.findall(r'translate\(([\d.]+) [\d.]+\) rotate\(-90\)" [^>]*>−[12]\.\d{5}<', svg)]
    assert len(places) >= 2 * 4
    assert np.diff(places).min() > 7.0


def test_a_limit_among_numbers_that_differ_by_little_is_drawn_where_it_is():
    plot = Plot((Limit(54.0527303, "x", INK, "limit"),), Axis(), Axis())
    assert screen.specifications(Drawing("f", (plot,)))[0]["data"][0]["x"] == [54.0527303] * 9


def test_a_key_shows_its_marks_in_the_colours_of_the_page_and_of_paper():
    line = Line(np.arange(2.0), np.arange(2.0), INK, "a line", key='a "@ink" line')
    drawing = Drawing("f", (Plot((line,), Axis(), Axis()),))
    assert 'stroke="var(--ink)"' in paper.page_swatch(drawing.key[0])
    assert '"@ink' not in paper.svg(drawing)
    assert "&quot;@ink&quot;" in paper.svg(drawing)


def test_names_of_rows_that_are_broken_into_lines_do_not_overlap():
    names = [f"a requirement with a name that is far too long for one line, number {k}" for k in range(30)]
    drawing = margin_figure(names, np.full((30, 2), 0.1), ["good"] * 30)
    places = [float(y) for y in re.findall(r'<text x="[^"]*" y="([^"]*)"[^>]*text-anchor="end"', paper.svg(drawing))]
    assert len(places) > 30
    assert np.diff(np.sort(places)).min() >= 0.9 * lettering.LINE


def test_margins_of_many_requirements_continue_on_the_next_page():
    """Of 200 in one panel the PDF had the 39 in the middle, without the axis: the page cut off the others."""
    names = [f"{'a requirement with a name that is far too long for one line ' * 3}{k}" for k in range(200)]
    margins = np.linspace(-0.2, 0.8, 400).reshape(200, 2)
    drawing = margin_figure(names, margins, ["good"] * 200)
    heights = [float(re.search(r'height="([0-9.]+)pt"', strip)[1]) for strip in paper.strips(drawing)]
    assert heights[0] + max(heights[1:]) < 700.0  # points of a page, less two lines of caption
    bounds = np.concatenate([plot.marks[1].x for plot in drawing.plots])
    assert bounds == pytest.approx(100.0 * margins[:, 0])
    told = [text for plot in drawing.plots for _, text in plot.y.ticks]
    assert [text.partition(",")[0] for text in told] == names
    assert len({plot.x.reach for plot in drawing.plots}) == 1


def test_a_label_too_long_for_its_panel_is_broken_into_lines():
    label = Axis("a metric with a name of very many words that nobody would type twice in all his life [kg m²]")
    plot = Plot((Points(np.arange(3.0), np.arange(3.0), INK),), label, Axis("y"))
    panels = paper.svg(Drawing("three", (plot, plot, plot), 3))
    lines = [text for text in re.findall(r">([^<]+)</text>", panels) if re.search("[a-z]{2}", text)]
    assert max(map(lettering.width, lines)) <= paper.WIDTH / 3.0


@pytest.mark.parametrize(("lost", "words"), [(0, "mean of 2 cases"), (1, "mean of up to 2 cases")])
def test_a_node_of_a_grid_that_lost_a_case_is_not_the_mean_of_all(lost, words):
    x, y = (axis.repeat(2) for axis in (np.arange(9.0) // 3, np.arange(9.0) % 3))
    z = x + y + 0.1 * (np.arange(18) % 2)
    z[:lost] = np.nan
    assert surface_method(map_metric(x, y, z), "km").startswith(f"{words} at each grid node ({18 - lost} of 18")
