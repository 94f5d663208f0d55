"""Intervals, limits, rings and cells stand where their numbers are, on the page and on paper."""

import numpy as np
import pytest

from mc_engine.statistics.drivers import SuccessCurve
from reports.drawing.marks import Axis, Limit, Line, Plot, Points
from reports.drawing.strokes import Frame, stroked
from reports.figures.rows import change_panel, difference_scale, ratio_scale, tornado
from reports.figures.statistics import correlation_matrix, success_panel

EFFECTS = np.array([[0.5, 0.4, 0.6], [0.2, 0.1, 0.3]])
FRAME = Frame(0.0, 0.0, 100.0, 100.0, (0.0, 1.0), (0.0, 1.0))


def pieces(plot):
    """The intervals of a panel: pairs of ends, each with its place on the other axis."""
    ends = []
    for mark in plot.marks:
        if isinstance(mark, Line) and mark.name == "interval":
            gap = np.isnan(mark.x) | np.isnan(mark.y)
            ends += np.column_stack([mark.x[~gap], mark.y[~gap]]).reshape(-1, 4).tolist()
    return ends


def test_the_intervals_of_a_tornado_span_total_and_first_effects():
    expected = [[0.4, -0.18, 0.6, -0.18], [0.1, 0.82, 0.3, 0.82], [0.4, 0.2, 0.6, 0.2], [0.1, 1.2, 0.3, 1.2]]
    np.testing.assert_allclose(pieces(tornado("miss", ["a", "b"], EFFECTS, EFFECTS, "90 %")), expected)


def test_the_intervals_of_changes_stand_at_the_rows_of_their_metrics():
    estimates = np.array([[1.0, 0.5, 1.5], [-2.0, -3.0, -1.0], [0.1, -0.2, 0.4]])
    for far, place in ((1.0, float), (1e4, np.arcsinh)):  # 10 000 σ make the axis logarithmic
        ends = far * estimates
        plot = change_panel(
            "means", ["a", "b", "c"], ends, np.array([False, True, False]), difference_scale(ends), "90 %"
        )
        expected = [
            [place(far * low), row, place(far * high), row]
            for low, row, high in ((-3, 1, -1), (-0.2, 2, 0.4), (0.5, 0, 1.5))
        ]
        np.testing.assert_allclose(sorted(pieces(plot)), expected)


def test_the_intervals_of_a_success_probability_and_the_extents_of_its_bins():
    low, high, half = np.array([0.0, 1.0]), np.array([1.0, 2.0]), np.array([0.5, 1.5])
    bounds = np.array([0.2, 0.7]), np.array([0.8, 0.9])
    curve = SuccessCurve(half, low, high, np.array([5, 8]), np.array([10, 10]), *bounds, ())
    plot = success_panel("landing", "speed", curve, 0.65, 0.9)
    np.testing.assert_allclose(
        sorted(pieces(plot)), [[0, 50, 1, 50], [0.5, 20, 0.5, 80], [1, 80, 2, 80], [1.5, 70, 1.5, 90]]
    )


def test_the_cells_of_a_correlation_matrix_stand_at_their_row_and_column():
    rho = np.array([[1.0, 0.5, -0.7], [0.5, 1.0, 0.1], [-0.7, 0.1, 1.0]])
    (cells,) = correlation_matrix(["a", "b", "c"], rho).marks
    places = {
        text: (round(left + 0.48, 9), round(bottom + 0.46, 9))
        for text, left, bottom in zip(cells.texts, cells.left, cells.bottom, strict=True)
    }
    assert places == {"c, a: −0.70": (0.0, 1.0), "c, b: 0.10": (1.0, 1.0), "b, a: 0.50": (0.0, 0.0)}


@pytest.mark.parametrize(
    ("mark", "sign"),
    [
        (Limit(0.5, "y", "#d55e00", "limit", "dash"), "stroke-dasharray"),
        (Points(np.array([0.5]), np.array([0.5]), "#ffffff", edge="#000000", edge_width=3.0), 'stroke="#000000"'),
    ],
)
def test_dashes_and_rings_are_drawn_on_paper(mark, sign):
    (stroke,) = Plot((mark,), Axis(reach=(0.0, 1.0)), Axis(reach=(0.0, 1.0))).strokes
    assert sign in "".join(stroked(stroke, FRAME))


def test_intervals_without_ends_reach_the_edges_of_their_panel():
    ratios = np.array([[2.0, 0.0, np.inf], [1.0, 0.5, 2.0]])
    scale = ratio_scale(ratios)
    plot = change_panel("spread", ["a", "b"], ratios, np.zeros(2, dtype=bool), scale, "90 %")
    assert [scale.axis.reach[0], 0.0, scale.axis.reach[1], 0.0] in pieces(plot)
