"""Lead compensation by frequency response, and the attitude loops that are flown with it."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from campaigns.reentry.autopilot.lead_compensator import design_lead, margins_of, short_period
from campaigns.reentry.autopilot.model import (
    STEEPEST,
    STEPS,
    air_at,
    bank_command,
    pitch_design,
    pitch_gains,
    planned_profile,
)
from campaigns.reentry.published.values import ogata_plant
from mc_engine.errors import ModelError
from mc_engine.flight.flight import fly_history, prepare, settings_of
from tests.campaigns.model_flights import ModelFlights

FLIGHTS = ModelFlights("campaigns.reentry.autopilot")
MODEL, NOMINAL, fly_one = FLIGHTS.model, FLIGHTS.nominal, FLIGHTS.one
CODES = SimpleNamespace(**{setting.symbol: setting.code(setting.default) for setting in MODEL.settings})


@pytest.fixture(scope="module")
def o():
    """The settings in flight, with the tables."""
    return settings_of(MODEL, prepare(MODEL, NOMINAL, 1).settings[0])


# ---- design


def test_a_capsule_that_the_loops_cannot_hold_is_rejected_and_a_less_unstable_one_flies():
    with pytest.raises(ModelError, match="Pa the capsule is too unstable for these loops: give a lower c_m_alpha"):
        fly_one(c_m_alpha=0.01)
    assert fly_one(c_m_alpha=0.001)["peak_alpha_deg"] < 3.0


@pytest.fixture(scope="module")
def lead():
    """For Ogata's example, 4 / (s (s + 2))."""
    return design_lead(ogata_plant, 10.0, np.radians(50.0))


def test_the_textbook_lead_has_the_margin_asked_for_at_a_higher_crossover(lead):
    margins = lead.margins(ogata_plant)
    assert 49.0 < np.degrees(margins.phase) < 52.0
    assert 8.5 < margins.crossover < 9.3
    # Ogata's rounded one: zero 4.41, pole 18.4, gain 41.7
    assert (lead.zero, lead.pole, lead.gain) == pytest.approx((4.41, 18.4, 41.7), rel=0.03)


def test_a_lead_keeps_the_gain_at_low_frequency_and_leads_most_at_its_middle(lead):
    assert abs(lead.response(1e-6)) == pytest.approx(10.0, rel=1e-9)
    alpha = lead.zero / lead.pole
    middle = np.angle(lead.response(np.sqrt(lead.zero * lead.pole)))
    assert np.sin(middle) == pytest.approx((1.0 - alpha) / (1.0 + alpha), rel=1e-12)
    for w in (0.5, 2.0):
        assert np.angle(lead.response(w * np.sqrt(lead.zero * lead.pole))) < middle


@given(stiffness=st.floats(0.0, 12.0), bandwidth=st.floats(0.2, 3.0), margin=st.floats(15.0, 60.0))
def test_the_margin_asked_for_is_reached_on_any_short_period(stiffness, bandwidth, margin):
    plant = short_period(stiffness)
    lead = design_lead(plant, bandwidth**2 + stiffness, np.radians(margin))
    assert np.degrees(lead.margins(plant).phase) > margin - 0.01
    poles = np.roots(
        np.polyadd(np.polymul([1.0, lead.pole], [1.0, 0.0, stiffness]), lead.gain * np.array([1.0, lead.zero]))
    )
    assert poles.real.max() < 0.0


def margin_at(lead, pressure, factor=1.0, inertia=1.0):
    """Phase margin [deg] of a compensator at a pressure, with other stability and inertia than assumed."""
    stiffness = -pressure * CODES.area * CODES.diameter * CODES.c_m_alpha * factor / CODES.inertia_pitch
    plant = short_period(stiffness / inertia)
    return np.degrees(margins_of(lambda w: lead.response(w) * plant(w) / inertia).phase)


def test_gains_that_follow_the_pressure_keep_the_margin_everywhere():
    pressures = np.linspace(0.0, STEEPEST, 13)
    leads = [pitch_design(CODES, q)[2] for q in pressures]
    assert min(margin_at(lead, q) for lead, q in zip(leads, pressures, strict=True)) > 49.99
    for factor, inertia in ((0.7, 1.1), (1.3, 0.9)):
        assert min(margin_at(lead, q, factor, inertia) for lead, q in zip(leads, pressures, strict=True)) > 40.0


def test_the_pitch_loop_halves_what_a_moment_does():
    """Angle over moment at rest: 1 / (gain + stiffness), without an autopilot 1 / stiffness; at large pressure."""
    _, gain, lead = pitch_design(CODES, 12e3)
    stiffness = gain - CODES.bandwidth**2
    assert lead.gain * lead.zero / lead.pole == pytest.approx(gain, rel=1e-12)
    assert stiffness / (gain + stiffness) == pytest.approx(0.5, abs=0.05)


# ---- tables


def test_the_tables_hold_the_designs_and_the_planned_entry(o):
    for k in (0, 11, STEPS - 1):
        pressure = STEEPEST * k / (STEPS - 1)
        lead = pitch_design(CODES, pressure)[2]
        assert pitch_gains(min(pressure, STEEPEST * (1.0 - 1e-9)), o) == pytest.approx(
            (lead.gain, lead.zero, lead.pole), rel=1e-4
        )
    profile = planned_profile()
    p = SimpleNamespace(pressure_factor=1.1)
    for second in (0, 250, 400):
        pressure, speed = air_at(float(second), p, o)
        assert (pressure, speed) == pytest.approx((1.1 * profile[second, 0], profile[second, 1]), rel=1e-12)
    assert 11e3 < profile[:, 0].max() < 14e3


def test_the_command_reverses_every_period_at_its_rate():
    p = SimpleNamespace(reversal_period=60.0, commanded_rate=0.2, bank_amplitude=1.0)
    t = np.linspace(0.0, 240.0, 9601)
    command = bank_command(t, p)
    assert np.abs(np.diff(command)).max() <= 0.2 * (t[1] - t[0]) * (1.0 + 1e-9)
    assert [bank_command(x, p) for x in (30.0, 59.0, 61.0, 90.0, 150.0)] == pytest.approx([1.0, 0.2, -0.2, -1.0, 1.0])


# ---- flight


def twin(inputs, duration, o):
    """State at the end by scipy, the compensators as second-order equations of the error."""
    profile = planned_profile()
    seconds = np.arange(len(profile))
    i = NOMINAL | inputs
    pitch, roll = 7000.0 * i["inertia_pitch_factor"], 8000.0 * i["inertia_roll_factor"]
    bank = design_lead(short_period(0.0), CODES.bandwidth**2, CODES.phase_margin)
    command = SimpleNamespace(reversal_period=60.0, commanded_rate=np.radians(10.0), bank_amplitude=np.radians(60.0))

    def rates(t, y):
        a, da, b, db, xa, xb = y
        q = np.interp(t, seconds, profile[:, 0]) * i["pressure_factor"]
        v = np.interp(t, seconds, profile[:, 1])
        k, zero, pole = pitch_gains(q, o)
        error = bank_command(t, command) - b
        m = np.clip(7000.0 * k * (-a + xa), -2000.0, 2000.0)
        n = np.clip(8000.0 * bank.gain * (error + xb), -2000.0, 2000.0)
        lever = q * 12.017 * 3.912
        static = -0.06 * i["c_m_alpha_factor"] * (a - np.radians(i["trim_offset_deg"]))
        return [
            da,
            (lever * (static + i["c_mq"] * 3.912 * da / (2.0 * v)) + m) / pitch,
            db,
            (q * 12.017 * 1.3 * i["side_offset_m"] + n) / roll,
            -pole * xa - (zero - pole) * a,
            -bank.pole * xb + (bank.zero - bank.pole) * error,
        ]

    start = np.radians([i["initial_alpha_deg"], 0.0, 0.0, 0.0, 0.0, 0.0])
    return np.degrees(solve_ivp(rates, (0.0, duration), start, rtol=1e-8, atol=1e-11, max_step=0.5).y[:, -1])


def test_a_flight_is_that_of_a_twin(o):
    inputs = {
        "trim_offset_deg": 1.5, "side_offset_m": 0.003, "c_mq": 0.3, "c_m_alpha_factor": 1.2, "pressure_factor": 1.1,
        "inertia_pitch_factor": 0.95, "inertia_roll_factor": 1.05, "initial_alpha_deg": 4.0,
    }  # fmt: skip
    duration = 243.0  # in the middle of a reversal
    row = fly_one(**inputs, duration_s=duration)
    expected = twin(inputs, duration, o)
    names = ("alpha_deg", "alpha_rate_deg_s", "bank_deg", "bank_rate_deg_s", "lead_alpha_deg", "lead_bank_deg")
    assert [row[f"end_{name}"] for name in names] == pytest.approx(expected, abs=2e-3)


def test_an_offset_trim_is_held_to_half_of_it_by_gains_that_follow_and_hardly_by_others():
    followed = fly_one(trim_offset_deg=2.0, initial_alpha_deg=0.0)
    fixed = fly_one(trim_offset_deg=2.0, initial_alpha_deg=0.0, scheduled=False)
    assert followed["peak_alpha_deg"] == pytest.approx(1.0, abs=0.1)
    assert fixed["peak_alpha_deg"] > 1.6


def test_an_unstable_oscillation_dies_out_with_the_autopilot_and_grows_without():
    wild = {"c_mq": 3.0, "initial_alpha_deg": 0.1, "trim_offset_deg": 0.0}
    assert fly_one(**wild)["final_alpha_deg"] == pytest.approx(0.0, abs=0.01)
    assert fly_one(**wild, torque_pitch_n_m=0.0)["peak_alpha_deg"] > 0.3


def test_too_small_a_torque_stands_at_its_limit():
    weak = fly_one(torque_roll_n_m=100.0)
    assert weak["limited_share"] > 0.05
    assert weak["peak_bank_error_deg"] > fly_one()["peak_bank_error_deg"]


def test_the_impulse_is_the_integral_of_the_torques():
    row, seen = fly_history(MODEL, NOMINAL | {"trim_offset_deg": 1.0}, 0, 1, rows=26_000)
    total = np.trapezoid(np.abs(seen["torque_pitch_n_m"]) + np.abs(seen["torque_roll_n_m"]), seen["t_s"])
    assert row["impulse_n_m_s"][0] == pytest.approx(total, rel=2e-3)
    assert row["peak_bank_error_deg"][0] == pytest.approx(seen["bank_error_deg"].max(), rel=1e-6)
