"""Vectors, quaternions, direction cosines and Euler angles against SciPy's rotations."""

from collections import namedtuple

import numpy as np
import pytest
from records import by_both
from scipy.spatial.transform import Rotation

from mc_engine.errors import ModelError
from mc_engine.lanes import physics
from mc_engine.physics import rotations, vectors
from mc_engine.physics.rotations import Quaternion
from mc_engine.physics.vectors import Matrix, Vector

N = 100_000
ROTATIONS = Rotation.random(N, np.random.default_rng(20))
OTHERS = Rotation.random(N, np.random.default_rng(21))
VECTORS = np.random.default_rng(22).normal(size=(3, N))
SEQUENCES = ["123", "132", "213", "231", "312", "321", "121", "131", "212", "232", "313", "323"]
SAMPLED = ("321", "313")  # of continuous integration; what is not compiled takes ten seconds
COMPILED = {"321", "132", "313"}
Turn = namedtuple("Turn", "q0 q1 q2 q3 x y z")
Pair = namedtuple("Pair", "p0 p1 p2 p3 q0 q1 q2 q3")
TwoVectors = namedtuple("TwoVectors", "ax ay az bx by bz")


def scalar_first(rotation):
    return rotation.as_quat(scalar_first=True).T


def same_attitude(found, rotation, within=2e-15):
    """Components up to the common sign of all four."""
    wanted = scalar_first(rotation)
    assert np.abs(found * np.sign((found * wanted).sum(axis=0)) - wanted).max() < within


TURNS = np.concatenate([scalar_first(ROTATIONS), VECTORS])


def test_a_rotated_vector_is_scipys():
    @physics
    def function(r):
        return rotations.rotated(Quaternion(r.q0, r.q1, r.q2, r.q3), Vector(r.x, r.y, r.z))

    assert np.abs(by_both(function, Turn, TURNS) - ROTATIONS.apply(VECTORS.T).T).max() < 1e-14


def test_components_in_b_and_back_are_those_of_the_matrix_of_direction_cosines():
    @physics
    def function(r):
        q, v = Quaternion(r.q0, r.q1, r.q2, r.q3), Vector(r.x, r.y, r.z)
        into, matrix = rotations.transformed(q, v), rotations.to_matrix(q)
        back, again = rotations.transformed_back(q, into), vectors.transposed_times(matrix, into)
        return into, vectors.matrix_times(matrix, v), back, again

    found = by_both(function, Turn, TURNS)
    wanted = ROTATIONS.inv().apply(VECTORS.T).T
    assert np.abs(found[:6] - np.tile(wanted, (2, 1))).max() < 2e-14
    assert np.abs(found[6:] - np.tile(VECTORS, (2, 1))).max() < 2e-14


def test_the_matrix_is_scipys():
    found = by_both(rotations.to_matrix, Quaternion, scalar_first(ROTATIONS))
    assert np.abs(found - ROTATIONS.inv().as_matrix().reshape(N, 9).T).max() < 2e-15


def test_frames_are_chained_as_their_matrices_are_multiplied():
    @physics
    def function(r):
        first, second = Quaternion(r.p0, r.p1, r.p2, r.p3), Quaternion(r.q0, r.q1, r.q2, r.q3)
        both = rotations.chained(first, second)
        matrix = vectors.matrix_product(rotations.to_matrix(second), rotations.to_matrix(first))
        back = rotations.product(both, rotations.inverse(both))
        return both, rotations.from_matrix(matrix), back

    found = by_both(function, Pair, np.concatenate([scalar_first(ROTATIONS), scalar_first(OTHERS)]))
    same_attitude(found[:4], ROTATIONS * OTHERS)
    same_attitude(found[4:8], ROTATIONS * OTHERS, within=5e-15)
    assert np.abs(found[8:] - np.array([[1.0], [0.0], [0.0], [0.0]])).max() < 2e-15


def test_a_matrix_gives_its_quaternion_near_half_turns_too():
    angle = np.random.default_rng(3).choice([0.0, 1e-9, np.pi - 1e-9, np.pi], N)
    half_turns = Rotation.from_rotvec((VECTORS / np.linalg.norm(VECTORS, axis=0) * angle).T)
    matrices = half_turns.inv().as_matrix().reshape(N, 9).T
    same_attitude(by_both(rotations.from_matrix, Matrix, matrices), half_turns, within=5e-15)


@pytest.mark.parametrize(
    "sequence", [name if name in SAMPLED else pytest.param(name, marks=pytest.mark.slow) for name in SEQUENCES]
)
def test_euler_angles_are_scipys_for_all_twelve_sequences(sequence):
    from_angles, to_angles = rotations.euler_sequence(sequence)
    name = "".join("XYZ"[int(axis) - 1] for axis in sequence)

    @physics
    def back(r):
        return from_angles(r.x, r.y, r.z)

    quaternions = scalar_first(ROTATIONS)
    compiles = sequence in COMPILED  # which takes seconds
    angles = by_both(to_angles, Quaternion, quaternions) if compiles else np.array(to_angles(Quaternion(*quaternions)))
    wanted = ROTATIONS.as_euler(name).T
    lever = np.abs(np.sin(wanted[1]) if sequence[0] == sequence[2] else np.cos(wanted[1]))
    error = np.abs((angles - wanted + np.pi) % (2.0 * np.pi) - np.pi)
    assert (error * lever).max() < 5e-15  # of the outer angles, which a small lever tells apart badly
    same_attitude(by_both(back, Vector, wanted) if compiles else np.array(back(Vector(*wanted))), ROTATIONS, 5e-15)


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_euler_angles_at_the_ends_of_the_second_give_the_attitude_back(sequence):
    from_angles, to_angles = rotations.euler_sequence(sequence)
    ends = [0.0, np.pi] if sequence[0] == sequence[2] else [-np.pi / 2, np.pi / 2]
    rng = np.random.default_rng(5)
    first, third = rng.uniform(-np.pi, np.pi, (2, 1000))
    there = np.array(from_angles(first, rng.choice(ends, 1000), third))
    again = np.array(from_angles(*to_angles(Quaternion(*there))))
    assert np.abs(np.abs((there * again).sum(axis=0)) - 1.0).max() < 1e-14


@pytest.mark.parametrize("axes", ["", "32", "322", "124", "3211", "zyx", 322, None])
def test_what_is_no_sequence_is_refused_with_one(axes):
    with pytest.raises(ModelError, match="three digits"):
        rotations.euler_sequence(axes)


def test_yaw_pitch_and_roll_turn_the_axes_one_after_the_other():
    nose = rotations.transformed_back(rotations.from_euler_321(0.3, 0.2, 0.9), Vector(1.0, 0.0, 0.0))
    # heading 0.3 rad towards y; with z down a positive pitch raises the nose
    assert nose == pytest.approx((np.cos(0.2) * np.cos(0.3), np.cos(0.2) * np.sin(0.3), -np.sin(0.2)), abs=1e-15)


def test_rotation_vectors_are_scipys_from_nothing_to_half_a_turn():
    size = np.random.default_rng(7).choice([0.0, 1e-200, 1e-9, 1e-5, 9e-5, 1.1e-4, 1.0, np.pi - 1e-6], N)
    turns = size * VECTORS / np.linalg.norm(VECTORS, axis=0)
    found = by_both(rotations.from_rotation_vector, Vector, turns)
    same_attitude(found, Rotation.from_rotvec(turns.T))
    back = by_both(rotations.to_rotation_vector, Quaternion, -found)
    assert (np.abs(back - turns) <= 1e-15 * np.maximum(1.0, 1e-200 + size) * 5.0).all()
    assert np.abs(back - turns)[:, size == 1e-9].max() < 1e-24


def test_the_shortest_turn_from_one_vector_to_another_is_found():
    @physics
    def function(r):
        return rotations.from_two_vectors(Vector(r.ax, r.ay, r.az), Vector(r.bx, r.by, r.bz))

    a, b = VECTORS, np.random.default_rng(8).normal(size=(3, N))
    b[:, :1000] = -2.0 * a[:, :1000]
    b[:, 1000:2000] = 3.0 * a[:, 1000:2000]
    q = by_both(function, TwoVectors, np.concatenate([a, b]))
    turned = np.array(rotations.rotated(Quaternion(*q), Vector(*a)))
    directions = [v / np.linalg.norm(v, axis=0) for v in (turned, b)]
    assert np.abs(directions[0] - directions[1]).max() < 2e-14
    assert np.abs(np.linalg.norm(q, axis=0) - 1.0).max() < 1e-15
    cosine = (a * b).sum(axis=0) / np.linalg.norm(a, axis=0) / np.linalg.norm(b, axis=0)
    assert np.abs(2.0 * q[0] ** 2 - 1.0 - cosine).max() < 1e-14


@pytest.mark.parametrize("short_of_half_a_turn", [1e-2, 1e-4, 1e-7, 1e-8, 1e-12, 1e-15])
def test_the_turn_to_a_nearly_opposite_vector_keeps_all_digits(short_of_half_a_turn):
    a = VECTORS
    across = np.cross(a.T, np.random.default_rng(9).normal(size=(N, 3)))
    across /= np.linalg.norm(across, axis=1)[:, None]
    b = -3.0 * Rotation.from_rotvec(-short_of_half_a_turn * across).apply(a.T).T
    q = rotations.from_two_vectors(Vector(*a), Vector(*b))
    turned = np.array(rotations.rotated(q, Vector(*a)))
    directions = [v / np.linalg.norm(v, axis=0) for v in (turned, b)]
    assert np.abs(directions[0] - directions[1]).max() < 4e-15


def test_small_angles_are_right_to_third_order():
    angles = 1e-3 * VECTORS[:, :1000]
    q = np.array(rotations.from_small_angles(Vector(*angles)))
    exact = scalar_first(Rotation.from_rotvec(angles.T))
    exact *= np.sign(exact[0])
    size = np.linalg.norm(angles, axis=0)
    assert (np.linalg.norm(q - exact, axis=0) <= size**3 / 12.0 / 2.0 * 1.01).all()


def test_the_derivative_leads_to_the_attitude_after_a_while():
    some = slice(0, 10_000)  # not compiled
    q, rate = Quaternion(*scalar_first(ROTATIONS[some])), Vector(*VECTORS[:, some])
    step = 1e-6
    after, before = (np.array(rotations.advanced(q, rate, h)) for h in (step, -step))
    assert np.abs((after - before) / (2.0 * step) - np.array(rotations.derivative(q, rate))).max() < 1e-9
    turned = ROTATIONS[some] * Rotation.from_rotvec(0.7 * VECTORS[:, some].T)
    same_attitude(np.array(rotations.advanced(q, rate, 0.7)), turned)


def test_the_held_derivative_pulls_the_length_back_to_one():
    q = Quaternion(*(1.01 * scalar_first(ROTATIONS)))
    grown = 2.0 * sum(a * b for a, b in zip(q, rotations.derivative_held(q, Vector(*VECTORS), 2.0), strict=True))
    assert grown == pytest.approx(2.0 * (1.0 - 1.01**2) * 1.01**2, rel=1e-12)


def test_products_of_vectors_are_numpys():
    @physics
    def function(r):
        a, b = Vector(r.ax, r.ay, r.az), Vector(r.bx, r.by, r.bz)
        return vectors.cross(a, b), (vectors.dot(a, b),), vectors.unit(a), vectors.added_scaled(a, 2.0, b)

    a, b = VECTORS, np.roll(VECTORS, 1, axis=1)
    found = by_both(function, TwoVectors, np.concatenate([a, b]))
    assert np.abs(found[:3] - np.cross(a, b, axis=0)).max() < 1e-14
    assert np.abs(found[3] - (a * b).sum(axis=0)).max() < 1e-14
    assert np.abs(found[4:7] - a / np.linalg.norm(a, axis=0)).max() < 1e-15
    assert np.abs(found[7:] - (a + 2.0 * b)).max() < 1e-14
    assert np.array(vectors.subtracted(vectors.added(Vector(*a), Vector(*b)), Vector(*b))) == pytest.approx(a)


def test_a_division_by_zero_on_plain_numbers_is_that_of_kernels():
    assert np.isnan(rotations.normalized(rotations.Quaternion(0.0, 0.0, 0.0, 0.0))).all()
    assert np.isnan(rotations.normalized(rotations.Quaternion(0, 0, 0, 0))).all()
