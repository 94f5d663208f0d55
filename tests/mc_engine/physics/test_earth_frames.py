"""Frames at the Earth against pyproj, pyerfa and NumPy's vector products."""

from collections import namedtuple

import erfa
import numpy as np
import pytest
from pyproj import Transformer
from records import by_both
from scipy.integrate import solve_ivp

from mc_engine.lanes import physics
from mc_engine.physics import earth_frames as frames
from mc_engine.physics.constants import EARTH_RATE, MU_EARTH
from mc_engine.physics.earth_frames import Course, Flow, Geodetic, Relative
from mc_engine.physics.sun_moon import terrestrial_time
from mc_engine.physics.vectors import Matrix, Vector, matrix_product, matrix_times, transposed_times

N = 100_000
RNG = np.random.default_rng(31)
PLACES = np.array([np.arcsin(RNG.uniform(-1.0, 1.0, N)), RNG.uniform(-np.pi, np.pi, N), 10.0 ** RNG.uniform(0, 8.5, N)])
PLACES[2, ::3] = RNG.uniform(-1e4, 1e5, PLACES[2, ::3].size)
PLACES[0, :8] = [np.pi / 2, -np.pi / 2, 0.0, 1e-9, -1e-9, np.pi / 2 - 1e-9, 0.5, -0.5]
State = namedtuple("State", "rx ry rz vx vy vz angle")
STATES = np.concatenate([RNG.normal(size=(3, N)) * 7e6, RNG.normal(size=(3, N)) * 7e3, RNG.uniform(-9.0, 9.0, (1, N))])
Two = namedtuple("Two", "rx ry rz vx vy vz sx sy sz wx wy wz")
Angles = namedtuple("Angles", "a b")
TO_ECEF = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)


def ecef_by_pyproj(places):
    latitude, longitude, altitude = places
    return np.array(TO_ECEF.transform(np.degrees(longitude), np.degrees(latitude), altitude))


def test_ecef_positions_are_those_of_pyproj_and_erfa():
    found = by_both(frames.geodetic_to_ecef, Geodetic, PLACES)
    scale = np.linalg.norm(found, axis=0)
    assert (np.abs(found - ecef_by_pyproj(PLACES)).max(axis=0) / scale).max() < 1e-15
    theirs = erfa.gd2gc(1, PLACES[1], PLACES[0], PLACES[2]).T
    assert (np.abs(found - theirs).max(axis=0) / scale).max() < 1e-15


def test_geodetic_places_are_those_that_the_positions_were_made_of_and_erfas():
    @physics
    def function(r):
        return frames.ecef_to_geodetic(r)

    positions = ecef_by_pyproj(PLACES)
    found = by_both(function, Vector, positions)
    scale = np.linalg.norm(positions, axis=0)
    east, north, up = erfa.gc2gd(1, positions.T)
    # erfa.gc2gd makes one step of its own (Fukushima, 2006), which is less exact
    for (latitude, longitude, altitude), within in ((PLACES, 1e-15), ((north, east, up), 3e-11)):
        assert np.abs(found[0] - latitude).max() < within
        turned = np.abs(found[1] - longitude)
        assert (np.minimum(turned, 2.0 * np.pi - turned) * np.cos(latitude)).max() < 3e-15
        assert (np.abs(found[2] - altitude) / np.maximum(scale, 4e6)).max() < 1e-15


def test_level_coordinates_are_those_of_pyproj():
    origin = Geodetic(0.9, -2.0, 250.0)
    position = Vector(*ecef_by_pyproj(np.array([0.9 + 0.01 * PLACES[0], -2.0 + 0.01 * PLACES[1], 1e-3 * PLACES[2]])))
    text = f"+proj=topocentric +ellps=WGS84 +lon_0={np.degrees(-2.0)} +lat_0={np.degrees(0.9)} +h_0=250"
    up = Transformer.from_pipeline(text)
    east, north, height = up.transform(*position)
    found = np.array(frames.ecef_to_ned(position, origin))
    assert np.abs(found - np.array([north, east, -height])).max() < 1e-8
    assert np.abs(np.array(frames.ned_to_ecef(Vector(*found), origin)) - np.array(position)).max() < 1e-8


def test_matrices_of_ned_are_rotations_and_turn_with_the_earth():
    @physics
    def function(r):
        return frames.ned_from_ecef(r.a, r.b), frames.ned_from_eci(r.a, r.b, 0.7)

    found = by_both(function, Angles, PLACES[:2]).reshape(2, 3, 3, N)
    for matrices in found:
        unit = np.einsum("ijn,kjn->ikn", matrices, matrices)
        assert np.abs(unit - np.eye(3)[:, :, None]).max() < 1e-15
    turn = np.array([[np.cos(0.7), np.sin(0.7), 0.0], [-np.sin(0.7), np.cos(0.7), 0.0], [0.0, 0.0, 1.0]])
    assert np.abs(found[1] - np.einsum("ijn,jk->ikn", found[0], turn)).max() < 2e-15
    ahead = ecef_by_pyproj(PLACES + np.array([[0.0], [0.0], [1.0]])) - ecef_by_pyproj(PLACES)
    near = PLACES[2] < 1e5
    assert np.abs(-found[0][2] - ahead)[:, near].max() < 2e-9  # up, by a metre of altitude


def test_rates_of_a_place_are_its_velocity():
    latitude, longitude, altitude = PLACES[:, PLACES[2] < 1e5][:, 8:10_008]  # not compiled
    v = RNG.normal(size=(3, latitude.size)) * 1e3
    rates = np.array(frames.geodetic_rates(latitude, altitude, Vector(*v)))
    step = 1e-2
    ahead, behind = (ecef_by_pyproj(np.array([latitude, longitude, altitude]) + h * rates) for h in (step, -step))
    level = matrix_times(frames.ned_from_ecef(latitude, longitude), Vector(*((ahead - behind) / (2.0 * step))))
    ordinary = np.abs(latitude) < 1.5
    assert np.abs(np.array(level) - v)[:, ordinary].max() < 1e-3


def test_the_earth_rotation_angle_is_erfas():
    days = RNG.uniform(-40_000.0, 40_000.0, (1, N))
    found = by_both(lambda_of(frames.earth_rotation_angle), namedtuple("Days", "days"), days)[0]
    wanted = erfa.era00(2_451_545.0, days[0])
    difference = np.abs(found - wanted)
    assert np.minimum(difference, 2.0 * np.pi - difference).max() < 2e-13  # half a microsecond of arc: 40 000 turns


def lambda_of(function):
    @physics
    def call(r):
        return (function(r.days),)

    return call


def test_inertial_and_turning_positions_and_velocities_go_both_ways():
    @physics
    def function(s):
        r, v = Vector(s.rx, s.ry, s.rz), Vector(s.vx, s.vy, s.vz)
        fixed, moving = frames.eci_to_ecef(r, s.angle), frames.velocity_eci_to_ecef(r, v, s.angle)
        back = frames.ecef_to_eci(fixed, s.angle)
        return fixed, moving, back, frames.velocity_ecef_to_eci(fixed, moving, s.angle)

    found = by_both(function, State, STATES)
    turn = erfa.rz(STATES[6], np.eye(3))
    fixed = np.einsum("nij,jn->in", turn, STATES[:3])
    moving = np.einsum("nij,jn->in", turn, STATES[3:6] - np.cross([0.0, 0.0, EARTH_RATE], STATES[:3].T).T)
    assert np.abs(found[:3] - fixed).max() < 2e-8
    assert np.abs(found[3:6] - moving).max() < 2e-11
    assert np.abs(found[6:9] - STATES[:3]).max() < 2e-8
    assert np.abs(found[9:] - STATES[3:6]).max() < 2e-11


def test_the_precise_rotation_is_erfas_and_nearly_the_simple_one_of_date():
    mjd = np.array([60_000.25, 61_000.5])
    matrices = frames.ecef_from_gcrs(mjd, ut1_less_utc=-0.01, xp=1e-6, yp=2e-6)
    tt = terrestrial_time(mjd)
    for matrix, utc, one in zip(matrices, mjd, tt, strict=True):
        ut1 = erfa.utcut1(2_400_000.5, utc, -0.01)
        assert np.abs(matrix - erfa.c2t06a(2_400_000.5, one, *ut1, 1e-6, 2e-6)).max() == 0.0
    angle = frames.earth_rotation_angle(mjd - 51_544.5 - 0.01 / 86_400.0)
    pole = matrices[:, 2, 2]
    assert np.abs(pole - 1.0).max() < 1e-5  # 23 years of precession: 0.13 degrees
    assert matrices[:, 0, 0] == pytest.approx(np.cos(angle), abs=1e-5)


def test_a_free_body_flies_straight_also_in_the_turning_frame():
    def turning(t, y):
        extra = frames.acceleration_in_ecef(Vector(*y[:3]), Vector(*y[3:]), 0.3)
        return [*y[3:], *extra]

    r, v = Vector(1.0, 2.0, 3.0), Vector(0.5, -1.0, 0.25)
    start = [*r, *frames.velocity_eci_to_ecef(r, v, 0.0, 0.3)]
    end = solve_ivp(turning, (0.0, 5.0), start, rtol=1e-12, atol=1e-12, method="DOP853").y[:, -1]
    straight = Vector(*(np.array(r) + 5.0 * np.array(v)))
    assert frames.ecef_to_eci(Vector(*end[:3]), 1.5) == pytest.approx(straight, abs=1e-9)


def test_courses_and_flows_go_both_ways():
    @physics
    def function(v):
        course, flow = frames.ned_to_course(v), frames.body_to_flow(v)
        axes = frames.wind_from_body(flow.alpha, flow.beta)
        return course, flow, frames.course_to_ned(course), frames.flow_to_body(flow), matrix_times(axes, v), axes

    v = RNG.normal(size=(3, N)) * 300.0
    found = by_both(function, Vector, v)
    speed = np.linalg.norm(v, axis=0)
    assert found[[0, 3]] == pytest.approx(np.array([speed, speed]), rel=1e-15)
    assert found[1] == pytest.approx(np.arcsin(-v[2] / speed), abs=1e-7)
    assert found[5] == pytest.approx(np.arcsin(v[1] / speed), abs=1e-7)
    assert np.abs(found[6:9] - v).max() < 1e-12
    assert np.abs(found[9:12] - v).max() < 1e-12
    assert np.abs(found[12:15] - np.array([speed, 0.0 * speed, 0.0 * speed])).max() < 1e-12
    axes = found[15:].reshape(3, 3, N)
    assert np.abs(np.linalg.det(axes.T) - 1.0).max() < 1e-14


def test_a_nose_up_in_level_flight_is_a_positive_angle_of_attack():
    assert frames.body_to_flow(Vector(100.0, 0.0, 10.0)).alpha == pytest.approx(np.arctan(0.1))
    lift = transposed_times(frames.wind_from_body(0.1, 0.0), Vector(0.0, 0.0, -1.0))
    assert lift.z == pytest.approx(-np.cos(0.1))
    assert frames.course_to_ned(Course(10.0, 0.5, np.pi / 2)).z < 0.0
    assert frames.flow_to_body(Flow(10.0, 0.0, 0.5)).y > 0.0


def test_orbital_axes_are_made_of_vector_products():
    @physics
    def function(s):
        r, v = Vector(s.rx, s.ry, s.rz), Vector(s.vx, s.vy, s.vz)
        return frames.ric_from_eci(r, v), frames.lvlh_from_eci(r, v)

    found = by_both(function, State, STATES)
    r, v = STATES[:3].T, STATES[3:6].T
    h = np.cross(r, v)
    radial, normal = (a / np.linalg.norm(a, axis=1)[:, None] for a in (r, h))
    ahead = np.cross(normal, radial)
    assert np.abs(found[:9] - np.concatenate([radial, ahead, normal], axis=1).T).max() < 1e-11
    assert np.abs(found[9:] - np.concatenate([ahead, -normal, -radial], axis=1).T).max() < 1e-11


def test_relative_states_go_both_ways_and_are_seen_from_the_turning_frame():
    @physics
    def function(s):
        r, v = Vector(s.rx, s.ry, s.rz), Vector(s.vx, s.vy, s.vz)
        relative = frames.eci_to_ric(r, v, Vector(s.sx, s.sy, s.sz), Vector(s.wx, s.wy, s.wz))
        back = frames.ric_to_eci(r, v, relative)
        return relative.position, relative.velocity, back.position, back.velocity

    rows = np.concatenate([STATES[:6], STATES[:6] + RNG.normal(size=(6, N)) * 100.0])
    found = by_both(function, Two, rows, rtol=1e-9)
    assert np.abs(found[6:9] - rows[6:9]).max() < 1e-6
    assert np.abs(found[9:] - rows[9:]).max() < 1e-8


def test_a_neighbour_in_the_same_circular_orbit_rests_in_ric():
    rate, r = np.sqrt(MU_EARTH / 7e6**3), 7e6

    def at(angle):
        c, s = np.cos(angle), np.sin(angle)
        return Vector(r * c, r * s, 0.0), Vector(-rate * r * s, rate * r * c, 0.0)

    relative = frames.eci_to_ric(*at(0.3), *at(0.3 + 1e-4))
    assert isinstance(relative, Relative)
    assert relative.position.y == pytest.approx(700.0, rel=1e-6)
    assert np.abs(relative.velocity).max() < 1e-9


def test_chained_matrices_lead_from_inertial_to_wind_axes():
    ned, wind = frames.ned_from_eci(0.5, 0.6, 0.7), frames.wind_from_body(0.1, 0.2)
    both = matrix_product(wind, ned)
    v = Vector(1.0, 2.0, 3.0)
    assert matrix_times(both, v) == pytest.approx(matrix_times(wind, matrix_times(ned, v)), abs=1e-15)
    assert isinstance(both, Matrix)
