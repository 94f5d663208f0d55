"""Covariance ellipses and regions of any shape."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.stats import f

from mc_engine.statistics.regions import (
    chi_square_scale,
    covariance_ellipses,
    density_regions,
    next_case_scale,
)


def normal_cloud(n, key=1):
    draw = np.random.Generator(np.random.Philox(key=key))
    return draw.multivariate_normal([30.0, -4.0], [[4.0, 1.5], [1.5, 2.0]], n)


@pytest.mark.parametrize("n", [5, 30, 1000])
def test_the_next_case_needs_the_larger_ellipse_of_hotelling(n):
    expected = np.sqrt(2.0 * (n * n - 1.0) / (n * (n - 2.0)) * f.ppf(0.9, 2, n - 2))
    assert next_case_scale(0.9, n) == pytest.approx(expected, rel=1e-10)
    assert next_case_scale(0.9, n) > chi_square_scale(0.9)


def test_an_ellipse_agrees_with_the_closed_form_of_its_covariance():
    points = normal_cloud(500)
    (ellipse,) = covariance_ellipses(points, (0.9,))
    sxx, sxy, syy = np.cov(points.T)[[0, 0, 1], [0, 1, 1]]
    root = np.hypot(0.5 * (sxx - syy), sxy)
    variances = 0.5 * (sxx + syy) + root, 0.5 * (sxx + syy) - root
    assert ellipse.semi_axes == pytest.approx(
        [np.sqrt(-2.0 * np.log(0.1) * variance) for variance in variances], rel=1e-12
    )
    assert ellipse.direction == pytest.approx(0.5 * np.arctan2(2.0 * sxy, sxx - syy), abs=1e-12)
    offsets = ellipse.outline() - points.mean(axis=0)
    squares = np.einsum("ni,ij,nj->n", offsets, np.linalg.inv(np.cov(points.T)), offsets)
    assert squares == pytest.approx(np.full(181, -2.0 * np.log(0.1)), rel=1e-9)


def test_the_points_inside_are_counted_as_by_hand():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [9.0, 9.0]])
    (ellipse,) = covariance_ellipses(points, (0.9,))
    # By hand: mean (1.5, 1.5), variances 27.4 and 0.4 along and across the diagonal.  Squares: the far point 4.106,
    # (-1, 0) 1.542, (1, 0) 1.323, (0, 0) 0.164; limits 4.605 and 1.386.
    assert ellipse.inside == 6
    (small,) = covariance_ellipses(points, (0.5,))
    assert small.inside == 3


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 2)),
        np.array([[1.0, 2.0]]),
        np.array([[1.0, 2.0], [3.0, 5.0]]),
        np.full((50, 2), 7.0),
        np.column_stack([np.arange(50.0), 2.0 * np.arange(50.0) + 1.0]),
    ],
)
def test_points_without_a_width_have_no_region(points):
    assert covariance_ellipses(points) == ()
    assert density_regions(points) == ()


def ring(n, key):
    """A cloud that no ellipse fits: a third of a ring."""
    draw = np.random.Generator(np.random.Philox(key=key))
    angle, radius = draw.uniform(0.0, 2.0, n), draw.normal(10.0, 0.5, n)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def test_a_region_of_any_shape_is_smaller_than_the_ellipse_of_a_bent_cloud():
    points = ring(4000, key=1)
    corners = np.random.Generator(np.random.Philox(key=2)).uniform(-13.0, 13.0, (20_000, 2))
    region = density_regions(points, (0.9,))[0]
    assert region.density.at(np.concatenate(region.outlines)) == pytest.approx(region.level, rel=1e-6)
    ellipse = covariance_ellipses(points, (0.9,))[0]
    assert (region.density.at(corners) >= region.level).mean() < 0.8 * np.pi * np.prod(ellipse.semi_axes) / 26.0**2
    assert region.outlines[0][0] == pytest.approx(region.outlines[0][-1])


def test_the_outline_of_a_thin_cloud_is_one_smooth_curve_at_its_sparse_end_too():
    draw = np.random.Generator(np.random.Philox(key=3))
    along = draw.exponential(1.0, 10_000)
    points = np.column_stack([along, along + draw.normal(0.0, 0.02 + 0.05 * along)])
    (region,) = density_regions(points, (0.9973,))
    (outline,) = region.outlines
    length = np.hypot(*np.diff(outline, axis=0).T).sum()
    hull = ConvexHull(outline)
    assert length < 1.1 * hull.area  # of a plane hull, the "area" is its circumference
