"""Maps of a metric over two inputs."""

import numpy as np
import pytest

from mc_engine.statistics import map_metric


def scattered(n=3000, key=1):
    draw = np.random.Generator(np.random.Philox(key=key))
    return draw.normal(0.0, 7.0, n), draw.normal(0.0, 0.05, n)


def quadratic(x, y):
    return 3.0 + 0.5 * x - 40.0 * y + 0.02 * x * x - 2.0 * x * y + 300.0 * y * y


def test_a_full_grid_is_given_back_exactly():
    x, y = np.linspace(-20.0, 20.0, 9), np.linspace(-15.0, 15.0, 7)
    grid_x, grid_y = np.meshgrid(x, y)
    order = np.random.Generator(np.random.Philox(key=2)).permutation(63)
    found = map_metric(grid_x.ravel()[order], grid_y.ravel()[order], np.hypot(grid_x, grid_y).ravel()[order])
    assert found.exact
    assert found.error is None
    assert (found.value == np.hypot(grid_x, grid_y)).all()


def test_a_grid_with_a_failed_case_has_one_blank_node():
    grid_x, grid_y = (values.ravel() for values in np.meshgrid(np.arange(4.0), np.arange(3.0)))
    z = grid_x + grid_y
    z[5] = np.nan
    found = map_metric(grid_x, grid_y, z)
    assert np.isnan(found.value).sum() == 1
    assert (found.n_used, found.n_tried) == (11, 12)


def test_a_grid_flown_several_times_gives_means_and_their_standard_errors():
    grid_x, grid_y = (np.tile(values.ravel(), 4) for values in np.meshgrid(np.arange(3.0), np.arange(2.0)))
    z = np.repeat([0.0, 1.0, 2.0, 3.0], 6)
    found = map_metric(grid_x, grid_y, z)
    assert found.cases_per_node == 4
    assert found.value == pytest.approx(np.full((2, 3), 1.5))
    assert found.error == pytest.approx(np.full((2, 3), np.std([0, 1, 2, 3], ddof=1) / 2.0))


def test_a_quadratic_surface_is_found_exactly_with_no_error():
    x, y = scattered()
    found = map_metric(x, y, quadratic(x, y))
    truth = quadratic(*np.meshgrid(found.x, found.y))
    known = np.isfinite(found.value)
    assert known.mean() > 0.4
    assert found.value[known] == pytest.approx(truth[known], abs=1e-6)
    assert np.nanmax(found.error) < 1e-6


def test_the_standard_error_covers_the_truth_under_noise():
    x, y = scattered(6000)
    noise = np.random.Generator(np.random.Philox(key=9)).normal(0.0, 2.0, x.size)
    found = map_metric(x, y, quadratic(x, y) + noise)
    off = (found.value - quadratic(*np.meshgrid(found.x, found.y))) / found.error
    assert 0.90 < np.mean(np.abs(off[np.isfinite(off)]) < 2.0) < 0.99


def test_nothing_is_drawn_outside_the_cases():
    x, y = scattered()
    found = map_metric(x, y, quadratic(x, y))
    corners = found.value[[0, 0, -1, -1], [0, -1, 0, -1]]
    assert np.isnan(corners).all()


def test_failed_cases_leave_the_map_and_are_counted():
    x, y = scattered()
    z = quadratic(x, y)
    z[:100] = np.nan
    found = map_metric(x, y, z)
    assert (found.n_used, found.n_tried) == (2900, 3000)


@pytest.mark.parametrize("n", [0, 1, 2, 11])
def test_too_few_cases_give_no_map(n):
    x, y = scattered(n)
    assert map_metric(x, y, quadratic(x, y)) is None


def test_cases_on_a_line_give_no_map():
    x, _ = scattered(500)
    assert map_metric(x, 2.0 * x, x) is None
    assert map_metric(x, np.zeros(500), x) is None


def test_all_failed_gives_no_map():
    x, y = scattered(500)
    assert map_metric(x, y, np.full(500, np.nan)) is None


def test_a_constant_metric_is_flat():
    x, y = scattered(500)
    assert np.nanmax(np.abs(map_metric(x, y, np.full(500, 4.0)).value - 4.0)) < 1e-9
