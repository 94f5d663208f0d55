import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import qmc

from mc_engine.halton import _permutations, _radical_inverse, prime, scrambled_halton


def test_the_bases_are_the_primes():
    assert [prime(d) for d in range(10)] == [2, 3, 5, 7, 11, 13, 17, 19, 23, 29]
    assert prime(99) == 541


@pytest.mark.parametrize("dimension", [0, 1, 2, 9])
def test_the_points_before_scrambling_are_those_of_scipy(dimension):
    base = prime(dimension)
    untouched = np.tile(np.arange(base), (len(_permutations(0, "x", base)), 1))
    ours = _radical_inverse(base, untouched, np.arange(500))
    theirs = qmc.Halton(10, scramble=False).random(500)[:, dimension]
    assert ours == pytest.approx(theirs, abs=1e-15)


def test_each_place_has_a_permutation_of_all_digits():
    permutations = _permutations(3, "x", 7)
    assert (np.sort(permutations, axis=1) == np.arange(7)).all()
    assert len({tuple(row) for row in permutations}) > 15  # of 22: the places are scrambled differently


@pytest.mark.parametrize("dimension", [0, 1, 3])
def test_scrambling_keeps_one_point_in_each_elementary_interval(dimension):
    cells = prime(dimension) ** 3
    points = scrambled_halton(1, "x", dimension, np.arange(cells))
    assert sorted((points * cells).astype(int)) == list(range(cells))


def test_the_discrepancy_is_far_below_that_of_chance():
    points = np.column_stack([scrambled_halton(4, f"n{d}", d, np.arange(2000)) for d in range(4)])
    chance = np.random.default_rng(4).random((2000, 4))
    assert qmc.discrepancy(points) < qmc.discrepancy(chance) / 20.0


@given(cases=st.lists(st.integers(0, 10**9), min_size=1, max_size=30), dimension=st.integers(0, 50))
def test_each_point_is_a_function_of_its_own_index(cases, dimension):
    together = scrambled_halton(8, "x", dimension, np.array(cases))
    alone = [scrambled_halton(8, "x", dimension, np.array([case]))[0] for case in cases]
    assert together.tolist() == alone
    assert ((together >= 0.0) & (together < 1.0)).all()
