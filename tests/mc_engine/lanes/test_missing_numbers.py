"""What is not a number is handed on: by the functions of lanes and physics, by tables, extrema and events."""

import math

import numpy as np
import pytest
from compiled_physics import bits, by_every_width

from mc_engine import lanes
from mc_engine.flight.flight import fly
from mc_engine.lanes import physics
from mc_engine.lanes.number import Number, calling
from mc_engine.model import load_model
from mc_engine.physics import (
    aerodynamics,
    atmosphere,
    attitude,
    curves,
    frames,
    geopotential,
    gravity,
    heating,
    orbital_elements,
    pulse_modulators,
    radiation,
    sun_moon,
)

INF, NAN = math.inf, math.nan
NUMBERS = np.array([0.0, -0.0, 0.5, -0.5, 1.0, -1.0, 3.0, 710.5, 1e300, 5e-324, INF, -INF, NAN])
X, Y = (grid.ravel() for grid in np.meshgrid(NUMBERS, NUMBERS))
LIMIT = 0.5


@physics
def _everything(x, y):
    s, c = lanes.sincos(x)
    return (
        lanes.minimum(x, y), lanes.maximum(x, y), lanes.copysign(x, y), lanes.atan2(x, y), lanes.pow(x, y),
        lanes.fma(x, y, 1.0), lanes.fma(x, 1.0, y), lanes.fma(1.0, x, y), x + y, x - y, x * y, x / y,
        lanes.minimum(x, LIMIT), lanes.minimum(LIMIT, x), lanes.maximum(x, 0.0), lanes.maximum(0.0, x),
        lanes.copysign(x, -1.0), lanes.copysign(1.0, x), lanes.pow(x, 2.0), lanes.pow(2.0, x), lanes.pow(x, 0.0),
        lanes.atan2(x, 1.0), lanes.atan2(1.0, x), lanes.sqrt(x), lanes.rint(x), lanes.floor(x), lanes.exp(x),
        lanes.sin(x), lanes.cos(x), lanes.tan(x), lanes.asin(x), lanes.acos(x), lanes.atan(x), lanes.log(x), s, c,
        abs(x), -x, lanes.minimum(lanes.maximum(x, -1.0), 1.0), x**2, x**3,
    )  # fmt: skip


OF_BOTH = 12  # the first results are of x and y, the others of x alone
RESULTS = 41


@pytest.fixture(scope="module")
def compiled():
    return by_every_width(_everything, RESULTS, X, Y)


def test_every_function_hands_on_what_is_not_a_number_in_any_argument_at_every_width(compiled):
    of_both, of_x = np.isnan(X) | np.isnan(Y), np.isnan(X)
    for i, row in enumerate(compiled):
        assert np.isnan(row[of_both if i < OF_BOTH else of_x]).all(), f"result {i}"


def test_interpreted_every_function_gives_the_bits_of_the_kernel(compiled):
    for i, (x, y) in enumerate(zip(X.tolist(), Y.tolist(), strict=True)):
        found = calling("everything", _everything, (Number(x), Number(y)))
        np.testing.assert_array_equal(bits(found), bits(compiled[:, i]), err_msg=f"{x}, {y}")


def test_minimum_and_maximum_are_those_of_ieee_754_and_the_second_of_two_zeros(compiled):
    for row, reference in ((0, np.minimum), (1, np.maximum)):
        expected = np.where(X == Y, Y, reference(X, Y))
        np.testing.assert_array_equal(bits(compiled[row]), bits(expected))
    arrays = [lanes.minimum(X, Y), lanes.maximum(X, Y)]
    np.testing.assert_array_equal(bits(arrays), bits(compiled[:2]))


def test_a_limit_that_is_written_out_gives_the_bits_of_one_that_is_not(compiled):
    row = {name: by_every_width(_everything, RESULTS, X, limit) for name, limit in (("half", LIMIT), ("zero", 0.0))}
    np.testing.assert_array_equal(bits(compiled[12]), bits(row["half"][0]))
    np.testing.assert_array_equal(bits(compiled[14]), bits(row["zero"][1]))
    np.testing.assert_array_equal(bits(compiled[15]), bits(np.where(X == 0.0, X, np.maximum(0.0, X))))


CURVE = curves.curve(x=[0.0, 1.0], y=[1.0, 2.0])
NODES = np.arange(48.0)
HARMONICS = geopotential.harmonics_table(2, 2).ravel()
COMMAND = pulse_modulators.at_rest()
SETUP = type("Setup", (), {"gain": 4.0, "level": 1.0, "on": 0.45, "off": 0.15, "time_constant": 0.1, "decay": 0.9})()

# function of numbers -> finite arguments
OF_PHYSICS = {
    "lift_direction": (aerodynamics.lift_direction, (1.0, 2.0, 3.0, 0.0, 0.6, 0.8, math.sqrt(14.0), 0.8, 0.6)),
    "axial_coefficient": (aerodynamics.axial_coefficient, (1.0, 0.2, 0.9, 0.1)),
    "curve": (CURVE, (0.7,)),
    "exponential": (atmosphere.exponential, (5e3, 1.225, 0.0, 7200.0)),
    "layered": (atmosphere.layered, (250e3,)),
    "us76": (atmosphere.us76, (30e3,)),
    "us76_logarithm": (atmosphere.us76_logarithm, (95e3,)),
    "quaternion_rates": (attitude.quaternion_rates, (0.5, 0.5, 0.5, 0.5, 0.1, 0.2, 0.3)),
    "second_axis_in_body": (attitude.second_axis_in_body, (0.5, 0.5, 0.5, 0.5)),
    "turned_slightly": (attitude.turned_slightly, (0.5, 0.5, 0.5, 0.5, 0.1, 0.2, 0.3)),
    "over_ellipsoid": (frames.over_ellipsoid, (7e6, 1 / 7e6, 0.3, 6.36e6, 0.0067)),
    "spherical": (frames.spherical, (1.0, 2.0, 3.0)),
    "geodetic_latitude": (frames.geodetic_latitude, (4e6, 4e6, 4e6, 3e5, 6.36e6, 0.0067)),
    "velocity_angles": (frames.velocity_angles, (1.0, 2.0, 3.0, 0.1, 0.2, 0.3)),
    "turned": (frames.turned, (1.0, 2.0, 0.6, 0.8)),
    "orbital_axes": (frames.orbital_axes, (7e6, 1e6, 2e6, 1e3, 7e3, 1e2)),
    "harmonics": (
        lambda x, y, z, mu, radius: geopotential.harmonics(x, y, z, mu, radius, 2.0, 2.0, HARMONICS, 0.0),
        (7e6, 1e6, 2e6, 4e14, 6.4e6),
    ),
    "point_mass": (gravity.point_mass, (7e6, 1e6, 2e6, 4e14)),
    "j2_perturbation": (gravity.j2_perturbation, (7e6, 1e6, 2e6, 4e14)),
    "oblate": (gravity.oblate, (7e6, 1e6, 2e6, 4e14)),
    "sutton_graves": (heating.sutton_graves, (1e-4, 7e3, 1e-4)),
    "detra_kemp_riddell": (heating.detra_kemp_riddell, (1e-4, 7e3, 1e-4)),
    "equinoctial": (orbital_elements.equinoctial, (7e6, 1e6, 2e6, 1e3, 7e3, 1e2, 4e14)),
    "lag_rate": (pulse_modulators.lag_rate, (0.1, 0.2, 1.0, 4.0, 4.0, 0.1)),
    "sampled_pulses": (
        lambda x, y, z: pulse_modulators.sampled_pulses(COMMAND, COMMAND, COMMAND, x, y, z, SETUP, 0.01)[3:],
        (0.3, 0.0, -0.9),
    ),
    "discs": (radiation.discs, (4e7, 1e6, 2e6, 1.4e11, 1e10, 2e10)),
    "sunlit": (radiation.sunlit, (-4.2e7, 1e6, 2e6, 1.4e11, 1e10, 2e10)),
    "solar_pressure": (radiation.solar_pressure, (4e7, 1e6, 2e6, 1.4e11, 1e10, 2e10, 0.02, 1.3)),
    "ephemeris": (lambda t, first: sun_moon.ephemeris(t, NODES, first), (1e4, 0.0)),
    "third_body": (sun_moon.third_body, (4e7, 1e6, 2e6, 1.4e11, 1e10, 2e10, 1.3e20)),
}  # fmt: skip


@pytest.mark.parametrize("name", OF_PHYSICS)
def test_shared_physics_hands_on_what_is_not_a_number_in_any_argument(name):
    function, arguments = OF_PHYSICS[name]
    assert np.isfinite(function(*arguments)).all()
    for place in range(len(arguments)):
        given = [NAN if i == place else value for i, value in enumerate(arguments)]
        assert np.isnan(function(*given)).any(), f"argument {place}"


GAP = """
from mc_engine.lanes import physics, sqrt, where
from mc_engine.model import {clock}, Event, Field, Parameter, inputs, last_above, maximum_of, metrics, model, outputs
from mc_engine.model import states, time_of_maximum

Inputs = inputs(
    seen_gap=Parameter(1e9, "where the output is none", unit=""),
    event_gap=Parameter(1e9, "where the event is none", unit=""),
)
State = states(x=Field("place", unit=""))
Outputs = outputs(hill=Field("height", unit=""))
Metrics = metrics(
    top=maximum_of("hill", "top", unit=""),
    top_time_s=time_of_maximum("hill", "time"),
    late_time_s=last_above("hill", 0.0, "time"),
)


@physics
def initial():
    return State(x=0.0)


@physics
def rhs():
    return State(x=1.0)


@physics
def gap(x, since, until):
    return where((x > since) & (x < until), sqrt(-1.0 - 0.0 * x), 0.0)


@physics
def observe(s, p):
    return Outputs(hill=2.0 + (s.x - 3.0) * (7.0 - s.x) + gap(s.x, p.seen_gap, p.seen_gap + 0.8))


@physics
def before_end(s, p):
    return 9.0 - s.x + gap(s.x, p.event_gap, p.event_gap + 0.8)


MODEL = model(
    name="gap", title="An output and an event with a gap", inputs=Inputs, states=State, outputs=Outputs,
    metrics=Metrics, clock={made}, initial=initial, rhs=rhs, observe=observe,
    events={{"end": Event(before_end)}},
)
"""
CLOCKS = {"FixedStep": "FixedStep(0.25, 20.0)", "AdaptiveStep": "AdaptiveStep(20.0, control_period=0.3)"}


@pytest.fixture(scope="module", params=CLOCKS)
def gapped(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("gap")
    (folder / "model.py").write_text(GAP.format(clock=request.param, made=CLOCKS[request.param]))
    return load_model("model.py", folder), folder


def test_an_output_that_was_once_not_a_number_has_no_extreme_value(gapped):
    model, folder = gapped
    inputs = {"seen_gap": np.array([1e9, 1.1, 5.1, 8.4]), "event_gap": 1e9}
    flown = fly(model, inputs, np.arange(4), 1, folder=folder, width=8)
    assert set(flown["status"]) == {"ok"}
    assert flown["top"][0] == pytest.approx(6.0)
    assert np.isnan(flown["top"][1:]).all()
    assert np.isnan(flown["top_time_s"][1:]).all()
    # above zero until 5 + sqrt(6); where nothing is seen later that is above zero, the last time is not known
    last = 5.0 + math.sqrt(6.0)
    assert flown["late_time_s"][:3] == pytest.approx([last] * 3, abs=1e-9 if "Adaptive" in str(model.clock) else 0.01)


def test_a_case_is_not_finite_where_the_function_of_an_event_is_not_a_number(gapped):
    model, folder = gapped
    inputs = {"seen_gap": 1e9, "event_gap": np.array([1e9, 8.6, 0.4, 9.05, 1e9, 8.9])}
    flown = fly(model, inputs, np.arange(6), 1, folder=folder, width=8)
    # a gap behind the event changes nothing, one before or on it hides it
    assert flown["status"].tolist() == ["ok", "not-finite", "not-finite", "ok", "ok", "not-finite"]
    assert flown["end_x"][[0, 3, 4]] == pytest.approx(9.0, abs=1e-9)
    assert (flown["end_x"][[1, 2, 5]] <= [8.6, 0.4, 8.9]).all()
    alone = fly(model, {**inputs, "event_gap": 8.6}, np.array([1]), 1, folder=folder, width=1)
    assert alone["end_x"][0] == flown["end_x"][1]
