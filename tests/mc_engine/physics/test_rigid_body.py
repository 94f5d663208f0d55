"""Rigid bodies against closed forms, kept quantities, point masses, and another formulation by SciPy."""

from collections import namedtuple

import numpy as np
import pytest
from records import by_both
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from mc_engine.lanes import physics
from mc_engine.physics import rigid_body as body
from mc_engine.physics.constants import EARTH_RATE, EQUATORIAL_RADIUS, J2_EARTH, MU_EARTH
from mc_engine.physics.earth_frames import velocity_eci_to_ecef
from mc_engine.physics.rigid_body import Inertia, Motion
from mc_engine.physics.rotations import Quaternion, to_matrix, transformed, transformed_back
from mc_engine.physics.vectors import Vector

RNG = np.random.default_rng(41)
POINTS = RNG.normal(size=(12, 3)) * [2.0, 0.7, 0.4]
MASSES = RNG.uniform(1.0, 5.0, 12)
POINTS -= (MASSES @ POINTS) / MASSES.sum()


def inertia_of(points, masses):
    x, y, z = points.T
    moments = [masses @ (y * y + z * z), masses @ (x * x + z * z), masses @ (x * x + y * y)]
    return Inertia(*moments, masses @ (x * y), masses @ (x * z), masses @ (y * z))


INERTIA = inertia_of(POINTS, MASSES)


def tensor(i):
    return np.array([[i.xx, -i.xy, -i.xz], [-i.xy, i.yy, -i.yz], [-i.xz, -i.yz, i.zz]])


def motion_of(y):
    return Motion(Vector(*y[:3]), Vector(*y[3:6]), Quaternion(*y[6:10]), Vector(*y[10:]))


def flat(derivative):
    return np.concatenate([np.array(part) for part in derivative])


def flown(derivative, start, until):
    return solve_ivp(derivative, (0.0, until), start, rtol=1e-12, atol=1e-12, method="DOP853").y[:, -1]


TENSOR = tensor(INERTIA)
State = namedtuple("State", "x y z vx vy vz q0 q1 q2 q3 wx wy wz")


def test_momentum_and_rate_are_inverse_and_those_of_the_tensor():
    @physics
    def function(w):
        h = body.angular_momentum(INERTIA, w)
        return h, body.rate_of(INERTIA, h)

    rates = RNG.normal(size=(3, 4096))
    found = by_both(function, Vector, rates)
    assert np.abs(found[:3] - TENSOR @ rates).max() < 1e-12
    assert np.abs(found[3:] - rates).max() < 1e-12


def test_the_inertia_about_another_point_is_that_of_the_point_masses():
    arm = np.array([0.3, -1.2, 2.0])
    found = body.inertia_about(INERTIA, MASSES.sum(), Vector(*arm))
    assert found == pytest.approx(inertia_of(POINTS - arm, MASSES), rel=1e-13)
    assert body.inertia_about(found, -MASSES.sum(), Vector(*arm)) == pytest.approx(INERTIA, rel=1e-12)


def test_a_free_axisymmetric_body_nutates_at_the_rate_of_the_book():
    across, along, spin, slant = 4.0, 1.5, 2.0, 0.3
    inertia = Inertia(along, across, across, 0.0, 0.0, 0.0)

    def turn(t, w):
        return np.array(body.angular_acceleration(inertia, Vector(*w), Vector(0.0, 0.0, 0.0)))

    end = flown(turn, [spin, slant, 0.0], 7.0)
    rate = (along - across) / across * spin
    assert end == pytest.approx([spin, slant * np.cos(rate * 7.0), slant * np.sin(rate * 7.0)], abs=1e-10)


def test_a_free_body_keeps_energy_and_angular_momentum():
    start = np.array([0, 0, 0, 0, 0, 0, *Rotation.random(rng=5).as_quat(scalar_first=True), 0.4, -1.1, 0.8])
    none = Vector(0.0, 0.0, 0.0)
    end = flown(lambda t, y: flat(body.flat_derivative(motion_of(y), 10.0, INERTIA, none, none, 0.0)), start, 20.0)
    before, after = motion_of(start), motion_of(end)
    energies = [np.array(m.rate) @ TENSOR @ np.array(m.rate) for m in (before, after)]
    momenta = [transformed_back(m.attitude, body.angular_momentum(INERTIA, m.rate)) for m in (before, after)]
    assert energies[1] == pytest.approx(energies[0], rel=1e-10)
    assert momenta[1] == pytest.approx(momenta[0], rel=1e-9)
    assert np.abs(np.array(after.rate) - np.array(before.rate)).max() > 0.1


def test_a_body_whose_inertia_changes_keeps_its_angular_momentum():
    empty, full = inertia_of(POINTS, 0.4 * MASSES), INERTIA

    def turn(t, y):
        q, w = Quaternion(*y[:4]), Vector(*y[4:])
        inertia, change = body.inertia_between(empty, full, 1.0 - 0.1 * t), body.inertia_rate(empty, full, -0.1)
        faster = body.angular_acceleration_changing(inertia, change, w, Vector(0.0, 0.0, 0.0))
        return [*body.derivative(q, w), *faster]

    start = [*Rotation.random(rng=6).as_quat(scalar_first=True), 0.4, -1.1, 0.8]
    end = flown(turn, start, 10.0)
    momenta = [
        transformed_back(Quaternion(*y[:4]), body.angular_momentum(inertia, Vector(*y[4:])))
        for y, inertia in ((start, full), (end, empty))
    ]
    assert momenta[1] == pytest.approx(momenta[0], rel=1e-9)


def test_jet_damping_works_against_the_turn():
    moment = body.jet_damping(2.0, Vector(-3.0, 0.0, 0.0), Vector(0.1, 0.2, 0.0))
    assert moment == pytest.approx((0.0, -2.0 * 9.0 * 0.2, 0.0))


def test_the_gravity_gradient_is_that_of_the_point_masses():
    r = 7e6 * np.array([0.6, -0.48, 0.64])
    away = r + POINTS
    # the pull of each point less the common one, which loses no digits: (1 + x)^-1.5 - 1 of a small x
    x = (2.0 * POINTS @ r + (POINTS * POINTS).sum(axis=1)) / (r @ r)
    forces = -MU_EARTH / np.linalg.norm(r) ** 3 * MASSES[:, None] * (np.expm1(-1.5 * np.log1p(x))[:, None] * away)
    exact = np.cross(POINTS, forces).sum(axis=0)
    found = np.array(body.gravity_gradient(INERTIA, Vector(*r)))
    assert found == pytest.approx(exact, rel=1e-5)
    assert body.gravity_gradient(INERTIA, Vector(*r), 2.0 * MU_EARTH) == pytest.approx(2.0 * found)


def test_forces_point_where_their_names_say():
    assert body.thrust_force(10.0, 0.0, 0.0) == (10.0, 0.0, 0.0)
    assert body.thrust_force(10.0, 0.1, 0.2) == pytest.approx((9.7517, 1.9768, -0.9983), abs=1e-4)
    drag = body.aerodynamic_force(100.0, 0.5, 0.1, 0.0, 0.4, 0.0, 0.0)
    assert drag == pytest.approx((-20.0 * np.cos(0.1), 0.0, -20.0 * np.sin(0.1)))
    lift = body.aerodynamic_force(100.0, 0.5, 0.1, 0.0, 0.0, 0.0, 1.0)
    assert lift == pytest.approx((50.0 * np.sin(0.1), 0.0, -50.0 * np.cos(0.1)))
    assert body.aerodynamic_moment(100.0, 0.5, 2.0, 0.1, 0.2, 0.3) == pytest.approx((10.0, 20.0, 30.0))
    assert body.moment_of(Vector(0.0, 0.0, -5.0), Vector(-2.0, 0.0, 0.0)) == (0.0, -10.0, 0.0)  # the nose goes down


def test_a_body_thrown_over_flat_ground_flies_a_parabola():
    start = np.array([1.0, 2.0, -100.0, 20.0, 5.0, -30.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    push = Vector(3.0, 0.0, 0.0)
    none = Vector(0.0, 0.0, 0.0)
    end = flown(lambda t, y: flat(body.flat_derivative(motion_of(y), 6.0, INERTIA, push, none, 9.8)), start, 4.0)
    assert end[:3] == pytest.approx([1.0 + 80.0 + 4.0, 22.0, -100.0 - 120.0 + 78.4], rel=1e-12)


# a body at its perigee: force and moment as functions of time, in body axes
START = np.array([6.6e6, 1e5, -2e5, 100.0, 6.5e3, 4.3e3, *Rotation.random(rng=9).as_quat(scalar_first=True),
                  0.02, -0.05, 0.1])  # fmt: skip


def force_at(t):
    return Vector(200.0 * np.cos(0.1 * t), 30.0, -10.0 + t)


def moment_at(t):
    return Vector(0.5 * np.sin(0.2 * t), -1.0, 0.3)


def in_eci(t, y):
    motion, moment = motion_of(y), moment_at(t)
    gradient = body.gravity_gradient(INERTIA, transformed(motion.attitude, motion.position))
    together = Vector(*(np.array(moment) + np.array(gradient)))
    return flat(body.orbital_derivative(motion, 50.0, INERTIA, force_at(t), together))


def in_turning_axes(t, y):
    """The same motion in Earth-fixed axes the attitude as a matrix, J2 as the gradient of a potential."""
    r, v, c, w = y[:3], y[3:6], y[6:15].reshape(3, 3), y[15:]
    turn = np.array([0.0, 0.0, EARTH_RATE])

    def potential(r):
        d = np.sqrt(r @ r)
        return MU_EARTH / d * (1.0 - J2_EARTH * (EQUATORIAL_RADIUS / d) ** 2 * (1.5 * (r[2] / d) ** 2 - 0.5))

    steps = 50.0 * np.eye(3)
    gravity = np.array([(8.0 * (potential(r + h) - potential(r - h)) - (potential(r + 2 * h) - potential(r - 2 * h)))
                        / 600.0 for h in steps])  # fmt: skip
    faster = c.T @ np.array(force_at(t)) / 50.0 + gravity - 2.0 * np.cross(turn, v)
    faster -= np.cross(turn, np.cross(turn, r))
    r_body = c @ r
    moment = np.array(moment_at(t)) + 3.0 * MU_EARTH / (r @ r) ** 2.5 * np.cross(r_body, TENSOR @ r_body)
    relative = w - c @ turn  # of the body to the Earth
    cross = np.array([[0, relative[2], -relative[1]], [-relative[2], 0, relative[0]], [relative[1], -relative[0], 0]])
    return np.concatenate([v, faster, (cross @ c).ravel(), np.linalg.solve(TENSOR, moment - np.cross(w, TENSOR @ w))])


def test_six_degrees_of_freedom_agree_with_another_formulation():
    end = motion_of(flown(in_eci, START, 60.0))
    first = motion_of(START)
    velocity = velocity_eci_to_ecef(first.position, first.velocity, 0.0)
    attitude = np.array(to_matrix(first.attitude))
    other = solve_ivp(in_turning_axes, (0.0, 60.0), np.concatenate([START[:3], velocity, attitude, START[10:]]),
                      rtol=1e-11, atol=1e-11, method="DOP853").y[:, -1]  # fmt: skip
    turned = Rotation.from_euler("z", 60.0 * EARTH_RATE)
    assert turned.apply(other[:3]) == pytest.approx(end.position, abs=1e-4)
    inertial = other[3:6] + np.cross([0.0, 0.0, EARTH_RATE], other[:3])
    assert turned.apply(inertial) == pytest.approx(end.velocity, abs=1e-5)
    assert other[15:] == pytest.approx(end.rate, abs=1e-9)
    body_from_eci = other[6:15].reshape(3, 3) @ turned.as_matrix().T
    assert body_from_eci.ravel() == pytest.approx(np.array(to_matrix(end.attitude)), abs=1e-8)


def test_the_derivatives_are_the_same_in_lanes():
    @physics
    def function(s):
        motion = Motion(Vector(s.x, s.y, s.z), Vector(s.vx, s.vy, s.vz), Quaternion(s.q0, s.q1, s.q2, s.q3),
                        Vector(s.wx, s.wy, s.wz))  # fmt: skip
        force, moment = Vector(1.0, 2.0, 3.0), Vector(0.1, 0.2, 0.3)
        one = body.orbital_derivative(motion, 5.0, INERTIA, force, moment)
        other = body.flat_derivative(motion, 5.0, INERTIA, force, moment, 9.8)
        wind = Vector(1.0, 2.0, 3.0)
        air = body.air_velocity(motion.position, motion.velocity, motion.attitude, wind)
        place, speed = body.point_of_body(motion, wind)
        return one.velocity, one.attitude, one.rate, other.velocity, air, place, speed

    rows = START[:, None] * RNG.uniform(0.9, 1.1, (13, 4096))
    found = by_both(function, State, rows, rtol=1e-12)
    state = rows[:, 0]
    motion = motion_of(state)
    alone = body.orbital_derivative(motion, 5.0, INERTIA, Vector(1.0, 2.0, 3.0), motion.rate)
    assert found[:3, 0] == pytest.approx(alone.velocity, rel=1e-12)
    arm = np.array([1.0, 2.0, 3.0])
    turned = np.array(transformed_back(motion.attitude, Vector(*arm)))
    assert found[16:19, 0] == pytest.approx(state[:3] + turned, rel=1e-12)
    ground = state[3:6] - np.cross([0.0, 0.0, EARTH_RATE], state[:3]) - arm
    assert found[13:16, 0] == pytest.approx(transformed(motion.attitude, Vector(*ground)), rel=1e-12)
