"""Adaptive flight: orders, events, peaks, histories, and lanes that never look at each other."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from flown_models import FOLDER, OSCILLATOR, flown, inputs_of, same_bytes
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from mc_engine.flight.flight import fly_history, fly_interpreted
from mc_engine.flight.interpreted import InterpretedFlight
from mc_engine.lanes.runge_kutta_pairs import PAIRS
from mc_engine.model import AdaptiveStep, FixedStep, load_model

MU = 398600.4418e9


def of_cases(columns, cases):
    """The rows of some cases."""
    return {name: column[cases] for name, column in columns.items()}


@pytest.fixture(scope="module")
def orbit():
    return load_model("orbit.py", FOLDER)


@pytest.fixture(scope="module")
def wave():
    return load_model("wave.py", FOLDER)


SPEEDS = np.linspace(7700.0, 9500.0, 40)  # near-circular to e = 0.58


@pytest.fixture(scope="module")
def day(orbit):
    return flown(orbit, speed_m_s=SPEEDS)


@pytest.mark.parametrize("width", [pytest.param(1, marks=pytest.mark.slow), 16])
def test_every_width_gives_the_same_bits(orbit, day, width):
    same_bytes(flown(orbit, width, speed_m_s=SPEEDS), day)


def test_neither_order_nor_company_of_the_cases_changes_a_bit(wave):
    rng = np.random.default_rng(2)
    inputs = {"omega_rad_s": rng.uniform(0.3, 3.0, 60), "noise_m_s2": rng.uniform(0.0, 0.1, 60)}
    straight, order = flown(wave, **inputs), rng.permutation(60)
    shuffled = flown(wave, case_ids=order, **{name: values[order] for name, values in inputs.items()})
    same_bytes(shuffled, of_cases(straight, order))
    for case in rng.integers(0, 60, 12):
        alone = flown(wave, 1, np.array([case]), **{name: values[case] for name, values in inputs.items()})
        same_bytes(alone, of_cases(straight, slice(case, case + 1)))


def test_apogee_and_perigee_are_those_of_kepler(day):
    a = 1.0 / (2.0 / 7e6 - SPEEDS**2 / MU)
    assert day["highest_m"] == pytest.approx(np.maximum(7e6, 2.0 * a - 7e6), rel=1e-10)
    assert day["lowest_m"] == pytest.approx(np.minimum(7e6, 2.0 * a - 7e6), rel=1e-10)
    # one of the apogees; a peak is flat, so that its time is known to the root of its height only
    turns = day["highest_time_s"] / (np.pi * np.sqrt(a**3 / MU))
    assert np.abs(turns - np.rint(turns))[a > 7e6].max() < 1e-6


def test_energy_and_angular_momentum_drift_less_than_1e_9_in_a_day(day):
    assert day["energy"] == pytest.approx(SPEEDS**2 / 2.0 - MU / 7e6, rel=1e-9)
    assert day["angular_momentum"] == pytest.approx(7e6 * SPEEDS, rel=1e-9)


def kepler(t, v=8000.0, r=7e6):
    """Place at time t of the orbit that starts at its perigee (r, 0) with speed v."""
    a = 1.0 / (2.0 / r - v**2 / MU)
    e, mean = 1.0 - r / a, t * np.sqrt(MU / a**3)
    anomaly = brentq(lambda x: x - e * np.sin(x) - mean, mean - 1.0, mean + 1.0, xtol=1e-15, rtol=1e-15)
    return np.array([a * (np.cos(anomaly) - e), a * np.sqrt(1.0 - e * e) * np.sin(anomaly)])


@pytest.mark.parametrize(("method", "order", "longest"), [("dop853", 8, 200.0), ("tp86", 8, 400.0), ("dp54", 5, 25.0)])
def test_the_error_falls_with_the_order_of_the_method(orbit, method, order, longest):
    """Tolerances that allow anything, and samples of the control that hold the step: halve it, and see."""
    errors = []
    for step in (longest, longest / 2.0):
        clock = replace(orbit.clock, method=method, atol=1e9, control_period=step, first_step=step)
        end = flown(replace(orbit, clock=clock), speed_m_s=8000.0, duration_s=4000.0)
        errors.append(np.hypot(*(np.array([end["end_x_m"][0], end["end_y_m"][0]]) - kepler(4000.0))))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.7)


@pytest.mark.parametrize("level", [-0.999, -0.5, 0.0, 0.7, 0.999, 0.999999])
def test_every_crossing_is_met_even_two_close_ones_in_one_step(wave, level):
    """Near its top the wave is over the level 0.999999 for 0.0028 rad, in steps of about one."""
    got = flown(wave, level_m=level, stop_s=50.0)
    turns = 2.0 * np.pi * np.arange(9)
    rises, falls = np.arcsin(level) + turns, np.pi - np.arcsin(level) + turns
    assert got["rises"][0] == np.count_nonzero((rises > 0.0) & (rises < 50.0))  # it does not cross where it begins
    assert got["falls"][0] == np.count_nonzero(falls < 50.0)


def test_event_times_are_within_1e_9_s_of_the_root(wave):
    levels = np.linspace(-0.99, 0.99, 37)
    got = flown(wave, level_m=levels, tolerance=1e-13)
    root = np.arcsin(levels) + 2.0 * np.pi * np.rint((got["rise_time_s"] - np.arcsin(levels)) / (2.0 * np.pi))
    assert np.abs(got["rise_time_s"] - root).max() < 1e-9
    fall = np.pi - np.arcsin(levels)
    fall += 2.0 * np.pi * np.floor((50.0 - fall) / (2.0 * np.pi))
    last = np.where(np.sin(50.0) > levels, 50.0, fall)
    assert np.abs(got["last_above_s"] - last).max() < 1e-9


def test_a_peak_is_as_exact_as_the_integrator_and_not_the_step(wave):
    got = flown(wave, tolerance=1e-12, omega_rad_s=np.linspace(0.5, 2.0, 16))
    assert got["top_m"] == pytest.approx(1.0, abs=1e-10)


def test_the_control_is_sampled_at_its_times_with_its_own_draws(wave):
    """Samples at 0, 7, 14, ... 49 s: the last push is the draw of the eighth."""
    longer = flown(wave, noise_m_s2=1.0, stop_s=np.array([50.0, 55.9, 56.1]), case_ids=np.array([4, 4, 4]))
    assert longer["push_m_s2"][0] == longer["push_m_s2"][1] != longer["push_m_s2"][2]


@pytest.mark.parametrize(("period", "until", "samples"), [(0.7, 2.1, 3), (0.3, 3.6, 12), (0.1, 0.3, 3)])
def test_no_sample_is_taken_at_the_end_whichever_way_its_time_is_rounded(period, until, samples):
    """As on a fixed grid.  In double precision 3 x 0.7 is below 2.1, 12 x 0.3 below 3.6, and 3 x 0.1 above 0.3."""
    got = flown(replace(OSCILLATOR, clock=AdaptiveStep(until, control_period=period)))
    assert (got["samples"][0], got["end_time_s"][0]) == (samples, until)


def test_a_flight_with_samples_and_no_event_has_the_same_bits_interpreted():
    sampled = replace(OSCILLATOR, clock=AdaptiveStep(until=3.0, control_period=0.7))
    columns = flown(sampled, case_ids=[5], noise_m_s2=0.1, gain_1_s=0.2)
    inputs = inputs_of(sampled, {"noise_m_s2": 0.1, "gain_1_s": 0.2})
    time, status, states, metrics = fly_interpreted(InterpretedFlight(sampled), inputs, 5, 1)
    assert (time[0], status[0], columns["samples"][0]) == (3.0, 0.0, 5.0)
    for fields, rows, before in ((sampled.states, states, "end_"), (sampled.metrics, metrics, "")):
        for field, row in zip(fields, rows, strict=True):
            assert row[0] / field.si_factor == columns[f"{before}{field.name}"][0], field.name


@pytest.mark.parametrize("width", [1, 8])
def test_a_history_disturbs_nothing_and_has_every_event_and_top_of_the_flight(wave, width):
    inputs = inputs_of(wave, {"omega_rad_s": 1.3, "tolerance": 1e-12})
    plain = flown(wave, omega_rad_s=1.3, tolerance=1e-12)
    turns = np.arange(int(50.0 * 1.3 / np.pi / 2.0)) * 2.0 * np.pi
    instants = np.concatenate([turns + angle for angle in (np.arcsin(0.5), np.pi - np.arcsin(0.5), np.pi / 2.0)]) / 1.3
    for rows in (11, 501):
        columns, history = fly_history(wave, inputs, 0, 1, folder=FOLDER, rows=rows, width=width)
        t, height = history["t_s"], history["height_m"]
        same_bytes(columns, plain)
        assert (t[0], t[-1], height[-1]) == (0.0, plain["end_time_s"][0], plain["end_x_m"][0])
        assert (np.diff(t) > 0.0).all()
        assert height == pytest.approx(np.sin(1.3 * t), abs=1e-9)
        assert np.abs(t[:, None] - instants).min(axis=0).max() < 1e-6  # a top is flat: its time has half the digits
        assert height.max() == plain["top_m"][0]
    assert len(t) == 501


def test_a_history_has_both_sides_of_every_sample_at_which_the_held_push_jumps(tmp_path):
    text = (FOLDER / "wave.py").read_text()
    text = text.replace("def observe(s, p)", "def observe(s, m)").replace("above=s.x - p.level", "above=m.push")
    (tmp_path / "pushed.py").write_text(text)
    model = load_model("pushed.py", tmp_path)
    inputs = inputs_of(model, {"omega_rad_s": 1.0, "noise_m_s2": 1.0})
    _, history = fly_history(model, inputs, 4, 1, folder=tmp_path, rows=60)
    t, push = history["t_s"], history["above_m"]
    for sample in range(1, 8):
        before, after = np.flatnonzero(t == 7.0 * sample)
        assert push[before] == push[np.flatnonzero(t == 7.0 * (sample - 1))[-1]] != push[after]


@pytest.mark.parametrize(("ill", "status"), [(1.0, "not-finite"), (2.0, "step-limit"), (3.0, "step-limit")])
def test_a_poisoned_case_ends_with_its_status_and_leaves_its_neighbours_bits_alone(wave, ill, status):
    rng = np.random.default_rng(5)
    omega, noise = rng.uniform(0.3, 3.0, 64), rng.uniform(0.0, 0.1, 64)
    healthy = flown(wave, omega_rad_s=omega, noise_m_s2=noise)
    sick = np.zeros(64)
    sick[[3, 17, 18, 40]] = ill
    mixed = flown(wave, omega_rad_s=omega, noise_m_s2=noise, ill=sick)
    assert set(mixed["status"][sick > 0.0]) == {status}
    assert np.isnan(mixed["top_m"][sick > 0.0]).all()
    assert np.isfinite(mixed["end_x_m"]).all()
    same_bytes(of_cases(mixed, sick == 0.0), of_cases(healthy, sick == 0.0))


def test_a_case_that_needs_more_attempts_than_allowed_ends_as_step_limit(wave):
    clock = replace(wave.clock, attempts=40)
    got = flown(replace(wave, clock=clock), stop_s=np.array([1.0, 99.0]))
    assert list(got["status"]) == ["ok", "step-limit"]
    assert 0.0 < got["end_time_s"][1] < 99.0


def test_a_falling_crossing_is_met_in_a_step_that_also_rises_over_the_level_and_reaches_the_ground():
    """Closed form of a hop with constant accelerations, whose coast is one long step."""
    burn = np.linspace(4.8, 7.2, 50)
    columns = flown(load_model("moon_hop.py", FOLDER), burn_s=burn)
    up = 5.0 - 1.62
    speed, height = up * burn, 0.5 * up * burn**2
    down = [burn + (speed + np.sqrt(speed**2 + 3.24 * (height - level))) / 1.62 for level in (100.0, 0.0)]
    assert set(columns["status"]) == {"ok"}
    for name, times in zip(("legs_s", "last_s", "land_s"), (down[0], down[0], down[1]), strict=True):
        assert columns[name] == pytest.approx(times, abs=1e-8)


def test_a_visit_of_a_millisecond_has_the_times_of_its_parabola_and_its_top():
    """Closed form of a throw that rises a little over a ceiling; after the switch there, its steps take seconds."""
    excess = np.array([1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.1])
    columns = flown(load_model("grazed_ceiling.py", FOLDER), excess_m=excess)
    top = np.sqrt(2.0 * (100.0 + excess) / 9.8)
    half = np.sqrt(2.0 * excess / 9.8)
    assert columns["rise_s"] == pytest.approx(top - half, abs=1e-9)
    assert columns["fall_s"] == pytest.approx(top + half, abs=1e-9)
    assert columns["top_s"] == pytest.approx(top, abs=1e-9)
    assert columns["top_m"] - 100.0 == pytest.approx(excess, abs=1e-12)


@pytest.mark.parametrize(
    ("method", "lag"),
    [*product(["dop853", "tp86", "dp54"], [100.0, 1e-13, 0.0]), *product(["rk4", "abm8"], [100.0, 0.0, -1.0])],
)
def test_rounding_after_an_event_is_not_taken_for_the_way_back(method, lag):
    """The height is rounded to 1e-9 m, and the step after the way up ends below the ceiling, or at once."""
    throw = load_model("grazed_ceiling.py", FOLDER)
    excess = np.geomspace(0.01, 30.0, 500)
    fixed = FixedStep(0.01, 60.0, method=method)
    throw = replace(throw, clock=replace(throw.clock, method=method) if method in PAIRS else fixed)
    columns = flown(throw, excess_m=excess, along_m_s=1e6, lag_s=lag)
    fall = np.sqrt(2.0 * (100.0 + excess) / 9.8) + np.sqrt(2.0 * excess / 9.8)
    assert set(columns["status"]) == {"ok"}
    assert columns["fall_s"] == pytest.approx(fall, abs=1e-7)


def test_the_time_of_a_largest_value_that_jumps_there_is_that_of_the_jump():
    opening = np.linspace(4.0, 6.0, 20)
    columns = flown(load_model("opened_parachute.py", FOLDER), open_s=opening)
    assert columns["top_s"] == pytest.approx(opening, abs=1e-9)
    assert (columns["top_m_s2"] > 500.0).all()


class CountedFlight(InterpretedFlight):
    """Keeps the times at which the derivative was asked for."""

    def __init__(self, model):
        super().__init__(model)
        self.times = []

    def call(self, name, function, arguments):
        if name == "rhs":
            self.times.append(float(arguments[0]))
        return super().call(name, function, arguments)


def counted(model, **inputs):
    """(times of all derivatives, end time) of one case."""
    flight = CountedFlight(model)
    (end,), *_ = fly_interpreted(flight, inputs_of(model, inputs), 0, 1)
    return np.array(flight.times), end


@pytest.mark.parametrize("method", ["dop853", "tp86", "dp54"])
def test_the_first_steps_of_a_trimmed_vehicle_see_what_its_elevator_does(method):
    """Its state changes by 4e-5 of itself in a second, but is far from trim a second after a doublet begins."""
    trimmed = load_model("trimmed.py", FOLDER)
    starts = np.array([0.0, 0.1, 0.5, 1.0])
    columns = flown(replace(trimmed, clock=replace(trimmed.clock, method=method)), start_s=starts)

    def angle(t, y, pull):
        return [y[1] - 0.8 * y[0], 5.0 * pull - 4.0 * y[0] - y[1]]

    first = solve_ivp(angle, (0.0, 0.5), [0.0, 0.0], args=(0.05,), rtol=1e-12, atol=1e-14, max_step=1e-3)
    second = solve_ivp(angle, (0.5, 1.0), first.y[:, -1], args=(-0.05,), rtol=1e-12, atol=1e-14, max_step=1e-3)
    top = 0.05 + max(first.y[0].max(), second.y[0].max())
    assert columns["top_rad"] == pytest.approx(top, abs=1e-6)


@pytest.mark.parametrize("flight_path_rad", np.linspace(-0.045, -0.025, 5))
def test_an_event_whose_function_is_rounded_far_from_zero_takes_few_looks(flight_path_rad):
    """The altitude is a difference of radii, to 1e-9 m; each look asks for two derivatives at its end."""
    model = load_model("tests.benchmarks.models.ballistic_adaptive")
    times, end = counted(model, flight_path_rad=flight_path_rad, tolerance=1e-11)
    assert np.count_nonzero(abs(times - end) < 1e-4) <= 2 * 4
