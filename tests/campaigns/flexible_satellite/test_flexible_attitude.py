"""Attitude kinematics of the engine, compared with its matrices and SciPy's rotations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mc_engine.physics.attitude import quaternion_rates, rotation_quaternion, second_axis_in_body, turned_slightly
from mc_engine.physics.rotations import Quaternion, product, to_matrix

numbers = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(lambda q: np.dot(q, q) > 1e-2)
vectors = st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3)


def unit(q):
    return np.array(q) / np.linalg.norm(q)


def matrix(q):
    """From components in the reference frame to components in the body."""
    return np.reshape(to_matrix(Quaternion(*q)), (3, 3))


@given(numbers)
def test_the_second_axis_is_the_second_column_of_the_matrix(q):
    np.testing.assert_allclose(second_axis_in_body(*unit(q)), matrix(unit(q))[:, 1], atol=1e-14)


@given(numbers, vectors)
def test_the_rates_turn_the_matrix_as_poissons_equation_does(q, w):
    q, h = unit(q), 1e-5
    rate = np.array(quaternion_rates(*q, *w))
    assert rate @ q == pytest.approx(0.0, abs=1e-14)
    turned = (matrix(q + h * rate) - matrix(q - h * rate)) / (2.0 * h)
    w = np.array(w)
    np.testing.assert_allclose(turned, -np.cross(w, matrix(q), axisa=0, axisb=0, axisc=0), atol=1e-8)


@given(vectors)
def test_the_quaternion_of_a_rotation_vector_is_scipys(v):
    np.testing.assert_allclose(
        matrix(rotation_quaternion(np.array(v))), Rotation.from_rotvec(v).as_matrix().T, atol=1e-14
    )


@given(numbers, vectors)
def test_a_small_turn_is_the_further_rotation_to_first_order(q, v):
    q, v = unit(q), 1e-4 * np.array(v)
    whole = product(Quaternion(*q), Quaternion(*rotation_quaternion(v)))[1:]
    np.testing.assert_allclose(turned_slightly(*q, *v), whole, atol=1e-7)
