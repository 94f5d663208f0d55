"""Attitude autopilot of an entering capsule: pitch about trim and bank, each with a lead compensator.  A model.

The capsule flies the planned entry's dynamic pressure and speed; its attitude does not change that path.  Pitch is the
short period about trim, I a'' = q S d [C_ma (a - offset) + C_mq d a' / (2 V)] + M, bank turns freely under its torque.
Both torques are limited.  The pitch gains follow the dynamic pressure.
"""

from collections import namedtuple
from types import SimpleNamespace

import numpy as np

from campaigns.reentry.autopilot.gains import (
    BANK_GAIN,
    BANK_POLE,
    BANK_ZERO,
    LAST_SECOND,
    PROFILE,
    SCHEDULE,
    STEEPEST,
    STEPS,
    autopilot_tables,
)
from mc_engine.lanes import floor, look_up, maximum, minimum, physics, sqrt, where
from mc_engine.model import Extremum, Field, FixedStep, Model, Parameter, Refusals, Setting
from mc_engine.model.figures import HistoryFigure, ScatterFigure

# alpha: angle of attack less that of trim; lead_..: states of the compensators; then integrals of squared errors, of
# the size of the torques, and of the time at their limits
State = namedtuple(
    "State", "alpha alpha_rate bank bank_rate lead_alpha lead_bank alpha_square bank_square impulse limited"
)
Parameters = namedtuple(
    "Parameters",
    "alpha alpha_rate bank moment damping offset roll_moment pressure known torque_pitch torque_roll inverse_pitch "
    "inverse_roll amplitude period bank_rate",
)
Quantities = namedtuple("Quantities", "alpha bank command pressure alpha_size bank_error torque_pitch torque_roll")
Metrics = namedtuple(
    "Metrics",
    "peak_alpha peak_alpha_time late_alpha_time alpha_rms peak_bank_error bank_rms impulse limited final_alpha",
)


def prepare(i: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Kernel parameters of each case, SI: coefficients over its inertia, torques, errors."""
    pitch, roll = settings.inertia_pitch * i.inertia_pitch_factor, settings.inertia_roll * i.inertia_roll_factor
    lever = settings.area * settings.diameter / pitch
    return {
        "alpha": i.initial_alpha,
        "alpha_rate": i.initial_alpha_rate,
        "bank": i.initial_bank,
        "moment": lever * settings.c_m_alpha * i.c_m_alpha_factor,
        "damping": 0.5 * lever * settings.diameter * i.c_mq,
        "offset": i.trim_offset,
        "roll_moment": settings.area * i.side_force_coefficient * i.side_offset / roll,
        "pressure": i.pressure_factor,
        "known": i.pressure_known_factor,
        "torque_pitch": i.torque_pitch,
        "torque_roll": i.torque_roll,
        "inverse_pitch": 1.0 / pitch,
        "inverse_roll": 1.0 / roll,
        "amplitude": i.bank_amplitude,
        "period": i.reversal_period,
        "bank_rate": i.commanded_rate,
    }


@physics
def initial(p, o):
    """At entry, compensators at rest."""
    zero = 0.0 * p.alpha
    return State(
        alpha=p.alpha,
        alpha_rate=p.alpha_rate,
        bank=p.bank,
        bank_rate=zero,
        lead_alpha=zero,
        lead_bank=zero,
        alpha_square=zero,
        bank_square=zero,
        impulse=zero,
        limited=zero,
    )


@physics
def air_at(t, p, o):
    """(dynamic pressure [Pa], speed [m/s]) of the planned entry, the pressure of the day on it."""
    at = minimum(maximum(t + 0.0 * p.pressure, 0.0), look_up(o.tables, LAST_SECOND) - 1e-6)
    second = floor(at)
    x, row = at - second, PROFILE + 2.0 * second
    q0, q1 = look_up(o.tables, row), look_up(o.tables, row + 2.0)
    v0, v1 = look_up(o.tables, row + 1.0), look_up(o.tables, row + 3.0)
    return p.pressure * (q0 + x * (q1 - q0)), v0 + x * (v1 - v0)


@physics
def pitch_gains(pressure, o):
    """(gain, zero, pole) of the pitch compensator at the dynamic pressure [Pa] that the autopilot knows."""
    place = minimum(maximum(pressure * ((STEPS - 1) / STEEPEST), 0.0), STEPS - 1.000001)
    step = floor(place)
    x, row = place - step, SCHEDULE + 3.0 * step
    a0, b0 = look_up(o.tables, row), look_up(o.tables, row + 3.0)
    a1, b1 = look_up(o.tables, row + 1.0), look_up(o.tables, row + 4.0)
    a2, b2 = look_up(o.tables, row + 2.0), look_up(o.tables, row + 5.0)
    return a0 + x * (b0 - a0), a1 + x * (b1 - a1), a2 + x * (b2 - a2)


@physics
def bank_command(t, p):
    """Commanded bank [rad]: reversals from one side to the other, half a period after entry and every period on."""
    number = floor(t / p.period + 0.5)
    since = t - p.period * number
    side = where(number - 2.0 * floor(0.5 * number) < 0.5, 1.0, -1.0)
    return side * minimum(maximum(p.bank_rate * since, -p.amplitude), p.amplitude)


@physics
def torques(t, s, p, o, pressure):
    """(pitch torque, roll torque [N m] within their limits, bank error, rates of both compensators, at a limit)."""
    gain, zero, pole = pitch_gains(p.known * pressure, o)
    error = bank_command(t, p) - s.bank
    bank_zero, bank_pole = look_up(o.tables, BANK_ZERO), look_up(o.tables, BANK_POLE)
    wanted_pitch = o.inertia_pitch * gain * (s.lead_alpha - s.alpha)
    wanted_roll = o.inertia_roll * look_up(o.tables, BANK_GAIN) * (s.lead_bank + error)
    pitch = minimum(maximum(wanted_pitch, -p.torque_pitch), p.torque_pitch)
    roll = minimum(maximum(wanted_roll, -p.torque_roll), p.torque_roll)
    # (s + z) / (s + p) = 1 + (z - p) / (s + p)
    lead_alpha = -pole * s.lead_alpha - (zero - pole) * s.alpha
    lead_bank = -bank_pole * s.lead_bank + (bank_zero - bank_pole) * error
    limited = where((pitch != wanted_pitch) | (roll != wanted_roll), 1.0, 0.0)
    return pitch, roll, error, lead_alpha, lead_bank, limited


@physics
def rhs(t, s, m, p, o):
    """Short period about trim and free roll under limited torques, SI and radians.

    I a'' = q S d [C_ma (a - offset) + C_mq d a' / (2 V)] + M: pitch about trim with linear coefficients, derived here;
    the bank is a double integrator.
    """
    pressure, speed = air_at(t, p, o)
    pitch, roll, error, lead_alpha, lead_bank, limited = torques(t, s, p, o, pressure)
    air = pressure * (p.moment * (s.alpha - p.offset) + p.damping * s.alpha_rate / speed)
    return State(
        alpha=s.alpha_rate,
        alpha_rate=air + pitch * p.inverse_pitch,
        bank=s.bank_rate,
        bank_rate=pressure * p.roll_moment + roll * p.inverse_roll,
        lead_alpha=lead_alpha,
        lead_bank=lead_bank,
        alpha_square=s.alpha * s.alpha,
        bank_square=error * error,
        impulse=abs(pitch) + abs(roll),
        limited=limited,
    )


@physics
def observe(t, s, m, p, o):
    """The quantities in the order of QUANTITIES, SI and radians."""
    pressure, _ = air_at(t, p, o)
    pitch, roll, error, _, _, _ = torques(t, s, p, o, pressure)
    return Quantities(
        s.alpha, s.bank, bank_command(t, p) + 0.0 * s.bank, pressure, abs(s.alpha), abs(error), pitch, roll
    )


@physics
def evaluate(t, s, m, p, o, best, when):
    """The metrics in the order of METRICS, SI and radians; means over the flight from integrals of squares."""
    return Metrics(
        peak_alpha=best.alpha,
        peak_alpha_time=when.alpha,
        late_alpha_time=when.late,
        alpha_rms=sqrt(s.alpha_square / t),
        peak_bank_error=best.bank,
        bank_rms=sqrt(s.bank_square / t),
        impulse=s.impulse,
        limited=s.limited / t,
        final_alpha=s.alpha,
    )


PARAMETERS = (
    Parameter("initial_alpha_deg", "deg", "first angle of attack less that of trim", 2.0, -30.0, 30.0),
    Parameter("initial_alpha_rate_deg_s", "deg/s", "its first rate", 0.0),
    Parameter("initial_bank_deg", "deg", "first bank", 0.0, -180.0, 180.0),
    Parameter("inertia_pitch_factor", "", "true over assumed moment of inertia in pitch", 1.0, low=1e-3),
    Parameter("inertia_roll_factor", "", "true over assumed moment of inertia in roll", 1.0, low=1e-3),
    Parameter("c_m_alpha_factor", "", "true over assumed static stability", 1.0),
    Parameter("c_mq", "", "pitch damping by d rate / (2 V): above zero it drives the oscillation", -0.2),
    Parameter("trim_offset_deg", "deg", "true less assumed trim angle of attack, as by an offset centre of mass", 0.0),
    Parameter("side_offset_m", "m", "offset of the centre of mass to the side", 0.0),
    Parameter("side_force_coefficient", "", "force coefficient that turns this offset into a roll moment", 1.3),
    Parameter("pressure_factor", "", "true over planned dynamic pressure", 1.0, low=0.0),
    Parameter("pressure_known_factor", "", "dynamic pressure that sets the gains over the true one", 1.0, low=0.0),
    Parameter("torque_pitch_n_m", "N m", "largest torque in pitch", 2000.0, low=0.0),
    Parameter("torque_roll_n_m", "N m", "largest torque in roll", 2000.0, low=0.0),
    Parameter("bank_amplitude_deg", "deg", "commanded bank to either side", 60.0, low=0.0, high=180.0),
    Parameter("reversal_period_s", "s", "time from one commanded reversal to the next", 60.0, low=1.0),
    Parameter("commanded_rate_deg_s", "deg/s", "rate of a commanded reversal", 10.0, low=1e-3),
)
SETTINGS = (
    Setting("inertia_pitch_kg_m2", "kg m^2", "assumed moment of inertia in pitch", 7000.0, low=1.0),
    Setting("inertia_roll_kg_m2", "kg m^2", "assumed moment of inertia in roll", 8000.0, low=1.0),
    Setting("area_m2", "m^2", "reference area", 12.017, low=1e-3),
    Setting("diameter_m", "m", "reference length", 3.912, low=1e-3),
    Setting("c_m_alpha", "", "assumed static stability per radian, negative if stable", -0.06),
    Setting("phase_margin_deg", "deg", "phase margin of both loops", 50.0, low=5.0, high=75.0),
    Setting("bandwidth_rad_s", "rad/s", "root of both loops' gain without air", 0.7, low=0.05, high=10.0),
    Setting("scheduled", "", "pitch gains follow the dynamic pressure", True),
    Setting("fixed_pressure_pa", "Pa", "dynamic pressure whose gains are used if they do not follow it", 0.0, low=0.0),
    Setting("duration_s", "s", "length of the flight", 520.0, low=1.0, high=800.0),
    Setting("step_s", "s", "integration step", 0.02, low=1e-4, high=0.2),
)
STATES = (
    Field("alpha_deg", "deg", "angle of attack less that of trim"),
    Field("alpha_rate_deg_s", "deg/s", "its rate"),
    Field("bank_deg", "deg", "bank"),
    Field("bank_rate_deg_s", "deg/s", "rate of the bank"),
    Field("lead_alpha_deg", "deg", "state of the pitch compensator"),
    Field("lead_bank_deg", "deg", "state of the bank compensator"),
    Field("alpha_square", "", "integral of the squared angle of attack error, rad^2 s"),
    Field("bank_square", "", "integral of the squared bank error, rad^2 s"),
    Field("impulse_n_m_s", "N m s", "integral of the size of both torques"),
    Field("limited_s", "s", "time with a torque at its limit"),
)
QUANTITIES = (
    Field("alpha_deg", "deg", "angle of attack less that of trim"),
    Field("bank_deg", "deg", "bank"),
    Field("bank_command_deg", "deg", "commanded bank"),
    Field("dynamic_pressure_pa", "Pa", "dynamic pressure"),
    Field("alpha_size_deg", "deg", "size of the angle of attack error"),
    Field("bank_error_deg", "deg", "size of the bank error"),
    Field("torque_pitch_n_m", "N m", "torque in pitch"),
    Field("torque_roll_n_m", "N m", "torque in roll"),
)
METRICS = (
    Field("peak_alpha_deg", "deg", "largest angle of attack error"),
    Field("peak_alpha_time_s", "s", "when"),
    Field("late_alpha_time_s", "s", "last time with an angle of attack error above one degree"),
    Field("alpha_rms_deg", "deg", "root mean square of the angle of attack error"),
    Field("peak_bank_error_deg", "deg", "largest bank error"),
    Field("bank_rms_deg", "deg", "root mean square of the bank error"),
    Field("impulse_n_m_s", "N m s", "integral of the size of both torques"),
    Field("limited_share", "", "share of the time with a torque at its limit"),
    Field("final_alpha_deg", "deg", "angle of attack error at the end"),
)
MODEL = Model(
    name="reentry_autopilot",
    title="Attitude autopilot of an entering capsule",
    source="K. Ogata, Modern Control Engineering: lead compensation by the frequency-response approach",
    parameters=PARAMETERS,
    settings=SETTINGS,
    states=STATES,
    quantities=QUANTITIES,
    metrics=METRICS,
    clock=FixedStep("step", "duration"),
    kernel_parameters=Parameters,
    prepare=prepare,
    initial=initial,
    rhs=rhs,
    tables=autopilot_tables,
    observe=observe,
    evaluate=evaluate,
    extrema=(
        Extremum("alpha", "alpha_size_deg", smooth=False),  # corners where the error goes through zero
        Extremum("late", "alpha_size_deg", "last_above", float(np.radians(1.0))),
        Extremum("bank", "bank_error_deg", smooth=False),
    ),
    figures=(
        HistoryFigure(("alpha_deg", "bank_deg", "bank_command_deg"), "Angle of attack error, bank and its command"),
        HistoryFigure(("dynamic_pressure_pa", "torque_pitch_n_m", "torque_roll_n_m"), "Dynamic pressure and torques"),
        ScatterFigure("peak_alpha_deg", "impulse_n_m_s", "Torque impulse and largest angle of attack error"),
    ),
)
