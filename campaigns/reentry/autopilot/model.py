"""Attitude autopilot of an entering capsule: pitch about trim and bank, each with a lead compensator.  A model.

The capsule flies the planned entry's dynamic pressure and speed; its attitude does not change that path.  Pitch is the
short period about trim, I a'' = q S d [C_ma (a - offset) + C_mq d a' / (2 V)] + M, bank turns freely under its torque.
Both torques are limited.  The pitch gains follow the dynamic pressure.
"""

from collections import namedtuple
from types import SimpleNamespace
from typing import Any

import numpy as np

from campaigns.reentry.autopilot.lead_compensator import Compensator, Response, design_lead, short_period
from campaigns.reentry.guidance.plan import plan_of
from campaigns.reentry.guidance.reference import SPEED, fly_reference
from campaigns.reentry.guidance.reference_table import between_rows
from mc_engine.errors import ModelError
from mc_engine.lanes import floor, look_up, look_up_record, maximum, merged, minimum, physics, replace, sqrt, where
from mc_engine.model import (
    Field,
    FixedStep,
    Parameter,
    Refusals,
    Setting,
    at_end,
    inputs,
    last_above,
    maximum_of,
    metrics,
    model,
    outputs,
    prepared,
    states,
    time_of_maximum,
)
from mc_engine.model.figures import HistoryFigure, ScatterFigure

Inputs = inputs(
    initial_alpha_deg=Parameter(2.0, "first angle of attack less that of trim", low=-30.0, high=30.0),
    initial_alpha_rate_deg_s=Parameter(0.0, "its first rate"),
    initial_bank_deg=Parameter(0.0, "first bank", low=-180.0, high=180.0),
    inertia_pitch_factor=Parameter(1.0, "true over assumed moment of inertia in pitch", low=1e-3, unit=""),
    inertia_roll_factor=Parameter(1.0, "true over assumed moment of inertia in roll", low=1e-3, unit=""),
    c_m_alpha_factor=Parameter(1.0, "true over assumed static stability", unit=""),
    c_mq=Parameter(-0.2, "pitch damping by d rate / (2 V): above zero it drives the oscillation", unit=""),
    trim_offset_deg=Parameter(0.0, "true less assumed trim angle of attack, as by an offset centre of mass"),
    side_offset_m=Parameter(0.0, "offset of the centre of mass to the side"),
    side_force_coefficient=Parameter(1.3, "force coefficient that turns this offset into a roll moment", unit=""),
    pressure_factor=Parameter(1.0, "true over planned dynamic pressure", low=0.0, unit=""),
    pressure_known_factor=Parameter(1.0, "dynamic pressure that sets the gains over the true one", low=0.0, unit=""),
    torque_pitch_n_m=Parameter(2000.0, "largest torque in pitch", low=0.0, unit="N m"),
    torque_roll_n_m=Parameter(2000.0, "largest torque in roll", low=0.0, unit="N m"),
    bank_amplitude_deg=Parameter(60.0, "commanded bank to either side", low=0.0, high=180.0),
    reversal_period_s=Parameter(60.0, "time from one commanded reversal to the next", low=1.0),
    commanded_rate_deg_s=Parameter(10.0, "rate of a commanded reversal", low=1e-3),
    inertia_pitch_kg_m2=Setting(7000.0, "assumed moment of inertia in pitch", low=1.0, unit="kg m^2"),
    inertia_roll_kg_m2=Setting(8000.0, "assumed moment of inertia in roll", low=1.0, unit="kg m^2"),
    area_m2=Setting(12.017, "reference area", low=1e-3),
    diameter_m=Setting(3.912, "reference length", low=1e-3),
    c_m_alpha=Setting(-0.06, "assumed static stability per radian, negative if stable", unit=""),
    phase_margin_deg=Setting(50.0, "phase margin of both loops", low=5.0, high=75.0),
    bandwidth_rad_s=Setting(0.7, "root of both loops' gain without air", low=0.05, high=10.0),
    scheduled=Setting(True, "pitch gains follow the dynamic pressure"),
    fixed_pressure_pa=Setting(0.0, "dynamic pressure whose gains are used if they do not follow it", low=0.0),
    duration_s=Setting(520.0, "length of the flight", low=1.0, high=800.0),
    step_s=Setting(0.02, "integration step", low=1e-4, high=0.2),
)
# lead_..: states of the compensators; then integrals of squared errors, of the size of the torques, and of the time at
# their limits
State = states(
    alpha_deg="angle of attack less that of trim",
    alpha_rate_deg_s="its rate",
    bank_deg="bank",
    bank_rate_deg_s="rate of the bank",
    lead_alpha_deg="state of the pitch compensator",
    lead_bank_deg="state of the bank compensator",
    alpha_square=Field("integral of the squared angle of attack error, rad^2 s", unit=""),
    bank_square=Field("integral of the squared bank error, rad^2 s", unit=""),
    impulse_n_m_s="integral of the size of both torques",
    limited_s="time with a torque at its limit",
)
Outputs = outputs(
    alpha_deg="angle of attack less that of trim",
    bank_deg="bank",
    bank_command_deg="commanded bank",
    dynamic_pressure_pa="dynamic pressure",
    alpha_size_deg="size of the angle of attack error",
    bank_error_deg="size of the bank error",
    torque_pitch_n_m=Field("torque in pitch", unit="N m"),
    torque_roll_n_m=Field("torque in roll", unit="N m"),
)
# corners where the errors go through zero
Metrics = metrics(
    peak_alpha_deg=maximum_of("alpha_size_deg", "largest angle of attack error", smooth=False),
    peak_alpha_time_s=time_of_maximum("alpha_size_deg", "time of the largest angle of attack error", smooth=False),
    late_alpha_time_s=last_above(
        "alpha_size_deg", float(np.radians(1.0)), "last time with an angle of attack error above one degree"
    ),
    alpha_rms_deg="root mean square of the angle of attack error",
    peak_bank_error_deg=maximum_of("bank_error_deg", "largest bank error", smooth=False),
    bank_rms_deg="root mean square of the bank error",
    impulse_n_m_s="integral of the size of both torques",
    limited_share=Field("share of the time with a torque at its limit", unit=""),
    final_alpha_deg=at_end("alpha_deg", "angle of attack error at the end"),
)
# states and outputs that both loops give, by their names
Loops = namedtuple("Loops", "torque_pitch torque_roll bank_error lead_alpha lead_bank limited")

# The tables: last second of the profile, compensator of the bank loop, those of the pitch loop at equal steps of
# pressure, and the profile: dynamic pressure and speed of the planned entry second by second; SI.
STEPS, STEEPEST = 48, 24e3  # compensators of the pitch loop, up to this pressure [Pa]
LAST_SECOND, BANK, PITCH = 0, 1, 4
PROFILE = PITCH + 3 * STEPS


def pitch_design(o: Any, pressure: float) -> tuple[Response, float, Compensator]:
    """(plant, gain, lead compensator) of the pitch loop at a dynamic pressure [Pa]; o: settings by symbol.

    The plant is undamped: angle over angular acceleration.  The gain makes the loop stiffer than the air by the square
    of the bandwidth asked for, and as stiff again: a moment moves the angle half as far as without an autopilot.
    """
    stiffness = -pressure * o.area * o.diameter * o.c_m_alpha / o.inertia_pitch
    plant, gain = short_period(stiffness), o.bandwidth**2 + stiffness
    if gain <= -stiffness:  # the loop would not even hold the angle against the air
        raise ModelError(
            f"at a dynamic pressure of {pressure:.0f} Pa the capsule is too unstable for these loops: give a lower "
            "c_m_alpha, which is negative if stable, or more bandwidth_rad_s"
        )
    return plant, gain, design_lead(plant, gain, o.phase_margin)


def planned_profile() -> np.ndarray:
    """float64[n, 2]: dynamic pressure [Pa] and speed [m/s] of the planned entry at whole seconds."""
    plan = plan_of()
    path = fly_reference(plan)
    t = np.arange(0.0, path.t[-1])
    return np.array([np.interp(t, path.t, path.drag) / plan.drag, np.interp(t, path.t, path.state[SPEED])]).T


def autopilot_tables(o: Any) -> np.ndarray:
    """What the autopilot's flight reads, for its settings o, SI."""
    pressures = np.linspace(0.0, STEEPEST, STEPS) if o.scheduled > 0.5 else np.full(STEPS, o.fixed_pressure)
    # the plant of the bank loop is the double integrator 1/s^2
    bank = design_lead(short_period(0.0), o.bandwidth**2, o.phase_margin)
    leads = [bank, *(pitch_design(o, pressure)[2] for pressure in pressures)]
    profile = planned_profile()
    return np.concatenate([[len(profile) - 1], np.ravel(leads), np.ravel(profile)])


def prepare(i: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Kernel parameters of each case, SI: the inputs, and coefficients over its inertia."""
    pitch, roll = settings.inertia_pitch * i.inertia_pitch_factor, settings.inertia_roll * i.inertia_roll_factor
    lever = settings.area * settings.diameter / pitch
    return vars(i) | {
        "moment": lever * settings.c_m_alpha * i.c_m_alpha_factor,
        "damping": 0.5 * lever * settings.diameter * i.c_mq,
        "roll_moment": settings.area * i.side_force_coefficient * i.side_offset / roll,
        "inverse_pitch": 1.0 / pitch,
        "inverse_roll": 1.0 / roll,
    }


@physics
def initial(p):
    """At entry, compensators at rest."""
    return State(
        alpha=p.initial_alpha, alpha_rate=p.initial_alpha_rate, bank=p.initial_bank, bank_rate=0.0, lead_alpha=0.0,
        lead_bank=0.0, alpha_square=0.0, bank_square=0.0, impulse=0.0, limited=0.0,
    )  # fmt: skip


@physics
def air_at(t, p, o):
    """(dynamic pressure [Pa], speed [m/s]) of the planned entry, the pressure of the day on it."""
    at = minimum(maximum(t, 0.0), look_up(o.tables, LAST_SECOND) - 1e-6)
    second = floor(at)
    x, row = at - second, PROFILE + 2.0 * second
    return p.pressure_factor * between_rows(o.tables, row, 2.0, x), between_rows(o.tables, row + 1.0, 2.0, x)


@physics
def pitch_gains(pressure, o):
    """The `Compensator` of the pitch loop at the dynamic pressure [Pa] that the autopilot knows."""
    place = minimum(maximum(pressure * ((STEPS - 1) / STEEPEST), 0.0), STEPS - 1.000001)
    step = floor(place)
    x, row = place - step, PITCH + 3.0 * step
    gain, zero = between_rows(o.tables, row, 3.0, x), between_rows(o.tables, row + 1.0, 3.0, x)
    return Compensator(gain, zero, pole=between_rows(o.tables, row + 2.0, 3.0, x))


@physics
def bank_command(t, p):
    """Commanded bank [rad]: reversals from one side to the other, half a period after entry and every period on."""
    number = floor(t / p.reversal_period + 0.5)
    since = t - p.reversal_period * number
    side = where(number - 2.0 * floor(0.5 * number) < 0.5, 1.0, -1.0)
    return side * minimum(maximum(p.commanded_rate * since, -p.bank_amplitude), p.bank_amplitude)


@physics
def loops(t, s, p, o, pressure):
    """The `Loops`, SI and radians: torques within their limits, rates of both compensators, the bank error."""
    error = bank_command(t, p) - s.bank
    follow, turn = pitch_gains(p.pressure_known_factor * pressure, o), look_up_record(o.tables, BANK, Compensator)
    wanted_pitch = o.inertia_pitch * follow.gain * (s.lead_alpha - s.alpha)
    wanted_roll = o.inertia_roll * turn.gain * (s.lead_bank + error)
    pitch = minimum(maximum(wanted_pitch, -p.torque_pitch), p.torque_pitch)
    roll = minimum(maximum(wanted_roll, -p.torque_roll), p.torque_roll)
    return Loops(
        torque_pitch=pitch,
        torque_roll=roll,
        bank_error=error,
        # (s + z) / (s + p) = 1 + (z - p) / (s + p)
        lead_alpha=-follow.pole * s.lead_alpha - (follow.zero - follow.pole) * s.alpha,
        lead_bank=-turn.pole * s.lead_bank + (turn.zero - turn.pole) * error,
        limited=where((pitch != wanted_pitch) | (roll != wanted_roll), 1.0, 0.0),
    )


@physics
def rhs(t, s, p, o):
    """Short period about trim with linear coefficients, derived here, and free roll, SI and radians; see the head."""
    pressure, speed = air_at(t, p, o)
    x = loops(t, s, p, o, pressure)
    air = pressure * (p.moment * (s.alpha - p.trim_offset) + p.damping * s.alpha_rate / speed)
    return merged(
        State,
        x,
        alpha=s.alpha_rate,
        alpha_rate=air + x.torque_pitch * p.inverse_pitch,
        bank=s.bank_rate,
        bank_rate=pressure * p.roll_moment + x.torque_roll * p.inverse_roll,
        alpha_square=s.alpha * s.alpha,
        bank_square=x.bank_error * x.bank_error,
        impulse=abs(x.torque_pitch) + abs(x.torque_roll),
    )


@physics
def observe(t, s, p, o):
    """Outputs, SI and radians."""
    pressure, _ = air_at(t, p, o)
    x, command, alpha_size = loops(t, s, p, o, pressure), bank_command(t, p), abs(s.alpha)
    x = replace(x, bank_error=abs(x.bank_error))
    return merged(Outputs, s, x, bank_command=command, dynamic_pressure=pressure, alpha_size=alpha_size)


@physics
def evaluate(t, s):
    """Metrics, SI and radians; means over the flight from integrals of squares."""
    alpha, bank = sqrt(s.alpha_square / t), sqrt(s.bank_square / t)
    return merged(Metrics, s, alpha_rms=alpha, bank_rms=bank, limited_share=s.limited / t)


MODEL = model(
    name="reentry_autopilot",
    title="Attitude autopilot of an entering capsule",
    source="K. Ogata, Modern Control Engineering: lead compensation by the frequency-response approach",
    inputs=Inputs,
    states=State,
    outputs=Outputs,
    metrics=Metrics,
    clock=FixedStep("step", "duration"),
    kernel_parameters=prepared(prepare, Inputs),
    prepare=prepare,
    initial=initial,
    rhs=rhs,
    tables=autopilot_tables,
    observe=observe,
    evaluate=evaluate,
    figures=(
        HistoryFigure(("alpha_deg", "bank_deg", "bank_command_deg"), "Angle of attack error, bank and its command"),
        HistoryFigure(("dynamic_pressure_pa", "torque_pitch_n_m", "torque_roll_n_m"), "Dynamic pressure and torques"),
        ScatterFigure("peak_alpha_deg", "impulse_n_m_s", "Torque impulse and largest angle of attack error"),
    ),
)
