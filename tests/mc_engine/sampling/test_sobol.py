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


def test_the_integral_of_a_smooth_function_converges_faster_than_by_chance():
    def error(n_points):
        errors = []
        for trial in range(20):
            x = np.column_stack([scrambled_sobol(1000 * trial + d, d, np.arange(n_points)) for d in range(4)])
            errors.append(np.prod(1.0 + 0.5 * (x - 0.5), axis=1).mean() - 1.0)
        return np.sqrt(np.mean(np.square(errors)))

    # By chance 64 times the points give an eighth of the error; scrambled nets on smooth functions give 1/512.
    assert error(4096) < error(64) / 100.0


@given(cases=st.lists(st.integers(0, 2**32 - 1), min_size=1, max_size=30), dimension=st.integers(0, 127))
def test_each_point_is_a_function_of_its_own_index(cases, dimension):
    together = scrambled_sobol(1, dimension, np.array(cases))
    alone = [scrambled_sobol(1, dimension, np.array([case]))[0] for case in cases]
    assert together.tolist() == alone
    assert ((together >= 0.0) & (together < 1.0)).all()
