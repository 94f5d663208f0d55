"""The bit promise: a case comes to the same bytes at every width, in every chunk, thread and order, and alone."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mc_engine.errors import ModelError
from mc_engine.flight.flight import fly, fly_history, grid_of, prepare
from mc_engine.model import AdaptiveStep, FixedStep, load_model

SEED = 20160421
N_CASES = 1000


@pytest.fixture(scope="module")
def model():
    return load_model("campaigns.deorbit")


@pytest.fixture(scope="module")
def inputs(model):
    """The de-orbit campaign with everything dispersed: burns, delays, navigation, and the ways to fly the command."""
    random = np.random.default_rng(SEED)
    columns = {item.name: item.default for item in (*model.parameters, *model.settings)}
    columns |= {
        "ve_pct": random.normal(size=N_CASES) * 20 / 3,
        "oe_pct": random.normal(size=N_CASES) * 5,
        "out_of_plane_error_deg": random.normal(size=N_CASES) * 0.1,
        "burn_delay_s": np.where(np.arange(N_CASES) % 5 == 0, random.uniform(0, 5, N_CASES), 0.0),
        "thrust_limit_n": random.uniform(20.0, 60.0, N_CASES),
        "navigation_position_noise_m": np.where(np.arange(N_CASES) % 2 == 0, random.uniform(0, 30, N_CASES), 0.0),
        "navigation_velocity_noise_m_s": np.where(np.arange(N_CASES) % 4 == 0, random.uniform(0, 0.3, N_CASES), 0.0),
        "navigation_radial_position_error_m": np.where(np.arange(N_CASES) % 3 == 0, 50.0, 0.0),
        "control": random.choice(["continuous", "clipped", "pulsed"], N_CASES),
        "pulse_feed": random.choice(["continuous", "closed_loop"], N_CASES),
        "j2": random.choice([True, False], N_CASES),
        "step_s": 2.0,
        "steps_per_fix": 3.0,
    }
    return columns


def chosen(inputs, cases):
    """The inputs of some cases."""
    return {name: value[cases] if np.ndim(value) else value for name, value in inputs.items()}


def flown(model, inputs, cases, *, width=None, chunk=N_CASES, threads=1):
    """Columns of the cases, flown in chunks by threads, put together in the order of `cases`."""
    parts = [cases[first : first + chunk] for first in range(0, len(cases), chunk)]
    with ThreadPoolExecutor(threads) as pool:
        done = list(pool.map(lambda part: fly(model, chosen(inputs, part), part, SEED, width=width), parts))
    return {name: np.concatenate([columns[name] for columns in done]) for name in done[0]}


def different(one, other):
    """Names of the columns that differ in any byte."""
    assert list(one) == list(other)
    return [
        name
        for name, column in one.items()
        if (list(column) != list(other[name]) if column.dtype == object else column.tobytes() != other[name].tobytes())
    ]


@pytest.fixture(scope="module")
def whole(model, inputs):
    """All cases in order, as many at a time as in a run, in one chunk."""
    columns = flown(model, inputs, np.arange(N_CASES))
    assert set(columns["status"]) == {"ok"}
    assert columns["pulse_count"].max() > 1
    return columns


# The builds of other widths than a run's own take long to compile; smaller models are flown 16 wide in tests of lanes.
WIDTHS = [pytest.param(width, marks=[pytest.mark.deep if width == 1 else pytest.mark.slow]) for width in (1, 4, 8, 16)]


@pytest.mark.parametrize("width", [None, *WIDTHS])
@pytest.mark.parametrize(
    ("chunk", "n_cases", "threads", "shuffled"),
    [(1, 64, 2, False), (7, 203, 1, True), (64, 1000, 2, True), (1000, 1000, 1, True)],
)
def test_bytes_depend_on_no_width_chunk_thread_or_order(model, inputs, whole, width, chunk, n_cases, threads, shuffled):
    cases = np.random.default_rng(chunk).permutation(N_CASES) if shuffled else np.arange(N_CASES)
    cases = cases[:n_cases]
    ours = flown(model, inputs, cases, width=width, chunk=chunk, threads=threads)
    assert different(ours, chosen(whole, cases)) == []


def test_fifty_cases_flown_alone_have_the_bytes_of_the_batch(model, inputs, whole):
    cases = np.random.default_rng(7).choice(N_CASES, 50, replace=False)
    for case in cases:
        one = chosen(inputs, np.array([case]))
        alone = fly(model, one, np.array([case]), SEED)
        assert different(alone, chosen(whole, np.array([case]))) == [], case
        columns, history = fly_history(model, one, int(case), SEED, rows=100)
        assert different(columns, chosen(whole, np.array([case]))) == [], case
        assert history["t_s"][-1] == whole["end_time_s"][case]


def test_another_seed_changes_the_cases_with_noise_and_no_other(model, inputs, whole):
    cases = np.arange(0, 100)
    noisy = (inputs["navigation_position_noise_m"] + inputs["navigation_velocity_noise_m_s"])[cases] > 0
    other = fly(model, chosen(inputs, cases), cases, SEED + 1)
    changed = other["final_position_error_m"] != whole["final_position_error_m"][cases]
    # the modulator fed by the ideal command does not listen to the navigation
    insensitive = ((inputs["control"] == "pulsed") & (inputs["pulse_feed"] == "continuous"))[cases]
    np.testing.assert_array_equal(changed, noisy & ~insensitive)


def test_inputs_may_be_read_only(model, inputs, whole):
    locked = {name: np.array(value) if np.ndim(value) else value for name, value in inputs.items()}
    cases = np.arange(N_CASES)
    for column in (*locked.values(), cases):
        if np.ndim(column):
            column.setflags(write=False)
    assert different(fly(model, locked, cases, SEED), whole) == []


def test_inputs_that_are_not_a_number_or_out_of_range_are_refused_with_a_sentence(model, inputs, whole):
    cases = np.arange(40)
    some = chosen(inputs, cases)
    some["ve_pct"][3], some["ve_pct"][4], some["oe_pct"][5] = np.nan, -120.0, np.inf
    some["initial_mass_kg"] = np.where(cases == 6, -1.0, 100.0)
    columns = fly(model, some, cases, SEED)
    bad = [3, 4, 5, 6]
    assert list(np.flatnonzero(columns["status"] == "refused")) == bad
    assert columns["reason"][5] == "oe_pct is infinite"
    assert columns["reason"][3] == "ve_pct is not a number"
    assert columns["reason"][4] == "ve_pct is outside -100 to inf %"
    assert "initial_mass_kg is outside 0.001 to inf kg" in columns["reason"][6]
    assert np.isnan(columns["propellant_kg"][bad]).all()
    others = np.setdiff1d(cases, bad)
    assert different(chosen(columns, others), chosen(whole, others)) == []


def test_refused_cases_alone_fly_nothing_and_keep_their_rows(model, inputs):
    some = chosen(inputs, np.arange(3)) | {"ve_pct": np.nan}
    columns = fly(model, some, np.arange(3), SEED)
    assert list(columns["status"]) == ["refused"] * 3
    assert all(len(column) == 3 for column in columns.values())
    one, history = fly_history(model, chosen(some, np.array([0])), 0, SEED)
    assert one["status"][0] == "refused"
    assert all(len(row) == 0 for row in history.values())


def test_parameters_enter_and_metrics_leave_in_their_declared_units(model):
    inputs = {item.name: item.default for item in (*model.parameters, *model.settings)}
    inputs |= {"initial_mass_kg": 80.0, "thrust_bias_pct": 5.0, "target_radius_km": 6500.0, "gain_1_s": 0.02}
    rows = dict(zip(model.kernel_parameters._fields, prepare(model, inputs, 2).parameters, strict=True))
    assert rows["initial_mass"].tolist() == [80.0, 80.0]
    assert rows["target_radius"].tolist() == [6.5e6, 6.5e6]
    assert rows["thrust_factor"].tolist() == [1.05, 1.05]
    columns = fly(model, inputs, np.array([0]), SEED)
    assert columns["entry_radius_km"][0] == pytest.approx(6500.0, rel=1e-12)
    assert columns["entry_flight_path_angle_deg"][0] == pytest.approx(-2.0, abs=1e-7)
    assert columns["entry_latitude_argument_deg"][0] == pytest.approx(60.0, abs=1e-7)
    assert columns["entry_speed_m_s"][0] == pytest.approx(7800.0, abs=1e-5)
    assert columns["entry_mass_kg"][0] == pytest.approx(80.0, rel=1e-9)


@pytest.mark.parametrize(
    ("step", "until", "n_steps"), [(0.01, 300.0, 30_000), (0.1, 0.3, 3), (1.0, 0.2, 1), (0.7, 2.0, 3), (0.1, 12.1, 121)]
)
def test_the_grid_has_the_steps_of_the_quotient_and_one_more_for_a_rest(step, until, n_steps):
    assert grid_of(FixedStep(step, until), None) == (n_steps, step, 1)
    settings = SimpleNamespace(dt=step, limit=until, every=4.0)
    assert grid_of(FixedStep("dt", "limit", "every"), settings) == (n_steps, step, 4)


def test_a_flight_has_a_billion_steps_at_most_which_is_enough_for_ten_days_of_a_hundredth_of_a_second(model):
    day = 86_400.0
    assert grid_of(FixedStep(0.01, 10 * day), None)[0] == 86_400_000
    assert grid_of(FixedStep(1e-3, 1e6), None)[0] == 10**9
    with pytest.raises(ModelError, match=r"no more than 1,000,000,000 steps"):
        grid_of(FixedStep(1e-3, 1.1e6), None)
    with pytest.raises(ModelError, match=r"`control_every` is 2\.7; it counts steps"):
        grid_of(FixedStep(1.0, 9.0, "every"), SimpleNamespace(every=2.7))
    assert replace(model, clock=AdaptiveStep(day, attempts=10**9, control_period=1.0)).clock.attempts == 10**9
    with pytest.raises(
        ModelError, match=r"`attempts` is 1000000001; it must be a number at least 1, and 1,000,000,000"
    ):
        replace(model, clock=AdaptiveStep(day, attempts=10**9 + 1, control_period=1.0))


def test_another_clock_of_the_same_kind_flies_with_the_same_kernel(model):
    """Such as the single step by which `check` compiles."""
    nominal = {item.name: item.default for item in (*model.parameters, *model.settings)}
    short = fly(model, nominal, np.array([0]), SEED, clock=replace(model.clock, until=model.clock.step))
    assert (short["status"][0], short["end_time_s"][0]) == ("no-stop", nominal["step_s"])


def test_what_is_not_a_number_has_the_same_bits_whoever_computed_it(model, inputs, monkeypatch):
    """0.0 / 0.0 has a sign on some processors and none on others."""

    def kernel(*arguments):
        time, status, state, metrics, history, rows, _ = arguments[-7:]
        time[...], state[...], metrics[...], status[...] = -np.nan, -np.nan, -np.nan, 0.0
        history[:, :1], rows[:] = 0.0, 1

    monkeypatch.setattr("mc_engine.flight.flight.build_kernel", lambda model, folder, width: kernel)
    among = fly(model, chosen(inputs, np.arange(8)), np.arange(8), SEED)
    alone, _ = fly_history(model, chosen(inputs, 0), 0, SEED)
    for columns, n in ((among, 8), (alone, 1)):
        numbers = [column for column in columns.values() if column.dtype == np.float64]
        assert len(numbers) > 10
        assert {column.tobytes() for column in numbers} == {np.full(n, np.nan).tobytes()}
