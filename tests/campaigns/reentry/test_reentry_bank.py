"""Execution of the bank against a differential equation; side and band."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from campaigns.reentry.bank import angle_at, followed, lateral_miss, side_of

number = st.floats(-2.5, 2.5)
UNLIMITED = 1e9


@given(bank=number, rate=st.floats(-0.3, 0.3), command=number, lag=st.floats(0.3, 4.0), period=st.floats(0.1, 2.0))
def test_without_a_limit_the_bank_is_a_critically_damped_lag(bank, rate, command, lag, period):
    w = 2.0 / lag
    flown = solve_ivp(
        lambda t, y: (y[1], w * w * (command - y[0]) - 2.0 * w * y[1]),
        (0.0, period),
        (bank, rate),
        rtol=1e-9,
        atol=1e-11,
    )
    assert followed(bank, rate, command, lag, UNLIMITED, period) == pytest.approx(flown.y[:, -1], abs=1e-7)


def test_a_steady_command_is_followed_late_by_the_lag():
    bank, rate, lag = 0.0, 0.0, 1.5
    for k in range(400):
        bank, rate = followed(bank, rate, 0.01 * 0.1 * (k + 0.5), lag, UNLIMITED, 0.1)
    assert 0.01 * 40.0 - bank == pytest.approx(0.01 * lag, rel=0.01)


@given(bank=number, rate=st.floats(-0.35, 0.35), command=number, lag=st.floats(0.2, 3.0), limit=st.floats(0.36, 1.0))
def test_between_samples_the_rate_goes_over_its_limit_by_less_than_a_third(bank, rate, command, lag, limit):
    period = 1.0
    end, later = followed(bank, rate, command, lag, limit, period)
    m = SimpleNamespace(sampled=5.0, bank=bank, bank_rate=rate, next_bank=end, next_rate=later)
    t = np.linspace(5.0, 6.0, 401)
    course = angle_at(t, m, period)
    assert course[0] == pytest.approx(bank, abs=1e-14)
    assert course[-1] == pytest.approx(end, abs=1e-12)
    assert np.abs(np.diff(course) / np.diff(t)).max() < 1.3 * limit
    assert abs(later) <= limit


def test_the_side_changes_only_where_the_miss_leaves_its_band():
    p = SimpleNamespace(relative_speed=8000.0, reversal_floor=1e3, reversal_width=40e3)
    fast, slow = 8000.0, 800.0
    assert side_of(1.0, 40.9e3, fast, p) == 1.0
    assert side_of(1.0, 41.1e3, fast, p) == -1.0  # too far right: lift to the left
    assert side_of(-1.0, -41.1e3, fast, p) == 1.0
    assert side_of(-1.0, 1.5e3, slow, p) == -1.0
    assert side_of(1.0, 1.5e3, slow, p) == -1.0


def test_the_lateral_miss_is_positive_where_the_flight_passes_to_the_right_of_the_target():
    radius = 6.4e6
    s = SimpleNamespace(x=radius, y=0.0, z=0.0, vx=-100.0, vy=7000.0, vz=0.0)  # east over the equator
    target = SimpleNamespace(radius=radius, tx=0.0, ty=np.cos(0.01), tz=np.sin(0.01))  # to the north: left
    assert lateral_miss(s, target) == pytest.approx(radius * np.sin(0.01), rel=1e-12)
