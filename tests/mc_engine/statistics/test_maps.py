"""Maps of a metric over two inputs."""

import numpy as np
import pytest

from mc_engine.statistics import map_metric
from mc_engine.statistics.maps import explained_share


def scattered(n=3000, key=1):
    draw = np.random.Generator(np.random.Philox(key=key))
    return draw.normal(0.0, 7.0, n), draw.normal(0.0, 0.05, n)


def quadratic(x, y):
    return 3.0 + 0.5 * x - 40.0 * y + 0.02 * x * x - 2.0 * x * y + 300.0 * y * y


def test_a_full_grid_is_given_back_exactly():
    x, y = np.linspace(-20.0, 20.0, 9), np.linspace(-15.0, 15.0, 7)
    grid_x, grid_y = np.meshgrid(x, y)
    order = np.random.Generator(np.random.Philox(key=2)).permutation(63)
    surface = map_metric(grid_x.ravel()[order], grid_y.ravel()[order], np.hypot(grid_x, grid_y).ravel()[order])
    assert surface.exact
    assert surface.error is None
    assert (surface.value == np.hypot(grid_x, grid_y)).all()


def test_a_grid_with_a_failed_case_has_one_blank_node():
    grid_x, grid_y = (values.ravel() for values in np.meshgrid(np.arange(4.0), np.arange(3.0)))
    z = grid_x + grid_y
    z[5] = np.nan
    surface = map_metric(grid_x, grid_y, z)
    assert np.isnan(surface.value).sum() == 1
    assert (surface.n_used, surface.n_tried) == (11, 12)


def test_a_grid_flown_several_times_gives_means_and_their_standard_errors():
    grid_x, grid_y = (np.tile(values.ravel(), 4) for values in np.meshgrid(np.arange(3.0), np.arange(2.0)))
    z = 10.0 * grid_x + np.repeat([0.0, 1.0, 2.0, 3.0], 6)
    surface = map_metric(grid_x, grid_y, z)
    assert surface.cases_per_node == 4
    assert surface.value == pytest.approx(np.array([[1.5, 11.5, 21.5]] * 2))
    assert surface.explained == pytest.approx(1.0 - (6 * 5.0 / 18) / z.var())  # within nodes 5 each, 24 - 6 free
    assert surface.error == pytest.approx(np.full((2, 3), np.std([0, 1, 2, 3], ddof=1) / 2.0))


def test_a_quadratic_surface_is_found_exactly_with_no_error():
    x, y = scattered()
    surface = map_metric(x, y, quadratic(x, y))
    truth = quadratic(*np.meshgrid(surface.x, surface.y))
    known = np.isfinite(surface.value)
    assert known.mean() > 0.4
    assert surface.value[known] == pytest.approx(truth[known], abs=1e-6)
    assert np.nanmax(surface.error) < 1e-6


@pytest.mark.parametrize("power", [(3, 0), (2, 1), (1, 2), (0, 3)])
def test_of_a_cubic_surface_the_error_is_what_the_quadratic_misses(power):
    x, y = np.random.Generator(np.random.Philox(key=6)).uniform(-1.0, 1.0, (2, 400))
    surface = map_metric(x, y, x ** power[0] * y ** power[1], points=15)
    grid_x, grid_y = np.meshgrid(surface.x, surface.y)
    off = np.abs(surface.value - grid_x ** power[0] * grid_y ** power[1])
    known = np.isfinite(off)
    assert known.mean() > 0.7
    assert (off <= surface.error + 1e-9)[known].all()  # which the scatter about the quadratic adds to
    assert np.median(surface.error[known]) < 2.0 * np.median(off[known]) + 0.01


SURFACES = {
    "quadratic": lambda x, y: 1.0 + 2.0 * x - y + x * y,
    "waves": lambda x, y: np.sin(2.0 * x) * np.cos(1.5 * y) + 0.3 * x,
    "ridge": lambda x, y: 1.0 / (1.0 + 4.0 * (x + y) ** 2),
    "cone": np.hypot,  # the fuel over the burn's errors: with a tip
}


def covered(surface, noise, n, campaigns):
    """Share of places where the true surface lies within two errors, and the numbers of neighbours."""
    inside, neighbours = [], []
    for key in range(campaigns):
        draw = np.random.Generator(np.random.Philox(key=key))
        x, y = draw.normal(size=(2, n))
        result = map_metric(x, y, surface(x, y) + noise * draw.normal(size=n), points=31)
        off = np.abs(result.value - surface(*np.meshgrid(result.x, result.y))) / result.error
        inside.append(np.mean(off[np.isfinite(off)] < 2.0))
        neighbours.append(result.neighbours)
    return np.mean(inside), neighbours


OFTEN = [("waves", noise) for noise in (1e-3, 0.1, 0.5)] + [(kind, 0.5) for kind in SURFACES] + [("cone", 1e-3)]


@pytest.mark.parametrize(
    ("kind", "noise"),
    [
        pytest.param(kind, noise, marks=() if (kind, noise) in OFTEN else pytest.mark.slow)
        for kind in SURFACES
        for noise in (1e-3, 0.1, 0.5)
    ],
)
def test_two_errors_hold_the_true_surface_whatever_it_is(kind, noise):
    # nominal 95 %; places of one map err together, so that three campaigns scatter by some percent
    share, _ = covered(SURFACES[kind], noise, 2000, campaigns=3)
    assert share > 0.90


def test_a_hole_between_the_cases_stays_blank():
    draw = np.random.Generator(np.random.Philox(key=5))
    angle, radius = draw.uniform(0.0, 2.0 * np.pi, 4000), draw.uniform(1.0, 2.0, 4000)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    surface = map_metric(x, y, np.sin(2.0 * x) + y)
    far = np.hypot(*np.meshgrid(surface.x, surface.y))
    assert np.isnan(surface.value[far < 0.7]).all()
    assert np.isfinite(surface.value[(far > 1.1) & (far < 1.9)]).mean() > 0.99


@pytest.mark.parametrize("n", [300, 2000])
def test_no_surface_is_drawn_between_three_levels_of_an_input(n):
    """A quadratic fits three levels exactly, whatever the metric does between them: the stated error was small."""
    x, y = scattered(n)
    level = np.round(np.clip(x, -1.0, 1.0))
    surface = map_metric(level, y, level + y + np.sin(np.pi * level))
    assert np.unique(level).size == 3
    assert np.isnan(surface.value).all()


@pytest.mark.parametrize("levels", [5, 8, 10, 15])
def test_a_smooth_surface_between_more_levels_is_drawn_everywhere(levels):
    """Some neighbourhoods hold only three of them."""
    draw = np.random.Generator(np.random.Philox(key=3))
    x, y = draw.integers(0, levels, 400) / (levels - 1.0), draw.uniform(0.0, 1.0, 400)
    surface = map_metric(x, y, np.sin(x) + y * y + x * y, points=41)
    assert np.isfinite(surface.value).mean() > 0.9


def test_what_no_cross_validation_can_tell_is_not_told_as_all_of_the_variance():
    x, y = scattered(400)
    noise = np.random.Generator(np.random.Philox(key=9)).normal(size=400)
    assert np.isnan(explained_share(x[:30], y[:30], noise[:30]))  # too few to leave any out
    assert np.isnan(explained_share(np.sign(x - np.median(x)), y, noise))  # no surface through two levels


@pytest.mark.parametrize("n", [0, 1, 2, 23])
def test_too_few_cases_give_no_map(n):
    x, y = scattered(n)
    assert map_metric(x, y, quadratic(x, y)) is None


@pytest.mark.parametrize("noise", [1e-3, *(pytest.param(noise, marks=pytest.mark.slow) for noise in (0.1, 0.5))])
def test_neighbourhoods_that_are_left_out_as_far_too_wide_would_not_have_been_chosen(monkeypatch, noise):
    draw = np.random.Generator(np.random.Philox(key=3))
    x, y = draw.normal(size=(2, 2000))
    z = SURFACES["waves"](x, y) + noise * draw.normal(size=2000)
    short = map_metric(x, y, z, points=11)
    monkeypatch.setattr("mc_engine.statistics.maps.WORSE_FOR_GOOD", np.inf)
    whole = map_metric(x, y, z, points=11)
    assert short.neighbours == whole.neighbours
    assert (short.explained, short.value.tobytes()) == (whole.explained, whole.value.tobytes())
