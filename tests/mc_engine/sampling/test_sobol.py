import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import qmc

from mc_engine.sampling.sobol import MAX_DIMENSIONS, scrambled_sobol, sobol_digits


def test_the_points_before_scrambling_are_those_of_scipy_in_every_dimension():
    theirs = qmc.Sobol(MAX_DIMENSIONS, scramble=False, bits=32).random(4096)
    indices = np.arange(4096, dtype=np.uint64)
    ours = np.column_stack([sobol_digits(d, indices) for d in range(MAX_DIMENSIONS)]) / 2.0**32
    assert ours.tobytes() == theirs.tobytes()


def test_a_point_far_down_the_sequence_is_reached_without_the_others():
    sampler = qmc.Sobol(5, scramble=False, bits=32)
    sampler.fast_forward(1_234_567)
    ours = [sobol_digits(d, np.array([1_234_567], dtype=np.uint64))[0] / 2.0**32 for d in range(5)]
    assert ours == sampler.random(1)[0].tolist()


@pytest.mark.parametrize("dimension", [0, 1, 17, 127])
@pytest.mark.parametrize("bits", [1, 5, 10])
def test_scrambling_keeps_one_point_in_each_elementary_interval(dimension, bits):
    points = scrambled_sobol(99, dimension, np.arange(2**bits))
    assert sorted((points * 2**bits).astype(int)) == list(range(2**bits))


def test_scrambling_keeps_the_net_in_two_dimensions():
    # A (0, m, 2)-net in base 2: every 2**-a by 2**-(m - a) box of the square holds one of the 2**m points.
    x, y = (scrambled_sobol(key, dimension, np.arange(1024)) for dimension, key in ((0, 5), (1, 6)))
    for a in range(11):
        boxes = (x * 2**a).astype(int) * 2 ** (10 - a) + (y * 2 ** (10 - a)).astype(int)
        assert len(set(boxes.tolist())) == 1024


def test_the_integral_of_a_smooth_function_converges_faster_than_by_chance():
    def error(n_points):
        errors = []
        for trial in range(20):
            x = np.column_stack([scrambled_sobol(1000 * trial + d, d, np.arange(n_points)) for d in range(4)])
            errors.append(np.prod(1.0 + 0.5 * (x - 0.5), axis=1).mean() - 1.0)
        return np.sqrt(np.mean(np.square(errors)))

    # By chance 64 times the points give an eighth of the error; scrambled nets on smooth functions give 1/512.
    assert error(4096) < error(64) / 100.0


def test_scrambled_points_are_uniform_over_the_keys():
    from scipy.stats import kstest

    draws = [scrambled_sobol(key, 3, np.array([17]))[0] for key in range(2000)]
    assert kstest(draws, "uniform").pvalue > 0.001


@given(cases=st.lists(st.integers(0, 2**32 - 1), min_size=1, max_size=30), dimension=st.integers(0, 127))
def test_each_point_is_a_function_of_its_own_index(cases, dimension):
    together = scrambled_sobol(1, dimension, np.array(cases))
    alone = [scrambled_sobol(1, dimension, np.array([case]))[0] for case in cases]
    assert together.tolist() == alone
    assert ((together >= 0.0) & (together < 1.0)).all()


def test_deeper_digits_are_flipped_by_coins_of_their_own():
    # The first point has only zeros for digits; its first and second four digits agree by chance, 1 in 16.
    points = np.array([scrambled_sobol(key, 0, np.array([0]))[0] for key in range(4000)])
    first, second = (points * 16).astype(int), (points * 256).astype(int) % 16
    assert (first == second).mean() == pytest.approx(1 / 16, abs=0.015)
