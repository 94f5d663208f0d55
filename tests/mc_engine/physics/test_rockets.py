"""Lift of a rocket's parts, its solid propellant, its equations of motion, parachutes and weight."""

import numpy as np
import pytest

from mc_engine.errors import ModelError
from mc_engine.physics.aerodynamics import fins_lift_area, lift_of_part, parachute_acceleration
from mc_engine.physics.curves import curve
from mc_engine.physics.gravity import normal_gravity
from mc_engine.physics.rigid_body import (
    Inertia,
    Propellant,
    Rocket,
    angular_acceleration,
    rocket_accelerations,
    solid_propellant,
)
from mc_engine.physics.vectors import Vector

MOTOR = {"number": 5, "density": 1815.0, "outer": 0.033, "inner": 0.015, "length": 0.12, "gap": 0.005}
THRUST = curve(x=[0.0, 0.5, 1.0, 3.5, 4.0], y=[0.0, 2000.0, 1900.0, 1500.0, 0.0])
DRY = Rocket(16.2, 6.5, 0.036, propellant=0.7, nozzle=1.1, jet=5e-4)


def test_weight_over_the_ellipsoid_is_that_of_the_standard():
    # NIMA TR8350.2, 3rd ed. (2000), table 3.4: at the equator and the poles; mean over the ellipsoid 9.7976432222
    assert normal_gravity(0.0, 0.0) == pytest.approx(9.7803253359, abs=1e-10)
    assert normal_gravity(1.0, 0.0) == pytest.approx(9.8321849378, abs=1e-9)
    sine = np.linspace(-1.0, 1.0, 200_001)  # equal steps of the sine are equal areas, but for the flattening
    assert np.mean(normal_gravity(sine * sine, 0.0)) == pytest.approx(9.7976432222, abs=2e-4)
    # in free air it falls by 0.3086 mGal a metre
    assert normal_gravity(0.5, 0.0) - normal_gravity(0.5, 1.0) == pytest.approx(3.086e-6, abs=2e-9)


def test_lift_of_a_part_is_across_it_and_grows_with_the_angle_of_attack():
    for alpha in (0.0, 1e-3, 0.1, 1.0):
        flow = Vector(0.0, 100.0 * np.sin(alpha), -100.0 * np.cos(alpha))
        force, moment = lift_of_part(1.2, flow, Vector(0.0, 0.0, 0.0), -0.8, 0.025)
        assert force == pytest.approx((0.0, 0.5 * 1.2 * 100.0**2 * 0.025 * alpha, 0.0), rel=1e-9)
        assert moment == pytest.approx(np.cross([0.0, 0.0, -0.8], force), abs=1e-12)


def test_lift_of_a_part_sees_the_turning_body():
    flow, rate = np.array([3.0, -2.0, -80.0]), np.array([0.4, -0.3, 5.0])
    own = flow - np.cross(rate, [0.0, 0.0, -0.8])  # the part moves, so the air moves the other way
    expected, _ = lift_of_part(1.2, Vector(own[0], own[1], own[2]), Vector(0.0, 0.0, 0.0), -0.8, 0.025)
    force, _ = lift_of_part(1.2, Vector(*flow), Vector(*rate), -0.8, 0.025)
    assert force == pytest.approx(expected, rel=1e-12)


def test_fins_of_great_span_are_those_of_slender_wings_and_of_thin_aerofoils():
    # a straight fin of a great aspect ratio: 2 pi by the angle of attack and its area; of a small one: pi / 2 times it
    wide, narrow = (fins_lift_area(0.0, 2, span, 1.0, 1.0, 0.0) for span in (1e4, 1e-4))
    assert wide / 1e4 == pytest.approx(2.0 * np.pi, rel=1e-3)
    assert narrow / 1e-4 == pytest.approx(0.5 * np.pi * 2e-4, rel=1e-3)
    # J. S. Barrowman (1967): compressibility by Prandtl and Glauert, and the body of radius r adds r / (r + span)
    assert fins_lift_area(0.6, 2, 1e6, 1.0, 1.0, 0.0) == pytest.approx(fins_lift_area(0.0, 2, 1e6, 1.0, 1.0, 0.0) / 0.8)
    one, on_body = (fins_lift_area(0.3, 4, 0.1, 0.12, 0.04, radius) for radius in (0.0, 0.05))
    assert on_body / one == pytest.approx(1.0 + 0.05 / 0.15)


def test_a_parachute_at_its_sink_speed_does_not_accelerate():
    speed = np.sqrt(2.0 * 16.0 * 9.8 / (1.2 * 10.0))
    a = parachute_acceleration(1.2, Vector(0.0, 0.0, speed), 16.0, 10.0, 9.8)
    assert a == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    # at rest it falls slower than a stone, since it has to move half a sphere of air
    air = 2.0 / 3.0 * np.pi * 1.2 * (10.0 / (1.4 * np.pi)) ** 1.5
    at_rest = parachute_acceleration(1.2, Vector(0.0, 0.0, 0.0), 16.0, 10.0, 9.8)
    assert at_rest.z == pytest.approx(-9.8 * 16.0 / (16.0 + air), rel=1e-14)


def test_the_propellant_is_burnt_by_the_thrust_and_has_the_inertia_of_its_cylinders():
    propellant = solid_propellant(THRUST, 4.0, **MOTOR)
    full = 5 * 1815.0 * np.pi * (0.033**2 - 0.015**2) * 0.12
    assert propellant(0.0).mass == pytest.approx(full, rel=1e-9)
    assert propellant(4.0).mass == pytest.approx(0.0, abs=1e-6)
    t = np.linspace(0.0, 4.0, 4001)
    impulse = np.concatenate([[0.0], np.cumsum(0.5 * (THRUST(t)[1:] + THRUST(t)[:-1]) * np.diff(t))])
    assert propellant(t).mass == pytest.approx(full * (1.0 - impulse / impulse[-1]), abs=1e-6)
    now = propellant(2.0)
    # by the points of the cylinders themselves
    r2 = 0.033**2 - now.mass / (5 * 1815.0 * np.pi * _length(now.mass))
    axis = np.concatenate([k * 0.125 + _length(now.mass) * (np.linspace(-0.5, 0.5, 2001)) for k in range(-2, 3)])
    ring = 0.25 * (0.033**2 + r2)
    assert now.axial == pytest.approx(2.0 * now.mass * ring, rel=1e-6)
    assert now.across == pytest.approx(now.mass * (ring + np.mean(axis**2)), rel=1e-3)


def _length(mass):
    """Length of a cylinder [m] when so much is left, by bisection."""
    low, high = 0.015, 0.033
    for _ in range(60):
        r = 0.5 * (low + high)
        left = 5 * 1815.0 * np.pi * (0.033**2 - r * r) * (0.12 - 2.0 * (r - 0.015))
        low, high = (r, high) if left > mass else (low, r)
    return 0.12 - 2.0 * (r - 0.015)


@pytest.mark.parametrize("t", [0.3, 0.8, 2.0, 3.7])
def test_the_rates_of_the_propellant_are_its_derivatives(t):
    propellant = solid_propellant(THRUST, 4.0, **MOTOR)
    now, before, after = propellant(t), propellant(t - 1e-2), propellant(t + 1e-2)
    for name in ("mass", "across", "axial"):
        rate = "rate" if name == "mass" else f"{name}_rate"
        slope = (getattr(after, name) - getattr(before, name)) / 2e-2
        assert getattr(now, rate) == pytest.approx(slope, rel=1e-3)
    assert now.change == pytest.approx((after.rate - before.rate) / 2e-2, rel=1e-6)


@pytest.mark.parametrize("wrong", [{"outer": 0.01}, {"inner": -0.01}, {"number": 0}, {"length": np.nan}, {"burn": 0.0}])
def test_sizes_that_are_no_motor_are_named(wrong):
    with pytest.raises(ModelError, match="0 <= inner < outer"):
        solid_propellant(THRUST, **{"burn": 4.0} | MOTOR | wrong)


@pytest.mark.parametrize("sizes", [MOTOR, MOTOR | {"inner": 0.010, "length": 0.046}], ids=["long", "gone at once"])
def test_behind_the_end_of_burning_nothing_pushes(sizes):
    propellant = solid_propellant(THRUST, 4.0, **sizes)
    assert propellant(5.0) == pytest.approx(Propellant(*7 * (0.0,)), abs=1e-9)


def test_without_propellant_a_rocket_is_a_rigid_body():
    rate, force, moment = Vector(0.3, -0.2, 4.0), Vector(20.0, -30.0, 500.0), Vector(1.0, -2.0, 0.1)
    a, turn = rocket_accelerations(DRY, Propellant(*7 * (0.0,)), rate, force, moment, Vector(0.1, 0.2, -9.8))
    inertia = Inertia(DRY.across, DRY.across, DRY.axial, 0.0, 0.0, 0.0)
    assert turn == pytest.approx(angular_acceleration(inertia, rate, moment), rel=1e-12)
    assert a == pytest.approx((0.1 + 20.0 / 16.2, 0.2 - 30.0 / 16.2, -9.8 + 500.0 / 16.2), rel=1e-12)


def test_full_and_cold_a_rocket_is_the_rigid_body_of_both_masses():
    """Nothing flows: motion about the common centre of mass, r behind the dry one; Euler's and Newton's laws there."""
    fuel = Propellant(3.0, 0.05, 0.003, 0.0, 0.0, 0.0, 0.0)
    rate, force, moment = np.array([0.3, -0.2, 4.0]), np.array([20.0, -30.0, 500.0]), np.array([1.0, -2.0, 0.1])
    a, turn = rocket_accelerations(DRY, fuel, Vector(*rate), Vector(*force), Vector(*moment), Vector(0.0, 0.0, 0.0))
    mass = DRY.mass + fuel.mass
    centre = np.array([0.0, 0.0, -DRY.propellant * fuel.mass / mass])
    across = DRY.across + fuel.across + fuel.mass * DRY.propellant**2 - mass * centre[2] ** 2
    inertia = np.diag([across, across, DRY.axial + fuel.axial])
    about = moment - np.cross(centre, force)
    wanted = np.linalg.solve(inertia, about - np.cross(rate, inertia @ rate))
    assert turn == pytest.approx(wanted, rel=1e-12)
    dry = force / mass - np.cross(wanted, centre) - np.cross(rate, np.cross(rate, centre))
    assert a == pytest.approx(dry, rel=1e-12)


def test_a_burning_rocket_keeps_the_balance_of_momentum_and_of_its_moment():
    """Of what is inside, about the dry centre of mass, in axes that turn; the gas leaves over a disc at the nozzle."""
    fuel = Propellant(3.0, 0.05, 0.003, rate=-0.75, across_rate=-0.012, axial_rate=-0.0007, change=1.4)
    rate, force, moment = np.array([0.3, -0.2, 4.0]), np.array([20.0, -30.0, 500.0]), np.array([1.0, -2.0, 0.1])
    mass, nozzle, grain = DRY.mass + fuel.mass, np.array([0.0, 0.0, -DRY.nozzle]), np.array([0.0, 0.0, -DRY.propellant])
    centre = grain * fuel.mass / mass
    speed = (grain - centre) * fuel.rate / mass  # of the centre of mass in the body; its own rate is left out
    inside = mass * speed + fuel.rate * (centre - nozzle)  # momentum of the gas against the body
    growth = fuel.change * (centre - nozzle) + 2.0 * fuel.rate * speed
    offset = fuel.mass * DRY.propellant**2
    inertia = np.diag([DRY.across + fuel.across + offset] * 2 + [DRY.axial + fuel.axial])
    shrinking = np.diag([fuel.across_rate + fuel.rate * DRY.propellant**2] * 2 + [fuel.axial_rate])
    carried = -fuel.rate * np.diag([0.5 * DRY.jet + DRY.nozzle**2] * 2 + [DRY.jet])

    def arm(r):
        return np.cross(r, np.eye(3)).T  # arm(r) @ v = r x v

    equations = np.block([[mass * np.eye(3), -mass * arm(centre)], [mass * arm(centre), inertia]])
    turning = mass * np.cross(rate, np.cross(rate, centre))
    given = np.concatenate([
        force - turning - 2.0 * np.cross(rate, inside) - growth,
        moment - np.cross(rate, inertia @ rate) - (shrinking + carried) @ rate,
    ])  # fmt: skip
    wanted = np.linalg.solve(equations, given)
    a, turn = rocket_accelerations(DRY, fuel, Vector(*rate), Vector(*force), Vector(*moment), Vector(0.0, 0.0, 0.0))
    assert np.concatenate([a, turn]) == pytest.approx(wanted, rel=1e-12)
