"""The de-orbit model as the engine sees it: inputs, settings, design of each case, and the MODEL record."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from campaigns.deorbit import dynamics, figures, outcome, path_design
from mc_engine.model import Event, Field, FixedStep, Model, Parameter, Refusals, Setting
from mc_engine.physics.constants import MU_EARTH, STANDARD_GRAVITY
from mc_engine.studies.published import read_published

SOURCE = (
    "S. Divsalar, R. Nadafi, M. Kabganian, Design of a trajectory-correction algorithm for a spacecraft in a "
    "de-orbit manoeuvre by the feedback-linearization method (in Persian), Electronics Industries Quarterly 7(1), 2016"
)

PARAMETERS = (
    Parameter("ve_pct", "%", "VE: error of the burn's magnitude", 0.0, low=-100.0),
    Parameter("oe_pct", "%", "OE: error of the burn's angle alpha, in percent of alpha itself", 0.0),
    Parameter("out_of_plane_error_deg", "deg", "burn direction out of the orbital plane", 0.0, -90.0, 90.0),
    Parameter("burn_delay_s", "s", "burn later than planned, on the same orbit", 0.0),
    Parameter("initial_mass_kg", "kg", "mass before the correction", 100.0, low=1e-3),
    Parameter("isp_s", "s", "specific impulse of the correction thrusters", 246.0, low=1e-3),
    Parameter("gain_1_s", "1/s", "gain k of the law, critical damping", 0.0175, low=0.0),
    Parameter(
        "thrust_limit_n", "N", "capacity of the thrusters: limit when clipped, level when pulsed", 30.0, low=1e-6
    ),
    Parameter("thrust_bias_pct", "%", "true thrust over the one asked for", 0.0, low=-100.0),
    Parameter("navigation_radial_position_error_m", "m", "constant position error, along the desired radius", 0.0),
    Parameter("navigation_transverse_position_error_m", "m", "constant position error, along the desired motion", 0.0),
    Parameter("navigation_normal_position_error_m", "m", "constant position error, along the orbit normal", 0.0),
    Parameter("navigation_radial_velocity_error_m_s", "m/s", "constant velocity error, along the desired radius", 0.0),
    Parameter(
        "navigation_transverse_velocity_error_m_s", "m/s", "constant velocity error, along the desired motion", 0.0
    ),
    Parameter("navigation_normal_velocity_error_m_s", "m/s", "constant velocity error, along the orbit normal", 0.0),
    Parameter("navigation_position_noise_m", "m", "1-sigma of a fresh error on each position component", 0.0, low=0.0),
    Parameter(
        "navigation_velocity_noise_m_s", "m/s", "1-sigma of a fresh error on each velocity component", 0.0, low=0.0
    ),
    Parameter("target_speed_m_s", "m/s", "desired inertial speed at entry", 7800.0, low=1.0),
    Parameter(
        "target_flight_path_angle_deg", "deg", "desired flight-path angle at entry, below the horizon", 2.0, 0, 89
    ),
    Parameter("target_radius_km", "km", "desired radius of entry", 6491.0, low=1.0),
    Parameter("target_latitude_argument_deg", "deg", "desired argument of latitude at entry", 60.0),
    Parameter("initial_semi_major_axis_km", "km", "radius of the circular initial orbit", 6639.0, low=1.0),
    Parameter("inclination_deg", "deg", "inclination of the orbit", 55.5, 0.0, 180.0),
    Parameter("ballistic_coefficient_kg_m2", "kg/m^2", "mass over drag area, for drag", 100.0, low=1e-6),
    Parameter("greenwich_angle_deg", "deg", "right ascension of Greenwich, from the node, at the nominal burn", 0.0),
    Parameter("modulator_input_gain", "", "modulator gain on the command", 3.0, low=0.0),
    Parameter("modulator_feedback_gain", "", "modulator gain on the thruster's output", 1.0, low=0.0),
    Parameter("modulator_time_constant_s", "s", "time constant of the modulator's lag", 57.62, low=1e-6),
    Parameter("modulator_on_n", "N", "lag output that switches the thruster on", 3.97, low=0.0),
    Parameter("modulator_off_n", "N", "lag output that switches it off again", 2.34, low=0.0),
)
_CONTROLS = ("continuous", "clipped", "pulsed", "off")
SETTINGS = (
    Setting("control", "", "how the commanded force is flown", "continuous", _CONTROLS),
    Setting("pulse_feed", "", "what feeds the modulator", "continuous", ("continuous", "closed_loop")),
    Setting("j2", "", "oblateness disturbs the flight", False),
    Setting("j2_feedforward", "", "the law knows of the oblateness", False),
    Setting("drag", "", "drag disturbs the flight", False),
    Setting("mass_model", "", "mass that turns force into acceleration", "constant", ("constant", "burning")),
    Setting("burn_point", "", "crossing of orbit and path", "descending", ("descending", "ascending")),
    Setting("step_s", "s", "integration step", 1.0, low=1e-3, high=60.0),
    Setting("steps_per_fix", "", "integration steps between navigation fixes", 1.0, low=1.0, high=1e6, whole=True),
    Setting(
        "time_limit_s", "s", "longest flight; a case that has not entered by then ends as no-stop", 3000.0, low=1.0
    ),
)
STATES = (
    *(Field(f"deviation_{axis}_m", "m", f"inertial position less the desired one, {axis}") for axis in "xyz"),
    *(Field(f"deviation_v{axis}_m_s", "m/s", f"inertial velocity less the desired one, {axis}") for axis in "xyz"),
    Field("f_desired_deg", "deg", "true anomaly on the desired path"),
    Field("impulse_m_s", "m/s", "impulse S per mass"),
    Field("filtered_n", "N", "output of the modulator's lag"),
)


def prepare(inputs: SimpleNamespace, settings: SimpleNamespace, refusals: Refusals) -> dict[str, np.ndarray]:
    """Kernel parameters of each case: desired path, erroneous burn, first errors.

    inputs : float64[n] by symbol, SI;  settings : codes, float64[n], by symbol.  Refused cases join `refusals`.
    """
    i = inputs
    refusals.add(i.modulator_on <= i.modulator_off, "modulator_on_n must be above modulator_off_n")
    path = path_design.design_path(
        i.initial_semi_major_axis,
        i.target_speed,
        i.target_flight_path_angle,
        i.target_radius,
        i.target_latitude_argument,
        settings.burn_point == 1.0,
        refusals,
    )
    refusals.add(
        i.initial_semi_major_axis <= i.target_radius,
        "the initial orbit is not above the entry interface to come down to",
    )
    refusals.add(i.gain * settings.step > 0.3, "gain_1_s times step_s is above 0.3: the step is too long for the law")
    to_perigee, ahead = _path_axes(path.omega, i.inclination)
    normal = np.cross(to_perigee, ahead, axis=0)
    # the burn happens `delay` after its time: the craft has gone on along the circle, its target along the path
    angle = path.f_burn + np.sqrt(MU_EARTH / i.initial_semi_major_axis**3) * i.burn_delay
    radial, transverse = _turned(to_perigee, ahead, angle)
    v = path_design.burnt_velocity(path, i.initial_semi_major_axis, i.ve, i.oe, i.out_of_plane_error)
    position = i.initial_semi_major_axis * radial
    velocity = v[0] * radial + v[1] * transverse + v[2] * normal
    mean = path_design.mean_anomaly(path.f_burn, path.e) + np.sqrt(MU_EARTH / path.a**3) * i.burn_delay
    on_time = i.burn_delay == 0.0
    f_desired = np.where(on_time, path.f_burn, path_design.true_anomaly(mean, path.e))
    wanted_position, wanted_velocity = _on_path(path, f_desired, to_perigee, ahead)
    deviation = (*(position - wanted_position), *(velocity - wanted_velocity))
    rows = dict(zip(("x", "y", "z", "vx", "vy", "vz"), deviation, strict=True))
    rows |= dict(zip(("px", "py", "pz", "qx", "qy", "qz"), (*to_perigee, *ahead), strict=True))
    rows |= {"f_desired": f_desired, "p": path.p, "a": path.a, "e": path.e, "omega": path.omega}
    rows |= {"theta_burn": path.theta_burn, "dv": path.dv, "alpha": path.alpha, "duration": path.flight_time()}
    return rows | _craft_rows(i)


def _craft_rows(i: SimpleNamespace) -> dict[str, np.ndarray]:
    """Parameters of the craft, its thrusters and its navigation, SI."""
    return {
        "gain": i.gain,
        "mass": i.initial_mass,
        "exhaust": i.isp * STANDARD_GRAVITY,
        "limit": i.thrust_limit,
        "thrust_factor": 1.0 + i.thrust_bias,
        "ballistic": i.ballistic_coefficient,
        "radius": i.target_radius,
        "delay": i.burn_delay,
        "greenwich": i.greenwich_angle,
        "misled": _misled(i),
        "bias_r": i.navigation_radial_position_error,
        "bias_t": i.navigation_transverse_position_error,
        "bias_n": i.navigation_normal_position_error,
        "bias_vr": i.navigation_radial_velocity_error,
        "bias_vt": i.navigation_transverse_velocity_error,
        "bias_vn": i.navigation_normal_velocity_error,
        "noise_position": i.navigation_position_noise,
        "noise_velocity": i.navigation_velocity_noise,
        "input_gain": i.modulator_input_gain,
        "feedback_gain": i.modulator_feedback_gain,
        "time_constant": i.modulator_time_constant,
        "on": i.modulator_on,
        "off": i.modulator_off,
    }


def _misled(i: SimpleNamespace) -> np.ndarray:
    """Above zero in the cases that navigate with any error at all; no unit, since metres and m/s are added."""
    names = [f"{axis}_{kind}" for axis in ("radial", "transverse", "normal") for kind in ("position", "velocity")]
    constant = sum(np.abs(getattr(i, f"navigation_{name}_error")) for name in names)
    return np.asarray(constant + i.navigation_position_noise + i.navigation_velocity_noise)


def _path_axes(omega, inclination):
    """Unit vectors [3, n] to the perigee and 90 degrees ahead of it: eq. (30) with the node on x."""
    s, c, zero = np.sin(omega), np.cos(omega), np.zeros_like(omega)
    node = np.array([np.ones_like(omega), zero, zero])
    across = np.array([zero, np.cos(inclination), np.sin(inclination)])
    return c * node + s * across, c * across - s * node


def _turned(to_perigee, ahead, angle):
    """Radial and transverse unit vectors [3, n] at a true anomaly."""
    s, c = np.sin(angle), np.cos(angle)
    return c * to_perigee + s * ahead, c * ahead - s * to_perigee


def _on_path(path: path_design.DeorbitPath, f, to_perigee, ahead):
    """Position [m] and velocity [m/s], [3, n], inertial, on the desired path at true anomaly f [rad].

    (31), (34), (37)
    """
    radial, transverse = _turned(to_perigee, ahead, f)
    root = np.sqrt(MU_EARTH / path.p)
    r = path.p / (1.0 + path.e * np.cos(f))
    return r * radial, root * path.e * np.sin(f) * radial + root * (1.0 + path.e * np.cos(f)) * transverse


MODEL = Model(
    name="deorbit",
    title="Correction of a de-orbit burn by feedback linearization",
    source=SOURCE,
    parameters=PARAMETERS,
    settings=SETTINGS,
    states=STATES,
    quantities=outcome.QUANTITIES,
    metrics=outcome.METRICS,
    clock=FixedStep("step", "time_limit", "steps_per_fix"),
    kernel_parameters=dynamics.Parameters,
    prepare=prepare,
    initial=dynamics.initial,
    start=dynamics.start,
    rhs=dynamics.rhs,
    control=dynamics.fix_position,
    events=dynamics.events,
    switch=dynamics.switch,
    event_list=(
        Event("entry", "falling", "stop"),
        Event("pulse_on", "rising", "switch", rare=True),
        Event("pulse_off", "falling", "switch", rare=True),
    ),
    observe=outcome.observe,
    evaluate=outcome.evaluate,
    extrema=outcome.EXTREMA,
    figures=figures.FIGURES,
    published=read_published(Path(__file__).with_name("published.toml")),
)
