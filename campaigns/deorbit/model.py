"""The de-orbit model as the engine sees it: inputs, settings, design of each case, and the MODEL record."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from campaigns.deorbit import dynamics, outcome
from campaigns.deorbit.path_design import design_path, first_deviation, path_axes
from mc_engine.model import Event, FixedStep, Parameter, Refusals, Setting, inputs, model, prepared
from mc_engine.model.figures import HistoryFigure, MapFigure, ScatterFigure
from mc_engine.physics.constants import STANDARD_GRAVITY
from mc_engine.studies.published import read_published

BURN_POINT = Setting("descending", "crossing of orbit and path", choices=("descending", "ascending"))
Inputs = inputs(
    ve_pct=Parameter(0.0, "VE: error of the burn's magnitude", low=-100.0),
    oe_pct=Parameter(0.0, "OE: error of the burn's angle alpha, in percent of alpha itself"),
    out_of_plane_error_deg=Parameter(0.0, "burn direction out of the orbital plane", -90.0, 90.0),
    burn_delay_s=Parameter(0.0, "burn later than planned, on the same orbit"),
    initial_mass_kg=Parameter(100.0, "mass before the correction", low=1e-3),
    isp_s=Parameter(246.0, "specific impulse of the correction thrusters", low=1e-3),
    gain_1_s=Parameter(0.0175, "gain k of the law, critical damping", low=0.0, unit="1/s"),
    thrust_limit_n=Parameter(30.0, "capacity of the thrusters: limit when clipped, level when pulsed", low=1e-6),
    thrust_bias_pct=Parameter(0.0, "true over commanded thrust, less 1", low=-100.0),
    navigation_radial_position_error_m=Parameter(0.0, "constant position error, along the desired radius"),
    navigation_transverse_position_error_m=Parameter(0.0, "constant position error, along the desired motion"),
    navigation_normal_position_error_m=Parameter(0.0, "constant position error, along the orbit normal"),
    navigation_radial_velocity_error_m_s=Parameter(0.0, "constant velocity error, along the desired radius"),
    navigation_transverse_velocity_error_m_s=Parameter(0.0, "constant velocity error, along the desired motion"),
    navigation_normal_velocity_error_m_s=Parameter(0.0, "constant velocity error, along the orbit normal"),
    navigation_position_noise_m=Parameter(0.0, "1-sigma of the noise of each position component", low=0.0),
    navigation_velocity_noise_m_s=Parameter(0.0, "1-sigma of the noise of each velocity component", low=0.0),
    target_speed_m_s=Parameter(7800.0, "desired inertial speed at entry", low=1.0),
    target_flight_path_angle_deg=Parameter(2.0, "desired flight-path angle at entry, below the horizon", 0, 89),
    target_radius_km=Parameter(6491.0, "desired radius of entry", low=1.0),
    target_latitude_argument_deg=Parameter(60.0, "desired argument of latitude at entry"),
    initial_semi_major_axis_km=Parameter(6639.0, "radius of the circular initial orbit", low=1.0),
    inclination_deg=Parameter(55.5, "inclination of the orbit", 0.0, 180.0),
    ballistic_coefficient_kg_m2=Parameter(100.0, "mass over drag area, for drag", low=1e-6, unit="kg/m^2"),
    greenwich_angle_deg=Parameter(0.0, "right ascension of Greenwich, from the node, at the nominal burn"),
    modulator_input_gain=Parameter(3.0, "modulator gain on the command", low=0.0, unit=""),
    modulator_feedback_gain=Parameter(1.0, "modulator gain on the thruster's output", low=0.0, unit=""),
    modulator_time_constant_s=Parameter(57.62, "time constant of the modulator's lag", low=1e-6),
    modulator_on_n=Parameter(3.97, "lag output that switches the thruster on", low=0.0),
    modulator_off_n=Parameter(2.34, "lag output that switches the thruster off", low=0.0),
    control=dynamics.CONTROL,
    pulse_feed=dynamics.PULSE_FEED,
    j2=Setting(False, "oblateness disturbs the flight"),
    j2_feedforward=Setting(False, "the control law accounts for the oblateness"),
    drag=Setting(False, "drag disturbs the flight"),
    mass_model=dynamics.MASS_MODEL,
    burn_point=BURN_POINT,
    step_s=Setting(1.0, "integration step", low=1e-3, high=60.0),
    steps_per_fix=Setting(1.0, "integration steps between navigation fixes", low=1.0, high=1e6, whole=True, unit=""),
    time_limit_s=Setting(3000.0, "longest flight; a case that has not entered by then ends as no-stop", low=1.0),
)


def prepare(i: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Kernel parameters of each case: desired path, erroneous burn, first errors.

    i : inputs, float64[n] by symbol, SI;  settings : codes, float64[n], by symbol.  Refused cases join `refusals`.
    """
    refusals.add(i.modulator_on <= i.modulator_off, "modulator_on_n must be above modulator_off_n")
    path = design_path(i, settings.burn_point == BURN_POINT.code("ascending"), refusals)
    refusals.add(
        i.initial_semi_major_axis <= i.target_radius,
        "the initial orbit is not above the entry interface to come down to",
    )
    refusals.add(i.gain * settings.step > 0.3, "gain_1_s times step_s is above 0.3: the step is too long for the law")
    to_perigee, ahead = path_axes(path.omega, i.inclination)
    f_desired, deviation = first_deviation(path, i, to_perigee, ahead)
    return {
        **vars(i),
        **path._asdict(),
        **_by_axis("deviation_", deviation[0]),
        **_by_axis("deviation_v", deviation[1]),
        **_by_axis("p", to_perigee),
        **_by_axis("q", ahead),
        "f_desired": f_desired,
        "exhaust": i.isp * STANDARD_GRAVITY,
        "thrust_factor": 1.0 + i.thrust_bias,
        # above zero in the cases that navigate with any error at all; no unit, since metres and m/s are added
        "misled": sum(np.abs(error) for name, error in vars(i).items() if name.startswith("navigation_")),
    }


def _by_axis(name: str, vector: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{name}{axis}": row for axis, row in zip("xyz", vector, strict=True)}


MODEL = model(
    name="deorbit",
    title="Correction of a de-orbit burn by feedback linearization",
    source="S. Divsalar, R. Nadafi, M. Kabganian, Design of a trajectory-correction algorithm for a spacecraft in a "
    "de-orbit manoeuvre by the feedback-linearization method (in Persian), Electronics Industries Quarterly 7(1), 2016",
    inputs=Inputs,
    states=dynamics.State,
    outputs=outcome.Outputs,
    metrics=outcome.Metrics,
    clock=FixedStep("step", "time_limit", "steps_per_fix"),
    kernel_parameters=prepared(prepare, Inputs),
    prepare=prepare,
    initial=dynamics.initial,
    start=dynamics.start,
    rhs=dynamics.rhs,
    control=dynamics.fix_position,
    switch=dynamics.switch,
    events={
        "entry": Event(dynamics.entry, "falling", "stop"),
        "pulse_on": Event(dynamics.pulse_on, "rising", "switch", rare=True),
        "pulse_off": Event(dynamics.pulse_off, "falling", "switch", rare=True),
    },
    observe=outcome.observe,
    evaluate=outcome.evaluate,
    extrema=outcome.EXTREMA,
    figures=(
        MapFigure("propellant_kg", "ve_pct", "oe_pct", "Correction propellant over the errors of the burn"),
        MapFigure("correction_impulse_m_s", "ve_pct", "oe_pct", "Correction impulse over the errors of the burn"),
        MapFigure("entry_flight_path_angle_deg", "ve_pct", "oe_pct", "Entry angle over the errors of the burn"),
        HistoryFigure(("a_error_km", "e_error", "omega_error_deg"), "Errors of the elements"),
        HistoryFigure(("position_error_m", "velocity_error_m_s"), "Errors of position and velocity"),
        HistoryFigure(("force_n", "force_radial_n", "force_transverse_n"), "Correction force"),
        HistoryFigure(("impulse_m_s",), "Impulse spent"),
        ScatterFigure("entry_speed_m_s", "entry_flight_path_angle_deg", "Entry state"),
    ),
    published=read_published(Path(__file__).with_name("published.toml")),
)
