"""Running extrema along a flight against closed forms."""

import numpy as np
import pytest
from flown_models import CORNERS, FOLDER, OSCILLATOR, flown, inputs_of

from mc_engine.flight.flight import fly_history
from mc_engine.lanes.adaptive_step import arm
from mc_engine.lanes.extrema import PEAK, crest, crest_time, crest_value

RANDOM = np.random.default_rng(5)
AMPLITUDE, PHASE, RATE = RANDOM.uniform(0.5, 2.0, 60), RANDOM.uniform(0.2, 6.0, 60), RANDOM.uniform(0.3, 2.0, 60)
# x = amplitude * cos(rate t - phase), seen for ten seconds
SWINGS = {
    "rate_rad_s": RATE,
    "x0_km": AMPLITUDE * np.cos(PHASE),
    "v0_m_s": 1e3 * AMPLITUDE * RATE * np.sin(PHASE),
}


def place(t):
    return AMPLITUDE * np.cos(RATE * t - PHASE)


@pytest.fixture(scope="module")
def columns():
    return flown(OSCILLATOR, **SWINGS, step_s=0.05)


def test_the_largest_value_between_two_steps_is_that_of_the_crest(columns):
    crests = PHASE / RATE < 9.9
    assert crests.sum() > 40
    np.testing.assert_allclose(columns["top_km"][crests], AMPLITUDE[crests], rtol=2e-6)


def test_without_a_crest_the_largest_value_is_at_an_end_of_the_flight(columns):
    rising = PHASE / RATE > 10.1
    assert rising.sum() > 2
    ends = np.maximum(place(0.0), place(10.0))[rising]
    np.testing.assert_allclose(columns["top_km"][rising], ends, rtol=1e-6)
    np.testing.assert_array_equal(
        columns["top_time_s"][rising], np.where(place(10.0) > place(0.0), columns["end_time_s"], 0.0)[rising]
    )


def test_the_smallest_value_mirrors_the_largest():
    up = flown(OSCILLATOR, **SWINGS)
    down = flown(OSCILLATOR, **{**SWINGS, "x0_km": -SWINGS["x0_km"], "v0_m_s": -SWINGS["v0_m_s"]})
    np.testing.assert_array_equal(up["top_km"], -down["bottom_km"])
    np.testing.assert_array_equal(up["top_time_s"], down["bottom_time_s"])


def test_a_quantity_with_corners_never_exceeds_its_values_at_the_steps(columns):
    for case in range(0, 60, 6):
        one = {name: float(value[case]) for name, value in SWINGS.items()} | {"step_s": 0.05}
        _, history = fly_history(OSCILLATOR, inputs_of(OSCILLATOR, one), case, 1, folder=FOLDER, width=8)
        at = int(np.argmax(history["x_km"]))
        assert columns["sampled_top_km"][case] == history["x_km"][at]
        assert columns["sampled_top_time_s"][case] == history["t_s"][at]
    assert (columns["sampled_top_km"] <= columns["top_km"]).all()


def test_an_extreme_never_goes_beyond_a_corner_or_a_jump():
    # steps of 0.25: the wave stays above its limit, and the relay on one side, for more than eight steps
    phases = RANDOM.uniform(0.0, 6.0, 200)
    # a limit that is left in the first two steps, or reached in the last two before 12, is not told from a crest
    left, reached = 5 * np.pi / 6 - phases, phases + 12.0 - np.pi / 6
    phases = phases[(left % (2 * np.pi) > 0.5) & (reached % (2 * np.pi) > 0.5)]
    columns = flown(CORNERS, phase_rad=phases)
    np.testing.assert_array_equal(columns["limited_top"], 1.0)
    np.testing.assert_array_equal(columns["relay_top"], 1.0)
    np.testing.assert_array_equal(columns["relay_bottom"], -1.0)
    half_turns = columns["saw_top"] / 0.25  # it is looked at once a step, and grows by a step from look to look
    np.testing.assert_allclose(half_turns, np.round(half_turns), rtol=1e-12)
    assert (np.abs(half_turns - 12.0) <= 1.0).all()
    np.testing.assert_allclose(columns["wave_top"], 2.0, rtol=1e-4)  # beside them, the curve through the steps: 8e-3


def test_the_last_time_above_a_level_is_where_the_value_falls_through_it():
    # cos(t) in ten seconds stands above 0.5 for the last time at 2 pi + pi / 3
    columns = flown(OSCILLATOR, step_s=0.01)
    assert columns["late_time_s"][0] == pytest.approx(2 * np.pi + np.pi / 3, abs=1e-5)


@pytest.mark.parametrize(("until", "last"), [(7.0, 7.0), (1.0, 1.0), (5.0, np.pi / 3), (9.0, 2 * np.pi + np.pi / 3)])
def test_a_value_above_the_level_at_the_end_is_above_it_until_then(until, last):
    columns = flown(OSCILLATOR, step_s=0.01, until_s=until)
    assert columns["late_time_s"][0] == pytest.approx(last, abs=1e-5)


@pytest.mark.parametrize("last_step", [1.0, 0.5, 1e-3, 1e-9])
def test_the_crest_of_three_points_of_a_parabola_is_exact_however_short_the_last_step(last_step):
    # an event cuts a step short: the third point may lie close to the second
    times = (0.0, 1.0, 1.0 + last_step)
    values = [5.0 - (t - 1.0 - 0.25 * last_step) ** 2 for t in times]
    assert crest(*values, 0.0)
    assert crest_value(0.0, 0.0, *values, *times, 1.0, True) == pytest.approx(5.0, rel=1e-15)
    found = crest_time(0.0, 0.0, *values, *times, 1.0, True)
    assert found == pytest.approx(1.0 + 0.25 * last_step, abs=max(1e-7 * last_step, 1e-15 / last_step))


def test_a_top_late_in_a_step_that_begins_flat_may_beat_the_best_so_far():
    # t^4 (5 - 4 t) + t / 1000 tops 1 between 0 and 1.1, where its tangents meet behind the step
    end, rate = 1.1**4 * 0.6 + 1.1e-3, -2.0 * 1.1**3 + 1e-3
    assert arm(PEAK, 1e-3, 0.0, rate, end, 0.9, 1.1) == 1.0
    # the rounding of a rate beside a value that stays
    assert arm(PEAK, 1e-11, 1.0, -3e-11, 1.0, 0.9999, 1.1) == 1.0  # beats the best so far
    assert arm(PEAK, 1e-11, 1.0, -3e-11, 1.0 - 1e-10, 1.5, 1.1) == 0.0
    # t (1 - t) between 0 and 1: they meet at 0.5, and bound its top of 0.25
    assert [float(arm(PEAK, 1.0, 0.0, -1.0, 0.0, best, 1.0)) for best in (0.49, 0.51)] == [1.0, 0.0]
