"""Random density and winds of a case: their statistics, their frozen profiles, and a flight through them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reentry_flights import assert_same_bits_alone, fly_cases, fly_one, history
from reentry_twin import MU, RADIUS, standard_density, to_cartesian
from scipy.integrate import solve_ivp

from campaigns.reentry.published.values import PLANAR
from campaigns.reentry.weather import (
    DEPTH,
    LARGE_SCALE,
    NODES,
    SMALL_SCALE,
    SPACING,
    node_altitudes,
    normal_deviates,
    standard_profile,
    weather_at,
    weather_nodes,
)

N = 6000
draws = st.floats(1e-9, 1.0 - 1e-9)


def tables_of(draw, mean=1.0):
    """Rows of `weather_nodes` for the draws, of full size, with this size of the mean wind."""
    draw = np.atleast_1d(draw)
    return weather_nodes(draw, *np.ones((2, draw.size)), np.full(draw.size, mean))


@pytest.fixture(scope="module")
def tables():
    """Of N cases, without a mean wind."""
    return tables_of(np.random.default_rng(76).uniform(size=N), mean=0.0)


@pytest.fixture(scope="module")
def nodes(tables):
    """float64[N, NODES, 3]."""
    return tables[:, :DEPTH].reshape(N, NODES, 3)


@pytest.fixture(scope="module")
def depths(tables):
    """float64[N]."""
    return tables[:, DEPTH]


def test_deviates_are_standard_normal_and_independent():
    z = normal_deviates(np.random.default_rng(2).uniform(size=4000), 50)
    assert z.mean() == pytest.approx(0.0, abs=5.0 / np.sqrt(z.size))
    assert z.std() == pytest.approx(1.0, abs=5.0 / np.sqrt(2.0 * z.size))
    assert np.abs(np.corrcoef(z) - np.eye(50)).max() < 5.0 / np.sqrt(4000)
    assert (z**4).mean() == pytest.approx(3.0, abs=0.15)


def test_neighbouring_numbers_name_unrelated_airs():
    z = normal_deviates(np.array([0.3, np.nextafter(0.3, 1.0)]), 4000)
    assert abs(np.corrcoef(z.T)[0, 1]) < 0.08


@pytest.mark.parametrize(("field", "column"), [(0, 1), (1, 2), (2, 2)])
def test_each_altitude_has_the_size_of_its_profile(nodes, depths, field, column):
    sizes = standard_profile(column, node_altitudes(depths)).T
    assert (nodes[:, :, field] / sizes).std(axis=0) == pytest.approx(np.ones(NODES), rel=0.05)
    assert np.abs((nodes[:, :, field] / sizes).mean(axis=0)).max() < 5.0 / np.sqrt(N)


def test_no_altitude_is_favoured_by_the_nodes(depths):
    """Extremes of the air lie at nodes; they are spread evenly over altitude from case to case."""
    table = tables_of(np.random.default_rng(5).uniform(size=600))
    above = np.arange(40e3, 48e3, 50.0)
    profiles = np.array([[weather_at(h, 0.0, row).density for h in above] for row in table])
    peak = profiles.argmax(axis=1)
    highest = above[peak[(peak > 0) & (peak < above.size - 1)]]
    counted = np.histogram((highest / SPACING) % 1.0, 4, (0.0, 1.0))[0]
    assert counted.max() < 2.0 * counted.min()
    assert np.histogram(depths, 10, (0.0, 1.0))[0] == pytest.approx(N / 10, rel=0.15)


def test_the_correlation_over_altitude_is_the_mean_of_the_two_scales(nodes):
    for apart in (1, 3, 8):
        nodes_of_case = np.corrcoef(nodes[:, 30, 0], nodes[:, 30 + apart, 0])[0, 1]
        distance = apart * SPACING
        expected = 0.5 * (np.exp(-distance / SMALL_SCALE) + np.exp(-distance / LARGE_SCALE))
        assert nodes_of_case == pytest.approx(expected, abs=0.06)


@given(draw=draws, h=st.floats(-1e3, 140e3))
def test_values_meet_the_nodes_and_slopes_are_derivatives(draw, h):
    table = tables_of(draw)[0]
    altitudes = node_altitudes(table[DEPTH:])[:, 0]
    k = int(np.clip(h / SPACING + table[DEPTH], 0, NODES - 2))
    at_node = weather_at(float(altitudes[k]), 0.0, table)
    assert (at_node.density, at_node.east, at_node.north) == pytest.approx(table[3 * k : 3 * k + 3], abs=1e-9)
    low, here, high = (weather_at(h + step, 0.0, table) for step in (-0.5, 0.0, 0.5))
    if altitudes[0] + 1.0 < h < altitudes[-1] - 1.0:
        assert here.density_slope == pytest.approx(high.density - low.density, abs=1e-7)
        assert here.east_slope == pytest.approx(high.east - low.east, abs=1e-4)
        assert here.north_slope == pytest.approx(high.north - low.north, abs=1e-4)


def test_the_air_has_one_slope_on_both_sides_of_a_node():
    """Differences over a metre below and above it agree; the slope is zero on both sides, as the air is level there."""
    table = tables_of(0.37)[0]
    nodes, step, beside = table[:DEPTH].reshape(NODES, 3), 1.0, 1e-6  # m
    steepest = np.abs(np.diff(nodes, axis=0)).max(axis=0) / SPACING
    for altitude in node_altitudes(table[DEPTH:])[:, 0][5:60]:
        below, at, above = (weather_at(altitude + h, 0.0, table) for h in (-step, 0.0, step))
        for field, largest in zip(("density", "east", "north"), steepest, strict=True):
            before, here, after = (getattr(air, field) for air in (below, at, above))
            assert abs((after - here) - (here - before)) / step < 0.01 * largest
            slopes = [getattr(weather_at(altitude + h, 0.0, table), f"{field}_slope") for h in (-beside, beside)]
            assert slopes == pytest.approx([0.0, 0.0], abs=1e-6 * largest)


def twin_rates(t, y, table, drag, lift):
    """A sphere at rest, inertial axes, bank 60 degrees; winds from local north and east."""
    r, v = y[:3], y[3:]
    size = np.sqrt(r @ r)
    up = r / size
    east = np.cross([0.0, 0.0, 1.0], up)
    east = east / np.sqrt(east @ east)
    w = weather_at(size - RADIUS, 0.0, table)
    through = v - w.east * east - w.north * np.cross(up, east)
    speed = np.sqrt(through @ through)
    push = 0.5 * standard_density(size - RADIUS) * np.exp(w.density) * speed
    right = np.cross(through, up)
    right = right / np.sqrt(right @ right)
    above = np.cross(right, through / speed)
    turned = 0.5 * above + np.sqrt(0.75) * right
    return np.concatenate([v, -MU / size**3 * r + push * (speed * lift * turned - drag * through)])


def test_a_flight_through_weather_is_that_of_a_twin():
    ten_centimetres, duration = 0.1, 250.0
    drag = 1.2569 * 12.017 / 5498.22
    world = PLANAR | {"planar": False, "weather": True, "tolerance": 1e-11, "stop_time_s": duration}
    for draw, latitude, heading in ((0.123, 30.0, 40.0), (0.77, -50.0, 200.0)):
        row = fly_one(
            **world, weather_draw=draw, entry_latitude_deg=latitude, entry_heading_deg=heading, stop_altitude_km=0.0
        )
        table = tables_of(draw)[0]
        phi, psi, path = np.radians([latitude, heading, -2.0])
        start = np.concatenate(to_cartesian([RADIUS + 120e3, 0.0, phi, 7800.0, path, psi]))
        end = solve_ivp(
            twin_rates, (0.0, duration), start, "DOP853", rtol=1e-11, atol=1e-8, args=(table, drag, 0.3 * drag)
        ).y[:, -1]
        flown = np.array([row[f"end_{axis}_m"] for axis in "xyz"])
        assert np.abs(flown - end[:3]).max() < ten_centimetres * 10.0  # corners of the 1976 standard
        assert np.abs(np.array([row[f"end_v{axis}_m_s"] for axis in "xyz"]) - end[3:]).max() < 0.01


def test_the_density_of_a_history_is_the_standard_one_times_the_profile():
    seen = history(rows=301, **PLANAR, weather=True, weather_draw=0.4)
    table = tables_of(0.4)[0]
    for i in range(0, 301, 25):
        h = 1e3 * seen["altitude_km"][i]
        expected = standard_density(h) * np.exp(weather_at(h, 0.0, table).density)
        assert seen["density_kg_m3"][i] == pytest.approx(expected, rel=1e-9)


def test_a_skip_meets_the_same_air_on_its_way_down_and_up():
    fast = PLANAR | {"entry_speed_m_s": 11e3, "entry_flight_path_angle_deg": -6.5, "bank_deg": 0.0}
    mixed, standard = (history(rows=2001, **fast, weather=on, weather_draw=0.9) for on in (True, False))
    turn = int(np.argmin(mixed["altitude_km"]))
    assert 0 < turn < 2000
    assert len(standard["t_s"]) == 2001
    ratio = mixed["density_kg_m3"] / [standard_density(1e3 * h) for h in mixed["altitude_km"]]
    down, up = slice(turn, None, -1), slice(turn, None)
    levels = np.linspace(mixed["altitude_km"][turn] + 1.0, 110.0, 40)
    first, second = (np.interp(levels, mixed["altitude_km"][part], ratio[part]) for part in (down, up))
    assert second == pytest.approx(first, rel=1e-3)
    assert np.ptp(first) > 0.01


def test_the_peaks_are_those_of_a_dense_history_through_weather_too():
    draws_of = np.linspace(0.05, 0.95, 6)
    rows = fly_cases(**PLANAR, weather=True, weather_draw=draws_of, tolerance=1e-9)
    for i, draw in enumerate(draws_of):
        seen = history(rows=8001, **PLANAR, weather=True, weather_draw=float(draw), tolerance=1e-9)
        for name in ("load_g", "heat_rate_w_m2", "dynamic_pressure_pa"):
            assert rows[f"peak_{name}"][i] == pytest.approx(seen[name].max(), rel=2e-5)


def test_a_tail_wind_carries_the_landing_along():
    """A mean wind to the east, an entry to the east."""
    still, blown = (
        fly_one(**PLANAR, lift_coefficient=0.0, weather=True, wind_mean_size=size)["downrange_km"]
        for size in (0.0, 1.0)
    )
    assert 0.5 < blown - still < 10.0


def test_the_air_of_a_case_hangs_on_its_number_alone():
    """Not on its place in the chunk, its neighbours, or the law."""
    draw = np.random.default_rng(3).uniform(size=21)
    law_1 = PLANAR | {"weather": True, "guidance": "law1", "plan": "given"}
    together = fly_cases(**law_1, weather_draw=draw)
    assert_same_bits_alone(together, (0, 10, 20), each={"weather_draw": draw}, **law_1)
    laws = np.array(["law1", "none", "law2r"] * 7, dtype=object)
    mixed = fly_cases(**law_1 | {"guidance": laws}, weather_draw=draw)
    assert mixed["downrange_km"][::3].tolist() == together["downrange_km"][::3].tolist()


def test_law_1_flies_through_weather_to_its_target():
    rng = np.random.default_rng(12)
    cases = {"weather_draw": rng.uniform(size=200), "entry_flight_path_angle_error_deg": rng.normal(0.0, 0.05, 200)}
    guided, open_loop = (
        fly_cases(**PLANAR, weather=True, **cases, plan="given", guidance=law)["downrange_km"]
        for law in ("law1", "none")
    )
    assert guided.std() < 2.0 < open_loop.std()


def test_violations_count_the_limits_that_were_passed():
    plain = fly_one(**PLANAR)
    peaks = ("peak_load_g", "peak_heat_rate_w_m2", "heat_load_j_m2", "peak_dynamic_pressure_pa")
    limits = {f"corridor_{name.removeprefix('peak_')}": plain[name] for name in peaks}
    assert plain["corridor_violations"] == 0.0
    for k in range(5):
        scaled = {name: value * (0.999 if i < k else 1.001) for i, (name, value) in enumerate(limits.items())}
        assert fly_one(**PLANAR, **scaled)["corridor_violations"] == float(k)
