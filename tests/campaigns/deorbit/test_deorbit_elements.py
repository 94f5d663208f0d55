"""The osculating elements and the Gauss equations (3)-(10), against each other and against the flown path."""

from collections import namedtuple

import numpy as np
import pytest
from deorbit_flights import NOMINAL, fly_one, history
from deorbit_twin import MU, Path
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from campaigns.deorbit.dynamics import osculating
from campaigns.deorbit.published import DEMONSTRATION
from mc_engine.physics.vectors import Vector

Elements = namedtuple("Elements", "node inclination omega a e f")  # SI, radians


def gauss_rates(elements, u_radial, u_transverse, u_normal):
    """Rates of the six elements under an acceleration [m/s^2] in the orbital frame: eqs (3)-(10) of the source."""
    inclination, omega, a, e, f = elements.inclination, elements.omega, elements.a, elements.e, elements.f
    p = a * (1.0 - e * e)  # (7)
    h = np.sqrt(MU * p)  # (8)
    sin_f, cos_f = np.sin(f), np.cos(f)
    r = p / (1.0 + e * cos_f)  # (9)
    theta = omega + f  # (10)
    normal = r * np.sin(theta) / np.sin(inclination) * u_normal
    apse = (-p * cos_f * u_radial + (p + r) * sin_f * u_transverse) / e
    return Elements(
        normal / h,
        r * np.cos(theta) * u_normal / h,
        (apse - normal * np.cos(inclination)) / h,
        (2.0 * a * a * e * sin_f * u_radial + 2.0 * a * a * p / r * u_transverse) / h,
        (p * sin_f * u_radial + ((p + r) * cos_f + r * e) * u_transverse) / h,
        h / (r * r) - apse / h,
    )


def turn(axis, angle):
    """Rotation matrix about the third ("z") or the first ("x") axis: column vectors of the turned frame."""
    s, c = np.sin(angle), np.cos(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]] if axis == "z" else [[1, 0, 0], [0, c, -s], [0, s, c]])


def frame(elements):
    """R, T, N as columns in inertial axes: equation (30)."""
    node, inclination, omega, _, _, f = elements
    return turn("z", node) @ turn("x", inclination) @ turn("z", omega + f)


def place(elements):
    """Inertial position [m] and velocity [m/s] of the elements: equations (31), (34)."""
    _, _, _, a, e, f = elements
    p = a * (1.0 - e * e)
    axes, root = frame(elements), np.sqrt(MU / p)
    r = p / (1.0 + e * np.cos(f))
    return axes @ [r, 0.0, 0.0], axes @ [root * e * np.sin(f), root * (1.0 + e * np.cos(f)), 0.0]


def turned(start, end, axis):
    """Angle in [-pi, pi] about a unit axis from one vector to another."""
    return np.arctan2(np.dot(np.cross(start, end), axis), np.dot(start, end))


def elements_of(r, v):
    """The six elements from vectors, angles in [-pi, pi]: eccentricity and node vectors, no formula of the campaign."""
    h = np.cross(r, v)
    to_perigee = np.cross(v, h) / MU - r / np.linalg.norm(r)
    normal, node = h / np.linalg.norm(h), np.array([-h[1], h[0], 0.0]) / np.hypot(h[0], h[1])
    e = np.linalg.norm(to_perigee)
    a = np.dot(h, h) / MU / (1.0 - e * e)
    lean = np.arctan2(np.hypot(h[0], h[1]), h[2])
    return np.array(
        [np.arctan2(node[1], node[0]), lean, turned(node, to_perigee, normal), a, e, turned(to_perigee, r, normal)]
    )


def random_elements(number):
    draw = np.random.default_rng([20160421, number])
    return Elements(
        draw.uniform(-3.0, 3.0),
        draw.uniform(0.2, 2.9),
        draw.uniform(-3.0, 3.0),
        draw.uniform(6.5e6, 4.2e7),
        draw.uniform(0.01, 0.8),
        draw.uniform(-3.0, 3.0),
    )


@pytest.mark.parametrize("number", range(12))
def test_the_osculating_elements_are_those_the_place_was_made_from(number):
    elements = random_elements(number)
    a, e, omega = osculating(*(Vector(*components) for components in place(elements)))
    assert a == pytest.approx(elements.a, rel=1e-12)
    assert e == pytest.approx(elements.e, abs=1e-13)
    assert omega == pytest.approx(elements.omega, abs=1e-11)  # 1e-13 / the smallest eccentricity


@pytest.mark.parametrize("direction", ["radial", "transverse", "normal"])
@pytest.mark.parametrize("number", range(6))
def test_the_gauss_equations_are_the_slopes_of_the_elements_under_a_push(number, direction):
    """A push changes the velocity alone: elements are differenced over it, and the free motion of f is h/r^2."""
    elements = random_elements(number)
    r, v = place(elements)
    push = np.eye(3)[["radial", "transverse", "normal"].index(direction)]
    kick, step = frame(elements) @ push, 0.05  # m/s: the cubic of a central difference stays below 1e-9 of it
    slopes = (elements_of(r, v + step * kick) - elements_of(r, v - step * kick)) / (2.0 * step)
    slopes[5] += np.linalg.norm(np.cross(r, v)) / np.dot(r, r)
    rates = gauss_rates(elements, *push)
    scale = np.array([1.0, 1.0, 1.0, elements.a, 1.0, 1.0]) / np.linalg.norm(v) / elements.e
    np.testing.assert_allclose(rates / scale, slopes / scale, rtol=0.0, atol=1e-7)


def fly_by_gauss(inputs):
    """(history, desired path, elements [6, n] at its instants): equation (3) under the force of the history."""
    seen, path = history(**inputs), Path(NOMINAL | inputs)
    force = [seen[f"force_{part}_n"] for part in ("radial", "transverse", "normal")]
    push = CubicSpline(seen["t_s"], np.array(force).T / NOMINAL["initial_mass_kg"])

    def rates(t, elements):
        wanted = path.place(t)[2]  # rows: R, T, N of the desired path, along which the history gives the force
        u = frame(elements).T @ wanted.T @ push(t)
        return gauss_rates(Elements(*elements), *u)

    first = elements_of(*path.burnt(NOMINAL | inputs))
    t = seen["t_s"]
    scale = np.array([1e-10, 1e-10, 1e-10, 1e-3, 1e-11, 1e-10])
    flight = solve_ivp(rates, t[[0, -1]], first, "DOP853", t_eval=t, rtol=1e-11, atol=scale, max_step=10.0)
    return seen, path, flight.y


TILTED = DEMONSTRATION | {"out_of_plane_error_deg": 3.0}


@pytest.fixture(scope="module")
def planar():
    return fly_by_gauss(DEMONSTRATION)


@pytest.fixture(scope="module")
def tilted():
    return fly_by_gauss(TILTED)


@pytest.mark.parametrize("case", ["planar", "tilted"])
def test_the_gauss_equations_lead_the_elements_along_the_flown_ones(case, request):
    """Six elements under the flown force go where the Cartesian flight goes: to a millimetre of 53 km."""
    seen, path, (_, _, omega, a, e, _) = request.getfixturevalue(case)
    omega_error = (np.degrees(omega - path.omega) + 180.0) % 360.0 - 180.0
    np.testing.assert_allclose(1e-3 * (a - path.a), seen["a_error_km"], rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(e - path.e, seen["e_error"], rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(omega_error, seen["omega_error_deg"], rtol=0.0, atol=1e-7)


def test_the_gauss_equations_turn_the_plane_as_the_flight_did(tilted):
    _, path, elements = tilted
    row = fly_one(**TILTED)
    r, v, _ = path.place(row["entry_time_s"])
    r = r + [row[f"end_deviation_{axis}_m"] for axis in "xyz"]
    v = v + [row[f"end_deviation_v{axis}_m_s"] for axis in "xyz"]
    np.testing.assert_allclose(elements[:2, -1], elements_of(r, v)[:2], rtol=0.0, atol=1e-9)
    assert abs(elements[1, 0] - elements[1, -1]) > 5e-4  # the burn had tilted the plane: there was something to turn


def test_near_a_circle_the_argument_of_perigee_keeps_its_digits():
    elements = Elements(0.3, 0.9, 1.2, 7e6, 1e-6, 0.4)
    _, e, omega = osculating(*(Vector(*components) for components in place(elements)))
    assert e == pytest.approx(1e-6, abs=1e-15)
    assert omega == pytest.approx(1.2, abs=1e-9)


def test_a_flight_in_the_equator_has_the_elements_of_an_inclined_one():
    inclined, equatorial = fly_one(**DEMONSTRATION), fly_one(**DEMONSTRATION, inclination_deg=0.0)
    for column in ("actual_perigee_argument_deg", "overshoot_omega_pct", "settling_time_s"):
        assert equatorial[column] == pytest.approx(inclined[column], rel=1e-9), column
